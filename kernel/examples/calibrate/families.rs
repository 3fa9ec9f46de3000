//! The kinds of scenes: bodies and materials of each, drawn.

use super::setting::{Eye, Setting};
use crate::drawn::Draw;
use crate::drawn::light::{Suns, diffuse, glossy, material, mirror, tinted};
use crate::drawn::shapes::{
    craft, cuboid, cylinder, dish, floor, revolved, room, room_with_hole, sheet, terrain,
};
use crate::support::scenes::{Mesh, box_open, corner, sphere};
use glam::{DVec3, dvec3};
use std::f64::consts::FRAC_PI_2;

/// A kind of scene: how it is drawn for a number of bands.
type Family = fn(&mut Draw, usize) -> Setting;

/// All kinds.
pub const FAMILIES: [(&str, Family); 18] = [
    ("boxes", boxes),
    ("spheres", spheres),
    ("open-cavity", open_cavity),
    ("nearly-closed", nearly_closed),
    ("lamp-room", lamp_room),
    ("craft", crafts),
    ("flat-mirrors", flat_mirrors),
    ("facing-mirrors", facing_mirrors),
    ("corner-reflector", corner_reflector),
    ("mirror-bodies", mirror_bodies),
    ("mirror-dish", mirror_dish),
    ("gloss", gloss),
    ("sheets", sheets),
    ("needles", needles),
    ("interpenetrating", interpenetrating),
    ("city", city),
    ("terrain", hills),
    ("mixed", mixed),
];

/// A body put down at (x, y), turned about z.
fn put(draw: &mut Draw, body: &Mesh, [x, y, z]: [f64; 3], material: u32) -> Mesh {
    body.rotated([0.0, 0.0, 1.0], draw.real(0.0, 6.3)).translated([x, y, z]).of_material(material)
}

/// A box of drawn size that stands on z = 0.
fn standing(draw: &mut Draw, largest: f64, material: u32, [x, y]: [f64; 2]) -> Mesh {
    let size = draw.point(0.25, 1.0) * largest;
    put(draw, &cuboid(size), [x, y, size.z / 2.0], material)
}

fn boxes(draw: &mut Draw, bands: usize) -> Setting {
    let mut mesh = floor(draw.real(1.6, 3.0), draw.real(1.6, 3.0), 1);
    for _ in 0..draw.whole(1, 3) {
        let at = [draw.real(-0.5, 0.5), draw.real(-0.5, 0.5)];
        mesh = mesh.joined(&standing(draw, 0.8, 1, at));
    }
    let levels = draw.pick(&[0, 0, 0, 1, 2, 3]);
    let materials = vec![diffuse(draw, bands), diffuse(draw, bands)];
    Setting::new(mesh.subdivided(levels), materials).sun(0.75)
}

fn spheres(draw: &mut Draw, bands: usize) -> Setting {
    let n = draw.pick(&[1, 1, 4, 8]);
    let mut mesh = floor(3.0, 3.0, n);
    for _ in 0..draw.whole(1, 3) {
        let radius = draw.real(0.2, 0.5);
        let height = radius * draw.real(1.0, 1.5);
        let at = [draw.real(-0.7, 0.7), draw.real(-0.7, 0.7), height];
        let level = draw.whole(0, 2) as u32;
        mesh = mesh.joined(&put(draw, &sphere(level).scaled(radius), at, 1));
    }
    let materials = vec![diffuse(draw, bands), diffuse(draw, bands)];
    Setting::new(mesh, materials).sun(0.6)
}

