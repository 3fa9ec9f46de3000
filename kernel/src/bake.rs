//! A scene with its tree, its elements, its coupling and, if wanted, its solution as one block of bytes that can be
//! kept, sent and put into read-only memory: relocatable, read without a copy.
//!
//! A block starts on a boundary of [`ALIGNMENT`]. Its head tells version, byte order, size and checksum; arrays follow
//! in fixed order, each on a boundary. [`Baked::load`] checks everything on which the kernel relies: whatever the bytes
//! are, what it lets through makes no call panic, run without end or give NaN. (A block that was forged with a right
//! checksum may still show a wrong image.)
//!
//! The byte order and the layout of numbers are those of the machine that wrote it: little-endian machines of 32 and of
//! 64 bits read each other's blocks.

use crate::base::arena::{ALIGNMENT, View, Writer, plain_struct};
use crate::base::error::Error;
use crate::base::index::Index;
use crate::base::simd::Isa;
use crate::coupling::Block;
use crate::coupling::element::Elements;
use crate::radiosity::direct::TableShape;
use crate::radiosity::solution::{self, Numbers};
use crate::radiosity::straight::{self, BY_ROWS, Straight};
use crate::radiosity::sun_image::{self, SunImages};
use crate::rays::bvh::Bvh;
use crate::scene::light;
use crate::scene::sky::record::SkyRecord;
use crate::scene::sky::{Sky, SkyInput};
use crate::scene::sun::{Sun, SunInput};
use crate::scene::{MAX_BANDS, Scene};
use crate::settings::{self, Settings};

/// Version of the layout; another one is refused.
pub const VERSION: u64 = 6;

/// "BLIKBAKE"; its bytes tell the byte order.
const MAGIC: u64 = u64::from_le_bytes(*b"BLIKBAKE");

/// Place of the checksum among the 64-bit words.
const CHECKSUM: usize = 3;

plain_struct! {
    /// What stands first.
    pub struct Head {
        /// "BLIKBAKE" in the machine's byte order.
        pub magic: u64,
        /// [`VERSION`].
        pub version: u64,
        /// Bytes of the whole block.
        pub bytes: u64,
        /// Of all 64-bit words, this one taken as 0.
        pub checksum: u64,
        /// The wanted error.
        pub tolerance: f64,
        /// Largest number of reflections; `u64::MAX`: by tolerance.
        pub max_bounces: u64,
        /// Bit 0: irradiance of all facets is wanted; bit 1: directions are kept.
        pub flags: u64,
        /// Blocks of the coupling.
        pub blocks: u64,
        /// 1 where a solution follows.
        pub solved: u64,
    }
}

/// Light and its solution.
#[derive(Clone, Copy, Debug)]
pub struct Solution<'m> {
    /// The sky.
    pub sky: Option<SkyInput<'m>>,
    /// The sun.
    pub sun: Option<SunInput<'m>>,
    /// As [`light::Light::emission`].
    pub emission: &'m [f64],
    /// The solved scene.
    pub record: solution::Solution<'m>,
}

plain_struct! {
    /// The light without its arrays.
    pub struct LightHead {
        /// The sky; of model 0 where there is none.
        pub sky: SkyRecord,
        /// 1 where there is a sun.
        pub sun: u64,
        /// Toward the sun.
        pub sun_direction: [f64; 3],
        /// Half angle of the sun.
        pub half_angle_deg: f64,
        /// 1 where facets have an emission of their own.
        pub emission: u64,
        /// 1 where mirrors reflect sunlight onto facets.
        pub images: u64,
        /// 1 where outlines tell the straight sky.
        pub straight: u64,
    }
}

/// Everything that is baked.
#[derive(Clone, Copy, Debug)]
pub struct Baked<'m> {
    /// The scene.
    pub scene: Scene<'m>,
    /// Its tree.
    pub bvh: Bvh<'m>,
    /// Its elements.
    pub elements: Elements<'m>,
    /// Blocks of the coupling, packed ([`crate::coupling::pack`]).
    pub blocks: &'m [Block<'m>],
    /// What decided the coupling.
    pub settings: Settings,
    /// The solution, if any.
    pub solution: Option<Solution<'m>>,
}

