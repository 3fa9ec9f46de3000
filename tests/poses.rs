//! Couplings that are kept while parts move: closed forms on the way, and each pose as from scratch.

#[path = "support/case.rs"]
mod case;
mod support;

use blik_kernel::coupling::kept::Fates;
use blik_kernel::error::Error;
use blik_kernel::host::{Geometry, GeometryMemory, Host, Settings};
use blik_kernel::light::LightInput;
use blik_kernel::math::Vec3;
use blik_kernel::scene::pose::{Parts, Pose};
use blik_kernel::sky::SkyModel;
use case::{Case, SkyOf, SunOf, orthographic, rms, within};
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use support::scenes::{self, Mesh};
use support::twin::Material;

/// A case whose facets of `first` on belong to part 1.
struct Moving {
    case: Case,
    parts: Vec<u32>,
}

impl Moving {
    fn new(still: &Mesh, moved: &Mesh, materials: &[Material]) -> Moving {
        let parts = [vec![0; still.facets.len()], vec![1; moved.facets.len()]].concat();
        Moving { case: Case::new(still.clone().joined(moved), materials), parts }
    }

    /// The case with its parts at these poses.
    fn at(&self, poses: &[Pose]) -> Case {
        let mut mesh = Mesh { materials: self.case.mesh.materials.clone(), ..Mesh::default() };
        for (facet, part) in self.case.mesh.facets.iter().zip(&self.parts) {
            let start = mesh.vertices.len() as u32;
            mesh.facets.push([start, start + 1, start + 2]);
            let moved =
                |v: &u32| poses[*part as usize].point(Vec3::from(self.case.mesh.vertices[*v as usize]));
            mesh.vertices.extend(facet.iter().map(moved).map(|p| p.to_array()));
        }
        Case { mesh, ..self.case.clone() }
    }

