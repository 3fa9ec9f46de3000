//! A median-split tree over triangles, closest hits by Moeller and Trumbore in f64.

use super::Ray;
use glam::DVec3;

const LEAF: usize = 4;

/// Two ranges of facets or one, with the box around them.
struct Node {
    low: DVec3,
    high: DVec3,
    /// Leaf: its facets in `order`. Inner node: its second child; the first is the next node.
    content: Content,
}

enum Content {
    Leaf(std::ops::Range<usize>),
    Second(usize),
}

/// The tree.
pub struct Bvh {
    nodes: Vec<Node>,
    order: Vec<u32>,
    corners: Vec<[DVec3; 3]>,
}

impl Bvh {
    /// Builds the tree over triangles given by their corners.
    pub fn new(corners: Vec<[DVec3; 3]>) -> Bvh {
        let order = (0..corners.len() as u32).collect();
        let mut bvh = Bvh { nodes: Vec::new(), order, corners };
        bvh.split(0..bvh.corners.len());
        bvh
    }

    fn split(&mut self, range: std::ops::Range<usize>) {
        let points = || self.order[range.clone()].iter().flat_map(|&f| self.corners[f as usize]);
        let low = points().fold(DVec3::INFINITY, DVec3::min);
        let high = points().fold(DVec3::NEG_INFINITY, DVec3::max);
        // a box must hold its facets' points in spite of the slab test's roundings
        let margin = DVec3::splat(1e-12 * low.abs().max(high.abs()).max_element());
        let (index, middle) = (self.nodes.len(), range.start + range.len() / 2);
        let content = Content::Leaf(range.clone());
        self.nodes.push(Node { low: low - margin, high: high + margin, content });
        if range.len() <= LEAF {
            return;
        }
        let axis = (high - low).max_position();
        let corners = &self.corners;
        let centre = |f: u32| corners[f as usize].iter().map(|p| p[axis]).sum::<f64>();
        self.order[range.clone()].sort_by(|&a, &b| centre(a).total_cmp(&centre(b)));
        self.split(range.start..middle);
        self.nodes[index].content = Content::Second(self.nodes.len());
        self.split(middle..range.end);
    }

    /// The closest hit: distance and facet; at equal distance the lowest facet.
    pub fn hit(&self, ray: &Ray) -> Option<(f64, u32)> {
        let inverse = ray.direction.recip();
        let mut best: Option<(f64, u32)> = None;
        let mut stack = vec![0];
        while let Some(index) = stack.pop() {
            let node = &self.nodes[index];
            let limit = best.map_or(f64::INFINITY, |b| b.0);
            if !meets(node, ray.origin, inverse, limit) {
                continue;
            }
            match &node.content {
                Content::Second(second) => stack.extend([*second, index + 1]),
                Content::Leaf(range) => {
                    for &facet in self.order[range.clone()].iter().filter(|&&f| Some(f) != ray.leaving) {
                        if let Some(t) = triangle(&self.corners[facet as usize], ray)
                            && best.is_none_or(|b| (t, facet) < b)
                        {
                            best = Some((t, facet));
                        }
                    }
                }
            }
        }
        best
    }
}

fn meets(node: &Node, origin: DVec3, inverse: DVec3, limit: f64) -> bool {
    let (a, b) = ((node.low - origin) * inverse, (node.high - origin) * inverse);
    // 0 * infinity, an origin on a box's plane, is no number and must not exclude: f64::min and max ignore it
    let mut near = 0.0f64;
    let mut far = limit;
    for k in 0..3 {
        near = near.max(a[k].min(b[k]));
        far = far.min(a[k].max(b[k]));
    }
    near <= far
}

/// Distance to the triangle; edges included. Moeller and Trumbore, "Fast, minimum storage ray/triangle
/// intersection", 1997.
fn triangle([a, b, c]: &[DVec3; 3], ray: &Ray) -> Option<f64> {
    let (e1, e2) = (*b - *a, *c - *a);
    let p = ray.direction.cross(e2);
    let determinant = e1.dot(p);
    if determinant == 0.0 {
        return None;
    }
    let s = ray.origin - *a;
    let u = s.dot(p) / determinant;
    let q = s.cross(e1);
    let v = ray.direction.dot(q) / determinant;
    let t = e2.dot(q) / determinant;
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0).then_some(t)
}
