//! The coupling: extended form factors between the elements of a scene, and what a new light needs instead of rays.

use crate::memory::*;
use crate::run::{Runner, blik_run};
use crate::scene::blik_scene;
use crate::status::*;
use crate::types::*;
use crate::{call, caught};
use blik_kernel::arena::ALIGNMENT;
use blik_kernel::coupling::kept::Fates;
use blik_kernel::coupling::rows::RowSettings;
use blik_kernel::coupling::{ABSENT, Block, Coupling, OPEN};
use blik_kernel::element::Elements;
use blik_kernel::plane_sides::PlaneSides;
use blik_kernel::stages::{self, BlockPlace, CouplingRows};
use blik_kernel::subdivide::{self, SubdivisionTree};
use blik_kernel::{Error, settings};
use core::ffi::c_void;

/// A coupling in memory. Read-only once made: any number of threads may use it at once.
pub struct blik_coupling {
    tag: usize,
    pub(crate) base: &'static blik_scene,
    pub(crate) elements: Elements<'static>,
    pub(crate) blocks: &'static [Block<'static>],
    pub(crate) settings: Settings,
    /// Rays of all rows.
    pub(crate) rays: u64,
    /// What became of its rows.
    pub(crate) fates: Fates,
    /// Rays that were traced for them.
    pub(crate) traced: u64,
    /// Bytes of the caller's memory up to the last that is used; 0: none of it is the caller's.
    pub(crate) extent: usize,
    #[cfg(feature = "std")]
    owner: Option<std::boxed::Box<Owned>>,
}

impl Handle for blik_coupling {
    const TAG: usize = 0x5ce9_e002;

    fn tag(at: *mut Self) -> *mut usize {
        // SAFETY: only the place is computed, within memory of a handle's size.
        unsafe { &raw mut (*at).tag }
    }

    #[cfg(feature = "std")]
    fn owner(&mut self) -> &mut Option<std::boxed::Box<Owned>> {
        &mut self.owner
    }
}

/// Checked [`blik_settings`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Settings {
    pub asked: settings::Settings,
    /// Fewer rays rather than no room.
    pub fit: bool,
}

impl Settings {
    /// # Safety
    /// As for [`read`].
    unsafe fn new(settings: *const blik_settings) -> Result<Settings, blik_error> {
        // SAFETY: by the caller's promise.
        let given = unsafe { read(settings) }?;
        let image = Some(given.image_tolerance).filter(|image| *image != 0.0);
        let asked = settings::Settings {
            max_bounces: u32::try_from(given.max_bounces).ok(),
            all_irradiances: given.all_irradiances != 0,
            directional: given.directional != 0,
            ray_budget: Some(given.ray_budget).filter(|&rays| rays > 0),
            ..settings::Settings::new(given.tolerance, image)?
        };
        Ok(Settings { asked, fit: given.fit_memory != 0 })
    }

    fn rows(&self, base: &blik_scene) -> RowSettings {
        self.asked.rows(&base.scene)
    }

    fn planes(&self, base: &blik_scene) -> bool {
        settings::planes(&base.scene, &self.rows(base))
    }
}

impl blik_coupling {
    pub(crate) fn new(
        base: &'static blik_scene,
        elements: Elements<'static>,
        blocks: &'static [Block<'static>],
        settings: Settings,
    ) -> blik_coupling {
        let rays = Coupling::part(blocks).rays();
        blik_coupling {
            tag: blik_coupling::TAG,
            base,
            elements,
            blocks,
            settings,
            rays,
            fates: Fates { redone: elements.unknowns() as u64, ..Fates::default() },
            traced: rays,
            extent: 0,
            #[cfg(feature = "std")]
            owner: None,
        }
    }

    pub(crate) fn matrix(&self) -> Result<Coupling<'static>, Error> {
        Coupling::new(self.blocks, self.elements.unknowns())
    }
}

