"""A path tracer on Mitsuba's rays: the object's pixels alone, light met by what finds it best.

Suns by a shadow ray at every diffuse facet, lamps and skies with bright places by sampling them and the surface with the
power heuristic, other skies by the surface's own sampling.
"""

import math
import os
import time

import numpy as np

# a, b, c, d, e of ISO 15469
CIE = """4 -.7 0 -1 0; 4 -.7 2 -1.5 .15; 1.1 -.8 0 -1 0; 1.1 -.8 2 -1.5 .15; 0 -1 0 -1 0; 0 -1 2 -1.5 .15; 0 -1 5 -2.5 .3;
0 -1 10 -3 .45; -1 -.55 2 -1.5 .15; -1 -.55 5 -2.5 .3; -1 -.55 10 -3 .45; -1 -.32 10 -3 .45; -1 -.32 16 -3 .3;
-1 -.15 16 -3 .3; -1 -.15 24 -2.8 .15"""
# Reflection from which on paths end by chance, as in the stock integrator
ROULETTE = 5
# Rows and columns of equal solid angle by which a sky with bright places is sampled
CELLS = (64, 128)
# Rays at once: the memory of a small machine
RAYS = 1 << 22


def processor():
    """Computing time of this process and of those that it has waited for."""
    return sum(os.times()[:4])


def start():
    import drjit as dr
    import mitsuba as mi

    if mi.variant() is None:
        mi.set_variant("llvm_ad_mono")
        dr.set_thread_count(2)
    return dr, mi


class Sky:
    """Radiance by direction, and a table to sample it by where it has bright places."""

    def __init__(self, dr, mi, scene, kind):
        self.dr, self.mi, self.kind, sky = dr, mi, kind, scene.sky
        self.model = sky["model"]
        unit = lambda v: np.array(v, float) / np.linalg.norm(v)
        up = unit(sky.get("up", [0, 0, 1]))
        along = unit(sky.get("azimuth_zero", [1, 0, 0]))
        off = along - up * (along @ up)
        x = unit(off if np.linalg.norm(off) > 1e-9 else np.array([0, 1, 0]) - up * up[1])
        self.axes = [mi.Vector3f(*map(float, v)) for v in (x, np.cross(up, x), up)]
        of = lambda key, default: kind(*map(float, scene.spectrum(sky, key, default)))
        self.radiance, self.ground = of("radiance", 1.0), of("ground", 0.0)
        if self.model == "table":
            self.rows, self.columns = scene.table.shape[:2]
            self.table = mi.Float(scene.table.astype(np.float32).ravel())
        if self.model == "cie":
            self.law = [float(x) for x in CIE.split(";")[sky["type"] - 1].split()]
            sun = unit(sky.get("sun_direction") or scene.sun["direction"])
            self.sun = mi.Vector3f(*map(float, sun))
            a, b, *_ = self.law
            zenith = mi.Float(float(np.arccos(np.clip(up @ sun, -1, 1))))
            self.scale = 1.0 / (self.indicatrix(zenith) * (1 + a * math.exp(b)))
        self.cells = self.tabulate() if self.model in ("table", "cie") else None

    def indicatrix(self, angle):
        dr, (_, _, c, d, e) = self.dr, self.law
        return 1 + c * (dr.exp(d * angle) - math.exp(d * math.pi / 2)) + e * dr.cos(angle) ** 2

    def __call__(self, direction):
        """Radiance from unit directions."""
        dr, mi = self.dr, self.mi
        height = dr.dot(direction, self.axes[2])
        if self.model == "uniform":
            return self.radiance
        if self.model == "gradient":
            return dr.fma(self.radiance - self.ground, 0.5 * (1 + height), self.ground)
        if self.model == "table":
            return self.radiance * self.bilinear(direction, height)
        share = mi.Float(1)
        if self.model == "overcast":
            share = (1 + 2 * height) / 3
        elif self.model == "cie":
            a, b, *_ = self.law
            angle = dr.atan2(dr.norm(dr.cross(direction, self.sun)), dr.dot(direction, self.sun))
            share = self.indicatrix(angle) * (1 + a * dr.exp(b / dr.maximum(height, 1e-6))) * self.scale
        return dr.select(height < 0, self.ground, self.radiance * share)

    def bilinear(self, direction, height):
        dr, mi = self.dr, self.mi
        x, y = dr.dot(direction, self.axes[0]), dr.dot(direction, self.axes[1])
        azimuth = dr.atan2(y, x)
        azimuth = dr.select(azimuth < 0, azimuth + dr.two_pi, azimuth)
        polar = dr.atan2(dr.sqrt(x * x + y * y), height)
        row = dr.clip(polar / dr.pi * self.rows - 0.5, 0, self.rows - 1)
        column = azimuth / dr.two_pi * self.columns - 0.5
        r, c = dr.floor(row), dr.floor(column)
        fr, fc = row - r, column - c

        def cell(r, c):
            c = dr.select(c < 0, c + self.columns, dr.select(c >= self.columns, c - self.columns, c))
            index = mi.UInt32(dr.minimum(r, self.rows - 1)) * self.columns + mi.UInt32(c)
            return dr.gather(self.kind, self.table, index)

        above = cell(r, c) * (1 - fc) + cell(r, c + 1) * fc
        below = cell(r + 1, c) * (1 - fc) + cell(r + 1, c + 1) * fc
        return above * (1 - fr) + below * fr

    def tabulate(self):
        """A distribution over cells of equal solid angle."""
        rows, columns = CELLS
        i, j = np.divmod(np.arange(rows * columns), columns)
        values = 0.0
        # a cell counts by the mean of some of its directions
        for u in (0.17, 0.5, 0.83):
            for v in (0.17, 0.5, 0.83):
                radiance = self(self.toward(self.mi.Float(1 - 2 * (i + u) / rows), self.mi.Float((j + v) / columns)))
                values = values + np.array(self.brightest(radiance))
        return self.mi.DiscreteDistribution(self.mi.Float(values + 1e-3 * values.max()))

    def brightest(self, value):
        return value if self.kind is self.mi.Float else self.dr.max(value)

    def toward(self, height, turn):
        dr, (x, y, up) = self.dr, self.axes
        s, c = dr.sincos(turn * dr.two_pi)
        return (x * c + y * s) * dr.safe_sqrt(1 - height * height) + up * height

    def sample(self, pick, point):
        """Directions and their densities over solid angle."""
        rows, columns = CELLS
        index, reused = self.cells.sample_reuse(pick)
        row, column = index // columns, index % columns
        height = 1 - 2 * (self.mi.Float(row) + reused) / rows
        direction = self.toward(height, (self.mi.Float(column) + point) / columns)
        return direction, self.density_of(index)

    def density(self, direction):
        dr, mi, (rows, columns) = self.dr, self.mi, CELLS
        x, y, up = (dr.dot(direction, axis) for axis in self.axes)
        turn = dr.atan2(y, x) / dr.two_pi
        turn = dr.select(turn < 0, turn + 1, turn)
        row = dr.clip(mi.Int32(0.5 * (1 - up) * rows), 0, rows - 1)
        column = dr.clip(mi.Int32(turn * columns), 0, columns - 1)
        return self.density_of(mi.UInt32(row * columns + column))

    def density_of(self, index):
        cells = CELLS[0] * CELLS[1]
        return self.cells.eval_pmf_normalized(index) * cells / (4 * math.pi)


