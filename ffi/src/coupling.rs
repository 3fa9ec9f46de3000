//! The coupling: extended form factors between the elements of a scene, and what a new light needs instead of rays.

use crate::memory::*;
use crate::run::{MOST_LANES, Runner, Start, Turns, blik_run};
use crate::scene::blik_scene;
use crate::status::*;
use crate::types::*;
use crate::{call, caught};
use blik_kernel::arena::ALIGNMENT;
use blik_kernel::coupling::pack::{move_down, pack};
use blik_kernel::coupling::rows::{RowSettings, fill};
use blik_kernel::coupling::{ABSENT, Block, Coupling, OPEN, sink};
use blik_kernel::element::Elements;
use blik_kernel::facing::Facing;
use blik_kernel::stages::{Executor, block_rows as piece};
use blik_kernel::subdivide::{self, Cut};
use blik_kernel::{Error, settings};
use core::ffi::c_void;
use core::ops::Range;

/// A coupling in memory. Read-only once made: any number of threads may use it at once.
pub struct blik_coupling {
    tag: usize,
    pub(crate) base: &'static blik_scene,
    pub(crate) elements: Elements<'static>,
    pub(crate) blocks: &'static [Block<'static>],
    pub(crate) settings: Settings,
    /// Rays of all rows.
    pub(crate) rays: u64,
    /// Bytes of the caller's memory up to the last that is used; 0: none of it is the caller's.
    extent: usize,
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
        blik_coupling {
            tag: blik_coupling::TAG,
            base,
            elements,
            blocks,
            settings,
            rays: Coupling::part(blocks).rays(),
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
}

/// Share of the progress that elements take.
const PROBING: f64 = 0.1;

/// Cuts a block of `size` bytes, of alignment 64, off the front of what is left.
struct Cutter {
    start: *mut u8,
    size: usize,
}

impl Cutter {
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
    fn take_back(&mut self, size: usize) -> Result<&'static mut [u8], blik_error> {
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
fn element_bytes(base: &blik_scene, tolerance: f64) -> Result<usize, blik_error> {
    let facets = base.scene.facets();
    let most = subdivide::most_elements(facets, tolerance);
    // first element of each facet, all nodes, facet and path of each element; the trees while they grow
    let kept =
        facets.saturating_mul(4).saturating_add(most.saturating_mul(4 + 4 + 6)).saturating_add(8 * ALIGNMENT);
    Ok(Cut::bytes(facets, tolerance)?.saturating_add(kept))
}

/// How finely each facet is cut.
fn cut<'s>(
    base: &blik_scene,
    facing: &Facing<'_>,
    settings: &Settings,
    runner: &mut Runner,
    scratch: &'s mut [u8],
) -> Result<Cut<'s>, blik_error> {
    let tolerance = settings.asked.tolerance;
    let mut cut = Cut::new(&base.scene, tolerance, scratch)?;
    let probing = settings::probing(&settings.rows(base));
    loop {
        let (work, unevenness) = cut.work();
        runner.rows(unevenness, 1, PROBING, |range, out| {
            work.probe(&base.scene, &base.bvh, facing, (probing, tolerance), range, out).map(|_| ())
        })?;
        if !cut.refine(&base.scene) {
            return Ok(cut);
        }
    }
}

/// Makes the elements in the caller's memory.
fn elements(
    base: &blik_scene,
    facing: &Facing<'_>,
    settings: &Settings,
    runner: &mut Runner,
    cutter: &mut Cutter,
) -> Result<Elements<'static>, blik_error> {
    // the trees stand at the end of the memory while the elements are made at its front
    let scratch_bytes = Cut::bytes(base.scene.facets(), settings.asked.tolerance)?;
    let whole = cutter.lend();
    let keep = whole.len().saturating_sub(scratch_bytes);
    let short = blik_error::of(BLIK_ERROR_BUFFER_TOO_SMALL);
    let (_, scratch) = whole.split_at_mut_checked(keep).ok_or(short)?;
    let cut = cut(base, facing, settings, runner, scratch)?;
    let bytes = Elements::bytes(&cut)?.next_multiple_of(ALIGNMENT);
    if bytes > keep {
        return Err(short.sizes(bytes + scratch_bytes, cutter.size));
    }
    let memory = cutter.take(bytes)?;
    Ok(Elements::new(&base.scene, &cut, memory)?)
}

