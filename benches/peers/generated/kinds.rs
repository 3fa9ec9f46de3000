//! The kinds of scenes: bodies, materials, light and view of each, drawn.

use super::{Generated, PIXELS};
use crate::drawn::Draw;
use crate::drawn::light::{glossy, material, tinted};
use crate::drawn::shapes::{
    craft, cuboid, cylinder, dish, floor, revolved, room, room_with_hole, sheet, terrain,
};
use crate::support::scenes::{Mesh, box_open, sphere};
use crate::support::twin::{Material, Model, Sky, Sun};
use blik_kernel::camera::{CameraInput, Projection, Sampling};
use glam::{DVec3, dvec3};
use std::f64::consts::FRAC_PI_2;

/// How a scene of a kind is drawn.
type Kind = fn(&mut Draw) -> Generated;

/// All kinds.
pub const KINDS: [(&str, Kind); 31] = [
    ("atrium", atrium),
    ("bodies_through_each_other", bodies_through_each_other),
    ("bowl", bowl),
    ("canyon", canyon),
    ("cavity", cavity),
    ("city_sun", city_sun),
    ("convex_room", convex_room),
    ("courtyard", courtyard),
    ("craft_cut", craft_cut),
    ("craft_diffuse", craft_diffuse),
    ("cylinder_bank", cylinder_bank),
    ("dish", dish_antenna),
    ("fins", fins),
    ("foliage", foliage),
    ("gloss", gloss),
    ("hills", hills),
    ("inlet", inlet),
    ("louvre", louvre),
    ("mirror_pipe", mirror_pipe),
    ("mirror_wall", mirror_wall),
    ("nested_boxes", nested_boxes),
    ("room_lamps", room_lamps),
    ("room_window", room_window),
    ("satellite", satellite),
    ("sheets", sheets),
    ("small_box", small_box),
    ("sphere_mirror", sphere_mirror),
    ("stairs", stairs),
    ("table_sky", table_sky),
    ("three_bands", three_bands),
    ("vehicle", vehicle),
];

/// Bodies and materials, in the dark and without a view.
struct Setting {
    mesh: Mesh,
    materials: Vec<Material>,
    two_sided: bool,
    sky: Option<Sky>,
    sun: Option<Sun>,
}

impl Setting {
    fn new(mesh: Mesh, materials: Vec<Material>) -> Setting {
        Setting { mesh, materials, two_sided: false, sky: None, sun: None }
    }

    fn two_sided(self) -> Setting {
        Setting { two_sided: true, ..self }
    }

    /// Under a sky of radiance 1 over a ground of that radiance, up along +z.
    fn sky(self, model: Model, ground: f64) -> Setting {
        let bands = self.materials[0].diffuse.len();
        let sky = Sky { model, radiance: vec![1.0; bands], ground: vec![ground; bands], up: DVec3::Z };
        Setting { sky: Some(sky), ..self }
    }

    /// With a sun of a drawn direction and that half-angle in degrees; 0: a point.
    fn sun(self, draw: &mut Draw, half_angle_deg: f64) -> Setting {
        let irradiance = tinted(draw, self.materials[0].diffuse.len(), 1.0, 3.5);
        let (direction, half_angle) = (draw.direction(25.0, 65.0), half_angle_deg.to_radians());
        Setting { sun: Some(Sun { direction, irradiance, half_angle }), ..self }
    }

    /// Seen along parallel rays from a direction of an elevation in degrees within the range: the bounding ball's part
    /// `zoom` fills the image's height.
    fn outside(self, draw: &mut Draw, low_deg: f64, high_deg: f64, zoom: f64) -> Generated {
        let direction = draw.direction(low_deg, high_deg);
        self.from(direction, zoom)
    }

