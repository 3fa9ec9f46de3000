//! Which rows of a coupling still hold where parts of its scene have moved against each other.
//!
//! A row holds where none of its rays can meet a part that has moved against its own, before or after: where the boxes of
//! such parts stay behind the plane of its facet, or where none of its rays enters one. Boxes are those of parts in the mesh,
//! so that flat parts keep flat boxes whichever way they are turned; rays are carried into each part's own coordinates.
//!
//! Constants of this file are measured by `cargo test --test poses` (rows that are kept and their bits).

use super::RowView;
use super::rows::RowRays;
use crate::base::arena::{Arena, Need};
use crate::base::error::Error;
use crate::base::index::{Index, IndexMut};
use crate::base::math::Vec3;
use crate::coupling::element::Elements;
use crate::scene::pose::{Parts, Pose};
use crate::scene::{NO_MIRROR, Scene};

/// Distance by which boxes are larger than their parts, in scene coordinates: above the rounding of poses of a mesh that stands
/// a million times its size from the origin.
const BOX_SLACK: f64 = 1e-9;

/// The box of a part in the scene before: its lowest and its highest coordinates.
type Bounds = [Vec3; 2];

/// Parts that moved.
#[derive(Clone, Copy, Debug)]
pub struct Motion<'a> {
    old: &'a Scene<'a>,
    parts: Parts<'a>,
    /// Of each part; the lowest above the highest where it has no facet.
    boxes: &'a [Bounds],
    /// Of each part the first of the same pose: they move together.
    groups: &'a [u32],
    /// Of each part 1 where a mirror that moves with it may see a part that does not.
    mirrored: &'a [u8],
}

/// What carries points of one part, in coordinates of the scene before, into those of another.
struct Carry<'a> {
    from: &'a Pose,
    to: &'a Pose,
    shift: Vec3,
}

impl Carry<'_> {
    fn turn(&self, v: Vec3) -> Vec3 {
        self.to.turn_back(self.from.turn(v))
    }

    fn point(&self, p: Vec3) -> Vec3 {
        self.turn(p) + self.shift
    }
}

impl<'a> Motion<'a> {
    /// Bytes for a number of parts.
    pub fn need(parts: usize) -> Need {
        Need::new().and::<Bounds>(parts).and::<u32>(parts).and::<u8>(parts)
    }

