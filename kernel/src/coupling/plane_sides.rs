//! Visibility between facets by planes alone: for each side of a facet, the facets that rise before its plane.
//!
//! A segment from one facet to another stays before both facets' planes. What does not rise before both, or has all
//! facets on one side of its own plane, is not in its way; what is left is tried against the shaft, the convex hull of
//! both facets (Haines and Wallace, 1991).
//!
//! Constants of this file are measured by `cargo test --test closed_forms` (which rows are in closed form) and `cargo bench
//! --bench counts` (instructions).

use crate::base::arena::{Arena, Need};
use crate::base::error::Error;
use crate::base::index::{Index, IndexMut, copy, pieces};
use crate::base::math::{Vec3, sqrt};
use crate::base::simd::{Task, run};
use crate::rays::bvh::Bvh;
use crate::rays::surface::{OFFSET, opens_to_sky};
use crate::scene::Scene;

/// Most sides of facets of a scene whose planes are compared: the table's bits grow with the square of their number.
pub const SIDES_MOST: usize = 8192;

/// Words of a set of sides.
pub(crate) const SIDE_SET_WORDS: usize = SIDES_MOST / 64;

/// Height before a plane, over the extent of the plane's facet, up to which a facet does not count as before it: it
/// hides no more than that share.
const PLANE_RISE_SLACK: f64 = 1e-6;

/// Heights and widths up to which facets touch, in scene coordinates.
const CONTACT_DISTANCE: f64 = 1e-9;

/// Facets of a block.
const PLANE_LANES: usize = 8;

/// Corners of [`PLANE_LANES`] facets: corner, axis, lane.
type Corners = [[[f64; PLANE_LANES]; 3]; 3];

/// Which facets rise before the plane of each facet's side: the candidates for occluders. Empty for scenes of more than
/// [`SIDES_MOST`] sides.
#[derive(Clone, Copy, Debug)]
pub struct PlaneSides<'m> {
    before: &'m [u64],
    /// Facets that have others on both sides of their planes: only these can stand between two.
    screens: &'m [u64],
    /// Facets that share a part of their plane with another.
    shared: &'m [u64],
    words: usize,
    sides: usize,
}

impl<'m> PlaneSides<'m> {
    /// Nothing is known.
    pub const NONE: PlaneSides<'static> =
        PlaneSides { before: &[], screens: &[], shared: &[], words: 0, sides: 1 };

    fn words(scene: &Scene<'_>, wanted: bool) -> usize {
        let few = scene.facets() * scene.sides() <= SIDES_MOST;
        if wanted && few { scene.facets().div_ceil(64) } else { 0 }
    }

    /// Bytes for a scene: at most 9 MiB. Not `wanted` where the sky's directions are to be kept: what uses the table then
    /// gains nothing by it.
    pub fn bytes(scene: &Scene<'_>, wanted: bool) -> Result<usize, Error> {
        let words = PlaneSides::words(scene, wanted);
        let rows = scene.facets() * scene.sides();
        let blocks = if words > 0 { scene.facets().div_ceil(PLANE_LANES) } else { 0 };
        let sets = Need::new().and::<u64>(if words > 0 { rows * words } else { 0 });
        sets.and::<u64>(words).and::<u64>(words).and::<u64>(2 * words).and::<Corners>(blocks).bytes()
    }