/// Numbers of a coupling.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct blik_coupling_info {
    /// Size of this struct.
    pub struct_size: usize,
    /// Elements that the facets are cut into.
    pub elements: usize,
    /// Sides of elements: rows of the coupling.
    pub unknowns: usize,
    /// Form factors kept.
    pub pairs: u64,
    /// Rows that nothing needs: of degenerate facets, or of facets that reflect nothing diffusely.
    pub skipped_rows: u64,
    /// Rows that see the sky alone: no ray was traced.
    pub open_rows: u64,
    /// Rays traced.
    pub rays: u64,
    /// Largest weight of mirror chains that were cut, as a share of the hemisphere: a bound.
    pub dropped: f64,
    /// Bytes in use. Of a coupling that blik_coupling_init made: from the start of its memory, the rest of which is
    /// free again.
    pub bytes: usize,
    /// Facets of its scene, degenerate ones included.
    pub facets: usize,
    /// Sides of a facet that carry its material: 1 or 2.
    pub sides: usize,
    /// Spectral bands.
    pub bands: usize,
}

impl Default for blik_coupling_info {
    fn default() -> blik_coupling_info {
        blik_coupling_info {
            struct_size: size_of::<blik_coupling_info>(),
            elements: 0,
            unknowns: 0,
            pairs: 0,
            skipped_rows: 0,
            open_rows: 0,
            rays: 0,
            dropped: 0.0,
            bytes: 0,
            facets: 0,
            sides: 0,
            bands: 0,
        }
    }
}
sized!(blik_coupling_info from facets);

/// Cuts a block of `size` bytes, of alignment 64, off the front of what is left.
pub(crate) struct Cutter {
    pub start: *mut u8,
    size: usize,
}

impl Cutter {
    /// Of what stands behind a handle.
    pub fn new(rest: &'static mut [u8]) -> Cutter {
        Cutter { start: rest.as_mut_ptr(), size: rest.len() & !(ALIGNMENT - 1) }
    }

    /// Reserved for good.
    fn take(&mut self, size: usize) -> Result<&'static mut [u8], blik_error> {
        let size = size.next_multiple_of(ALIGNMENT);
        if size > self.size {
            return Err(blik_error::of(BLIK_ERROR_BUFFER_TOO_SMALL).sizes(size, self.size));
        }
        // SAFETY: within the caller's memory, and never handed out twice.
        let taken = unsafe { core::slice::from_raw_parts_mut(self.start, size) };
        self.start = self.start.wrapping_add(size);
        self.size -= size;
        Ok(taken)
    }

    /// Reserved at the end, until all else is made.
    pub fn take_back(&mut self, size: usize) -> Result<&'static mut [u8], blik_error> {
        let size = size.next_multiple_of(ALIGNMENT);
        let left = self.size.checked_sub(size);
        self.size = left.ok_or(blik_error::of(BLIK_ERROR_BUFFER_TOO_SMALL).sizes(size, self.size))?;
        // SAFETY: within the caller's memory, and what is left ends before it.
        Ok(unsafe { core::slice::from_raw_parts_mut(self.start.add(self.size), size) })
    }

    /// Lent until the next use: memory that nothing else holds.
    fn lend<'a>(&self) -> &'a mut [u8] {
        // SAFETY: within the caller's memory; callers drop it before they take.
        unsafe { core::slice::from_raw_parts_mut(self.start, self.size) }
    }
}

/// Bytes that elements and their making need at most.
fn element_bytes(base: &blik_scene, settings: &Settings) -> Result<usize, blik_error> {
    let facets = base.scene.facets();
    let most = subdivide::most_elements(facets, settings.asked.budget.solution);
    // facets of clusters and their sums of areas, all nodes, facet and path of each element; the trees while they grow
    let kept = facets
        .saturating_mul(8)
        .saturating_add(most.saturating_mul(4 + 4 + 6))
        .saturating_add(12 * ALIGNMENT);
    Ok(tree_bytes(base, settings)?.saturating_add(kept))
}

