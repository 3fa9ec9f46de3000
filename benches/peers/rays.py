"""Rays per second on one thread: Embree on the rays that Blik writes out."""

import json
import statistics
import subprocess

SCENES = ["airplane_d0.1_s0.3_a", "cylinders_d0.3_s0.1_a", "corner_d0.4_s0_a", "bowl_100k_d0.1_s0.3_a"]


def compare(blik, found, options):
    """A table of Mray/s and of Blik's over Embree's."""
    lines = [
        "| rays, one thread | Blik closest | Embree single / packet 16 | ratio to single | Blik any | "
        "Embree single / packet 16 | ratio to packet |",
        "|---|---|---|---|---|---|---|",
    ]
    folder = options.work / "rays"
    folder.mkdir(exist_ok=True)
    for scene in filter(found.get, SCENES[:2] if options.quick else SCENES):
        blik("open", found[scene])
        for kind in ["primary", "hemisphere"]:
            own, theirs = [], []
            for _ in range(1 if options.quick else 3):
                own.append(blik("rays", kind, folder))
                run = subprocess.run([options.work / "embree", folder], capture_output=True, text=True, check=True)
                theirs.append(json.loads(run.stdout))
            off = abs(own[0]["hits"] - theirs[0]["hits"]) / max(1, theirs[0]["hits"])
            assert off < 1e-3, f"{scene}: {own[0]['hits']} hits, Embree {theirs[0]['hits']}"
            ours = lambda key: statistics.median(r[key] for r in own)
            peer = lambda key: statistics.median(r[key] for r in theirs)
            ratio = lambda a, b: statistics.median(o[a] / t[b] for o, t in zip(own, theirs))
            lines.append(
                f"| {scene.split('_d')[0]}, {kind} | {ours('closest'):.1f} | "
                f"{peer('closest'):.1f} / {peer('closest16'):.1f} | {ratio('closest', 'closest'):.2f} | "
                f"{ours('any'):.1f} | {peer('any'):.1f} / {peer('any16'):.1f} | {ratio('any', 'any16'):.2f} |"
            )
    return "\n".join(lines) + "\n"