    /// Compares the planes of all facets with all facets, or none where that is not `wanted`.
    pub fn new(
        scene: &Scene<'_>,
        bvh: &Bvh<'_>,
        wanted: bool,
        memory: &'m mut [u8],
    ) -> Result<PlaneSides<'m>, Error> {
        let (words, sides) = (PlaneSides::words(scene, wanted), scene.sides());
        let mut arena = Arena::new(memory, PlaneSides::bytes(scene, wanted)?)?;
        if words == 0 {
            return Ok(PlaneSides::NONE);
        }
        let before = arena.take::<u64>(scene.facets() * sides * words)?;
        let screens = arena.take::<u64>(words)?;
        let shared = arena.take::<u64>(words)?;
        let (behind, real) = arena.take::<u64>(2 * words)?.split_at_mut_checked(words).unwrap_or_default();
        let blocks = arena.take::<Corners>(scene.facets().div_ceil(PLANE_LANES))?;
        blocks.fill([[[0.0; PLANE_LANES]; 3]; 3]);
        [&mut *screens, &mut *shared, &mut *real].into_iter().for_each(|set| set.fill(0));
        for (facet, (corners, area)) in scene.corners().iter().zip(scene.areas()).enumerate() {
            for (axes, corner) in blocks.iter_mut().skip(facet / PLANE_LANES).take(1).flatten().zip(corners) {
                axes.iter_mut()
                    .zip(corner.to_array())
                    .for_each(|(lanes, x)| lanes.set(facet % PLANE_LANES, x));
            }
            if *area > 0.0 {
                insert(real, facet);
            }
        }
        for (facet, rows) in pieces(before, sides * words).enumerate() {
            rows.fill(0);
            let normal = scene.side_normal(facet, 0);
            let open = |side: usize| opens_to_sky(scene, bvh, facet, scene.side_normal(facet, side));
            if scene.areas().at(facet) == 0.0 || (open(0) && (sides == 1 || open(1))) {
                continue;
            }
            let height = scene.corners().at(facet).iter().map(|c| c.dot(normal)).sum::<f64>() / 3.0;
            let slack = PLANE_RISE_SLACK * sqrt(scene.areas().at(facet)) + 0.5 * OFFSET;
            let front = rows.head_mut(words);
            run(
                bvh.isa(),
                Compare { blocks, normal, height, slack, front: &mut *front, behind: &mut *behind },
            );
            for (front, (behind, real)) in front.iter_mut().zip(behind.iter_mut().zip(&*real)) {
                (*front, *behind) = (*front & real, *behind & real);
            }
            if front.iter().any(|w| *w != 0) && behind.iter().any(|w| *w != 0) {
                insert(screens, facet);
            }
            let flat = front.iter().zip(&*behind).zip(&*real).map(|((f, b), real)| real & !(f | b));
            if members(flat).any(|other| other != facet && overlap(scene, facet, other)) {
                insert(shared, facet);
            }
            if sides == 2 {
                copy(rows.part_mut(words..2 * words), behind);
            }
        }
        Ok(PlaneSides { before, screens, shared, words, sides })
    }

    /// True where the scene has too many sides: nothing is known then.
    pub fn is_empty(&self) -> bool {
        self.words == 0
    }

    fn set(&self, facet: usize, side: usize) -> &'m [u64] {
        let start = (facet * self.sides + side) * self.words;
        self.before.part(start..start + self.words)
    }

    /// The facets that rise before the plane of a side.
    pub fn before(&self, facet: usize, side: usize) -> impl Iterator<Item = usize> + use<'m> {
        members(self.set(facet, side).iter().copied())
    }

    /// True where no other facet lies in a part of this one's plane, so that rays meet it or what is before it.
    pub fn is_alone(&self, facet: usize) -> bool {
        !contains(self.shared, facet)
    }

    /// Whether nothing stands between the receiver and a side of another facet. Each facet that planes leave in question
    /// costs one of `tries`; false where they are used up.
    pub fn is_unoccluded(
        &self,
        scene: &Scene<'_>,
        receiver: &Receiver,
        other: usize,
        other_side: usize,
        tries: &mut u32,
    ) -> bool {
        let Receiver { facet, side, .. } = *receiver;
        let sets = || {
            let both = self.set(facet, side).iter().zip(self.set(other, other_side));
            both.zip(self.screens).map(|((a, b), s)| a & b & s)
        };
        // mostly none, which takes no walk through members
        if sets().fold(0, |all, word| all | word) == 0 {
            return true;
        }
        let mut between = members(sets()).filter(|&k| k != facet && k != other);
        let to = scene.corners().at(other);
        between.all(|k| {
            *tries = tries.saturating_sub(1);
            *tries > 0
                && is_separated(&receiver.corners, &to, (&scene.corners().at(k), scene.side_normal(k, 0)))
        })
    }
}

/// A triangle on a side of a facet, of which is asked what it sees.
#[derive(Clone, Copy, Debug)]
pub struct Receiver {
    /// The facet.
    pub facet: usize,
    /// 0: front, 1: back.
    pub side: usize,
    /// Unit normal of the side.
    pub normal: Vec3,
    /// Corners in scene coordinates.
    pub corners: [Vec3; 3],
}

impl Receiver {
    /// Whether a part of a facet's side lies wholly before the receiver's plane, and the receiver before its.
    pub(crate) fn faces(&self, scene: &Scene<'_>, (facet, side): (usize, usize), part: &[Vec3; 3]) -> bool {
        let base = self.corners[0].dot(self.normal);
        let (low, high) = heights(scene, facet, &self.corners);
        part.iter().all(|c| c.dot(self.normal) - base >= -EDGE_ON_HEIGHT)
            && if side == 0 { low >= -EDGE_ON_HEIGHT } else { high <= EDGE_ON_HEIGHT }
    }
}

