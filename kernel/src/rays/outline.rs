//! The open sky above a point, by the outlines of the facets before it, without rays.
//!
//! The number of facets in a direction changes only at *outline edges*: edges whose two facets turn different sides to the
//! point, or that have one facet. Lambert's contour sum over them, each times its jump of counted facets, is the exact sum
//! of the form factors of all counted facets, hidden or not (`contour.rs`). Where counted facets cover one another, or
//! others cover the sky, great circles through the pole tell by how much the sum differs from what is blocked
//! (`circles.rs`); where no circle finds any, the sum is the answer.
//!
//! A facet is counted where its front shows; where the back carries a material and its body has a rim, on both sides. All
//! decisions are signs of the same few products, so that the count of facets along any circle is right whatever is rounded.
//!
//! The edges are found once for a mesh (`edges.rs`), those that matter to the points of one facet once for that facet
//! (`candidates.rs`).
//!
//! Constants of this file are measured by `cargo test --test outlines` (outlines against rays) and `cargo bench --bench
//! counts` (instructions).

mod candidates;
mod circles;
mod contour;
mod edges;
mod groups;

pub use candidates::Candidates;
use groups::EdgeGroups;

use crate::base::arena::{Arena, Need, View, Writer, plain_struct};
use crate::base::error::Error;
use crate::base::math::{Vec3, unit};
use crate::base::simd::WIDTH;

/// Rows of a [`Block`]: the lower end (lexicographically) and the upper one, both planes (normal and distance), the sense
/// in which each facet runs through the edge (1: from the lower end; -1; 0 where there is none), by what each facet counts
/// where its back shows, and the body's number.
const EDGE_BLOCK_ROWS: usize = 19;

/// Edges, lane by lane.
type Block = [[f64; WIDTH]; EDGE_BLOCK_ROWS];

/// Set in a facet's group where its body has a rim: both of its sides count, where both carry a material.
const BOTH: u32 = 1 << 31;

/// Most edges of a mesh that outlines are found for: with more, finding those of a facet costs as much as some hundreds
/// of rays.
const MESH_EDGES_MOST: usize = 1 << 16;

/// Most facets of a mesh whose edges are looked for: flat parts have fewer edges than facets.
const MOST_FACETS: usize = 1 << 18;

/// Edges of small meshes beyond two for each facet.
const FEW_EDGES: usize = 64;

/// Whether outlines are found: where memory is small, rays find what is open.
const KEEPS_OUTLINES: bool = cfg!(feature = "std");

/// Height over a point's plane, in scene coordinates, up to which a facet lies in it: some thousand roundings of a
/// height.
const OUTLINE_HEIGHT_SLACK: f64 = 1e-12;

plain_struct! {
    /// Outlines without their arrays.
    pub struct Head {
        /// Edges.
        pub edges: u64,
        /// Facets; 0 where there are no outlines.
        pub facets: u64,
    }
}

/// The edges of a mesh that may be outlines.
#[derive(Clone, Copy, Debug)]
pub struct Outlines<'m> {
    blocks: &'m [Block],
    /// Bounds of [`groups::GROUP`] blocks each.
    block_groups: &'m [EdgeGroups],
    /// The facet whose plane each facet has, and [`BOTH`].
    groups: &'m [u32],
    edges: usize,
}

impl<'m> Outlines<'m> {
    /// Without edges: nothing is known.
    pub const NONE: Outlines<'static> = Outlines { blocks: &[], block_groups: &[], groups: &[], edges: 0 };

    /// Most edges of a mesh of `facets` facets: a closed one has one and a half for each facet.
    fn most(facets: usize) -> usize {
        if !KEEPS_OUTLINES || facets > MOST_FACETS {
            0
        } else {
            (2 * facets + FEW_EDGES).min(MESH_EDGES_MOST)
        }
    }

    /// Adds the memory of a mesh of `facets` facets, at most some 370 bytes for each.
    pub fn need(need: Need, facets: usize) -> Need {
        let most = Outlines::most(facets);
        if most == 0 {
            return need;
        }
        let blocks = most.div_ceil(WIDTH);
        let need = need.and::<u32>(facets);
        let need = edges::Build::need(need, facets, most).and::<Block>(blocks);
        need.and::<EdgeGroups>(groups::count(blocks))
    }

