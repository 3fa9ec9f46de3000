//! Sheets and wires seen edge on, which stand between pixel centres: found in the mesh, as no centre shows them.
//!
//! Constants of this file are measured by `cargo run --release --example calibrate` (errors of thin parts).

use super::Painter;
use crate::base::index::Index;
use crate::base::math::{Vec3, unit};
use crate::rays::bvh::HalfSpace;
use core::ops::Range;

impl Painter<'_, '_> {
    /// Has pixels sampled that no centre about shows to hold anything but black backs, but into which the front of a facet
    /// reaches: edges of sheets, wires.
    #[inline(never)]
    pub(super) fn find_thin(&mut self, row: isize, columns: isize) {
        let empty = |this: &Self, j: isize| {
            let at = this.centre_rows.place(row, j);
            this.is_dark(at) && this.is_flat(at)
        };
        let mut start = 0;
        while start < columns {
            let mut end = start;
            while end < columns && empty(self, end) {
                end += 1;
            }
            let mut left = start..end;
            while !left.is_empty() {
                let mut run = left.clone();
                // halved until nothing is in it, or it is one pixel
                while !run.is_empty() && self.reaches(row, &run) {
                    if run.len() == 1 {
                        let at = self.centre_rows.place(row, run.start);
                        self.centre_rows.set_unevenness(at, f64::INFINITY);
                        break;
                    }
                    run.end = run.start + run.len() as isize / 2;
                }
                left.start = run.end;
            }
            start = end + 1;
        }
    }

    /// Whether fronts of facets may reach into a pixel whose centre shows none.
    pub(super) fn is_thin(&self, row: isize, column: isize) -> bool {
        let at = self.centre_rows.place(row, column);
        let empty = self.is_dark(at);
        self.centre_rows.unevenness(at) == f64::INFINITY || empty && self.reaches(row, &(column..column + 1))
    }

    /// Whether a pixel's centre shows no facet, or a black back.
    fn is_dark(&self, at: usize) -> bool {
        !self.centre_rows.is_object(at) || self.centre_rows.terms(at).iter().all(|l| *l == 0.0)
    }

    /// Whether the front of a facet may reach into some pixels of a row.
    #[inline(never)]
    fn reaches(&self, row: isize, columns: &Range<isize>) -> bool {
        let (left, right) = (columns.start as f64, columns.end as f64);
        let (top, bottom) = (row as f64, row as f64 + 1.0);
        let corners = [(left, top), (right, top), (right, bottom), (left, bottom)];
        let eye = self.camera.ray(0.5 * (left + right), 0.5 * (top + bottom));
        let inside = eye.origin + eye.direction;
        let halves = [0, 1, 2, 3].map(|side| {
            let [one, other] =
                [corners.at(side), corners.at((side + 1) % 4)].map(|(x, y)| self.camera.ray(x, y));
            let along = other.origin + other.direction - (one.origin + one.direction);
            let normal = unit(one.direction.cross(along)).unwrap_or(Vec3::ZERO);
            let height = normal.dot(one.origin);
            if normal.dot(inside) >= height {
                HalfSpace { normal, height }
            } else {
                HalfSpace { normal: -normal, height: -height }
            }
        });
        let mut found = false;
        let (bvh, two_sided) = (self.solved.bvh, self.solved.scene.sides() == 2);
        bvh.within(&halves, |facet: u32| {
            let front = |([a, ..], normal): ([Vec3; 3], Vec3)| {
                normal.dot(if self.camera.is_parallel() { -eye.direction } else { eye.origin - a }) > 0.0
            };
            found = two_sided || bvh.corners(facet).is_some_and(front);
            !found
        });
        found
    }
}