class World:
    """A scene ready for paths."""

    def __init__(self, scene):
        dr, mi = self.dr, self.mi = start()
        kind = self.kind = mi.Float if scene.bands == 1 else mi.Color3f
        assert scene.bands in (1, 3)
        self.two_sided, self.reference = scene.two_sided, scene.reference
        mesh = mi.Mesh("mesh", len(scene.vertices), len(scene.facets))
        params = mi.traverse(mesh)
        params["vertex_positions"] = mi.Float(scene.vertices.ravel())
        params["faces"] = mi.UInt32(scene.facets.ravel())
        params.update()
        self.world = mi.load_dict({"type": "scene", "mesh": mesh})
        flat = lambda values: mi.Float(values.astype(np.float32).ravel())
        self.diffuse, self.specular, self.emission = map(flat, (scene.diffuse, scene.specular, scene.emission))
        sums = [values.max(1) for values in (scene.diffuse, scene.specular)]
        self.mirror = flat(sums[1] / np.maximum(sums[0] + sums[1], 1e-30)) if sums[1].any() else None
        self.gloss = flat(scene.gloss) if scene.gloss.any() else None
        self.sky = Sky(dr, mi, scene, kind) if scene.sky else None
        self.sun = self.sun_of(scene) if scene.sun else None
        self.lamps = self.lamps_of(scene) if scene.emission.any() else None
        rays = [mi.Point3f(scene.origins.T), mi.Vector3f(np.ascontiguousarray(scene.directions.T))]
        self.hit = np.array(self.world.ray_test(mi.Ray3f(*rays)))
        pixels = mi.UInt32(np.flatnonzero(self.hit))
        self.rays = [dr.gather(type(r), r, pixels) for r in rays]
        self.pixels = int(self.hit.sum())
        self.sampler = mi.load_dict({"type": "multijitter"})
        self.seed = 0

    def brightest(self, value):
        return value if self.kind is self.mi.Float else self.dr.max(value)

    def sun_of(self, scene):
        direction = np.array(scene.sun["direction"], float)
        direction = self.mi.Vector3f(*map(float, direction / np.linalg.norm(direction)))
        sine = math.sin(math.radians(scene.sun.get("half_angle_deg", 0.2665)))
        irradiance = self.kind(*map(float, scene.spectrum(scene.sun, "irradiance", 0.0)))
        return direction, sine, irradiance

    def lamps_of(self, scene):
        """Luminous facets by power: distribution, facet numbers, corners, and the density over area of every facet."""
        mi, corners = self.mi, scene.vertices[scene.facets]
        areas = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
        facets = np.flatnonzero(scene.emission.any(1))
        power = (scene.emission.max(1) * areas)[facets]
        density = np.zeros(len(areas))
        density[facets] = power / power.sum() / areas[facets]
        return (
            mi.DiscreteDistribution(mi.Float(power)),
            mi.UInt32(facets),
            [mi.Float(np.ascontiguousarray(corners[facets, k].ravel())) for k in range(3)],
            mi.Float(density),
        )

    def image(self, samples):
        """The object's pixels (pixel, band) and processor seconds; the scene is in memory. Samples: a square number."""
        before, total, count = processor(), 0.0, 0
        side = max(1, math.isqrt(min(samples, RAYS // max(self.pixels, 1))))
        for _ in range(max(1, round(samples / side**2))):
            self.seed += 1
            total, count = total + np.array(self.paths(side**2, self.seed)), count + 1
        values = (total / count).reshape(-1, self.pixels).T
        return values, processor() - before

    def paths(self, samples, seed):
        dr, mi = self.dr, self.mi
        count = self.pixels * samples
        sampler = self.sampler.clone()
        sampler.set_sample_count(samples)
        sampler.set_samples_per_wavefront(samples)
        sampler.seed(seed, count)
        index = dr.arange(mi.UInt32, count) // samples
        ray = mi.Ray3f(*(dr.gather(type(r), r, index) for r in self.rays))
        radiance = trace()(self, dr, mi, sampler, ray)
        return dr.block_sum(radiance, samples) / samples

    def direct(self, hit, normal, sampler, active):
        """What arrives at diffuse facets from lights that are sampled, times cos/pi."""
        dr, mi, sum = self.dr, self.mi, self.kind(0)
        if self.sun is not None:
            axis, sine, irradiance = self.sun
            toward, weight = axis, mi.Float(1)
            if sine > 0:
                u = sampler.next_2d(active)
                s, c = dr.sincos(u.y * dr.two_pi)
                r = sine * dr.sqrt(u.x)
                cosine = dr.sqrt(1 - r * r)
                toward = mi.Frame3f(axis).to_world(mi.Vector3f(r * c, r * s, cosine))
                weight = 1 / cosine
            facing = dr.dot(toward, normal)
            lit = active & (facing > 0)
            lit &= ~self.world.ray_test(hit.spawn_ray(toward), lit)
            sum += dr.select(lit, irradiance * (facing * weight / dr.pi), 0)
        if self.sky is not None and self.sky.cells is not None:
            toward, density = self.sky.sample(sampler.next_1d(active), sampler.next_1d(active))
            facing = dr.dot(toward, normal)
            lit = active & (facing > 0)
            lit &= ~self.world.ray_test(hit.spawn_ray(toward), lit)
            share = facing / dr.pi
            sum += dr.select(lit, self.sky(toward) * (share * power(dr, density, share) / density), 0)
        if self.lamps is not None:
            lamps, facets, corners, densities = self.lamps
            index, u = lamps.sample_reuse(sampler.next_1d(active))
            v = sampler.next_1d(active)
            root = dr.sqrt(u)
            a, b, c = (dr.gather(mi.Point3f, corner, index) for corner in corners)
            point = a * (1 - root) + b * (root * (1 - v)) + c * (root * v)
            away = point - hit.p
            distance2 = dr.squared_norm(away)
            toward = away * dr.rsqrt(distance2)
            front = dr.normalize(dr.cross(b - a, c - a))
            back = -dr.dot(toward, front)
            if self.two_sided:
                back = abs(back)
            facing = dr.dot(toward, normal)
            lit = active & (facing > 0) & (back > 1e-6)
            lit &= ~self.world.ray_test(hit.spawn_ray_to(point), lit)
            facet = dr.gather(mi.UInt32, facets, index)
            density = dr.gather(mi.Float, densities, facet) * distance2 / dr.maximum(back, 1e-6)
            emission = dr.gather(self.kind, self.emission, facet)
            share = facing / dr.pi
            sum += dr.select(lit, emission * (share * power(dr, density, share) / density), 0)
        return sum


def power(dr, a, b):
    """The power heuristic's weight of a sample of density a that another way finds with density b."""
    return a * a / dr.maximum(a * a + b * b, 1e-30)


def lobe(dr, mi, ratio, mirror, point):
    """A direction of the whole lobe about the mirror direction; an ideal mirror's where the axis ratio is 0."""
    t2 = dr.maximum(ratio, 1.0001) ** 2
    sine2 = dr.select(ratio > 0, dr.minimum((t2**point.x - 1) / (t2 - 1), 1), 0)
    s, c = dr.sincos(point.y * dr.two_pi)
    r = dr.sqrt(sine2)
    return mi.Frame3f(mirror).to_world(mi.Vector3f(r * c, r * s, dr.safe_sqrt(1 - sine2)))


def _trace():
    import drjit as dr

    @dr.syntax
    def trace(self, dr, mi, sampler, ray):
        kind = self.kind
        radiance, weight = kind(0), kind(1)
        active, depth = mi.Bool(True), mi.UInt32(0)
        # density of the last direction where it was a diffuse facet's, else 0: nothing else finds the light then
        last = mi.Float(0)
        while active:
            hit = self.world.ray_intersect(ray, mi.RayFlags.Minimal, False, active)
            out = active & ~hit.is_valid()
            if self.sky is not None:
                share = mi.Float(1)
                if self.sky.cells is not None:
                    share = dr.select(last > 0, power(dr, last, self.sky.density(ray.d)), 1)
                radiance += dr.select(out, weight * self.sky(ray.d) * share, 0)
            if self.sun is not None and self.mirror is not None:
                axis, sine, irradiance = self.sun
                if sine > 0:
                    within = out & (last == 0) & (dr.norm(dr.cross(ray.d, axis)) < sine) & (dr.dot(ray.d, axis) > 0)
                    radiance += dr.select(within, weight * irradiance / (dr.pi * sine * sine), 0)
            active &= hit.is_valid()
            cosine = -dr.dot(ray.d, hit.n)
            normal = hit.n
            if self.two_sided:
                normal = dr.mulsign(hit.n, cosine)
            else:
                active &= cosine > 0
            facet = hit.prim_index
            if self.lamps is not None:
                emission = dr.gather(kind, self.emission, facet, active)
                density = dr.gather(mi.Float, self.lamps[3], facet, active) * hit.t * hit.t / dr.maximum(abs(cosine), 1e-6)
                share = dr.select(last > 0, power(dr, last, density), 1)
                radiance += dr.select(active, weight * emission * share, 0)
            diffuse = dr.gather(kind, self.diffuse, facet, active)
            radiance += weight * diffuse * self.direct(hit, normal, sampler, active)
            point = sampler.next_2d(active)
            local = mi.warp.square_to_cosine_hemisphere(point)
            toward = mi.Frame3f(normal).to_world(local)
            last = local.z / dr.pi
            value = diffuse
            if self.mirror is not None:
                share = dr.gather(mi.Float, self.mirror, facet, active)
                mirrored = sampler.next_1d(active) < share
                specular = dr.gather(kind, self.specular, facet, active)
                mirror = ray.d - normal * (2 * dr.dot(ray.d, normal))
                if self.gloss is not None:
                    ratio = dr.gather(mi.Float, self.gloss, facet, active)
                    mirror = lobe(dr, mi, ratio, mirror, point)
                toward = dr.select(mirrored, mirror, toward)
                value = dr.select(mirrored, specular / dr.maximum(share, 1e-6), diffuse / dr.maximum(1 - share, 1e-6))
                last = dr.select(mirrored, 0, last)
                active &= dr.dot(toward, normal) > 0
            weight *= value
            ray = hit.spawn_ray(toward)
            depth += 1
            most = self.brightest(weight)
            active &= most > 0
            survive = dr.minimum(most, 0.95)
            late = depth >= ROULETTE
            active &= ~late | (sampler.next_1d(active) < survive)
            weight = dr.select(late, weight / dr.maximum(survive, 1e-30), weight)
        return radiance

    return trace


def trace():
    """One path for each ray, compiled once."""
    global _compiled
    if _compiled is None:
        _compiled = _trace()
    return _compiled


_compiled = None