    /// Finds the edges of facets of the given corners and areas (0 where they are degenerate). None are found where a
    /// mesh has more than 65536.
    ///
    /// # Errors
    /// [`Error::BufferTooSmall`] below [`Outlines::need`].
    pub fn new(corners: &[[Vec3; 3]], areas: &[f64], arena: &mut Arena<'m>) -> Result<Outlines<'m>, Error> {
        let facets = corners.len();
        let most = Outlines::most(facets);
        if most == 0 {
            return Ok(Outlines::NONE);
        }
        let groups = arena.take::<u32>(facets)?;
        let found = edges::Build::new(corners, areas, most, arena)?.run(groups);
        let Some(found) = found else { return Ok(Outlines::NONE) };
        let edges = found.count();
        let blocks = arena.take::<Block>(edges.div_ceil(WIDTH))?;
        let block_groups = arena.take::<EdgeGroups>(groups::count(blocks.len()))?;
        found.lay(groups, blocks);
        groups::of_edges(blocks, edges, block_groups);
        Ok(Outlines { blocks, block_groups, groups, edges })
    }

    /// Edges that may be outlines.
    pub fn edges(&self) -> usize {
        self.edges
    }

    /// True for [`Outlines::NONE`].
    pub fn is_empty(&self) -> bool {
        self.groups.is_empty()
    }

    pub(crate) fn put(&self, writer: &mut Writer<'_>) -> Result<(), Error> {
        writer.put(&[Head { edges: self.edges as u64, facets: self.groups.len() as u64 }])?;
        writer.put(self.groups)?;
        writer.put(self.blocks)?;
        writer.put(self.block_groups)
    }

    pub(crate) fn get(view: &mut View<'m>, facets: usize) -> Result<Outlines<'m>, Error> {
        let head = view.take::<Head>(1)?.first().copied().ok_or(Error::Block)?;
        let all = head.facets == facets as u64 && head.edges <= MESH_EDGES_MOST as u64;
        if !all && (head.facets, head.edges) != (0, 0) {
            return Err(Error::Block);
        }
        let (edges, facets) = (head.edges as usize, head.facets as usize);
        let groups = view.take::<u32>(facets)?;
        let blocks = view.take::<Block>(edges.div_ceil(WIDTH))?;
        let block_groups = view.take::<EdgeGroups>(groups::count(blocks.len()))?;
        let known = |group: &u32| ((group & !BOTH) as usize) < facets;
        // coordinates of the scene, senses of facets and numbers of bodies
        let right = |(row, x): (usize, &f64)| x.abs() <= if row == EDGE_BLOCK_ROWS - 1 { 4e9 } else { 4.0 };
        let rows = blocks.iter().flat_map(|block| block.iter().enumerate());
        let mut values = rows.flat_map(|(row, lanes)| lanes.iter().map(move |x| (row, x)));
        if groups.iter().all(known) && values.all(right) {
            Ok(Outlines { blocks, block_groups, groups, edges })
        } else {
            Err(Error::Block)
        }
    }

    /// Bytes in use.
    pub fn memory(&self) -> usize {
        size_of_val(self.block_groups) + size_of_val(self.blocks) + size_of_val(self.groups)
    }
}

/// Normal and distance of a facet's own plane.
fn plane(corners: &[Vec3; 3]) -> (Vec3, f64) {
    let [a, b, c] = *corners;
    let normal = unit((b - a).cross(c - a)).unwrap_or(Vec3::ZERO);
    (normal, product(normal, a))
}

/// a.b, always in the same order, so that equal corners have equal coordinates wherever they are computed.
#[inline(always)]
fn product(a: Vec3, b: Vec3) -> f64 {
    (a.x * b.x + a.y * b.y) + a.z * b.z
}

/// Whether a corner comes before another, by place.
fn precedes(a: Vec3, b: Vec3) -> bool {
    edges::order(a, b) == core::cmp::Ordering::Less
}

/// How the sky depends on direction, as far as outlines tell: what is open of it is a sum of these.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Basis {
    /// The same everywhere.
    Whole,
    /// Apart above and below the horizon of this unit vector, on each side as a linear function of the direction's height.
    Horizon(Vec3),
}

/// Irradiance over pi by what is open of skies over a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OpenSky {
    /// Of the radiance 1, and of the height above the horizon, over the whole sphere; the same on the side of the horizon
    /// where [`OpenSky::above`] tells. But for the first 0 where the basis is [`Basis::Whole`].
    pub values: [f64; 4],
    /// Whether the last two are for the side above the horizon, or for that below.
    pub above: bool,
    /// Expected error of the first.
    pub error: f64,
    /// Whether the point is inside a closed body.
    pub inside: bool,
}

impl OpenSky {
    /// Of the radiances 1 above and below the horizon.
    pub fn halves(&self) -> (f64, f64) {
        self.sides(self.values[0], self.values[2])
    }

    /// Of the heights above the horizon as radiances, above and below it.
    pub fn heights(&self) -> (f64, f64) {
        self.sides(self.values[1], self.values[3])
    }

    fn sides(&self, whole: f64, one: f64) -> (f64, f64) {
        if self.above { (one, whole - one) } else { (whole - one, one) }
    }
}
