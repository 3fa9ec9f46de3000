//! The edges of a mesh: which facets meet in them, and which share a plane.
//!
//! Constants of this file are measured by `cargo test --test outlines` (outlines against rays).

use super::{BOTH, Block, plane, product};
use crate::base::arena::{Arena, Need};
use crate::base::error::Error;
use crate::base::index::{Index, IndexMut};
use crate::base::math::Vec3;
use crate::base::simd::WIDTH;
use crate::base::sort::sort;
use core::cmp::Ordering;

/// Largest sine of the angle between facets of one plane.
const COPLANAR_SINE: f64 = 4e-6;

/// Largest distance of facets of one plane from it, in scene coordinates.
const COPLANAR_DISTANCE: f64 = 1e-7;

/// Most facets at one edge that are paired; where more meet, each has the edge for itself.
const MOST_PAIRED: usize = 16;

/// No second facet.
const NOBODY: u32 = u32::MAX;

/// Where an edge lies along a curve through the scene, and the sides of facets that it is: three times the facet, and which.
type Pair = [u32; 3];

/// A key by which sides of facets are sorted first, and three times the facet and which side it is.
type Half = [u32; 2];

/// Memory while edges are found.
pub struct Build<'s, 'm> {
    corners: &'s [[Vec3; 3]],
    areas: &'s [f64],
    halves: &'m mut [Half],
    pairs: &'m mut [Pair],
    bodies: &'m mut [u32],
}

/// Edges that were found.
pub struct Found<'s, 'm> {
    corners: &'s [[Vec3; 3]],
    pairs: &'m [Pair],
    bodies: &'m [u32],
}

impl<'s, 'm> Build<'s, 'm> {
    pub fn need(need: Need, facets: usize, most: usize) -> Need {
        need.and::<Half>(3 * facets).and::<Pair>(most).and::<u32>(facets)
    }

    pub fn new(
        corners: &'s [[Vec3; 3]],
        areas: &'s [f64],
        most: usize,
        arena: &mut Arena<'m>,
    ) -> Result<Build<'s, 'm>, Error> {
        let halves = arena.take::<Half>(3 * corners.len())?;
        let pairs = arena.take::<Pair>(most)?;
        let bodies = arena.take::<u32>(corners.len())?;
        Ok(Build { corners, areas, halves, pairs, bodies })
    }

    /// Fills `groups` and finds the edges; `None` where they are too many.
    pub fn run(self, groups: &mut [u32]) -> Option<Found<'s, 'm>> {
        let Build { corners, areas, halves, pairs, bodies } = self;
        let mut count = 0;
        for (facet, _) in areas.iter().enumerate().filter(|(_, area)| **area > 0.0) {
            for side in 0..3 {
                let half = (3 * facet + side) as u32;
                halves.set(count, [key(ends(corners, half).0.x), half]);
                count += 1;
            }
        }
        let (halves, _) = halves.split_at_mut(count.min(halves.len()));
        sort(halves, &|a, b| {
            a[0].cmp(&b[0]).then_with(|| {
                let ((p, q, _), (r, s, _)) = (ends(corners, a[1]), ends(corners, b[1]));
                order(p, r).then(order(q, s))
            })
        });
        for set in [&mut *groups, &mut *bodies] {
            set.iter_mut().enumerate().for_each(|(facet, to)| *to = facet as u32);
        }
        for run in runs(corners, halves) {
            join(corners, run, groups, bodies);
        }
        for facet in 0..groups.len() {
            let (group, body) = (find(groups, facet as u32), find(bodies, facet as u32));
            groups.set(facet, group);
            bodies.set(facet, body);
        }
        // BOTH marks bodies with a rim for now, in their first facet
        let (mut edges, mut fits) = (0, true);
        for run in runs(corners, halves) {
            pair(corners, run, groups, |first, second| {
                let Some(place) = pairs.get_mut(edges) else {
                    fits = false;
                    return;
                };
                *place = [along(corners, first), first, second];
                edges += 1;
                if second == NOBODY {
                    let body = (bodies.at(first as usize / 3) & !BOTH) as usize;
                    bodies.set(body, bodies.at(body) | BOTH);
                }
            });
        }
        for facet in 0..groups.len() {
            let rim = bodies.at((bodies.at(facet) & !BOTH) as usize) & BOTH;
            groups.set(facet, groups.at(facet) | rim);
        }
        let (pairs, _) = pairs.split_at_mut(edges.min(pairs.len()));
        sort(pairs, &|a, b| a.cmp(b));
        fits.then_some(Found { corners, pairs, bodies })
    }
}

