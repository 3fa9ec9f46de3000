//! The bounding volume hierarchy: nodes of eight boxes, packets of eight facets, in caller memory.
//!
//! Two builders, [`Bvh::build`] and (with feature `std`) [`Bvh::build_obvhs`], make one layout, and one traversal
//! reads it. Hits are those of [`ray::intersect`] over all facets, bit for bit: the least `t`, where facets coincide a
//! front before a back, then the lowest facet index, whatever the builder and the instruction set.
//!
//! Constants of this file are measured by `cargo test --test bvh` (hits) and `cargo bench --bench counts` (instructions).

mod above;
mod bake;
mod build;
mod collapse;
mod external;
#[cfg(feature = "std")]
mod obvhs;
mod path_stack;
mod stream;
mod traverse;
mod within;

use crate::base::arena::{Arena, Need};
use crate::base::error::Error;
use crate::base::index::{Index, IndexMut};
use crate::base::math::{Vec3, fabs};
use crate::base::simd::Isa;
use crate::rays::outline::Outlines;
use crate::rays::ray::{self, Hit, Ray};

use build::{Binary, Facets};
use external::External;

pub use external::{AnswerBuffer, INTERSECTOR_RAYS_MOST, Intersector, NO_FACET};
pub(crate) use stream::STREAM_RAYS;
pub(crate) use within::HalfSpace;

/// Eight child boxes of a node: axis, then 0 the low and 1 the high side, then child. No child: low is infinity
/// and high is minus infinity.
type Boxes = [[[f32; 8]; 2]; 3];

/// Eight facets in f32: corner, then axis, then facet.
type Packet = [[[f32; 8]; 3]; 3];

/// How far the edge functions of each facet of a packet can be off in f32, in units of the error of an image.
type Slack = [f32; 8];

/// One facet: its corners and normal.
type Solid = [[f64; 3]; 4];

/// A child with this bit is a leaf: the packet's index, and [`PAIR`] where the leaf goes on in the next packet.
const LEAF_CHILD: u32 = 1 << 31;
/// Bit of a leaf that goes on in the next packet.
const PAIR: u32 = 1 << 30;

/// No facet: fills the lanes of packets that hold none.
const NO_LANE_FACET: u32 = u32::MAX;

/// Facets a leaf holds at most, and the width of a packet.
const PACKET_LANES: usize = 8;

/// Levels of the deepest tree.
const MOST_LEVELS: usize = 32;

/// Entries of a stack that the deepest tree needs: seven for each level, and one.
const STACK: usize = MOST_LEVELS * 7 + 1;

/// Facet count is kept below this, so that lane and node numbers fit beside the bits of a child.
const BVH_FACETS_MOST: usize = 1 << 28;

/// Coordinates up to this keep every product of the traversal finite in f32.
const COORDINATE_LARGEST: f64 = (1u64 << 40) as f64;

/// A largest coordinate from here on keeps them clear of f32's subnormal numbers.
const COORDINATE_SMALLEST: f64 = 1.0 / COORDINATE_LARGEST;

/// A mesh made ready for rays. Holds nothing but slices of the caller's memory.
///
/// Queries take `&self` and may run at the same time on any number of threads.
#[derive(Clone, Copy, Debug)]
pub struct Bvh<'m> {
    boxes: &'m [Boxes],
    children: &'m [[u32; 8]],
    packets: &'m [Packet],
    slacks: &'m [Slack],
    facets: &'m [[u32; PACKET_LANES]],
    /// By facet.
    solids: &'m [Solid],
    /// Levels of nodes: bounds the stack of a traversal.
    levels: usize,
    low: Vec3,
    high: Vec3,
    /// Largest magnitude of a coordinate.
    scale: f64,
    isa: Isa,
    external: Option<External<'m>>,
    outlines: Outlines<'m>,
}

/// How many of each thing `facets` facets can need.
struct Size {
    nodes: usize,
    packets: usize,
    /// Bytes that first hold the binary tree and then the facets.
    shared: usize,
}

impl Size {
    fn of(facets: usize) -> Result<Size, Error> {
        if facets >= BVH_FACETS_MOST {
            return Err(Error::TooMany { what: "facets", limit: BVH_FACETS_MOST - 1 });
        }
        // A node of fewer than eight children has leaves alone and at least nine facets (smaller subtrees become
        // one leaf). Let w of N nodes be such. Nodes other than the root, and leaves outside the w, are children of
        // the N - w full nodes: 8 (N - w) = N - 1 + l with 9 w + l <= n, hence N < n/7; but the root may be alone.
        let nodes = facets / 7 + 2;
        // Leaves start on a packet's boundary as long as that leaves at most as many lanes empty as are filled.
        let packets = (2 * facets).div_ceil(PACKET_LANES);
        let tree = Binary::need(facets).bytes()?;
        let shared = tree.max(Need::new().and::<Solid>(facets).bytes()?);
        Ok(Size { nodes, packets, shared })
    }

