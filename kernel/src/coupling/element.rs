//! Elements: facets cut into quarters as [`crate::coupling::subdivide`] decides, on each of which diffuse light varies
//! linearly.
//!
//! The cut depends on geometry, materials and tolerance, never on the light. An unknown of the linear system is one
//! side of one element: unknown = element * sides + side.

mod bake;

use crate::base::arena::{Arena, Need};
use crate::base::error::Error;
use crate::base::index::{Index, IndexMut};
use crate::base::math::Vec3;
use crate::base::quarter::{self, Path, QUARTERS};
use crate::coupling::subdivide::{Node, SubdivisionTree};
use crate::scene::Scene;

/// Which elements each facet has.
#[derive(Clone, Copy, Debug)]
pub struct Elements<'m> {
    first: &'m [u32],
    /// Of each node of the trees: [`ELEMENT_NODE`] and its element, or the first of its four quarters' nodes.
    nodes: &'m [u32],
    facet: &'m [u32],
    path: &'m [u32],
    sides: usize,
    memory: usize,
}

/// Marks nodes that are elements.
const ELEMENT_NODE: u32 = 1 << 31;

/// A point on an element: its local coordinates, each the barycentric weight of a corner less 1/3.
pub type Local = (f64, f64);

/// The quarters of a node that still wait while a tree is walked.
const NODES_WAITING: usize = Path::DEEPEST as usize * (QUARTERS - 1) + 1;

/// Calls `leaf` with (facet, node, path) of every element, by facet, first quarters first. `child` gives a node's first
/// quarter, `None` for an element. False where `leaf` says so or the trees are deeper than can be.
fn walk(
    facets: usize,
    child: impl Fn(usize) -> Option<usize>,
    mut leaf: impl FnMut(usize, usize, Path) -> bool,
) -> bool {
    for facet in 0..facets {
        let mut waiting = [(0usize, Path::default()); NODES_WAITING];
        waiting.set(0, (facet, Path::default()));
        let mut count = 1;
        while count > 0 {
            count -= 1;
            let (node, path) = waiting.at(count);
            match child(node) {
                None if !leaf(facet, node, path) => return false,
                None => {}
                Some(_) if path.depth() >= Path::DEEPEST => return false,
                Some(first) => {
                    for quarter in (0..QUARTERS).rev() {
                        waiting.set(count, (first + quarter, path.step(quarter)));
                        count += 1;
                    }
                }
            }
        }
    }
    true
}

impl<'m> Elements<'m> {
    /// Bytes for facets cut like this.
    pub fn bytes(tree: &SubdivisionTree<'_>) -> Result<usize, Error> {
        let leaves = tree.nodes().iter().filter(|n| n.child == 0).count();
        Elements::need(tree.facets(), tree.nodes().len(), leaves).bytes()
    }

    fn need(facets: usize, nodes: usize, elements: usize) -> Need {
        Need::new().and::<u32>(facets + 1).and::<u32>(nodes).and::<u32>(elements).and::<u32>(elements)
    }

