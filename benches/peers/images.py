"""Seconds to an image of equal error: Mitsuba 3 and Radiance on the same meshes and camera rays."""

import copy
import csv
import math
import os
import statistics
import subprocess
import time
import tomllib

import numpy as np

SCENES = ["airplane_d0.1_s0.3_a", "corner_d0.4_s0_a"]
GOALS = {"airplane_d0.1_s0.3_a": [1.35e-3, 3e-4, 1e-4], "corner_d0.4_s0_a": [2e-3, 5e-4]}
TOLERANCES = [2e-2, 1e-2, 5e-3, 3e-3, 2e-3, 1.4e-3, 1e-3, 7e-4, 5e-4, 3e-4, 2e-4, 1e-4]
# Pixels of references of our own where the given ones do not show an error, and samples of each: a standard error of some
# 2.5e-5 on the aircraft
FINE_PIXELS, FINE_SAMPLES = 2048, 1 << 20
# no finer run of Blik after one of so many processor seconds: the next takes several times as long
LONGEST = 30.0


class Scene:
    """A scene file with its mesh, reference and camera rays."""

    def __init__(self, folder, name):
        self.name, self.path = name, folder / f"{name}.toml"
        file = tomllib.loads(self.path.read_text())
        material, camera = file["material"]["default"], file["camera"]
        self.diffuse, self.specular = material["diffuse"], material["specular"]
        assert file["sky"]["model"] == "uniform" and "sun" not in file and camera["kind"] == "orthographic"
        vertices, facets = [], []
        for line in (folder / file["mesh"]["file"]).read_text().splitlines():
            words = line.split()
            if words[:1] == ["v"]:
                vertices.append([float(w) for w in words[1:4]])
            elif words[:1] == ["f"]:
                corners = [int(w.split("/")[0]) - 1 for w in words[1:]]
                facets += [[corners[0], b, c] for b, c in zip(corners[1:], corners[2:])]
        self.vertices, self.facets = np.array(vertices), np.array(facets)
        masks = np.load(next(folder.glob(f"{name.split('_d')[0]}_masks.npz")))
        self.counted = masks["hit"] & ~masks["disputed"]
        self.hit = masks["hit"]
        self.reference = np.load(folder / f"{name}.npy").reshape(self.hit.shape)
        rows = csv.DictReader((folder / "index.csv").open())
        errors = {r["id"]: float(r["reference_standard_error"]) for r in rows if r["kind"] == "image"}
        self.noise = errors[name]
        self.fine = None
        self.rays(camera)

    def rays(self, camera):
        """Origins through the centres of the pixels that meet the object, and the common direction."""
        eye, target, up = (np.array(camera[k], float) for k in ("eye", "target", "up"))
        unit = lambda v: v / np.linalg.norm(v)
        self.forward = unit(target - eye)
        right = unit(np.cross(self.forward, up))
        up = np.cross(right, self.forward)
        columns, rows = camera["resolution"]
        i, j = np.nonzero(self.hit)
        x = ((j + 0.5) / columns - 0.5) * camera["height"] * columns / rows
        y = (0.5 - (i + 0.5) / rows) * camera["height"]
        self.origins = eye + x[:, None] * right + y[:, None] * up

    def eps(self, values):
        """eps_c of an image given by its object pixels, or None where the references' noise hides it."""
        image = np.zeros(self.hit.shape)
        image[self.hit] = values
        error = shown((image - self.reference)[self.counted], self.noise)
        if error is None and self.fine:
            pixels, reference, noise = self.fine
            error = shown(np.asarray(values)[pixels] - reference, noise)
        return error

    def refine(self, work):
        """Makes a finer reference of some pixels, with Mitsuba, and keeps it in the work folder."""
        file = work / f"{self.name}_fine.npz"
        if not file.exists():
            # spread over the object; numbers in the order of its pixels
            counted = np.flatnonzero(self.counted[self.hit])
            pixels = np.unique(counted[np.linspace(0, len(counted) - 1, FINE_PIXELS).astype(int)])
            subset = copy.copy(self)
            subset.origins = self.origins[pixels]
            passes = list(Mitsuba(subset).passes(FINE_SAMPLES))
            error2 = np.mean(np.var(passes, axis=0, ddof=1)) / len(passes)
            np.savez(file, pixels=pixels, values=np.mean(passes, axis=0), noise=math.sqrt(error2))
        kept = np.load(file)
        self.fine = kept["pixels"], kept["values"], float(kept["noise"])