/// The words of a block mixed to one number; its own place counts as 0.
fn checksum(bytes: &[u8]) -> u64 {
    let mut sum = 0x9e37_79b9_7f4a_7c15_u64;
    for (at, word) in bytes.as_chunks::<8>().0.iter().enumerate() {
        let word = if at == CHECKSUM { 0 } else { u64::from_ne_bytes(*word) };
        sum = (sum ^ word).wrapping_mul(0xff51_afd7_ed55_8ccd);
        sum ^= sum >> 32;
    }
    sum
}

/// One value for each of `bands` bands; zeros beyond what there is.
fn put_bands(writer: &mut Writer<'_>, values: &[f64], bands: usize) -> Result<(), Error> {
    let mut all = [0.0; MAX_BANDS];
    crate::base::index::copy(&mut all, values);
    writer.put(all.head(bands))
}

impl<'m> Baked<'m> {
    /// Bytes that [`Baked::write`] needs.
    pub fn bytes(&self) -> Result<usize, Error> {
        let mut writer = Writer::counting();
        self.put(&mut writer, Head::default())?;
        Ok(writer.extent().next_multiple_of(ALIGNMENT))
    }

    /// Writes the block to `memory`, which starts on a boundary of [`ALIGNMENT`], and returns its size.
    pub fn write(&self, memory: &mut [u8]) -> Result<usize, Error> {
        let (bytes, given) = (self.bytes()?, memory.len());
        let memory = memory.get_mut(..bytes).ok_or(Error::BufferTooSmall { needed: bytes, given })?;
        memory.fill(0);
        let mut head = Head {
            magic: MAGIC,
            version: VERSION,
            bytes: bytes as u64,
            checksum: 0,
            tolerance: self.settings.budget.solution,
            max_bounces: self.settings.max_bounces.map_or(u64::MAX, u64::from),
            flags: u64::from(self.settings.all_irradiances) | u64::from(self.settings.directional) << 1,
            blocks: self.blocks.len() as u64,
            solved: u64::from(self.solution.is_some()),
        };
        self.put(&mut Writer::new(&mut *memory), head)?;
        head.checksum = checksum(memory);
        let mut writer = Writer::new(memory);
        writer.put(&[head])?;
        Ok(bytes)
    }

    fn put(&self, writer: &mut Writer<'_>, head: Head) -> Result<(), Error> {
        writer.put(&[head])?;
        self.scene.put(writer)?;
        self.bvh.put(writer)?;
        self.elements.put(writer)?;
        for block in self.blocks {
            block.put(writer)?;
        }
        match &self.solution {
            Some(solution) => solution.put(writer, self.scene.bands()),
            None => Ok(()),
        }
    }

    /// How many blocks of coupling the block in `memory` holds: room that [`Baked::load`] needs. The head alone is
    /// checked.
    pub fn count(memory: &[u8]) -> Result<usize, Error> {
        let head = head(memory)?;
        // every block has a head of its own
        if head.blocks > head.bytes / ALIGNMENT as u64 {
            return Err(Error::Block);
        }
        Ok(head.blocks as usize)
    }

