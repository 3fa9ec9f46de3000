//! A cache of occluders: the facets that may stand before a flat facet in one direction. Mostly there are none, and
//! rays that leave it need not be traced.
//!
//! Constants of this file are measured by `cargo bench --bench counts` (instructions).

use super::{Fronts, Solved};
use crate::base::arena::plain_struct;
use crate::base::index::{Index, IndexMut};
use crate::base::math::{Vec3, reflect, sqrt};
use crate::radiosity::sun_image::{Image, Nearby, SUN_DISTANCE_LEAST};
use crate::rays::bvh::HalfSpace;
use crate::rays::outline::Candidates;
use crate::rays::surface::Surface;
use crate::rays::swept::{SWEPT_MARGIN, swept};
use crate::scene::NO_MIRROR;

/// Directions in which rays leave a facet's side.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum RayKind {
    /// The mirror direction of parallel rays.
    Mirror,
    /// The sun.
    Sun,
    /// An image of the sun.
    Image(u32),
}

impl RayKind {
    /// A number other than 0.
    fn number(self) -> u32 {
        match self {
            RayKind::Mirror => 1,
            RayKind::Sun => 2,
            RayKind::Image(n) => 3 + n,
        }
    }
}

/// Most facets of one list.
const OCCLUDERS_MOST: usize = 13;

/// Number of lists that are kept, a power of 2.
const LISTS_KEPT: usize = 512;

/// In place of a list's count: there are too many, and rays are traced.
const OCCLUDERS_TOO_MANY: u32 = u32::MAX;

plain_struct! {
    /// Facets that may stand before one side of a facet in one direction.
    pub struct Occluders {
        /// Twice the facet and the side.
        pub side: u32,
        /// [`RayKind::number`]; 0: an empty place.
        pub kind: u32,
        /// Facets that may be in the way, or [`OCCLUDERS_TOO_MANY`]; toward an image of the sun: mirrors in the way
        /// that may show it.
        pub count: u32,
        /// Which.
        pub facets: [u32; OCCLUDERS_MOST],
    }
}

/// Number of images of the sun that are kept.
const SUN_IMAGES_KEPT: usize = if cfg!(feature = "std") { 128 } else { 0 };

/// Radius of the ball for whose points images of the sun are kept, over the root of the facet's area.
const SUN_IMAGES_REACH: f64 = 0.06;

/// Images of the sun that may be seen from a ball about a point, of a side of a facet.
struct Images {
    /// Facet and side; none at first.
    side: Option<(usize, usize)>,
    centre: Vec3,
    reach: f64,
    /// How many there are; more than [`SUN_IMAGES_KEPT`]: they are not remembered.
    count: usize,
    all: [Image; SUN_IMAGES_KEPT],
}

/// Images of the sun that may be seen from a point, one after the other: those that are remembered, or any.
pub(super) enum Walk<'a> {
    /// The next of those that are remembered.
    Remembered(usize),
    /// All that the side has.
    All(Nearby<'a>),
}

impl Walk<'_> {
    /// The next image.
    #[inline]
    pub(super) fn next(&mut self, occluders: &OccluderCache<'_>) -> Option<Image> {
        match self {
            Walk::Remembered(at) => {
                *at += 1;
                let images = occluders.images.as_ref()?;
                images.all.head(images.count).get(*at - 1).copied()
            }
            Walk::All(nearby) => nearby.next(),
        }
    }
}

/// Ways asked for lately; the same answers whether they are remembered or not.
pub struct OccluderCache<'m> {
    lists: &'m mut [Occluders],
    /// None for a single ray: they are too large to be set up for it.
    images: Option<Images>,
    /// Candidates for outlines from points of facets.
    pub(super) candidates: Candidates<'m>,
    /// What faces points.
    pub(super) fronts: Fronts<'m>,
    /// Whether first rays are parallel.
    parallel: bool,
    /// Least projected area of a facet whose occluders along the mirror direction are collected: the few rays of
    /// smaller ones cost less.
    least_mirror: f64,
    /// Least area of a facet whose occluders toward the sun are collected.
    least_sun: f64,
}

