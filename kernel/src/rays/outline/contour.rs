//! Lambert's contour sum over the outlines above a point: the sum of the form factors of all counted facets.

use super::candidates::{Active, Frame};
use super::{Basis, Block, OUTLINE_HEIGHT_SLACK};
use crate::base::math::{PI, TAU, asin};
use crate::base::simd::{Isa, Lanes64, WIDTH, Wide, WideTask, run_wide, spread, wide_dot};
use crate::form_factor::angle::{lambert_term, wide_angle};

/// Irradiance over pi where nothing stands, for each part of a basis.
pub(super) fn whole(frame: &Frame, basis: Basis) -> [f64; 4] {
    if basis == Basis::Whole {
        return [1.0, 0.0, 0.0, 0.0];
    }
    let (x, z) = frame.zenith;
    let near = (z * PI + 2.0 * x + z * (PI - 2.0 * asin(x.min(1.0)))) / (3.0 * PI);
    // the zenith of the near side may be below the horizon
    let sign = if frame.above { 1.0 } else { -1.0 };
    [1.0, sign * z * 2.0 / 3.0, 0.5 * (1.0 + z), sign * near]
}

/// Finds the outlines from a point that rise above its plane; how many, and whether they are of one body.
pub(super) fn sweep(
    isa: Isa,
    frame: &Frame,
    blocks: &[Block],
    both: bool,
    active: &mut [Active],
) -> (usize, bool) {
    run_wide(isa, Sweep { frame, blocks, back: if both { 1.0 } else { 0.0 }, active })
}

struct Sweep<'a> {
    frame: &'a Frame,
    blocks: &'a [Block],
    /// Weight of the backs of bodies with a rim.
    back: f64,
    active: &'a mut [Active],
}

impl WideTask for Sweep<'_> {
    type Out = (usize, bool);

    #[inline(always)]
    fn run<L: Lanes64>(self, lanes: L) -> (usize, bool) {
        let Sweep { frame, blocks, back, active } = self;
        let back = lanes.all(back);
        let p = spread(lanes, frame.point);
        let axes = [spread(lanes, frame.axes[0]), spread(lanes, frame.axes[1]), spread(lanes, frame.axes[2])];
        let (zero, one, slack) = (lanes.all(0.0), lanes.all(1.0), lanes.all(OUTLINE_HEIGHT_SLACK));
        let (mut count, mut body, mut alone) = (0, f64::NAN, true);
        for block in blocks {
            let row = |k: usize| lanes.of(&block[k]);
            let first = (wide_dot(&p, &[row(6), row(7), row(8)]) - row(9)).gt(zero);
            let other = (wide_dot(&p, &[row(10), row(11), row(12)]) - row(13)).gt(zero);
            let minus = zero - one;
            let jump = row(14) * one.where_else(first, minus) + row(15) * one.where_else(other, minus);
            let outline = L::F::bits(jump.abs().gt(zero));
            if outline == 0 {
                continue;
            }
            let counted = row(14) * one.where_else(first, zero - back * row(16))
                + row(15) * one.where_else(other, zero - back * row(17));
            let a = [row(0) - p[0], row(1) - p[1], row(2) - p[2]];
            let b = [row(3) - p[0], row(4) - p[1], row(5) - p[2]];
            let (az, bz) = (wide_dot(&axes[2], &a), wide_dot(&axes[2], &b));
            let mut kept = outline & L::F::bits(az.max(bz).gt(slack));
            if kept == 0 {
                continue;
            }
            // no closures: they would be compiled for no instruction set
            let rows = [
                wide_dot(&axes[0], &a).array(),
                wide_dot(&axes[1], &a).array(),
                az.array(),
                wide_dot(&axes[0], &b).array(),
                wide_dot(&axes[1], &b).array(),
                bz.array(),
                jump.array(),
                counted.array(),
            ];
            while kept != 0 {
                let lane = kept.trailing_zeros() as usize % WIDTH;
                kept &= kept - 1;
                let Some(to) = active.get_mut(count / WIDTH) else { return (count, alone) };
                for (to, from) in to.iter_mut().zip(&rows) {
                    to[count % WIDTH] = from[lane];
                }
                count += 1;
                alone &= body.is_nan() || body == block[18][lane];
                body = block[18][lane];
            }
        }
        if let Some(rest) = active.get_mut(count / WIDTH) {
            for lane in count % WIDTH..WIDTH {
                rest.iter_mut().for_each(|row| row[lane] = 0.0);
            }
        }
        (count, alone)
    }
}

/// The angle of a direction, -pi to pi.
#[inline(always)]
fn azimuth<L: Lanes64>(lanes: L, y: L::F, x: L::F) -> L::F {
    let (zero, angle) = (lanes.all(0.0), wide_angle(lanes, y.abs(), x));
    angle.where_else(y.gt(zero), zero - angle)
}

