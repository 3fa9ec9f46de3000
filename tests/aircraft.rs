//! The built-in aircraft is a sound mesh: closed, oriented outward, free of self-intersections and of slivers,
//! symmetric, and hollow where its engine inlets are.

#[path = "../kernel/examples/render/aircraft.rs"]
mod aircraft;

use aircraft::{CAMERA_EYE, CAMERA_HEIGHT, CAMERA_TARGET, CAMERA_UP, Model, aircraft};
use glam::DVec3;
use std::collections::{HashMap, HashSet};

type Triangle = [DVec3; 3];

fn triangles(model: &Model) -> Vec<Triangle> {
    model.facets.iter().map(|f| f.map(|id| DVec3::from(model.vertices[id as usize]))).collect()
}

/// Twice the facet's area along its outward normal.
fn normal([a, b, c]: &Triangle) -> DVec3 {
    (*b - *a).cross(*c - *a)
}

/// Distance, in units of |direction|, at which a line pierces a facet.
fn pierce(origin: DVec3, direction: DVec3, t: &Triangle) -> Option<f64> {
    let n = normal(t);
    let distance = (t[0] - origin).dot(n) / direction.dot(n);
    let p = origin + distance * direction;
    let inside = (0..3).all(|k| (t[(k + 1) % 3] - t[k]).cross(p - t[k]).dot(n) >= 0.0);
    (inside && distance.is_finite()).then_some(distance)
}

/// The nearest facet that a ray hits, and its distance.
fn first_hit(mesh: &[Triangle], origin: DVec3, direction: DVec3) -> Option<(usize, f64)> {
    mesh.iter()
        .enumerate()
        .filter_map(|(id, t)| pierce(origin, direction, t).map(|distance| (id, distance)))
        // Beyond the facet that the ray starts on, which it may meet again by rounding (about 1e-15).
        .filter(|hit| hit.1 > 1e-9)
        .min_by(|a, b| a.1.total_cmp(&b.1))
}

#[test]
fn has_a_few_thousand_facets_and_uses_every_vertex() {
    let model = aircraft();
    assert!((2_000..=6_000).contains(&model.facets.len()), "{} facets", model.facets.len());
    let used: HashSet<u32> = model.facets.iter().flatten().copied().collect();
    assert_eq!(used.len(), model.vertices.len());
    assert!(used.iter().all(|&id| (id as usize) < model.vertices.len()));
    let places: HashSet<_> = model.vertices.iter().map(|v| v.map(f64::to_bits)).collect();
    assert_eq!(places.len(), model.vertices.len(), "two vertices at one place");
}

#[test]
fn every_edge_joins_two_facets_in_opposite_directions() {
    let model = aircraft();
    let mut uses: HashMap<[u32; 2], usize> = HashMap::new();
    for f in &model.facets {
        for k in 0..3 {
            *uses.entry([f[k], f[(k + 1) % 3]]).or_default() += 1;
        }
    }
    for (&[a, b], &count) in &uses {
        assert_eq!(count, 1, "directed edge {a}-{b}");
        assert!(uses.contains_key(&[b, a]), "edge {a}-{b} is open");
    }
    // Euler's formula for a surface of one piece without handles: the parts are stitched, not set beside.
    assert_eq!(model.vertices.len() + model.facets.len(), uses.len() / 2 + 2);
}

#[test]
fn encloses_a_positive_volume() {
    let volume: f64 = triangles(&aircraft()).iter().map(|[a, b, c]| a.dot(b.cross(*c)) / 6.0).sum();
    // The body is about 15 long and 1.2 high, and 2 wide on average; the wings add little.
    assert!((15.0..36.0).contains(&volume), "volume {volume}");
}

#[test]
fn no_facet_is_a_sliver() {
    for (id, t) in triangles(&aircraft()).iter().enumerate() {
        let longest = (0..3).map(|k| t[k].distance_squared(t[(k + 1) % 3])).fold(0.0, f64::max);
        let shape = 0.5 * normal(t).length() / longest;
        // Equilateral: 0.43. The least belong to the thin trailing edges at the tips, where 0.015 means a
        // height of 3 % of the length, still far from where double precision would lose the normal.
        assert!(shape > 0.015, "facet {id}: area over squared length is {shape}");
    }
}

#[test]
fn left_and_right_mirror_each_other() {
    let model = aircraft();
    // Adding 0 turns -0 into 0, so that the vertices of the plane of symmetry match themselves.
    let key = |f: &[u32; 3], side: f64| {
        let mut corners = f.map(|id| {
            let [x, y, z] = model.vertices[id as usize];
            [x, side * y + 0.0, z].map(f64::to_bits)
        });
        corners.sort_unstable();
        corners
    };
    let facets: HashSet<_> = model.facets.iter().map(|f| key(f, 1.0)).collect();
    assert_eq!(facets.len(), model.facets.len());
    assert!(model.facets.iter().all(|f| facets.contains(&key(f, -1.0))));
}