/// Cost of collecting a facet's occluders, in rays. Measured by `cargo bench --bench stages`.
const COLLECT_COST: f64 = 8.0;

impl<'m> OccluderCache<'m> {
    /// Values of type [`Occluders`] that a cache holds.
    pub const ROOM: usize = LISTS_KEPT;

    /// A cache for rays that are parallel to begin with, or not. `lists` holds [`OccluderCache::ROOM`] values, all
    /// zero, or none; parallel rays have the area `area` each, and `sun` rays follow each of them toward the sun.
    pub fn new(lists: &'m mut [Occluders], parallel: bool, area: f64, sun: f64) -> OccluderCache<'m> {
        let least = if parallel { COLLECT_COST * area } else { 0.0 };
        let all = [Image::default(); SUN_IMAGES_KEPT];
        let images = Images { side: None, centre: Vec3::ZERO, reach: 0.0, count: 0, all };
        let images = (SUN_IMAGES_KEPT > 0).then_some(images);
        OccluderCache {
            lists,
            images,
            parallel,
            least_mirror: least,
            least_sun: least / sun,
            ..OccluderCache::none()
        }
    }

    /// A cache that holds nothing: every ray is traced.
    pub fn none() -> OccluderCache<'m> {
        let (candidates, fronts) = (Candidates::none(), Fronts::none());
        OccluderCache {
            lists: &mut [],
            images: None,
            candidates,
            fronts,
            parallel: false,
            least_mirror: 0.0,
            least_sun: 0.0,
        }
    }

    /// The cache with room for outlines and for what faces points.
    pub fn with(self, candidates: Candidates<'m>, fronts: Fronts<'m>) -> OccluderCache<'m> {
        OccluderCache { candidates, fronts, ..self }
    }

    /// Whether first rays are parallel and ways are known.
    pub(super) fn is_parallel(&self) -> bool {
        self.parallel && !self.lists.is_empty()
    }

    /// The images of the sun that may be seen from a point of a surface.
    pub(super) fn images<'a>(&mut self, solved: &Solved<'a>, surface: &Surface, spread: f64) -> Walk<'a> {
        let sides = solved.elements.facet_sides();
        let side = solved.elements.kept_side(surface.facet, surface.side);
        let near = |reach: f64| solved.images.near(sides, side, surface.point, reach, spread);
        let Some(images) = &mut self.images else { return Walk::All(near(0.0)) };
        let apart = surface.point - images.centre;
        let here = Some((surface.facet, surface.side));
        if images.side != here || apart.dot(apart) > images.reach * images.reach {
            let reach = SUN_IMAGES_REACH * sqrt(solved.scene.areas().at(surface.facet));
            (images.side, images.centre, images.reach, images.count) = (here, surface.point, reach, 0);
            for image in near(reach) {
                if images.count < SUN_IMAGES_KEPT {
                    images.all.set(images.count, image);
                }
                images.count += 1;
            }
        }
        if images.count <= SUN_IMAGES_KEPT { Walk::Remembered(0) } else { Walk::All(near(0.0)) }
    }

    /// The facets that may stand in the way of rays that leave the flat `surface`'s side along `direction`, or along any
    /// that is within an angle of sine `spread` of it (toward an image of the sun: mirrors among them that may show it);
    /// `None` where that is not known, or they are many.
    #[cfg_attr(target_pointer_width = "32", inline(never))]
    #[cfg_attr(not(target_pointer_width = "32"), inline)]
    pub(super) fn before(
        &mut self,
        solved: &Solved<'_>,
        surface: &Surface,
        kind: RayKind,
        (direction, spread): (Vec3, f64),
    ) -> Option<&[u32]> {
        let area = solved.scene.areas().at(surface.facet);
        let small = match kind {
            RayKind::Mirror => area * surface.normal.dot(direction) < self.least_mirror,
            _ => area < self.least_sun,
        };
        if small {
            return None;
        }
        let (side, kind) = (2 * surface.facet as u32 + surface.side as u32, kind.number());
        let place = side.wrapping_mul(7).wrapping_add(kind.wrapping_mul(0x9e37_79b1)) as usize;
        let list = self.lists.get_mut(place & (LISTS_KEPT - 1))?;
        if (list.side, list.kind) != (side, kind) {
            *list = Occluders { side, kind, ..Occluders::default() };
            list.collect(solved, surface, direction, spread);
        }
        if list.count == OCCLUDERS_TOO_MANY { None } else { Some(list.facets.head(list.count as usize)) }
    }
}

