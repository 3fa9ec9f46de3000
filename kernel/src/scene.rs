//! The scene: facets in scene coordinates, their normals, areas and materials; validation of every input.
//!
//! Scene coordinates are the caller's, moved to the middle of the bounding box and scaled by a power of two so
//! that the box fits into [-1, 1]. Moving subtracts the box's lowest corner first: a shift of all vertices by
//! exactly representable amounts leaves the scene coordinates bit-identical.

use crate::arena::{Arena, Need};
use crate::error::{Error, Field};
use crate::math::{Vec3, sqrt, unit};

/// The most spectral bands a scene may have.
pub const MAX_BANDS: usize = 64;

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

/// Reflectances and emission of one material, one value per band each.
#[derive(Clone, Copy, Debug)]
pub struct MaterialInput<'a> {
    /// Diffuse reflectance rho_d, in [0, 1].
    pub diffuse: &'a [f64],
    /// Mirror reflectance rho_s, in [0, 1]; rho_d + rho_s <= 1. With gloss: the lobe's albedo at normal view.
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

/// Which mirror a material is, as far as chains are concerned: materials with the same mirror reflectance in
/// all bands and the same lobe are one class.
pub const NO_MIRROR: u32 = u32::MAX;

/// A validated scene in caller memory.
#[derive(Clone, Copy, Debug)]
pub struct Scene<'m> {
    corners: &'m [[Vec3; 3]],
    normals: &'m [Vec3],
    areas: &'m [f64],
    materials: &'m [u32],
    corner_normals: &'m [[Vec3; 3]],
    diffuse: &'m [f64],
    specular: &'m [f64],
    emission: &'m [f64],
    mirror: &'m [u32],
    gloss_ratio: &'m [f64],
    gloss_rays: &'m [u32],
    lowest: Vec3,
    half: Vec3,
    scale: f64,
    bands: usize,
    sides: usize,
    degenerate: usize,
    memory: usize,
}

impl<'m> Scene<'m> {
    /// Bytes that [`Scene::new`] needs for this input.
    pub fn bytes(input: &SceneInput<'_>) -> Result<usize, Error> {
        let facets = input.facets.len();
        let materials = input.materials.len();
        let values = materials.saturating_mul(input.bands.min(MAX_BANDS));
        let smooth = if input.normals.is_empty() { 0 } else { facets };
        Need::new()
            .and::<[Vec3; 3]>(facets)
            .and::<Vec3>(facets)
            .and::<f64>(facets)
            .and::<u32>(facets)
            .and::<[Vec3; 3]>(smooth)
            .and::<f64>(values)
            .and::<f64>(values)
            .and::<f64>(values)
            .and::<u32>(materials)
            .and::<f64>(materials)
            .and::<u32>(materials)
            .bytes()
    }

