//! The lobe of directional-diffuse ("glossy") reflection: Kholopov's ellipsoid through the reflection point,
//! long axis along the mirror direction.
//!
//! With T the axis ratio and alpha the angle to the mirror direction,
//! q = rho_0 C cos(alpha)/(cos^2 alpha + T^2 sin^2 alpha) for alpha < 90 degrees, C = (T^2 - 1)/(pi ln T^2), and
//! zero below the facet. q has no incidence cosine; over the whole half space around the mirror direction it
//! integrates to rho_0, over the part above the facet to the albedo A(theta).
//!
//! In the plane that touches the sphere of directions at the mirror direction, p = tan(alpha), the lobe has
//! the radial density C/((1 + p^2)(1 + T^2 p^2)), and what lies above the facet is the half plane
//! x > -cot(theta). Along x the density integrates to closed forms, with which everything here works:
//! F(x) = 1/2 + (asinh(T x) - asinh(x))/(2 ln T) is the energy below x, A(theta)/rho_0 = F(cot theta).
//!
//! Constants of this file are measured by `cargo test --test lobe` (errors).

use crate::base::error::{Error, Field};
use crate::base::math::{
    FRAC_PI_2, PI, TAU, Vec3, asin, atan, clamp, cos, exp, fabs, floor, frame, log, sin, sqrt,
};
use crate::base::quadrature::rule;
use crate::scene::MIRROR_AXIS_RATIO;
use crate::scene::sun::Sun;

/// The golden ratio's fraction: azimuth step, in turns, of a sunflower's seeds.
const SUNFLOWER_STEP: f64 = 0.618_033_988_749_894_8;

/// Rays and samples keep at least this cosine to the facet's normal.
const LEAST_COSINE: f64 = 1e-9;

/// A lobe of a given axis ratio, for a reflectance rho_0 of 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lobe {
    ratio: f64,
    /// ln(ratio).
    log_ratio: f64,
    /// ln(ratio)/(ratio - 1).
    log_slope: f64,
    /// C.
    peak: f64,
}

impl Lobe {
    /// A lobe of long over short axis `axis_ratio` >= 1: at 1 it is cos(alpha)/pi; from 1e4 on it counts as
    /// an ideal mirror ([`Lobe::is_mirror`]) and is kept at 1e4.
    ///
    /// # Errors
    /// [`Error::Range`] where it is below 1 or not finite.
    pub fn new(axis_ratio: f64) -> Result<Lobe, Error> {
        if !(axis_ratio >= 1.0 && axis_ratio.is_finite()) {
            return Err(Error::Range { field: Field::AxisRatio, band: 0, value: axis_ratio });
        }
        let ratio = axis_ratio.min(MIRROR_AXIS_RATIO);
        let log_ratio = log(ratio);
        Ok(Lobe { ratio, log_ratio, log_slope: log_slope(ratio - 1.0), peak: growth(2.0 * log_ratio) / PI })
    }

    /// Long over short axis.
    pub fn ratio(&self) -> f64 {
        self.ratio
    }

    /// Whether the lobe is so narrow that the caller treats it as an ideal mirror.
    pub fn is_mirror(&self) -> bool {
        self.ratio >= MIRROR_AXIS_RATIO
    }

    /// q/rho_0 in sr-1 by the cosine of the angle to the mirror direction; 0 where that is not positive. The
    /// caller leaves out directions below the facet. One division; a few ulp, times T^2 at most next to the
    /// peak, where the cosine does not resolve the angle.
    #[inline]
    pub fn value(&self, cos_alpha: f64) -> f64 {
        if cos_alpha <= 0.0 {
            return 0.0;
        }
        let sin2 = ((1.0 - cos_alpha) * (1.0 + cos_alpha)).max(0.0);
        self.peak * cos_alpha / (1.0 + (self.ratio * self.ratio - 1.0) * sin2)
    }

