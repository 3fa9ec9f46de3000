//! No ray slips through a closed mesh, and none meets the facet that it leaves: rays at random, and rays that go just
//! where meshes are weakest.

use crate::support::scenes::{self, Mesh};
use crate::support::twin::Rng;
use blik_kernel::bvh::Bvh;
use blik_kernel::math::Vec3;
use blik_kernel::mirror::OFFSET;
use blik_kernel::ray::{Ray, normal};
use blik_kernel::simd::Isa;

/// A closed mesh, outward fronts, that holds the origin; convex, so that nothing leaves it and comes back.
struct Body {
    name: &'static str,
    corners: Vec<[Vec3; 3]>,
}

impl Body {
    fn new(name: &'static str, mesh: &Mesh) -> Body {
        assert!(mesh.is_watertight(), "{name}");
        Body { name, corners: (0..mesh.facets.len()).map(|f| mesh.corners(f)).collect() }
    }
}

/// A box of an even grid; a ball; a box whose facets are fans of slivers, turned.
fn bodies() -> [Body; 3] {
    let centred = scenes::cube_outside().translated([-0.5; 3]).scaled(2.0);
    let mut fan = Mesh { vertices: centred.vertices.clone(), ..Mesh::default() };
    for (f, &[a, b, c]) in centred.facets.iter().enumerate() {
        let [p, q, r] = centred.corners(f);
        let new = fan.vertices.len() as u32;
        fan.vertices.push((p * 0.4 + q * (0.6 - 1e-7) + r * 1e-7).to_array());
        fan.facets.extend([[a, b, new], [b, c, new], [c, a, new]]);
        fan.materials.extend([0; 3]);
    }
    let turned = fan.rotated([0.3, -0.2, 0.9], 0.7).scaled(0.5);
    [
        Body::new("grid box", &centred.subdivided(3)),
        Body::new("ball", &scenes::sphere(3)),
        Body::new("turned box of slivers", &turned),
    ]
}

fn direction(rng: &mut Rng) -> Vec3 {
    loop {
        let d = Vec3::new(rng.unit(), rng.unit(), rng.unit()) * 2.0 - 1.0;
        if (0.01..1.0).contains(&d.length_squared()) {
            return d.normalize();
        }
    }
}

/// A ray, and whether it starts within.
fn ray(body: &Body, index: u64, rng: &mut Rng) -> (Ray, bool) {
    let facet = (rng.bits() % body.corners.len() as u64) as usize;
    let [a, b, c] = body.corners[facet];
    let (u, v) = (rng.unit(), rng.unit());
    let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
    let on = a + (b - a) * u + (c - a) * v;
    let n = normal(&body.corners[facet]).normalize();
    let leave = |direction: Vec3, side: f64| {
        let origin = on + n * (side * OFFSET);
        Ray { skip: facet as u32, ..Ray::new(origin, direction) }
    };
    let inside = direction(rng) * (0.3 * rng.unit());
    let toward = |point: Vec3| Ray::new(inside, (point - inside).normalize());
    let grid = |k: u64| (k % 15) as f64 / 16.0 - 0.4375;
    match index % 8 {
        0 => (Ray::new(inside, direction(rng)), true),
        1 => (toward(a), true),
        2 => (toward(a + (b - a) * u), true),
        3 => {
            // along the axes from the points of a grid, as a camera's rows and columns are
            let at = Vec3::new(grid(index / 8), grid(index / 120), grid(index / 1800)) * 0.5;
            let axes = [Vec3::X, Vec3::Y, Vec3::Z, -Vec3::X, -Vec3::Y, -Vec3::Z];
            (Ray::new(at, axes[rng.bits() as usize % 6]), true)
        }
        4 => {
            let d = direction(rng);
            (leave(if d.dot(n) > 0.0 { -d } else { d }, -1.0), true)
        }
        // in the facet's own plane, within
        5 => (leave((b - a).normalize(), -1.0), true),
        6 => {
            // outward: nothing is met, least of all the facet
            let d = direction(rng);
            (leave(if d.dot(n) < 0.0 { -d } else { d }, 1.0), false)
        }
        _ => (toward((a + b) * 0.5), true),
    }
}

/// Rays that leak or meet the facet that they leave, of `count` ones; and a sum over all hits' bits.
fn count_leaks(body: &Body, isa: Isa, rays: std::ops::Range<u64>) -> (u64, u64) {
    let areas: Vec<f64> = body.corners.iter().map(|f| 0.5 * normal(f).length()).collect();
    let mut memory = vec![0; Bvh::bytes(areas.len()).unwrap()];
    let bvh = Bvh::build(&body.corners, &areas, isa, &mut memory).unwrap();
    let (mut leaks, mut sum) = (0, 0u64);
    for index in rays {
        let mut rng = Rng(index);
        let (ray, within) = ray(body, index, &mut rng);
        let hit = bvh.closest(&ray);
        let sound = match hit {
            Some(hit) => within && !hit.front && hit.facet != ray.skip,
            None => !within,
        };
        if !sound && leaks == 0 {
            println!("{}: {index}: {ray:?} {hit:?}", body.name);
        }
        leaks += u64::from(!sound);
        let bits = hit.map_or(1, |h| h.t.to_bits() ^ u64::from(h.facet) ^ h.u.to_bits().rotate_left(7));
        sum = (sum ^ bits).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    }
    (leaks, sum)
}

/// Rays of each mesh: a third of ten million, or of `BLIK_LEAK_RAYS`.
fn rays_each() -> u64 {
    let all = std::env::var("BLIK_LEAK_RAYS").ok().and_then(|n| n.parse().ok()).unwrap_or(10_000_000u64);
    all.div_ceil(3)
}

#[test]
fn closed_meshes_leak_no_ray_and_no_ray_meets_its_own_facet() {
    let threads = std::thread::available_parallelism().map_or(1, |n| n.get()) as u64;
    for body in &bodies() {
        let (count, mut leaks) = (rays_each(), 0);
        std::thread::scope(|scope| {
            let part = |k: u64| count * k / threads..count * (k + 1) / threads;
            let work = |k: u64| scope.spawn(move || count_leaks(body, Isa::detect(), part(k)).0);
            let all: Vec<_> = (0..threads).map(work).collect();
            leaks = all.into_iter().map(|thread| thread.join().unwrap()).sum();
        });
        println!("{}: {leaks} leaks of {count} rays", body.name);
        assert_eq!(leaks, 0, "{}", body.name);
    }
}

#[test]
fn every_instruction_set_gives_the_same_hits() {
    for body in &bodies() {
        let [plain, best] = [Isa::BASELINE, Isa::detect()].map(|isa| count_leaks(body, isa, 0..100_000));
        assert_eq!(plain, best, "{}", body.name);
    }
}