/// Bytes of the trees while they grow.
fn tree_bytes(base: &blik_scene, settings: &Settings) -> Result<usize, blik_error> {
    let (asked, scene) = (&settings.asked, &base.scene);
    Ok(SubdivisionTree::bytes(scene.facets(), asked.budget.solution, asked.clusters(scene))?)
}

/// About the most elements that a scene may have.
fn most_elements(base: &blik_scene, settings: &Settings) -> usize {
    let (facets, clusters) = (base.scene.facets(), settings.asked.clusters(&base.scene));
    // large facets stand alone beside the clusters: fewer than these
    let roots = if clusters > 0 { facets.min(2 * clusters) } else { facets };
    subdivide::most_elements(roots, settings.asked.budget.solution)
}

/// How finely each facet is cut.
fn cut<'s>(
    base: &blik_scene,
    plane_sides: &PlaneSides<'_>,
    settings: &Settings,
    runner: &mut Runner,
    scratch: &'s mut [u8],
) -> Result<SubdivisionTree<'s>, blik_error> {
    let mut cut = SubdivisionTree::new(
        &base.scene,
        &settings.asked.budget,
        settings.asked.clusters(&base.scene),
        scratch,
    )?;
    stages::refine(&base.scene, &base.bvh, plane_sides, &settings.asked, &mut cut, runner)?;
    Ok(cut)
}

/// Makes the elements in the caller's memory.
fn elements(
    base: &blik_scene,
    plane_sides: &PlaneSides<'_>,
    settings: &Settings,
    runner: &mut Runner,
    cutter: &mut Cutter,
) -> Result<Elements<'static>, blik_error> {
    // the trees stand at the end of the memory while the elements are made at its front
    let scratch_bytes = tree_bytes(base, settings)?;
    let whole = cutter.lend();
    let keep = whole.len().saturating_sub(scratch_bytes);
    let short = blik_error::of(BLIK_ERROR_BUFFER_TOO_SMALL);
    let (_, scratch) = whole.split_at_mut_checked(keep).ok_or(short)?;
    let cut = cut(base, plane_sides, settings, runner, scratch)?;
    let bytes = Elements::bytes(&cut)?.next_multiple_of(ALIGNMENT);
    if bytes > keep {
        return Err(short.sizes(bytes + scratch_bytes, cutter.size));
    }
    let memory = cutter.take(bytes)?;
    Ok(Elements::new(&base.scene, &cut, memory)?)
}

/// Bytes to begin with: elements, tables of blocks, one row while it grows.
fn least(base: &blik_scene, settings: &Settings) -> Result<usize, blik_error> {
    let mut rows = settings.rows(base);
    while let Some(fewer) = rows.fewer().filter(|_| settings.fit) {
        rows = fewer;
    }
    let unknowns = most_elements(base, settings) * base.scene.sides();
    let row = stages::least_bytes(&base.scene, &rows, unknowns)?;
    let table = stages::places(unknowns) * (size_of::<BlockPlace>() + size_of::<Block<'_>>()) + 4 * ALIGNMENT;
    let planes = PlaneSides::bytes(&base.scene, settings.planes(base))? + ALIGNMENT;
    let parts = [head::<blik_coupling>(), element_bytes(base, settings)?, table, row, planes];
    Ok(parts.iter().fold(0usize, |sum, part| sum.saturating_add(*part)))
}

/// A table of plain places in the caller's memory.
fn table<T: Copy>(cutter: &mut Cutter, count: usize, value: T) -> Result<&'static mut [T], blik_error> {
    let memory = cutter.take(count * size_of::<T>())?;
    const { assert!(align_of::<T>() <= ALIGNMENT) };
    let start = memory.as_mut_ptr().cast::<T>();
    for i in 0..count {
        // SAFETY: within the memory just taken, which is aligned.
        unsafe { start.add(i).write(value) };
    }
    // SAFETY: all places have just been written.
    Ok(unsafe { core::slice::from_raw_parts_mut(start, count) })
}

