//! How a scene of the plane model is solved.

use crate::base::error::{Error, Field};
use crate::plane::rows::{Method, RowSettings, check_bounces};
use crate::plane::scene::Basis;

/// How a scene is solved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// How the diffuse radiance varies.
    pub basis: Basis,
    /// How rows are integrated.
    pub method: Method,
    /// Light reflected more often does not count, 1 to 64; `None`: by `cutoff`.
    pub max_bounces: Option<u32>,
    /// Chains end where their mirrors leave less than this share.
    pub cutoff: f64,
    /// Bound on the solver's error, relative to the brightest light.
    pub solver: f64,
    /// Wanted error, relative to the sky: chooses the rays of lobes that have none of their own.
    pub tolerance: f64,
}

impl Settings {
    /// Settings with which bodies that are cut finely enough reach this error, relative to the sky: circles of
    /// 12 elements at 1e-4 and of 16 at 1e-5 in the two-circle study, more where bodies nearly touch. A tolerance
    /// beyond 1e-13 to 0.1 is refused by [`crate::plane::scene::PlaneScene::new`].
    pub fn for_tolerance(tolerance: f64) -> Settings {
        let t = tolerance.clamp(1e-13, 0.1);
        let points = if t >= 5e-5 {
            6
        } else if t >= 5e-6 {
            8
        } else {
            16
        };
        Settings {
            basis: Basis::Panels(4),
            method: Method::Split { points },
            max_bounces: None,
            cutoff: 0.1 * t,
            solver: 0.01 * t,
            tolerance,
        }
    }

    /// How rows are computed.
    pub fn rows(&self) -> RowSettings {
        RowSettings { method: self.method, max_bounces: self.max_bounces, cutoff: self.cutoff }
    }

    /// Refuses more reflections than are told apart, and shares that are none.
    ///
    /// # Errors
    /// [`Error::Range`] that names the value.
    pub fn check(&self) -> Result<(), Error> {
        check_bounces(&self.rows())?;
        for value in [self.cutoff, self.solver] {
            if !(0.0..=1.0).contains(&value) {
                return Err(Error::Range { field: Field::Tolerance, band: 0, value });
            }
        }
        Ok(())
    }
}
