//! The tree finds what a search of every facet finds, bit for bit, and no ray slips through a closed mesh.

use blik_kernel::Error;
use blik_kernel::bvh::Bvh;
use blik_kernel::math::Vec3;
use blik_kernel::ray::{Hit, Ray, intersect, normal};
use blik_kernel::simd::Isa;

type Facet = [Vec3; 3];

/// SplitMix64: the same rays on every machine.
struct Random(u64);

impl Random {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in 0..1.
    fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Uniform in the cube [-1, 1]^3.
    fn cube(&mut self) -> Vec3 {
        Vec3::new(self.unit(), self.unit(), self.unit()) * 2.0 - 1.0
    }

    fn direction(&mut self) -> Vec3 {
        loop {
            let d = self.cube();
            if (0.01..1.0).contains(&d.length_squared()) {
                return d.normalize();
            }
        }
    }

    fn below(&mut self, n: usize) -> usize {
        (self.bits() % n as u64) as usize
    }
}

fn areas(mesh: &[Facet]) -> Vec<f64> {
    mesh.iter().map(|facet| 0.5 * normal(facet).length()).collect()
}

type Builder = for<'a> fn(&[Facet], &[f64], Isa, &'a mut [u8]) -> Result<Bvh<'a>, Error>;

fn builders() -> Vec<Builder> {
    vec![
        |corners, areas, isa, memory| Bvh::build(corners, areas, isa, memory),
        #[cfg(feature = "std")]
        |corners, areas, isa, memory| Bvh::build_obvhs(corners, areas, isa, memory),
    ]
}

/// Calls `check` with the tree of every builder and instruction set.
fn with_trees(mesh: &[Facet], mut check: impl FnMut(&Bvh)) {
    for build in builders() {
        for isa in [Isa::BASELINE, Isa::detect()] {
            let mut memory = vec![0xa5; Bvh::bytes(mesh.len()).unwrap()];
            let given = memory.len();
            let bvh = build(mesh, &areas(mesh), isa, &mut memory).unwrap();
            assert!(bvh.memory() <= given);
            check(&bvh);
        }
    }
}

/// Every facet in turn, in the same arithmetic.
fn brute_force(mesh: &[Facet], ray: &Ray) -> Option<Hit> {
    let solid = mesh.iter().enumerate().filter(|(_, facet)| normal(facet) != Vec3::ZERO);
    let hits: Vec<Hit> = solid.filter_map(|(i, facet)| intersect(ray, i as u32, facet)).collect();
    let size = mesh.iter().flatten().map(|c| c.abs().max_element()).fold(0.0, f64::max);
    let least = |hits: &mut dyn Iterator<Item = Hit>| hits.reduce(|a, b| if b.t < a.t { b } else { a });
    let nearest = least(&mut hits.iter().copied())?;
    // sheets this close together count as one: of those the front shows
    let close = |hit: &Hit| hit.t - nearest.t <= 2f64.powi(-42) * (size + nearest.t);
    let front = least(&mut hits.iter().copied().filter(|hit| hit.front));
    Some(front.filter(close).unwrap_or(nearest))
}

fn assert_like_brute_force(mesh: &[Facet], rays: &[Ray]) {
    let want: Vec<_> = rays.iter().map(|ray| brute_force(mesh, ray)).collect();
    with_trees(mesh, |bvh| {
        for (ray, want) in rays.iter().zip(&want) {
            assert_eq!(bvh.closest(ray), *want, "{ray:?}");
            assert_eq!(bvh.occluded(ray), want.is_some(), "{ray:?}");
        }
        // together they find the same, however many there are
        for count in [rays.len(), 1, 127, 129] {
            let n = count.min(rays.len());
            let (mut hits, mut occluded) = (vec![None; n], vec![true; n]);
            bvh.closest_many(&rays[..n], &mut hits);
            bvh.occluded_many(&rays[..n], &mut occluded);
            assert_eq!(hits, want[..n]);
            assert!(occluded.iter().zip(&want[..n]).all(|(occluded, want)| *occluded == want.is_some()));
        }
    });
}