    /// A(theta)/rho_0, by the cosine of the angle between mirror direction and normal: the integral of q/rho_0
    /// over the directions above the facet, in 0..=1. Closed form, 1e-15; one square root and one logarithm.
    #[inline]
    pub fn albedo(&self, cos_theta: f64) -> f64 {
        let c = fabs(cos_theta).min(1.0);
        // ln[(T c + sqrt(1 + (T^2 - 1) c^2))/(1 + c)]/ln T, arranged for T next to 1
        let excess = self.ratio - 1.0;
        let root = sqrt(1.0 + excess * (self.ratio + 1.0) * c * c);
        let rise = (c + (self.ratio + 1.0) * c * c / (1.0 + root)) / (1.0 + c);
        let half = 0.5 * rise * log_slope(rise * excess) / self.log_slope;
        if cos_theta >= 0.0 { 0.5 + half } else { 0.5 - half }
    }

    /// Omega_eq of eq. (19) in steradians, the solid angle of a top hat of the lobe's peak and visible energy; at
    /// `cos_theta` = 1 pi ln(T^2)/(T^2 - 1).
    pub fn equivalent_solid_angle(&self, cos_theta: f64) -> f64 {
        self.albedo(cos_theta) / self.peak
    }

    /// The plain mean of A/rho_0 over the angle of incidence, eq. (17): the paper's rho_s of a single ray; 1e-12.
    pub fn mean_albedo(&self) -> f64 {
        mean_over_angle(|cos_theta| self.albedo(cos_theta))
    }

    /// The mean of A/rho_0 over the hemisphere of directions weighed by their cosine, that of an orthographic image
    /// of a sphere: 1/2 + (T acosh(T)/sqrt(T^2 - 1) - 1)/(2 ln T).
    pub fn cosine_mean_albedo(&self) -> f64 {
        // A by parts, with F' in place of F
        let e = (self.ratio - 1.0).max(1e-12);
        let k2 = e * (2.0 + e);
        let k = sqrt(k2);
        // asinh(k)/k - 1
        let defect = if k2 < 1e-3 {
            -k2 / 6.0 * (1.0 - 9.0 / 20.0 * k2 * (1.0 - 25.0 / 42.0 * k2 * (1.0 - 49.0 / 72.0 * k2)))
        } else {
            log(k + self.ratio) / k - 1.0
        };
        0.5 + 0.5 * (e + (1.0 + e) * defect) / (e * log_slope(e))
    }

    /// The mean of A/rho_0 over one plane of incidence weighed by the cosine, that of a scan line across a
    /// cylinder: 1/2 + pi (T/agm(1, T) - 1)/(4 ln T), with the arithmetic-geometric mean.
    pub fn line_mean_albedo(&self) -> f64 {
        let e = (self.ratio - 1.0).max(1e-12);
        // Gauss's iteration on what the two means exceed 1 by
        let (mut a, mut g) = (e, 0.0);
        for _ in 0..8 {
            let product = a + g + a * g;
            (a, g) = (0.5 * (a + g), product / (1.0 + sqrt(1.0 + product)));
        }
        0.5 + 0.25 * PI * (e - a) / ((1.0 + a) * e * log_slope(e))
    }

    /// Angle to the mirror direction, radians, of the cone that holds the share `u` (0 to 1) of the whole lobe's
    /// energy: the inverse of the lobe's cumulative energy, asin sqrt((T^(2u) - 1)/(T^2 - 1)).
    pub fn cone(&self, u: f64) -> f64 {
        atan(self.slope(clamp(u, 0.0, 1.0 - 1e-12)))
    }

    /// Share of the whole lobe's energy within an angle of the mirror direction: the inverse of [`Lobe::cone`].
    fn energy_within(&self, angle: f64) -> f64 {
        let sine = if angle < FRAC_PI_2 { sin(angle) } else { 1.0 };
        let square = sine * sine;
        PI * self.peak * square * log_slope((self.ratio - 1.0) * (self.ratio + 1.0) * square)
    }

