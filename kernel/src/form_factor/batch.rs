//! From one point to many triangles at once, on SIMD lanes.

use super::angle::angle;
use super::point::share;
use crate::base::math::Vec3;
use crate::base::simd::{Isa, Task, run};

/// Triangles in a block: two registers of the widest instruction set, so that their latencies overlap.
pub const TRIANGLE_LANES: usize = 8;

/// [`TRIANGLE_LANES`] triangles, lane by lane: `corners[corner][axis][lane]`. Lanes left over may hold anything finite.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(64))]
pub struct TriangleBlock {
    /// Corner, axis, lane.
    pub corners: [[[f64; TRIANGLE_LANES]; 3]; 3],
}

impl TriangleBlock {
    /// All lanes at the origin: triangles without area, whose factor is 0.
    pub const EMPTY: TriangleBlock = TriangleBlock { corners: [[[0.0; TRIANGLE_LANES]; 3]; 3] };

    /// Puts a triangle into a lane; nothing happens where the lane is not below [`TRIANGLE_LANES`].
    pub fn set(&mut self, lane: usize, triangle: &[Vec3; 3]) {
        for (axes, corner) in self.corners.iter_mut().zip(triangle) {
            for (lanes, x) in axes.iter_mut().zip(corner.to_array()) {
                lanes.iter_mut().skip(lane).take(1).for_each(|slot| *slot = x);
            }
        }
    }
}

/// Form factors from the point `p` with the unit normal `n` to all triangles of `blocks`, into `factors`, block
/// by block, as many as both hold.
///
/// As [`point_to_triangle`](super::point_to_triangle), within 1e-15 (and relatively 1e-15 r/s), for triangles
/// that lie wholly above p's horizon and whose planes do not hold p: nothing is clipped. The same bits on
/// every instruction set.
pub fn point_to_triangles(
    isa: Isa,
    p: Vec3,
    n: Vec3,
    blocks: &[TriangleBlock],
    factors: &mut [[f64; TRIANGLE_LANES]],
) {
    run(isa, Blocks { p, n, blocks, factors });
}

/// The arguments of [`point_to_triangles`].
struct Blocks<'a> {
    p: Vec3,
    n: Vec3,
    blocks: &'a [TriangleBlock],
    factors: &'a mut [[f64; TRIANGLE_LANES]],
}

impl Task for Blocks<'_> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let Blocks { p, n, blocks, factors } = self;
        for (block, out) in blocks.iter().zip(factors) {
            let [u, v, w] = &block.corners;
            let mut local = [0.0; TRIANGLE_LANES];
            for (lane, factor) in local.iter_mut().enumerate() {
                let corner = |c: &[[f64; TRIANGLE_LANES]; 3]| Vec3::new(c[0][lane], c[1][lane], c[2][lane]);
                let (u, v, w) = (corner(u), corner(v), corner(w));
                let (a, b, c) = (u - p, v - p, w - p);
                *factor = share(edge(a, b, v - u, n) + edge(b, c, w - v, n) + edge(c, a, u - w, n));
            }
            *out = local;
        }
    }
}

/// One term of Lambert's sum, as in [`super::point`].
#[inline(always)]
fn edge(a: Vec3, b: Vec3, side: Vec3, n: Vec3) -> f64 {
    let cross = a.cross(side);
    let sine2 = cross.dot(cross);
    let inverse = inverse_sqrt(sine2);
    angle(sine2 * inverse, a.dot(b)) * inverse * cross.dot(n)
}

/// 1/sqrt(x) for x >= 0 within 4e-16, some large number for 0: Newton's method from the exponent's half.
///
/// `libm`'s square root is an instruction hidden from the optimiser, which keeps a loop from vectorising.
#[inline(always)]
fn inverse_sqrt(x: f64) -> f64 {
    let mut y = f64::from_bits(0x5fe6_eb50_c7b5_37a9_u64.wrapping_sub(x.to_bits() >> 1));
    for _ in 0..4 {
        y *= 1.5 - (0.5 * x * y) * y;
    }
    y
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Four steps square the start's error of 3.5 % down to rounding: three of them in the last step.
    #[test]
    fn inverse_square_roots() {
        for k in -900..900 {
            for m in [1.0, 1.3, 1.9, 2.7, 3.999] {
                let x = m * 2f64.powi(k);
                let want = 1.0 / crate::base::math::sqrt(x);
                assert!((inverse_sqrt(x) / want - 1.0).abs() < 4.5e-16, "{x:e}");
            }
        }
        assert!(inverse_sqrt(0.0).is_finite());
    }
}
