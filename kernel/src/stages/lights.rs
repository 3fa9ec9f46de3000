//! Many lights against one coupling: each light is solved by one lane, serially, in memory that its next light reuses; lights
//! of the same sky share what is known of it.
//!
//! A light's numbers have the bits of [`Lighting::direct`], [`Beams::add`] and [`Lighting::solve`] on any executor.

use super::{AdjointMemory, AdjointReport, Beams, Executor, Lighting, Merge, Scratch, Sizes};
use crate::base::arena::{ALIGNMENT, Arena, Need, plain_table};
use crate::base::error::{Error, Field};
use crate::base::index::copy;
use crate::base::math::Vec3;
use crate::coupling::Coupling;
use crate::coupling::element::Elements;
use crate::radiosity::direct::TableShape;
use crate::radiosity::solution::Solution;
use crate::radiosity::straight;
use crate::rays::bvh::Bvh;
use crate::scene::light::{Light, LightInput};
use crate::scene::sky::SkyInput;
use crate::scene::sky::record::SkyRecord;
use crate::scene::{MAX_BANDS, Scene};
use crate::settings::{self, Settings};
use crate::view::chain::{ChainSettings, KnownRows, Solved};
use crate::view::importance::Importance;
use crate::view::signature::{self, Sums, View};

/// An executor of one lane: the calling thread takes piece after piece.
#[derive(Clone, Copy, Debug, Default)]
pub struct Alone;

impl Executor for Alone {
    type Error = Error;

    fn lanes(&self) -> usize {
        1
    }

    fn pieces<T: Send, R: Merge>(
        &mut self,
        out: &mut [T],
        piece: usize,
        _: f64,
        work: impl Fn(usize, &mut [T]) -> Result<R, Error> + Sync,
    ) -> Result<R, Error> {
        let mut all = R::default();
        for (number, part) in out.chunks_mut(piece.max(1)).enumerate() {
            all.merge(work(number, part)?);
        }
        Ok(all)
    }
}

plain_table! {
    /// Whose sky a lane's memory holds.
    pub struct KeptSky {
        /// 1 where it holds one.
        pub filled: u64,
        /// 1 where a bright spot of the sky is taken for the sun.
        pub spot: u64,
        /// Address of the samples of its table.
        pub samples: u64,
        /// [`SkyRecord::model`] and [`SkyRecord::cie_type`].
        pub model: [u64; 2],
        /// [`SkyRecord::table`].
        pub table: [u64; 3],
        /// [`SkyRecord::up`] and [`SkyRecord::direction`].
        pub directions: [[f64; 3]; 2],
        /// Radiance.
        pub radiance: [f64; MAX_BANDS],
        /// Radiance below the horizon.
        pub ground: [f64; MAX_BANDS],
        /// The reference radiance, by which elements are looked at closer.
        pub reference: [f64; MAX_BANDS],
    }
}

impl KeptSky {
    fn of(sky: &SkyInput<'_>, light: &Light<'_>, reference: &[f64]) -> KeptSky {
        let record = SkyRecord::new(sky);
        let bands = |values: &[f64]| {
            let mut all = [0.0; MAX_BANDS];
            copy(&mut all, values);
            all
        };
        KeptSky {
            filled: 1,
            spot: u64::from(light.sun.is_some_and(|sun| sun.is_of_sky())),
            samples: sky.model.samples().as_ptr() as usize as u64,
            model: [record.model, record.cie_type],
            table: record.table,
            directions: [record.up, record.direction],
            radiance: bands(sky.radiance),
            ground: bands(sky.ground),
            reference: bands(reference),
        }
    }
}

/// A coupling under many lights.
#[derive(Clone, Copy, Debug)]
pub struct Lights<'a> {
    /// The scene.
    pub scene: &'a Scene<'a>,
    /// Its tree.
    pub bvh: &'a Bvh<'a>,
    /// Its elements.
    pub elements: &'a Elements<'a>,
    /// Its coupling.
    pub coupling: &'a Coupling<'a>,
    /// By which the coupling was made.
    pub settings: &'a Settings,
}

/// The sky's part of the light before any reflection, kept from light to light.
struct SkyMemory<'m> {
    head: &'m mut [KeptSky],
    direct: &'m mut [f64],
    straight: &'m mut [f64],
    variance: &'m mut [f32],
}

impl SkyMemory<'_> {
    /// Whether what is kept is of this sky.
    // apart, as is the next: a sky's bands do not burden the stack of solving
    #[inline(never)]
    fn is_of(&self, sky: &SkyInput<'_>, light: &Light<'_>, reference: &[f64]) -> bool {
        self.head.first().is_some_and(|head| *head == KeptSky::of(sky, light, reference))
    }

    /// Notes that what is kept is of this sky.
    #[inline(never)]
    fn note(&mut self, sky: &SkyInput<'_>, light: &Light<'_>, reference: &[f64]) {
        if let Some(head) = self.head.first_mut() {
            *head = KeptSky::of(sky, light, reference);
        }
    }
}

