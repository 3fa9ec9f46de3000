//! Triangles cut into four congruent ones, and those again: where a point lies, in weights of corners 1 and 2.

use crate::base::math::Vec3;

/// Quarters of a triangle: those at its corners 0, 1 and 2, and the middle one.
pub const QUARTERS: usize = 4;

/// The point of weights (a, b) of a quarter, as weights of the whole triangle.
#[inline(always)]
pub fn out_of(quarter: usize, (a, b): (f64, f64)) -> (f64, f64) {
    match quarter {
        0 => (0.5 * a, 0.5 * b),
        1 => (0.5 + 0.5 * a, 0.5 * b),
        2 => (0.5 * a, 0.5 + 0.5 * b),
        _ => (0.5 - 0.5 * a, 0.5 - 0.5 * b),
    }
}

/// The quarter in which the point of weights (a, b) of a triangle lies, and its weights there. Undoes [`out_of`], to
/// the bit.
#[inline(always)]
pub fn into(a: f64, b: f64) -> (usize, (f64, f64)) {
    if a > 0.5 {
        (1, (2.0 * a - 1.0, 2.0 * b))
    } else if b > 0.5 {
        (2, (2.0 * a, 2.0 * b - 1.0))
    } else if a + b < 0.5 {
        (0, (2.0 * a, 2.0 * b))
    } else {
        (3, (1.0 - 2.0 * a, 1.0 - 2.0 * b))
    }
}

/// The point of barycentric weights `u`, `v` (corners 1 and 2) of a triangle.
#[inline(always)]
pub fn point(triangle: &[Vec3; 3], u: f64, v: f64) -> Vec3 {
    let [a, b, c] = *triangle;
    a + (b - a) * u + (c - a) * v
}

/// Which quarter of which quarter of a triangle: up to [`Path::DEEPEST`] steps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Path(pub u32);

impl Path {
    /// The most steps: a facet's sides over its smallest elements', 4096. Four bits of a path count them and each has two.
    pub const DEEPEST: u32 = 12;

    /// Steps taken.
    #[inline(always)]
    pub fn depth(self) -> u32 {
        self.0 & 15
    }

    /// One step more.
    #[inline(always)]
    pub fn step(self, quarter: usize) -> Path {
        Path((self.0 & !15) << 2 | (quarter as u32 & 3) << 4 | (self.depth() + 1))
    }

    /// Whether another path leads to or into one of the quarters of the triangle of which this one's end is a quarter.
    pub fn is_quarter_beside(self, other: Path) -> bool {
        let deeper = other.depth().checked_sub(self.depth());
        self.depth() > 0 && deeper.is_some_and(|d| other.0 >> 4 >> (2 * (d + 1)) == self.0 >> 4 >> 2)
    }

    /// Its share of the triangle's area.
    #[inline(always)]
    pub fn share(self) -> f64 {
        // 4^-depth, exactly
        1.0 / (1u64 << (2 * self.depth().min(30))) as f64
    }

    /// Corners of the path's end, of a triangle with these.
    pub fn corners(self, triangle: &[Vec3; 3]) -> [Vec3; 3] {
        [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)].map(|(a, b)| {
            let (u, v) = self.out_of(a, b);
            point(triangle, u, v)
        })
    }

    /// The point of weights (a, b) at the path's end, as weights of the whole triangle.
    #[inline(always)]
    pub fn out_of(self, a: f64, b: f64) -> (f64, f64) {
        let (mut point, mut steps) = ((a, b), self.0 >> 4);
        for _ in 0..self.depth() {
            point = out_of((steps & 3) as usize, point);
            steps >>= 2;
        }
        point
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn into_undoes_out_of() {
        for quarter in 0..QUARTERS {
            for point in [(0.2, 0.3), (0.7, 0.1), (0.05, 0.9), (1.0 / 3.0, 1.0 / 3.0)] {
                let (a, b) = out_of(quarter, point);
                let (found, (c, d)) = into(a, b);
                assert_eq!(found, quarter);
                // 0.5 + a/2 rounds a to twice the spacing of numbers near 1
                assert!((c - point.0).abs() < 4e-16 && (d - point.1).abs() < 4e-16);
            }
        }
    }

    #[test]
    fn paths_go_down_step_by_step() {
        let path = Path::default().step(1).step(3).step(2);
        assert_eq!((path.depth(), path.share()), (3, 1.0 / 64.0));
        let (a, b) = path.out_of(0.25, 0.5);
        assert_eq!((a, b), out_of(1, out_of(3, out_of(2, (0.25, 0.5)))));
        let beside = Path::default().step(1).step(3).step(0);
        assert!(path.is_quarter_beside(beside) && path.is_quarter_beside(beside.step(1)));
        assert!(!path.is_quarter_beside(Path::default().step(1).step(2).step(2)));
        assert!(!beside.step(1).is_quarter_beside(path) && !Path::default().is_quarter_beside(path));
        let deepest = (0..Path::DEEPEST).fold(Path::default(), |p, k| p.step(k as usize));
        assert_eq!((deepest.depth(), deepest.share()), (12, 1.0 / (1u64 << 24) as f64));
    }
}
