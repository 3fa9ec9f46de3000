//! The scenes that the benches measure, of any size and finish.

#[path = "../../tests/support/scenes/mod.rs"]
#[allow(dead_code, unused_imports)]
mod scenes;

use blik_kernel::camera::{CameraInput, Projection, Sampling};
use blik_kernel::host::{Geometry, GeometryMemory, Host, Lit, Settings};
use blik_kernel::scene::{MaterialInput, SceneInput};
use blik_kernel::sky::{SkyInput, SkyModel};
use blik_kernel::sun::SunInput;
use glam::DVec3;
pub use scenes::Mesh;

/// A shallow bowl with bumps over the square [-1, 1]^2, of 2 n^2 facets: concave, and every facet is partly hidden
/// from many others. The same shape for all n.
pub fn bowl(n: usize) -> Mesh {
    let mut mesh = Mesh::default();
    mesh.rectangle(DVec3::new(-1.0, -1.0, 0.0), DVec3::X * 2.0, DVec3::Y * 2.0, n, 0);
    mesh.mapped(|p| {
        let bumps = (7.0 * p.x).sin() * (7.0 * p.y).sin();
        p.with_z(0.6 * (p.x * p.x + p.y * p.y) + 0.06 * bumps)
    })
}

/// A convex body of 320 facets, fronts outward.
pub fn sphere() -> Mesh {
    scenes::sphere(2)
}

/// A mesh and its finishes.
pub struct Case {
    pub mesh: Mesh,
    /// Diffuse and specular reflectance of each material; each band has the same.
    pub finishes: Vec<(f64, f64)>,
    pub bands: usize,
    pub settings: Settings,
}

impl Case {
    /// One finish, one band, tolerance 2e-3.
    pub fn new(mesh: Mesh, diffuse: f64, specular: f64) -> Case {
        Case { mesh, finishes: vec![(diffuse, specular)], bands: 1, settings: Settings::default() }
    }

    /// Gives the second finish to the share `share` of all facets, spread evenly.
    pub fn mixed(mut self, share: f64, diffuse: f64, specular: f64) -> Case {
        let upto = |facet: usize| (facet as f64 * share) as usize;
        for (facet, material) in self.mesh.materials.iter_mut().enumerate() {
            *material = u32::from(upto(facet + 1) > upto(facet));
        }
        self.finishes.push((diffuse, specular));
        self
    }

    /// Calls `with` with the scene as the kernel takes it.
    pub fn with_input<R>(&self, with: impl FnOnce(&SceneInput<'_>) -> R) -> R {
        let per_band = |value: f64| vec![value; self.bands];
        let (diffuse, specular): (Vec<_>, Vec<_>) =
            self.finishes.iter().map(|&(d, s)| (per_band(d), per_band(s))).unzip();
        let emission = per_band(0.0);
        let finish =
            |(diffuse, specular)| MaterialInput { diffuse, specular, emission: &emission, gloss: None };
        let both = diffuse.iter().map(Vec::as_slice).zip(specular.iter().map(Vec::as_slice));
        let materials: Vec<MaterialInput<'_>> = both.map(finish).collect();
        with(&SceneInput {
            vertices: &self.mesh.vertices,
            facets: &self.mesh.facets,
            facet_materials: &self.mesh.materials,
            normals: &[],
            facet_normals: &[],
            materials: &materials,
            two_sided: false,
            bands: self.bands,
        })
    }

    /// Scene, tree, elements and coupling.
    pub fn geometry<'m>(&self, host: &Host, memory: &'m mut GeometryMemory) -> Geometry<'m> {
        self.with_input(|input| host.geometry(memory, input, &self.settings)).expect("a sound scene")
    }

    /// Everything, from the arrays to the image in memory; returns one pixel.
    pub fn cold(&self, host: &Host, sky: SkyModel<'static>, sun: bool, pixels: usize) -> f32 {
        let mut memory = GeometryMemory::default();
        let geometry = self.geometry(host, &mut memory);
        let values = Values::new(self.bands);
        image(host, &values.light(host, &geometry, sky, sun), EYE, pixels)
    }
}

/// Light of each band.
pub struct Values {
    radiance: Vec<f64>,
    ground: Vec<f64>,
    sun: Vec<f64>,
}

impl Values {
    pub fn new(bands: usize) -> Values {
        Values { radiance: vec![1.0; bands], ground: vec![0.1; bands], sun: vec![2.0; bands] }
    }

    /// The scene under a sky of zenith radiance 1 over darker ground, with the sun or without.
    pub fn light<'g>(
        &'g self,
        host: &Host,
        geometry: &'g Geometry<'g>,
        model: SkyModel<'g>,
        sun: bool,
    ) -> Lit<'g> {
        let sky = SkyInput { model, radiance: &self.radiance, ground: &self.ground, up: [0.0, 0.0, 1.0] };
        let sun = sun.then_some(SunInput {
            direction: [0.3, 0.2, 1.0],
            irradiance: &self.sun,
            half_angle_deg: 0.2665,
        });
        host.light(geometry, Some(&sky), sun.as_ref()).expect("a sound light")
    }
}

/// Where the camera stands, and where it goes for a new view.
pub const EYE: [f64; 3] = [2.0, 2.1, 4.0];
pub const OTHER_EYE: [f64; 3] = [-1.0, 2.5, 4.0];

/// A camera whose image is `height` high, of `pixels` x `pixels`; the scenes measure about 2.
pub fn camera(eye: [f64; 3], height: f64, pixels: usize) -> CameraInput {
    CameraInput {
        projection: Projection::Orthographic { height },
        eye,
        target: [0.0, 0.0, 0.3],
        up: [0.0, 0.0, 1.0],
        columns: pixels,
        rows: pixels,
        sampling: Sampling::Area,
    }
}

/// Makes an image in which the object is large; one pixel of it.
pub fn image(host: &Host, lit: &Lit<'_>, eye: [f64; 3], pixels: usize) -> f32 {
    host.image(lit, &camera(eye, 2.6, pixels), false).expect("a sound camera").pixels[0]
}