    /// Parts of a scene that stand where it has them, and in a new one at their poses.
    ///
    /// # Errors
    /// Those of [`Parts::check`]; [`Error::Mismatch`] where facets of the new scene stand elsewhere.
    pub fn new(
        old: &'a Scene<'a>,
        new: &Scene<'_>,
        parts: Parts<'a>,
        arena: &mut Arena<'a>,
    ) -> Result<Motion<'a>, Error> {
        parts.check(old.facets())?;
        if old.facets() != new.facets() || !(0..old.facets()).all(|facet| stands(old, new, &parts, facet)) {
            return Err(Error::Mismatch { what: "mesh" });
        }
        let count = parts.poses.len();
        let boxes = arena.take::<Bounds>(count)?;
        let groups = arena.take::<u32>(count)?;
        let mirrored = arena.take::<u8>(count)?;
        boxes.fill([Vec3::INFINITY, Vec3::NEG_INFINITY]);
        for facet in (0..old.facets()).filter(|facet| old.areas().at(*facet) > 0.0) {
            let Some([low, high]) = boxes.get_mut(parts.of(facet)) else { continue };
            for corner in old.corners().at(facet) {
                *low = low.min(corner - Vec3::splat(BOX_SLACK));
                *high = high.max(corner + Vec3::splat(BOX_SLACK));
            }
        }
        for (part, group) in groups.iter_mut().enumerate() {
            let pose = parts.poses.get(part);
            *group = parts.poses.iter().position(|other| Some(other) == pose).unwrap_or(part) as u32;
        }
        let mut motion = Motion { old, parts, boxes, groups, mirrored: &[] };
        for facet in (0..old.facets()).filter(|facet| old.mirror(old.material(*facet)) != NO_MIRROR) {
            let sees = |side: usize| motion.others(facet).any(|part| motion.rises(facet, side, part));
            if mirrored.at(motion.group(facet)) == 0 && (0..old.sides()).any(sees) {
                mirrored.set(motion.group(facet), 1);
            }
        }
        motion.mirrored = mirrored;
        Ok(motion)
    }

    /// How directions turn that belong to a facet's part.
    pub(super) fn pose(&self, facet: usize) -> &Pose {
        self.parts.pose(facet)
    }

    fn group(&self, facet: usize) -> usize {
        self.groups.at(self.parts.of(facet)) as usize
    }

    /// Parts that moved against a facet's.
    fn others(&self, facet: usize) -> impl Iterator<Item = usize> + use<'a> {
        let (own, groups, boxes) = (self.group(facet), self.groups, self.boxes);
        let filled = move |part: &usize| boxes.at(*part)[0].x <= boxes.at(*part)[1].x;
        (0..groups.len()).filter(move |part| groups.at(*part) as usize != own).filter(filled)
    }

    /// Into the coordinates in which a part's box stands now.
    fn carry(&self, facet: usize, part: usize) -> Carry<'_> {
        let (from, to) = (self.pose(facet), self.parts.poses.get(part).unwrap_or(&Pose::REST));
        // scene coordinates are s = k (x - c): s' = R'^-1 R s + k (R'^-1 (R c + t - t') - c)
        let middle = self.old.to_caller(Vec3::ZERO);
        let moved = from.point(middle) - Vec3::from_array(to.translation);
        let shift = (to.turn_back(moved) - middle) * self.old.scale();
        Carry { from, to, shift }
    }

    /// Whether a part's box rises above the plane of a facet's side, before or after.
    fn rises(&self, facet: usize, side: usize, part: usize) -> bool {
        let (normal, corner) = (self.old.side_normal(facet, side), self.old.corners().at(facet)[0]);
        let carry = self.carry(facet, part);
        let [low, high] = self.boxes.at(part);
        let above = |normal: Vec3, point: Vec3| {
            let highest = Vec3::select(normal.cmpgt(Vec3::ZERO), high, low);
            (highest - point).dot(normal) > 0.0
        };
        above(normal, corner) || above(carry.turn(normal), carry.point(corner))
    }

    /// Whether the row of an unknown, of the scene before, still holds. `directional`: rows have no entries in closed form.
    pub(super) fn keeps(
        &self,
        elements: &Elements<'_>,
        unknown: usize,
        row: &RowView<'_>,
        directional: bool,
    ) -> bool {
        let (facet, side) = elements.facet_of(unknown);
        let facets = elements.facets_of(unknown);
        let own = self.group(facet);
        if facets.iter().any(|facet| self.group(*facet as usize) != own) {
            return false;
        }
        let moved = |unknown: usize| self.group(elements.facet_of(unknown).0) != own;
        if row.targets.iter().any(|record| moved(record.unknown())) {
            return false;
        }
        if row.row.chain_rays > 0 && self.mirrored.at(own) != 0 {
            return false;
        }
        let rises = |part: &usize| facets.iter().any(|facet| self.rises(*facet as usize, side, *part));
        let mut rising = self.others(facet).filter(rises);
        // entries in closed form have no rays, and open rows had none
        if !directional || row.row.rays == 0 {
            return rising.next().is_none();
        }
        while let Some(first) = rising.next() {
            let (mut some, mut count) = ([first; PARTS_TOGETHER], 1);
            for (to, part) in some.iter_mut().skip(1).zip(&mut rising) {
                (*to, count) = (part, count + 1);
            }
            if !self.misses(elements, unknown, (some, count), row.row.rays) {
                return false;
            }
        }
        true
    }

    /// Whether no ray of a row enters the boxes of the first `count` of some parts, before or after.
    fn misses(
        &self,
        elements: &Elements<'_>,
        unknown: usize,
        (parts, count): ([usize; PARTS_TOGETHER], usize),
        rays: u32,
    ) -> bool {
        let facet = elements.facet_of(unknown).0;
        let all = parts.map(|part| (self.carry(facet, part), self.boxes.at(part)));
        let own = RowRays::new(self.old, elements, unknown);
        (0..rays).all(|number| {
            let ray = own.ray(self.old, elements, number).0;
            all.iter().take(count).all(|(carry, bounds)| {
                !enters(bounds, ray.origin, ray.direction)
                    && !enters(bounds, carry.point(ray.origin), carry.turn(ray.direction))
            })
        })
    }
}

/// Parts whose boxes a row's rays are held against together: making a ray costs as much as some of them.
const PARTS_TOGETHER: usize = 4;

/// Distance from its pose at which a facet's corner still stands there, over the size of the larger scene: above what rotations
/// known to 1e-6 and meshes far from the origin make of it.
const POSE_SLACK: f64 = 1e-5;

/// Whether a facet of a new scene stands where its part's pose has it.
fn stands(old: &Scene<'_>, new: &Scene<'_>, parts: &Parts<'_>, facet: usize) -> bool {
    let pose = parts.pose(facet);
    let slack = POSE_SLACK / old.scale().min(new.scale());
    let corners = old.corners().at(facet).into_iter().zip(new.corners().at(facet));
    corners.fold(true, |stands, (was, is)| {
        let off = new.to_caller(is) - pose.point(old.to_caller(was));
        stands && off.abs().max_element() <= slack
    })
}

/// Whether a ray enters a box; true where rounding leaves it open.
fn enters([low, high]: &Bounds, origin: Vec3, direction: Vec3) -> bool {
    let (mut first, mut last) = (0.0, f64::INFINITY);
    let axes = low.to_array().into_iter().zip(high.to_array());
    for ((low, high), (o, d)) in axes.zip(origin.to_array().into_iter().zip(direction.to_array())) {
        let (a, b) = ((low - o) / d, (high - o) / d);
        // a ray within a face gives no number, which min and max pass over
        first = f64::max(first, a.min(b));
        last = f64::min(last, a.max(b));
    }
    first <= last
}