    fn bytes(&self, facets: usize) -> Result<usize, Error> {
        let need = Need::new()
            .and::<Boxes>(self.nodes)
            .and::<[u32; 8]>(self.nodes)
            .and::<[u32; PACKET_LANES]>(self.packets)
            .and::<Packet>(self.packets)
            .and::<Slack>(self.packets)
            .and::<u8>(self.shared);
        Outlines::need(need, facets).bytes()
    }
}

impl<'m> Bvh<'m> {
    /// Bytes of memory that a tree over `facets` facets needs at most, building included: some 220 a facet, and
    /// 370 for outlines.
    ///
    /// # Errors
    /// [`Error::TooMany`] for 2^28 facets and more.
    pub fn bytes(facets: usize) -> Result<usize, Error> {
        Size::of(facets)?.bytes(facets)
    }

    /// Builds the tree with the kernel's own builder: no heap, binned surface area heuristic.
    ///
    /// `corners[i]` are facet i's, recentred and scaled to about [-1, 1]; `areas[i]` is 0 for a degenerate facet,
    /// which no ray meets. `memory` holds at least [`Bvh::bytes`] bytes, of any content and alignment.
    ///
    /// # Errors
    /// [`Error::BufferTooSmall`]; [`Error::TooMany`]; [`Error::Length`] where there is not one area per facet;
    /// [`Error::Extent`] where a coordinate is not finite or the largest magnitude outside 2^-40..=2^40.
    pub fn build(
        corners: &[[Vec3; 3]],
        areas: &[f64],
        isa: Isa,
        memory: &'m mut [u8],
    ) -> Result<Bvh<'m>, Error> {
        Bvh::build_with(corners, areas, isa, memory, build::binned)
    }

    /// Builds the tree with the builder of the crate obvhs (PLOC with reinsertion), which takes heap of its own while
    /// it builds. Arguments and errors as for [`Bvh::build`].
    #[cfg(feature = "std")]
    pub fn build_obvhs(
        corners: &[[Vec3; 3]],
        areas: &[f64],
        isa: Isa,
        memory: &'m mut [u8],
    ) -> Result<Bvh<'m>, Error> {
        Bvh::build_with(corners, areas, isa, memory, obvhs::ploc)
    }

    fn build_with(
        corners: &[[Vec3; 3]],
        areas: &[f64],
        isa: Isa,
        memory: &'m mut [u8],
        builder: fn(&Facets, &mut Binary),
    ) -> Result<Bvh<'m>, Error> {
        if areas.len() != corners.len() {
            return Err(Error::Length { what: "areas", expected: corners.len(), given: areas.len() });
        }
        let size = Size::of(corners.len())?;
        let mut arena = Arena::new(memory, size.bytes(corners.len())?)?;
        let (low, high) = extent(corners, areas)?;
        let scale = low.abs().max(high.abs()).max_element();
        let boxes = arena.take::<Boxes>(size.nodes)?;
        let children = arena.take::<[u32; 8]>(size.nodes)?;
        let facets = arena.take::<[u32; PACKET_LANES]>(size.packets)?;
        let packets = arena.take::<Packet>(size.packets)?;
        let slacks = arena.take::<Slack>(size.packets)?;
        let shared = arena.take::<u8>(size.shared)?;
        let made = {
            let mut scratch = Arena::new(&mut *shared, size.shared)?;
            let (prepared, mut tree) = Binary::prepare(corners, areas, &mut scratch)?;
            builder(&prepared, &mut tree);
            collapse::collapse(&tree, boxes, children, facets)
        };
        let (facets, packets) = (facets.head(made.packets), packets.head_mut(made.packets));
        let slacks = slacks.head_mut(made.packets);
        for ((packet, slack), lanes) in packets.iter_mut().zip(&mut *slacks).zip(facets) {
            (*packet, *slack) = packed(lanes, corners);
        }
        let solids = Arena::new(shared, 0)?.take::<Solid>(corners.len())?;
        for (place, facet) in solids.iter_mut().zip(corners) {
            *place = solid(facet);
        }
        let (boxes, children) = (boxes.head(made.nodes), children.head(made.nodes));
        Ok(Bvh {
            boxes,
            children,
            packets,
            slacks,
            facets,
            solids,
            levels: made.levels,
            low,
            high,
            scale,
            isa,
            external: None,
            outlines: Outlines::new(corners, areas, &mut arena)?,
        })
    }

    /// The tree with a tracer of the caller's in place of the walk through it; `corners` are the mesh's. Where an
    /// answer names a facet that the ray does not meet, the tree is asked.
    pub fn with_intersector(self, tracer: Option<&'m dyn Intersector>, corners: &'m [[Vec3; 3]]) -> Bvh<'m> {
        Bvh { external: tracer.map(|tracer| External { tracer, corners }), ..self }
    }

    /// The mesh's outlines, if any.
    #[inline]
    pub fn outlines(&self) -> &Outlines<'m> {
        &self.outlines
    }

    /// The first facet that the ray meets: least t with `0 < t < t_max`, where facets coincide a front before a back, then
    /// the lowest index.
    pub fn closest(&self, ray: &Ray) -> Option<Hit> {
        match &self.external {
            Some(external) => external.closest(self, ray),
            None => traverse::closest(self, ray),
        }
    }

    /// As [`closest`](Bvh::closest), and calls `visit` with every hit of this tree, in any order: 64 at most.
    pub(crate) fn crossings(&self, ray: &Ray, visit: impl FnMut(&Hit)) -> Option<Hit> {
        let first = traverse::crossings(self, ray, visit);
        match &self.external {
            Some(external) => external.closest(self, ray),
            None => first,
        }
    }

    /// Whether the ray meets any facet with `0 < t < t_max`: the same as `closest(ray).is_some()`, sooner.
    pub fn occluded(&self, ray: &Ray) -> bool {
        match &self.external {
            Some(external) => external.any(self, ray),
            None => traverse::occluded(self, ray),
        }
    }

    /// [`closest`](Bvh::closest) of each ray: the same hits, sooner where rays that follow each other start near each
    /// other. Of slices of different lengths, what the shorter one has.
    pub fn closest_many(&self, rays: &[Ray], hits: &mut [Option<Hit>]) {
        match &self.external {
            Some(external) => external.closest_many(self, rays, hits),
            None => stream::closest(self, rays, hits),
        }
    }

    /// [`occluded`](Bvh::occluded) of each ray; as [`Bvh::closest_many`].
    pub fn occluded_many(&self, rays: &[Ray], occluded: &mut [bool]) {
        match &self.external {
            Some(external) => external.any_many(self, rays, occluded),
            None => stream::occluded(self, rays, occluded),
        }
    }

    /// Whether any corner of a facet that rays can meet lies above the plane of points p with p.normal = height.
    /// Error: 3 roundings of a coordinate.
    pub fn rises_above(&self, normal: Vec3, height: f64) -> bool {
        above::rises_above(self, normal, height)
    }

    /// The instruction set that it uses.
    pub fn isa(&self) -> Isa {
        self.isa
    }

    /// The lowest and the highest coordinates of the facets that rays can meet; zeros where there is none.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        (self.low, self.high)
    }

    /// One packet with its slacks and facets.
    #[inline(always)]
    fn lanes(&self, packet: usize) -> Option<(&Packet, &Slack, &[u32; PACKET_LANES])> {
        Some((self.packets.get(packet)?, self.slacks.get(packet)?, self.facets.get(packet)?))
    }

    /// Bytes in use once built, at most [`Bvh::bytes`].
    pub fn memory(&self) -> usize {
        size_of_val(self.boxes)
            + size_of_val(self.children)
            + size_of_val(self.facets)
            + size_of_val(self.packets)
            + size_of_val(self.slacks)
            + size_of_val(self.solids)
            + self.outlines.memory()
    }
}