/// Rays of every kind that a mesh can be asked for: through space, from facets, along axes, at corners and edge
/// points, from far away, with and without limit.
fn rays(mesh: &[Facet], random: &mut Random, count: usize) -> Vec<Ray> {
    let axes = [Vec3::X, Vec3::Y, Vec3::Z, -Vec3::X, -Vec3::Y, -Vec3::Z];
    (0..count)
        .map(|i| {
            let skip = random.below(mesh.len());
            let [a, b, c] = mesh[skip];
            let (u, v) = (random.unit(), random.unit() * 0.5);
            let on_facet = a + (b - a) * (u * 0.5) + (c - a) * v;
            let mut ray = Ray::new(random.cube() * 1.5, random.direction());
            match i % 8 {
                0 => (ray.origin, ray.skip) = (on_facet, skip as u32),
                1 => ray.direction = axes[random.below(6)],
                2 => ray.direction = (a - ray.origin).normalize(),
                3 => ray.direction = (a + (b - a) * u - ray.origin).normalize(),
                4 => (ray.origin, ray.direction) = (a, axes[random.below(6)]),
                5 => {
                    let away = random.direction() * 10f64.powf(random.unit() * 7.0);
                    (ray.origin, ray.direction) = (on_facet - away, away.normalize());
                }
                6 => ray.t_max = random.unit(),
                _ => {}
            }
            ray
        })
        .collect()
}

fn random_mesh(random: &mut Random, count: usize, size: impl Fn(&mut Random) -> f64) -> Vec<Facet> {
    (0..count)
        .map(|_| {
            let (at, size) = (random.cube(), size(random));
            [at, at + random.cube() * size, at + random.cube() * size]
        })
        .collect()
}

/// A cube of 6 n^2 squares of two facets each, outward fronts, corners moved by `shape`.
fn cube(n: usize, shape: impl Fn(Vec3) -> Vec3) -> Vec<Facet> {
    let mut mesh = Vec::new();
    let at = |i: usize| 2.0 * i as f64 / n as f64 - 1.0;
    for axis in 0..3 {
        for side in [-1.0, 1.0] {
            let place = |i: usize, j: usize| {
                let mut p = [0.0; 3];
                (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) = (side, at(i), at(j));
                shape(Vec3::from_array(p))
            };
            for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
                let [a, b, c, d] = [place(i, j), place(i + 1, j), place(i + 1, j + 1), place(i, j + 1)];
                mesh.extend(if side > 0.0 { [[a, b, c], [a, c, d]] } else { [[a, c, b], [a, d, c]] });
            }
        }
    }
    mesh
}

#[test]
fn random_meshes_like_brute_force() {
    let mut random = Random(1);
    for count in [1, 2, 3, 4, 5, 6, 8, 9, 13, 31, 64, 200, 700] {
        let mesh = random_mesh(&mut random, count, |_| 0.3);
        let rays = rays(&mesh, &mut random, 2000);
        assert_like_brute_force(&mesh, &rays);
    }
}

#[test]
fn facets_of_all_sizes_and_needles_like_brute_force() {
    let mut random = Random(2);
    let mut mesh = random_mesh(&mut random, 300, |r| 10f64.powf(r.unit() * 9.3 - 9.0));
    for _ in 0..100 {
        let (at, along, across) = (random.cube(), random.direction(), random.direction());
        mesh.push([at, at + along, at + along * 0.5 + across * 1e-12]);
    }
    let rays = rays(&mesh, &mut random, 20_000);
    assert_like_brute_force(&mesh, &rays);
}

#[test]
fn grids_and_axis_rays_like_brute_force() {
    let mut random = Random(3);
    let mesh = cube(4, |p| p);
    let rays = rays(&mesh, &mut random, 20_000);
    assert_like_brute_force(&mesh, &rays);
}

#[test]
fn deep_and_coincident_meshes_like_brute_force() {
    let mut random = Random(4);
    // Sizes and distances halve a hundred times: no split by count alone suits them.
    let shrinking = |i: i32| {
        let s = 0.5f64.powi(i);
        [Vec3::new(s, 0.0, 0.0), Vec3::new(s, s, 0.0), Vec3::new(s, 0.0, s)]
    };
    let mut mesh: Vec<Facet> = (0..100).map(shrinking).collect();
    // The same centre five hundred times: nothing to split by.
    for _ in 0..500 {
        let (a, b) = (random.cube(), random.cube());
        mesh.push([a, b, -(a + b)]);
    }
    let rays = rays(&mesh, &mut random, 5000);
    assert_like_brute_force(&mesh, &rays);
}

