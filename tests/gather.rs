//! Rays from a point find what arrives there where its element's linear function does not.

#[path = "support/case.rs"]
mod case;
mod support;

use blik_kernel::arena::Memory;
use blik_kernel::camera::{Camera, CameraInput, Sampling};
use blik_kernel::chain::{PixelArea, RaySample, Solved, Terms};
use blik_kernel::form_factor::point_to_polygon;
use blik_kernel::host::Settings;
use blik_kernel::image::{Target, rows, scratch_bytes};
use blik_kernel::math::Vec3;
use blik_kernel::ray::Ray;
use blik_kernel::sky::SkyModel;
use case::{Case, SkyOf, SunOf, within};
use glam::DVec3;
use support::scenes::{self, Mesh};
use support::twin::Material;

const RHO: f64 = 0.8;

/// A floor from y = 0 on, and a wall over its edge.
fn floor_and_wall(wall: Material) -> Case {
    let mut mesh = Mesh::default();
    mesh.rectangle(DVec3::new(-2.0, 0.0, 0.0), DVec3::X * 4.0, DVec3::Y * 4.0, 1, 0);
    mesh.rectangle(DVec3::new(-2.0, 0.0, 0.0), DVec3::Z * 2.0, DVec3::X * 4.0, 1, 1);
    Case::new(mesh, &[Material::spectral(&[RHO], &[0.0]), wall])
}

/// Places on the floor, down to a five-hundredth of its side from the wall.
fn places() -> impl Iterator<Item = Vec3> {
    let near = (0..24).map(|i| 0.008 * 1.2f64.powi(i));
    near.zip([-0.7, 0.1, 0.9].into_iter().cycle()).map(|(y, x)| Vec3::new(x, y, 0.0))
}

/// Radiance of a place of the floor as seen from above.
fn radiance(solved: &Solved<'_>, place: Vec3) -> f64 {
    let from = solved.scene.to_scene(place + Vec3::new(0.0, 0.5, 1.0));
    let direction = (solved.scene.to_scene(place) - from).normalize();
    let mut terms = Terms::ZERO;
    solved.radiance(&Ray::new(from, direction), RaySample::Integrate(1), &mut terms);
    terms.sum(0)
}

/// With rays from each point, and with elements alone.
fn both(solved: &Solved<'_>, place: Vec3) -> [f64; 2] {
    [0.0, f64::INFINITY].map(|gather| {
        let mut settings = solved.settings;
        settings.gather = gather;
        radiance(&Solved { settings, ..*solved }, place)
    })
}

#[test]
fn beside_a_black_wall_the_sky_is_what_the_wall_leaves() {
    // the elements are made for four times the error that the rays go for
    let (tolerance, coarse) = (2.5e-3, 1e-2);
    let settings = Settings { image_tolerance: Some(tolerance), ..within(coarse) };
    let skies = [SkyOf::uniform(1), SkyOf::new(SkyModel::Hemisphere, &[1.0], &[0.0])];
    for sky in skies {
        let case = floor_and_wall(Material::spectral(&[0.0], &[0.0])).sky(sky);
        case.with_lit(1, &settings, |_, lit| {
            let solved = lit.solved();
            let wall = [[-2.0, 0.0], [-2.0, 2.0], [2.0, 2.0], [2.0, 0.0]].map(|[x, z]| Vec3::new(x, 0.0, z));
            let mut worst = [0.0f64; 2];
            for place in places() {
                let exact = RHO * (1.0 - point_to_polygon(place, Vec3::Z, &wall));
                let errors = both(&solved, place).map(|l| (l - exact).abs());
                worst = [worst[0].max(errors[0]), worst[1].max(errors[1])];
            }
            // rays go on until half the tolerance is expected; the worst of two dozen points may be twice as far off
            assert!(worst[0] < tolerance, "{worst:?}");
            assert!(worst[1] > 1.5 * worst[0], "elements alone would do here: {worst:?}");
        });
    }
}

/// What stands on a floor so large that its smallest elements are far larger still is met by few of its rows' rays; a view
/// from near shows that.
#[test]
fn views_from_near_show_what_stands_there() {
    let (tolerance, size) = (1e-2, 2e-5);
    // of twelve facets, and of more than are looked at one by one
    for cuts in [0, 4] {
        let mut mesh = Mesh::default();
        mesh.rectangle(DVec3::new(-1.0, -1.0, 0.0), DVec3::X * 2.0, DVec3::Y * 2.0, 1, 0);
        let cube = scenes::cube_outside().subdivided(cuts).mapped(|v| (v - DVec3::new(0.5, 0.5, 0.0)) * size);
        let mesh = mesh.joined(&cube.translated([0.2, -0.3, 0.0]).of_material(1));
        let materials = [Material::spectral(&[RHO], &[0.0]), Material::spectral(&[0.0], &[0.0])];
        Case::new(mesh, &materials).sky(SkyOf::uniform(1)).with_lit(1, &within(tolerance), |_, lit| {
            let mut near = lit.solved();
            // parallel rays through pixels of a twentieth of the cube
            near.settings.pixel = PixelArea { start: (size / 20.0) * (size / 20.0), growth: 0.0 };
            let middle = Vec3::new(0.2, -0.3, 0.0);
            let wall = [[-0.5, 0.0], [-0.5, 1.0], [0.5, 1.0], [0.5, 0.0]];
            let mut worst = [0.0f64; 2];
            for gap in [0.02, 0.1, 0.3, 0.7, 1.5] {
                // beside the middle of one wall: no other shows
                let place = middle + Vec3::new(0.1, 0.5 + gap, 0.0) * size;
                let corners = wall.map(|[x, z]| middle + Vec3::new(x, 0.5, z) * size);
                let exact = RHO * (1.0 - point_to_polygon(place, Vec3::Z, &corners));
                let errors = [&near, &lit.solved()].map(|solved| (radiance(solved, place) - exact).abs());
                worst = [worst[0].max(errors[0]), worst[1].max(errors[1])];
            }
            // half the tolerance is gone for
            assert!(worst[0] < tolerance, "{cuts} cuts: {worst:?}");
            assert!(worst[1] > 10.0 * tolerance, "its element alone would do here: {worst:?}");
        });
    }
}

