//! Paths by way of mirrors and lobes: their state, what they meet, and how far they go.
//!
//! Constants of this file are measured by `cargo bench --bench plane` (errors and seconds).

use crate::plane::Vec2;
use crate::plane::lobe::PlaneLobe;
use crate::plane::scene::PlaneScene;

/// A first hit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// What is met.
    pub primitive: u32,
    /// Where.
    pub point: Vec2,
    /// Unit normal of the front.
    pub normal: Vec2,
    /// Whether the front is met.
    pub front: bool,
}

/// State of a path: its ray, throughput and depth.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PathState {
    pub origin: Vec2,
    pub direction: Vec2,
    /// The primitive that it leaves.
    pub skip: u32,
    /// Product of the reflectances so far, times the ray's weight.
    pub throughput: f64,
    /// The chain ends where less is left.
    pub floor: f64,
    /// Surfaces met.
    pub depth: u32,
    /// Lobes among them.
    pub lobes: u32,
}

/// Receiver of a chain's events: what it meets and where it leaves.
pub(crate) trait Sink {
    /// The front of a primitive is met after `state.depth` mirrors.
    fn meet(&mut self, hit: &Hit, state: &PathState);
    /// The chain leaves the object.
    fn escape(&mut self, state: &PathState);
    /// A black back is met.
    fn back(&mut self) {}
    /// A lobe is met, around the direction `mirrored`; `through` includes its reflectance.
    fn glossy(&mut self, _hit: &Hit, _mirrored: Vec2, _lobe: &PlaneLobe, _leg: &PathState) {}
    /// A chain is cut that could still bring the share `throughput` of the brightest light.
    fn lost(&mut self, _throughput: f64) {}
}

/// How far chains go.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Chains<'a> {
    pub scene: &'a PlaneScene<'a>,
    /// Most surfaces that reflect along a chain.
    pub most: u32,
    /// Nodes of lobe parts that escape: 1 where all escapes bring the same.
    pub sky_nodes: usize,
    /// Directions at which the sky jumps.
    pub cuts: &'a [Vec2],
}

/// No path has more lobes.
pub(crate) const MOST_LOBES: u32 = 64;