    /// Checks the input and lays the scene out in `memory`.
    ///
    /// # Errors
    /// Everything that is wrong with the input, with the index of the first offender; a buffer below
    /// [`Scene::bytes`]. Facets of zero area are no error: they keep their index and take no part.
    pub fn new(input: &SceneInput<'_>, memory: &'m mut [u8]) -> Result<Scene<'m>, Error> {
        check_sizes(input)?;
        check_materials(input)?;
        check_mesh(input)?;
        let (lowest, half, scale) = placement(input)?;
        let needed = Scene::bytes(input)?;
        let mut arena = Arena::new(memory, needed)?;
        let facets = input.facets.len();
        let corners = arena.take::<[Vec3; 3]>(facets)?;
        let normals = arena.take::<Vec3>(facets)?;
        let areas = arena.take::<f64>(facets)?;
        let place = |index: u32| {
            let v = input.vertices.get(index as usize).copied().unwrap_or_default();
            (Vec3::from_array(v) - lowest - half) * scale
        };
        let mut degenerate = 0;
        for (((facet, corner), normal), area) in
            input.facets.iter().zip(corners.iter_mut()).zip(normals.iter_mut()).zip(areas.iter_mut())
        {
            *corner = facet.map(place);
            (*normal, *area) = normal_and_area(corner);
            degenerate += usize::from(*area == 0.0);
        }
        let materials = arena.take::<u32>(facets)?;
        materials.iter_mut().zip(input.facet_materials).for_each(|(to, from)| *to = *from);
        let corner_normals = lay_normals(input, normals, &mut arena)?;
        let values = input.materials.len() * input.bands;
        let diffuse = arena.take::<f64>(values)?;
        let specular = arena.take::<f64>(values)?;
        let emission = arena.take::<f64>(values)?;
        for (index, material) in input.materials.iter().enumerate() {
            let at = index * input.bands..(index + 1) * input.bands;
            diffuse[at.clone()].copy_from_slice(material.diffuse);
            specular[at.clone()].copy_from_slice(material.specular);
            emission[at].copy_from_slice(material.emission);
        }
        let mirror = arena.take::<u32>(input.materials.len())?;
        let gloss_ratio = arena.take::<f64>(input.materials.len())?;
        let gloss_rays = arena.take::<u32>(input.materials.len())?;
        lay_mirrors(input, mirror, gloss_ratio, gloss_rays);
        Ok(Scene {
            corners,
            normals,
            areas,
            materials,
            corner_normals,
            diffuse,
            specular,
            emission,
            mirror,
            gloss_ratio,
            gloss_rays,
            lowest,
            half,
            scale,
            bands: input.bands,
            sides: if input.two_sided { 2 } else { 1 },
            degenerate,
            memory: needed,
        })
    }

    /// Number of facets, degenerate ones included.
    #[inline(always)]
    pub fn facets(&self) -> usize {
        self.corners.len()
    }

    /// Facets of zero area, which take no part.
    pub fn degenerate(&self) -> usize {
        self.degenerate
    }

    /// Spectral bands.
    #[inline(always)]
    pub fn bands(&self) -> usize {
        self.bands
    }

    /// Sides of a facet that carry its material: 1 (front) or 2.
    #[inline(always)]
    pub fn sides(&self) -> usize {
        self.sides
    }

    /// Corners of all facets, in scene coordinates.
    #[inline(always)]
    pub fn corners(&self) -> &'m [[Vec3; 3]] {
        self.corners
    }

    /// Unit normals of the front sides; zero for degenerate facets.
    #[inline(always)]
    pub fn normals(&self) -> &'m [Vec3] {
        self.normals
    }

    /// Areas in scene coordinates; 0 for degenerate facets.
    #[inline(always)]
    pub fn areas(&self) -> &'m [f64] {
        self.areas
    }

    /// Area of a facet in the caller's units.
    pub fn area(&self, facet: usize) -> f64 {
        self.areas[facet] / (self.scale * self.scale)
    }

    /// Unit normal of a side of a facet (side 0 front, 1 back).
    #[inline(always)]
    pub fn side_normal(&self, facet: usize, side: usize) -> Vec3 {
        if side == 0 { self.normals[facet] } else { -self.normals[facet] }
    }

    /// Normal for the mirror direction at the point of barycentric weights `u`, `v` (corners 1 and 2) of a side.
    #[inline]
    pub fn mirror_normal(&self, facet: usize, side: usize, u: f64, v: f64) -> Vec3 {
        let flat = self.side_normal(facet, side);
        let Some([a, b, c]) = self.corner_normals.get(facet) else { return flat };
        let sum = *a * (1.0 - u - v) + *b * u + *c * v;
        match unit(sum) {
            Some(n) if side == 0 => n,
            Some(n) => -n,
            None => flat,
        }
    }

    /// True when mirror directions follow interpolated vertex normals.
    pub fn is_smooth(&self) -> bool {
        !self.corner_normals.is_empty()
    }

    /// Index of a facet's material.
    #[inline(always)]
    pub fn material(&self, facet: usize) -> usize {
        self.materials[facet] as usize
    }

    /// Number of materials.
    pub fn materials(&self) -> usize {
        self.mirror.len()
    }

    /// Diffuse reflectance of a material, one value per band.
    #[inline(always)]
    pub fn diffuse(&self, material: usize) -> &'m [f64] {
        &self.diffuse[material * self.bands..(material + 1) * self.bands]
    }

    /// Mirror reflectance of a material, one value per band.
    #[inline(always)]
    pub fn specular(&self, material: usize) -> &'m [f64] {
        &self.specular[material * self.bands..(material + 1) * self.bands]
    }

    /// Own diffuse radiance of a material, one value per band.
    #[inline(always)]
    pub fn emission(&self, material: usize) -> &'m [f64] {
        &self.emission[material * self.bands..(material + 1) * self.bands]
    }

    /// Mirror class of a material: the index of the first material with the same mirror, or [`NO_MIRROR`].
    #[inline(always)]
    pub fn mirror(&self, material: usize) -> u32 {
        self.mirror[material]
    }

    /// Axis ratio of a material's lobe, or `None` for an ideal mirror.
    #[inline(always)]
    pub fn gloss(&self, material: usize) -> Option<f64> {
        let ratio = self.gloss_ratio[material];
        if ratio > 0.0 { Some(ratio) } else { None }
    }

    /// Rays that a material asks for at the first hit of its lobe; `None`: by tolerance.
    pub fn gloss_rays(&self, material: usize) -> Option<u32> {
        match self.gloss_rays[material] {
            0 => None,
            n => Some(n),
        }
    }

    /// Largest value over materials and bands of a table given by `of`.
    fn largest(values: &[f64]) -> f64 {
        values.iter().fold(0.0, |a, &b| if b > a { b } else { a })
    }

    /// Largest diffuse reflectance of the scene.
    pub fn largest_diffuse(&self) -> f64 {
        Scene::largest(self.diffuse)
    }

    /// Largest mirror reflectance of the scene.
    pub fn largest_specular(&self) -> f64 {
        Scene::largest(self.specular)
    }

    /// Largest emission of the scene in one band.
    pub fn largest_emission(&self, band: usize) -> f64 {
        self.emission.iter().skip(band).step_by(self.bands).fold(0.0, |a, &b| if b > a { b } else { a })
    }

    /// A point of the caller's coordinates in scene coordinates.
    pub fn to_scene(&self, point: Vec3) -> Vec3 {
        (point - self.lowest - self.half) * self.scale
    }

    /// Scene lengths per length of the caller: a power of two.
    pub fn scale(&self) -> f64 {
        self.scale
    }

    /// Bytes in use.
    pub fn memory(&self) -> usize {
        self.memory
    }
}