    fn from(self, direction: DVec3, zoom: f64) -> Generated {
        let points = || self.mesh.vertices.iter().map(|v| DVec3::from(*v));
        let low = points().fold(DVec3::INFINITY, DVec3::min);
        let high = points().fold(DVec3::NEG_INFINITY, DVec3::max);
        let (middle, radius) = ((low + high) / 2.0, (high - low).length() / 2.0);
        let projection = Projection::Orthographic { height: 2.0 * radius * zoom };
        self.seen(projection, middle + direction * 3.0 * radius, middle)
    }

    /// Seen from a point.
    fn within(self, eye: DVec3, target: DVec3, fov_deg: f64) -> Generated {
        self.seen(Projection::Perspective { fov_deg }, eye, target)
    }

    fn seen(self, projection: Projection, eye: DVec3, target: DVec3) -> Generated {
        let Setting { mesh, materials, two_sided, sky, sun } = self;
        let camera = CameraInput {
            projection,
            eye: eye.to_array(),
            target: target.to_array(),
            up: [0.0, 0.0, 1.0],
            columns: PIXELS,
            rows: PIXELS,
            sampling: Sampling::Centre,
        };
        Generated { mesh, materials, two_sided, sky, sun, camera }
    }
}

/// A diffuse material of a reflectance near `middle`.
fn diffuse(draw: &mut Draw, middle: f64) -> Material {
    Material::new(middle * draw.real(0.9, 1.1), 0.0)
}

/// A box of that size that stands on z = 0 at (x, y).
fn standing(size: DVec3, [x, y]: [f64; 2], material: u32) -> Mesh {
    cuboid(size).translated([x, y, size.z / 2.0]).of_material(material)
}

fn joined(bodies: impl IntoIterator<Item = Mesh>) -> Mesh {
    bodies.into_iter().fold(Mesh::default(), |all, body| all.joined(&body))
}

/// A deep shaft of bright walls.
fn atrium(draw: &mut Draw) -> Generated {
    let depth = draw.real(1.5, 3.0);
    let mesh = box_open(1.0, 1.0, depth, 3);
    let setting = Setting::new(mesh, vec![diffuse(draw, 0.4), diffuse(draw, 0.8)]);
    let eye = dvec3(0.9, 0.85, 0.98 * depth);
    setting.sky(Model::Overcast, 0.0).within(eye, dvec3(0.35, 0.4, 0.3 * depth), 75.0)
}

fn bodies_through_each_other(draw: &mut Draw) -> Generated {
    let mut mesh = floor(3.0, 3.0, 1);
    for i in 0..5 {
        let body = match i % 3 {
            0 => sphere(2).scaled(draw.real(0.3, 0.5)),
            1 => cylinder(draw.real(0.15, 0.3), draw.real(0.8, 1.4), 16),
            _ => cuboid(draw.point(0.4, 0.9)),
        };
        let at = [draw.real(-0.5, 0.5), draw.real(-0.5, 0.5), draw.real(0.1, 0.6)];
        let turned = body.rotated([1.0, 2.0, 0.5], draw.real(0.0, 3.0)).translated(at);
        mesh = mesh.joined(&turned.of_material(1 + i % 2));
    }
    let materials = vec![diffuse(draw, 0.3), diffuse(draw, 0.6), diffuse(draw, 0.7)];
    Setting::new(mesh, materials).sky(Model::Hemisphere, 0.1).outside(draw, 25.0, 55.0, 0.7)
}

/// A finely tessellated bowl.
fn bowl(draw: &mut Draw) -> Generated {
    let mesh = dish(draw.real(0.5, 0.9), 70, true);
    let materials = vec![diffuse(draw, 0.4)];
    Setting::new(mesh, materials).sky(Model::Uniform, 0.0).outside(draw, 40.0, 70.0, 0.7)
}

