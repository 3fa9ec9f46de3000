//! Parameters drawn from distributions, the same in every run.

use crate::support::twin::Rng;
use glam::{DVec3, dvec3};
use std::f64::consts::TAU;

/// A stream of drawn parameters.
pub struct Draw(Rng);

impl Draw {
    /// The stream of the case `index`.
    pub fn new(index: usize) -> Draw {
        Draw(Rng(0xb11c).child(index as u64))
    }

    /// Uniform in [low, high).
    pub fn real(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.0.unit()
    }

    /// Uniform in its logarithm.
    pub fn scale(&mut self, low: f64, high: f64) -> f64 {
        self.real(low.ln(), high.ln()).exp()
    }

    /// Uniform in low..=high.
    pub fn whole(&mut self, low: usize, high: usize) -> usize {
        low + (self.0.unit() * (high - low + 1) as f64) as usize
    }

    /// True with the probability `p`.
    pub fn chance(&mut self, p: f64) -> bool {
        self.0.unit() < p
    }

    /// One of the values.
    pub fn pick<T: Copy>(&mut self, values: &[T]) -> T {
        values[self.whole(0, values.len() - 1)]
    }

    /// A unit vector of an elevation in degrees within the range.
    pub fn direction(&mut self, low_deg: f64, high_deg: f64) -> DVec3 {
        let (elevation, azimuth) = (self.real(low_deg, high_deg).to_radians(), self.real(0.0, TAU));
        let (s, c) = elevation.sin_cos();
        dvec3(c * azimuth.cos(), c * azimuth.sin(), s)
    }

    /// A point of the box [low, high]^3.
    pub fn point(&mut self, low: f64, high: f64) -> DVec3 {
        dvec3(self.real(low, high), self.real(low, high), self.real(low, high))
    }
}
