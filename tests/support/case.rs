//! Owned scenes, lights and cameras of the tests that hold the kernel to identities, and a run of the kernel's
//! owning layer over them.
#![allow(dead_code)]

use crate::support::scenes::Mesh;
use crate::support::twin::Material;
use blik_kernel::camera::{CameraInput, Projection, Sampling};
use blik_kernel::host::{Geometry, GeometryMemory, Host, Image, Lit, Report, Seconds, Settings};
use blik_kernel::scene::{Gloss, MaterialInput, SceneInput};
use blik_kernel::sky::{SkyInput, SkyModel};
use blik_kernel::sun::SunInput;

/// A sky that owns its values.
#[derive(Clone, Debug)]
pub struct SkyOf {
    pub model: SkyModel<'static>,
    pub radiance: Vec<f64>,
    pub ground: Vec<f64>,
    pub up: [f64; 3],
}

impl SkyOf {
    /// The same model in all bands, up along +z.
    pub fn new(model: SkyModel<'static>, radiance: &[f64], ground: &[f64]) -> SkyOf {
        SkyOf { model, radiance: radiance.into(), ground: ground.into(), up: [0.0, 0.0, 1.0] }
    }

    /// Radiance 1 over the whole sphere in `bands` bands.
    pub fn uniform(bands: usize) -> SkyOf {
        SkyOf::new(SkyModel::Uniform, &vec![1.0; bands], &vec![0.0; bands])
    }

    pub fn input(&self) -> SkyInput<'_> {
        SkyInput { model: self.model, radiance: &self.radiance, ground: &self.ground, up: self.up }
    }
}

/// A sun that owns its values.
#[derive(Clone, Debug)]
pub struct SunOf {
    pub direction: [f64; 3],
    pub irradiance: Vec<f64>,
    pub half_angle_deg: f64,
}

impl SunOf {
    pub fn new(direction: [f64; 3], irradiance: &[f64], half_angle_deg: f64) -> SunOf {
        SunOf { direction, irradiance: irradiance.into(), half_angle_deg }
    }

    pub fn input(&self) -> SunInput<'_> {
        let (direction, half_angle_deg) = (self.direction, self.half_angle_deg);
        SunInput { direction, irradiance: &self.irradiance, half_angle_deg }
    }
}

/// A lit scene.
#[derive(Clone, Debug)]
pub struct Case {
    pub mesh: Mesh,
    pub materials: Vec<Material>,
    /// Rays at the first hit of every lobe.
    pub gloss_rays: Option<u32>,
    /// One normal per vertex, or none.
    pub normals: Vec<[f64; 3]>,
    pub two_sided: bool,
    pub sky: Option<SkyOf>,
    pub sun: Option<SunOf>,
}

/// What a facet's side receives and sends.
#[derive(Clone, Debug, PartialEq)]
pub struct Side {
    pub facet: usize,
    pub area: f64,
    pub irradiance: Vec<f64>,
    pub radiance: Vec<f64>,
}

/// Everything that a run brings.
pub struct Outcome {
    pub image: Image,
    pub sides: Vec<Side>,
    /// The report of geometry and light, before any view.
    pub lit: Report,
}

impl Outcome {
    /// The bits of all pixels and of all three components.
    pub fn pixel_bits(&self) -> Vec<u32> {
        let components = self.image.components.iter().flatten().flatten();
        self.image.pixels.iter().chain(components).map(|p| p.to_bits()).collect()
    }

    /// The bits of all irradiances and diffuse radiances.
    pub fn facet_bits(&self) -> Vec<u64> {
        let values =
            |s: &Side| s.irradiance.iter().chain(&s.radiance).map(|x| x.to_bits()).collect::<Vec<_>>();
        self.sides.iter().flat_map(values).collect()
    }
}

/// A report without what no two runs share.
pub fn timeless(report: &Report) -> Report {
    Report { seconds: Seconds::default(), ..report.clone() }
}

impl Case {
    /// One-sided facets in the dark; `materials[mesh.materials[f]]` is the material of facet f.
    pub fn new(mesh: Mesh, materials: &[Material]) -> Case {
        let materials = materials.to_vec();
        Case {
            mesh,
            materials,
            gloss_rays: None,
            normals: Vec::new(),
            two_sided: false,
            sky: None,
            sun: None,
        }
    }

    pub fn sky(mut self, sky: SkyOf) -> Case {
        self.sky = Some(sky);
        self
    }