#[test]
fn facets_do_not_pierce_each_other() {
    let model = aircraft();
    let mesh = triangles(&model);
    // Boxes grow by far more than rounding, so that a touch counts as an overlap.
    let low: Vec<_> = mesh.iter().map(|t| t[0].min(t[1]).min(t[2]) - DVec3::splat(1e-9)).collect();
    let high: Vec<_> = mesh.iter().map(|t| t[0].max(t[1]).max(t[2]) + DVec3::splat(1e-9)).collect();
    let apart = |i: usize, j: usize| low[i].cmpgt(high[j]).any() || low[j].cmpgt(high[i]).any();
    let mut compared = 0;
    for i in 0..mesh.len() {
        for j in (0..mesh.len()).filter(|&j| j != i && !apart(i, j)) {
            let (edges_of, other) = (&model.facets[i], &model.facets[j]);
            // An edge that starts on the other facet touches it there and rightly so.
            for k in (0..3).filter(|&k| ![k, (k + 1) % 3].iter().any(|&k| other.contains(&edges_of[k]))) {
                let (start, end) = (mesh[i][k], mesh[i][(k + 1) % 3]);
                let hit = pierce(start, end - start, &mesh[j]);
                assert!(!hit.is_some_and(|s| (0.0..=1.0).contains(&s)), "facet {i} pierces facet {j}");
                compared += 1;
            }
        }
    }
    assert!(compared > mesh.len(), "the boxes hide the facets from each other");
}

#[test]
fn neighbours_do_not_fold_back_on_each_other() {
    let model = aircraft();
    let mesh = triangles(&model);
    let mut owner = HashMap::new();
    for (id, f) in model.facets.iter().enumerate() {
        for k in 0..3 {
            owner.insert([f[k], f[(k + 1) % 3]], id);
        }
    }
    for (&[a, b], &id) in &owner {
        let bend = normal(&mesh[id]).normalize().dot(normal(&mesh[owner[&[b, a]]]).normalize());
        // Facets that share an edge overlap only if their normals are opposite; lips and edges of the wings
        // bend by less than 170 degrees.
        assert!(bend > -0.985, "edge {a}-{b}: cosine between normals {bend}");
    }
}

#[test]
fn facets_see_each_other_from_in_front() {
    let mesh = triangles(&aircraft());
    let mut seeing = 0;
    for t in &mesh {
        let n = normal(t).normalize();
        if let Some((id, _)) = first_hit(&mesh, (t[0] + t[1] + t[2]) / 3.0, n) {
            assert!(normal(&mesh[id]).dot(n) < 0.0, "facet {id} is seen from behind");
            seeing += 1;
        }
    }
    // On a convex body none would. The walls of the two ducts alone have more than 200 facets.
    assert!(seeing > 200, "{seeing} facets face another");
}

#[test]
fn inlets_are_ducts_with_a_back_wall() {
    let mesh = triangles(&aircraft());
    for side in [-1.0, 1.0] {
        // In the middle of the duct, behind its lip.
        let inside = DVec3::new(1.0, side * 0.8, -0.03);
        for direction in [DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z, DVec3::NEG_X] {
            let (id, distance) = first_hit(&mesh, inside, direction).expect("a wall of the duct");
            assert!(distance < 1.5, "wall at {distance}");
            assert!(normal(&mesh[id]).dot(direction) < 0.0, "facet {id} is seen from behind");
        }
        assert_eq!(first_hit(&mesh, inside, DVec3::X), None, "the duct is open ahead");
    }
}

#[test]
fn the_suggested_view_frames_the_aircraft_and_shows_an_inlet() {
    let mesh = triangles(&aircraft());
    let (eye, target) = (DVec3::from(CAMERA_EYE), DVec3::from(CAMERA_TARGET));
    let forward = (target - eye).normalize();
    let right = forward.cross(DVec3::from(CAMERA_UP)).normalize();
    let up = right.cross(forward);
    for p in mesh.iter().flatten() {
        let offset = *p - target;
        let reach = offset.dot(right).abs().max(offset.dot(up).abs());
        assert!(reach < 0.5 * CAMERA_HEIGHT, "{p} lies outside the image");
        assert!((*p - eye).dot(forward) > 0.0, "{p} lies behind the eye");
    }
    // A point in the opening of the left inlet is in view, and what is seen through it lies in the duct.
    let opening = DVec3::new(1.9, 1.1, -0.2);
    let (_, distance) = first_hit(&mesh, opening - 30.0 * forward, forward).expect("a wall of the duct");
    assert!(distance > 30.0, "the opening is hidden");
}
