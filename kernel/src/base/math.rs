//! The one door to transcendental functions, so that every build gives the same bits.
//!
//! All are `libm`'s: at most 1 ulp from the correctly rounded value; `sqrt` is correctly rounded.

pub use glam::DVec3 as Vec3;

pub use core::f64::consts::{FRAC_1_PI, FRAC_PI_2, PI, TAU};

pub use libm::{acos, asin, atan, atan2, cos, exp, fabs, floor, log, pow, sin, tan};

/// Square root, correctly rounded (an instruction where the target has one).
#[inline(always)]
pub fn sqrt(x: f64) -> f64 {
    libm::sqrt(x)
}

/// `v` scaled to length 1, or `None` where it is zero or not finite. Safe against overflow of the square.
pub fn unit(v: Vec3) -> Option<Vec3> {
    let largest = v.abs().max_element();
    if !(largest > 0.0 && largest.is_finite() && v.is_finite()) {
        return None;
    }
    let scaled = v / largest;
    Some(scaled / sqrt(scaled.dot(scaled)))
}

/// Two unit vectors that make a right-handed frame (x, y, n) with the unit vector `n`.
///
/// Duff et al., "Building an Orthonormal Basis, Revisited", JCGT 6(1), 2017.
#[inline(always)]
pub fn frame(n: Vec3) -> (Vec3, Vec3) {
    let sign = if n.z.is_sign_negative() { -1.0 } else { 1.0 };
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    (Vec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x), Vec3::new(b, sign + n.y * n.y * a, -n.y))
}

/// The mirror direction of `d` (leaving an observer, arriving at the surface) at a surface of unit normal `n`.
#[inline(always)]
pub fn reflect(d: Vec3, n: Vec3) -> Vec3 {
    d - n * (2.0 * d.dot(n))
}

/// `x`, but at least `low` and at most `high`; NaN stays. Unlike the standard library's without an assertion that low <=
/// high, which would be a panic where it is not inlined.
#[inline]
pub fn clamp(x: f64, low: f64, high: f64) -> f64 {
    if x < low {
        low
    } else if x > high {
        high
    } else {
        x
    }
}

/// `x` in f32, at most its largest: what the kernel makes is far below, but a forged block may hold anything.
#[inline]
pub fn narrow(x: f64) -> f32 {
    clamp(x, f64::from(f32::MIN), f64::from(f32::MAX)) as f32
}

/// Neumaier's compensated sum: error of a few ulp of the result plus `n eps^2` of the terms' absolute sum.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sum {
    high: f64,
    low: f64,
}

impl Sum {
    /// Adds one term.
    #[inline(always)]
    pub fn add(&mut self, x: f64) {
        let t = self.high + x;
        self.low += if fabs(self.high) >= fabs(x) { (self.high - t) + x } else { (x - t) + self.high };
        self.high = t;
    }

    /// The sum so far.
    #[inline(always)]
    pub fn value(self) -> f64 {
        self.high + self.low
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_orthonormal() {
        for n in [Vec3::X, -Vec3::Z, Vec3::Z, Vec3::new(0.6, 0.0, -0.8), Vec3::new(1.0, 2.0, 3.0).normalize()]
        {
            let (x, y) = frame(n);
            for (a, b, want) in [(x, x, 1.0), (y, y, 1.0), (x, y, 0.0), (x, n, 0.0), (y, n, 0.0)] {
                // a dozen roundings of numbers of size 1
                assert!((a.dot(b) - want).abs() < 4e-16, "{n}: {}", a.dot(b));
            }
            assert!((x.cross(y) - n).length() < 1e-15);
        }
    }

    #[test]
    fn compensated_sum_keeps_small_terms() {
        let mut sum = Sum::default();
        for x in [1.0, 1e100, 1.0, -1e100] {
            sum.add(x);
        }
        assert_eq!(sum.value(), 2.0);
    }

    #[test]
    fn unit_survives_extremes() {
        assert_eq!(unit(Vec3::new(0.0, 1e-300, 0.0)), Some(Vec3::Y));
        assert_eq!(unit(Vec3::new(1e300, 0.0, 0.0)), Some(Vec3::X));
        assert_eq!(unit(Vec3::ZERO), None);
        assert_eq!(unit(Vec3::new(f64::NAN, 1.0, 0.0)), None);
    }
}
