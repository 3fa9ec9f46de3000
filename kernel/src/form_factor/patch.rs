//! Quadrilateral patches and the area form of the form factor between them, by Gauss points.

use super::rule::{GAUSS_2, GAUSS_3, GAUSS_4, GAUSS_5, GAUSS_6, Rule};
use crate::base::math::{FRAC_1_PI, Vec3, sqrt};

/// Rules by how many times farther apart than large two patches are, for a relative error of at most 1e-10:
/// measured on 3,000 random pairs of triangles each, the worst being those that see each other edge-on.
const GAUSS_RULES: [(f64, Rule); 5] =
    [(1e4, GAUSS_2), (100.0, GAUSS_3), (16.0, GAUSS_4), (8.0, GAUSS_5), (4.0, GAUSS_6)];

/// Gauss points computed side by side.
const PATCH_LANES: usize = 4;

/// Blocks of [`PATCH_LANES`] points that hold the largest rule's 36.
const PATCH_POINT_BLOCKS: usize = 9;

/// A convex quadrilateral, corners in order; a triangle has its last corner twice.
#[derive(Clone, Copy)]
pub(super) struct Patch {
    corners: [Vec3; 4],
}

/// Gauss points on a patch, each with the area that it stands for times its height over the other's plane.
/// Places that the rule leaves over weigh nothing.
#[derive(Clone, Copy)]
struct Points {
    x: [f64; PATCH_LANES],
    y: [f64; PATCH_LANES],
    z: [f64; PATCH_LANES],
    weight: [f64; PATCH_LANES],
}

impl Points {
    const NONE: Points = Points {
        x: [0.0; PATCH_LANES],
        y: [0.0; PATCH_LANES],
        z: [0.0; PATCH_LANES],
        weight: [0.0; PATCH_LANES],
    };
}

/// The path from a whole to a part of it that was halved again and again, and on to the next part: lower halves first.
#[derive(Clone, Copy, Default)]
pub(super) struct HalvingPath {
    /// Bit n: whether step n leads to the upper half.
    upper: u32,
    steps: u32,
}

impl HalvingPath {
    /// Steps down to the lower half; false where that is deeper than `most`, at most 32.
    pub(super) fn down(&mut self, most: u32) -> bool {
        if self.steps >= most {
            return false;
        }
        self.upper &= !(1 << self.steps);
        self.steps += 1;
        true
    }

    /// From an upper half back to the whole that it is of; false from a lower half, or where there is none.
    pub(super) fn up(&mut self) -> bool {
        let last = self.steps.wrapping_sub(1);
        let upper = self.steps > 0 && self.upper >> last & 1 == 1;
        if upper {
            self.steps = last;
        }
        upper
    }

    /// From a lower half to the upper one beside it; false where there is none.
    pub(super) fn across(&mut self) -> bool {
        if self.steps > 0 {
            self.upper |= 1 << (self.steps - 1);
        }
        self.steps > 0
    }

    /// The next part beside or above, in order; false after the last.
    pub(super) fn next(&mut self) -> bool {
        while self.up() {}
        self.across()
    }

    /// Steps from the whole.
    pub(super) fn depth(&self) -> u32 {
        self.steps
    }

    /// Whether each step leads to the upper half.
    pub(super) fn steps(&self) -> impl Iterator<Item = bool> + use<> {
        let HalvingPath { upper, steps } = *self;
        (0..steps).map(move |n| upper >> n & 1 == 1)
    }
}

/// Cuts a convex polygon into a fan of patches.
pub(super) fn patches(corners: &[Vec3]) -> impl Iterator<Item = Patch> + Clone + '_ {
    let (apex, rest) = corners.split_first().map_or((Vec3::ZERO, &[][..]), |(a, r)| (*a, r));
    (0..rest.len() / 2).filter_map(move |k| {
        let (b, c) = (*rest.get(2 * k)?, *rest.get(2 * k + 1)?);
        Some(Patch { corners: [apex, b, c, *rest.get(2 * k + 2).unwrap_or(&c)] })
    })
}

impl Patch {
    /// The mean of the corners.
    fn centre(&self) -> Vec3 {
        let [a, b, c, d] = self.corners;
        (a + b + c + d) * 0.25
    }

    /// Radius of the sphere about the centre that holds the patch.
    pub(super) fn size(&self) -> f64 {
        let centre = self.centre();
        sqrt(self.corners.iter().fold(0.0, |m: f64, c| m.max((*c - centre).length_squared())))
    }

    /// The cheapest rule that is exact enough for this pair; none where the patches are too near.
    pub(super) fn rule(a: &Patch, b: &Patch) -> Option<Rule> {
        let apart = b.centre() - a.centre();
        let ratio = sqrt(apart.dot(apart)) / (a.size() + b.size());
        GAUSS_RULES.iter().find(|(least, _)| ratio >= *least).map(|(_, rule)| *rule)
    }

