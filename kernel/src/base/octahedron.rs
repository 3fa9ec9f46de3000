//! Directions in few bits, by the octahedron.

use crate::base::math::{Vec3, fabs};

/// Bits of each coordinate of a direction to the sky: error below 6.6e-5 rad, and about none on the mean of many.
pub const SKY_BITS: u32 = 16;

/// A unit vector in twice `BITS` bits (at most 31 each), to within 4.3 times 2^-BITS rad.
pub fn pack<const BITS: u32>(d: Vec3) -> u64 {
    let sum = fabs(d.x) + fabs(d.y) + fabs(d.z);
    let (mut x, mut y) = (d.x / sum, d.y / sum);
    if d.z < 0.0 {
        (x, y) = (fold(x, y), fold(y, x));
    }
    let step = |a: f64| ((a + 1.0) * 0.5 * steps(BITS) + 0.5) as u64;
    step(x) << BITS | step(y)
}

/// The unit vector that was packed.
pub fn unpack<const BITS: u32>(p: u64) -> Vec3 {
    let mask = (1u64 << BITS) - 1;
    let back = |s: u64| (s & mask) as f64 / steps(BITS) * 2.0 - 1.0;
    let (mut x, mut y) = (back(p >> BITS), back(p));
    let z = 1.0 - fabs(x) - fabs(y);
    if z < 0.0 {
        (x, y) = (fold(x, y), fold(y, x));
    }
    Vec3::new(x, y, z).normalize()
}

/// How many steps there are from one side of the square to the other: an even number, so that the axes are among them.
pub fn steps(bits: u32) -> f64 {
    ((1u64 << bits) - 2) as f64
}

/// The lower half's corner in the square's.
fn fold(a: f64, b: f64) -> f64 {
    (1.0 - fabs(b)) * if a < 0.0 { -1.0 } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check<const BITS: u32>() {
        // half a step in x and y, their sum in z, stretched by at most sqrt 3 on the sphere
        let step = 4.3 / (1u64 << BITS) as f64;
        for i in 0..2000 {
            let (a, b) = (f64::from(i) * 0.618, f64::from(i) * 0.755);
            let d = Vec3::new(a.sin(), b.cos() * a.cos(), b.sin() * a.cos()).normalize();
            let back = unpack::<BITS>(pack::<BITS>(d));
            assert!((back - d).length() < step && pack::<BITS>(d) < 1 << (2 * BITS), "{d} {back}");
        }
        for d in [Vec3::X, Vec3::Y, Vec3::Z, -Vec3::X, -Vec3::Y, -Vec3::Z] {
            assert!((unpack::<BITS>(pack::<BITS>(d)) - d).length() < 1e-15);
        }
    }

    #[test]
    fn packed_directions_come_back() {
        check::<SKY_BITS>();
        check::<31>();
    }
}
