"""Form factors of all pairs of a corner's quads, one thread: pyviewfactor, and View3D where there is one."""

import os
import pathlib
import re
import resource
import statistics
import subprocess
import time

import numpy as np

os.environ["NUMBA_NUM_THREADS"] = "1"


def corner(n):
    """Corners of the n x n quads of three unit squares that face the octant x, y, z > 0, in Blik's order."""
    walls = [((1, 0, 0), (0, 1, 0)), ((0, 1, 0), (0, 0, 1)), ((0, 0, 1), (1, 0, 0))]
    quads = []
    for a, b in np.array(walls, float):
        for i in range(n):
            for j in range(n):
                quads.append([(a * (i + p) + b * (j + q)) / n for p, q in [(0, 0), (1, 0), (1, 1), (0, 1)]])
    return np.array(quads)


def pyviewfactor(quads):
    """Processor seconds and row sums."""
    import pyvista
    from pyviewfactor import compute_viewfactor_matrix

    count = len(quads)
    faces = np.hstack([np.full((count, 1), 4), np.arange(4 * count).reshape(count, 4)])
    mesh = pyvista.PolyData(quads.reshape(-1, 3), faces.ravel())
    start = time.process_time()
    matrix = compute_viewfactor_matrix(mesh, skip_obstruction=True)
    return time.process_time() - start, matrix.sum(axis=0)


def processor_of_children():
    """Processor seconds of the programs that have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def view3d(quads, folder):
    """Processor seconds of the program's own run, reading and writing included, row sums, and the seconds that it says
    it has computed for."""
    lines = ["T corner", "F 3", "C encl=0 list=0 eps=1e-4"]
    lines += [f"V {i + 1} {x:.9g} {y:.9g} {z:.9g}" for i, (x, y, z) in enumerate(quads.reshape(-1, 3))]
    for i in range(len(quads)):
        corners = " ".join(str(4 * i + k + 1) for k in range(4))
        lines.append(f"S {i + 1} {corners} 0 0 0.5 s{i + 1}")
    (folder / "corner.vs3").write_text("\n".join([*lines, "End of data", ""]))
    before = processor_of_children()
    run = [pathlib.Path(os.environ["VIEW3D"]).resolve(), "corner.vs3", "corner.out"]
    piped = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
    said = subprocess.run(run, cwd=folder, check=True, **piped).stdout
    seconds = processor_of_children() - before
    # a title, the areas, then the matrix
    rows = (folder / "corner.out").read_text().splitlines()[2 : 2 + len(quads)]
    sums = np.array([sum(map(float, row.split())) for row in rows])
    return seconds, sums, float(re.search(r"([\d.e+-]+) seconds to compute view factors", said).group(1))


def compare(blik, options):
    """A table of processor seconds, of the worst error of a row sum, and of their time over Blik's."""
    lines = ["| form factors, one thread | Blik, CPU s | row sums | program | CPU s | row sums | ratio |", "|---|---|---|---|---|---|---|"]
    folder = pathlib.Path(options.work / "factors")
    folder.mkdir(exist_ok=True)
    peers = {"pyviewfactor": pyviewfactor}
    if "VIEW3D" in os.environ:
        peers["View3D"] = lambda quads: view3d(quads, folder)
    pyviewfactor(corner(2))  # its first call compiles
    for n in [8] if options.quick else [8, 16, 32]:
        quads = corner(n)
        for name, peer in peers.items():
            if name == "pyviewfactor" and n > 16:
                continue  # minutes
            own, theirs = [], []
            for _ in range(3):
                own.append(blik("factors", len(quads), 5))
                theirs.append(peer(quads))
            exact = np.array(own[0]["row_sums"])
            off = np.abs(theirs[0][1] - exact).max()
            ours = statistics.median(o["processor"] for o in own)
            for part, what in [(0, name), (2, f"{name}, without reading and writing")]:
                if part >= len(theirs[0]):
                    continue
                seconds = statistics.median(t[part] for t in theirs)
                if part == 2 and seconds < 0.1:
                    continue  # it says hundredths
                lines.append(
                    f"| {len(quads)} quads | {ours:.4f} | {own[0]['row_defect']:.0e} | {what} | {seconds:.3f} | "
                    f"{off:.0e} | {seconds / ours:.1f} |"
                )
    if "VIEW3D" not in os.environ:
        lines.append("\n(View3D: no package has it; VIEW3D=PROGRAM names one.)")
    return "\n".join(lines) + "\n"