    /// The elements of a cut.
    pub fn new(
        scene: &Scene<'_>,
        tree: &SubdivisionTree<'_>,
        memory: &'m mut [u8],
    ) -> Result<Elements<'m>, Error> {
        let (facets, trees): (usize, &[Node]) = (tree.facets(), tree.nodes());
        if facets != scene.facets() {
            return Err(Error::Mismatch { what: "cut" });
        }
        let needed = Elements::bytes(tree)?;
        let elements = trees.iter().filter(|n| n.child == 0).count();
        let mut arena = Arena::new(memory, needed)?;
        let first = arena.take::<u32>(facets + 1)?;
        let nodes = arena.take::<u32>(trees.len())?;
        let facet_of = arena.take::<u32>(elements)?;
        let paths = arena.take::<u32>(elements)?;
        for (node, tree) in nodes.iter_mut().zip(trees) {
            *node = tree.child;
        }
        let child = |node: usize| trees.get(node).map(|n| n.child as usize).filter(|c| *c != 0);
        let mut at = 0;
        walk(facets, child, |facet, node, path| {
            nodes.set(node, ELEMENT_NODE | at as u32);
            facet_of.set(at, facet as u32);
            paths.set(at, path.0);
            at += 1;
            first.set(facet + 1, at as u32);
            true
        });
        Ok(Elements { first, nodes, facet: facet_of, path: paths, sides: scene.sides(), memory: needed })
    }

    /// Number of elements.
    #[inline(always)]
    pub fn count(&self) -> usize {
        self.facet.len()
    }

    /// Number of unknowns: elements times sides.
    #[inline(always)]
    pub fn unknowns(&self) -> usize {
        self.facet.len() * self.sides
    }

    /// Facet and side of an unknown.
    #[inline(always)]
    pub fn facet_of(&self, unknown: usize) -> (usize, usize) {
        if self.sides == 1 {
            // without a division
            return (self.facet.at(unknown) as usize, 0);
        }
        (self.facet.at(unknown / self.sides.max(1)) as usize, unknown % self.sides.max(1))
    }

    /// Sides of all facets.
    #[inline(always)]
    pub fn facet_sides(&self) -> usize {
        self.first.len().saturating_sub(1) * self.sides
    }

    /// The place of an unknown's side of a facet among them: facet * sides + side.
    #[inline(always)]
    pub fn facet_side(&self, unknown: usize) -> usize {
        let (facet, side) = self.facet_of(unknown);
        facet * self.sides + side
    }

    /// The unknowns of one side of a facet.
    pub fn unknowns_of(&self, facet: usize, side: usize) -> impl Iterator<Item = usize> + Clone + use<> {
        let sides = self.sides;
        (self.first.at(facet) as usize..self.first.at(facet + 1) as usize).map(move |e| e * sides + side)
    }

    /// The unknowns of what was cut together with an unknown's element: the other quarters of one triangle, or what those
    /// were cut into, some thirty at most.
    pub fn neighbours(&self, unknown: usize) -> impl Iterator<Item = usize> {
        let (sides, facet) = (self.sides.max(1), self.facet_of(unknown).0);
        let side = unknown % sides;
        let own = Path(self.path.at(unknown / sides));
        let (start, end) = (self.first.at(facet) as usize, self.first.at(facet + 1) as usize);
        let at = unknown / sides;
        (1..16)
            .flat_map(move |step| [at.checked_sub(step), at.checked_add(step)])
            .flatten()
            .filter(move |e| (start..end).contains(e) && own.is_quarter_beside(Path(self.path.at(*e))))
            .map(move |e| e * sides + side)
    }

    /// Share of its facet's area that an unknown's element has.
    #[inline(always)]
    pub fn share(&self, unknown: usize) -> f64 {
        Path(self.path.at(unknown / self.sides.max(1))).share()
    }

    /// The unknown at the point of barycentric weights (u, v) of a facet's side, and the point on its element.
    #[inline(always)]
    pub fn locate(&self, facet: usize, side: usize, u: f64, v: f64) -> (usize, Local) {
        let (mut node, mut point) = (self.nodes.at(facet), (u, v));
        for _ in 0..Path::DEEPEST {
            if node & ELEMENT_NODE != 0 {
                break;
            }
            let (quarter, next) = quarter::into(point.0, point.1);
            (node, point) = (self.nodes.at(node as usize + quarter), next);
        }
        ((node & !ELEMENT_NODE) as usize * self.sides + side, (point.0 - 1.0 / 3.0, point.1 - 1.0 / 3.0))
    }

    /// Barycentric weights in the facet of the point (a, b) (weights of corners 1 and 2) of an element.
    #[inline(always)]
    pub fn in_facet(&self, element: usize, a: f64, b: f64) -> (f64, f64) {
        Path(self.path.at(element)).out_of(a, b)
    }

    /// Corners of an element in scene coordinates, wound as its facet.
    pub fn corners(&self, scene: &Scene<'_>, element: usize) -> [Vec3; 3] {
        Path(self.path.at(element)).corners(&scene.corners().at(self.facet.at(element) as usize))
    }

    /// Bytes in use.
    pub fn memory(&self) -> usize {
        self.memory
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::budget::ErrorBudget;
    use crate::scene::{MaterialInput, SceneInput};

    #[test]
    fn locate_and_in_facet_are_inverse_and_cover_the_facet() {
        let material = MaterialInput { diffuse: &[0.5], specular: &[0.0], emission: &[0.0], gloss: None };
        let input = SceneInput {
            vertices: &[[0.0; 3], [3.0, 0.0, 0.0], [0.0, 2.0, 1.0]],
            facets: &[[0, 1, 2], [0, 2, 1]],
            facet_materials: &[],
            normals: &[],
            facet_normals: &[],
            materials: &[material],
            two_sided: true,
            bands: 1,
        };
        let mut memory = [0u8; 4096];
        let scene = Scene::new(&input, &mut memory).unwrap();
        for cuts in [0, 1, 3, 6] {
            let mut memory = [0u8; 1 << 18];
            let mut tree = SubdivisionTree::new(&scene, &ErrorBudget::new(1e-3, 1e-3), &mut memory).unwrap();
            // the first facet and then always one corner and the middle of what was cut
            for _ in 0..cuts {
                let (_, values) = tree.newest_level();
                values
                    .iter_mut()
                    .enumerate()
                    .for_each(|(i, v)| *v = if i % 4 == 0 || i % 4 == 3 { 1.0 } else { 0.0 });
                assert!(tree.refine(&scene));
            }
            let mut memory = [0u8; 1 << 16];
            let elements = Elements::new(&scene, &tree, &mut memory).unwrap();
            let own = elements.unknowns_of(0, 1).map(|u| u / 2);
            assert_eq!(own.clone().count() + 1, elements.count());
            let (mut area, mut share) = (0.0, 0.0);
            for e in own {
                for (a, b) in [(0.2, 0.3), (0.7, 0.1), (0.05, 0.9)] {
                    let (u, v) = elements.in_facet(e, a, b);
                    let (unknown, (la, lb)) = elements.locate(0, 1, u, v);
                    assert_eq!(elements.facet_of(unknown), (0, 1));
                    assert_eq!(unknown, e * 2 + 1, "{cuts} cuts");
                    // rounding of weights near 1, doubled at each of six steps
                    assert!((la + 1.0 / 3.0 - a).abs() < 1e-13 && (lb + 1.0 / 3.0 - b).abs() < 1e-13);
                }
                let [p, q, r] = elements.corners(&scene, e);
                area += 0.5 * (q - p).cross(r - p).dot(scene.normals()[0]);
                share += elements.share(e * 2);
            }
            // a sum of some hundred terms rounds each time
            assert!((area - scene.areas()[0]).abs() < 1e-13 && (share - 1.0).abs() < 1e-15);
            for (u, v) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.5, 0.5), (-1e-17, 1.0 + 1e-16)] {
                let (unknown, _) = elements.locate(0, 0, u, v);
                assert_eq!(elements.facet_of(unknown), (0, 0));
            }
        }
    }
}
