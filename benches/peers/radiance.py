"""Radiance's rtrace on the camera's rays of the scenes that it takes as they are: one band, uniform sky, facets alike."""

import subprocess
import time

import numpy as np

import images
import paths

# Images and divisions of its ambient calculation
SCENES = ["airplane_d0.1_s0.3_a", "corner_d0.4_s0_a"]
DIVISIONS = [128, 512]


class Radiance:
    """rtrace with its ambient cache."""

    def __init__(self, scene, hit, work):
        import pyradiance

        self.scene, self.work = scene, work
        assert pyradiance
        self.root = next((work / "venv" / "lib").glob("python*/site-packages/pyradiance"))
        d, s = scene.diffuse[0, 0], scene.specular[0, 0]
        head = f"void plastic m 0 0 5 {d} {d} {d} 0 0\n"
        if s:
            # the one material of it that is diffuse + mirror
            head = f"void BRTDfunc m 10 {s} {s} {s} 0 0 0 0 0 0 . 0 9 {d} {d} {d} 0 0 0 0 0 0\n"
        text = [head, "void glow g 0 0 4 1 1 1 0\ng source sky 0 0 4 0 0 1 360\n"]
        for i, facet in enumerate(scene.facets):
            corners = " ".join(f"{x:.9g}" for x in scene.vertices[facet].ravel())
            text.append(f"m polygon f{i} 0 0 9 {corners}\n")
        (work / "scene.rad").write_text("".join(text))
        made = [self.root / "bin/oconv", work / "scene.rad"]
        octree = subprocess.run(made, env=self.env(), capture_output=True, check=True)
        (work / "scene.oct").write_bytes(octree.stdout)
        rays = np.hstack([scene.origins[hit], scene.directions[hit]]).astype(np.float64)
        (work / "scene.rays").write_bytes(rays.tobytes())

    def env(self):
        return {"RAYPATH": f".:{self.root}/lib", "PATH": "/usr/bin:/bin"}

    def image(self, divisions):
        """Seconds and processor seconds of the program, with its octree made, and the object's pixels."""
        settings = f"-h -fdf -ab 5 -ad {divisions} -as {divisions // 4} -aa .1 -ar 512 -lw 1e-6 -lr 8 -n 2".split()
        start, before = time.perf_counter(), paths.processor()
        with (self.work / "scene.rays").open("rb") as rays:
            command = [self.root / "bin/rtrace", *settings, self.work / "scene.oct"]
            run = subprocess.run(command, stdin=rays, env=self.env(), capture_output=True, check=True)
        seconds = time.perf_counter() - start, paths.processor() - before
        return *seconds, np.frombuffer(run.stdout, np.float32).reshape(-1, 3)[:, :1]


def compare(blik, found, options):
    """The table: Radiance's error, and Blik's time for one that is no larger."""
    columns = "image, 2 threads | Radiance: -ad | error | processor s | Blik: tolerance | error | processor s | ratio"
    lines = [f"| {columns} |", "|" + "---|" * 8]
    for name in filter(found.get, SCENES):
        entry = images.Entry(blik, found[name], options)
        program = Radiance(entry.scene, entry.world.hit, options.work)
        for divisions in DIVISIONS[:1] if options.quick else DIVISIONS:
            _, seconds, values = program.image(divisions)
            error = entry.eps(values)[0]
            run = next((r for r in entry.runs() if r.shown <= error), None)
            own = f"{run.asked:.0e} | {run.shown:.1e} | {run.seconds:.3f} | {seconds / run.seconds:.1f}" if run else "| | |"
            lines.append(f"| {name} | {divisions} | {error:.1e} | {seconds:.2f} | {own} |")
    return "\n".join(lines) + "\n"