    /// Calls `each` with the geometry of every set of poses, kept from that at rest.
    fn over(
        &self,
        settings: &Settings,
        all: &[Vec<Pose>],
        mut each: impl FnMut(usize, &Host, &Geometry<'_>),
    ) {
        self.case.with_geometry(2, settings, |host, kept| {
            self.case.with_input(|input| {
                for (number, poses) in all.iter().enumerate() {
                    let mut memory = GeometryMemory::default();
                    let parts = Parts { facets: &self.parts, poses };
                    each(number, host, &host.pose(kept, &mut memory, input, &parts).unwrap());
                }
            });
        });
    }
}

/// What is seen of a geometry under a case's light.
fn seen(host: &Host, geometry: &Geometry<'_>, case: &Case, forward: DVec3) -> (Vec<f32>, f64, Vec<[f64; 2]>) {
    let (sky, sun) = (case.sky.as_ref().map(SkyOf::input), case.sun.as_ref().map(SunOf::input));
    let reference = vec![1.0; case.bands()];
    let input = LightInput { sky, sun, reference: Some(&reference), ..LightInput::default() };
    let lit = host.light_of(geometry, &input).unwrap();
    let camera = orthographic((-5.0 * forward).to_array(), [0.0; 3], 12.0, 48);
    let image = host.image(&lit, &camera, false).unwrap();
    let (signature, _) = host.signature(&lit, forward).unwrap();
    let both = signature.radiant_intensity.iter().zip(&signature.error).map(|(i, e)| [*i, *e]).collect();
    (image.pixels, image.report.error_estimate, both)
}

/// Mean irradiance over pi of facets, by area.
fn mean(host: &Host, geometry: &Geometry<'_>, light: &LightInput<'_>, wanted: impl Fn(usize) -> bool) -> f64 {
    let lit = host.light_of(geometry, light).unwrap();
    let (mut sum, mut all) = (0.0, 0.0);
    lit.facets(|facet, _, area, irradiance, _| {
        if wanted(facet) {
            sum += area * irradiance[0] / PI;
            all += area;
        }
    });
    sum / all
}

/// A body with a dish on it and two panels on an axle along y, each a part of its own.
fn satellite() -> Moving {
    let cuboid = |low: DVec3, size: DVec3, n: usize, material: u32| {
        let mut mesh = Mesh::default();
        for axis in 0..3 {
            let unit = |k: usize| DVec3::AXES[(axis + k) % 3] * size[(axis + k) % 3];
            mesh.rectangle(low + unit(0), unit(1), unit(2), n, material);
            mesh.rectangle(low, unit(2), unit(1), n, material);
        }
        mesh
    };
    let body = cuboid(DVec3::splat(-1.0), DVec3::splat(2.0), 3, 0);
    let fin = cuboid(DVec3::new(-0.9, -0.9, 1.0), DVec3::new(0.1, 1.8, 0.8), 2, 2);
    let panels = [-4.5, 1.5].map(|y| cuboid(DVec3::new(-0.9, y, -0.03), DVec3::new(1.8, 3.0, 0.06), 3, 1));
    let materials = [
        Material::spectral(&[0.5, 0.3], &[0.1, 0.3]),
        Material::spectral(&[0.2, 0.1], &[0.4, 0.3]),
        Material::spectral(&[0.6, 0.7], &[0.0, 0.0]),
    ];
    let still = body.joined(&fin);
    let mut moving = Moving::new(&still, &panels[0].clone().joined(&panels[1]), &materials);
    let count = moving.parts.len();
    let last = panels[1].facets.len();
    moving.parts[count - last..].fill(2);
    moving
}

fn axle(angle: f64) -> Pose {
    Pose::about([0.0; 3], [0.0, 1.0, 0.0], angle)
}

fn lit(case: Case) -> Case {
    case.sky(SkyOf::new(SkyModel::Gradient, &[0.6, 0.5], &[0.2, 0.3])).sun(SunOf::new(
        [0.4, 0.5, 1.0],
        &[1.5, 1.0],
        0.27,
    ))
}

const FORWARD: DVec3 = DVec3::new(-0.48, 0.6, -0.64);

#[test]
fn each_pose_is_as_from_scratch() {
    let mut moving = satellite();
    moving.case = lit(moving.case);
    let all: Vec<Vec<Pose>> =
        (0..5).map(|n| vec![Pose::REST, axle(0.3 + n as f64), axle(0.3 - 0.7 * n as f64)]).collect();
    for directional in [true, false] {
        let settings = Settings { directional, ..within(1e-2) };
        if !directional {
            moving.case.sky = Some(SkyOf::uniform(2));
        }
        moving.over(&settings, &all, |number, host, geometry| {
            let rows = geometry.report().rows;
            assert!(rows.kept > 0 && rows.redone > 0, "{rows:?}");
            let case = moving.at(&all[number]);
            let (pixels, error, signature) = seen(host, geometry, &moving.case, FORWARD);
            let scratch = case.with_geometry(2, &settings, |host, scratch| {
                assert!(geometry.report().rays.visibility < scratch.report().rays.visibility);
                seen(host, scratch, &case, FORWARD)
            });
            let off = rms(&pixels, &scratch.0);
            println!(
                "pose {number}: {rows:?}, images differ by {off:.1e}, estimates {error:.1e}, {:.1e}",
                scratch.1
            );
            assert!(off <= error + scratch.1, "pose {number}: {off} above {error} + {}", scratch.1);
            for ([a, ea], [b, eb]) in signature.iter().zip(&scratch.2) {
                assert!((a - b).abs() <= ea + eb, "pose {number}: {a} +- {ea}, {b} +- {eb}");
            }
        });
    }
}

/// At rest nothing is redone: the same bits; and the bits of a pose depend neither on poses before nor on threads.
#[test]
fn poses_have_no_history_and_rest_has_the_bits_of_before() {
    let mut moving = satellite();
    moving.case = lit(moving.case);
    let rest = vec![Pose::REST; 3];
    let poses = vec![Pose::REST, axle(0.4), axle(2.0)];
    let other = vec![Pose::REST, axle(1.4), axle(2.0)];
    let mut shown = Vec::new();
    moving.over(&within(2e-2), &[rest, poses.clone(), other, poses.clone()], |_, host, geometry| {
        shown.push(seen(host, geometry, &moving.case, FORWARD));
    });
    assert!(shown[1] == shown[3] && shown[1] != shown[2]);
    let case = &moving.case;
    case.with_geometry(2, &within(2e-2), |host, kept| {
        assert!(shown[0] == seen(host, kept, case, FORWARD));
        for threads in [1, 3] {
            let (host, mut memory) = (Host::new(threads).unwrap(), GeometryMemory::default());
            let parts = Parts { facets: &moving.parts, poses: &poses };
            let geometry = case.with_input(|input| host.pose(kept, &mut memory, input, &parts)).unwrap();
            assert!(shown[1] == seen(&host, &geometry, case, FORWARD), "{threads} threads");
        }
    });
}

/// All parts turned together, and the light and the observer with them: no ray, and the same signature.
#[test]
fn what_moves_together_keeps_its_rows() {
    let mut moving = satellite();
    moving.case = lit(moving.case);
    let turned = Pose::from_quaternion([0.5, -0.3, 0.7, 0.2], [100.0, -20.0, 3.0]);
    let turn = |v: [f64; 3]| turned.turn(Vec3::from(v)).to_array();
    let mut light = moving.case.clone();
    light.sky.as_mut().unwrap().up = turn([0.0, 0.0, 1.0]);
    light.sun.as_mut().unwrap().direction = turn([0.4, 0.5, 1.0]);
    let mut at_rest = Vec::new();
    moving.over(&within(1e-2), &[vec![Pose::REST; 3], vec![turned; 3]], |number, host, geometry| {
        let Fates { rescaled, redone, .. } = geometry.report().rows;
        assert!(rescaled == 0 && redone == 0 && geometry.report().rays.visibility == 0);
        let (case, forward) =
            if number == 0 { (&moving.case, FORWARD) } else { (&light, turned.turn(FORWARD)) };
        let (_, _, signature) = seen(host, geometry, case, forward);
        println!("{signature:?}");
        if number == 0 {
            at_rest = signature;
            return;
        }
        for ([a, e], [b, _]) in signature.iter().zip(&at_rest) {
            // directions are kept to 6.6e-5 rad; cells lie elsewhere on the outline
            assert!((a - b).abs() <= 0.5 * e, "{a} and {b}, +- {e}");
        }
    });
}

/// Two plates of one width on a hinge, between ends that mirror all: the form factor of endless plates at an angle a,
/// 1 - sin(a/2).
#[test]
fn hinged_plates_over_a_quarter_turn() {
    let (mut still, mut plate) = (Mesh::default(), Mesh::default());
    still.rectangle(DVec3::ZERO, DVec3::X, DVec3::Y, 4, 0);
    // ends that hold both plates at all angles
    for (y, front) in [(0.0, true), (1.0, false)] {
        let (a, b) = (DVec3::X * 2.2, DVec3::Z * 1.1);
        let (a, b) = if front { (b, a) } else { (a, b) };
        still.rectangle(DVec3::new(-1.1, y, -0.02), a, b, 1, 2);
    }
    plate.rectangle(DVec3::ZERO, DVec3::Y, DVec3::Z, 4, 1);
    let materials = [Material::new(0.5, 0.0), Material::new(0.0, 0.0).emitting(1.0), Material::new(0.0, 1.0)];
    let moving = Moving::new(&still, &plate, &materials);
    let angles: Vec<f64> = (0..=6).map(|n| 0.3 + 0.25 * FRAC_PI_2 * n as f64).collect();
    // at rest the plates stand at a right angle; about y, the positive way leads from z to x
    let poses: Vec<Vec<Pose>> =
        angles.iter().map(|angle| vec![Pose::REST, axle(FRAC_PI_2 - angle)]).collect();
    moving.over(&within(3e-3), &poses, |number, host, geometry| {
        let found = mean(host, geometry, &LightInput::default(), |facet| facet < 32);
        let wanted = 1.0 - (0.5 * angles[number]).sin();
        println!("{:.3} rad: {found:.5}, {wanted:.5}; {:?}", angles[number], geometry.report().rows);
        assert!((found - wanted).abs() < 3e-3, "{} rad: {found}, not {wanted}", angles[number]);
    });
}

/// A flat mirror that sweeps the sun over a plate, which it never sees straight: irradiance times what the beam covers.
#[test]
fn a_mirror_flat_sweeps_the_sun_over_a_plate() {
    let (mut plate, mut flat) = (Mesh::default(), Mesh::default());
    plate.rectangle(DVec3::ZERO, DVec3::X, DVec3::Y, 8, 0);
    let (centre, half, rho) = (DVec3::new(2.0, 0.0, 1.0), 0.2, 0.8);
    let sun = DVec3::new(0.3, 0.0, -0.91).normalize();
    let toward = |x: f64| (DVec3::new(x, 0.0, 0.0) - centre).normalize();
    // the normal halves the angle between the sun and where its light goes
    let normal = |x: f64| (sun + toward(x)).normalize();
    let along = |n: DVec3| DVec3::new(n.z, 0.0, -n.x);
    let rest = normal(0.5);
    let (u, corner) = (along(rest), centre - along(rest) * half - 1.0 * DVec3::Y);
    flat.rectangle(corner, u * (2.0 * half), DVec3::Y * 3.0, 1, 1);
    if u.cross(DVec3::Y).dot(rest) < 0.0 {
        flat = flat.flipped();
    }
    let moving = Moving::new(&plate, &flat, &[Material::new(0.5, 0.0), Material::new(0.0, rho)]);
    let aims: Vec<f64> = (0..13).map(|n| -0.5 + 0.15 * f64::from(n)).collect();
    let pose = |x: &f64| {
        let (a, b) = (rest, normal(*x));
        let angle = a.cross(b).dot(DVec3::Y).atan2(a.dot(b));
        vec![Pose::REST, Pose::about(centre.to_array(), [0.0, 1.0, 0.0], angle)]
    };
    let poses: Vec<Vec<Pose>> = aims.iter().map(pose).collect();
    let light = SunOf::new(sun.to_array(), &[PI], 0.0);
    let mut most: f64 = 0.0;
    moving.over(&within(5e-3), &poses, |number, host, geometry| {
        let input = LightInput { sun: Some(light.input()), ..LightInput::default() };
        let found = mean(host, geometry, &input, |facet| facet < 128);
        let n = normal(aims[number]);
        let out = toward(aims[number]);
        let ends = [-half, half].map(|s| {
            let p = centre + along(n) * s;
            p.x - out.x / out.z * p.z
        });
        let covered = ends[0].max(ends[1]).min(1.0) - ends[0].min(ends[1]).max(0.0);
        let wanted = rho * -out.z * covered.max(0.0);
        most = most.max(wanted);
        println!("aim {:.2}: {found:.5}, {wanted:.5}", aims[number]);
        // edges of the beam run through elements: their means are of some rays
        assert!((found - wanted).abs() < 5e-3, "aim {}: {found}, not {wanted}", aims[number]);
    });
    assert!(most > 0.05);
}

/// A small sphere that passes a bright one: half of 1 - sqrt(1 - (R/s)^2) of its view, s apart.
#[test]
fn two_spheres_that_pass_each_other() {
    let (large, small) =
        (scenes::sphere(3), scenes::sphere(1).scaled(0.2).translated([0.0, 1.8, 0.0]).of_material(1));
    // of the tessellated sphere, the radius of its mean shadow
    let area: f64 = (0..large.facets.len()).map(|facet| large.area(facet)).sum();
    let radius = (area / (4.0 * PI)).sqrt();
    let moving =
        Moving::new(&large, &small, &[Material::new(0.0, 0.0).emitting(1.0), Material::new(0.4, 0.0)]);
    let places: Vec<f64> = (0..7).map(|n| -3.0 + f64::from(n)).collect();
    let pose = |x: &f64| vec![Pose::REST, Pose { translation: [*x, 0.0, 0.0], ..Pose::REST }];
    let poses: Vec<Vec<Pose>> = places.iter().map(pose).collect();
    let first = large.facets.len();
    moving.over(&within(3e-3), &poses, |number, host, geometry| {
        let found = mean(host, geometry, &LightInput::default(), |facet| facet >= first);
        let distance = (1.8f64 * 1.8 + places[number] * places[number]).sqrt();
        let wanted = 0.5 * (1.0 - (1.0 - (radius / distance).powi(2)).sqrt());
        println!("{distance:.3}: {found:.5}, {wanted:.5}");
        // flat facets and the small sphere's size: a percent of the most
        assert!((found - wanted).abs() < 2e-3, "{distance} apart: {found}, not {wanted}");
    });
}

#[test]
fn parts_that_are_none_are_refused() {
    let moving = satellite();
    moving.case.with_geometry(1, &within(5e-2), |host, kept| {
        let refused = |facets: &[u32], poses: &[Pose]| {
            let mut memory = GeometryMemory::default();
            let parts = Parts { facets, poses };
            let made =
                moving.case.with_input(|input| host.pose(kept, &mut memory, input, &parts).map(|_| ()));
            made.unwrap_err()
        };
        let (facets, rest) = (&moving.parts[..], Pose::REST);
        let (count, what) = (facets.len(), "parts");
        assert_eq!(
            refused(&facets[1..], &[rest; 3]),
            Error::Length { what, expected: count, given: count - 1 }
        );
        let facet = facets.iter().position(|part| *part == 2).unwrap();
        assert_eq!(refused(facets, &[rest; 2]), Error::PartOutOfRange { facet, part: 2, parts: 2 });
        let mut mirrored = rest;
        mirrored.rotation[0][0] = -1.0;
        let mut long = rest;
        long.rotation[1][1] = 1.001;
        let none = Pose::from_quaternion([0.0; 4], [0.0; 3]);
        let far = Pose { translation: [0.0, f64::INFINITY, 0.0], ..rest };
        for pose in [mirrored, long, none, far] {
            assert_eq!(refused(facets, &[rest, pose, rest]), Error::Pose { part: 1 });
        }
        let mut other = moving.case.clone();
        other.mesh.vertices.iter_mut().for_each(|v| v[0] *= 2.0);
        let mut memory = GeometryMemory::default();
        let parts = Parts { facets, poses: &[rest; 3] };
        let made = other.with_input(|input| host.pose(kept, &mut memory, input, &parts).map(|_| ()));
        assert_eq!(made.unwrap_err(), Error::Mismatch { what: "mesh" });
    });
    let whole = Pose::about([1.0, 2.0, 3.0], [0.0, 0.0, 5.0], TAU);
    assert!(whole.point(Vec3::new(4.0, 5.0, 6.0)).distance(Vec3::new(4.0, 5.0, 6.0)) < 1e-14);
}
