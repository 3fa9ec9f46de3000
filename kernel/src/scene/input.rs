//! What a scene is made from.

/// "No vertex normal" in [`SceneInput::facet_normals`].
pub const NO_NORMAL: u32 = u32::MAX;

/// The most rays that a material may ask for at the first hit of its lobe.
pub const MOST_GLOSS_RAYS: u32 = 65_536;

/// The widest lobe's axis ratio is 1; from this one on a glossy material is an ideal mirror.
pub const MIRROR_AXIS_RATIO: f64 = 1e4;

/// A directional-diffuse lobe instead of an ideal mirror (Kholopov's ellipsoid).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gloss {
    /// Long over short axis of the lobe, >= 1.
    pub axis_ratio: f64,
    /// Rays at the first hit, 1 to [`MOST_GLOSS_RAYS`]; `None`: by tolerance.
    pub rays: Option<u32>,
}

/// Reflectances up to 1 and what single precision adds to two that make up 1: four roundings. They are scaled back to 1.
pub const MOST_REFLECTANCE: f64 = 1.0 + 4.0 / (1u64 << 24) as f64;

/// Reflectances that make up more than 1 by rounding, scaled back to it.
pub(crate) fn within_one(diffuse: f64, specular: f64) -> (f64, f64) {
    let sum = diffuse + specular;
    if sum > 1.0 { (diffuse / sum, specular / sum) } else { (diffuse, specular) }
}

/// Reflectances and emission of one material, one value per band each.
#[derive(Clone, Copy, Debug)]
pub struct MaterialInput<'a> {
    /// Diffuse reflectance rho_d, in [0, 1].
    pub diffuse: &'a [f64],
    /// Mirror reflectance rho_s, in [0, 1]; rho_d + rho_s <= 1, up to [`MOST_REFLECTANCE`]. With gloss: the lobe's albedo
    /// at normal view.
    pub specular: &'a [f64],
    /// Own diffuse radiance, >= 0, in W m-2 sr-1.
    pub emission: &'a [f64],
    /// Absent: an ideal mirror.
    pub gloss: Option<Gloss>,
}

/// A mesh with its materials, as the caller has it.
#[derive(Clone, Copy, Debug)]
pub struct SceneInput<'a> {
    /// Positions in any unit and at any offset.
    pub vertices: &'a [[f64; 3]],
    /// Three vertex indices a facet; counter-clockwise seen from the front.
    pub facets: &'a [[u32; 3]],
    /// Material of each facet; empty: all 0.
    pub facet_materials: &'a [u32],
    /// Normals for interpolated mirror directions; empty: mirrors are flat.
    pub normals: &'a [[f64; 3]],
    /// Per facet corner an index into `normals` or [`NO_NORMAL`]; empty with normals given: as `facets`.
    pub facet_normals: &'a [[u32; 3]],
    /// The materials.
    pub materials: &'a [MaterialInput<'a>],
    /// Both sides carry material and emission; otherwise backs are black and opaque.
    pub two_sided: bool,
    /// Spectral bands, 1 to 64.
    pub bands: usize,
}

/// A mesh with its materials in whatever layout the caller keeps it; [`SceneInput`] is one.
///
/// Every method gives the same answer each time; indices are below the count that belongs to them.
pub trait Mesh {
    /// Number of vertices.
    fn vertices(&self) -> usize;
    /// Position of a vertex.
    fn vertex(&self, index: usize) -> [f64; 3];
    /// Number of facets.
    fn facets(&self) -> usize;
    /// Three vertex indices, counter-clockwise seen from the front.
    fn facet(&self, index: usize) -> [u32; 3];
    /// Number of facets whose material is told: all, or 0 where all have material 0.
    fn facet_materials(&self) -> usize;
    /// Material of a facet.
    fn facet_material(&self, facet: usize) -> u32;
    /// Number of vertex normals; 0: mirrors are flat.
    fn normals(&self) -> usize;
    /// A vertex normal, of any length but zero.
    fn normal(&self, index: usize) -> [f64; 3];
    /// Number of facets whose normals are told: all, or 0 where they go with the vertices.
    fn facet_normals(&self) -> usize;
    /// Per corner the index of a normal or [`NO_NORMAL`].
    fn facet_normal(&self, facet: usize) -> [u32; 3];
    /// Number of materials.
    fn materials(&self) -> usize;
    /// A material.
    fn material(&self, index: usize) -> MaterialInput<'_>;
    /// Both sides carry material and emission.
    fn two_sided(&self) -> bool;
    /// Spectral bands.
    fn bands(&self) -> usize;
}

/// A material of nothing, for indices that are out of range.
const BLACK_MATERIAL: MaterialInput<'_> =
    MaterialInput { diffuse: &[], specular: &[], emission: &[], gloss: None };

impl Mesh for SceneInput<'_> {
    fn vertices(&self) -> usize {
        self.vertices.len()
    }

    fn vertex(&self, index: usize) -> [f64; 3] {
        self.vertices.get(index).copied().unwrap_or_default()
    }

    fn facets(&self) -> usize {
        self.facets.len()
    }

    fn facet(&self, index: usize) -> [u32; 3] {
        self.facets.get(index).copied().unwrap_or_default()
    }

    fn facet_materials(&self) -> usize {
        self.facet_materials.len()
    }

    fn facet_material(&self, facet: usize) -> u32 {
        self.facet_materials.get(facet).copied().unwrap_or_default()
    }

    fn normals(&self) -> usize {
        self.normals.len()
    }

    fn normal(&self, index: usize) -> [f64; 3] {
        self.normals.get(index).copied().unwrap_or_default()
    }

    fn facet_normals(&self) -> usize {
        self.facet_normals.len()
    }

    fn facet_normal(&self, facet: usize) -> [u32; 3] {
        self.facet_normals.get(facet).copied().unwrap_or([NO_NORMAL; 3])
    }

    fn materials(&self) -> usize {
        self.materials.len()
    }

    fn material(&self, index: usize) -> MaterialInput<'_> {
        self.materials.get(index).copied().unwrap_or(BLACK_MATERIAL)
    }

    fn two_sided(&self) -> bool {
        self.two_sided
    }

    fn bands(&self) -> usize {
        self.bands
    }
}