impl Found<'_, '_> {
    /// How many there are.
    pub fn count(&self) -> usize {
        self.pairs.len()
    }

    /// Fills `blocks`.
    pub fn lay(&self, groups: &[u32], blocks: &mut [Block]) {
        for (number, pair) in self.pairs.iter().enumerate() {
            if let Some(block) = blocks.get_mut(number / WIDTH) {
                let body = self.bodies.at(pair.at(1) as usize / 3) & !BOTH;
                put(self.corners, (groups, body), block, number % WIDTH, pair);
            }
        }
    }
}

/// Lexicographic order of places: those of equal corners are the same.
pub(super) fn order(a: Vec3, b: Vec3) -> Ordering {
    let of = |a: f64, b: f64| a.partial_cmp(&b).unwrap_or(Ordering::Equal);
    of(a.x, b.x).then(of(a.y, b.y)).then(of(a.z, b.z))
}

/// The lower and the upper end of a side, and whether its facet runs from the lower to the upper.
fn ends(corners: &[[Vec3; 3]], half: u32) -> (Vec3, Vec3, bool) {
    let facet = corners.at(half as usize / 3);
    let side = half as usize % 3;
    let (from, to) = (facet.at(side), facet.at((side + 1) % 3));
    if order(from, to) == Ordering::Less { (from, to, true) } else { (to, from, false) }
}

/// A number that grows with a coordinate, to 24 bits.
fn key(x: f64) -> u32 {
    // the order of numbers is that of their bits, but for negative ones; both zeros are one
    let bits = (x as f32 + 0.0).to_bits();
    if bits >> 31 == 0 { bits | 1 << 31 } else { !bits }
}

/// Sides between the same ends.
fn runs<'h>(corners: &[[Vec3; 3]], halves: &'h [Half]) -> impl Iterator<Item = &'h [Half]> {
    halves.chunk_by(|[key, a], [other, b]| {
        if key != other {
            return false;
        }
        let ((p, q, _), (r, s, _)) = (ends(corners, *a), ends(corners, *b));
        order(p, r).then(order(q, s)) == Ordering::Equal
    })
}

/// The first of a set that a facet is in.
fn find(sets: &mut [u32], facet: u32) -> u32 {
    let mut at = facet;
    loop {
        let next = sets.at(at as usize);
        if next == at {
            return at;
        }
        sets.set(at as usize, sets.at(next as usize));
        at = sets.at(next as usize);
    }
}

fn unite(sets: &mut [u32], a: u32, b: u32) {
    let (a, b) = (find(sets, a), find(sets, b));
    sets.set(a.max(b) as usize, a.min(b));
}

/// Joins the bodies of the facets in one edge, and the planes of those that have the same.
fn join(corners: &[[Vec3; 3]], run: &[Half], groups: &mut [u32], bodies: &mut [u32]) {
    for pair in run.windows(2) {
        unite(bodies, pair.at(0)[1] / 3, pair.at(1)[1] / 3);
    }
    for (at, &[_, a]) in run.iter().enumerate().take(MOST_PAIRED) {
        for &[_, b] in run.iter().take(MOST_PAIRED).skip(at + 1) {
            let (f, g) = (find(groups, a / 3), find(groups, b / 3));
            if ends(corners, a).2 != ends(corners, b).2
                && coplanar(corners, f, a / 3)
                && coplanar(corners, f, b / 3)
                && coplanar(corners, f, g)
                && coplanar(corners, g, f)
            {
                unite(groups, f, g);
            }
        }
    }
}

