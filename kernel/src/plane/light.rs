//! Sky and sun of the plane model, checked.

use crate::base::error::{Error, Field};
use crate::base::index::{Index, IndexMut};
use crate::base::math::{cos, fabs, sin};
use crate::plane::lobe::PlaneLobe;
use crate::plane::path::Hit;
use crate::plane::scene::PlaneScene;
use crate::plane::{Vec2, cross, length, turned};

/// Radiance by direction; the direction points away from the object.
pub type RadianceOf<'a> = &'a (dyn Fn(Vec2) -> f64 + Sync);

/// The sky.
#[derive(Clone, Copy)]
pub enum Sky<'a> {
    /// The same radiance everywhere.
    Uniform(f64),
    /// Any radiance.
    Varying {
        /// Finite, not negative.
        radiance: RadianceOf<'a>,
        /// Directions at which it jumps or bends, at most [`MAX_JUMPS`].
        jumps: &'a [Vec2],
    },
}

impl core::fmt::Debug for Sky<'_> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Sky::Uniform(radiance) => write!(f, "Uniform({radiance})"),
            Sky::Varying { jumps, .. } => write!(f, "Varying {{ jumps: {jumps:?} }}"),
        }
    }
}

/// Most jumps of a sky.
pub const MAX_JUMPS: usize = 12;

/// The paper's device against missed glints: a ray that leaves the object after at least one mirror or lobe
/// within `half_angle` of a point sun sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Capture {
    /// Radians, 0 to 1.5.
    pub half_angle: f64,
    /// Radiance that such a ray sees.
    pub radiance: f64,
}

impl Capture {
    /// The cone that keeps the sun's energy: radiance E/(2 half_angle).
    pub fn conserving(irradiance: f64, half_angle: f64) -> Capture {
        Capture { half_angle, radiance: irradiance / (2.0 * half_angle) }
    }
}

/// A point sun.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlaneSun {
    /// Toward the sun; any length.
    pub direction: Vec2,
    /// E on a surface that faces it.
    pub irradiance: f64,
    /// `Some`: mirrors and lobes see the sun by this cone, and lobes are not evaluated. `None`: lobes are
    /// evaluated at the sun's direction, E q V, and ideal mirrors do not show it.
    pub capture: Option<Capture>,
}

/// All light, checked.
#[derive(Clone, Copy, Debug)]
pub struct Light<'a> {
    pub(super) sky: Sky<'a>,
    pub(super) sun: Option<PlaneSun>,
    cuts: [Vec2; MAX_JUMPS + 3],
    count: usize,
}

impl<'a> Light<'a> {
    /// Checks sky and sun.
    ///
    /// # Errors
    /// [`Error::Range`], [`Error::Direction`], [`Error::TooMany`] jumps.
    pub fn new(sky: Sky<'a>, sun: Option<PlaneSun>) -> Result<Light<'a>, Error> {
        let mut light = Light { sky, sun: None, cuts: [Vec2::ZERO; MAX_JUMPS + 3], count: 0 };
        let range = |field, value: f64, most: f64| {
            let good = value >= 0.0 && value <= most;
            if good { Ok(()) } else { Err(Error::Range { field, band: 0, value }) }
        };
        match sky {
            Sky::Uniform(radiance) => range(Field::SkyRadiance, radiance, 1e37)?,
            Sky::Varying { jumps, .. } => {
                if jumps.len() > MAX_JUMPS {
                    return Err(Error::TooMany { what: "sky jumps", limit: MAX_JUMPS });
                }
                for jump in jumps {
                    light.cut(unit(*jump).ok_or(Error::Direction { field: Field::SkyTable })?);
                }
            }
        }
        let Some(sun) = sun else { return Ok(light) };
        let direction = unit(sun.direction).ok_or(Error::Direction { field: Field::SunDirection })?;
        range(Field::SunIrradiance, sun.irradiance, 1e37)?;
        if let Some(capture) = sun.capture {
            range(Field::SunHalfAngle, capture.half_angle, 1.5)?;
            range(Field::SunIrradiance, capture.radiance, 1e37)?;
            let (s, c) = (sin(capture.half_angle), cos(capture.half_angle));
            light.cut(direction * c + turned(direction) * s);
            light.cut(direction * c - turned(direction) * s);
            light.cut(-direction);
        }
        light.sun = Some(PlaneSun { direction, ..sun });
        Ok(light)
    }

    fn cut(&mut self, direction: Vec2) {
        self.cuts.set(self.count, direction);
        self.count += 1;
    }

    /// Directions at which what a mirrored ray sees jumps.
    pub fn cuts(&self) -> &[Vec2] {
        self.cuts.head(self.count)
    }

    /// Whether all that escapes brings the same.
    pub fn is_uniform(&self) -> bool {
        matches!(self.sky, Sky::Uniform(_)) && self.sun.is_none_or(|sun| sun.capture.is_none())
    }

    /// The sun.
    pub fn sun(&self) -> Option<&PlaneSun> {
        self.sun.as_ref()
    }

    /// Radiance that arrives along `direction` (away from the object); `mirrored`: after at least one mirror.
    #[inline]
    pub fn radiance(&self, direction: Vec2, mirrored: bool) -> f64 {
        let sky = match self.sky {
            Sky::Uniform(radiance) => radiance,
            Sky::Varying { radiance, .. } => radiance(direction),
        };
        match &self.sun {
            Some(PlaneSun { direction: toward, capture: Some(capture), .. })
                if mirrored && direction.dot(*toward) >= cos(capture.half_angle) =>
            {
                sky + capture.radiance
            }
            _ => sky,
        }
    }

    /// What the sun adds to the mean of the half circle's radiance at a point, cos V E/2.
    pub(crate) fn sunlit(&self, scene: &PlaneScene<'_>, point: Vec2, normal: Vec2, skip: u32) -> f64 {
        let Some(sun) = &self.sun else { return 0.0 };
        let cosine = sun.direction.dot(normal);
        if cosine <= 0.0 || scene.first(point, sun.direction, skip).is_some() {
            return 0.0;
        }
        0.5 * sun.irradiance * cosine
    }

    /// The sun in a lobe, E q V for rho_0 = 1; 0 where a cone stands for it.
    pub(crate) fn in_lobe(&self, scene: &PlaneScene<'_>, hit: &Hit, mirrored: Vec2, lobe: &PlaneLobe) -> f64 {
        let Some(PlaneSun { direction, irradiance, capture: None }) = &self.sun else { return 0.0 };
        if direction.dot(hit.normal) <= 0.0 || scene.first(hit.point, *direction, hit.primitive).is_some() {
            return 0.0;
        }
        irradiance * lobe.value(cross(mirrored, *direction), mirrored.dot(*direction))
    }
}

fn unit(v: Vec2) -> Option<Vec2> {
    let size = fabs(v.x).max(fabs(v.y));
    if !(size > 0.0 && v.is_finite()) {
        return None;
    }
    let v = v / size;
    Some(v / length(v))
}