#[test]
fn closed_meshes_do_not_leak() {
    let mut random = Random(5);
    let ball = cube(12, |p| p.normalize());
    let box_ = cube(8, |p| p);
    // Squeezed a million-fold: all facets are needles seen from most directions.
    let needle = cube(8, |p| p.normalize() * Vec3::new(1.0, 1e-6, 1.0));
    for mesh in [&ball, &box_, &needle] {
        let inside = if std::ptr::eq(mesh, &needle) { Vec3::new(0.3, 2e-7, 0.2) } else { Vec3::splat(0.3) };
        with_trees(mesh, |bvh| {
            for i in 0..40_000 {
                let [a, b, _] = mesh[random.below(mesh.len())];
                let aim = match i % 4 {
                    0 => a,
                    1 => (a + b) * 0.5,
                    2 => a + (b - a) * random.unit(),
                    _ => random.direction(),
                };
                let origin = if i % 3 == 0 { Vec3::ZERO } else { inside * random.unit() };
                let ray = Ray::new(origin, (aim - origin).normalize());
                let hit = bvh.closest(&ray).unwrap_or_else(|| panic!("leak: {ray:?}"));
                assert!(!hit.front, "{ray:?} {hit:?}");
                assert!(bvh.occluded(&ray));
                // The same way from far outside, the first hit is a front.
                let ray = Ray::new(origin - ray.direction * 4.0, ray.direction);
                assert!(bvh.closest(&ray).expect("leak").front, "{ray:?}");
            }
        });
    }
}

#[test]
fn axis_rays_through_every_corner_and_edge_of_a_grid() {
    let mesh = cube(6, |p| p);
    let at = |i: usize| i as f64 / 6.0 - 1.0;
    with_trees(&mesh, |bvh| {
        for (i, j) in (1..12).flat_map(|i| (1..12).map(move |j| (i, j))) {
            for axis in 0..3 {
                for sense in [1.0, -1.0] {
                    let (mut o, mut d) = ([at(i), at(j), 0.0], [0.0, 0.0, sense]);
                    o.rotate_right(axis);
                    d.rotate_right(axis);
                    let mut ray = Ray::new(o.into(), d.into());
                    let hit = bvh.closest(&ray).expect("leak");
                    // a product and a quotient round: two ulp
                    assert!((hit.t - 1.0).abs() < 4.5e-16 && !hit.front);
                    ray.origin -= ray.direction * 8.0;
                    let hit = bvh.closest(&ray).expect("leak");
                    assert!((hit.t - 7.0).abs() < 1.8e-15 && hit.front);
                }
            }
        }
    });
}

#[test]
fn ties_go_to_the_lowest_index_and_skip_leaves_out_one() {
    let mut random = Random(6);
    let once = random_mesh(&mut random, 60, |_| 0.8);
    let mesh: Vec<Facet> = (0..7).flat_map(|_| once.iter().copied()).collect();
    let rays = rays(&mesh, &mut random, 4000);
    assert_like_brute_force(&mesh, &rays);
    with_trees(&mesh, |bvh| {
        for ray in &rays {
            let Some(first) = bvh.closest(&Ray { skip: u32::MAX, ..*ray }) else { continue };
            assert!(first.facet < 60);
            let second = bvh.closest(&Ray { skip: first.facet, ..*ray }).unwrap();
            assert_eq!((second.t, second.facet), (first.t, first.facet + 60));
        }
    });
}