/// A solution that is ten times as coarse as the image is to be, and rays from the image's points.
#[test]
fn images_are_finer_than_their_solution() {
    let (tolerance, coarse) = (1e-3, 1e-2);
    let case = floor_and_wall(Material::spectral(&[0.0], &[0.0])).sky(SkyOf::uniform(1));
    let camera = case::perspective([0.5, 3.0, 2.0], [0.0, 0.5, 0.0], 40.0, 12);
    let wall = [[-2.0, 0.0], [-2.0, 2.0], [2.0, 2.0], [2.0, 0.0]].map(|[x, z]| Vec3::new(x, 0.0, z));
    let settings = Settings { image_tolerance: Some(tolerance), ..within(coarse) };
    let errors = [settings, within(coarse)].map(|settings| {
        case.with_lit(1, &settings, |host, lit| {
            let centres = CameraInput { sampling: Sampling::Centre, ..camera };
            let image = host.image(lit, &centres, false).unwrap();
            assert_eq!(image.report.tolerance, settings.image_tolerance.unwrap_or(coarse));
            let rays = Camera::new(&centres, lit.solved().scene).unwrap();
            let (mut sum, mut count) = (0.0, 0);
            for (at, pixel) in image.pixels.iter().enumerate() {
                let ray = rays.ray((at % 12) as f64 + 0.5, (at / 12) as f64 + 0.5);
                let Some(hit) = lit.solved().bvh.closest(&ray) else { continue };
                let scene = lit.solved().scene;
                let place = (ray.origin + ray.direction * hit.t - scene.to_scene(Vec3::ZERO)) / scene.scale();
                if hit.front && place.y > 1e-6 {
                    let exact = RHO * (1.0 - point_to_polygon(place, Vec3::Z, &wall));
                    sum += (f64::from(*pixel) - exact).powi(2);
                    count += 1;
                }
            }
            assert!(count > 60);
            ((sum / f64::from(count)).sqrt(), image.report.error_estimate)
        })
    });
    // outlines tell the sky at a point to both, however coarse the solution is
    for (error, estimate) in errors {
        assert!(error <= tolerance && error <= estimate, "{error:.1e}, estimated {estimate:.1e}");
    }
}

/// A block of a solved scene may be forged: its irradiances are within what is accepted, and beyond what is solved.
#[test]
fn pixels_are_finite_whatever_the_irradiances_are() {
    let case = floor_and_wall(Material::spectral(&[RHO], &[0.2])).sky(SkyOf::uniform(1));
    case.with_lit(1, &within(1e-2), |_, lit| {
        let mut solved = lit.solved();
        let (huge, unsure) = (vec![1e44; solved.irradiance.len()], vec![1.0; solved.variance.len()]);
        (solved.solution.irradiance, solved.solution.variance) = (&huge, &unsure);
        let input = case::perspective([0.5, 3.0, 2.0], [0.0, 0.5, 0.0], 40.0, 8);
        for (sampling, rays) in
            [(Sampling::Centre, u64::MAX), (Sampling::Area, u64::MAX), (Sampling::Area, 0)]
        {
            solved.settings.rays = rays;
            let camera = Camera::new(&CameraInput { sampling, ..input }, solved.scene).unwrap();
            let (mut pixels, mut memory) = (
                vec![f32::NAN; 64],
                Memory::new(scratch_bytes(&camera, solved.scene, solved.elements).unwrap()),
            );
            let mut target = Target { image: &mut pixels, components: [&mut [], &mut [], &mut []] };
            rows(&solved, &camera, 0..8, &mut target, memory.bytes_mut()).unwrap();
            assert!(pixels.iter().all(|p| p.is_finite()) && pixels.contains(&f32::MAX), "{pixels:?}");
        }
    });
}

#[test]
fn the_sun_counts_once() {
    // the wall is a mirror that shows the floor the sun, or glows by its light
    for (wall, tolerance) in
        [(Material::spectral(&[0.0], &[0.9]), 1e-2), (Material::spectral(&[0.1], &[0.0]), 2e-3)]
    {
        let mirror = wall.specular[0];
        let sun = SunOf::new([0.2, 1.0, 1.5], &[3.0], 0.2665);
        floor_and_wall(wall).sun(sun).with_lit(1, &within(tolerance), |_, lit| {
            let solved = lit.solved();
            let reference = lit.reference()[0];
            for place in places().filter(|p| p.y > 0.05) {
                let [rays, elements] = both(&solved, place).map(|l| l / reference);
                let straight = RHO * (1.5 / 3.29f64.sqrt());
                if mirror > 0.0 {
                    // sunlight arrives straight and by way of the mirror, both computed at the point either way
                    assert!((rays - elements).abs() < 1e-6, "{place}: {rays} {elements}");
                } else {
                    // what the lit wall sends down: half of the sunlight that it reflects at most, straight or by the floor
                    let most = 0.5 * RHO * 0.1 * (1.0 / 3.29f64.sqrt() + 0.5 * straight);
                    assert!(rays > straight && rays < straight + most, "{place}: {rays} {straight}");
                    // the wall's light, to what both ways are wrong by
                    assert!((rays - elements).abs() < 2.0 * tolerance, "{place}: {rays} {elements}");
                }
            }
        });
    }
}
