//! Deterministic low-discrepancy points: Sobol's sequence with a nested uniform (Owen) scramble.
//!
//! This work is based on: Sobol' 1967, Joe and Kuo 2008 (direction numbers), Owen 1995 (scrambling), Laine and
//! Karras 2011, Burley 2020 and Vegdahl 2021 (scrambling by hash). The error of a mean over n = 2^k points is O(n^-3/2) for
//! smooth integrands and about n^-3/4 where the integrand jumps.

/// Dimensions that one point has.
pub const DIMENSIONS: usize = 6;

/// Primitive polynomial and initial direction numbers of dimensions 1 to 5 (dimension 0 is van der Corput's).
const JOE_KUO: [(u32, u32, [u32; 4]); DIMENSIONS - 1] = [
    (1, 0, [1, 0, 0, 0]),
    (2, 1, [1, 3, 0, 0]),
    (3, 1, [1, 3, 1, 0]),
    (3, 2, [1, 1, 1, 0]),
    (4, 1, [1, 1, 3, 3]),
];

/// Direction numbers of all dimensions, 32 bits each.
const DIRECTIONS: [[u32; 32]; DIMENSIONS] = directions();

const fn directions() -> [[u32; 32]; DIMENSIONS] {
    let mut v = [[0u32; 32]; DIMENSIONS];
    let mut i = 0;
    while i < 32 {
        v[0][i] = 1 << (31 - i);
        i += 1;
    }
    let mut d = 1;
    while d < DIMENSIONS {
        let (degree, a, m) = JOE_KUO[d - 1];
        let s = degree as usize;
        let mut i = 0;
        while i < 32 {
            if i < s {
                v[d][i] = m[i] << (31 - i);
            } else {
                let mut x = v[d][i - s] ^ (v[d][i - s] >> s);
                let mut k = 1;
                while k < s {
                    if (a >> (s - 1 - k)) & 1 == 1 {
                        x ^= v[d][i - k];
                    }
                    k += 1;
                }
                v[d][i] = x;
            }
            i += 1;
        }
        d += 1;
    }
    v
}

/// The same directions summed over each byte of the index, so that a point costs four look-ups.
static BYTES: [[[u32; 256]; 2]; DIMENSIONS] = byte_tables();

const fn byte_tables() -> [[[u32; 256]; 2]; DIMENSIONS] {
    let mut tables = [[[0u32; 256]; 2]; DIMENSIONS];
    let mut d = 0;
    while d < DIMENSIONS {
        let mut byte = 0;
        while byte < 2 {
            let mut value = 0;
            while value < 256 {
                let mut x = 0;
                let mut bit = 0;
                while bit < 8 {
                    if (value >> bit) & 1 == 1 {
                        x ^= DIRECTIONS[d][byte * 8 + bit];
                    }
                    bit += 1;
                }
                tables[d][byte][value] = x;
                value += 1;
            }
            byte += 1;
        }
        d += 1;
    }
    tables
}

/// A 32-bit finaliser with full avalanche (Wellons' "lowbias32").
#[inline(always)]
pub const fn hash(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x7feb_352d);
    x ^= x >> 15;
    x = x.wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

/// Hash of a pair.
#[inline(always)]
pub const fn hash2(a: u32, b: u32) -> u32 {
    hash(a ^ hash(b.wrapping_add(0x9e37_79b9)))
}

/// Owen's scramble: each bit is flipped by a hash of the bits above it.
#[inline(always)]
const fn scramble(x: u32, seed: u32) -> u32 {
    let mut x = x.reverse_bits();
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^= x.wrapping_mul(0x53a2_2864);
    x.reverse_bits()
}

/// One scrambled sequence; two sequences of different seeds are independent.
#[derive(Clone, Copy, Debug)]
pub struct Sequence {
    seeds: [u32; DIMENSIONS],
}

impl Sequence {
    /// The sequence of this seed.
    #[inline(always)]
    pub fn new(seed: u32) -> Sequence {
        let mut seeds = [0; DIMENSIONS];
        for (d, s) in seeds.iter_mut().enumerate() {
            *s = hash2(seed, d as u32);
        }
        Sequence { seeds }
    }

    /// Coordinates `d`, `d + 1` of point `index` (< 65,536), in [0, 1).
    #[inline(always)]
    pub fn pair(&self, index: u32, d: usize) -> (f64, f64) {
        (self.coordinate(index, d), self.coordinate(index, d + 1))
    }

    /// Coordinate `d` of point `index`, in (0, 1): the middle of its cell of 2^-32.
    #[inline(always)]
    pub fn coordinate(&self, index: u32, d: usize) -> f64 {
        let d = d % DIMENSIONS;
        let t = &BYTES[d];
        let x = t[0][(index & 255) as usize] ^ t[1][((index >> 8) & 255) as usize];
        (f64::from(scramble(x, self.seeds[d])) + 0.5) * (1.0 / 4_294_967_296.0)
    }
}