/// Panels without thickness, turned at random: fronts and backs share their corners, but not their diagonals nor where
/// facets begin, so that distances differ by rounding.
#[test]
fn of_sheets_that_coincide_the_side_that_faces_the_ray_is_met() {
    let mut random = Random(16);
    for panel in 0..40 {
        let (at, along) = (random.cube(), random.direction());
        let across = along.cross(random.direction()).normalize();
        let (along, across) = (along * (0.2 + random.unit()), across * (0.2 + random.unit()));
        let [a, b, c, d] = [at, at + along, at + along + across, at + across];
        let front = [[a, b, c], [c, d, a]];
        let back = if panel % 2 == 0 { [[c, b, a], [a, d, c]] } else { [[d, c, b], [a, d, b]] };
        let beyond = random_mesh(&mut random, 9, |_| 0.3);
        for order in [[front, back], [back, front]] {
            let mesh: Vec<Facet> = order.into_iter().flatten().chain(beyond.iter().copied()).collect();
            let mut rays = Vec::new();
            while rays.len() < 200 {
                let (u, v) = (random.unit(), random.unit());
                let direction = random.direction();
                let cosine = direction.dot(along.cross(across).normalize()).abs();
                if cosine > 0.02 {
                    let target = at + along * u + across * v;
                    rays.push(Ray::new(target - direction * (1e-3 + 9.0 * random.unit()), direction));
                }
            }
            assert_like_brute_force(&mesh, &rays);
            with_trees(&mesh, |bvh| {
                for ray in &rays {
                    let hit = bvh.closest(ray).unwrap();
                    assert!(hit.front || hit.facet >= 4, "{ray:?} {hit:?}");
                    // the back is met where the front is left, not what lies beyond
                    let behind = bvh.closest(&Ray { skip: hit.facet, ..*ray }).unwrap();
                    assert!(hit.facet >= 4 || behind.facet >= 4 || !behind.front, "{ray:?} {behind:?}");
                }
            });
        }
    }
}

#[test]
fn stacked_facets_a_nanometre_apart_are_told_apart() {
    let square = |z: f64| [Vec3::new(-1.0, -1.0, z), Vec3::new(1.0, -1.0, z), Vec3::new(0.0, 1.0, z)];
    // From the top down, so that index order is not distance order.
    let mesh: Vec<Facet> = (0..50).rev().map(|i| square(1e-9 * f64::from(i))).collect();
    let mut random = Random(7);
    assert_like_brute_force(&mesh, &rays(&mesh, &mut random, 4000));
    with_trees(&mesh, |bvh| {
        for i in 0..50u32 {
            let ray = Ray { skip: 49 - i, ..Ray::new(Vec3::new(0.1, -0.2, 1e-9 * f64::from(i)), Vec3::Z) };
            let want = if i == 49 { None } else { Some(48 - i) };
            assert_eq!(bvh.closest(&ray).map(|hit| hit.facet), want);
        }
    });
}

#[test]
fn distances_are_right_and_weights_meet_the_point() {
    let mut random = Random(8);
    let mesh = random_mesh(&mut random, 300, |_| 0.5);
    with_trees(&mesh, |bvh| {
        for ray in rays(&mesh, &mut random, 8000) {
            let Some(hit) = bvh.closest(&ray) else { continue };
            let [a, b, c] = mesh[hit.facet as usize];
            let n = (b - a).cross(c - a).normalize();
            let cos = n.dot(ray.direction);
            assert_eq!(hit.front, cos < 0.0);
            let reach = 1.0 + (a - ray.origin).length();
            // Hit::t's bound with room for this test's own normal; barycentric weights in addition suffer from the
            // rounding of the images, over the facet's height.
            let off = n.dot(ray.origin + ray.direction * hit.t - a).abs();
            assert!(off < 1e-14 * reach, "{off:e} {ray:?} {hit:?}");
            let height = normal(&[a, b, c]).length() * cos.abs() / 1.0;
            let point = a + (b - a) * hit.u + (c - a) * hit.v;
            let off = (point - ray.origin - ray.direction * hit.t).length();
            assert!(off < 1e-14 * reach / (height * cos.abs()), "{off:e} {ray:?} {hit:?}");
        }
    });
}

#[test]
fn needle_planes_are_as_good_as_any() {
    let mut random = Random(9);
    for _ in 0..2000 {
        let (at, along) = (random.cube(), random.direction());
        let facet = [at, at + along, at + along * random.unit() + random.direction() * 1e-12];
        let n = normal(&facet).normalize();
        // Each corner is a double away from the plane, no more: some roundings of coordinates of size 2.
        for corner in facet {
            assert!((n.dot(corner - at)).abs() < 1e-15);
        }
    }
}