/// A street between two rows of houses.
fn canyon(draw: &mut Draw) -> Generated {
    let mut mesh = floor(8.0, 3.4, 1);
    for row in [-1.0, 1.0] {
        for i in 0..5 {
            let size = dvec3(draw.real(1.0, 1.4), 1.0, draw.real(0.8, 2.2));
            mesh = mesh.joined(&standing(size, [1.5 * f64::from(i) - 3.0, 1.1 * row], 1));
        }
    }
    let setting = Setting::new(mesh, vec![diffuse(draw, 0.2), diffuse(draw, 0.5)]).sky(Model::Overcast, 0.1);
    setting.within(dvec3(-3.9, draw.real(-0.3, 0.3), 0.35), dvec3(0.0, 0.0, 0.6), 60.0)
}

fn cavity(draw: &mut Draw) -> Generated {
    let [width, depth, height] = [draw.real(0.9, 1.2), draw.real(0.9, 1.2), draw.real(0.7, 1.2)];
    let mesh = box_open(width, depth, height, 4);
    let materials = vec![diffuse(draw, 0.6), diffuse(draw, 0.7)];
    Setting::new(mesh, materials).sky(Model::Uniform, 0.0).outside(draw, 50.0, 75.0, 0.7)
}

/// Blocks that throw soft shadows.
fn city_sun(draw: &mut Draw) -> Generated {
    let mut mesh = floor(3.0, 3.0, 1);
    for i in 0..16 {
        let size = dvec3(draw.real(0.25, 0.5), draw.real(0.25, 0.5), draw.scale(0.15, 1.2));
        let at = [f64::from(i % 4), f64::from(i / 4)].map(|k| 0.65 * (k - 1.5));
        mesh = mesh.joined(&standing(size, at, 1));
    }
    let materials = vec![diffuse(draw, 0.2), diffuse(draw, 0.5)];
    let setting = Setting::new(mesh, materials).sky(Model::Overcast, 0.1).sun(draw, 2.0);
    setting.outside(draw, 30.0, 60.0, 0.75)
}

/// A closed room of twelve facets with a luminous ceiling: nothing is hidden in it.
fn convex_room(draw: &mut Draw) -> Generated {
    let size = draw.point(0.8, 1.4);
    let mesh = room(size).with_materials(&[0, 0, 1, 1, 0, 0, 0, 0, 2, 2, 2, 2]);
    let materials = vec![diffuse(draw, 0.5), diffuse(draw, 0.3).emitting(1.0), diffuse(draw, 0.7)];
    let eye = dvec3(-0.45, -0.4, 0.5) * size;
    Setting::new(mesh, materials).within(eye, dvec3(0.3, 0.3, 0.4) * size, 80.0)
}

fn courtyard(draw: &mut Draw) -> Generated {
    let height = draw.real(0.6, 1.2);
    let (long, short) = (dvec3(3.0, 0.5, height), dvec3(0.5, 2.0, height));
    let mesh = joined([
        floor(4.0, 4.0, 1),
        standing(long, [0.0, -1.25], 1),
        standing(long, [0.0, 1.25], 1),
        standing(short, [-1.25, 0.0], 1),
        standing(short, [1.25, 0.0], 1),
        standing(dvec3(0.4, 0.4, 0.5), [draw.real(-0.5, 0.5), draw.real(-0.5, 0.5)], 2),
    ]);
    let materials = vec![diffuse(draw, 0.25), diffuse(draw, 0.55), diffuse(draw, 0.4)];
    let setting = Setting::new(mesh, materials).sky(Model::Overcast, 0.2).sun(draw, 0.2665);
    setting.outside(draw, 45.0, 65.0, 0.6)
}

/// An aircraft of mostly mirror, finely cut: facets that change nothing.
fn craft_cut(draw: &mut Draw) -> Generated {
    let mesh = craft(draw).subdivided(2);
    let materials = vec![Material::new(0.1, 0.3), Material::new(0.1, 0.3)];
    Setting::new(mesh, materials).sky(Model::Uniform, 0.0).outside(draw, 10.0, 50.0, 0.8)
}

fn craft_diffuse(draw: &mut Draw) -> Generated {
    let mesh = craft(draw).subdivided(1);
    let materials = vec![diffuse(draw, 0.4), diffuse(draw, 0.4)];
    Setting::new(mesh, materials).sky(Model::Hemisphere, 0.0).outside(draw, 10.0, 50.0, 0.8)
}