/// Most facets left in question by planes that are tried against the shafts of one receiver: with more, little is found
/// unoccluded.
const SHAFT_TRIES_MOST: u32 = 64;

/// Sides of facets that are proven visible from all of a receiver, with nothing between; and how many elements they
/// have.
#[derive(Debug)]
pub struct ProvenVisible<'m> {
    proven: &'m mut [u64],
    /// Elements of the proven sides.
    pub elements: usize,
    /// True where the receiver can see nothing else.
    pub all: bool,
}

impl<'m> ProvenVisible<'m> {
    /// Words of memory for a scene's sides.
    pub fn words(scene: &Scene<'_>) -> usize {
        (scene.facets() * scene.sides()).div_ceil(64).min(SIDE_SET_WORDS)
    }

    /// Nothing is proven yet; `memory` has [`ProvenVisible::words`] words of any content.
    pub fn new(memory: &'m mut [u64]) -> ProvenVisible<'m> {
        memory.fill(0);
        ProvenVisible { proven: memory, elements: 0, all: true }
    }

    /// Forgets all that is proven.
    pub fn clear(&mut self) {
        self.proven.fill(0);
        (self.elements, self.all) = (0, true);
    }

    /// Whether rays need not find a side of a facet.
    pub fn has(&self, facet: usize, side: usize, sides: usize) -> bool {
        contains(self.proven, facet * sides + side)
    }

    /// As [`ProvenVisible::prove`], facets being counted; whether the receiver sees nothing else.
    pub fn prove_whole(
        &mut self,
        scene: &Scene<'_>,
        plane_sides: &PlaneSides<'_>,
        receiver: &Receiver,
        most: usize,
    ) -> bool {
        // the back of a one-sided facet may show, or is hidden by what no plane tells
        let back =
            |facet: usize| scene.sides() == 1 && heights(scene, facet, &receiver.corners).0 < -EDGE_ON_HEIGHT;
        if plane_sides.is_empty() || plane_sides.before(receiver.facet, receiver.side).any(back) {
            return false;
        }
        self.prove(scene, plane_sides, receiver, most, |_, _| 1);
        self.all
    }

    /// How many elements the receiver may see, `count` those of a side of a facet.
    pub fn possible(
        scene: &Scene<'_>,
        plane_sides: &PlaneSides<'_>,
        receiver: &Receiver,
        count: impl Fn(usize, usize) -> usize,
    ) -> usize {
        let of = |facet: usize| {
            let (low, high) = heights(scene, facet, &receiver.corners);
            let front = if high > EDGE_ON_HEIGHT { count(facet, 0) } else { 0 };
            front + if low < -EDGE_ON_HEIGHT && scene.sides() == 2 { count(facet, 1) } else { 0 }
        };
        plane_sides.before(receiver.facet, receiver.side).map(of).sum()
    }

    /// Proves what nothing hides from the receiver, as far as `most` elements, `count` those of a side of a facet, and
    /// `SHAFT_TRIES_MOST` go.
    pub fn prove(
        &mut self,
        scene: &Scene<'_>,
        plane_sides: &PlaneSides<'_>,
        receiver: &Receiver,
        most: usize,
        count: impl Fn(usize, usize) -> usize,
    ) {
        let mut tries = SHAFT_TRIES_MOST;
        for facet in plane_sides.before(receiver.facet, receiver.side) {
            let (low, high) = heights(scene, facet, &receiver.corners);
            for side in [0, 1] {
                let seen = if side == 0 { high > EDGE_ON_HEIGHT } else { low < -EDGE_ON_HEIGHT };
                if !seen {
                    continue;
                }
                let count = count(facet, side);
                if side < scene.sides()
                    && self.elements + count <= most
                    && plane_sides.is_alone(facet)
                    && plane_sides.is_unoccluded(scene, receiver, facet, side, &mut tries)
                {
                    insert(self.proven, facet * scene.sides() + side);
                    self.elements += count;
                } else {
                    self.all = false;
                }
            }
        }
    }
}

/// Heights (scene coordinates) below which a plane is seen edge-on.
const EDGE_ON_HEIGHT: f64 = 1e-13;

/// The least and the greatest height of points above a facet's front.
fn heights(scene: &Scene<'_>, facet: usize, points: &[Vec3; 3]) -> (f64, f64) {
    let normal = scene.side_normal(facet, 0);
    let base = scene.corners().at(facet)[0];
    let of = |p: Vec3| (p - base).dot(normal);
    let [a, b, c] = points.map(of);
    (a.min(b).min(c), a.max(b).max(c))
}

/// Puts a facet into a set.
fn insert(set: &mut [u64], facet: usize) {
    if let Some(word) = set.get_mut(facet / 64) {
        *word |= 1 << (facet % 64);
    }
}

/// Whether a facet is in a set.
#[inline]
fn contains(set: &[u64], facet: usize) -> bool {
    set.at(facet / 64) >> (facet % 64) & 1 == 1
}

/// The members of a set, in order.
fn members(words: impl Iterator<Item = u64>) -> impl Iterator<Item = usize> {
    words.enumerate().flat_map(|(at, word)| {
        let mut left = word;
        core::iter::from_fn(move || {
            let bit = left.trailing_zeros() as usize;
            left &= left.wrapping_sub(1);
            (bit < 64).then_some(at * 64 + bit)
        })
    })
}

/// Compares all facets with one plane.
struct Compare<'a> {
    blocks: &'a [Corners],
    normal: Vec3,
    height: f64,
    slack: f64,
    front: &'a mut [u64],
    behind: &'a mut [u64],
}