fn open_cavity(draw: &mut Draw, bands: usize) -> Setting {
    let [w, d, h] = [draw.real(0.6, 1.4), draw.real(0.6, 1.4), draw.real(0.4, 1.6)];
    let n = draw.pick(&[1, 2, 4, 6]);
    let mut mesh = box_open(w, d, h, n).translated([-w / 2.0, -d / 2.0, 0.0]);
    if draw.chance(0.4) {
        mesh = mesh.joined(&standing(draw, 0.4 * h.min(w).min(d), 2, [0.0, 0.0]));
    }
    let share = if draw.chance(0.5) { 0.0 } else { draw.real(0.1, 0.8) };
    let materials = vec![
        material(draw, bands, 0.2, 0.8, 0.0),
        material(draw, bands, 0.2, 0.85, share),
        diffuse(draw, bands),
    ];
    Setting::new(mesh, materials).sun(0.4).eye(Eye::Above)
}

fn nearly_closed(draw: &mut Draw, bands: usize) -> Setting {
    let size = draw.point(0.8, 1.5);
    let hole = [draw.real(0.15, 0.5), draw.real(0.15, 0.5)];
    let n = draw.pick(&[1, 2, 3]);
    let mut mesh = room_with_hole(size, hole, n);
    if draw.chance(0.4) {
        mesh = mesh.joined(&standing(draw, 0.4, 1, [0.2, 0.1]));
    }
    let share = if draw.chance(0.7) { 0.0 } else { draw.real(0.1, 0.5) };
    let materials = vec![material(draw, bands, 0.3, 0.8, share), diffuse(draw, bands)];
    Setting::new(mesh, materials).sun(0.3).eye(Eye::Within(size))
}

fn lamp_room(draw: &mut Draw, bands: usize) -> Setting {
    let size = draw.point(0.8, 1.5);
    let levels = draw.whole(0, 2) as u32;
    let mut mesh = room(size).subdivided(levels);
    let [w, d] = [draw.real(0.2, 0.5), draw.real(0.2, 0.5)];
    let lamp =
        floor(w, d, 1).flipped().translated([draw.real(-0.1, 0.1), 0.0, size.z - draw.real(0.01, 0.2)]);
    mesh = mesh.joined(&lamp.of_material(1));
    if draw.chance(0.5) {
        mesh = mesh.joined(&standing(draw, 0.4, 2, [0.15, -0.1]));
    }
    let share = if draw.chance(0.6) { 0.0 } else { draw.real(0.1, 0.5) };
    let mut emitter = diffuse(draw, bands);
    emitter.emission = tinted(draw, bands, 0.5, 3.0);
    let materials = vec![material(draw, bands, 0.2, 0.75, share), emitter, diffuse(draw, bands)];
    let inside = Eye::Within(size * dvec3(1.0, 1.0, 0.7));
    let setting = Setting::new(mesh, materials).eye(inside);
    if draw.chance(0.8) { setting.dark() } else { setting.sun(0.0) }
}

fn crafts(draw: &mut Draw, bands: usize) -> Setting {
    let mesh = craft(draw);
    let share = draw.pick(&[0.0, 0.25, 0.5, 0.75]);
    let materials = vec![material(draw, bands, 0.3, 0.6, share), material(draw, bands, 0.3, 0.6, share)];
    let setting =
        Setting::new(mesh, materials).sun(0.6).suns(if share > 0.0 { Suns::Large } else { Suns::Any });
    setting.eye(Eye::Around)
}

fn flat_mirrors(draw: &mut Draw, bands: usize) -> Setting {
    let n = draw.pick(&[1, 1, 3, 8]);
    let mut mesh = floor(2.4, 2.4, n);
    // one panel, two upright ones at a right angle, or two askew: these alone make many images of the sun
    let (kind, turn) = (draw.whole(0, 2), draw.real(0.0, 6.3));
    for i in 0..if kind == 0 { 1 } else { 2 } {
        let panel = floor(draw.real(0.4, 1.0), draw.real(0.4, 1.0), 1);
        let (tilt, askew) = (draw.real(0.6, 1.7), draw.real(0.0, 6.3));
        let at = [draw.real(-0.8, 0.8), draw.real(-0.8, 0.8), draw.real(0.4, 0.8)];
        let upright = kind == 1;
        let panel = panel.rotated([1.0, 0.0, 0.0], if upright { FRAC_PI_2 } else { tilt });
        let panel = panel.rotated([0.0, 0.0, 1.0], if upright { turn + FRAC_PI_2 * i as f64 } else { askew });
        mesh = mesh.joined(&panel.translated(at).of_material(1));
    }
    if draw.chance(0.6) {
        mesh = mesh.joined(&standing(draw, 0.5, 2, [0.1, 0.2]));
    }
    let materials = vec![diffuse(draw, bands), mirror(draw, bands), diffuse(draw, bands)];
    Setting::new(mesh, materials).sun(0.8).suns(if kind == 2 { Suns::Large } else { Suns::Any })
}