fn cylinder_bank(draw: &mut Draw) -> Generated {
    let mut mesh = floor(3.0, 3.0, 1);
    for i in 0..16 {
        let (radius, height) = (draw.real(0.12, 0.25), draw.real(0.4, 1.2));
        let [x, y] = [f64::from(i % 4), f64::from(i / 4)].map(|k| 0.65 * (k - 1.5));
        mesh = mesh.joined(&cylinder(radius, height, 24).translated([x, y, height / 2.0]).of_material(1));
    }
    let materials = vec![diffuse(draw, 0.3), diffuse(draw, 0.6)];
    Setting::new(mesh, materials).sky(Model::Overcast, 0.1).outside(draw, 25.0, 55.0, 0.75)
}

/// A reflector on its mast with the feed on three struts.
fn dish_antenna(draw: &mut Draw) -> Generated {
    let (bend, thick) = (draw.real(0.25, 0.45), 0.03);
    let ring = |i: usize| i as f64 / 8.0;
    let mut profile: Vec<_> = (0..=8).map(|i| [ring(i), bend * ring(i).powi(2) - thick]).collect();
    profile.extend((0..=8).rev().map(|i| [ring(i), bend * ring(i).powi(2)]));
    let focus = 0.25 / bend;
    let mut bodies =
        vec![revolved(&profile, 32), cylinder(0.06, 0.2, 16).translated([0.0, 0.0, focus]).of_material(1)];
    for i in 0..3 {
        let (foot, head) = (dvec3(0.95, 0.0, bend * 0.9), dvec3(0.05, 0.0, focus));
        let length = (head - foot).length();
        let lean = (head.x - foot.x).atan2(head.z - foot.z);
        let strut = cuboid(dvec3(0.025, 0.025, length)).rotated([0.0, 1.0, 0.0], lean);
        let strut = strut.translated(((foot + head) / 2.0).to_array());
        bodies.push(strut.rotated([0.0, 0.0, 1.0], 2.1 * f64::from(i)).of_material(1));
    }
    let head = joined(bodies).rotated([0.0, 1.0, 0.0], draw.real(0.4, 0.9)).translated([0.0, 0.0, 1.2]);
    let mast = standing(dvec3(0.15, 0.15, 1.1), [0.0, 0.0], 1);
    let mesh = joined([head, mast, floor(4.0, 4.0, 1).of_material(2)]);
    let materials = vec![diffuse(draw, 0.7), diffuse(draw, 0.4), diffuse(draw, 0.2)];
    let setting = Setting::new(mesh, materials).sky(Model::Overcast, 0.1).sun(draw, 0.0);
    setting.outside(draw, 20.0, 50.0, 0.5)
}

/// Cooling fins on a plate.
fn fins(draw: &mut Draw) -> Generated {
    let (count, height) = (draw.whole(8, 12), draw.real(0.4, 0.7));
    let place = |i: usize| [2.0 * (i as f64 + 0.5) / count as f64 - 1.0, 0.0];
    let fins = (0..count).map(|i| standing(dvec3(0.04, 1.8, height), place(i), 0));
    let mesh = joined([floor(2.2, 2.2, 1)].into_iter().chain(fins));
    let materials = vec![diffuse(draw, 0.6)];
    Setting::new(mesh, materials).sky(Model::Uniform, 0.0).outside(draw, 35.0, 60.0, 0.75)
}

/// Hundreds of small leaves over a lawn.
fn foliage(draw: &mut Draw) -> Generated {
    let mut mesh = floor(3.0, 3.0, 1);
    for _ in 0..400 {
        let at = draw.direction(-60.0, 90.0) * draw.real(0.4, 0.8) + dvec3(0.0, 0.0, 1.2);
        let leaf = sheet(draw).scaled(0.12).translated(at.to_array());
        mesh = mesh.joined(&leaf.of_material(1));
    }
    let materials = vec![diffuse(draw, 0.2), diffuse(draw, 0.4)];
    let setting = Setting::new(mesh, materials).two_sided().sky(Model::Gradient, 0.2).sun(draw, 0.2665);
    setting.outside(draw, 15.0, 40.0, 0.6)
}

