//! Convex polygons of a fixed capacity, and clipping them.
//!
//! Constants of this file are measured by `cargo test --test form_factor` (errors).

use crate::base::math::Vec3;

/// Corners that a [`Convex`] holds.
pub(super) const CAPACITY: usize = 10;

/// Corners of the largest piece that [`pieces`] gives: two cuts fit on top of it.
const PIECE_CORNERS_MOST: usize = 8;

/// A convex polygon in fixed storage; callers meet it only as scratch memory ([`Convex::EMPTY`]).
#[derive(Clone, Copy, Debug)]
pub struct Convex {
    corners: [Vec3; CAPACITY],
    count: usize,
}

impl Convex {
    /// No corners.
    pub const EMPTY: Convex = Convex { corners: [Vec3::ZERO; CAPACITY], count: 0 };

    /// The first corners of `corners`, as many as fit.
    pub(super) fn new(corners: &[Vec3]) -> Convex {
        let mut polygon = Convex::EMPTY;
        corners.iter().for_each(|c| polygon.push(*c));
        polygon
    }

    /// Appends a corner; one beyond the capacity is left out.
    pub(super) fn push(&mut self, corner: Vec3) {
        if let Some(slot) = self.corners.get_mut(self.count) {
            *slot = corner;
            self.count += 1;
        }
    }

    /// The corners in order.
    pub(super) fn corners(&self) -> &[Vec3] {
        self.corners.get(..self.count).unwrap_or(&[])
    }

    /// Whether too few corners are left to have an area.
    pub(super) fn is_empty(&self) -> bool {
        self.count < 3
    }

    /// The same polygon with every corner mapped.
    pub(super) fn map(mut self, f: impl Fn(Vec3) -> Vec3) -> Convex {
        let count = self.count;
        self.corners.iter_mut().take(count).for_each(|c| *c = f(*c));
        self
    }

    /// The part where `height >= 0`, `height` being affine. Corners within `tolerance` of 0 count as on the
    /// plane and stay as they are, so that a shared edge is not cut by its own rounding; empty where no corner
    /// is above `tolerance`.
    pub(super) fn clip(&self, height: impl Fn(Vec3) -> f64, tolerance: f64) -> Convex {
        let heights =
            |f: fn(f64, f64) -> f64, start| self.corners().iter().fold(start, |m, c| f(m, height(*c)));
        if heights(f64::max, f64::NEG_INFINITY) <= tolerance {
            return Convex::EMPTY;
        }
        if heights(f64::min, f64::INFINITY) >= -tolerance {
            return *self;
        }
        let mut kept = Convex::EMPTY;
        for (a, b) in edges(self.corners()) {
            let (ha, hb) = (height(a), height(b));
            if ha >= -tolerance {
                kept.push(a);
            }
            if (ha > tolerance && hb < -tolerance) || (ha < -tolerance && hb > tolerance) {
                // From the same end whichever way the edge runs, so that neighbours cut it at the same point.
                let (from, to, hf, ht) = if ha > hb { (a, b, ha, hb) } else { (b, a, hb, ha) };
                kept.push(from + (to - from) * (hf / (hf - ht)));
            }
        }
        kept
    }
}

/// The edges of a closed contour, as pairs of corners.
pub(super) fn edges(corners: &[Vec3]) -> impl Iterator<Item = (Vec3, Vec3)> + Clone + '_ {
    let next = corners.iter().cycle().skip(1);
    corners.iter().zip(next).map(|(a, b)| (*a, *b))
}

/// Twice the vector area: along the side from which the corners run counter-clockwise.
pub(super) fn double_area(corners: &[Vec3]) -> Vec3 {
    let Some((first, rest)) = corners.split_first() else {
        return Vec3::ZERO;
    };
    let sides = rest.iter().zip(rest.iter().skip(1));
    sides.fold(Vec3::ZERO, |sum, (b, c)| sum + (*b - *first).cross(*c - *first))
}

/// A convex polygon of any number of corners, cut into a fan of at most [`PIECE_CORNERS_MOST`] corners each.
pub(super) fn pieces(polygon: &[Vec3]) -> impl Iterator<Item = Convex> + '_ {
    const FAN_STEP: usize = PIECE_CORNERS_MOST - 2;
    let (apex, rest) = polygon.split_first().map_or((Vec3::ZERO, &[][..]), |(a, r)| (*a, r));
    let count = rest.len().saturating_sub(1).div_ceil(FAN_STEP);
    (0..count).map(move |k| {
        let mut piece = Convex::new(&[apex]);
        rest.iter().skip(k * FAN_STEP).take(PIECE_CORNERS_MOST - 1).for_each(|c| piece.push(*c));
        piece
    })
}