    /// Checks the block in `memory`, which starts on a boundary of [`ALIGNMENT`], and reads it; `blocks` has as many
    /// places as [`Baked::count`] says, of any content.
    ///
    /// # Errors
    /// [`Error::Block`] for anything that is not as it should be.
    pub fn load(memory: &'m [u8], isa: Isa, blocks: &'m mut [Block<'m>]) -> Result<Baked<'m>, Error> {
        let head = head(memory)?;
        let memory = memory.get(..head.bytes as usize).ok_or(Error::Block)?;
        let wanted = Baked::count(memory)?;
        if blocks.len() != wanted || checksum(memory) != head.checksum {
            return Err(Error::Block);
        }
        // in one place of the stack: it is large
        let mut baked = Baked::read(&head, memory, isa, blocks);
        let sound = baked.as_ref().is_ok_and(|baked| {
            baked.solution.as_ref().is_none_or(|solution| solution.has_light(&baked.scene))
        });
        if !sound {
            baked = Err(Error::Block);
        }
        baked
    }

    // apart: does not burden the stack of checking the light
    #[inline(never)]
    fn read(
        head: &Head,
        memory: &'m [u8],
        isa: Isa,
        blocks: &'m mut [Block<'m>],
    ) -> Result<Baked<'m>, Error> {
        let max_bounces = match head.max_bounces {
            u64::MAX => None,
            most => Some(u32::try_from(most).map_err(|_| Error::Block)?),
        };
        let settings = Settings {
            max_bounces,
            all_irradiances: head.flags & 1 != 0,
            directional: head.flags & 2 != 0,
            ..Settings::new(head.tolerance, None)?
        };
        let mut view = View::new(memory);
        view.take::<Head>(1)?;
        let scene = Scene::get(&mut view)?;
        let bvh = Bvh::get(&mut view, &scene, isa)?;
        let elements = Elements::get(&mut view, &scene)?;
        let mut next = 0;
        for place in blocks.iter_mut() {
            *place = Block::get(&mut view, &scene, &elements, settings.directional)?;
            if place.range().start != next || place.range().is_empty() {
                return Err(Error::Block);
            }
            next = place.range().end;
        }
        if next != elements.unknowns() || head.flags > 3 || head.solved > 1 {
            return Err(Error::Block);
        }
        let shape = settings::shape(max_bounces, scene.bands());
        let solved = head.solved == 1;
        let solution = solved.then(|| Solution::get(&mut view, &elements, shape)).transpose()?;
        Ok(Baked { scene, bvh, elements, blocks, settings, solution })
    }
}

/// The head, of this version and byte order, its size within the memory.
fn head(memory: &[u8]) -> Result<Head, Error> {
    if memory.as_ptr().align_offset(ALIGNMENT) != 0 {
        return Err(Error::Block);
    }
    let head = View::new(memory).take::<Head>(1).map_err(|_| Error::Block)?.first().copied();
    let head = head.ok_or(Error::Block)?;
    let right = head.magic == MAGIC && head.version == VERSION;
    if !right || head.bytes > memory.len() as u64 || head.bytes % ALIGNMENT as u64 != 0 {
        return Err(Error::Block);
    }
    Ok(head)
}

impl<'m> Solution<'m> {
    fn put(&self, writer: &mut Writer<'_>, bands: usize) -> Result<(), Error> {
        let mut head = LightHead::default();
        let (mut radiance, mut ground, mut samples): (&[f64], &[f64], &[f32]) = (&[], &[], &[]);
        if let Some(sky) = &self.sky {
            (radiance, ground, samples) = (sky.radiance, sky.ground, sky.model.samples());
            head.sky = SkyRecord::new(sky);
        }
        if let Some(sun) = &self.sun {
            (head.sun, head.sun_direction, head.half_angle_deg) = (1, sun.direction, sun.half_angle_deg);
        }
        let solution::Solution { reference, irradiance, straight, sun, images, variance, numbers, .. } =
            self.record;
        head.emission = u64::from(!self.emission.is_empty());
        head.images = u64::from(!images.slots.is_empty());
        head.straight = u64::from(!straight.variance.is_empty());
        writer.put(&[head])?;
        put_bands(writer, radiance, bands)?;
        put_bands(writer, ground, bands)?;
        put_bands(writer, self.sun.map_or(&[], |s| s.irradiance), bands)?;
        writer.put(samples)?;
        writer.put(self.emission)?;
        writer.put(&[numbers])?;
        writer.put(reference)?;
        writer.put(irradiance)?;
        writer.put(straight.values)?;
        writer.put(straight.variance)?;
        writer.put(sun)?;
        writer.put(variance)?;
        writer.put(images.slots)?;
        writer.put(images.reflected_irradiance)
    }