/// A glossy body on a floor.
fn gloss(draw: &mut Draw) -> Generated {
    let body = sphere(3).scaled(0.5).translated([0.0, 0.0, 0.55]);
    let mesh = floor(2.4, 2.4, 1).joined(&body.of_material(1));
    let materials = vec![diffuse(draw, 0.4), glossy(draw, 1)];
    Setting::new(mesh, materials).sky(Model::Overcast, 0.1).outside(draw, 25.0, 55.0, 0.75)
}

fn hills(draw: &mut Draw) -> Generated {
    let mesh = terrain(draw, 48);
    let setting = Setting::new(mesh, vec![diffuse(draw, 0.3)]).sky(Model::Hemisphere, 0.0).sun(draw, 0.0);
    setting.outside(draw, 25.0, 50.0, 0.7)
}

/// An engine's inlet, half a mirror.
fn inlet(draw: &mut Draw) -> Generated {
    let depth = draw.real(0.4, 1.0);
    let profile = [
        [0.0, -1.0],
        [0.6, -1.0],
        [0.63, 0.2],
        [0.59, 0.9],
        [0.52, 1.0],
        [0.46, 0.9],
        [0.42, 0.5 - 0.5 * depth],
        [0.45, -depth],
        [0.12, -depth],
        [0.0, 0.25 - depth],
    ];
    let mesh = revolved(&profile, 36).rotated([0.0, 1.0, 0.0], FRAC_PI_2);
    let setting = Setting::new(mesh, vec![Material::new(0.35, 0.35)]).sky(Model::Hemisphere, 0.2);
    setting.from(dvec3(1.0, draw.real(0.1, 0.4), draw.real(0.1, 0.4)).normalize(), 0.6)
}

/// Slats before a wall.
fn louvre(draw: &mut Draw) -> Generated {
    let (count, lean) = (14, draw.real(0.3, 0.9));
    let slat = |i: usize| {
        let slat = cuboid(dvec3(0.22, 1.8, 0.012)).rotated([0.0, 1.0, 0.0], lean);
        slat.translated([0.25, 0.0, 1.9 * (i as f64 + 0.5) / count as f64 + 0.05])
    };
    let mut wall = Mesh::default();
    wall.rectangle(dvec3(0.0, -1.0, 0.0), DVec3::Y * 2.0, DVec3::Z * 2.0, 1, 1);
    let mesh = joined((0..count).map(slat).chain([wall, floor(4.0, 2.0, 1).translated([2.0, 0.0, 0.0])]));
    let setting = Setting::new(mesh, vec![diffuse(draw, 0.6), diffuse(draw, 0.7)]).sky(Model::Overcast, 0.1);
    setting.from(dvec3(1.0, draw.real(-0.5, 0.5), draw.real(0.3, 0.7)).normalize(), 0.6)
}

/// A light pipe: mirror walls over a diffuse floor.
fn mirror_pipe(draw: &mut Draw) -> Generated {
    let height = draw.real(1.5, 2.5);
    let mesh = box_open(1.0, 1.0, height, 1);
    let materials = vec![diffuse(draw, 0.5), Material::new(0.0, draw.real(0.85, 0.95))];
    let setting = Setting::new(mesh, materials).sky(Model::Overcast, 0.0);
    setting.within(dvec3(0.85, 0.75, 0.97 * height), dvec3(0.2, 0.3, 0.4 * height), 75.0)
}

