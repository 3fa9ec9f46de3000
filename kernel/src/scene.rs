//! The scene: facets in scene coordinates, their normals, areas and materials; validation of every input.
//!
//! Scene coordinates are the caller's, moved to the middle of the bounding box and scaled by a power of two so
//! that the box fits into [-1, 1]. Moving subtracts the box's lowest corner first: a shift of all vertices by
//! exactly representable amounts leaves the scene coordinates bit-identical.
//!
//! Constants of this file are measured by `cargo test --test poses` (images of moved parts).

pub(crate) mod bake;
mod check;
mod input;
pub mod light;
pub mod lobe;
pub mod pose;
pub mod sky;
pub mod sun;

use crate::base::arena::{Arena, Need};
use crate::base::error::Error;
use crate::base::index::{Index, copy, pieces};
use crate::base::math::{Vec3, sqrt, unit};

pub use input::*;

/// The most spectral bands a scene may have.
pub const MAX_BANDS: usize = 64;

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
    /// Bytes that [`Scene::new`] needs for this mesh.
    pub fn bytes(mesh: &dyn Mesh) -> Result<usize, Error> {
        let smooth = mesh.normals() > 0;
        Scene::need(mesh.facets(), mesh.materials(), mesh.bands().min(MAX_BANDS), smooth).bytes()
    }

    fn need(facets: usize, materials: usize, bands: usize, smooth: bool) -> Need {
        let values = materials.saturating_mul(bands);
        Need::new()
            .and::<[Vec3; 3]>(facets)
            .and::<Vec3>(facets)
            .and::<f64>(facets)
            .and::<u32>(facets)
            .and::<[Vec3; 3]>(if smooth { facets } else { 0 })
            .and::<f64>(values)
            .and::<f64>(values)
            .and::<f64>(values)
            .and::<u32>(materials)
            .and::<f64>(materials)
            .and::<u32>(materials)
    }

    /// Checks the mesh and lays the scene out in `memory`.
    ///
    /// # Errors
    /// Everything that is wrong with the input, with the index of the first offender; a buffer below
    /// [`Scene::bytes`]. Facets of zero area are no error: they keep their index and take no part.
    pub fn new(mesh: &dyn Mesh, memory: &'m mut [u8]) -> Result<Scene<'m>, Error> {
        check::sizes(mesh)?;
        check::materials(mesh)?;
        check::mesh(mesh)?;
        let (lowest, half, scale) = placement(mesh)?;
        let needed = Scene::bytes(mesh)?;
        let mut arena = Arena::new(memory, needed)?;
        let facets = mesh.facets();
        let corners = arena.take::<[Vec3; 3]>(facets)?;
        let normals = arena.take::<Vec3>(facets)?;
        let areas = arena.take::<f64>(facets)?;
        let place = |index: u32| (Vec3::from_array(mesh.vertex(index as usize)) - lowest - half) * scale;
        let mut degenerate = 0;
        for (facet, ((corner, normal), area)) in
            corners.iter_mut().zip(normals.iter_mut()).zip(areas.iter_mut()).enumerate()
        {
            *corner = mesh.facet(facet).map(place);
            (*normal, *area) = normal_and_area(corner);
            degenerate += usize::from(*area == 0.0);
        }
        let materials = arena.take::<u32>(facets)?;
        if mesh.facet_materials() > 0 {
            materials.iter_mut().enumerate().for_each(|(facet, to)| *to = mesh.facet_material(facet));
        }
        let corner_normals = lay_normals(mesh, normals, &mut arena)?;
        let (count, bands) = (mesh.materials(), mesh.bands());
        let diffuse = arena.take::<f64>(count * bands)?;
        let specular = arena.take::<f64>(count * bands)?;
        let emission = arena.take::<f64>(count * bands)?;
        let tables = [&mut *diffuse, &mut *specular, &mut *emission];
        lay_values(mesh, tables);
        let mirror = arena.take::<u32>(count)?;
        let gloss_ratio = arena.take::<f64>(count)?;
        let gloss_rays = arena.take::<u32>(count)?;
        lay_mirrors(mesh, specular, mirror, gloss_ratio, gloss_rays);
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
            bands,
            sides: if mesh.two_sided() { 2 } else { 1 },
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
        self.areas.at(facet) / (self.scale * self.scale)
    }

    /// Unit normal of a side of a facet (side 0 front, 1 back).
    #[inline(always)]
    pub fn side_normal(&self, facet: usize, side: usize) -> Vec3 {
        if side == 0 { self.normals.at(facet) } else { -self.normals.at(facet) }
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

    /// Normal for the mirror directions of all points of a side, where they have the same one.
    pub fn flat_normal(&self, facet: usize, side: usize) -> Option<Vec3> {
        match self.corner_normals.get(facet) {
            None => Some(self.side_normal(facet, side)),
            Some([a, b, c]) if a == b && b == c => Some(if side == 0 { *a } else { -*a }),
            Some(_) => None,
        }
    }

    /// True when mirror directions follow interpolated vertex normals.
    pub fn is_smooth(&self) -> bool {
        !self.corner_normals.is_empty()
    }

    /// Index of a facet's material.
    #[inline(always)]
    pub fn material(&self, facet: usize) -> usize {
        self.materials.at(facet) as usize
    }

    /// Number of materials.
    pub fn materials(&self) -> usize {
        self.mirror.len()
    }

    #[inline(always)]
    fn values(&self, table: &'m [f64], material: usize) -> &'m [f64] {
        table.part(material * self.bands..(material + 1) * self.bands)
    }

    /// Diffuse reflectance of a material, one value per band.
    #[inline(always)]
    pub fn diffuse(&self, material: usize) -> &'m [f64] {
        self.values(self.diffuse, material)
    }

    /// Mirror reflectance of a material, one value per band.
    #[inline(always)]
    pub fn specular(&self, material: usize) -> &'m [f64] {
        self.values(self.specular, material)
    }

    /// Own diffuse radiance of a material, one value per band.
    #[inline(always)]
    pub fn emission(&self, material: usize) -> &'m [f64] {
        self.values(self.emission, material)
    }

    /// True where a material sends out diffuse light.
    #[inline]
    pub fn glows(&self, material: usize) -> bool {
        self.diffuse(material).iter().chain(self.emission(material)).any(|&x| x > 0.0)
    }

    /// Mirror class of a material: the index of the first material with the same mirror, or [`NO_MIRROR`].
    #[inline(always)]
    pub fn mirror(&self, material: usize) -> u32 {
        self.mirror.get(material).copied().unwrap_or(NO_MIRROR)
    }

    /// Axis ratio of a material's lobe, or `None` for an ideal mirror.
    #[inline(always)]
    pub fn gloss(&self, material: usize) -> Option<f64> {
        let ratio = self.gloss_ratio.at(material);
        if ratio > 0.0 { Some(ratio) } else { None }
    }

    /// Rays that a material asks for at the first hit of its lobe; `None`: by tolerance.
    pub fn gloss_rays(&self, material: usize) -> Option<u32> {
        match self.gloss_rays.at(material) {
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

    /// Largest diffuse reflectance of a facet over the bands.
    pub fn largest_diffuse_of(&self, facet: usize) -> f64 {
        Scene::largest(self.diffuse(self.material(facet)))
    }

    /// Largest mirror reflectance of the scene.
    pub fn largest_specular(&self) -> f64 {
        Scene::largest(self.specular)
    }

    /// Largest emission of the scene in one band.
    pub fn largest_emission(&self, band: usize) -> f64 {
        self.emission
            .iter()
            .skip(band)
            .step_by(self.bands.max(1))
            .fold(0.0, |a, &b| if b > a { b } else { a })
    }

    /// A point of the caller's coordinates in scene coordinates.
    pub fn to_scene(&self, point: Vec3) -> Vec3 {
        (point - self.lowest - self.half) * self.scale
    }

    /// A point of scene coordinates in the caller's.
    pub fn to_caller(&self, point: Vec3) -> Vec3 {
        point / self.scale + self.half + self.lowest
    }

    /// Scene lengths per length of the caller: a power of two.
    pub fn scale(&self) -> f64 {
        self.scale
    }

    /// Whether another scene has the same facets, at the same places and of the same mirror directions.
    pub fn has_mesh_of(&self, other: &Scene<'_>) -> bool {
        let placed = |s: &Scene<'_>| (s.lowest, s.half, s.scale, s.sides, s.bands);
        placed(self) == placed(other)
            && self.corners == other.corners
            && self.corner_normals == other.corner_normals
    }

    /// Bytes in use.
    pub fn memory(&self) -> usize {
        self.memory
    }
}

/// Facets whose corners have indices of normals.
fn normal_facets(mesh: &dyn Mesh) -> usize {
    match mesh.facet_normals() {
        0 if mesh.normals() > 0 => mesh.facets(),
        told => told,
    }
}

/// Indices of the normals at a facet's corners.
fn corner_normals(mesh: &dyn Mesh, facet: usize) -> [u32; 3] {
    if mesh.facet_normals() > 0 { mesh.facet_normal(facet) } else { mesh.facet(facet) }
}

/// Lowest corner of the bounding box of the used vertices, half its size, and the power of two that scales the
/// half size into (0.5, 1].
fn placement(mesh: &dyn Mesh) -> Result<(Vec3, Vec3, f64), Error> {
    let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    for facet in 0..mesh.facets() {
        for index in mesh.facet(facet) {
            let vertex = Vec3::from_array(mesh.vertex(index as usize));
            low = low.min(vertex);
            high = high.max(vertex);
        }
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

fn lay_normals<'m>(mesh: &dyn Mesh, flat: &[Vec3], arena: &mut Arena<'m>) -> Result<&'m [[Vec3; 3]], Error> {
    let count = mesh.normals();
    if count == 0 {
        return Ok(&[]);
    }
    let normals = arena.take::<[Vec3; 3]>(mesh.facets())?;
    for (facet, (to, &flat)) in normals.iter_mut().zip(flat).enumerate() {
        *to = corner_normals(mesh, facet).map(|i| {
            let told = (i as usize) < count;
            told.then(|| unit(Vec3::from_array(mesh.normal(i as usize)))).flatten().unwrap_or(flat)
        });
    }
    Ok(normals)
}

/// Writes the materials' values into the tables of diffuse, specular and emission.
fn lay_values(mesh: &dyn Mesh, tables: [&mut [f64]; 3]) {
    let [diffuse, specular, emission] = tables.map(|t| pieces(t, mesh.bands()));
    for (index, ((d, s), e)) in diffuse.zip(specular).zip(emission).enumerate() {
        let material = mesh.material(index);
        copy(e, material.emission);
        let told = material.diffuse.iter().zip(material.specular);
        for ((d, s), (&diffuse, &specular)) in d.iter_mut().zip(s).zip(told) {
            (*d, *s) = within_one(diffuse, specular);
        }
    }
}

/// `specular` are the materials' mirror reflectances as they were laid out.
fn lay_mirrors(mesh: &dyn Mesh, specular: &[f64], mirror: &mut [u32], ratio: &mut [f64], rays: &mut [u32]) {
    let of = |index: usize| specular.part(index * mesh.bands()..(index + 1) * mesh.bands());
    let lobe = |m: &MaterialInput<'_>| m.gloss.filter(|g| g.axis_ratio < MIRROR_AXIS_RATIO);
    for (index, ((mirror, ratio), rays)) in mirror.iter_mut().zip(ratio).zip(rays).enumerate() {
        let material = mesh.material(index);
        let gloss = lobe(&material);
        let same = |other: &usize| {
            of(*other) == of(index)
                && lobe(&mesh.material(*other)).map(|g| g.axis_ratio) == gloss.map(|g| g.axis_ratio)
        };
        let first = (0..index).find(same).unwrap_or(index);
        let reflects = of(index).iter().any(|&s| s > 0.0);
        *mirror = if reflects { first as u32 } else { NO_MIRROR };
        *ratio = gloss.map_or(0.0, |g| g.axis_ratio);
        *rays = gloss.and_then(|g| g.rays).unwrap_or(0);
    }
}