    /// The two halves, cut across the longer direction.
    pub(super) fn halves(&self) -> (Patch, Patch) {
        let [a, b, c, d] = self.corners;
        let along = ((b - a) + (c - d)).length_squared();
        let across = ((d - a) + (c - b)).length_squared();
        if along >= across {
            let (low, high) = ((a + b) * 0.5, (c + d) * 0.5);
            (Patch { corners: [a, low, high, d] }, Patch { corners: [low, b, c, high] })
        } else {
            let (low, high) = ((a + d) * 0.5, (b + c) * 0.5);
            (Patch { corners: [a, b, high, low] }, Patch { corners: [low, high, c, d] })
        }
    }

    /// One of the two halves.
    pub(super) fn half(&self, upper: bool) -> Patch {
        let (lower, higher) = self.halves();
        if upper { higher } else { lower }
    }

    /// int int cos cos' / (pi r^2) over both patches, of unit normals `na` and `nb` that face each other.
    ///
    /// r cos is the height of one point over the other's plane, and does not depend on where the other is.
    #[inline(never)]
    pub(super) fn product(a: &Patch, na: Vec3, b: &Patch, nb: Vec3, rule: Rule) -> f64 {
        let mut on_b = [Points::NONE; PATCH_POINT_BLOCKS];
        b.points(nb, a, na, rule, &mut on_b);
        let blocks = (rule.len() * rule.len()).div_ceil(PATCH_LANES);
        let mut sums = [0.0; PATCH_LANES];
        for (position, weight) in a.weighed(na, b, nb, rule) {
            let [x, y, z] = position.to_array();
            let mut row = [0.0; PATCH_LANES];
            for t in on_b.iter().take(blocks) {
                for (lane, sum) in row.iter_mut().enumerate() {
                    let (dx, dy, dz) = (t.x[lane] - x, t.y[lane] - y, t.z[lane] - z);
                    let r2 = dx * dx + dy * dy + dz * dz;
                    *sum += t.weight[lane] / (r2 * r2);
                }
            }
            sums.iter_mut().zip(row).for_each(|(sum, r)| *sum += weight * r);
        }
        let [p, q, r, s] = sums;
        ((p + q) + (r + s)) * FRAC_1_PI
    }

    /// The rule's points on this patch, weighed by their height over the `other`, in blocks.
    fn points(
        &self,
        normal: Vec3,
        other: &Patch,
        other_normal: Vec3,
        rule: Rule,
        blocks: &mut [Points; PATCH_POINT_BLOCKS],
    ) {
        let Vec3 { x, y, z } = self.corners[0];
        blocks.fill(Points {
            x: [x; PATCH_LANES],
            y: [y; PATCH_LANES],
            z: [z; PATCH_LANES],
            weight: [0.0; PATCH_LANES],
        });
        let lanes =
            blocks.iter_mut().flat_map(|p| p.x.iter_mut().zip(&mut p.y).zip(&mut p.z).zip(&mut p.weight));
        for ((((x, y), z), weight), (position, own)) in
            lanes.zip(self.weighed(normal, other, other_normal, rule))
        {
            (*x, *y, *z) = position.into();
            *weight = own;
        }
    }

    /// The rule's points on this patch, each with the area that it stands for times its height over the `other`.
    fn weighed(
        &self,
        normal: Vec3,
        other: &Patch,
        other_normal: Vec3,
        rule: Rule,
    ) -> impl Iterator<Item = (Vec3, f64)> + use<> {
        let base = other.corners[0];
        // Below zero by rounding alone: the polygons were cut at each other's planes.
        let weigh = move |(position, area): (Vec3, f64)| {
            (position, area * (position - base).dot(other_normal).max(0.0))
        };
        self.nodes(normal, rule).map(weigh)
    }

    /// The rule's points on this patch of unit normal `normal`, with the area that each stands for.
    pub(super) fn nodes(&self, normal: Vec3, rule: Rule) -> impl Iterator<Item = (Vec3, f64)> + use<> {
        let [a, b, c, d] = self.corners;
        let (u, v, twist) = (b - a, d - a, (a - b) + (c - d));
        let jacobian = [u.cross(v), u.cross(twist), twist.cross(v)].map(|part| part.dot(normal));
        rule.iter().flat_map(move |(x, wx)| {
            rule.iter().map(move |(y, wy)| {
                let [plain, with_x, with_y] = jacobian;
                let area = wx * wy * (plain + with_x * x + with_y * y);
                (a + u * x + v * y + twist * (x * y), area.max(0.0))
            })
        })
    }
}