/// An open box with one mirror among its walls and a body within.
fn mirror_wall(draw: &mut Draw) -> Generated {
    let case = box_open(1.2, 1.2, 0.8, 2).translated([-0.6, -0.6, 0.0]);
    // the wall x = 0: facets 8 to 15
    let materials: Vec<u32> = (0..case.facets.len()).map(|f| u32::from((8..16).contains(&f))).collect();
    let body = standing(draw.point(0.25, 0.5), [draw.real(-0.2, 0.2), draw.real(-0.2, 0.2)], 2);
    let mesh = case.with_materials(&materials).joined(&body);
    let materials = vec![diffuse(draw, 0.5), Material::new(0.0, 0.8), diffuse(draw, 0.6)];
    let setting = Setting::new(mesh, materials).sky(Model::Uniform, 0.0);
    setting.from(dvec3(0.6, draw.real(-0.3, 0.3), 1.2).normalize(), 0.6)
}

/// A box within a box, light by slits alone.
fn nested_boxes(draw: &mut Draw) -> Generated {
    let outer = room_with_hole(dvec3(2.0, 2.0, 1.5), [1.6, draw.real(0.2, 0.35)], 1);
    let inner = room_with_hole(dvec3(1.0, 0.9, 0.7), [0.8, draw.real(0.15, 0.3)], 1);
    let turned = inner.rotated([0.0, 0.0, 1.0], draw.real(0.2, 0.6)).translated([0.1, 0.0, 0.05]);
    let mesh = outer.joined(&turned.of_material(1));
    let setting = Setting::new(mesh, vec![diffuse(draw, 0.6), diffuse(draw, 0.6)]).two_sided();
    let setting = setting.sky(Model::Overcast, 0.0);
    setting.within(dvec3(-0.9, -0.85, 1.35), dvec3(0.15, 0.1, 0.5), 75.0)
}

/// A closed room with lamps and furniture.
fn room_lamps(draw: &mut Draw) -> Generated {
    let size = dvec3(2.0, 1.6, 1.0);
    let mut mesh = room(size);
    for i in 0..3 {
        let lamp = floor(draw.real(0.15, 0.3), draw.real(0.2, 0.5), 1).flipped();
        mesh = mesh.joined(&lamp.translated([0.6 * f64::from(i) - 0.6, 0.0, 0.97]).of_material(1));
    }
    for _ in 0..3 {
        let at = [draw.real(-0.5, 0.8), draw.real(-0.6, 0.6)];
        mesh = mesh.joined(&standing(draw.point(0.15, 0.4), at, 2));
    }
    let materials = vec![diffuse(draw, 0.6), diffuse(draw, 0.5).emitting(3.0), diffuse(draw, 0.4)];
    Setting::new(mesh, materials).within(dvec3(-0.95, -0.7, 0.7), dvec3(0.6, 0.3, 0.3), 75.0)
}

/// A furnished room that a window lights.
fn room_window(draw: &mut Draw) -> Generated {
    let size = dvec3(1.6, 1.0, 2.0);
    let hole = [draw.real(0.6, 1.1), draw.real(0.4, 0.6)];
    // the pierced ceiling becomes the wall x = 1
    let room = room_with_hole(size, hole, 1).rotated([0.0, 1.0, 0.0], FRAC_PI_2);
    let room = room.rotated([1.0, 0.0, 0.0], FRAC_PI_2).translated([-1.0, 0.0, 0.5]);
    let mut mesh = room;
    for _ in 0..3 {
        let at = [draw.real(-0.6, 0.7), draw.real(-0.6, 0.6)];
        mesh = mesh.joined(&standing(draw.point(0.15, 0.4), at, 1));
    }
    let setting = Setting::new(mesh, vec![diffuse(draw, 0.6), diffuse(draw, 0.4)]).sky(Model::Overcast, 0.2);
    setting.within(dvec3(-0.95, -0.65, 0.7), dvec3(0.7, 0.2, 0.3), 75.0)
}

