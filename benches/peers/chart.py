"""One chart over all images: the path tracer's time over Blik's, by the error asked for."""

import io
import statistics

# images named beside their lines, the slowest ones
NAMED = 6
PANELS = [("ratio_true", "at equal true error"), ("ratio_asked", "at the error asked for")]


def draw(rows):
    """An SVG of two panels; a line for each image, their median, and the bar at 1."""
    import matplotlib

    matplotlib.use("svg")
    matplotlib.rcParams.update({"svg.fonttype": "none", "svg.hashsalt": "blik", "font.size": 9})
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(1, 2, figsize=(11, 5.5), sharey=True, layout="constrained")
    for axis, (key, title) in zip(axes, PANELS):
        panel(axis, [r for r in rows if r.get(key)], key)
        axis.set_title(f"Path tracer's processor seconds over Blik's, {title}")
    text = io.StringIO()
    figure.savefig(text, format="svg", metadata={"Date": None})
    pyplot.close(figure)
    return "\n".join(line.rstrip() for line in text.getvalue().splitlines()) + "\n"


def panel(axis, rows, key):
    names = sorted({r["image"] for r in rows}, key=lambda n: min(r[key] for r in rows if r["image"] == n))
    for index, name in enumerate(names):
        line = sorted((r["asked"], r[key]) for r in rows if r["image"] == name)
        behind = any(ratio < 1 for _, ratio in line)
        colour = "#c0392b" if behind else "#7f8c8d"
        axis.plot(*zip(*line), color=colour, linewidth=1.2 if behind else 0.7, alpha=0.8, marker=".", markersize=4)
        if index < NAMED:
            axis.annotate(name, line[0], xytext=(4, 0), textcoords="offset points", fontsize=7, color=colour)
    tolerances = sorted({r["asked"] for r in rows})
    medians = [statistics.median(r[key] for r in rows if r["asked"] == t) for t in tolerances]
    axis.plot(tolerances, medians, color="#1f4e9c", linewidth=2.5, label="median")
    axis.axhline(1.0, color="black", linewidth=1.0, linestyle="--", label="equal time")
    axis.set(xscale="log", yscale="log", xlabel="error asked for", xticks=tolerances)
    axis.set_xticklabels([f"{t:.0e}" for t in tolerances])
    axis.minorticks_off()
    axis.invert_xaxis()
    axis.grid(True, which="major", linewidth=0.4)
    axis.legend(loc="upper left")