def shown(differences, noise):
    """Rms of differences without the reference's noise, or None where that hides it."""
    corrected = math.sqrt(max(0.0, np.mean(differences**2) - noise**2))
    return corrected if corrected >= 0.5 * noise else None


def processor():
    """Computing time of this process and of those that it has waited for."""
    return sum(os.times()[:4])


class Mitsuba:
    """Path tracing of the object's pixels: the sky is met by the surfaces' own sampling."""

    def __init__(self, scene):
        import drjit as dr
        import mitsuba as mi

        if mi.variant() is None:
            mi.set_variant("llvm_ad_mono")
            dr.set_thread_count(2)
        self.scene, self.dr, self.mi = scene, dr, mi
        total = scene.diffuse + scene.specular
        share = scene.specular / total
        diffuse = {"type": "diffuse", "reflectance": {"type": "spectrum", "value": total}}
        mirror = {"type": "conductor", "material": "none", "specular_reflectance": {"type": "spectrum", "value": total}}
        bsdf = {"type": "blendbsdf", "weight": share, "a": diffuse, "b": mirror} if share else diffuse
        props = mi.Properties()
        props["bsdf"] = mi.load_dict(bsdf)
        mesh = mi.Mesh("mesh", len(scene.vertices), len(scene.facets), props=props)
        params = mi.traverse(mesh)
        # every facet with vertices of its own is flat: no normals are interpolated
        params["vertex_positions"] = mi.Float(scene.vertices.ravel())
        params["faces"] = mi.UInt32(scene.facets.ravel())
        params.update()
        self.world = mi.load_dict({"type": "scene", "mesh": mesh})
        self.sampler = mi.load_dict({"type": "multijitter"})
        self.origins = mi.Point3f(scene.origins.T)
        self.seed = 0

    def image(self, samples):
        """Seconds, the object's pixels and processor seconds; the scene is in memory. Samples: a square number."""
        start, before = time.perf_counter(), processor()
        total, count = 0.0, 0
        for values in self.passes(samples):
            total, count = total + values, count + 1
        return time.perf_counter() - start, total / count, processor() - before

    def passes(self, samples):
        """The pixels of one image after the other, which have so many samples together."""
        # so many rays at once fit into the memory of a small machine
        side = math.isqrt(min(samples, (1 << 23) // len(self.scene.origins)))
        for _ in range(round(samples / side**2)):
            self.seed += 1
            yield np.array(self.paths(side**2, self.seed))

    def paths(self, samples, seed):
        dr, mi = self.dr, self.mi
        count = len(self.scene.origins) * samples
        sampler = self.sampler.clone()
        sampler.set_sample_count(samples)
        sampler.set_samples_per_wavefront(samples)
        sampler.seed(seed, count)
        origin = dr.gather(mi.Point3f, self.origins, dr.arange(mi.UInt32, count) // samples)
        ray = mi.Ray3f(origin, mi.Vector3f(*map(float, self.scene.forward)))
        return dr.block_sum(trace(dr, mi, self.world, sampler, ray), samples) / samples


def _trace():
    import drjit as dr

    @dr.syntax
    def trace(dr, mi, world, sampler, ray):
        context = mi.BSDFContext()
        radiance, weight = mi.Float(0), mi.Float(1)
        active, depth = mi.Bool(True), mi.UInt32(0)
        while active:
            hit = world.ray_intersect(ray, active)
            out = active & ~hit.is_valid()
            radiance += dr.select(out, weight, 0)
            active &= hit.is_valid()
            sample, value = hit.bsdf(ray).sample(
                context, hit, sampler.next_1d(active), sampler.next_2d(active), active
            )
            weight *= value[0]
            ray = hit.spawn_ray(hit.to_world(sample.wo))
            depth += 1
            active &= weight > 0
            # Russian roulette from the fifth reflection on, as the stock integrator does
            survive = dr.minimum(weight, 0.95)
            late = depth >= 5
            active &= ~late | (sampler.next_1d(active) < survive)
            weight = dr.select(late, weight / survive, weight)
        return radiance

    return trace


def trace(*arguments):
    """One path for each ray; compiled once."""
    global _compiled
    if _compiled is None:
        _compiled = _trace()
    return _compiled(*arguments)


_compiled = None


class Radiance:
    """rtrace with its ambient cache, on the same rays."""

    def __init__(self, scene, work):
        import pyradiance

        self.scene, self.work = scene, work
        root = work / "venv" / "lib"
        self.root = next(root.glob("python*/site-packages/pyradiance"))
        assert pyradiance
        d, s = scene.diffuse, scene.specular
        head = f"void plastic m 0 0 5 {d} {d} {d} 0 0\n"
        if s:
            # the one material of it that is diffuse + mirror
            head = f"void BRTDfunc m 10 {s} {s} {s} 0 0 0 0 0 0 . 0 9 {d} {d} {d} 0 0 0 0 0 0\n"
        text = [head, "void glow g 0 0 4 1 1 1 0\ng source sky 0 0 4 0 0 1 360\n"]
        for i, facet in enumerate(scene.facets):
            corners = " ".join(f"{x:.9g}" for x in scene.vertices[facet].ravel())
            text.append(f"m polygon f{i} 0 0 9 {corners}\n")
        (work / "scene.rad").write_text("".join(text))
        octree = subprocess.run([self.root / "bin/oconv", work / "scene.rad"], env=self.env(), capture_output=True, check=True)
        (work / "scene.oct").write_bytes(octree.stdout)
        forward = np.broadcast_to(scene.forward, scene.origins.shape)
        (work / "scene.rays").write_bytes(np.hstack([scene.origins, forward]).astype(np.float64).tobytes())

    def env(self):
        return {"RAYPATH": f".:{self.root}/lib", "PATH": "/usr/bin:/bin"}

    def image(self, divisions):
        """Seconds and processor seconds of the program, with its octree made, and the object's pixels."""
        settings = f"-h -fdf -ab 5 -ad {divisions} -as {divisions // 4} -aa .1 -ar 512 -lw 1e-6 -lr 8 -n 2".split()
        start, before = time.perf_counter(), processor()
        with (self.work / "scene.rays").open("rb") as rays:
            command = [self.root / "bin/rtrace", *settings, self.work / "scene.oct"]
            run = subprocess.run(command, stdin=rays, env=self.env(), capture_output=True, check=True)
        seconds = time.perf_counter() - start, processor() - before
        return *seconds, np.frombuffer(run.stdout, np.float32).reshape(-1, 3)[:, 0]


def blik_runs(blik, scene, options):
    """(tolerance, seconds, error, whether it is the true one, processor seconds) from coarse to fine; where the
    reference does not show the error it is the estimate."""
    out, runs = options.work / "image.f32", []
    blik("open", scene.path)
    for tolerance in TOLERANCES:
        answer = blik("cold", tolerance, out)
        pixels = np.fromfile(out, np.float32).reshape(scene.hit.shape)[scene.hit]
        true = scene.eps(pixels)
        error = true or answer["estimate"]
        runs.append((tolerance, answer["seconds"], error, true is not None, answer["processor"]))
        if answer["processor"] > LONGEST:
            break
    return runs


def first(runs, goal):
    """The quickest run that reaches the goal."""
    return min((r for r in runs if r[2] <= goal), key=lambda r: r[4], default=None)


def in_turn(blik, mitsuba, tolerance, samples, work, runs):
    """Median (seconds, processor seconds) of both, a run of each in turn."""
    own, theirs = [], []
    mitsuba.image(samples)  # compiles
    for _ in range(runs):
        answer, (seconds, _, processor) = blik("cold", tolerance, work), mitsuba.image(samples)
        own.append((answer["seconds"], answer["processor"]))
        theirs.append((seconds, processor))
    medians = lambda rows: [statistics.median(column) for column in zip(*rows)]
    return medians(own), medians(theirs)


def compare(blik, found, options):
    """Tables for both programs."""
    head = "| image, 2 threads | error | Blik: tolerance | error | s | of the processor | {} | s | of the processor | ratio | ratio |"
    tables = {"Mitsuba: samples": [], "Radiance: -ad": []}
    for name in filter(found.get, SCENES):
        scene = Scene(found[name], name)
        if min(GOALS[name]) < 0.5 * scene.noise:
            scene.refine(options.work)
        runs = blik_runs(blik, scene, options)
        tables["Mitsuba: samples"] += mitsuba_rows(blik, scene, Mitsuba(scene), runs, options)
        tables["Radiance: -ad"] += radiance_rows(scene, runs, options, options.work)
    note = (
        "Ratios: of seconds, of processor seconds. Errors in brackets: below what the reference shows; Blik's is its own "
        "estimate, Mitsuba's goes with samples^-1/2."
    )
    lines = []
    for program, rows in tables.items():
        lines += [head.format(program), "|" + "---|" * 11, *rows, ""]
    return "\n".join([*lines, note]) + "\n"


def row(name, goal, blik, own, peer, theirs):
    """A line of a table; `blik` is a run or None, `own` and `theirs` are seconds and processor seconds."""
    head = f"| {name} | {goal:.2e} |"
    if blik is None:
        return f"{head} not reached | | | | {peer} | {theirs[0]:.3f} | {theirs[1]:.3f} | | |"
    error = f"{blik[2]:.1e}" if blik[3] else f"({blik[2]:.1e})"
    ratios = [t / o for t, o in zip(theirs, own)]
    return (
        f"{head} {blik[0]:.0e} | {error} | {own[0]:.3f} | {own[1]:.3f} | {peer} | {theirs[0]:.3f} | {theirs[1]:.3f} | "
        f"{ratios[0]:.1f} | {ratios[1]:.1f} |"
    )


def mitsuba_rows(blik, scene, mitsuba, runs, options):
    mitsuba.image(64)
    # the error of one sample a pixel, from the mean of several images' squares
    errors = [scene.eps(mitsuba.image(64)[1]) for _ in range(3)]
    single = math.sqrt(statistics.mean((e or 0.0) ** 2 for e in errors) * 64)
    lines = []
    for goal in GOALS[scene.name]:
        samples = math.ceil(max(2.0, single / goal)) ** 2
        run = first(runs, goal)
        # more samples than that are so many images of this many
        few, count = min(samples, 1024), 3 if options.quick else 5
        own, theirs = in_turn(blik, mitsuba, (run or runs[0])[0], few, options.work / "image.f32", count)
        lines.append(row(scene.name, goal, run, own, samples, [t * samples / few for t in theirs]))
    return lines


def radiance_rows(scene, runs, options, work):
    program = Radiance(scene, work)
    lines = []
    for divisions in [128] if options.quick else [128, 512]:
        seconds, processor, values = program.image(divisions)
        error = scene.eps(values) or 0.5 * scene.noise
        run = first(runs, error)
        lines.append(row(scene.name, error, run, run and (run[1], run[4]), divisions, (seconds, processor)))
    return lines