    pub fn sun(mut self, sun: SunOf) -> Case {
        self.sun = Some(sun);
        self
    }

    pub fn two_sided(mut self) -> Case {
        self.two_sided = true;
        self
    }

    pub fn bands(&self) -> usize {
        self.materials[0].diffuse.len()
    }

    /// Calls `with` with the scene as the kernel takes it.
    pub fn with_input<R>(&self, with: impl FnOnce(&SceneInput<'_>) -> R) -> R {
        let lobe = |ratio| Gloss { axis_ratio: ratio, rays: self.gloss_rays };
        let material = |m: &'_ Material| m.gloss.map(lobe);
        let materials: Vec<MaterialInput<'_>> = self
            .materials
            .iter()
            .map(|m| MaterialInput {
                diffuse: &m.diffuse,
                specular: &m.specular,
                emission: &m.emission,
                gloss: material(m),
            })
            .collect();
        with(&SceneInput {
            vertices: &self.mesh.vertices,
            facets: &self.mesh.facets,
            facet_materials: &self.mesh.materials,
            normals: &self.normals,
            facet_normals: &[],
            materials: &materials,
            two_sided: self.two_sided,
            bands: self.bands(),
        })
    }

    /// Calls `with` with the scene's geometry, coupling included.
    pub fn with_geometry<R>(
        &self,
        threads: usize,
        settings: &Settings,
        with: impl FnOnce(&Host, &Geometry<'_>) -> R,
    ) -> R {
        let host = Host::new(threads).unwrap();
        let mut memory = GeometryMemory::default();
        self.with_input(|input| {
            let geometry = host.geometry(&mut memory, input, settings).unwrap();
            with(&host, &geometry)
        })
    }

    /// Calls `with` with the solved scene.
    pub fn with_lit<R>(
        &self,
        threads: usize,
        settings: &Settings,
        with: impl FnOnce(&Host, &Lit<'_>) -> R,
    ) -> R {
        self.with_geometry(threads, settings, |host, geometry| {
            let (sky, sun) = (self.sky.as_ref().map(SkyOf::input), self.sun.as_ref().map(SunOf::input));
            let lit = host.light(geometry, sky.as_ref(), sun.as_ref()).unwrap();
            with(host, &lit)
        })
    }

    /// A whole run on a number of threads.
    pub fn run(&self, threads: usize, settings: &Settings, camera: &CameraInput) -> Outcome {
        self.with_lit(threads, settings, |host, lit| outcome(host, lit, camera))
    }
}

/// A view of a solved scene.
pub fn outcome(host: &Host, lit: &Lit<'_>, camera: &CameraInput) -> Outcome {
    let image = host.image(lit, camera, true).unwrap();
    Outcome { image, sides: sides(lit), lit: lit.report().clone() }
}

/// What all sides receive and send.
pub fn sides(lit: &Lit<'_>) -> Vec<Side> {
    let mut sides = Vec::new();
    lit.facets(|facet, _, area, irradiance, radiance| {
        sides.push(Side { facet, area, irradiance: irradiance.into(), radiance: radiance.into() });
    });
    sides
}

/// Settings of a tolerance, all else by default.
pub fn within(tolerance: f64) -> Settings {
    Settings { tolerance, ..Settings::default() }
}

/// An orthographic camera with square pixels, one ray through the centre of each.
pub fn orthographic(eye: [f64; 3], target: [f64; 3], height: f64, pixels: usize) -> CameraInput {
    CameraInput {
        projection: Projection::Orthographic { height },
        eye,
        target,
        up: [0.0, 0.0, 1.0],
        columns: pixels,
        rows: pixels,
        sampling: Sampling::Centre,
    }
}

/// A perspective camera, one ray through the centre of each pixel.
pub fn perspective(eye: [f64; 3], target: [f64; 3], fov_deg: f64, pixels: usize) -> CameraInput {
    CameraInput { projection: Projection::Perspective { fov_deg }, ..orthographic(eye, target, 1.0, pixels) }
}

/// Eq. 16 between two images, over all pixels: rms difference relative to a reference radiance of 1.
pub fn rms(a: &[f32], b: &[f32]) -> f64 {
    assert_eq!(a.len(), b.len());
    let sum: f64 = a.iter().zip(b).map(|(a, b)| (f64::from(*a) - f64::from(*b)).powi(2)).sum();
    (sum / a.len() as f64).sqrt()
}
