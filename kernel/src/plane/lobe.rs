//! The flatland form of the lobe of [`crate::scene::lobe`], with its closed forms.
//!
//! q = rho_0 C cos(alpha)/(cos^2 alpha + T^2 sin^2 alpha) for |alpha| < 90 degrees, k = sqrt(T^2 - 1) and
//! C = k/(2 atan k), so that the whole lobe holds rho_0. The energy between two angles is a difference of
//! W(alpha) = atan(k sin alpha)/atan(k), halved: sampling and albedo need one arc tangent each.

use crate::base::arena::plain_struct;
use crate::base::error::{Error, Field};
use crate::base::math::{PI, atan, clamp, sqrt, tan};
use crate::plane::{Vec2, cross, turned};
use crate::scene::MIRROR_AXIS_RATIO;
use crate::scene::lobe::mean_over_angle;

plain_struct! {
    /// A lobe of a given axis ratio, for a reflectance rho_0 of 1.
    pub struct PlaneLobe {
        /// T, 1 to 1e4.
        pub ratio: f64,
        /// sqrt(T^2 - 1), at least 1e-6: below, the lobe is cos(alpha)/2 to 1e-12.
        pub k: f64,
        /// atan(k).
        pub turn: f64,
    }
}

/// The part of a lobe above the surface, W from `low` to `high`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Visible {
    /// W of the lower limit of alpha.
    pub low: f64,
    /// W of the upper limit.
    pub high: f64,
}

impl Visible {
    /// Energy of the visible part: A(theta)/rho_0.
    #[inline(always)]
    pub fn energy(&self) -> f64 {
        0.5 * (self.high - self.low)
    }
}

impl PlaneLobe {
    /// A lobe of long over short axis `axis_ratio` >= 1, kept at 1e4 from there on.
    ///
    /// # Errors
    /// [`Error::Range`] where it is below 1 or not finite.
    pub fn new(axis_ratio: f64) -> Result<PlaneLobe, Error> {
        if !(axis_ratio >= 1.0 && axis_ratio.is_finite()) {
            return Err(Error::Range { field: Field::AxisRatio, band: 0, value: axis_ratio });
        }
        let ratio = axis_ratio.min(MIRROR_AXIS_RATIO);
        let k = sqrt((ratio - 1.0) * (ratio + 1.0)).max(1e-6);
        Ok(PlaneLobe { ratio, k, turn: atan(k) })
    }

    /// q/rho_0 per radian, by sine and cosine of alpha; 0 where the cosine is not positive.
    #[inline(always)]
    pub fn value(&self, sin_alpha: f64, cos_alpha: f64) -> f64 {
        if cos_alpha <= 0.0 {
            return 0.0;
        }
        let (s, c) = (sin_alpha * self.ratio, cos_alpha);
        self.k / (2.0 * self.turn) * c / (c * c + s * s)
    }

    /// A(theta)/rho_0 by the cosine of the angle of incidence: what the lobe holds above the surface, 1 at
    /// normal view, 1/2 at grazing.
    #[inline(always)]
    pub fn albedo(&self, cos_theta: f64) -> f64 {
        0.5 + 0.5 * atan(self.k * cos_theta) / self.turn
    }

    /// The plain mean of A/rho_0 over the angle of incidence: the paper's best rho_s, eq. (17).
    pub fn mean_albedo(&self) -> f64 {
        mean_over_angle(|cos_theta| self.albedo(cos_theta))
    }

    /// The mean of A/rho_0 weighed by the cosine, 1/2 int A cos: the best rho_s of an orthographic image of a
    /// circle. 1/2 + pi (T - 1)/(4 k atan k).
    pub fn cosine_mean_albedo(&self) -> f64 {
        // (T - 1)/k = k/(T + 1)
        0.5 + 0.25 * PI * self.k / ((self.ratio + 1.0) * self.turn)
    }

    /// Omega_eq of eq. (19) in radians, the full width of a top hat of the lobe's peak and visible energy.
    pub fn equivalent_width(&self, cos_theta: f64) -> f64 {
        (self.turn + atan(self.k * cos_theta)) / self.k
    }

    /// W at an angle alpha of sine `s`: -1 at -90 degrees, 1 at 90.
    #[inline(always)]
    pub fn at(&self, sin_alpha: f64) -> f64 {
        atan(self.k * sin_alpha.clamp(-1.0, 1.0)) / self.turn
    }

    /// What lies above a surface of unit normal `n` of the lobe around the unit vector `mirror`.
    #[inline(always)]
    pub fn visible(&self, mirror: Vec2, n: Vec2) -> Visible {
        let grazing = self.at(mirror.dot(n).max(0.0));
        if cross(n, mirror) < 0.0 {
            Visible { low: -grazing, high: 1.0 }
        } else {
            Visible { low: -1.0, high: grazing }
        }
    }

    /// W of the direction `d`, within the limits of `visible`.
    #[inline(always)]
    pub fn place(&self, mirror: Vec2, d: Vec2, visible: &Visible) -> f64 {
        let sine = cross(mirror, d);
        if mirror.dot(d) >= 0.0 {
            return clamp(self.at(sine), visible.low, visible.high);
        }
        if sine < 0.0 { visible.low } else { visible.high }
    }

    /// The direction at W = `w`: the inverse of [`PlaneLobe::at`].
    #[inline(always)]
    pub fn direction(&self, mirror: Vec2, w: f64) -> Vec2 {
        let sine = (tan(w * self.turn) / self.k).clamp(-1.0, 1.0);
        mirror * sqrt((1.0 - sine) * (1.0 + sine)) + turned(mirror) * sine
    }
}