impl Lights<'_> {
    fn shape(&self) -> TableShape {
        settings::shape(self.settings.max_bounces, self.scene.bands())
    }

    /// Values of the sky's irradiance, of the straight sky and of its variance.
    fn sky_values(&self) -> [usize; 3] {
        let (shape, unknowns) = (self.shape(), self.elements.unknowns());
        [unknowns * shape.stride(), unknowns * straight::stride(shape.bands), unknowns]
    }

    fn sky_need(&self) -> Need {
        let [direct, values, variance] = self.sky_values();
        Need::new().and::<KeptSky>(1).and::<f64>(direct).and::<f64>(values).and::<f32>(variance)
    }

    fn sizes(&self, light: &Light<'_>) -> Result<Sizes, Error> {
        Sizes::new((self.scene, self.bvh), self.elements, light, self.settings)
    }

    /// Bytes of a lane's memory, in which it solves one light after the other: the most that any of the lights needs, each
    /// given by its [`Sizes`].
    pub fn bytes(&self, light: &Light<'_>) -> Result<usize, Error> {
        let sizes = self.sizes(light)?;
        let all = self.sky_need().join(sizes.solution.need()).join(sizes.scratch()).and::<u8>(sizes.beams(1));
        Ok(all.bytes()? + ALIGNMENT)
    }

    /// Makes a lane's memory, of any content, ready for its first light.
    pub fn start(&self, memory: &mut [u8]) -> Result<(), Error> {
        let needed = self.sky_need().bytes()?;
        let mut arena = Arena::new(memory, needed)?;
        arena.take::<KeptSky>(1)?.iter_mut().for_each(|kept| kept.filled = 0);
        Ok(())
    }

    /// Solves a light in a lane's memory, that [`Lights::start`] or another light left: the solution stands in it until the
    /// next one. `given` is the reference radiance, if not the light's own.
    ///
    /// # Errors
    /// Those of the stages; [`Error::BufferTooSmall`] where mirrors scatter sunlight over more elements than usual.
    pub fn solve<'m>(
        &self,
        input: &LightInput<'_>,
        light: &Light<'_>,
        given: Option<&[f64]>,
        memory: &'m mut [u8],
    ) -> Result<Solution<'m>, Error> {
        let arena = Arena::new(memory, self.bytes(light)?)?;
        self.solve_in((input, light), given, self.sizes(light)?, arena).map(|(solution, _)| solution)
    }

    /// The same in an arena of all that is left to it, and the scratch memory as the solver leaves it.
    fn solve_in<'m>(
        &self,
        (input, light): (&LightInput<'_>, &Light<'_>),
        given: Option<&[f64]>,
        sizes: Sizes,
        mut arena: Arena<'m>,
    ) -> Result<(Solution<'m>, Scratch<'m>), Error> {
        let Lights { scene, bvh, elements, coupling, settings } = *self;
        let lighting = Lighting { scene, bvh, elements, coupling, light, settings };
        let [direct, values, variance] = self.sky_values();
        let mut kept = SkyMemory {
            head: arena.keep(1)?,
            direct: arena.keep(direct)?,
            straight: arena.keep(values)?,
            variance: arena.keep(variance)?,
        };
        let mut solution = sizes.solution.take(&mut arena)?;
        let mut scratch = sizes.take_scratch(&mut arena)?;
        let beam_memory = arena.keep::<u8>(arena.left().saturating_sub(ALIGNMENT))?;
        lighting.begin(input.reference.or(given), &mut solution, &mut scratch)?;
        let sky = input.sky.as_ref();
        if sky.is_some_and(|sky| kept.is_of(sky, light, solution.reference)) {
            copy(scratch.direct, kept.direct);
            copy(solution.straight, kept.straight);
            copy(solution.straight_variance, kept.variance);
        } else {
            lighting.sky(&mut solution, &mut scratch, &mut Alone)?;
            if let Some(sky) = sky {
                kept.note(sky, light, solution.reference);
                copy(kept.direct, scratch.direct);
                copy(kept.straight, solution.straight);
                copy(kept.variance, solution.straight_variance);
            }
        }
        let mut rays = lighting.sun(&mut solution, &mut Alone)?;
        let mut beams = Beams::default();
        beams.add(&lighting, &mut solution, &mut scratch, beam_memory, &mut Alone)?;
        rays += beams.rays;
        let solution = lighting.solve(solution, &mut scratch, rays, &mut Alone)?;
        Ok((solution, scratch))
    }

    fn explanation_need(&self) -> Result<[usize; 3], Error> {
        let shape = self.shape();
        Ok([
            Importance::need(self.scene, self.elements).bytes()?,
            AdjointMemory::need(self.elements.unknowns(), shape).bytes()?,
            signature::scratch_bytes()?,
        ])
    }

    /// Bytes for [`Lights::explain`] under a light.
    pub fn explain_bytes(&self, light: &Light<'_>) -> Result<usize, Error> {
        let extra = Need::new().and::<f64>(self.elements.unknowns() * self.scene.bands()).bytes()?;
        Ok(self.bytes(light)? + extra + self.explanation_need()?.iter().sum::<usize>())
    }

    /// Solves a light as [`Lights::solve`] does and calls `each` with the number of each view, the solved scene, the view's
    /// signature, and what that is made of and depends on.
    ///
    /// # Errors
    /// Those of [`Lights::solve`]; [`Error::Range`] where reflections are counted (`max_bounces` up to 32): the transposed system
    /// is that of all of them.
    pub fn explain(
        &self,
        (input, light): (&LightInput<'_>, &Light<'_>),
        given: Option<&[f64]>,
        (views, cells): (&[[f64; 3]], usize),
        chains: ChainSettings<'_>,
        memory: &mut [u8],
        mut each: impl FnMut(usize, &Explained<'_>) -> Result<(), Error>,
    ) -> Result<(), Error> {
        if self.shape().levels > 1 {
            let value = self.settings.max_bounces.map_or(0.0, f64::from);
            return Err(Error::Range { field: Field::MaxBounces, band: 0, value });
        }
        let (needed, given_bytes) = (self.explain_bytes(light)?, memory.len());
        let parts = self.explanation_need()?;
        let short = Error::BufferTooSmall { needed, given: given_bytes };
        let split = given_bytes.checked_sub(parts.iter().sum::<usize>()).ok_or(short)?;
        let (memory, rest) = memory.split_at_mut_checked(split).ok_or(short)?;
        let (first, rest) = rest.split_at_mut_checked(parts[0]).ok_or(short)?;
        let (second, scratch_memory) = rest.split_at_mut_checked(parts[1]).ok_or(short)?;
        let sizes = self.sizes(light)?.keeping_first();
        let arena = Arena::new(memory, needed - parts.iter().sum::<usize>())?;
        let (solution, mut scratch) = self.solve_in((input, light), given, sizes, arena)?;
        let Lights { scene, bvh, elements, coupling, settings } = *self;
        let lighting = Lighting { scene, bvh, elements, coupling, light, settings };
        let rows = KnownRows::new(coupling);
        let solved = &Solved { scene, bvh, elements, rows, light, solution, settings: chains };
        for (number, forward) in views.iter().enumerate() {
            let view = (Vec3::from_array(*forward), cells);
            let memory = [&mut *first, &mut *second, &mut *scratch_memory];
            explain_view((&lighting, solved), view, &mut scratch, memory, |found| each(number, found))?;
        }
        Ok(())
    }
}