/// The box of all facets of nonzero area.
fn extent(corners: &[[Vec3; 3]], areas: &[f64]) -> Result<(Vec3, Vec3), Error> {
    let mut bounds = None;
    for &corner in corners.iter().zip(areas).filter(|(_, area)| **area != 0.0).flat_map(|(facet, _)| facet) {
        if corner.is_nan() || corner.to_array().iter().any(|&x| fabs(x) > COORDINATE_LARGEST) {
            return Err(Error::Extent);
        }
        let (low, high) = bounds.unwrap_or((corner, corner));
        bounds = Some((corner.min(low), corner.max(high)));
    }
    let Some((low, high)) = bounds else { return Ok((Vec3::ZERO, Vec3::ZERO)) };
    if low.abs().max(high.abs()).max_element() < COORDINATE_SMALLEST {
        Err(Error::Extent)
    } else {
        Ok((low, high))
    }
}

/// The facets of one packet in f32, and their slacks. Lanes without a facet are NaN, which is inside of nothing.
fn packed(lanes: &[u32; PACKET_LANES], corners: &[[Vec3; 3]]) -> (Packet, Slack) {
    let mut packet = [[[f32::NAN; PACKET_LANES]; 3]; 3];
    let mut slack = [f32::NAN; PACKET_LANES];
    for (lane, &facet) in lanes.iter().enumerate() {
        let Some(facet) = corners.get(facet as usize) else { continue };
        let [a, b, c] = *facet;
        for (rows, vector) in packet.iter_mut().zip(facet) {
            for (row, x) in rows.iter_mut().zip(vector.to_array()) {
                row.set(lane, x as f32);
            }
        }
        let extent = (a.max(b).max(c) - a.min(b).min(c)).max_element();
        slack.set(lane, (extent * traverse::LANE_EDGE_SLACK) as f32);
    }
    (packet, slack)
}

/// A facet with its normal.
fn solid(facet: &[Vec3; 3]) -> Solid {
    let [a, b, c] = *facet;
    [a, b, c, ray::normal(facet)].map(|vector| vector.to_array())
}