    /// A direction of the lobe above the facet for (`u`, `v`) in the unit square, with equal energy per area:
    /// the mean of f over n well-spread samples, times the albedo, tends to the integral of f q/rho_0 over
    /// the directions above the facet.
    ///
    /// `mirror` and `normal` are unit vectors. `u` is the share of the whole lobe's energy nearer to the mirror
    /// direction, `v` the azimuth in turns from the normal's side. The lobe so sampled is then pushed above the
    /// facet along x, each slice of equal energy onto a slice of equal energy, by the closed form of F and one
    /// root for the position within the slice (energy error below 1e-10); where nothing is cut off, nothing
    /// moves. No sample has n.d < 1e-9, but for rounding.
    pub fn sample(&self, mirror: Vec3, normal: Vec3, u: f64, v: f64) -> Vec3 {
        let cos_theta = clamp(mirror.dot(normal), -1.0, 1.0);
        let off = normal - mirror * cos_theta;
        let sin_theta = sqrt(off.dot(off));
        let first = if sin_theta > 1e-8 { off / sin_theta } else { frame(mirror).0 };
        let second = mirror.cross(first);

        let u = clamp(u, 0.0, 1.0 - 1e-12);
        let slope = self.slope(u);
        let (mut x, mut y) = (slope * cos(TAU * v), slope * sin(TAU * v));
        let albedo = self.albedo(cos_theta);
        if albedo < 1.0 - 1e-13 {
            let before = x;
            x = self
                .quantile(albedo * self.above(before))
                .max((2.0 * LEAST_COSINE - cos_theta) / sin_theta.max(1e-8));
            y = self.slide(before, x, y);
        }
        let length = sqrt(1.0 + x * x + y * y);
        let (along, x, y) = (1.0 / length, x / length, y / length);
        let direction = mirror * along + first * x + second * y;
        let low = LEAST_COSINE - direction.dot(normal);
        if low > 0.0 { direction + normal * low } else { direction }
    }

    /// Ray `ray` (0..`count`) of `count` rays of equal energy, each standing for albedo/`count`, above the
    /// facet: 1: the energy's median direction (the mirror direction where nothing is cut off); 2 to 4: a
    /// ring; 5 to 9: a centre and a ring, every ray at the median of its cell's energy; more: a sunflower.
    /// The set is rotated about the mirror direction by `turn` turns, so that sets that count together differ.
    pub fn ray(&self, ray: usize, count: usize, turn: f64, mirror: Vec3, normal: Vec3) -> Vec3 {
        let (i, n) = (ray as f64, count.max(1) as f64);
        let (u, v) = match (count, ray) {
            (0..=1, _) | (5..=9, 0) => (0.0, 0.0),
            (2..=4, _) => (0.5, (i + 0.5) / n),
            (5..=9, _) => (0.5 + 0.5 / n, (i - 0.5) / (n - 1.0)),
            _ => ((i + 0.5) / n, i * SUNFLOWER_STEP - floor(i * SUNFLOWER_STEP)),
        };
        self.sample(mirror, normal, u, v + turn)
    }

    /// tan(alpha) of the cone that holds the share `u` < 1 of the whole lobe's energy:
    /// sin^2 alpha = (T^(2u) - 1)/(T^2 - 1).
    fn slope(&self, u: f64) -> f64 {
        let sin2 = u * growth(2.0 * self.log_ratio * u) / growth(2.0 * self.log_ratio);
        sqrt(sin2 / (1.0 - sin2).max(1e-16))
    }

    /// 1 - F(x): energy above `x`.
    fn above(&self, x: f64) -> f64 {
        self.albedo(-x / sqrt(1.0 + x * x))
    }

    /// The x with energy `above` above it: F solved for x.
    fn quantile(&self, above: f64) -> f64 {
        let above = clamp(above, 1e-15, 1.0 - 1e-15);
        let below = 1.0 - above;
        let l = self.log_ratio;
        let spread = self.ratio * above * below * sinh_ratio(l * above) * sinh_ratio(l * below);
        (below - above) * sinh_ratio(l * (below - above)) / (2.0 * sqrt(spread))
    }

    /// The y that has at `after` the same share of the energy at equal x as `y` has at `before`.
    ///
    /// At a given x the density along y is 1/(a^2 + y^2) - 1/(b^2 + y^2), a^2 = x^2 + T^-2, b^2 = x^2 + 1. With
    /// y = a tan(zeta) and r = b/a its integral is, up to a factor, zeta + atan((r - 1) m)/(r - 1),
    /// m = sin cos/(r cos^2 + sin^2): concave for zeta > 0, so that Newton's method from 0 climbs to the root
    /// without overshoot.
    fn slide(&self, before: f64, after: f64, y: f64) -> f64 {
        let (a, excess) = self.slice(before);
        let length = sqrt(a * a + y * y);
        let energy = slice_energy(atan(fabs(y) / a), fabs(y) / length, a / length, excess);
        let (a, excess) = self.slice(after);
        let mut zeta = 0.0;
        for _ in 0..40 {
            let (s, c) = (sin(zeta), cos(zeta));
            let rest = energy - slice_energy(zeta, s, c, excess);
            let r = 1.0 + excess;
            let density = (r + 1.0) * r * c * c / (r * r * c * c + s * s);
            let step = rest / density;
            // the comparison also ends the loop where the density has vanished
            if !(step > 1e-12 && zeta + step < FRAC_PI_2) {
                break;
            }
            zeta += step;
        }
        let size = a * sin(zeta) / cos(zeta);
        if y < 0.0 { -size } else { size }
    }