fn facing_mirrors(draw: &mut Draw, bands: usize) -> Setting {
    let gap = draw.real(0.5, 1.2);
    let n = draw.pick(&[1, 2, 6]);
    let mut mesh = floor(gap, 1.2, n);
    let mut wall = Mesh::default();
    let height = draw.real(0.4, 1.0);
    wall.rectangle(dvec3(-gap / 2.0, -0.6, 0.0), DVec3::Y * 1.2, DVec3::Z * height, 1, 1);
    wall.rectangle(dvec3(gap / 2.0, -0.6, 0.0), DVec3::Z * height, DVec3::Y * 1.2, 1, 1);
    mesh = mesh.joined(&wall);
    if draw.chance(0.5) {
        mesh = mesh.joined(&standing(draw, 0.4 * gap, 2, [0.0, 0.1]).subdivided(1));
    }
    let materials = vec![diffuse(draw, bands), mirror(draw, bands), diffuse(draw, bands)];
    Setting::new(mesh, materials).sun(0.6).eye(Eye::Above)
}

fn corner_reflector(draw: &mut Draw, bands: usize) -> Setting {
    let n = draw.pick(&[1, 2, 4, 8]);
    let mut mesh = corner(n);
    if draw.chance(0.5) {
        mesh = mesh.joined(&standing(draw, 0.4, 3, [0.5, 0.5]));
    }
    let mut materials: Vec<_> =
        (0..3).map(|_| if draw.chance(0.6) { mirror(draw, bands) } else { diffuse(draw, bands) }).collect();
    materials.push(diffuse(draw, bands));
    Setting::new(mesh, materials).sun(0.6).eye(Eye::Octant)
}

fn mirror_bodies(draw: &mut Draw, bands: usize) -> Setting {
    let n = draw.pick(&[1, 1, 4]);
    let mut mesh = floor(2.6, 2.6, n);
    let count = draw.whole(1, 2);
    for _ in 0..count {
        let body = match draw.whole(0, 2) {
            0 => sphere(draw.whole(0, 2) as u32).scaled(0.4),
            1 => cylinder(0.35, 0.8, draw.whole(6, 24)),
            _ => cuboid(draw.point(0.3, 0.8)),
        };
        let at = [draw.real(-0.6, 0.6), draw.real(-0.6, 0.6), draw.real(0.45, 0.7)];
        mesh = mesh.joined(&put(draw, &body, at, 1));
    }
    let materials = vec![diffuse(draw, bands), mirror(draw, bands)];
    // a single convex body throws nothing by two mirrors
    let suns = if count == 1 { Suns::Any } else { Suns::Large };
    Setting::new(mesh, materials).sun(0.6).suns(suns)
}

fn mirror_dish(draw: &mut Draw, bands: usize) -> Setting {
    let bowl = draw.chance(0.4);
    let n = if bowl { draw.whole(3, 7) } else { draw.whole(4, 16) };
    let bend = draw.real(0.1, 0.4);
    let lean = draw.real(0.0, 0.8);
    let mirrors = dish(bend, n, bowl).scaled(0.8).rotated([0.0, 1.0, 0.0], lean).of_material(1);
    let mut target = Mesh::default();
    let depth = draw.real(0.4, 1.0);
    target.rectangle(dvec3(1.0, -depth, 0.0), DVec3::Y * (-2.0 * depth), DVec3::Z * 1.0, 1, 0);
    let levels = draw.pick(&[0, 2, 3]);
    let target = target.translated([0.0, 2.0 * depth, 0.0]).subdivided(levels);
    let materials = vec![diffuse(draw, bands), mirror(draw, bands)];
    Setting::new(mirrors.joined(&target), materials).sun(0.7).suns(Suns::Large).eye(Eye::Around)
}

