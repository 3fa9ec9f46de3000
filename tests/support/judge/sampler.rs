//! Low-discrepancy points of any number of dimensions: Sobol's sequence in sets of four, scrambled and shuffled.
//!
//! This work is based on B. Burley, "Practical Hash-based Owen Scrambling", JCGT 9(4), 2020, with the permutation of
//! S. Laine and T. Karras (2011) in N. Vegdahl's constants and the direction numbers of Joe and Kuo (2008).

/// Degree, coefficients and first direction numbers of Sobol's dimensions 1 to 3; dimension 0 is van der Corput's.
const POLYNOMIALS: [(usize, u32, [u32; 3]); 3] = [(1, 0, [1, 0, 0]), (2, 1, [1, 3, 0]), (3, 1, [1, 3, 1])];

/// Direction numbers, (dimension, bit of the index).
static DIRECTIONS: [[u32; 32]; 4] = directions();

const fn directions() -> [[u32; 32]; 4] {
    let mut v = [[0u32; 32]; 4];
    let mut i = 0;
    while i < 32 {
        v[0][i] = 1 << (31 - i);
        i += 1;
    }
    let mut d = 1;
    while d < 4 {
        let (degree, coefficients, first) = POLYNOMIALS[d - 1];
        let mut i = 0;
        while i < 32 {
            if i < degree {
                v[d][i] = first[i] << (31 - i);
            } else {
                let mut x = v[d][i - degree] ^ (v[d][i - degree] >> degree);
                let mut k = 1;
                while k < degree {
                    if (coefficients >> (degree - 1 - k)) & 1 == 1 {
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

/// A well-mixed number of two.
pub fn mix(a: u32, b: u32) -> u32 {
    let mut z = (u64::from(a) << 32 | u64::from(b)).wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    (z ^ (z >> 31)) as u32
}

/// Owen's scramble: every bit is flipped or not by a hash of the bits above it.
fn scramble(x: u32, seed: u32) -> u32 {
    let mut x = x.reverse_bits();
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^= x.wrapping_mul(0x53a2_2864);
    x.reverse_bits()
}

/// Point `index` of the sequence that `seed` names: each power of 2 of points, from the first on, is well spread.
#[derive(Clone, Copy, Debug)]
pub struct Sampler {
    /// Names the sequence; sequences of different seeds are independent.
    pub seed: u32,
    /// Which point, below 65,536.
    pub index: u32,
}

impl Sampler {
    /// The coordinates 4 `set` to 4 `set` + 3, in [0, 1). Those of one set are well spread together.
    pub fn four(&self, set: u32) -> [f64; 4] {
        let seed = mix(self.seed, set);
        // sixteen bits of the index are permuted among themselves, so that sets are independent
        let index = scramble(self.index << 16, mix(seed, 4)) >> 16;
        std::array::from_fn(|d| {
            let (mut x, mut rest) = (0, index);
            while rest != 0 {
                x ^= DIRECTIONS[d][rest.trailing_zeros() as usize];
                rest &= rest - 1;
            }
            f64::from(scramble(x, mix(seed, d as u32))) / 4_294_967_296.0
        })
    }
}
