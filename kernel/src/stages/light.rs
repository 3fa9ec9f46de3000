//! From a coupling and a light to the record that views are computed from.

use super::{Count, Executor};
use crate::base::arena::{ALIGNMENT, Arena, Need};
use crate::base::error::Error;
use crate::coupling::element::Elements;
use crate::coupling::{Coupling, row_builder};
use crate::radiosity::accuracy::Own;
use crate::radiosity::beam::{self, BeamSettings};
use crate::radiosity::direct::{self, TableShape};
use crate::radiosity::limits;
use crate::radiosity::solution::{Solution, SolutionMemory, SolutionSize};
use crate::radiosity::solver;
use crate::radiosity::straight::{self, Straight};
use crate::radiosity::sun_image::{self, SPREAD};
use crate::rays::bvh::Bvh;
use crate::scene::Scene;
use crate::scene::light::Light;
use crate::settings::{self, Settings};

/// Share of the progress that each stage takes: the sky's light, the sun's, the sweeps' bounds, gathering. Measured by
/// `cargo bench --bench stages`.
pub(super) const SHARES: [f64; 4] = [0.3, 0.3, 0.2, 0.2];

/// A scene and its coupling under a light that is to be solved for.
#[derive(Clone, Copy, Debug)]
pub struct Lighting<'a> {
    /// The scene.
    pub scene: &'a Scene<'a>,
    /// Its tree.
    pub bvh: &'a Bvh<'a>,
    /// Its elements.
    pub elements: &'a Elements<'a>,
    /// Its coupling.
    pub coupling: &'a Coupling<'a>,
    /// The light.
    pub light: &'a Light<'a>,
    /// By which the coupling was made.
    pub settings: &'a Settings,
}

/// Counts of the values that a light's stages work on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sizes {
    /// The solution's.
    pub solution: SolutionSize,
    /// Radiances of all unknowns that are kept at once while solving.
    orders: usize,
    /// Bytes of a few rows of beams.
    beams: usize,
    /// Bytes in which the straight sky of elements is evaluated.
    lookers: usize,
    /// Whether radiances of the first pass are kept.
    first: bool,
}

/// Memory of a light's stages beside the solution's, from [`Sizes::scratch`].
#[derive(Debug)]
pub struct Scratch<'m> {
    /// Direct irradiance, of the solution's shape.
    pub(super) direct: &'m mut [f64],
    pub(super) orders: &'m mut [f64],
    pub(super) own: &'m mut [Own],
    pub(super) carried: &'m mut [f32],
    /// Where on elements light falls that may stay a mean; of no length where no mirror reflects sunlight.
    pub(super) spread: &'m mut [f32],
    /// Bands, as bits, that emission alone lights and for which the caller gave no reference radiance: it follows from the
    /// solution.
    pub(super) dark: u64,
    pub(super) lookers: &'m mut [u8],
    /// Radiances of the first of both passes, where they are kept.
    pub(super) first: &'m mut [f64],
}

/// Settings of the beams that a scene's mirrors reflect of a light's sun; `None` where there are no such beams.
pub(super) fn beam_settings(
    scene: &Scene<'_>,
    light: &Light<'_>,
    settings: &Settings,
) -> Option<BeamSettings> {
    let sun = light.sun.as_ref()?;
    settings::beams(scene, sun, settings)
}

impl Sizes {
    /// Those of a scene under a light.
    pub fn new(
        (scene, bvh): (&Scene<'_>, &Bvh<'_>),
        elements: &Elements<'_>,
        light: &Light<'_>,
        settings: &Settings,
    ) -> Result<Sizes, Error> {
        let Settings { budget, max_bounces, .. } = *settings;
        let shape = settings::shape(max_bounces, scene.bands());
        let (mut beams, mut places) = (0, 0);
        if let Some(settings) = beam_settings(scene, light, settings) {
            beams = row_builder::bytes(16, 64, beam::unmerged(scene, elements, &settings), scene.bands())?;
            places = sun_image::places(elements.facet_sides());
        }
        let straight = light.sky.as_ref().is_some_and(|sky| straight::basis(bvh, sky).is_some());
        let sweeps = || 2 + solver::kept(scene, budget.solver, max_bounces);
        Ok(Sizes {
            solution: SolutionSize { shape, unknowns: elements.unknowns(), places, straight },
            orders: if shape.levels == 1 { sweeps() } else { shape.levels + 1 },
            beams,
            lookers: if straight { super::straight::bytes(scene.bands())? } else { 0 },
            first: false,
        })
    }

    /// The same with room for the radiances of the first pass, which [`Lighting::differentiate`] needs.
    pub fn keeping_first(self) -> Sizes {
        Sizes { first: true, ..self }
    }

    /// Values of [`Scratch::first`].
    fn first(&self) -> usize {
        if self.first { self.solution.values() } else { 0 }
    }