fn gloss(draw: &mut Draw, bands: usize) -> Setting {
    let mut mesh = floor(2.2, 2.2, draw.pick(&[1, 4]));
    let body = match draw.whole(0, 2) {
        0 => sphere(draw.whole(1, 2) as u32).scaled(0.5),
        1 => cylinder(0.4, 0.9, draw.whole(6, 20)),
        _ => cuboid(draw.point(0.4, 0.9)),
    };
    let height = draw.real(0.5, 0.7);
    mesh = mesh.joined(&put(draw, &body, [0.0, 0.0, height], 1));
    let plain = draw.chance(0.5);
    let ground = if plain { diffuse(draw, bands) } else { glossy(draw, bands) };
    let materials = vec![ground, glossy(draw, bands)];
    Setting::new(mesh, materials).sun(0.4).rough()
}

fn sheets(draw: &mut Draw, bands: usize) -> Setting {
    let mut mesh = sheet(draw);
    for _ in 0..draw.whole(2, 14) {
        let material = draw.whole(0, 1) as u32;
        mesh = mesh.joined(&sheet(draw).of_material(material));
    }
    let levels = draw.pick(&[0, 0, 1]);
    let share = if draw.chance(0.7) { 0.0 } else { draw.real(0.2, 0.9) };
    let materials = vec![diffuse(draw, bands), material(draw, bands, 0.2, 0.8, share)];
    let suns = if share > 0.0 { Suns::Large } else { Suns::Any };
    let setting = Setting::new(mesh.subdivided(levels), materials).sun(0.6).suns(suns).eye(Eye::Around);
    if draw.chance(0.8) { setting.two_sided() } else { setting }
}

fn needles(draw: &mut Draw, bands: usize) -> Setting {
    let mut mesh = floor(2.4, 2.4, 1);
    match draw.whole(0, 2) {
        // strips and caps' triangles of a fine cylinder
        0 => {
            let (radius, k) = (draw.real(0.2, 0.4), draw.whole(24, 80));
            let at = [0.1, 0.0, 0.62];
            mesh = mesh.joined(&put(draw, &cylinder(radius, 1.2, k), at, 1));
        }
        // slats
        1 => {
            let count = draw.whole(6, 20);
            let lean = draw.real(-0.6, 0.6);
            for i in 0..count {
                let x = 1.6 * (i as f64 + 0.5) / count as f64 - 0.8;
                let slat = cuboid(dvec3(0.01, 1.4, 0.25)).rotated([0.0, 1.0, 0.0], lean);
                mesh = mesh.joined(&slat.translated([x, 0.0, 0.35]).of_material(1));
            }
        }
        // a spindle of long thin triangles
        _ => {
            let profile = [[0.0, 0.0], [0.08, 0.3], [0.1, 0.9], [0.0, 1.4]];
            let k = draw.whole(12, 48);
            for _ in 0..draw.whole(1, 3) {
                let at = [draw.real(-0.5, 0.5), draw.real(-0.5, 0.5), 0.02];
                mesh = mesh.joined(&put(draw, &revolved(&profile, k), at, 1));
            }
        }
    }
    let share = if draw.chance(0.7) { 0.0 } else { draw.real(0.2, 0.6) };
    let materials = vec![diffuse(draw, bands), material(draw, bands, 0.2, 0.8, share)];
    let suns = if share > 0.0 { Suns::Large } else { Suns::Any };
    Setting::new(mesh, materials).sun(0.6).suns(suns)
}