impl Task for Compare<'_> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let Compare { blocks, normal, height, slack, front, behind } = self;
        for (word, (front, behind)) in front.iter_mut().zip(behind.iter_mut()).enumerate() {
            (*front, *behind) = (0, 0);
            let start = word * (64 / PLANE_LANES);
            let blocks = blocks.part(start..blocks.len().min(start + 64 / PLANE_LANES));
            for (block, shift) in blocks.iter().zip((0..64).step_by(PLANE_LANES)) {
                let (mut high, mut low) = ([0.0; PLANE_LANES], [0.0; PLANE_LANES]);
                let [a, b, c] = block;
                for (lane, (high, low)) in high.iter_mut().zip(&mut low).enumerate() {
                    let of = |corner: &[[f64; PLANE_LANES]; 3]| {
                        let [x, y, z] = corner;
                        normal.x * x[lane] + normal.y * y[lane] + normal.z * z[lane] - height
                    };
                    let (p, q, r) = (of(a), of(b), of(c));
                    let (more, less) = if p > q { (p, q) } else { (q, p) };
                    *high = if r > more { r } else { more };
                    *low = if r < less { r } else { less };
                }
                for (lane, (high, low)) in high.iter().zip(&low).enumerate() {
                    *front |= u64::from(*high > slack) << (shift + lane);
                    *behind |= u64::from(*low < -slack) << (shift + lane);
                }
            }
        }
    }
}

/// The least and the greatest of three heights.
fn range(heights: [f64; 3]) -> (f64, f64) {
    let [a, b, c] = heights;
    (a.min(b).min(c), a.max(b).max(c))
}

/// Whether two facets of one plane overlap.
fn overlap(scene: &Scene<'_>, one: usize, other: usize) -> bool {
    let (a, b, normal) = (scene.corners().at(one), scene.corners().at(other), scene.side_normal(one, 0));
    let separates = |axis: Vec3| {
        let tolerance = CONTACT_DISTANCE * sqrt(axis.length_squared());
        let ((al, ah), (bl, bh)) = (range(a.map(|c| c.dot(axis))), range(b.map(|c| c.dot(axis))));
        ah <= bl + tolerance || bh <= al + tolerance
    };
    let sides = |[p, q, r]: [Vec3; 3]| [q - p, r - q, p - r].map(|side| normal.cross(side));
    let axes = [Vec3::X, Vec3::Y, Vec3::Z];
    // boxes first: most facets of a plane are far apart
    let far = axes.iter().any(|axis| {
        let ((al, ah), (bl, bh)) = (range(a.map(|c| c.dot(*axis))), range(b.map(|c| c.dot(*axis))));
        ah + CONTACT_DISTANCE < bl || bh + CONTACT_DISTANCE < al
    });
    !far && !sides(a).into_iter().chain(sides(b)).any(separates)
}