/// Computes all rows in what is left of the caller's memory, `given` bytes at first; their blocks, which stand there.
pub(crate) fn rows_in(
    cutter: &mut Cutter,
    rows: &CouplingRows<'_>,
    fit: bool,
    given: usize,
    runner: &mut Runner,
) -> Result<&'static [Block<'static>], blik_error> {
    let places = table(cutter, rows.places(), BlockPlace::default())?;
    let room = (places.len() * size_of::<Block<'_>>()).next_multiple_of(ALIGNMENT);
    let size = cutter.size.saturating_sub(room);
    let free = cutter.lend().get_mut(..size).unwrap_or_default();
    let (places, end) = match rows.fill_in(free, places, fit, runner) {
        Err(error) if error.status == BLIK_ERROR_BUFFER_TOO_SMALL => {
            return Err(error.sizes(error.needed.saturating_add(given - size), given));
        }
        done => done?,
    };
    let all: &'static [u8] = cutter.take(end)?;
    let blocks = table(cutter, places.len(), Block::EMPTY)?;
    for (block, place) in blocks.iter_mut().zip(places) {
        *block = place.open(all)?;
    }
    Ok(blocks)
}

/// Builds in the caller's memory.
fn build(
    base: &'static blik_scene,
    settings: &Settings,
    memory: &'static mut [u8],
    runner: &mut Runner,
) -> Result<*mut blik_coupling, blik_error> {
    let (given, start) = (memory.len(), memory.as_ptr() as usize);
    let least = least(base, settings)?;
    if given < least {
        return Err(blik_error::of(BLIK_ERROR_BUFFER_TOO_SMALL).sizes(least, given));
    }
    let (place, rest) = place::<blik_coupling>(memory)?;
    let mut cutter = Cutter::new(rest);
    let planes = cutter.take_back(PlaneSides::bytes(&base.scene, settings.planes(base))?)?;
    let plane_sides = PlaneSides::new(&base.scene, &base.bvh, settings.planes(base), planes)?;
    let elements = elements(base, &plane_sides, settings, runner, &mut cutter)?;
    let rows = settings.asked.rows_within(&base.scene, elements.unknowns());
    let (bvh, scene) = (&base.bvh, &base.scene);
    let rows = CouplingRows { scene, bvh, elements: &elements, plane_sides: &plane_sides, rows, kept: None };
    let blocks = rows_in(&mut cutter, &rows, settings.fit, given, runner)?;
    let extent = cutter.start as usize - start;
    // SAFETY: `place` made room for it.
    unsafe { place.write(blik_coupling { extent, ..blik_coupling::new(base, elements, blocks, *settings) }) };
    Ok(place.as_ptr())
}

/// Bytes of memory with which [`blik_coupling_init`] can begin. What the rows take is not known before they are computed:
///
/// ```c
/// for (;;) {
///     memory = realloc(memory, bytes);
///     status = blik_coupling_init(scene, &settings, NULL, memory, bytes, &error, &coupling);
///     if (status != BLIK_ERROR_BUFFER_TOO_SMALL) break;
///     bytes = error.needed;
/// }
/// ```
///
/// - `scene`: the scene
/// - `settings`: the settings
/// - `bytes`: receives the bytes
///
/// # Safety
/// Pointers are null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_coupling_size(
    scene: *const blik_scene,
    settings: *const blik_settings,
    error: *mut blik_error,
    bytes: *mut usize,
) -> blik_status {
    call(error, || {
        let to = needed(bytes)?;
        // SAFETY: by the caller's promise.
        let (base, settings) = unsafe { (object(scene)?, Settings::new(settings)?) };
        let size = least(base, &settings)?;
        // SAFETY: not null.
        unsafe { to.write(size) };
        Ok(())
    })
}