/// Whether a facet lies in the plane of another.
fn coplanar(corners: &[[Vec3; 3]], of: u32, facet: u32) -> bool {
    let (normal, distance) = plane(&corners.at(of as usize));
    let (own, _) = plane(&corners.at(facet as usize));
    let cross = normal.cross(own);
    let near = |c: &Vec3| (product(normal, *c) - distance).abs() <= COPLANAR_DISTANCE;
    normal.dot(own) > 0.0
        && cross.dot(cross) <= COPLANAR_SINE * COPLANAR_SINE
        && corners.at(facet as usize).iter().all(near)
}

/// Calls `each` with the sides that meet in one edge: two of opposite senses, or one. Pairs of one plane are left out.
fn pair(corners: &[[Vec3; 3]], run: &[Half], groups: &[u32], mut each: impl FnMut(u32, u32)) {
    if run.len() > MOST_PAIRED {
        run.iter().for_each(|&[_, half]| each(half, NOBODY));
        return;
    }
    let group = |half: u32| groups.at(half as usize / 3);
    let mut used = 0u32;
    for same in [true, false] {
        for (i, &[_, a]) in run.iter().enumerate() {
            let other = run.iter().enumerate().skip(i + 1).find(|&(j, &[_, b])| {
                used & (1 << i | 1 << j) == 0
                    && ends(corners, a).2 != ends(corners, b).2
                    && (!same || group(a) == group(b))
            });
            if let Some((j, &[_, b])) = other {
                used |= 1 << i | 1 << j;
                if !same {
                    each(a, b);
                }
            }
        }
    }
    run.iter().enumerate().filter(|(i, _)| used & 1 << i == 0).for_each(|(_, &[_, a])| each(a, NOBODY));
}

/// Place of an edge's middle along a curve that fills the scene.
fn along(corners: &[[Vec3; 3]], half: u32) -> u32 {
    let (a, b, _) = ends(corners, half);
    let middle = (a + b) * 0.25 + Vec3::splat(0.5);
    let spread = |x: f64| {
        let cell = (crate::base::math::clamp(x, 0.0, 1.0) * 1023.0) as u32;
        (0..10).fold(0, |all, bit| all | (cell >> bit & 1) << (3 * bit))
    };
    spread(middle.x) | spread(middle.y) << 1 | spread(middle.z) << 2
}

/// Puts an edge into a lane.
fn put(
    corners: &[[Vec3; 3]],
    (groups, body): (&[u32], u32),
    block: &mut Block,
    lane: usize,
    &[_, first, second]: &Pair,
) {
    let (low, high, _) = ends(corners, first);
    let mut values = [0.0; super::EDGE_BLOCK_ROWS];
    let mut lay =
        |start: usize, v: [f64; 3]| v.into_iter().enumerate().for_each(|(k, x)| values.set(start + k, x));
    lay(0, low.to_array());
    lay(3, high.to_array());
    let other = if second == NOBODY { first } else { second };
    let planes = [first, other].map(|half| {
        let of = groups.at(half as usize / 3);
        (plane(&corners.at((of & !BOTH) as usize)), ends(corners, half).2, of & BOTH != 0)
    });
    lay(6, planes[0].0.0.to_array());
    lay(10, planes[1].0.0.to_array());
    values.set(18, f64::from(body));
    for (number, ((_, distance), upward, both)) in planes.into_iter().enumerate() {
        values.set(9 + 4 * number, distance);
        if number == 0 || second != NOBODY {
            values.set(14 + number, if upward { 1.0 } else { -1.0 });
            values.set(16 + number, if both { 1.0 } else { 0.0 });
        }
    }
    block.iter_mut().zip(values).for_each(|(lanes, x)| lanes.set(lane, x));
}
