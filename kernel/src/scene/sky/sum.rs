//! Radiance of a sky summed over many directions at once.
//!
//! Constants of this file are measured by `cargo test --test sky` (errors of sums).

use super::{Model, Sky};
use crate::base::index::IndexMut;
use crate::base::math::Vec3;
use crate::base::octahedron::{self, SKY_BITS};
use crate::base::simd::Lanes;
use crate::scene::MAX_BANDS;

impl Sky<'_> {
    /// Sum of the radiance per band over directions packed in twice [`SKY_BITS`] bits, into `out`.
    ///
    /// As good as [`Sky::radiance`] of each, to 1e-6 of the sum.
    #[cfg_attr(target_pointer_width = "32", inline(never))]
    #[cfg_attr(not(target_pointer_width = "32"), inline(always))]
    pub(crate) fn sum<L: Lanes>(&self, lanes: L, packed: &[u32], out: &mut [f64]) {
        let rays = packed.len() as f64;
        if matches!(self.model, Model::Cie(_) | Model::Table(_)) {
            return self.sum_one_by_one(packed, out);
        }
        let (sky, ground) = if self.is_uniform() {
            (rays, 0.0)
        } else {
            let Sums { above, high, all } = heights(lanes, packed, self.up);
            match &self.model {
                Model::Overcast => ((above + 2.0 * high) / 3.0, rays - above),
                Model::Gradient => (0.5 * (rays + all), 0.5 * (rays - all)),
                _ => (above, rays - above),
            }
        };
        self.combine(sky, ground, out);
    }

    #[inline(never)]
    fn sum_one_by_one(&self, packed: &[u32], out: &mut [f64]) {
        let directions = packed.iter().map(|packed| octahedron::unpack::<SKY_BITS>(u64::from(*packed)));
        if let Model::Cie(cie) = &self.model {
            let (mut above, mut sum) = (0.0, 0.0);
            for direction in directions {
                let height = direction.dot(self.up);
                if height >= 0.0 {
                    above += 1.0;
                    sum += cie.relative_radiance(direction, height);
                }
            }
            return self.combine(sum, packed.len() as f64 - above, out);
        }
        let mut own = [0.0; MAX_BANDS];
        let own = own.head_mut(out.len());
        out.fill(0.0);
        for direction in directions {
            self.radiance(direction, own);
            out.iter_mut().zip(&*own).for_each(|(sum, radiance)| *sum += radiance);
        }
    }
}

/// Of many directions: how many are not below the horizon, the sum of their heights, and of all.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Sums {
    above: f64,
    high: f64,
    all: f64,
}

/// Lanes: sums are those of this many interleaved parts, whatever the instruction set.
const N: usize = 8;

/// Chunks of directions that are added up in f32; beyond, sums are f64.
const CHUNKS: usize = 16;

/// Sums of the heights of packed directions over the horizon of `up`: in f32, good to 1e-6, as the directions are no
/// better than 6.6e-5.
// apart on small machines: does not burden the stack of other models
#[cfg_attr(target_pointer_width = "32", inline(never))]
#[cfg_attr(not(target_pointer_width = "32"), inline(always))]
fn heights<L: Lanes>(lanes: L, packed: &[u32], up: Vec3) -> Sums {
    let up = [up.x, up.y, up.z].map(|x| lanes.splat8(x as f32));
    let (mut sums, mut parts) = ([0.0; 3], [lanes.splat8(0.0); 3]);
    let (chunks, rest) = packed.as_chunks::<N>();
    for (number, packed) in chunks.iter().enumerate() {
        if number % CHUNKS == CHUNKS - 1 {
            flush(lanes, &mut parts, &mut sums);
        }
        add(lanes, packed, up, 0, &mut parts);
    }
    if !rest.is_empty() {
        // the last eight, of which some have been added; or all there are
        let before = N - rest.len() % N;
        let mut few = [0; N];
        let last = packed.last_chunk::<N>().unwrap_or_else(|| {
            few.iter_mut().skip(before).zip(rest).for_each(|(to, from)| *to = *from);
            &few
        });
        add(lanes, last, up, before, &mut parts);
    }
    flush(lanes, &mut parts, &mut sums);
    let [above, high, all] = sums;
    Sums { above, high, all }
}

