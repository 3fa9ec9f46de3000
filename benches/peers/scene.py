"""A scene file as arrays, with the truth of its image."""

import hashlib
import tomllib

import numpy as np


def digest(files):
    """A short name for the contents of files."""
    sum = hashlib.sha256()
    for file in files:
        sum.update(file.read_bytes())
    return sum.hexdigest()[:12]


class Scene:
    """Mesh, materials per facet, light, and camera rays."""

    def __init__(self, path):
        self.path, self.name = path, path.stem
        file = tomllib.loads(path.read_text())
        self.bands = file.get("bands", 1)
        self.two_sided = file["mesh"].get("two_sided", False)
        self.reference = self.spectrum(file, "reference_radiance", 1.0)
        self.files = [path, path.parent / file["mesh"]["file"]]
        names = self.read_mesh(self.files[1])
        materials = [file["material"].get(name) or file["material"]["default"] for name in names]
        of = lambda key: np.array([self.spectrum(m, key, 0.0) for m in materials])[self.facet_materials]
        self.diffuse, self.specular, self.emission = of("diffuse"), of("specular"), of("emission")
        # 0: an ideal mirror
        self.gloss = np.array([m.get("gloss", {}).get("axis_ratio", 0.0) for m in materials])[self.facet_materials]
        self.sky, self.sun = file.get("sky"), file.get("sun")
        if self.sky and self.sky["model"] == "table":
            self.files.append(path.parent / self.sky["file"])
            table = np.load(self.files[-1])
            self.table = np.broadcast_to(table.reshape(*table.shape[:2], -1), (*table.shape[:2], self.bands))
        self.rays(file["camera"])

    def spectrum(self, entries, key, default):
        value = entries.get(key, default)
        return np.broadcast_to(np.array(value, float), (self.bands,))

    def read_mesh(self, path):
        """Reads the OBJ file; its materials' names in the order of the facets' indices."""
        vertices, facets, names, material = [], [], [], []
        for line in path.read_text().splitlines():
            words = line.split()
            if words[:1] == ["v"]:
                vertices.append([float(w) for w in words[1:4]])
            elif words[:1] == ["usemtl"]:
                name = words[1]
                if name not in names:
                    names.append(name)
                current = names.index(name)
            elif words[:1] == ["f"]:
                if not names:
                    names, current = ["default"], 0
                corners = [int(w.split("/")[0]) - 1 for w in words[1:]]
                facets += [[corners[0], b, c] for b, c in zip(corners[1:], corners[2:])]
                material += [current] * (len(corners) - 2)
        self.vertices, self.facets = np.array(vertices), np.array(facets)
        self.facet_materials = np.array(material)
        return names

    def rays(self, camera):
        """Origins and directions through the centres of all pixels, row by row."""
        eye, target, up = (np.array(camera[k], float) for k in ("eye", "target", "up"))
        unit = lambda v: v / np.linalg.norm(v, axis=-1, keepdims=True)
        forward = unit(target - eye)
        right = unit(np.cross(forward, up))
        up = np.cross(right, forward)
        columns, rows = self.resolution = camera["resolution"]
        perspective = camera["kind"] == "perspective"
        height = 2.0 * np.tan(np.radians(camera["fov_deg"]) / 2.0) if perspective else camera["height"]
        i, j = np.divmod(np.arange(rows * columns), columns)
        x = ((j + 0.5) / columns - 0.5) * height * columns / rows
        y = (0.5 - (i + 0.5) / rows) * height
        aside = x[:, None] * right + y[:, None] * up
        if perspective:
            self.origins, self.directions = np.broadcast_to(eye, aside.shape), unit(forward + aside)
        else:
            self.origins, self.directions = eye + aside, np.broadcast_to(forward, aside.shape)

    def light(self):
        """The light in a few words."""
        words = [self.sky["model"]] if self.sky else []
        if self.sun:
            angle = self.sun.get("half_angle_deg", 0.2665)
            words.append("point sun" if angle == 0 else f"sun {angle:g}°")
        if self.emission.any():
            words.append("lamps")
        return " + ".join(words)

    def computable(self):
        """Whether a path tracer meets all light: a point sun by way of mirrors no ray finds."""
        point = self.sun and self.sun.get("half_angle_deg", 0.2665) == 0
        return not (self.specular.any() and point)


class Truth:
    """Two independent halves of the truth of some pixels."""

    def __init__(self, scene, halves):
        halves = halves.reshape(2, -1, scene.bands).astype(float)
        self.known = np.isfinite(halves[0, :, 0])
        self.halves, self.reference = halves[:, self.known], scene.reference

    def eps(self, image):
        """eps_c of an image (pixel, band) in the worst band, and its standard error: the halves' errors are
        independent, so the mean product of the differences from both holds no noise."""
        a, b = ((image[self.known] - half) / self.reference for half in self.halves)
        square, spread = (a * b).mean(0), np.sqrt(((a * a - b * b) ** 2).mean(0) / (4 * len(a)))
        eps = np.sqrt(np.maximum(square, 0.0))
        band = int(np.argmax(eps))
        return eps[band], float(np.sqrt(max(square[band], 0.0) + spread[band]) - eps[band])

    def noise(self):
        """Standard error of eps_c of a perfect image."""
        variance = (((self.halves[0] - self.halves[1]) / self.reference) ** 2).mean(0).max() / 2
        return float(np.sqrt(variance / np.sqrt(len(self.halves[0]))))