/// Of length 1; zero stays.
#[inline(always)]
fn unit<L: Lanes64>(lanes: L, [x, y, z]: [L::F; 3]) -> [L::F; 3] {
    let length = (x * x + y * y + z * z).sqrt().max(lanes.all(1e-30));
    [x / length, y / length, z / length]
}

/// Sum over the outlines, beside the facets over the pole, each part of the basis over pi.
pub(super) struct Contour<'a> {
    pub frame: &'a Frame,
    pub basis: Basis,
    pub active: &'a [Active],
}

impl WideTask for Contour<'_> {
    type Out = [f64; 4];

    #[inline(always)]
    fn run<L: Lanes64>(self, lanes: L) -> [f64; 4] {
        let Contour { frame, basis, active } = self;
        let mut sums = [0.0; 4];
        for block in active {
            let terms = match basis {
                Basis::Whole => {
                    let arc = Arc::new(lanes, block);
                    let term = arc.counted * (arc.turn(lanes) - arc.swept(lanes));
                    [term, lanes.all(0.0), lanes.all(0.0), lanes.all(0.0)]
                }
                Basis::Horizon(_) => horizon(lanes, frame, block),
            };
            for (sum, term) in sums.iter_mut().zip(terms) {
                // a fixed tree, as on every instruction set
                let [a, b, c, d, e, f, g, h] = term.array();
                *sum += ((a + b) + (c + d)) + ((e + f) + (g + h));
            }
        }
        let sign = if frame.above { 1.0 } else { -1.0 };
        let sums = sums.map(|sum| sum / TAU);
        [sums[0], sign * sums[1], sums[2], sign * sums[3]]
    }
}

/// An outline above the horizon, from its lower end to its upper.
#[derive(Clone, Copy)]
struct Arc<F: Wide> {
    a: [F; 3],
    b: [F; 3],
    /// Positive where it goes counter-clockwise about the pole.
    sense: F,
    counted: F,
}

impl<F: Wide> Arc<F> {
    #[inline(always)]
    fn new<L: Lanes64<F = F>>(lanes: L, block: &Active) -> Arc<F> {
        let row = |k: usize| lanes.of(&block[k]);
        let (a, b) = ([row(0), row(1), row(2)], [row(3), row(4), row(5)]);
        let sense = a[0] * b[1] - a[1] * b[0];
        let whole = Arc { a, b, sense, counted: row(7) };
        whole.above(lanes, a[2], b[2])
    }

    /// The part where the height, `first` and `last` at the ends, is not negative.
    #[inline(always)]
    fn above<L: Lanes64<F = F>>(self, lanes: L, first: F, last: F) -> Arc<F> {
        let zero = lanes.all(0.0);
        let (low, other) = (zero.gt(first), zero.gt(last));
        let t = first / (first - last);
        let (mut a, mut b) = (self.a, self.b);
        for k in 0..3 {
            let cut = self.a[k] + (self.b[k] - self.a[k]) * t;
            a[k] = cut.where_else(low, self.a[k]);
            b[k] = cut.where_else(other, self.b[k]);
        }
        Arc { a, b, ..self }
    }

    #[inline(always)]
    fn cross(&self) -> [F; 3] {
        let ([ax, ay, az], [bx, by, bz]) = (self.a, self.b);
        [ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx]
    }

    #[inline(always)]
    fn signed<L: Lanes64<F = F>>(&self, lanes: L, x: F) -> F {
        let zero = lanes.all(0.0);
        x.where_else(self.sense.gt(zero), zero - x)
    }

    /// Angle about the pole.
    #[inline(always)]
    fn turn<L: Lanes64<F = F>>(&self, lanes: L) -> F {
        let [_, _, z] = self.cross();
        let dot = self.a[0] * self.b[0] + self.a[1] * self.b[1];
        self.signed(lanes, wide_angle(lanes, z.abs(), dot))
    }

    /// Integral of the square of the sine of the angle from the pole over the angle about it: Lambert's term.
    #[inline(always)]
    fn swept<L: Lanes64<F = F>>(&self, lanes: L) -> F {
        let [x, y, z] = self.cross();
        let sine = (x * x + y * y + z * z).sqrt();
        let cosine = self.a[0] * self.b[0] + self.a[1] * self.b[1] + self.a[2] * self.b[2];
        self.signed(lanes, lambert_term(lanes, sine, cosine, z.abs()))
    }