fn check_sizes(input: &SceneInput<'_>) -> Result<(), Error> {
    if !(1..=MAX_BANDS).contains(&input.bands) {
        return Err(Error::Bands { given: input.bands });
    }
    if input.facets.is_empty() {
        return Err(Error::NoFacets);
    }
    // two sides and the flag bit of a coupling record must fit into 32 bits
    if input.facets.len() > (1 << 29) {
        return Err(Error::TooMany { what: "facets", limit: 1 << 29 });
    }
    if input.materials.is_empty() {
        return Err(Error::NoMaterials);
    }
    let lengths =
        [("facet_materials", input.facet_materials.len()), ("facet_normals", input.facet_normals.len())];
    for (what, given) in lengths {
        if given != 0 && given != input.facets.len() {
            return Err(Error::Length { what, expected: input.facets.len(), given });
        }
    }
    Ok(())
}

fn check_materials(input: &SceneInput<'_>) -> Result<(), Error> {
    for (index, material) in input.materials.iter().enumerate() {
        let fields = [
            (Field::Diffuse, material.diffuse, 1.0),
            (Field::Specular, material.specular, 1.0),
            (Field::Emission, material.emission, 1e37),
        ];
        for (field, values, largest) in fields {
            if values.len() != input.bands {
                let (expected, given) = (input.bands, values.len());
                return Err(Error::BandCount { material: index, field, expected, given });
            }
            for (band, &value) in values.iter().enumerate() {
                if !(0.0..=largest).contains(&value) {
                    return Err(Error::MaterialRange { material: index, band, field, value });
                }
            }
        }
        for (band, (d, s)) in material.diffuse.iter().zip(material.specular).enumerate() {
            // 0.1 + 0.9 may exceed 1 by a rounding
            if d + s > 1.0 + 4.0 * f64::EPSILON {
                return Err(Error::ReflectanceSum { material: index, band, sum: d + s });
            }
        }
        if let Some(gloss) = material.gloss {
            if !(gloss.axis_ratio >= 1.0 && gloss.axis_ratio.is_finite()) {
                let (field, value) = (Field::AxisRatio, gloss.axis_ratio);
                return Err(Error::MaterialRange { material: index, band: 0, field, value });
            }
            if let Some(rays) = gloss.rays.filter(|n| !(1..=MOST_GLOSS_RAYS).contains(n)) {
                let (field, value) = (Field::GlossRays, f64::from(rays));
                return Err(Error::MaterialRange { material: index, band: 0, field, value });
            }
        }
    }
    Ok(())
}