/// A satellite with two panels over a bright planet, in the sun.
fn satellite(draw: &mut Draw) -> Generated {
    let turn = draw.real(0.0, 1.5);
    let panel = |side: f64| {
        let panel = cuboid(dvec3(0.5, 1.4, 0.02)).rotated([0.0, 1.0, 0.0], turn);
        panel.translated([0.0, 1.1 * side, 0.0]).of_material(1)
    };
    let mast = |side: f64| cuboid(dvec3(0.03, 0.2, 0.03)).translated([0.0, 0.38 * side, 0.0]);
    let nozzle = revolved(&[[0.05, -0.1], [0.14, -0.3], [0.12, -0.3], [0.0, -0.12]], 20).flipped();
    let mesh = joined([
        cuboid(dvec3(0.5, 0.6, 0.8)),
        panel(1.0),
        panel(-1.0),
        mast(1.0),
        mast(-1.0),
        nozzle.translated([0.0, 0.0, -0.3]).of_material(2),
        sphere(3).scaled(0.14).translated([0.1, 0.1, 0.5]).of_material(2),
    ]);
    let materials = vec![diffuse(draw, 0.5), Material::new(0.1, 0.1), diffuse(draw, 0.3)];
    let mut setting = Setting::new(mesh, materials).sky(Model::Hemisphere, 0.0).sun(draw, 0.2665);
    if let Some(sky) = &mut setting.sky {
        (sky.up, sky.radiance) = (-DVec3::Z, vec![0.3]);
    }
    setting.outside(draw, 10.0, 60.0, 0.65)
}

/// Thin sheets with light on both sides.
fn sheets(draw: &mut Draw) -> Generated {
    let mesh = joined((0..14).map(|i| sheet(draw).of_material(i % 2)));
    let materials = vec![diffuse(draw, 0.6), diffuse(draw, 0.4)];
    let setting = Setting::new(mesh, materials).two_sided().sky(Model::Hemisphere, 0.1);
    setting.outside(draw, 0.0, 60.0, 0.8)
}

/// A small body on a floor that reaches far beyond the view.
fn small_box(draw: &mut Draw) -> Generated {
    let size = draw.point(0.4, 0.8);
    let mesh = floor(60.0, 60.0, 1).joined(&standing(size, [0.0, 0.0], 1));
    let setting = Setting::new(mesh, vec![diffuse(draw, 0.3), diffuse(draw, 0.6)]).sky(Model::Overcast, 0.1);
    let direction = draw.direction(25.0, 55.0);
    let target = dvec3(0.0, 0.0, size.z / 2.0);
    setting.seen(Projection::Orthographic { height: 2.2 }, target + direction * 5.0, target)
}

/// A fine sphere with a little mirror on a floor.
fn sphere_mirror(draw: &mut Draw) -> Generated {
    let body = sphere(5).scaled(0.5).translated([0.0, 0.0, draw.real(0.5, 0.7)]);
    let mesh = floor(2.6, 2.6, 1).joined(&body.of_material(1));
    let materials = vec![diffuse(draw, 0.4), Material::new(0.35, 0.15)];
    Setting::new(mesh, materials).sky(Model::Overcast, 0.1).outside(draw, 20.0, 50.0, 0.7)
}

/// Bright stairs along a wall.
fn stairs(draw: &mut Draw) -> Generated {
    let (count, rise, run, width) = (draw.whole(8, 12), 0.16, 0.26, 1.4);
    let mut mesh = Mesh::default();
    let across = DVec3::Y * width;
    for i in 0..count {
        let (x, z) = (run * i as f64, rise * i as f64);
        mesh.rectangle(dvec3(x, 0.0, z), DVec3::Z * rise, across, 1, 0);
        mesh.rectangle(dvec3(x, 0.0, z + rise), DVec3::X * run, across, 1, 0);
    }
    let (length, height) = (run * count as f64, rise * count as f64 + 1.0);
    mesh.rectangle(dvec3(-1.0, 0.0, 0.0), DVec3::X, across, 1, 0);
    // the wall y = 0 faces the steps
    mesh.rectangle(dvec3(-1.0, 0.0, 0.0), DVec3::Z * height, DVec3::X * (length + 1.0), 1, 0);
    let setting = Setting::new(mesh, vec![Material::new(0.8, 0.0)]).sky(Model::Overcast, 0.0);
    setting.from(dvec3(-0.8, draw.real(0.5, 1.0), draw.real(0.5, 0.9)).normalize(), 0.65)
}

