//! Radiance of a sky summed over many directions at once.

use super::{Model, Sky};
use crate::index::IndexMut;
use crate::math::Vec3;
use crate::octahedron::{self, SKY_BITS};
use crate::scene::MAX_BANDS;
use crate::simd::{self, Isa, LaneTask, Lanes};

impl Sky<'_> {
    /// Sum of the radiance per band over directions packed in twice [`SKY_BITS`] bits, into `out`.
    ///
    /// As good as [`Sky::radiance`] of each, to some ulp of the sum.
    pub fn sum(&self, packed: &[u32], isa: Isa, out: &mut [f64]) {
        let rays = packed.len() as f64;
        if self.is_uniform() {
            return self.combine(rays, 0.0, out);
        }
        let heights = || simd::run_lanes(isa, Heights { packed, up: self.up });
        match &self.model {
            Model::Uniform => {}
            Model::Hemisphere => {
                let Sums { above, .. } = heights();
                self.combine(above, rays - above, out);
            }
            Model::Overcast => {
                let Sums { above, high, .. } = heights();
                self.combine((above + 2.0 * high) / 3.0, rays - above, out);
            }
            Model::Gradient => {
                let Sums { all, .. } = heights();
                self.combine(0.5 * (rays + all), 0.5 * (rays - all), out);
            }
            Model::Cie(cie) => {
                let (mut above, mut sum) = (0.0, 0.0);
                for direction in packed.iter().map(unpack) {
                    let height = direction.dot(self.up);
                    if height >= 0.0 {
                        above += 1.0;
                        sum += cie.relative_radiance(direction, height);
                    }
                }
                self.combine(sum, rays - above, out);
            }
            Model::Table(_) => {
                let mut own = [0.0; MAX_BANDS];
                let own = own.head_mut(out.len());
                out.fill(0.0);
                for direction in packed.iter().map(unpack) {
                    self.radiance(direction, own);
                    out.iter_mut().zip(&*own).for_each(|(sum, radiance)| *sum += radiance);
                }
            }
        }
    }
}

fn unpack(packed: &u32) -> Vec3 {
    octahedron::unpack::<SKY_BITS>(u64::from(*packed))
}

/// Of many directions: how many are not below the horizon, the sum of their heights, and of all.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Sums {
    above: f64,
    high: f64,
    all: f64,
}

/// Lanes: sums are those of so many interleaved parts, whatever the instruction set.
const N: usize = 4;

/// The heights of packed directions over a horizon.
struct Heights<'a> {
    packed: &'a [u32],
    up: Vec3,
}

impl LaneTask for Heights<'_> {
    type Out = Sums;

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) -> Sums {
        let mut sums = [[0.0; N]; 3];
        let (chunks, rest) = self.packed.as_chunks::<N>();
        for packed in chunks {
            let heights = self.heights(lanes, packed);
            for i in 0..N {
                let above = heights[i] >= 0.0;
                sums[0][i] += if above { 1.0 } else { 0.0 };
                sums[1][i] += if above { heights[i] } else { 0.0 };
                sums[2][i] += heights[i];
            }
        }
        if !rest.is_empty() {
            let mut packed = [0; N];
            packed.iter_mut().zip(rest).for_each(|(to, from)| *to = *from);
            let heights = self.heights(lanes, &packed);
            for i in 0..rest.len().min(N) {
                let above = heights[i] >= 0.0;
                sums[0][i] += if above { 1.0 } else { 0.0 };
                sums[1][i] += if above { heights[i] } else { 0.0 };
                sums[2][i] += heights[i];
            }
        }
        let [above, high, all] = sums.map(|[a, b, c, d]| (a + b) + (c + d));
        Sums { above, high, all }
    }
}

impl Heights<'_> {
    #[inline(always)]
    fn heights<L: Lanes>(&self, lanes: L, packed: &[u32; N]) -> [f64; N] {
        let (mut dots, mut squares) = ([0.0; N], [0.0; N]);
        for i in 0..N {
            let (x, y, z) = octahedron::unscaled(packed[i]);
            dots[i] = x * self.up.x + y * self.up.y + z * self.up.z;
            squares[i] = x * x + y * y + z * z;
        }
        let lengths = lanes.roots4(squares);
        for i in 0..N {
            dots[i] /= lengths[i];
        }
        dots
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sky::{SkyInput, SkyModel, SkyTable};

    #[test]
    fn a_sum_is_that_of_the_directions_with_any_instructions() {
        let samples: [f32; 12] = core::array::from_fn(|i| 0.5 + (i as f32 * 0.37) % 1.0);
        let table = SkyTable { rows: 2, columns: 3, bands: 2, radiance: &samples, azimuth_zero: None };
        let cie = SkyModel::Cie { kind: 12, sun_direction: [0.3, 0.1, 0.8] };
        let models = [
            SkyModel::Uniform,
            SkyModel::Hemisphere,
            SkyModel::Overcast,
            SkyModel::Gradient,
            cie,
            SkyModel::Table(table),
        ];
        for model in models {
            let input = SkyInput { model, radiance: &[1.0, 0.4], ground: &[0.2, 0.7], up: [0.2, -0.1, 1.0] };
            let sky = Sky::new(&input, 2).unwrap();
            for count in [1, 3, 4, 5, 23] {
                let mut packed = [0; 23];
                for (i, packed) in packed.iter_mut().enumerate() {
                    let (a, b) = (i as f64 * 0.618, i as f64 * 1.755);
                    let d = Vec3::new(a.sin() * b.cos(), a.sin() * b.sin(), a.cos());
                    *packed = octahedron::pack::<SKY_BITS>(d) as u32;
                }
                let packed = &packed[..count];
                let (mut wanted, mut own) = ([0.0; 2], [0.0; 2]);
                for direction in packed.iter().map(unpack) {
                    sky.radiance(direction, &mut own);
                    (0..2).for_each(|band| wanted[band] += own[band]);
                }
                let (mut wide, mut plain) = ([f64::NAN; 2], [f64::NAN; 2]);
                sky.sum(packed, Isa::detect(), &mut wide);
                sky.sum(packed, Isa::BASELINE, &mut plain);
                assert_eq!(wide, plain, "{model:?}");
                for (sum, wanted) in wide.iter().zip(wanted) {
                    // some roundings of each of 23 terms
                    assert!((sum - wanted).abs() < 1e-13 * wanted, "{model:?}: {sum} {wanted}");
                }
            }
        }
    }
}
