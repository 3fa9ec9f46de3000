//! The record of a solved scene: what the stages of light and radiosity leave for every view.

use crate::base::arena::{Arena, Need, plain_struct};
use crate::base::error::Error;
use crate::radiosity::direct::TableShape;
use crate::radiosity::straight::{self, Straight};
use crate::radiosity::sun_image::SunImages;

/// A scene under one light, solved.
#[derive(Clone, Copy, Debug)]
pub struct Solution<'m> {
    /// Shape of the irradiance table.
    pub shape: TableShape,
    /// Reference radiance, one value per band.
    pub reference: &'m [f64],
    /// Mean and gradients of each unknown's irradiance, without the sun's direct part and that of its images.
    pub irradiance: &'m [f64],
    /// The part of it that is the sky seen straight, where outlines tell it.
    pub straight: Straight<'m>,
    /// Mean of cos V of the sun over each unknown.
    pub sun: &'m [f64],
    /// Images of the sun in flat mirrors.
    pub images: SunImages<'m>,
    /// Expected squared error of each unknown's irradiance over pi, relative to the reference radiance.
    pub variance: &'m [f32],
    /// Numbers.
    pub numbers: Numbers,
}

impl Solution<'_> {
    /// Bytes in use.
    pub fn memory(&self) -> usize {
        size_of_val(self.irradiance)
            + size_of_val(self.straight.values)
            + size_of_val(self.straight.variance)
            + size_of_val(self.sun)
            + size_of_val(self.variance)
            + self.images.memory()
    }
}

plain_struct! {
    /// Numbers of a solution.
    pub struct Numbers {
        /// Largest radiance that any ray can see, relative to the reference radiance.
        pub brightest: f64,
        /// Bound on the distance of the radiances from the solution of the discrete system, relative to the reference
        /// radiance.
        pub solver: f64,
        /// Mean irradiance over pi of the elements whose straight sky is known, by all else, relative to the reference
        /// radiance in its brightest band; 1 where none is known.
        pub reflected: f64,
        /// Sweeps done.
        pub sweeps: u64,
        /// Rays toward the sun and from mirrors that face it.
        pub sun_rays: u64,
    }
}

/// Memory of a [`Solution`], of any content.
#[derive(Debug)]
pub struct SolutionMemory<'m> {
    /// As [`Solution::reference`].
    pub reference: &'m mut [f64],
    /// As [`Solution::irradiance`].
    pub irradiance: &'m mut [f64],
    /// As [`Straight::values`].
    pub straight: &'m mut [f64],
    /// As [`Straight::variance`].
    pub straight_variance: &'m mut [f32],
    /// As [`Solution::sun`].
    pub sun: &'m mut [f64],
    /// As [`SunImages::slots`].
    pub slots: &'m mut [u64],
    /// As [`SunImages::reflected_irradiance`].
    pub reflected_irradiance: &'m mut [f64],
    /// As [`Solution::variance`].
    pub variance: &'m mut [f32],
}

/// Counts of a solution's values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SolutionSize {
    /// Shape of the irradiance table.
    pub shape: TableShape,
    /// Unknowns.
    pub unknowns: usize,
    /// Places for images of the sun; 0 where no mirror reflects sunlight.
    pub places: usize,
    /// Whether outlines tell the straight sky.
    pub straight: bool,
}

impl SolutionSize {
    /// Values of the irradiance table.
    pub fn table(&self) -> usize {
        self.unknowns * self.shape.stride()
    }

    /// Values of all unknowns and bands.
    pub fn values(&self) -> usize {
        self.unknowns * self.shape.bands
    }

    /// Irradiances by images of the sun.
    pub fn reflected_irradiance(&self) -> usize {
        if self.places > 0 { self.values() * self.shape.levels } else { 0 }
    }

    /// Values and variances of the straight sky.
    pub fn straight(&self) -> (usize, usize) {
        let values = straight::stride(self.shape.bands) * self.unknowns;
        if self.straight { (values, self.unknowns) } else { (0, 0) }
    }

    /// Bytes of [`SolutionMemory`].
    pub fn need(&self) -> Need {
        Need::new()
            .and::<f64>(self.shape.bands)
            .and::<f64>(self.table())
            .and::<f64>(self.straight().0)
            .and::<f32>(self.straight().1)
            .and::<f64>(self.unknowns)
            .and::<u64>(self.places)
            .and::<f64>(self.reflected_irradiance())
            .and::<f32>(self.unknowns)
    }

    /// Carves the memory out of an arena.
    pub fn take<'m>(&self, arena: &mut Arena<'m>) -> Result<SolutionMemory<'m>, Error> {
        Ok(SolutionMemory {
            reference: arena.take(self.shape.bands)?,
            irradiance: arena.take(self.table())?,
            straight: arena.take(self.straight().0)?,
            straight_variance: arena.take(self.straight().1)?,
            sun: arena.take(self.unknowns)?,
            slots: arena.take(self.places)?,
            reflected_irradiance: arena.take(self.reflected_irradiance())?,
            variance: arena.take(self.unknowns)?,
        })
    }
}