    /// As the open irradiance of an arc, of a radiance that rises as the height of the direction: `x`, `z` point to the
    /// zenith; a factor of 2/3 is left out.
    #[inline(always)]
    fn lifted<L: Lanes64<F = F>>(self, lanes: L, (x, z): (F, F)) -> F {
        let (one, least) = (lanes.all(1.0), lanes.all(1e-30));
        let own = Arc { a: unit(lanes, self.a), b: unit(lanes, self.b), ..self };
        let cross = own.cross()[2].abs();
        let dot = own.a[0] * own.b[0] + own.a[1] * own.b[1] + own.a[2] * own.b[2];
        let beside = (one + dot).max(least);
        let height = x * (own.a[0] + own.b[0]) + z * (own.a[2] + own.b[2]);
        // the spherical triangle with the pole
        let excess = wide_angle(lanes, cross, one + dot + own.a[2] + own.b[2]);
        self.signed(lanes, cross * height / beside + z * (excess + excess))
    }
}

/// Antiderivatives by the angle about the pole of what lies between the pole and the nearer of both horizons, at a place.
struct Rim<F: Wide> {
    /// The angle, from -pi/2 on.
    angle: F,
    sine: F,
    /// Of the radiance 1 and of the height, on the near side.
    near: [F; 2],
}

impl<F: Wide> Rim<F> {
    #[inline(always)]
    fn new<L: Lanes64<F = F>>(lanes: L, place: [F; 3], (x, z): (F, F)) -> Rim<F> {
        let (zero, half) = (lanes.all(0.0), lanes.all(0.5 * PI));
        let [px, py, _] = place;
        let radius = (px * px + py * py).sqrt().max(lanes.all(1e-300));
        let sine = py / radius;
        let straight = azimuth(lanes, py, px);
        let angle = (straight + lanes.all(TAU)).where_else((zero - half).gt(straight), straight);
        let far = zero.gt(px);
        // beyond a right angle, counted from its middle
        let middle = azimuth(lanes, zero - z * py, zero - px);
        let arc = zero - x * sine;
        let root = (lanes.all(1.0) - arc * arc).max(zero).sqrt();
        let rest = azimuth(lanes, arc, root) + azimuth(lanes, x, (lanes.all(1.0) - x * x).max(zero).sqrt());
        let thirds = lanes.all(2.0 / 3.0);
        let near = [
            (half + z * (middle + half)).where_else(far, angle),
            (thirds * (z * half + x) + thirds * z * (angle - half - rest))
                .where_else(far, thirds * (z * angle + x * sine)),
        ];
        Rim { angle, sine, near }
    }
}

/// The terms of all parts of a basis with a horizon.
#[inline(always)]
fn horizon<L: Lanes64>(lanes: L, frame: &Frame, block: &Active) -> [L::F; 4] {
    let zenith = (lanes.all(frame.zenith.0), lanes.all(frame.zenith.1));
    let (zero, thirds) = (lanes.all(0.0), lanes.all(2.0 / 3.0));
    let arc = Arc::new(lanes, block);
    let (a, b) = (Rim::new(lanes, arc.a, zenith), Rim::new(lanes, arc.b, zenith));
    let turn = arc.turn(lanes);
    let whole = [
        turn - arc.swept(lanes),
        thirds * (zenith.1 * turn + zenith.0 * (b.sine - a.sine)) - thirds * arc.lifted(lanes, zenith),
    ];
    // the part on the near side of the horizon
    let first = zenith.0 * arc.a[0] + zenith.1 * arc.a[2];
    let last = zenith.0 * arc.b[0] + zenith.1 * arc.b[2];
    let below = L::F::bits(zero.gt(first)) | L::F::bits(zero.gt(last));
    let (near, a, b) = if below == 0 {
        (arc, a, b)
    } else {
        let near = arc.above(lanes, first, last);
        (near, Rim::new(lanes, near.a, zenith), Rim::new(lanes, near.b, zenith))
    };
    let none = zero.gt(first.max(last));
    // once about the pole
    let (x, z) = frame.zenith;
    let round = [PI + PI * z, (z * PI + 2.0 * x + z * (PI - 2.0 * asin(x.min(1.0)))) * (2.0 / 3.0)];
    let raw = b.angle - a.angle;
    let half = lanes.all(0.5 * PI);
    let counter = near.sense.gt(zero);
    let swept = [near.swept(lanes), thirds * near.lifted(lanes, zenith)];
    let mut terms = [arc.counted * whole[0], arc.counted * whole[1], zero, zero];
    for k in 0..2 {
        let step = b.near[k] - a.near[k];
        let once = lanes.all(round[k]);
        // over the place where the angle starts
        let forth = (step + once).where_else((zero - half).gt(raw), step);
        let back = (step - once).where_else(raw.gt(half), step);
        let step = forth.where_else(counter, back);
        terms[2 + k] = arc.counted * zero.where_else(none, step - swept[k]);
    }
    terms
}
