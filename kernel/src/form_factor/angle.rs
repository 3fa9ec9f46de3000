//! The angle of a vector in the upper half plane, as straight-line code that vectorises.

use crate::base::math::{FRAC_PI_2, PI};
use crate::base::simd::{Lanes64, Wide};

/// tan(pi/8): arguments above it are turned by pi/4.
const TAN_PI_8: f64 = 0.414_213_562_373_095_05;

/// tan(3 pi/8), the reciprocal of [`TAN_PI_8`]: arguments above it are turned by pi/2.
const TAN_3PI_8: f64 = 2.414_213_562_373_095;

/// atan(z)/z in powers of z^2 for |z| <= tan(pi/8): interpolation at the Chebyshev nodes, error 3e-17.
const ATAN: [f64; 11] = [
    1.0,
    -0.3333333333332844,
    0.1999999999885511,
    -0.14285714180976467,
    0.11111106180455946,
    -0.09090773074808414,
    0.07689953496306857,
    -0.06640233930429408,
    0.056883492268090106,
    -0.04348052215716462,
    0.021135373157693246,
];

/// The angle in [0, pi] whose sine and cosine are as `y` >= 0 to `x`; 0 where both are 0.
///
/// Absolute error below 1e-15 everywhere, relative error below 1e-15 for angles below pi/2.
#[inline(always)]
pub(super) fn angle(y: f64, x: f64) -> f64 {
    let wide = x.abs();
    let (steep, slanted) = (y > TAN_3PI_8 * wide, y > TAN_PI_8 * wide);
    let (above, below, turn) = (
        select(steep, -wide, select(slanted, y - wide, y)),
        select(steep, y, select(slanted, y + wide, wide)),
        select(steep, FRAC_PI_2, select(slanted, 0.5 * FRAC_PI_2, 0.0)),
    );
    let z = above / select(below > f64::MIN_POSITIVE, below, f64::MIN_POSITIVE);
    let z2 = z * z;
    let acute = turn + z * arc_tangent_series(z2);
    select(x < 0.0, PI - acute, acute)
}

/// [`angle`] in explicit lanes.
#[inline(always)]
pub(crate) fn wide_angle<L: Lanes64>(lanes: L, y: L::F, x: L::F) -> L::F {
    let (zero, least) = (lanes.all(0.0), lanes.all(f64::MIN_POSITIVE));
    let wide = x.abs();
    let (steep, slanted) = (y.gt(lanes.all(TAN_3PI_8) * wide), y.gt(lanes.all(TAN_PI_8) * wide));
    let above = (zero - wide).where_else(steep, (y - wide).where_else(slanted, y));
    let below = y.where_else(steep, (y + wide).where_else(slanted, wide));
    let turn = lanes.all(FRAC_PI_2).where_else(steep, lanes.all(0.5 * FRAC_PI_2).where_else(slanted, zero));
    let z = above / below.max(least);
    let z2 = z * z;
    let (z4, c) = (z2 * z2, ATAN);
    let z8 = z4 * z4;
    let low = (lanes.all(c[0]) + lanes.all(c[1]) * z2) + (lanes.all(c[2]) + lanes.all(c[3]) * z2) * z4;
    let mid = (lanes.all(c[4]) + lanes.all(c[5]) * z2) + (lanes.all(c[6]) + lanes.all(c[7]) * z2) * z4;
    let high = (lanes.all(c[8]) + lanes.all(c[9]) * z2) + lanes.all(c[10]) * z4;
    let acute = turn + z * (low + (mid + high * z8) * z8);
    (lanes.all(PI) - acute).where_else(zero.gt(x), acute)
}

/// One term of Lambert's sum in explicit lanes, theta (a x b)/|a x b| . n, of the edge between two corners a and b: `sine` is
/// |a x b|, `cosine` a . b and `toward` (a x b) . n. 0 where both corners lie in one direction.
#[inline(always)]
pub(crate) fn lambert_term<L: Lanes64>(lanes: L, sine: L::F, cosine: L::F, toward: L::F) -> L::F {
    wide_angle(lanes, sine, cosine) * toward / sine.max(lanes.all(f64::MIN_POSITIVE))
}

/// atan(z)/z, by Estrin's scheme: half as many operations wait for one another as in Horner's.
#[inline(always)]
fn arc_tangent_series(z2: f64) -> f64 {
    let [c0, c1, c2, c3, c4, c5, c6, c7, c8, c9, c10] = ATAN;
    let z4 = z2 * z2;
    let z8 = z4 * z4;
    let low = (c0 + c1 * z2) + (c2 + c3 * z2) * z4;
    let mid = (c4 + c5 * z2) + (c6 + c7 * z2) * z4;
    let high = (c8 + c9 * z2) + c10 * z4;
    low + (mid + high * z8) * z8
}

/// One of two computed values, by mask rather than by branch: a branch would keep a loop from vectorising.
#[inline(always)]
fn select(condition: bool, yes: f64, no: f64) -> f64 {
    let mask = (condition as u64).wrapping_neg();
    f64::from_bits((yes.to_bits() & mask) | (no.to_bits() & !mask))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::math::{atan2, cos, sin};
    use crate::base::simd::{Isa, WIDTH, WideTask, run_wide};

    struct Angles([f64; WIDTH], [f64; WIDTH]);

    impl WideTask for Angles {
        type Out = [f64; WIDTH];

        #[inline(always)]
        fn run<L: Lanes64>(self, lanes: L) -> [f64; WIDTH] {
            wide_angle(lanes, lanes.of(&self.0), lanes.of(&self.1)).array()
        }
    }

    #[test]
    fn lanes_have_the_bits_of_one() {
        for k in 0..1000 {
            let at = |n: usize| PI * (k * WIDTH + n) as f64 / 7999.0;
            let y: [f64; WIDTH] = core::array::from_fn(|n| sin(at(n)).max(0.0));
            let x: [f64; WIDTH] = core::array::from_fn(|n| cos(at(n)));
            let want: [f64; WIDTH] = core::array::from_fn(|n| angle(y[n], x[n]));
            for isa in Isa::all() {
                assert_eq!(run_wide(isa, Angles(y, x)), want);
            }
        }
        let (y, x) =
            ([0.0, 0.0, 0.0, 1.0, 1e-300, 0.0, 1.0, 1.0], [0.0, 1.0, -1.0, 0.0, 1.0, -0.0, 1.0, -1.0]);
        let want: [f64; WIDTH] = core::array::from_fn(|n| angle(y[n], x[n]));
        assert_eq!(run_wide(Isa::BASELINE, Angles(y, x)), want);
    }

    /// 1e-15: the polynomial's 3e-17 and five roundings of numbers up to pi.
    #[test]
    fn angles_agree_with_atan2() {
        for k in 0..=100_000 {
            let a = PI * f64::from(k) / 100_000.0;
            for size in [1.0, 1e-120, 1e120] {
                let (y, x) = (sin(a).max(0.0) * size, cos(a) * size);
                let (got, want) = (angle(y, x), atan2(y, x));
                assert!((got - want).abs() <= 1e-15 * want.clamp(0.0, 1.0), "{y:e} {x:e}: {got:e} {want:e}");
            }
        }
        let tiny =
            [(0.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, -1.0, PI), (1e-300, 1.0, 1e-300), (1.0, 0.0, FRAC_PI_2)];
        for (y, x, want) in tiny {
            assert_eq!(angle(y, x), want);
        }
    }
}