/// Explains one view, a direction and its cells, and calls `each` with what was found. The memory is for importance,
/// the transposed system and the signature.
// apart: does not burden the stack of solving
#[cfg_attr(target_pointer_width = "32", inline(never))]
fn explain_view(
    (lighting, solved): (&Lighting<'_>, &Solved<'_>),
    (forward, cells): (Vec3, usize),
    scratch: &mut Scratch<'_>,
    [first, second, third]: [&mut [u8]; 3],
    each: impl FnOnce(&Explained<'_>) -> Result<(), Error>,
) -> Result<(), Error> {
    let (scene, elements) = (solved.scene, solved.elements);
    let mut importance = Importance::take(scene, elements, &mut Arena::new(first, 0)?)?;
    let view = View::new(solved, forward, cells)?;
    let sums = signature::explained(solved, &view, third, &mut importance)?;
    let mut adjoint = AdjointMemory::take(elements.unknowns(), solved.shape, &mut Arena::new(second, 0)?)?;
    let report = lighting.differentiate(&solved.solution, scratch, &mut importance, &mut adjoint)?;
    each(&Explained { solved, sums, importance: &importance, report })
}

/// A signature with its parts and derivatives.
#[derive(Debug)]
pub struct Explained<'a> {
    /// The solved scene.
    pub solved: &'a Solved<'a>,
    /// The signature's sums.
    pub sums: &'a Sums,
    /// Shares, terms and derivatives.
    pub importance: &'a Importance<'a>,
    /// How the transposed solution went.
    pub report: AdjointReport,
}