/// Computes the coupling of a scene in the caller's memory: once for a mesh and its materials, whatever the light. Where the
/// memory does not suffice, `error->needed` is an extrapolation from the rows done.
///
/// - `scene`: the scene, which must outlive the coupling
/// - `settings`: the settings
/// - `coupling`: receives the coupling
///
/// # Safety
/// Pointers are null or valid; nobody else uses the memory while the coupling is in use.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_coupling_init(
    scene: *const blik_scene,
    settings: *const blik_settings,
    run: *const blik_run,
    memory: *mut c_void,
    size: usize,
    error: *mut blik_error,
    coupling: *mut *mut blik_coupling,
) -> blik_status {
    call(error, || {
        let to = needed(coupling)?;
        // SAFETY: by the caller's promise.
        let (base, settings, mut runner, memory) =
            unsafe { (object(scene)?, Settings::new(settings)?, Runner::new(run)?, bytes(memory, size)?) };
        let made = build(base, &settings, memory, &mut runner)?;
        // SAFETY: not null.
        unsafe { to.write(made) };
        Ok(())
    })
}

/// Computes the coupling of a scene in memory of its own.
///
/// - `scene`: the scene, which must outlive the coupling
/// - `settings`: the settings
/// - `coupling`: receives the coupling; to be ended by [`blik_coupling_destroy`]
///
/// # Safety
/// Pointers are null or valid.
#[cfg(feature = "std")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_coupling_create(
    scene: *const blik_scene,
    settings: *const blik_settings,
    run: *const blik_run,
    error: *mut blik_error,
    coupling: *mut *mut blik_coupling,
) -> blik_status {
    call(error, || {
        let to = needed(coupling)?;
        // SAFETY: by the caller's promise.
        let (base, settings, mut runner) =
            unsafe { (object(scene)?, Settings::new(settings)?, Runner::new(run)?) };
        let made = owned::build(base, &settings, &mut runner)?;
        // SAFETY: not null.
        unsafe { to.write(made) };
        Ok(())
    })
}

/// Ends a coupling and frees what it owns.
///
/// - `coupling`: the coupling, whose solutions have ended before; null: nothing
///
/// # Safety
/// Null or a coupling that nobody uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_coupling_destroy(coupling: *mut blik_coupling) {
    let _ = caught(|| {
        // SAFETY: by the caller's promise.
        unsafe { end(coupling) };
        Ok(())
    });
}

/// Numbers of a coupling; reads all of it.
///
/// - `coupling`: the coupling
/// - `info`: receives them; its `struct_size` is set before
///
/// # Safety
/// Pointers are null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_coupling_get_info(
    coupling: *const blik_coupling,
    error: *mut blik_error,
    info: *mut blik_coupling_info,
) -> blik_status {
    call(error, || {
        // SAFETY: by the caller's promise.
        let (to, coupling) = unsafe { (Place::new(info)?, object(coupling)?) };
        to.write(coupling.info()?);
        Ok(())
    })
}

impl blik_coupling {
    pub(crate) fn info(&self) -> Result<blik_coupling_info, blik_error> {
        let matrix = self.matrix()?;
        let mut info = blik_coupling_info {
            struct_size: size_of::<blik_coupling_info>(),
            elements: self.elements.count(),
            unknowns: self.elements.unknowns(),
            pairs: 0,
            skipped_rows: 0,
            open_rows: 0,
            rays: self.rays,
            dropped: 0.0,
            bytes: self.extent.max(matrix.memory() + self.elements.memory()),
            facets: self.base.scene.facets(),
            sides: self.base.scene.sides(),
            bands: self.base.scene.bands(),
        };
        for (_, row) in matrix.rows(0..matrix.unknowns()) {
            info.pairs += row.targets.len() as u64;
            info.dropped = info.dropped.max(row.row.truncated_weight);
            info.skipped_rows += u64::from(row.row.state == ABSENT);
            info.open_rows += u64::from(row.row.state == OPEN);
        }
        Ok(info)
    }
}

/// Building in memory of the library's own, as much as it takes.
#[cfg(feature = "std")]
pub(crate) mod owned {
    use super::*;
    use blik_kernel::stages::BlockMemory;
    use std::boxed::Box;
    use std::vec::Vec;

