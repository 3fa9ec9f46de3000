"""Runs Blik and other programs in turn on the same work and prints tables of times and ratios (Markdown).

Started by `run` beside this file, which installs what it needs.
"""

import argparse
import datetime
import json
import os
import pathlib
import platform
import re
import select
import statistics
import subprocess
import sys

import factors
import images
import radiance
import rays

ROOT = pathlib.Path(__file__).resolve().parents[2]


class Blik:
    """Blik's program: a line in, a line of JSON out."""

    def __init__(self, program):
        self.program = program
        self.start()

    def start(self):
        pipe = subprocess.PIPE
        self.process = subprocess.Popen([self.program], stdin=pipe, stdout=pipe, text=True)

    def __call__(self, *words, seconds=None):
        """The answer; None where it takes longer than `seconds`."""
        self.process.stdin.write(" ".join(map(str, words)) + "\n")
        self.process.stdin.flush()
        if seconds and not select.select([self.process.stdout], [], [], seconds)[0]:
            self.process.kill()
            self.process.wait()
            self.start()
            return None
        answer = json.loads(self.process.stdout.readline())
        if "error" in answer:
            sys.exit(f"blik: {answer['error']}")
        return answer


def references():
    """Scene file of each reference by its name: the project's own, then those of BLIK_REFERENCES."""
    folders = [ROOT / "tests/data/references"]
    if "BLIK_REFERENCES" in os.environ:
        folders.append(pathlib.Path(os.environ["BLIK_REFERENCES"]))
    return {path.stem: path for folder in reversed(folders) for path in folder.glob("*.toml")}


def machine():
    """One line: date, processor, threads, system."""
    text = pathlib.Path("/proc/cpuinfo").read_text()
    name = re.search(r"model name\s*: (.*)", text)
    commit = subprocess.run(["git", "rev-parse", "--short", "HEAD"], cwd=ROOT, capture_output=True, text=True)
    wide = "AVX-512" if "avx512f" in text else "AVX2" if "avx2" in text else "SSE"
    return (
        f"{datetime.date.today()}, {name.group(1) if name else platform.processor()} ({os.cpu_count()} cores, {wide}), "
        f"{platform.freedesktop_os_release()['PRETTY_NAME']}, commit {commit.stdout.strip()}, "
        f"load before the run {os.getloadavg()[0]:.1f}"
    )


def again(blik, found, quick):
    """What a solved airplane costs again."""
    scene = "airplane_d0.1_s0.3_a"
    if scene not in found:
        return f"(no {scene}: name its folder with BLIK_REFERENCES)\n"
    blik("open", found[scene])
    answers = [blik("again", 2e-3, 3 if quick else 11) for _ in range(1 if quick else 3)]
    of = lambda key: statistics.median(a[key] for a in answers)
    rows = [
        ("new view, 256 x 256", "new_view", 1e3, "ms"),
        ("new view, 512 x 512", "new_view_512", 1e3, "ms"),
        ("new sky, all facets", "new_sky", 1e3, "ms"),
        ("new sky and sun, all facets", "new_sun", 1e3, "ms"),
        ("light curve of 1,000 directions", "light_curve", 1.0, "s"),
        ("bytes stored for new light", "stored_bytes", 2.0**-20, "MiB"),
    ]
    lines = [f"| {name} | {of(key) * by:.2f} {unit} |" for name, key, by, unit in rows]
    return "\n".join([f"| {scene}, tolerance 2e-3 | Blik |", "|---|---|", *lines]) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--blik", required=True)
    parser.add_argument("--work", type=pathlib.Path, required=True)
    parser.add_argument("--only", choices=["images", "radiance", "again", "rays", "factors"])
    parser.add_argument("--images", type=lambda t: t.split(","), help="only images whose names begin so")
    parser.add_argument("--seed", type=int, default=1, help="other generated scenes")
    parser.add_argument("--tolerances", type=lambda t: [float(x) for x in t.split(",")], default=images.TOLERANCES)
    parser.add_argument("--folder", type=pathlib.Path, help="where images.csv and images.svg go")
    parser.add_argument("--quick", action="store_true", help="fewer runs, scenes and sizes")
    parser.add_argument("--out", type=pathlib.Path, help="append the tables to this file, too")
    options = parser.parse_args()
    options.folder = options.folder or options.work
    blik, found = Blik(options.blik), references()
    parts = {
        "images": lambda: images.compare(blik, found, options),
        "radiance": lambda: radiance.compare(blik, found, options),
        "again": lambda: again(blik, found, options.quick),
        "rays": lambda: rays.compare(blik, found, options),
        "factors": lambda: factors.compare(blik, options),
    }

    def say(text):
        print(text, flush=True)
        if options.out:
            with options.out.open("a") as file:
                print(text, file=file)

    say(machine() + "\n")
    for name, part in parts.items():
        if options.only in (None, name):
            say(part())


main()
