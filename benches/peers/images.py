"""Error against processor seconds, Blik and a path tracer on Mitsuba, over references and generated scenes."""

import csv
import dataclasses
import math
import statistics

import numpy as np

import chart
import paths
import scene

TOLERANCES = [1e-2, 5e-3, 2e-3, 5e-4, 2e-4]
# no finer run of Blik after one of so many processor seconds
LONGEST, LONGEST_QUICK = 20.0, 6.0
# runs of Blik of which the quickest counts, while they take less than a second together
REPEATED = 5
# Samples of a pixel for the path tracer, as long as one image takes less than these processor seconds
SAMPLES = [4, 16, 64, 256, 1024]
DEAREST, DEAREST_QUICK = 6.0, 1.5
# The truth: standard error of eps_c wanted, and rays after which it is good enough
TRUTH, TRUTH_QUICK = (1e-4, 400_000_000), (4e-4, 30_000_000)
# Reference images of the quick form, beside one generated scene in so many
FEW = ["airplane_d0.4_s0_b", "airplane_d0.4_s0_csun", "corner_d0.4_s0_a", "cylinders_d0.3_s0.1_a", "mirror_box_mirror_a"]
EVERY = 3


@dataclasses.dataclass
class Run:
    """Blik's image at a tolerance."""

    asked: float
    seconds: float
    estimate: float
    met: bool
    true: float
    noise: float
    mib: float

    @property
    def shown(self):
        """The true error, or the least that the truth shows."""
        return max(self.true, self.noise)


class Curve:
    """The path tracer's processor seconds for an error, between and beyond those measured."""

    def __init__(self, world, dearest):
        self.points = []
        for samples in SAMPLES:
            (a, first), (b, second) = world.image(samples), world.image(samples)
            # two independent images: their difference holds the errors of both and no truth is needed
            error = np.sqrt(((a - b) ** 2).mean(0) / 2)
            self.points.append((samples, float((error / world.reference).max()), min(first, second)))
            self.mean = (a + b) / 2
            if first > dearest:
                break

    def seconds(self, error):
        """Seconds for an error: along the measured points, beyond them by its inverse square."""
        points = [(math.log(e), math.log(max(s, 1e-6))) for _, e, s in self.points if e > 0]
        if not points:
            return 0.0
        x = math.log(error)
        if x >= points[0][0] or len(points) == 1:
            at = points[0]
        elif x <= points[-1][0]:
            at = points[-1]
        else:
            pairs = zip(points, points[1:])
            (x0, y0), (x1, y1) = next(p for p in pairs if p[0][0] >= x >= p[1][0])
            return math.exp(y0 + (y1 - y0) * (x - x0) / (x1 - x0))
        return math.exp(at[1] - 2.0 * (x - at[0]))


class Entry:
    """An image with both programs' measurements."""

    def __init__(self, blik, path, options):
        self.blik, self.path, self.options = blik, path, options
        self.scene = scene.Scene(path)
        self.truth = self.known_truth()
        self.world = paths.World(self.scene)

    def known_truth(self):
        """The judge's image, from its file or computed and kept."""
        goal, rays = TRUTH_QUICK if self.options.quick else TRUTH
        folder = self.options.work / "truth"
        folder.mkdir(exist_ok=True)
        key = scene.digest(self.scene.files)
        best = folder / f"{self.scene.name}_{key}.npy"
        quick = folder / f"{self.scene.name}_{key}_quick.npy"
        if self.options.quick and not best.exists():
            best = quick
        if not best.exists():
            self.blik("open", self.path)
            self.blik("truth", goal, rays, best)
        return scene.Truth(self.scene, np.load(best))

    def eps(self, values):
        """True error of the object's pixels, and its standard error."""
        image = np.zeros((self.world.hit.size, self.scene.bands))
        image[self.world.hit] = values
        return self.truth.eps(image)

    def runs(self):
        """Blik's runs from coarse to fine."""
        out, runs = self.options.work / "image.f32", []
        self.blik("open", self.path)
        longest = LONGEST_QUICK if self.options.quick else LONGEST
        for tolerance in self.options.tolerances:
            seconds = []
            while len(seconds) < REPEATED and (not seconds or sum(seconds) + seconds[-1] < 1.0):
                answer = self.blik("cold", tolerance, out, seconds=4 * longest)
                if answer is None:
                    return runs
                seconds.append(answer["processor"])
            pixels = np.fromfile(out, np.float32).reshape(-1, self.scene.bands).astype(float)
            true, spread = self.truth.eps(pixels)
            noise = self.truth.noise() if true < 2 * spread else 0.0
            runs.append(Run(tolerance, min(seconds), answer["estimate"], answer["met"], true, noise, answer["bytes"] / 2**20))
            if runs[-1].seconds > longest:
                break
        return runs

    def rows(self):
        """One row for each tolerance."""
        dearest = DEAREST_QUICK if self.options.quick else DEAREST
        self.world.image(4)  # compiles
        curve = Curve(self.world, dearest)
        self.agreement = self.eps(curve.mean)[0] / max(curve.points[-1][1] / math.sqrt(2), 1e-30)
        runs, able = {r.asked: r for r in self.runs()}, self.scene.computable()
        for asked in self.options.tolerances:
            run = runs.get(asked)
            row = {"image": self.scene.name, "light": self.scene.light(), "facets": len(self.scene.facets), "asked": asked}
            row["peer_s_asked"] = curve.seconds(asked) if able else None
            if run:
                row |= {"estimate": run.estimate, "true": run.true, "noise": run.noise, "s": run.seconds, "mib": run.mib}
                row |= {"met": int(run.met), "peer_s_true": curve.seconds(run.shown) if able else None}
                for key in ("asked", "true"):
                    row[f"ratio_{key}"] = row[f"peer_s_{key}"] / run.seconds if able else None
            yield row