impl Occluders {
    /// Finds what reaches into the region that the facet sweeps along the directions, from where rays start above it.
    #[inline(never)]
    fn collect(&mut self, solved: &Solved<'_>, surface: &Surface, direction: Vec3, spread: f64) {
        self.count = OCCLUDERS_TOO_MANY;
        let corners = solved.scene.corners().at(surface.facet);
        let normal = surface.normal;
        let Some(halves) = swept(&corners, normal, direction, spread) else { return };
        self.collect_within(solved, surface, direction, &halves);
    }

    /// Notes what reaches into a region.
    // apart on small machines: does not burden the stack of finding the region
    #[cfg_attr(target_pointer_width = "32", inline(never))]
    fn collect_within(
        &mut self,
        solved: &Solved<'_>,
        surface: &Surface,
        direction: Vec3,
        halves: &[HalfSpace; 4],
    ) {
        let (mut count, own) = (0, surface.facet as u32);
        // of what is in the way to an image of the sun, the mirrors that may show it count
        let image = self.kind >= RayKind::Image(0).number();
        let facets = &mut self.facets;
        solved.bvh.within(halves, |facet| {
            if facet == own || image && !solved.shows_sun(facet as usize, direction) {
                return true;
            }
            facets.set(count, facet);
            count += 1;
            count <= OCCLUDERS_MOST
        });
        self.count = if count <= OCCLUDERS_MOST { count as u32 } else { OCCLUDERS_TOO_MANY };
    }
}

impl Solved<'_> {
    /// Whether a facet may show the sun, or an image of it, to who looks along `axis`.
    fn shows_sun(&self, facet: usize, axis: Vec3) -> bool {
        let material = self.scene.material(facet);
        let Some(sun) = &self.light.sun else { return false };
        if self.scene.mirror(material) == NO_MIRROR || self.scene.gloss(material).is_some() {
            return false;
        }
        let side = usize::from(self.scene.side_normal(facet, 0).dot(axis) > 0.0);
        if side >= self.scene.sides() {
            return false;
        }
        let Some(normal) = self.scene.flat_normal(facet, side) else { return false };
        let mirrored = reflect(axis, normal);
        let place = self.elements.kept_side(facet, side);
        1.0 - mirrored.dot(sun.direction()) < SUN_DISTANCE_LEAST
            || self.images.may_show(self.elements.facet_sides(), place, mirrored)
    }
}

/// Whether any line from `point` within an angle of sine `spread` of the unit vector `axis` may meet a facet.
#[cfg_attr(target_pointer_width = "32", inline(never))]
pub(super) fn may_meet(corners: &[Vec3; 3], point: Vec3, axis: Vec3, spread: f64) -> bool {
    let [a, b, c] = *corners;
    let farthest = [a, b, c].iter().map(|&corner| (corner - point).length_squared()).fold(0.0, f64::max);
    // twice the spread: more than its tangent
    let off = SWEPT_MARGIN + 2.0 * spread * sqrt(farthest);
    [(a, b, c), (b, c, a), (c, a, b)].iter().all(|&(from, to, other)| {
        let across = (to - from).cross(axis);
        let across = if across.dot(other - from) < 0.0 { -across } else { across };
        across.dot(point - from) >= -off * sqrt(across.dot(across))
    })
}