    fn get(view: &mut View<'m>, elements: &Elements<'_>, shape: TableShape) -> Result<Solution<'m>, Error> {
        let (bands, unknowns) = (shape.bands, elements.unknowns());
        let head = view.take::<LightHead>(1)?.first().copied().ok_or(Error::Block)?;
        let (radiance, ground) = (view.take::<f64>(bands)?, view.take::<f64>(bands)?);
        let irradiance = view.take::<f64>(bands)?;
        let samples = view.take::<f32>(head.sky.samples().ok_or(Error::Block)?)?;
        let sky = match head.sky.model {
            0 => None,
            _ => Some(head.sky.input(radiance, ground, samples).ok_or(Error::Block)?),
        };
        let (direction, half_angle_deg) = (head.sun_direction, head.half_angle_deg);
        let sun = (head.sun == 1).then_some(SunInput { direction, irradiance, half_angle_deg });
        if let Some(sky) = &sky {
            Sky::new(sky, bands)?;
        }
        if let Some(sun) = &sun {
            Sun::new(sun, bands)?;
        }
        let emitters = if head.emission != 0 { elements.facet_sides() } else { 0 };
        let emission = view.take::<f64>(emitters.checked_mul(bands).ok_or(Error::Block)?)?;
        let numbers = view.take::<Numbers>(1)?.first().copied().ok_or(Error::Block)?;
        let reference = view.take::<f64>(bands)?;
        let irradiance = view.take::<f64>(unknowns.checked_mul(shape.stride()).ok_or(Error::Block)?)?;
        let seen = if head.straight != 0 { unknowns } else { 0 };
        let values = view.take::<f64>(seen.checked_mul(straight::stride(bands)).ok_or(Error::Block)?)?;
        let straight = Straight { values, variance: view.take::<f32>(seen)? };
        let (lit, variance) = (view.take::<f64>(unknowns)?, view.take::<f32>(unknowns)?);
        let mut images = SunImages::default();
        if head.images != 0 {
            let sides = elements.facet_sides();
            let slots = view.take::<u64>(sun_image::places(sides))?;
            let reflected_irradiance = view.take::<f64>(unknowns * shape.levels * bands)?;
            images = SunImages::new(slots, reflected_irradiance, sides, unknowns, shape)?;
        }
        let record = solution::Solution {
            shape,
            reference,
            irradiance,
            straight,
            sun: lit,
            images,
            variance,
            numbers,
        };
        let solution = Solution { sky, sun, emission, record };
        solution.check()?;
        Ok(solution)
    }

    /// Values within what the kernel makes.
    fn check(&self) -> Result<(), Error> {
        let record = &self.record;
        let positive = |x: &f64| (0.0..=1e300).contains(x);
        // irradiance: pi times the largest radiance, gradients some times that
        let right = record.irradiance.iter().all(|x| x.abs() <= 1e40)
            && record.straight.values.iter().all(|x| x.abs() <= 1e40)
            && record.straight.variance.iter().all(|x| *x == BY_ROWS || (0.0..=f32::MAX).contains(x))
            && record.sun.iter().all(|x| (0.0..=1.0 + 1e-9).contains(x))
            && record.images.reflected_irradiance.iter().all(|x| (0.0..=1e40).contains(x))
            && record.variance.iter().all(|x| (0.0..=f32::MAX).contains(x))
            && record.reference.iter().all(|x| (0.0..=1e38).contains(x))
            && positive(&record.numbers.brightest)
            && record.numbers.solver >= 0.0;
        if right { Ok(()) } else { Err(Error::Block) }
    }

    /// Whether the kernel takes its light.
    // apart, as the light is large
    #[inline(never)]
    fn has_light(&self, scene: &Scene<'_>) -> bool {
        self.light(scene).is_ok()
    }

    /// The kernel's light.
    pub fn light(&self, scene: &Scene<'_>) -> Result<light::Light<'m>, Error> {
        light::LightInput { sky: self.sky, sun: self.sun, emission: self.emission, reference: None }
            .light(scene)
    }
}