COLUMNS = [
    "image", "light", "facets", "asked", "estimate", "true", "noise", "met", "s", "mib", "peer_s_true", "peer_s_asked",
    "ratio_true", "ratio_asked",
]  # fmt: skip


def compare(blik, found, options):
    """Measures all images; writes images.csv and images.svg beside the table."""
    rows = []
    for name in sorted(chosen(blik, found, options)):
        entry = Entry(blik, found[name], options)
        rows += entry.rows()
        own = [f"{r['s']:.2f}" for r in rows if r["image"] == name and "s" in r]
        print(f"{name}: {', '.join(own)} s; path tracer off the truth by {entry.agreement:.2f} of its own error", flush=True)
    folder = options.folder
    with (folder / "images.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        short = lambda v: f"{v:.3g}" if isinstance(v, float) else v
        writer.writerows({k: short(v) for k, v in row.items()} for row in rows)
    (folder / "images.svg").write_text(chart.draw(rows))
    return table(rows) + "\n" + summary(rows)


def chosen(blik, found, options):
    """Names of the images; generated ones are drawn into the work folder."""
    names = set(FEW if options.quick else found) & set(found)
    folder = options.work / "scenes"
    for kind in blik("kinds")[:: EVERY if options.quick else 1]:
        name = blik("draw", kind, options.seed, folder)["name"]
        found[name] = folder / f"{name}.toml"
        names.add(name)
    return [n for n in names if not options.images or any(n.startswith(i) for i in options.images)]


def number(value, form):
    return "" if value is None else format(value, form)


def table(rows):
    """All rows in Markdown, the worst image at the error asked for first."""
    worst = lambda name: min((r["ratio_asked"] for r in rows if r["image"] == name and r.get("ratio_asked")), default=math.inf)
    head = "image | light | facets | asked | estimate | true | Blik s | MiB | peer s, true | peer s, asked | equal | asked"
    lines = [f"| {head} |", "|" + "---|" * 12]
    for row in sorted(rows, key=lambda r: (worst(r["image"]), r["image"], -r["asked"])):
        first = row["asked"] == max(r["asked"] for r in rows if r["image"] == row["image"])
        lines.append("| " + " | ".join(cells(row, first)) + " |")
    return "\n".join(lines) + "\n"


def cells(row, first):
    head = [row["image"], row["light"], str(row["facets"])] if first else ["", "", ""]
    if "s" not in row:
        return [*head, f"{row['asked']:.0e}", "not run", "", "", "", "", number(row["peer_s_asked"], ".2f"), "", ""]
    true = f"{row['true']:.1e}" if not row["noise"] else f"< {row['noise']:.1e}"
    ratios = [number(row[k], ".2g") for k in ("ratio_true", "ratio_asked")]
    ratios = [f"**{r}**" if r and float(r) < 1 else r for r in ratios]
    estimate = f"{row['estimate']:.1e}" + ("" if row["met"] else " (not met)")
    seconds = [number(row[k], ".3g") for k in ("s", "mib", "peer_s_true", "peer_s_asked")]
    return [*head, f"{row['asked']:.0e}", estimate, true, *seconds, *ratios]


def summary(rows):
    """Per tolerance: where Blik is ahead, medians, and how well its estimates tell the truth."""
    head = "asked | images | ahead at equal error | ahead at the error asked for | worst, median ratio at equal error | the same at the error asked for | true <= estimate | estimate <= 2 x true | true in 0.4 to 1 of asked | above asked | not run"
    lines = [f"| {head} |", "|" + "---|" * 11]
    for asked in sorted({r["asked"] for r in rows}, reverse=True):
        here = [r for r in rows if r["asked"] == asked]
        ran = [r for r in here if "s" in r]
        cells = [f"{asked:.0e}", str(len(ran))]
        for key in ("ratio_true", "ratio_asked"):
            values = [r[key] for r in ran if r[key] is not None]
            cells.append(f"{sum(v > 1 for v in values)} of {len(values)}")
        for key in ("ratio_true", "ratio_asked"):
            values = [r[key] for r in ran if r[key] is not None]
            cells.append(f"{min(values):.2g}, {statistics.median(values):.2g}" if values else "")
        seen = [r for r in ran if not r["noise"]]
        share = lambda some, of: f"{sum(map(of, some))} of {len(some)}"
        cells += [
            share(ran, lambda r: r["true"] <= r["estimate"]),
            share(seen, lambda r: r["estimate"] <= 2 * r["true"]),
            share(ran, lambda r: 0.4 * asked <= r["true"] <= asked),
            share(ran, lambda r: r["true"] > asked),
            str(len(here) - len(ran)),
        ]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"