/// Where a finished block stands.
#[derive(Clone, Copy, Debug, Default)]
struct Spot {
    first: usize,
    rows: usize,
    at: usize,
    size: usize,
}

/// Fills all rows into the caller's memory: first each lane its share of rows in its share of the memory, then one
/// after the other what did not fit; blocks are moved together after each round.
struct Filler<'a> {
    base: &'a blik_scene,
    elements: &'a Elements<'static>,
    facing: &'a Facing<'a>,
    rows: &'a RowSettings,
    /// Memory for the blocks.
    start: Start<u8>,
    size: usize,
    /// The blocks so far.
    spots: &'a mut [Spot],
    used: usize,
    end: usize,
}

impl Filler<'_> {
    /// One lane's work: as many rows of `range` as `region` holds, which end up packed at its front.
    fn lane(
        &self,
        range: Range<usize>,
        region: Range<usize>,
        note: &(dyn Fn(Spot) -> bool + Sync),
    ) -> Result<(), Error> {
        let bands = self.base.scene.bands();
        let unmerged = settings::unmerged(self.rows);
        let (mut next, mut at, mut records) = (range.start, region.start, 64);
        while next < range.end {
            let until = (next + piece(self.elements.unknowns())).min(range.end);
            let wanted = sink::bytes(until - next, records, unmerged, bands)?.next_multiple_of(ALIGNMENT);
            let size = wanted.min(region.end.saturating_sub(at));
            // SAFETY: within this lane's region, which no other lane touches, behind its finished blocks.
            let memory = unsafe { core::slice::from_raw_parts_mut(self.start.at(at), size) };
            let done = match fill(
                &self.base.scene,
                &self.base.bvh,
                self.elements,
                self.facing,
                self.rows,
                next..until,
                memory,
            ) {
                Ok(done) => done,
                // the next round gives the rest more memory
                Err(Error::BufferTooSmall { .. }) => return Ok(()),
                Err(error) => return Err(error),
            };
            records = 64.max(Block::open(memory)?.records() / done.max(1) + 16);
            let size = pack(memory)?.next_multiple_of(ALIGNMENT);
            if !note(Spot { first: next, rows: done, at, size }) {
                return Ok(());
            }
            (next, at) = (next + done, at + size);
        }
        Ok(())
    }

    /// The first gap in the rows that are done at or after `from`.
    fn gap(&self, from: usize) -> Range<usize> {
        let all = self.elements.unknowns();
        let spots = || self.spots.iter().take(self.used);
        let mut start = from;
        while let Some(spot) = spots().find(|s| s.first <= start && start < s.first + s.rows) {
            start = spot.first + spot.rows;
        }
        let end = spots().map(|s| s.first).filter(|first| *first >= start).min().unwrap_or(all);
        start.min(all)..end.min(all)
    }

    /// One round with `lanes` lanes over one gap; true where it did any row.
    fn round(
        &mut self,
        gap: Range<usize>,
        lanes: usize,
        share: f64,
        runner: &mut Runner,
    ) -> Result<bool, blik_error> {
        let before = self.used;
        let spots = Start(self.spots.as_mut_ptr());
        let (room, most) = (Turns::new(self.used), self.spots.len());
        let note = |spot: Spot| {
            room.with(|used| {
                if *used >= most {
                    return false;
                }
                // SAFETY: within the spots, one thread at a time, each place once.
                unsafe { spots.at(*used).write(spot) };
                *used += 1;
                true
            })
        };
        let part = ((self.size - self.end) / lanes.max(1)) & !(ALIGNMENT - 1);
        let this = &*self;
        // every lane is one item, so that its region has one owner
        runner.each(lanes, lanes, share, &|_, lane| {
            let cut = |i: usize| gap.start + gap.len() * i / lanes.max(1);
            let start = this.end + lane * part;
            Ok(this.lane(cut(lane)..cut(lane + 1), start..start + part, &note)?)
        })?;
        self.used = room.into_inner();
        let done = self.spots.get_mut(before..self.used).unwrap_or_default();
        sort(done, |s| s.at);
        for spot in done {
            // SAFETY: all lanes have ended: the memory is this thread's alone.
            let memory = unsafe { core::slice::from_raw_parts_mut(self.start.at(0), self.size) };
            move_down(memory, spot.at, self.end, spot.size);
            spot.at = self.end;
            self.end += spot.size;
        }
        Ok(self.used > before)
    }

    /// All rounds.
    fn run(&mut self, runner: &mut Runner) -> Result<(), blik_error> {
        let all = self.elements.unknowns();
        let lanes = runner.lanes().min(all.div_ceil(16)).max(1);
        let left = 1.0 - PROBING;
        let mut gap = 0..all;
        if lanes > 1 {
            self.round(gap, lanes, 0.9 * left, runner)?;
            gap = self.gap(0);
        }
        while !gap.is_empty() {
            let share = if lanes > 1 { 0.1 } else { 1.0 } * left * gap.len() as f64 / all as f64;
            // one piece at a time, so that progress is told and a stop is heard
            let next = gap.start..gap.end.min(gap.start + piece(all));
            let own = share * next.len() as f64 / gap.len() as f64;
            if !self.round(next, 1, own, runner)? {
                return Err(self.short());
            }
            gap = self.gap(gap.start);
        }
        Ok(())
    }

    /// How much memory the rows done so far say that all need.
    fn short(&self) -> blik_error {
        let all = self.elements.unknowns();
        let done: usize = self.spots.iter().take(self.used).map(|s| s.rows).sum();
        let per_row = self.end.checked_div(done).unwrap_or(0);
        let fixed = sink::bytes(1, 64, settings::unmerged(self.rows), self.base.scene.bands()).unwrap_or(0);
        let needed = per_row.saturating_mul(all).saturating_add(per_row * (all - done) / 4);
        let needed = needed.saturating_add(2 * fixed).max(self.size + fixed);
        blik_error::of(BLIK_ERROR_BUFFER_TOO_SMALL).sizes(needed, self.size)
    }
}