    /// Block by block, each lane as it goes.
    pub fn build(
        base: &'static blik_scene,
        settings: &Settings,
        runner: &mut Runner,
    ) -> Result<*mut blik_coupling, blik_error> {
        let mut planes = Slab::new(PlaneSides::bytes(&base.scene, settings.planes(base))?)?;
        // SAFETY: dropped at the end of this function, after the last use.
        let plane_sides =
            PlaneSides::new(&base.scene, &base.bvh, settings.planes(base), unsafe { planes.bytes_mut() })?;
        let mut scratch = Slab::new(tree_bytes(base, settings)?)?;
        // SAFETY: dropped at the end of this function, after the last use.
        let cut = cut(base, &plane_sides, settings, runner, unsafe { scratch.bytes_mut() })?;
        let mut own = Slab::new(Elements::bytes(&cut)?)?;
        // SAFETY: the handle owns the slab.
        let elements = Elements::new(&base.scene, &cut, unsafe { own.bytes_mut() })?;
        let rows = settings.asked.rows_within(&base.scene, elements.unknowns());
        let (bvh, scene) = (&base.bvh, &base.scene);
        let rows =
            CouplingRows { scene, bvh, elements: &elements, plane_sides: &plane_sides, rows, kept: None };
        let (mut slabs, blocks) = fill(&rows, runner)?;
        slabs.push(own);
        place_blocks(slabs, &blocks, |blocks| blik_coupling::new(base, elements, blocks, *settings))
    }

    /// Computes all rows; the slabs in which the blocks stand, and these.
    pub fn fill(
        rows: &CouplingRows<'_>,
        runner: &mut Runner,
    ) -> Result<(Vec<Slab>, Vec<Block<'static>>), blik_error> {
        let mut pieces: Vec<Slabs> = (0..rows.pieces()).map(|_| Slabs::default()).collect();
        rows.fill(&mut pieces, runner)?;
        let slabs: Vec<Slab> = pieces.into_iter().flat_map(|piece| piece.blocks).collect();
        // SAFETY: the handle that is made of them owns the slabs.
        let blocks =
            slabs.iter().map(|s| Block::open(unsafe { s.bytes() })).collect::<Result<Vec<_>, _>>()?;
        Ok((slabs, blocks))
    }

    /// A handle over blocks, which owns the slabs.
    pub fn place_blocks(
        mut slabs: Vec<Slab>,
        blocks: &[Block<'static>],
        handle: impl FnOnce(&'static [Block<'static>]) -> blik_coupling,
    ) -> Result<*mut blik_coupling, blik_error> {
        let bytes = head::<blik_coupling>() + size_of_val(blocks) + ALIGNMENT;
        let mut front = Slab::new(bytes)?;
        // SAFETY: the handle owns the slab.
        let (place, rest) = place::<blik_coupling>(unsafe { front.bytes_mut() })?;
        let mut cutter = Cutter { start: rest.as_mut_ptr(), size: rest.len() };
        let kept = table(&mut cutter, blocks.len(), Block::EMPTY)?;
        kept.copy_from_slice(blocks);
        slabs.push(front);
        let mut handle = handle(kept);
        handle.owner = Some(Box::new(Owned(slabs)));
        // SAFETY: `place` made room for it.
        unsafe { place.write(handle) };
        Ok(place.as_ptr())
    }

    /// Memory of one piece's blocks, each of its own.
    #[derive(Default)]
    struct Slabs {
        blocks: Vec<Slab>,
        kept: usize,
    }

    impl BlockMemory for Slabs {
        fn lend(&mut self, bytes: usize) -> Result<&mut [u8], Error> {
            self.blocks.truncate(self.kept);
            self.blocks.push(Slab::new(bytes).map_err(|_| Error::OutOfMemory { bytes })?);
            // SAFETY: the bytes are lent until the next call, and the slab stays where it is until then.
            Ok(self.blocks.last_mut().map(|slab| unsafe { slab.bytes_mut() }).unwrap_or_default())
        }

        fn keep(&mut self, bytes: usize) {
            if let Some(slab) = self.blocks.last_mut() {
                slab.shrink(bytes);
            }
            self.kept = self.blocks.len();
        }
    }
}