    /// Bytes of [`Scratch`].
    pub fn scratch(&self) -> Need {
        let values = self.solution.values();
        Need::new()
            .and::<f64>(self.solution.table())
            .and::<f64>(values * self.orders)
            .and::<Own>(values)
            .and::<f32>(2 * values)
            .and::<f32>(self.spread())
            .and::<u8>(self.lookers)
            .and::<f64>(self.first())
    }

    /// Values of [`Scratch::spread`].
    fn spread(&self) -> usize {
        if self.beams > 0 { self.solution.unknowns * SPREAD } else { 0 }
    }

    /// Carves the scratch memory out of an arena.
    pub fn take_scratch<'m>(&self, arena: &mut Arena<'m>) -> Result<Scratch<'m>, Error> {
        let values = self.solution.values();
        Ok(Scratch {
            direct: arena.take(self.solution.table())?,
            orders: arena.take(values * self.orders)?,
            own: arena.take(values)?,
            carried: arena.take(2 * values)?,
            spread: arena.take(self.spread())?,
            dark: 0,
            lookers: arena.take(self.lookers)?,
            first: arena.take(self.first())?,
        })
    }

    /// Bytes with which beams can begin on `lanes` lanes; 0 where there are none.
    pub fn beams(&self, lanes: usize) -> usize {
        if self.beams == 0 { 0 } else { self.beams.saturating_mul(4 * lanes.max(1) - 3) + ALIGNMENT }
    }

    /// Shape of the irradiance table.
    pub fn shape(&self) -> TableShape {
        self.solution.shape
    }
}

impl Lighting<'_> {
    /// Direct light but for beams, and the reference radiance: that `given`, or from the light. Returns the rays toward the
    /// sun.
    ///
    /// # Errors
    /// Radiances above 1e37 ([`limits::check_highlights`]).
    pub fn direct<X: Executor>(
        &self,
        given: Option<&[f64]>,
        memory: &mut SolutionMemory<'_>,
        scratch: &mut Scratch<'_>,
        run: &mut X,
    ) -> Result<u64, X::Error> {
        self.begin(given, memory, scratch)?;
        self.sky(memory, scratch, run)?;
        self.sun(memory, run)
    }

    /// The reference radiance.
    pub(super) fn begin(
        &self,
        given: Option<&[f64]>,
        memory: &mut SolutionMemory<'_>,
        scratch: &mut Scratch<'_>,
    ) -> Result<(), Error> {
        let Lighting { scene, light, .. } = *self;
        limits::check_highlights(scene, light)?;
        scratch.dark = match given {
            Some(given) => {
                memory.reference.iter_mut().zip(given).for_each(|(to, from)| *to = *from);
                0
            }
            None => light.reference_radiance(scene, memory.reference),
        };
        Ok(())
    }

    /// The sky's part of the direct light.
    pub(super) fn sky<X: Executor>(
        &self,
        memory: &mut SolutionMemory<'_>,
        scratch: &mut Scratch<'_>,
        run: &mut X,
    ) -> Result<(), X::Error> {
        let Lighting { scene, elements, coupling, light, settings, .. } = *self;
        let shape = settings::shape(settings.max_bounces, scene.bands());
        match &light.sky {
            None => scratch.direct.fill(0.0),
            Some(sky) => {
                super::straight::fill(self, memory, scratch, run)?;
                let straight = Straight { values: memory.straight, variance: memory.straight_variance };
                let accuracy = settings.budget.sky;
                run.rows(scratch.direct, shape.stride(), SHARES[0], |range, out| {
                    let sky = (sky, &straight);
                    direct::sky_rows(scene, elements, coupling, sky, accuracy, range, shape, out)
                })?;
            }
        }
        Ok(())
    }

    /// The share of the sun's irradiance that arrives straight; returns the rays toward it.
    pub(super) fn sun<X: Executor>(
        &self,
        memory: &mut SolutionMemory<'_>,
        run: &mut X,
    ) -> Result<u64, X::Error> {
        let Lighting { scene, bvh, elements, coupling, light, .. } = *self;
        let Some(sun) = &light.sun else {
            memory.sun.fill(0.0);
            return Ok(0);
        };
        let Count(rays) = run.rows(memory.sun, 1, 0.5 * SHARES[1], |range, out| {
            direct::sun_rows(scene, bvh, elements, coupling, sun, range, out).map(Count)
        })?;
        Ok(rays)
    }

    /// The diffuse solution from the direct light, of which `sun_rays` rays were traced.
    ///
    /// # Errors
    /// A system that diverges; radiances above 1e37 ([`limits::check_radiance`]).
    pub fn solve<'m, X: Executor>(
        &self,
        memory: SolutionMemory<'m>,
        scratch: &mut Scratch<'_>,
        sun_rays: u64,
        run: &mut X,
    ) -> Result<Solution<'m>, X::Error> {
        super::solve::solve(self, memory, scratch, sun_rays, run)
    }
}
