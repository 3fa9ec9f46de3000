//! The work that is counted: small, fixed, on one thread.

use crate::scene::{Case, EYE, OTHER_EYE, Values, bowl, image};
use blik_kernel::arena::Memory;
use blik_kernel::bvh::Bvh;
use blik_kernel::form_factor::Polygons;
use blik_kernel::host::{Geometry, GeometryMemory, Host, Lit, Settings};
use blik_kernel::math::Vec3;
use blik_kernel::ray::Ray;
use blik_kernel::scene::Scene;
use blik_kernel::simd::Isa;
use blik_kernel::sky::SkyModel;
use std::hint::black_box;

/// What is counted; the function of each is `counted_NAME`.
pub const NAMES: [&str; 10] =
    ["tree", "closest", "occluded", "factors", "geometry", "light", "relight", "image", "signature", "bands"];

/// Pixels along each side of the images.
const PIXELS: usize = 32;

/// Runs all of it once.
pub fn run() {
    rays();
    factors();
    let host = Host::new(1).expect("a thread");
    let case = Case { settings: coarse(), ..Case::new(bowl(6), 0.3, 0.1) };
    let (mut memory, values) = (GeometryMemory::default(), Values::new(1));
    counted_setup();
    let geometry = counted_geometry(&case, &host, &mut memory);
    counted_setup();
    let lit = counted_light(&values, &host, &geometry);
    counted_setup();
    counted_image(&host, &lit);
    counted_setup();
    counted_signature(&host, &lit);
    counted_setup();
    counted_relight(&values, &host, &geometry);
    crate::c::run(&case, PIXELS, counted_setup);
    let case = Case { bands: 16, settings: coarse(), ..Case::new(bowl(4), 0.3, 0.1) };
    counted_setup();
    counted_bands(&case, &host);
}

fn coarse() -> Settings {
    Settings { tolerance: 1e-2, ..Settings::default() }
}

/// A tree over a bowl and rays that start on it.
fn rays() {
    Case::new(bowl(48), 0.3, 0.0).with_input(|input| {
        let mut memory = Memory::new(Scene::bytes(input).expect("a sound scene"));
        let scene = Scene::new(input, memory.bytes_mut()).expect("a sound scene");
        let mut tree = Memory::new(Bvh::bytes(scene.facets()).expect("few facets"));
        counted_setup();
        let bvh = counted_tree(&scene, &mut tree);
        let rays = hemisphere(&scene, 8);
        counted_setup();
        black_box(counted_closest(&bvh, &rays));
        counted_setup();
        black_box(counted_occluded(&bvh, &rays));
    });
}

/// Some rays from each facet's centroid, spread over its front.
fn hemisphere(scene: &Scene<'_>, each: u32) -> Vec<Ray> {
    let of = |facet: usize| {
        let [a, b, c] = scene.corners()[facet];
        let (centre, normal) = ((a + b + c) / 3.0, scene.normals()[facet]);
        (0..each).map(move |i| {
            // a spiral over the sphere about the normal's tip: a cosine distribution
            let n = facet as f64 * f64::from(each) + f64::from(i);
            let (z, angle) = (1.0 - 2.0 * ((n * 0.618_033_988_75) % 1.0), 2.399_963_2 * n);
            let r = (1.0 - z * z).sqrt();
            let direction = normal + Vec3::new(r * angle.cos(), r * angle.sin(), z);
            Ray { skip: facet as u32, ..Ray::new(centre, direction.normalize()) }
        })
    };
    (0..scene.facets()).flat_map(of).collect()
}

/// Form factors of a bowl's facets, of which many touch and some cross each other's planes.
fn factors() {
    Case::new(bowl(6), 0.3, 0.0).with_input(|input| {
        let mut memory = Memory::new(Scene::bytes(input).expect("a sound scene"));
        let scene = Scene::new(input, memory.bytes_mut()).expect("a sound scene");
        let mut memory = Memory::new(Polygons::bytes(scene.corners()).expect("few facets"));
        let mut areas = vec![0.0; scene.facets()];
        counted_setup();
        counted_factors(scene.corners(), &mut memory, &mut areas);
        black_box(areas);
    });
}

/// Ends what belongs to no count.
#[inline(never)]
fn counted_setup() {
    black_box(());
}

#[inline(never)]
fn counted_tree<'m>(scene: &Scene<'m>, memory: &'m mut Memory) -> Bvh<'m> {
    Bvh::build(scene.corners(), scene.areas(), Isa::detect(), memory.bytes_mut()).expect("a tree")
}

#[inline(never)]
fn counted_closest(bvh: &Bvh<'_>, rays: &[Ray]) -> usize {
    rays.iter().filter(|ray| bvh.closest(ray).is_some()).count()
}

#[inline(never)]
fn counted_occluded(bvh: &Bvh<'_>, rays: &[Ray]) -> usize {
    rays.iter().filter(|ray| bvh.occluded(ray)).count()
}

#[inline(never)]
fn counted_factors(corners: &[[Vec3; 3]], memory: &mut Memory, areas: &mut [f64]) {
    let polygons = Polygons::new(Isa::detect(), corners, memory.bytes_mut()).expect("enough memory");
    for row in 0..corners.len() {
        polygons.exchange_areas(row, row..corners.len(), &mut areas[row..]).expect("a row");
        black_box(&areas);
    }
}

#[inline(never)]
fn counted_geometry<'m>(case: &Case, host: &Host, memory: &'m mut GeometryMemory) -> Geometry<'m> {
    case.geometry(host, memory)
}

#[inline(never)]
fn counted_light<'g>(values: &'g Values, host: &Host, geometry: &'g Geometry<'g>) -> Lit<'g> {
    values.light(host, geometry, SkyModel::Overcast, true)
}

#[inline(never)]
fn counted_image(host: &Host, lit: &Lit<'_>) {
    black_box(image(host, lit, EYE, PIXELS));
}

#[inline(never)]
fn counted_signature(host: &Host, lit: &Lit<'_>) {
    black_box(host.signature(lit, Vec3::new(-1.0, -0.5, -2.0)).expect("a direction"));
}

/// A new sky without a sun, and its image from elsewhere.
#[inline(never)]
fn counted_relight(values: &Values, host: &Host, geometry: &Geometry<'_>) {
    black_box(image(host, &values.light(host, geometry, SkyModel::Gradient, false), OTHER_EYE, PIXELS));
}

/// All of a scene in sixteen bands.
#[inline(never)]
fn counted_bands(case: &Case, host: &Host) {
    black_box(case.cold(host, SkyModel::Overcast, false, PIXELS));
}