/// Bodies under a measured sky.
fn table_sky(draw: &mut Draw) -> Generated {
    let [rows, columns] = [16, 32];
    let mut values: Vec<f64> =
        (0..rows * columns).map(|_| f64::from(draw.real(0.2, 1.2).powi(2) as f32)).collect();
    // a bright patch, as around a veiled sun
    for cell in [5 * columns + 7, 5 * columns + 8, 6 * columns + 8] {
        values[cell] = 12.0;
    }
    let mesh = joined([
        floor(2.8, 2.8, 1),
        standing(draw.point(0.4, 0.8), [-0.5, 0.2], 1),
        sphere(3).scaled(0.35).translated([0.4, -0.3, 0.4]).of_material(1),
        cylinder(0.2, 0.9, 24).translated([0.5, 0.6, 0.45]).of_material(1),
    ]);
    let azimuth_zero = draw.direction(0.0, 0.0);
    let setting = Setting::new(mesh, vec![diffuse(draw, 0.3), diffuse(draw, 0.6)]);
    setting.sky(Model::Table { rows, columns, values, azimuth_zero }, 0.0).outside(draw, 25.0, 55.0, 0.7)
}

/// Coloured bodies in three bands under a clear sky.
fn three_bands(draw: &mut Draw) -> Generated {
    let mut mesh = floor(2.8, 2.8, 1);
    for (i, at) in (1..).zip([[-0.6, 0.3], [0.5, 0.5], [0.1, -0.6]]) {
        mesh = mesh.joined(&standing(draw.point(0.3, 0.8), at, i));
    }
    let materials = (0..4).map(|_| material(draw, 3, 0.1, 0.8, 0.0)).collect();
    let setting = Setting::new(mesh, materials).sky(Model::Uniform, 0.1).sun(draw, 0.0);
    let sun = setting.sun.as_ref().map_or(DVec3::Z, |sun| sun.direction);
    let mut setting = setting.sky(Model::Cie { kind: 12, sun }, 0.1);
    if let Some(sky) = &mut setting.sky {
        sky.radiance = vec![0.6, 0.8, 1.2];
    }
    setting.outside(draw, 25.0, 55.0, 0.7)
}

/// A vehicle on a plane in the sun.
fn vehicle(draw: &mut Draw) -> Generated {
    let cabin = cuboid(dvec3(1.0, 0.8, 0.4)).mapped(|v| {
        let narrow = 1.0 - 0.6 * (v.z + 0.2);
        dvec3(v.x * narrow - 0.1, v.y * narrow, v.z + 0.95)
    });
    let wheel = |x: f64, y: f64| {
        cylinder(0.24, 0.16, 20).rotated([1.0, 0.0, 0.0], FRAC_PI_2).translated([x, y, 0.24]).of_material(2)
    };
    let body = cuboid(dvec3(2.2, 0.9, draw.real(0.4, 0.55))).translated([0.0, 0.0, 0.5]);
    let mesh = joined([
        body,
        cabin,
        wheel(-0.7, -0.42),
        wheel(0.7, -0.42),
        wheel(-0.7, 0.42),
        wheel(0.7, 0.42),
        floor(6.0, 6.0, 1).of_material(1),
    ]);
    let materials = vec![diffuse(draw, 0.5), diffuse(draw, 0.25), diffuse(draw, 0.06)];
    let setting = Setting::new(mesh, materials).sky(Model::Gradient, 0.1).sun(draw, 0.0);
    setting.outside(draw, 15.0, 40.0, 0.4)
}