fn check_mesh(input: &SceneInput<'_>) -> Result<(), Error> {
    if let Some(vertex) = input.vertices.iter().position(|v| !v.iter().all(|x| x.is_finite())) {
        return Err(Error::VertexNotFinite { vertex });
    }
    if let Some(normal) = input.normals.iter().position(|n| unit(Vec3::from_array(*n)).is_none()) {
        return Err(Error::NormalNotFinite { normal });
    }
    for (facet, corners) in input.facets.iter().enumerate() {
        if let Some(&index) = corners.iter().find(|&&i| i as usize >= input.vertices.len()) {
            return Err(Error::IndexOutOfRange {
                facet,
                index: index as usize,
                vertices: input.vertices.len(),
            });
        }
    }
    let by_facets = input.facet_normals.is_empty() && !input.normals.is_empty();
    let indices = if by_facets { input.facets } else { input.facet_normals };
    for (facet, corners) in indices.iter().enumerate() {
        if let Some(&index) = corners.iter().find(|&&i| i as usize >= input.normals.len() && i != NO_NORMAL) {
            let normals = input.normals.len();
            return Err(Error::NormalIndexOutOfRange { facet, index: index as usize, normals });
        }
    }
    let materials = input.materials.len();
    for (facet, &material) in input.facet_materials.iter().enumerate() {
        if material as usize >= materials {
            return Err(Error::MaterialOutOfRange { facet, material: material as usize, materials });
        }
    }
    Ok(())
}

/// Lowest corner of the bounding box of the used vertices, half its size, and the power of two that scales the
/// half size into (0.5, 1].
fn placement(input: &SceneInput<'_>) -> Result<(Vec3, Vec3, f64), Error> {
    let used = || input.facets.iter().flatten().filter_map(|&i| input.vertices.get(i as usize));
    let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    for vertex in used() {
        low = low.min(Vec3::from_array(*vertex));
        high = high.max(Vec3::from_array(*vertex));
    }
    let half = (high - low) * 0.5;
    let largest = half.max_element();
    if largest == 0.0 {
        return Ok((low, Vec3::ZERO, 1.0));
    }
    let exponent = libm::ilogb(largest);
    if !largest.is_finite() || !(-1000..=1000).contains(&exponent) {
        return Err(Error::Extent);
    }
    Ok((low, half, libm::ldexp(1.0, -exponent - 1)))
}

/// Unit normal and area of a triangle; zeros where the area is below the rounding error of its edges' product.
fn normal_and_area(corners: &[Vec3; 3]) -> (Vec3, f64) {
    let [a, b, c] = *corners;
    let (ab, bc, ca) = (b - a, c - b, a - c);
    // the cross product of the two shortest edges has the smallest error
    let (l0, l1, l2) = (ab.length_squared(), bc.length_squared(), ca.length_squared());
    let (first, second) = if l0 >= l1 && l0 >= l2 {
        (bc, ca)
    } else if l1 >= l2 {
        (ca, ab)
    } else {
        (ab, bc)
    };
    let cross = first.cross(second);
    let length = sqrt(cross.length_squared());
    let error = 4.0 * f64::EPSILON * sqrt(first.length_squared() * second.length_squared());
    match unit(cross) {
        Some(normal) if length > error => (normal, 0.5 * length),
        _ => (Vec3::ZERO, 0.0),
    }
}

fn lay_normals<'m>(
    input: &SceneInput<'_>,
    flat: &[Vec3],
    arena: &mut Arena<'m>,
) -> Result<&'m [[Vec3; 3]], Error> {
    if input.normals.is_empty() {
        return Ok(&[]);
    }
    let indices = if input.facet_normals.is_empty() { input.facets } else { input.facet_normals };
    let corner_normals = arena.take::<[Vec3; 3]>(indices.len())?;
    for ((to, from), &facet) in corner_normals.iter_mut().zip(indices).zip(flat) {
        *to = from
            .map(|i| input.normals.get(i as usize).and_then(|n| unit(Vec3::from_array(*n))).unwrap_or(facet));
    }
    Ok(corner_normals)
}

fn lay_mirrors(input: &SceneInput<'_>, mirror: &mut [u32], ratio: &mut [f64], rays: &mut [u32]) {
    let lobe = |m: &MaterialInput<'_>| m.gloss.filter(|g| g.axis_ratio < MIRROR_AXIS_RATIO);
    for (index, material) in input.materials.iter().enumerate() {
        let gloss = lobe(material);
        let same = |other: &MaterialInput<'_>| {
            other.specular == material.specular
                && lobe(other).map(|g| g.axis_ratio) == gloss.map(|g| g.axis_ratio)
        };
        let first = input.materials.iter().position(same).unwrap_or(index);
        let reflects = material.specular.iter().any(|&s| s > 0.0);
        mirror[index] = if reflects { first as u32 } else { NO_MIRROR };
        ratio[index] = gloss.map_or(0.0, |g| g.axis_ratio);
        rays[index] = gloss.and_then(|g| g.rays).unwrap_or(0);
    }
}