/// Insertion sort: the pieces come nearly in order, and are few.
fn sort(spots: &mut [Spot], key: impl Fn(&Spot) -> usize) {
    for end in 1..spots.len() {
        for at in (1..=end).rev() {
            let Some([a, b]) = spots.get_mut(at - 1..=at) else { break };
            if key(a) <= key(b) {
                break;
            }
            core::mem::swap(a, b);
        }
    }
}

/// The most blocks that `rows` rows are spread over.
fn most_blocks(rows: usize) -> usize {
    2 * rows.div_ceil(piece(rows)) + 8 + MOST_LANES.min(rows.div_ceil(16))
}

/// Bytes to begin with: elements, tables of blocks, one row while it grows.
fn least(base: &blik_scene, settings: &Settings) -> Result<usize, blik_error> {
    let mut rows = settings.rows(base);
    while let Some(fewer) = rows.fewer().filter(|_| settings.fit) {
        rows = fewer;
    }
    let unknowns =
        subdivide::most_elements(base.scene.facets(), settings.asked.tolerance) * base.scene.sides();
    let row = sink::bytes(piece(unknowns), 64, settings::unmerged(&rows), base.scene.bands())?;
    let table = most_blocks(unknowns) * (size_of::<Spot>() + size_of::<Block<'_>>()) + 4 * ALIGNMENT;
    let planes = Facing::bytes(&base.scene, settings.planes(base))? + ALIGNMENT;
    let parts = [head::<blik_coupling>(), element_bytes(base, settings.asked.tolerance)?, table, row, planes];
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
    let mut cutter = Cutter { start: rest.as_mut_ptr(), size: rest.len() & !(ALIGNMENT - 1) };
    let planes = cutter.take_back(Facing::bytes(&base.scene, settings.planes(base))?)?;
    let facing = Facing::new(&base.scene, &base.bvh, settings.planes(base), planes)?;
    let elements = elements(base, &facing, settings, runner, &mut cutter)?;
    let mut rows = settings.asked.rows_within(&base.scene, elements.unknowns());
    let most = most_blocks(elements.unknowns());
    let spots = table(&mut cutter, most, Spot::default())?;
    let room = (most * size_of::<Block<'_>>()).next_multiple_of(ALIGNMENT);
    let size = cutter.size.saturating_sub(room);
    let (used, end) = loop {
        let (elements, rows_now) = (&elements, &rows);
        let start = Start(cutter.start);
        let (facing, spots) = (&facing, &mut *spots);
        let mut filler =
            Filler { base, elements, facing, rows: rows_now, start, size, spots, used: 0, end: 0 };
        let Err(error) = filler.run(runner) else { break (filler.used, filler.end) };
        if error.status != BLIK_ERROR_BUFFER_TOO_SMALL {
            return Err(error);
        }
        match rows.fewer().filter(|_| settings.fit) {
            Some(fewer) => rows = fewer,
            None => return Err(error.sizes(error.needed.saturating_add(given - size), given)),
        }
    };
    let done = spots.get_mut(..used).unwrap_or_default();
    sort(done, |s| s.first);
    let all: &'static [u8] = cutter.take(end)?;
    let open = |spot: &Spot| Block::open(all.get(spot.at..spot.at + spot.size).unwrap_or_default());
    let first = done.first().map(open).ok_or(blik_error::of(BLIK_ERROR_INTERNAL))??;
    let blocks = table(&mut cutter, done.len(), first)?;
    for (block, spot) in blocks.iter_mut().zip(&*done) {
        *block = open(spot)?;
    }
    let extent = cutter.start as usize - start;
    // SAFETY: `place` made room for it.
    unsafe { place.write(blik_coupling { extent, ..blik_coupling::new(base, elements, blocks, *settings) }) };
    Ok(place.as_ptr())
}

/// Bytes of memory with which [`blik_coupling_init`] can begin. The rows' own part is not known before: where it does
/// not fit, the call returns `BLIK_ERROR_BUFFER_TOO_SMALL` and `error->needed` says how many bytes probably do.
///
/// # Safety
/// Pointers are null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_coupling_size(
    scene: *const blik_scene,
    settings: *const blik_settings,
    error: *mut blik_error,
    bytes: *mut usize,
) -> i32 {
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

/// Computes the coupling of a scene in the caller's memory: once for a mesh and its materials, whatever the light.
///
/// With `run` the rows are computed on the caller's threads, each in its part of the memory. The scene must outlive
/// the coupling.
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
    coupling: *mut *const blik_coupling,
) -> i32 {
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

/// Computes the coupling of a scene in memory of its own; to be ended by [`blik_coupling_destroy`]. The scene must
/// outlive it.
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
) -> i32 {
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

/// Ends a coupling and frees what it owns; nothing for null. Solutions made from it must have ended before.
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
/// # Safety
/// Pointers are null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_coupling_get_info(
    coupling: *const blik_coupling,
    error: *mut blik_error,
    info: *mut blik_coupling_info,
) -> i32 {
    call(error, || {
        let to = needed(info)?;
        // SAFETY: by the caller's promise.
        let coupling = unsafe { object(coupling) }?;
        let info = coupling.info()?;
        // SAFETY: not null.
        unsafe { to.write(info) };
        Ok(())
    })
}

impl blik_coupling {
    pub(crate) fn info(&self) -> Result<blik_coupling_info, blik_error> {
        let matrix = self.matrix()?;
        let mut info = blik_coupling_info {
            elements: self.elements.count(),
            unknowns: self.elements.unknowns(),
            pairs: 0,
            skipped_rows: 0,
            open_rows: 0,
            rays: self.rays,
            dropped: 0.0,
            bytes: self.extent.max(matrix.memory() + self.elements.memory()),
        };
        for (_, row) in matrix.rows(0..matrix.unknowns()) {
            info.pairs += row.targets.len() as u64;
            info.dropped = info.dropped.max(row.row.lost);
            info.skipped_rows += u64::from(row.row.state == ABSENT);
            info.open_rows += u64::from(row.row.state == OPEN);
        }
        Ok(info)
    }
}

/// Building in memory of the library's own, as much as it takes.
#[cfg(feature = "std")]
mod owned {
    use super::*;
    use std::boxed::Box;
    use std::sync::Mutex;
    use std::vec::Vec;

    /// Block by block, each lane as it goes.
    pub fn build(
        base: &'static blik_scene,
        settings: &Settings,
        runner: &mut Runner,
    ) -> Result<*mut blik_coupling, blik_error> {
        let mut planes = Slab::new(Facing::bytes(&base.scene, settings.planes(base))?)?;
        // SAFETY: dropped at the end of this function, after the last use.
        let facing =
            Facing::new(&base.scene, &base.bvh, settings.planes(base), unsafe { planes.bytes_mut() })?;
        let mut scratch = Slab::new(Cut::bytes(base.scene.facets(), settings.asked.tolerance)?)?;
        // SAFETY: dropped at the end of this function, after the last use.
        let cut = cut(base, &facing, settings, runner, unsafe { scratch.bytes_mut() })?;
        let mut own = Slab::new(Elements::bytes(&cut)?)?;
        // SAFETY: the handle owns the slab.
        let elements = Elements::new(&base.scene, &cut, unsafe { own.bytes_mut() })?;
        let rows = settings.asked.rows_within(&base.scene, elements.unknowns());
        let (unknowns, piece) = (elements.unknowns(), piece(elements.unknowns()));
        let done = Mutex::new(Vec::new());
        runner.each(unknowns.div_ceil(piece), runner.lanes(), 1.0 - PROBING, &|_, item| {
            let range = item * piece..((item + 1) * piece).min(unknowns);
            let slabs = piece_of(base, (&elements, &facing), &rows, range)?;
            done.lock().map_err(|_| blik_error::of(BLIK_ERROR_INTERNAL))?.push((item, slabs));
            Ok(())
        })?;
        let mut done = done.into_inner().map_err(|_| blik_error::of(BLIK_ERROR_INTERNAL))?;
        done.sort_by_key(|(item, _)| *item);
        let mut slabs: Vec<Slab> = done.into_iter().flat_map(|(_, slabs)| slabs).collect();
        // SAFETY: the handle owns the slabs.
        let blocks =
            slabs.iter().map(|s| Block::open(unsafe { s.bytes() })).collect::<Result<Vec<_>, _>>()?;
        let bytes = head::<blik_coupling>() + blocks.len() * size_of::<Block<'_>>() + ALIGNMENT;
        let mut front = Slab::new(bytes)?;
        // SAFETY: the handle owns the slab.
        let (place, rest) = place::<blik_coupling>(unsafe { front.bytes_mut() })?;
        let mut cutter = Cutter { start: rest.as_mut_ptr(), size: rest.len() };
        let first = *blocks.first().ok_or(blik_error::of(BLIK_ERROR_INTERNAL))?;
        let kept = table(&mut cutter, blocks.len(), first)?;
        kept.copy_from_slice(&blocks);
        slabs.extend([own, front]);
        let mut handle = blik_coupling::new(base, elements, kept, *settings);
        handle.owner = Some(Box::new(Owned(slabs)));
        // SAFETY: `place` made room for it.
        unsafe { place.write(handle) };
        Ok(place.as_ptr())
    }

    /// The rows of one range, in as many blocks as it takes.
    fn piece_of(
        base: &blik_scene,
        (elements, facing): (&Elements<'_>, &Facing<'_>),
        rows: &RowSettings,
        range: Range<usize>,
    ) -> Result<Vec<Slab>, blik_error> {
        let mut slabs = Vec::new();
        let (mut next, mut records, mut unmerged) = (range.start, 64, settings::unmerged(rows));
        while next < range.end {
            let bytes = sink::bytes(range.end - next, records, unmerged, base.scene.bands())?;
            let mut slab = Slab::new(bytes)?;
            // SAFETY: the slab is not moved while its bytes are in use.
            let memory = unsafe { slab.bytes_mut() };
            match fill(&base.scene, &base.bvh, elements, facing, rows, next..range.end, memory) {
                Ok(done) => {
                    next += done;
                    records = 64.max(Block::open(memory)?.records() / done.max(1) + 16);
                    let size = pack(memory)?;
                    slab.shrink(size);
                    slabs.push(slab);
                }
                Err(Error::BufferTooSmall { .. }) if unmerged < 1 << 28 => unmerged *= 4,
                Err(error) => return Err(error.into()),
            }
        }
        Ok(slabs)
    }
}
