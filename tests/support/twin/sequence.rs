//! Random numbers, a low-discrepancy sequence, and means with their standard errors.

/// SplitMix64: Steele, Lea and Flood, "Fast splittable pseudorandom number generators", 2014.
#[derive(Clone, Debug)]
pub struct Rng(pub u64);

impl Rng {
    /// The next 64 bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in [0, 1).
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// A generator of its own for the part `index` of a task.
    pub fn child(&self, index: u64) -> Rng {
        let mut rng = Rng(self.0 ^ index.wrapping_mul(0xd134_2543_de82_ef95));
        Rng(rng.bits())
    }
}

/// Roberts' R sequence in D dimensions (multiples of the powers of a generalised golden ratio, modulo 1) with a
/// random shift, which makes every point uniform on its own.
#[derive(Clone, Debug)]
pub struct Kronecker<const D: usize> {
    step: [f64; D],
    shift: [f64; D],
}

impl<const D: usize> Kronecker<D> {
    /// The sequence of one randomisation.
    pub fn new(rng: &mut Rng) -> Self {
        let mut ratio = 1.5f64; // to the root of x^(D+1) = x + 1
        for _ in 0..64 {
            ratio = (1.0 + ratio).powf(1.0 / (D as f64 + 1.0));
        }
        Self {
            step: std::array::from_fn(|k| ratio.powi(-(k as i32) - 1)),
            shift: std::array::from_fn(|_| rng.unit()),
        }
    }

    /// Its point `index`, in [0, 1)^D.
    pub fn point(&self, index: usize) -> [f64; D] {
        std::array::from_fn(|k| (self.shift[k] + index as f64 * self.step[k]).fract())
    }
}

/// Means, each with its standard error.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimate {
    /// Means over the randomisations.
    pub mean: Vec<f64>,
    /// Their standard errors, from the spread of the randomisations.
    pub standard_error: Vec<f64>,
}

/// The means of what `run` yields over `randomisations` independent generators derived from `seed` (at least 2).
pub fn estimate(randomisations: usize, seed: u64, mut run: impl FnMut(Rng) -> Vec<f64>) -> Estimate {
    assert!(randomisations >= 2);
    let runs: Vec<Vec<f64>> = (0..randomisations).map(|r| run(Rng(seed).child(r as u64))).collect();
    let n = randomisations as f64;
    let mean: Vec<f64> = (0..runs[0].len()).map(|k| runs.iter().map(|r| r[k]).sum::<f64>() / n).collect();
    let error = |k: usize| {
        let squares: f64 = runs.iter().map(|r| (r[k] - mean[k]).powi(2)).sum();
        (squares / (n * (n - 1.0))).sqrt()
    };
    Estimate { standard_error: (0..mean.len()).map(error).collect(), mean }
}