/// Whether a plane is found that has a facet on one side and the convex hull of two triangles on the other.
fn is_separated(a: &[Vec3; 3], b: &[Vec3; 3], (facet, normal): (&[Vec3; 3], Vec3)) -> bool {
    let base = facet.iter().map(|c| c.dot(normal)).sum::<f64>() / 3.0;
    let heights = |t: &[Vec3; 3]| range(t.map(|c| c.dot(normal) - base));
    let ((al, ah), (bl, bh)) = (heights(a), heights(b));
    if al.min(bl) >= -CONTACT_DISTANCE || ah.max(bh) <= CONTACT_DISTANCE {
        return true;
    }
    // the planes through a side of one and a corner of the other
    let side_planes = |one: &[Vec3; 3], other: &[Vec3; 3]| {
        let [p, q, r] = *one;
        [(p, q), (q, r), (r, p)].into_iter().any(|(from, to)| {
            other.iter().any(|corner| {
                let plane = (to - from).cross(*corner - from);
                let length = sqrt(plane.length_squared());
                let tolerance = CONTACT_DISTANCE * length;
                let of = |t: &[Vec3; 3]| range(t.map(|c| (c - from).dot(plane)));
                let ((ol, oh), (tl, th), (fl, fh)) = (of(one), of(other), of(facet));
                let below = oh.max(th) <= tolerance && fl >= -tolerance;
                let above = ol.min(tl) >= -tolerance && fh <= tolerance;
                length > CONTACT_DISTANCE && (below || above)
            })
        })
    };
    side_planes(a, b) || side_planes(b, a)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::simd::Isa;
    use crate::scene::{MaterialInput, SceneInput};

    fn plane_sides(
        vertices: &[[f64; 3]],
        facets: &[[u32; 3]],
        check: impl FnOnce(&Scene<'_>, &PlaneSides<'_>),
    ) {
        let material = MaterialInput { diffuse: &[0.5], specular: &[0.0], emission: &[0.0], gloss: None };
        let input = SceneInput {
            vertices,
            facets,
            facet_materials: &[],
            normals: &[],
            facet_normals: &[],
            materials: &[material],
            two_sided: false,
            bands: 1,
        };
        let (mut memory, mut tree, mut table) = ([0u8; 4096], [0u8; 16384], [0u8; 4096]);
        let scene = Scene::new(&input, &mut memory).unwrap();
        let bvh = Bvh::build(scene.corners(), scene.areas(), Isa::detect(), &mut tree).unwrap();
        check(&scene, &PlaneSides::new(&scene, &bvh, true, &mut table).unwrap());
    }

    /// Two triangles that face each other across a gap of 2, and a third between them or beside.
    fn between(x: f64, check: impl FnOnce(&Scene<'_>, &PlaneSides<'_>)) {
        let vertices = [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, 0.0, 2.0],
            [1.0, 0.0, 2.0],
            [0.0, 1.0, 2.0],
            [x, 0.1, 0.9],
            [x + 0.3, 0.1, 1.0],
            [x, 0.4, 1.1],
        ];
        plane_sides(&vertices, &[[0, 1, 2], [3, 5, 4], [6, 7, 8]], check);
    }

    #[test]
    fn what_stands_between_is_found() {
        let clear = |x: f64, tries: u32| {
            let mut found = None;
            between(x, |scene, plane_sides| {
                let corners = scene.corners()[0];
                let receiver = Receiver { facet: 0, side: 0, normal: Vec3::Z, corners };
                found = Some(plane_sides.is_unoccluded(scene, &receiver, 1, 0, &mut { tries }));
                assert!(plane_sides.before(0, 0).eq([1, 2]));
                assert!((0..3).all(|f| plane_sides.is_alone(f)));
            });
            found.unwrap()
        };
        assert!(!clear(0.2, 10));
        assert!(clear(1.2, 10), "beside the shaft");
        assert!(!clear(1.2, 1), "tries are used up");
    }

    #[test]
    fn facets_of_one_plane_share_it_only_where_they_overlap() {
        let vertices = [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [1.0, 1.0, 0.0],
            [0.1, 0.1, 1e-12],
            [0.3, 0.1, 0.0],
            [0.1, 0.3, 0.0],
            [0.0, 0.0, 1.0],
            [1.0, 0.0, 1.0],
        ];
        plane_sides(&vertices, &[[0, 1, 2], [1, 3, 2], [4, 6, 5], [0, 8, 7]], |_, plane_sides| {
            assert_eq!([0, 1, 2, 3].map(|f| plane_sides.is_alone(f)), [false, true, false, true]);
        });
    }
}