    /// a and r - 1 of the slice at `x`.
    fn slice(&self, x: f64) -> (f64, f64) {
        let inverse = 1.0 / self.ratio;
        let (a, b) = (sqrt(x * x + inverse * inverse), sqrt(x * x + 1.0));
        (a, (1.0 - inverse) * (1.0 + inverse) / (a * (a + b)))
    }
}

/// Sine of a disc's half angle, over the lobe's width there, below which its middle stands for the disc: their values differ
/// by less than half the square of this.
const POINT: f64 = 3e-3;

/// Points of the integral over a disc's edge: relative error 1e-5 where the mirror direction points to the very edge, else
/// below 1e-6.
const EDGE_POINTS: usize = 8;

/// A lobe against a disc of uniform radiance: the sun's, seen straight or mirrored.
///
/// Along a circle about the mirror direction the lobe is constant, and the share of its energy within a circle is a closed
/// form. What the disc takes of it is therefore an integral of the arc of each circle inside the disc over that share,
/// u; with u = low + span (1 - cos t)/2 it has no root at either end.
#[derive(Clone, Copy, Debug)]
pub struct Highlight {
    lobe: Lobe,
    mirror: Vec3,
    /// At right angles to it, toward the disc's middle, and to both.
    axes: (Vec3, Vec3),
    /// Angle from the mirror direction to the disc's middle, and the disc's half angle.
    angle: f64,
    half: f64,
    /// Energy of the circles that are wholly inside, and where those begin that are partly.
    inside: f64,
    low: f64,
    span: f64,
    /// Energy of the parts of the others, in the order of the points.
    parts: [f64; EDGE_POINTS],
    /// Energy in the disc.
    energy: f64,
    /// Mean of q/rho_0 over the disc.
    pub value: f64,
}

impl Highlight {
    /// The lobe about the unit vector `mirror` against the sun's disc; `None` where the disc's middle stands for all of it.
    pub fn new(lobe: &Lobe, mirror: Vec3, sun: &Sun<'_>) -> Option<Highlight> {
        let half = sun.half_angle();
        let apart = mirror - sun.direction();
        let angle = 2.0 * asin((0.5 * sqrt(apart.dot(apart))).min(1.0));
        let excess = (lobe.ratio - 1.0) * (lobe.ratio + 1.0);
        let width2 = 1.0 + excess * sin(angle) * sin(angle);
        if half == 0.0 || half * half * lobe.ratio * lobe.ratio < POINT * POINT * width2 {
            return None;
        }
        let aside = sun.direction() - mirror * mirror.dot(sun.direction());
        let length = sqrt(aside.dot(aside));
        let first = if length > 0.0 { aside / length } else { frame(mirror).0 };
        let (nearest, farthest) = (fabs(angle - half), angle + half);
        let low = lobe.energy_within(nearest);
        let mut highlight = Highlight {
            lobe: *lobe,
            mirror,
            axes: (first, mirror.cross(first)),
            angle,
            half,
            inside: if angle < half { low } else { 0.0 },
            low,
            span: lobe.energy_within(farthest) - low,
            parts: [0.0; EDGE_POINTS],
            energy: 0.0,
            value: 0.0,
        };
        let (nodes, weights) = rule(EDGE_POINTS);
        let mut energy = highlight.inside;
        for (n, (t, weight)) in nodes.iter().zip(weights).enumerate() {
            let arc = highlight.arc(highlight.cone(*t));
            let part = 0.5 * PI * sin(PI * t) * weight * highlight.span * arc;
            highlight.parts[n % EDGE_POINTS] = part;
            energy += part;
        }
        let sine = sin(half);
        (highlight.energy, highlight.value) = (energy, energy / (PI * sine * sine));
        Some(highlight)
    }