fn interpenetrating(draw: &mut Draw, bands: usize) -> Setting {
    let mut mesh = floor(2.4, 2.4, draw.pick(&[1, 3]));
    for i in 0..draw.whole(2, 4) {
        let body = match draw.whole(0, 2) {
            0 => sphere(draw.whole(0, 2) as u32).scaled(draw.real(0.3, 0.5)),
            1 => cylinder(draw.real(0.15, 0.3), draw.real(0.6, 1.4), draw.whole(5, 16)),
            _ => cuboid(draw.point(0.3, 0.9)),
        };
        let body = body.rotated([1.0, 2.0, 0.5], draw.real(0.0, 3.0));
        let at = [draw.real(-0.4, 0.4), draw.real(-0.4, 0.4), draw.real(0.0, 0.6)];
        mesh = mesh.joined(&put(draw, &body, at, 1 + i as u32 % 2));
    }
    let share = if draw.chance(0.6) { 0.0 } else { draw.real(0.2, 0.7) };
    let materials = vec![diffuse(draw, bands), diffuse(draw, bands), material(draw, bands, 0.2, 0.8, share)];
    let suns = if share > 0.0 { Suns::Large } else { Suns::Any };
    Setting::new(mesh, materials).sun(0.6).suns(suns)
}

fn city(draw: &mut Draw, bands: usize) -> Setting {
    let n = draw.whole(2, 4);
    let mut mesh = floor(2.4, 2.4, draw.pick(&[1, 1, 4]));
    let step = 2.0 / n as f64;
    for i in 0..n * n {
        let height = draw.scale(0.15, 1.2);
        let size = dvec3(step * draw.real(0.4, 0.8), step * draw.real(0.4, 0.8), height);
        let [x, y] = [i % n, i / n].map(|k| (k as f64 + 0.5) * step - 1.0);
        mesh = mesh.joined(&cuboid(size).translated([x, y, height / 2.0]).of_material(1));
    }
    let levels = draw.pick(&[0, 0, 1]);
    let share = if draw.chance(0.8) { 0.0 } else { draw.real(0.2, 0.7) };
    let materials = vec![diffuse(draw, bands), material(draw, bands, 0.2, 0.7, share)];
    Setting::new(mesh.subdivided(levels), materials).sun(0.8)
}

fn hills(draw: &mut Draw, bands: usize) -> Setting {
    let n = draw.whole(5, 18);
    let mesh = terrain(draw, n);
    let share = if draw.chance(0.8) { 0.0 } else { draw.real(0.2, 0.7) };
    let materials = vec![material(draw, bands, 0.2, 0.8, share)];
    let suns = if share > 0.0 { Suns::Large } else { Suns::Any };
    Setting::new(mesh, materials).sun(0.7).suns(suns)
}

/// A bit of everything: diffuse, mirrors, gloss and lamps side by side.
fn mixed(draw: &mut Draw, bands: usize) -> Setting {
    let mut mesh = floor(2.4, 2.4, draw.pick(&[1, 4]));
    let mut materials = vec![diffuse(draw, bands)];
    for i in 1..=draw.whole(2, 4) {
        let at = [draw.real(-0.8, 0.8), draw.real(-0.8, 0.8)];
        let body = if draw.chance(0.6) {
            standing(draw, 0.7, i as u32, at)
        } else {
            let level = draw.whole(0, 1) as u32;
            put(draw, &sphere(level).scaled(0.3), [at[0], at[1], 0.35], i as u32)
        };
        mesh = mesh.joined(&body);
        let mut chosen = match draw.whole(0, 3) {
            0 => mirror(draw, bands),
            1 => glossy(draw, bands),
            _ => diffuse(draw, bands),
        };
        if draw.chance(0.25) {
            chosen.emission = tinted(draw, bands, 0.1, 1.0);
        }
        materials.push(chosen);
    }
    let setting = Setting::new(mesh, materials).sun(0.5).suns(Suns::Large).rough();
    if draw.chance(0.3) { setting.two_sided() } else { setting }
}
