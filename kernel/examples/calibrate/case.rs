//! The calibration's cases: case i is the same in every run.

use super::families::FAMILIES;
use super::setting::{Eye, Setting};
use crate::drawn::Draw;
use crate::drawn::light::lights;
use crate::support::scenes::Mesh;
use crate::support::twin::{Material, Scene, Sky, Sun};
use blik_kernel::camera::{CameraInput, Projection, Sampling};
use glam::{DVec3, dvec3};

/// How many cases there are: thirteen of each kind.
pub const CASES: usize = 13 * FAMILIES.len();

/// A scene, its light, a view and a tolerance.
#[derive(Clone, Debug)]
pub struct Case {
    /// Its number.
    pub index: usize,
    /// Its kind.
    pub family: &'static str,
    /// Facets.
    pub mesh: Mesh,
    /// Material of each index that the mesh names.
    pub materials: Vec<Material>,
    /// Whether backs are like fronts.
    pub two_sided: bool,
    /// The sky, if any.
    pub sky: Option<Sky>,
    /// The sun, if any.
    pub sun: Option<Sun>,
    /// The view.
    pub camera: CameraInput,
    /// The error asked for.
    pub tolerance: f64,
}

impl Case {
    /// Case `index`, below [`CASES`].
    pub fn new(index: usize) -> Case {
        let mut draw = Draw::new(index);
        let (family, build) = FAMILIES[index % FAMILIES.len()];
        let bands = if draw.chance(0.3) { 3 } else { 1 };
        let setting = build(&mut draw, bands);
        let (sky, sun) =
            if setting.dark { (None, None) } else { lights(&mut draw, bands, setting.sun, setting.suns) };
        let tolerance = match draw.whole(0, 9) {
            0..=2 => 1e-2,
            3..=7 => 2e-3,
            _ if setting.rough => 2e-3,
            _ => 5e-4,
        };
        let camera = camera(&mut draw, &setting);
        let Setting { mesh, materials, two_sided, .. } = setting;
        Case { index, family, mesh, materials, two_sided, sky, sun, camera, tolerance }
    }

    /// The scene as the twin and the judge take it, without the images of the sun that the twin alone needs.
    pub fn scene(&self) -> Scene {
        let mut scene = Scene::new(&self.mesh, &self.materials).two_sided(self.two_sided);
        (scene.sky, scene.sun) = (self.sky.clone(), self.sun.clone());
        scene
    }

    /// Light, sides, bands and sampling in a word each.
    pub fn summary(&self) -> String {
        let sky = self.sky.as_ref().map_or("no sky".into(), |s| {
            format!("{:?}", s.model).split([' ', '{']).next().unwrap_or_default().to_lowercase()
        });
        let sun = match self.sun.as_ref().map(|s| s.half_angle.to_degrees()) {
            None => "no sun".into(),
            Some(0.0) => "point sun".into(),
            Some(degrees) => format!("sun {degrees:.2} deg"),
        };
        let sides = if self.two_sided { "two-sided" } else { "one-sided" };
        let bands = self.materials[0].diffuse.len();
        let view = match self.camera.projection {
            Projection::Orthographic { .. } => "orthographic",
            Projection::Perspective { .. } => "perspective",
        };
        format!("{sky}; {sun}; {sides}; {bands} band; {view}; {:?}", self.camera.sampling).to_lowercase()
    }
}

fn camera(draw: &mut Draw, setting: &Setting) -> CameraInput {
    let side = draw.whole(22, 36);
    let (columns, rows) = (side + draw.whole(0, 8), side);
    let sampling = draw.pick(&[Sampling::Area, Sampling::Centre]);
    let perspective = draw.chance(0.5) || matches!(setting.eye, Eye::Within(_));
    let direction = match setting.eye {
        Eye::Outside => draw.direction(10.0, 70.0),
        Eye::Around => draw.direction(-50.0, 70.0),
        Eye::Above => draw.direction(40.0, 85.0),
        Eye::Octant => draw.point(0.3, 1.0).normalize(),
        Eye::Within(size) => {
            // from one wall to the opposite one
            let inside = dvec3(0.42, 0.42, 0.85) * size;
            let eye = dvec3(-inside.x, draw.real(-inside.y, inside.y), draw.real(0.5, 1.0) * inside.z);
            let target = dvec3(inside.x, draw.real(-inside.y, inside.y), draw.real(0.0, 0.6) * inside.z);
            let projection = Projection::Perspective { fov_deg: draw.real(50.0, 95.0) };
            return view(projection, eye, target, [columns, rows], sampling);
        }
    };
    let points = || setting.mesh.vertices.iter().map(|v| DVec3::from(*v));
    let low = points().fold(DVec3::INFINITY, DVec3::min);
    let high = points().fold(DVec3::NEG_INFINITY, DVec3::max);
    let (middle, radius) = ((low + high) / 2.0, (high - low).length() / 2.0);
    let away = radius * draw.real(1.6, 5.0);
    let right = DVec3::Z.cross(direction).normalize();
    let up = direction.cross(right);
    // half the image's height that shows the whole scene, at the scene or at distance 1
    let half = points()
        .map(|p| p - middle)
        .map(|p| {
            let size = (p.dot(right).abs() * rows as f64 / columns as f64).max(p.dot(up).abs());
            if perspective { size / (away - p.dot(direction)) } else { size }
        })
        .fold(0.0, f64::max);
    let half = half * draw.real(0.7, 1.05);
    let projection = if perspective {
        Projection::Perspective { fov_deg: 2.0 * half.atan().to_degrees() }
    } else {
        Projection::Orthographic { height: 2.0 * half }
    };
    view(projection, middle + direction * away, middle, [columns, rows], sampling)
}

fn view(
    projection: Projection,
    eye: DVec3,
    target: DVec3,
    [columns, rows]: [usize; 2],
    sampling: Sampling,
) -> CameraInput {
    let (eye, target) = (eye.to_array(), target.to_array());
    CameraInput { projection, eye, target, up: [0.0, 0.0, 1.0], columns, rows, sampling }
}