#[test]
fn degenerate_facets_are_left_out() {
    let line = [Vec3::ZERO, Vec3::X, Vec3::X * 0.5];
    let square = [Vec3::new(-1.0, -1.0, 0.5), Vec3::new(1.0, -1.0, 0.5), Vec3::new(0.0, 1.0, 0.5)];
    let ray = Ray::new(Vec3::new(0.25, 0.0, -1.0), Vec3::Z);
    with_trees(&[line; 9], |bvh| {
        assert_eq!(bvh.closest(&ray), None);
        assert!(!bvh.occluded(&ray));
        assert_eq!(bvh.bounds(), (Vec3::ZERO, Vec3::ZERO));
    });
    with_trees(&[], |bvh| assert_eq!(bvh.closest(&ray), None));
    with_trees(&[line, line, square, line], |bvh| {
        assert_eq!(bvh.closest(&ray).map(|hit| (hit.facet, hit.t)), Some((2, 1.5)));
        assert_eq!(bvh.bounds(), (Vec3::new(-1.0, -1.0, 0.5), Vec3::new(1.0, 1.0, 0.5)));
    });
}

#[test]
fn rays_without_direction_or_end_hit_nothing() {
    let mesh = cube(2, |p| p);
    let bad = [Vec3::ZERO, Vec3::splat(f64::NAN), Vec3::new(f64::INFINITY, 0.0, 0.0)];
    with_trees(&mesh, |bvh| {
        for v in bad {
            assert_eq!(bvh.closest(&Ray::new(Vec3::ZERO, v)), None);
            assert_eq!(intersect(&Ray::new(Vec3::ZERO, v), 0, &mesh[0]), None);
        }
        assert_eq!(bvh.closest(&Ray::new(Vec3::splat(f64::NAN), Vec3::X)), None);
        assert_eq!(bvh.closest(&Ray { t_max: f64::NAN, ..Ray::new(Vec3::ZERO, Vec3::X) }), None);
        assert_eq!(bvh.closest(&Ray { t_max: -1.0, ..Ray::new(Vec3::ZERO, Vec3::X) }), None);
    });
}

#[test]
fn limits_are_exclusive() {
    let mesh = cube(3, |p| p);
    let ray = Ray::new(Vec3::new(0.1, 0.2, 0.0), Vec3::X);
    with_trees(&mesh, |bvh| {
        let t = bvh.closest(&ray).unwrap().t;
        assert_eq!(t, 0.9);
        assert!(!bvh.occluded(&Ray { t_max: t, ..ray }));
        assert!(bvh.occluded(&Ray { t_max: t.next_up(), ..ray }));
    });
}

#[test]
fn what_cannot_be_built_is_refused() {
    let mesh = cube(3, |p| p);
    let area = areas(&mesh);
    let needed = Bvh::bytes(mesh.len()).unwrap();
    for build in builders() {
        let mut memory = vec![0; needed];
        let given = needed - 1;
        let short = build(&mesh, &area, Isa::detect(), &mut memory[..given]).unwrap_err();
        assert_eq!(short, Error::BufferTooSmall { needed, given });
        let lengths = build(&mesh, &area[1..], Isa::detect(), &mut memory).unwrap_err();
        assert!(matches!(lengths, Error::Length { .. }));
        for x in [f64::NAN, f64::INFINITY, 1e30, 1e-30] {
            let bad = cube(3, |p| p * x);
            assert_eq!(build(&bad, &area, Isa::detect(), &mut memory).unwrap_err(), Error::Extent);
        }
    }
    assert!(matches!(Bvh::bytes(1 << 28), Err(Error::TooMany { .. })));
}

#[test]
fn the_bound_on_memory_holds_for_every_count() {
    let mut random = Random(10);
    for count in 0..150 {
        let mesh = random_mesh(&mut random, count, |r| r.unit() * r.unit());
        with_trees(&mesh, |_| {});
        let per_facet = Bvh::bytes(count).unwrap() as f64 / count.max(1) as f64;
        assert!(count < 100 || per_facet < 760.0, "{per_facet}");
    }
}