/// Adds eight directions but for the first `before`.
#[inline(always)]
fn add<L: Lanes>(lanes: L, packed: &[u32; N], up: [L::F8; 3], before: usize, sums: &mut [L::F8; 3]) {
    const LANE_NUMBERS: [f32; N] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];
    let (zero, steps) = (lanes.splat8(0.0), lanes.splat8(octahedron::steps(SKY_BITS) as f32));
    let negative = |a| lanes.sub8(zero, a);
    // in whole half steps, exactly
    let (x, y) = lanes.halves8(packed);
    let [x, y] = [x, y].map(|a| lanes.sub8(lanes.add8(a, a), steps));
    let sizes = [x, y].map(|a| lanes.max8(a, negative(a)));
    let z = lanes.sub8(lanes.sub8(steps, sizes[0]), sizes[1]);
    // the lower half is folded over the square's edges: by as much as z falls below 0
    let over = lanes.max8(negative(z), zero);
    let [x, y] = [(x, sizes[0]), (y, sizes[1])].map(|(a, size)| {
        let within = lanes.sub8(size, over);
        lanes.choose8(lanes.mask8(zero, a), within, negative(within))
    });
    let dot = |a: [L::F8; 3], b: [L::F8; 3]| {
        let [x, y, z] = [0, 1, 2].map(|i| lanes.mul8(a[i], b[i]));
        lanes.add8(lanes.add8(x, y), z)
    };
    let (direction, keep) = ([x, y, z], lanes.mask8(lanes.splat8(before as f32), lanes.load8(&LANE_NUMBERS)));
    let height = lanes.div8(dot(direction, up), lanes.root8(dot(direction, direction)));
    let above = lanes.mask8(zero, height);
    for (sum, value) in sums.iter_mut().zip([
        lanes.choose8(above, lanes.splat8(1.0), zero),
        lanes.choose8(above, height, zero),
        height,
    ]) {
        *sum = lanes.add8(*sum, if before > 0 { lanes.choose8(keep, value, zero) } else { value });
    }
}

/// Adds up the lanes, and begins anew.
#[inline(always)]
fn flush<L: Lanes>(lanes: L, parts: &mut [L::F8; 3], sums: &mut [f64; 3]) {
    for (sum, part) in sums.iter_mut().zip(parts) {
        let [a, b, c, d, e, f, g, h] = lanes.store8(*part);
        *sum += f64::from(((a + e) + (b + f)) + ((c + g) + (d + h)));
        *part = lanes.splat8(0.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::simd::{self, Isa, LaneTask};
    use crate::scene::sky::{SkyInput, SkyModel, SkyTable};

    struct Sum<'a> {
        sky: &'a Sky<'a>,
        packed: &'a [u32],
        out: &'a mut [f64; 2],
    }

    impl LaneTask for Sum<'_> {
        type Out = ();

        #[inline(always)]
        fn run<L: Lanes>(self, lanes: L) {
            self.sky.sum(lanes, self.packed, self.out);
        }
    }

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
            for count in [1, 3, 8, 9, 600] {
                let mut packed = [0; 600];
                for (i, packed) in packed.iter_mut().enumerate() {
                    let (a, b) = (i as f64 * 0.618, i as f64 * 1.755);
                    let d = Vec3::new(a.sin() * b.cos(), a.sin() * b.sin(), a.cos());
                    *packed = octahedron::pack::<SKY_BITS>(d) as u32;
                }
                let packed = &packed[..count];
                let (mut wanted, mut own) = ([0.0; 2], [0.0; 2]);
                for packed in packed {
                    let direction = octahedron::unpack::<SKY_BITS>(u64::from(*packed));
                    sky.radiance(direction, &mut own);
                    (0..2).for_each(|band| wanted[band] += own[band]);
                }
                let (mut wide, mut plain) = ([f64::NAN; 2], [f64::NAN; 2]);
                simd::run_lanes(Isa::detect(), Sum { sky: &sky, packed, out: &mut wide });
                simd::run_lanes(Isa::BASELINE, Sum { sky: &sky, packed, out: &mut plain });
                assert_eq!(wide, plain, "{model:?}");
                for (sum, wanted) in wide.iter().zip(wanted) {
                    // some roundings in f32 of each term
                    assert!((sum - wanted).abs() < 1e-6 * wanted, "{model:?}: {sum} {wanted}");
                }
            }
        }
    }
}