    /// Angle of the circle at a place in 0..=1 between the first and the last that is partly inside.
    fn cone(&self, t: f64) -> f64 {
        self.lobe.cone(self.low + 0.5 * self.span * (1.0 - cos(PI * t)))
    }

    /// Share of the circle of an angle about the mirror direction that is inside the disc.
    fn arc(&self, cone: f64) -> f64 {
        let (a, b) = (sin(0.5 * (self.half + cone - self.angle)), sin(0.5 * (self.half - cone + self.angle)));
        let (rise, most) = (a * b, sin(cone) * sin(self.angle));
        if rise <= 0.0 {
            0.0
        } else if rise >= most {
            1.0
        } else {
            2.0 * asin(sqrt(rise / most)) / PI
        }
    }

    /// A direction of the disc for (`u`, `v`) in the unit square, as dense as the lobe is high there.
    pub fn sample(&self, u: f64, v: f64) -> Vec3 {
        let mut rest = u * self.energy;
        let (cone, arc) = if rest < self.inside {
            (self.lobe.cone(rest), 1.0)
        } else {
            rest -= self.inside;
            let mut place = 1.0;
            let mut start = 0.0;
            for (part, weight) in self.parts.iter().zip(rule(EDGE_POINTS).1) {
                if rest < *part {
                    place = start + weight * (rest / part);
                    break;
                }
                rest -= part;
                start += weight;
            }
            let cone = self.cone(place.min(1.0));
            (cone, self.arc(cone))
        };
        let turn = PI * arc * (2.0 * v - 1.0);
        let (first, second) = self.axes;
        self.mirror * cos(cone) + (first * cos(turn) + second * sin(turn)) * sin(cone)
    }
}

/// The mean over the angle of incidence, 0 to 90 degrees, of an albedo given by that angle's cosine.
pub(crate) fn mean_over_angle(albedo: impl Fn(f64) -> f64) -> f64 {
    // narrow lobes bend next to grazing: panels that halve toward it
    const PANELS: usize = 20;
    let (nodes, weights) = rule(16);
    let (mut sum, mut width) = (0.0, FRAC_PI_2);
    for panel in 1..=PANELS {
        let rest = if panel == PANELS { 0.0 } else { 0.5 * width };
        for (x, w) in nodes.iter().zip(weights) {
            let from_grazing = rest + (width - rest) * x;
            sum += w * (width - rest) * albedo(sin(from_grazing));
        }
        width = rest;
    }
    sum / FRAC_PI_2
}

/// zeta + atan(e m)/e with m = s c/((1 + e) c^2 + s^2): pi/2 of it is all.
#[inline]
fn slice_energy(zeta: f64, s: f64, c: f64, e: f64) -> f64 {
    let m = s * c / ((1.0 + e) * c * c + s * s);
    // the limit for a small e is m; the next term of the series is m^3 e^2/3
    zeta + if e < 1e-7 { m } else { atan(e * m) / e }
}

/// (e^x - 1)/x for x >= 0, 1 at 0; a few ulp.
fn growth(x: f64) -> f64 {
    if x > 0.1 { (exp(x) - 1.0) / x } else { series(x, |k| 1.0 / (k + 1.0)) }
}

/// sinh(x)/x, 1 at 0; a few ulp.
fn sinh_ratio(x: f64) -> f64 {
    if fabs(x) > 0.5 {
        (exp(x) - exp(-x)) / (2.0 * x)
    } else {
        series(x * x, |k| 1.0 / (2.0 * k * (2.0 * k + 1.0)))
    }
}

/// ln(1 + x)/x for x >= 0, 1 at 0; a few ulp (Kahan's correction of the rounding of 1 + x).
#[inline]
fn log_slope(x: f64) -> f64 {
    let rounded = 1.0 + x;
    if rounded == 1.0 { 1.0 } else { log(rounded) / (rounded - 1.0) }
}

/// 1 + x f(1) (1 + x f(2) (1 + ...)), ten terms.
fn series(x: f64, factor: impl Fn(f64) -> f64) -> f64 {
    let mut sum = 1.0;
    for k in (1..=10).rev() {
        sum = 1.0 + sum * x * factor(f64::from(k));
    }
    sum
}