/// The direction, in the frame (x, y, n), of the cosine-weighted hemisphere: Malley's method over Shirley and
/// Chiu's concentric map.
#[inline(always)]
pub fn cosine_direction(u: f64, v: f64) -> (f64, f64, f64) {
    let (x, y) = disc(u, v);
    let z = 1.0 - x * x - y * y;
    (x, y, crate::base::math::sqrt(if z > 1e-12 { z } else { 1e-12 }))
}

/// The unit square mapped to the unit disc with equal areas (Shirley and Chiu 1997).
#[inline(always)]
pub fn disc(u: f64, v: f64) -> (f64, f64) {
    let (a, b) = (2.0 * u - 1.0, 2.0 * v - 1.0);
    if a == 0.0 && b == 0.0 {
        return (0.0, 0.0);
    }
    let quarter = core::f64::consts::FRAC_PI_4;
    if crate::base::math::fabs(a) > crate::base::math::fabs(b) {
        let (s, c) = quarter_sin_cos(quarter * (b / a));
        (a * c, a * s)
    } else {
        let (s, c) = quarter_sin_cos(quarter * (a / b));
        (b * s, b * c)
    }
}

/// Sine and cosine for |x| <= pi/4: Taylor series, error below 1e-13.
#[inline(always)]
fn quarter_sin_cos(x: f64) -> (f64, f64) {
    let q = x * x;
    let s = x
        * (1.0
            - q / 6.0
                * (1.0
                    - q / 20.0
                        * (1.0 - q / 42.0 * (1.0 - q / 72.0 * (1.0 - q / 110.0 * (1.0 - q / 156.0))))));
    let c = 1.0
        - q / 2.0
            * (1.0
                - q / 12.0
                    * (1.0
                        - q / 30.0
                            * (1.0 - q / 56.0 * (1.0 - q / 90.0 * (1.0 - q / 132.0 * (1.0 - q / 182.0))))));
    (s, c)
}

/// The unit square mapped to barycentric weights of corners 1 and 2 with equal areas (Heitz 2019: no crease on
/// the diagonal that a square root would bring, low distortion).
#[inline(always)]
pub fn triangle(u: f64, v: f64) -> (f64, f64) {
    if v > u { (0.5 * u, v - 0.5 * u) } else { (u - 0.5 * v, 0.5 * v) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every elementary interval of a (0, 2)-sequence holds exactly its share of the first 2^k points.
    #[test]
    fn pairs_are_stratified() {
        for seed in 0..4 {
            let sequence = Sequence::new(seed);
            for split in 0..=8 {
                let (columns, rows) = (1usize << split, 1usize << (8 - split));
                let mut count = [0u8; 256];
                for i in 0..256 {
                    let (x, y) = sequence.pair(i, 0);
                    count[(x * columns as f64) as usize * rows + (y * rows as f64) as usize] += 1;
                }
                assert!(count.iter().all(|&c| c == 1), "seed {seed}, {columns} x {rows}");
            }
        }
    }

    #[test]
    fn every_dimension_is_stratified() {
        let sequence = Sequence::new(7);
        for d in 0..DIMENSIONS {
            let mut count = [0u8; 256];
            (0..256).for_each(|i| count[(sequence.coordinate(i, d) * 256.0) as usize] += 1);
            assert!(count.iter().all(|&c| c == 1), "dimension {d}");
        }
    }

    #[test]
    fn series_match_libm() {
        for i in -100..=100 {
            let x = f64::from(i) / 100.0 * core::f64::consts::FRAC_PI_4;
            let (s, c) = quarter_sin_cos(x);
            // the first term left out is below 1e-14
            assert!((s - libm::sin(x)).abs() < 1e-13 && (c - libm::cos(x)).abs() < 1e-13);
        }
    }

    #[test]
    fn maps_keep_area() {
        let sequence = Sequence::new(3);
        let n = 4096;
        let (mut z, mut r2, mut bary) = (0.0, 0.0, [0.0; 2]);
        for i in 0..n {
            let (u, v) = sequence.pair(i, 0);
            z += cosine_direction(u, v).2 / f64::from(n);
            let (x, y) = disc(u, v);
            r2 += (x * x + y * y) / f64::from(n);
            let (a, b) = triangle(u, v);
            assert!(a >= 0.0 && b >= 0.0 && a + b <= 1.0);
            bary[0] += a / f64::from(n);
            bary[1] += b / f64::from(n);
        }
        // means over 4,096 points of functions with creases (the maps' diagonals): about n^-5/4 = 3e-5, three times that
        assert!((z - 2.0 / 3.0).abs() < 1e-4 && (r2 - 0.5).abs() < 1e-4);
        assert!((bary[0] - 1.0 / 3.0).abs() < 1e-4 && (bary[1] - 1.0 / 3.0).abs() < 1e-4);
    }
}
