//! Couplings that are kept while materials change and parts of the scene move.

use crate::call;
use crate::coupling::{Cutter, blik_coupling, rows_in};
use crate::memory::*;
use crate::mesh::Reader;
use crate::run::{Runner, blik_run};
use crate::scene::blik_scene;
use crate::status::*;
use crate::types::*;
use blik_kernel::arena::ALIGNMENT;
use blik_kernel::coupling::kept::Fates;
use blik_kernel::coupling::{Block, Coupling};
use blik_kernel::scene::pose::{Parts, Pose};
use blik_kernel::stages::{self, BlockPlace, Update};
use core::ffi::c_void;

/// Where a rigid part stands: what is at x in the mesh is at R x + t. Frozen: it does not grow.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct blik_pose {
    /// The rotation R, row by row.
    pub rotation: [f64; 9],
    /// The translation t, in the mesh's unit.
    pub translation: [f64; 3],
}

const _: () =
    assert!(size_of::<blik_pose>() == size_of::<Pose>() && align_of::<blik_pose>() == align_of::<Pose>());

/// The rigid parts of a mesh, and where they stand.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct blik_parts {
    /// Size of this struct.
    pub struct_size: usize,
    /// The part of each facet.
    pub facet_parts: *const u32,
    /// Number of facets.
    pub facet_count: usize,
    /// Where each part stands.
    pub poses: *const blik_pose,
    /// Number of parts.
    pub pose_count: usize,
}

impl Default for blik_parts {
    fn default() -> blik_parts {
        blik_parts {
            struct_size: size_of::<blik_parts>(),
            facet_parts: core::ptr::null(),
            facet_count: 0,
            poses: core::ptr::null(),
            pose_count: 0,
        }
    }
}
sized!(blik_parts);

/// What became of the rows of a coupling that was kept.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct blik_update_info {
    /// Size of this struct.
    pub struct_size: usize,
    /// Rows kept as they are.
    pub kept: u64,
    /// Rows kept with other products of mirror reflectances.
    pub rescaled: u64,
    /// Rows computed anew.
    pub redone: u64,
    /// Rays traced for these.
    pub rays: u64,
}

impl Default for blik_update_info {
    fn default() -> blik_update_info {
        blik_update_info {
            struct_size: size_of::<blik_update_info>(),
            kept: 0,
            rescaled: 0,
            redone: 0,
            rays: 0,
        }
    }
}
sized!(blik_update_info);

/// The caller's parts; `None` where there are none.
///
/// # Safety
/// `at` is null or valid, its arrays as long as it says.
unsafe fn given_parts<'a>(at: *const blik_parts) -> Result<Option<Parts<'a>>, blik_error> {
    if at.is_null() {
        return Ok(None);
    }
    // SAFETY: by the caller's promise; poses have the layout of the kernel's, as checked above.
    unsafe {
        let parts = read(at)?;
        let named = |error: blik_error| error.field(BLIK_FIELD_PARTS);
        let facets = input(parts.facet_parts, parts.facet_count).map_err(named)?;
        let poses = input(parts.poses.cast::<Pose>(), parts.pose_count).map_err(named)?;
        Ok(Some(Parts { facets, poses }))
    }
}

/// A pose by a quaternion w, x, y, z of any length but zero, and a translation.
///
/// - `quaternion`: four numbers
/// - `translation`: three numbers, in the mesh's unit
/// - `pose`: receives the pose
///
/// # Safety
/// Pointers are null or valid, arrays as long as stated.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_pose_from_quaternion(
    quaternion: *const f64,
    translation: *const f64,
    error: *mut blik_error,
    pose: *mut blik_pose,
) -> blik_status {
    call(error, || {
        let to = needed(pose)?;
        // SAFETY: by the caller's promise.
        let (quaternion, translation) = unsafe { (input(quaternion, 4)?, input(translation, 3)?) };
        let turned = [0, 1, 2, 3].map(|k| quaternion.get(k).copied().unwrap_or_default());
        let moved = [0, 1, 2].map(|k| translation.get(k).copied().unwrap_or_default());
        let Pose { rotation: [a, b, c], translation } = Pose::from_quaternion(turned, moved);
        if [a, b, c].as_flattened().iter().any(|x| !x.is_finite()) {
            return Err(blik_error::of(BLIK_ERROR_POSE));
        }
        let rotation = [a[0], a[1], a[2], b[0], b[1], b[2], c[0], c[1], c[2]];
        // SAFETY: not null.
        unsafe { to.write(blik_pose { rotation, translation }) };
        Ok(())
    })
}

/// As `blik_scene_init`, of a mesh whose parts stand elsewhere: `blik_scene_size` tells the bytes.
///
/// - `mesh`: the mesh; not needed afterwards
/// - `parts`: its parts and their poses; not needed afterwards
/// - `scene`: receives the scene
///
/// # Safety
/// Pointers are null or valid; nobody else uses the memory while the scene is in use.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_scene_pose_init(
    mesh: *const blik_mesh,
    parts: *const blik_parts,
    memory: *mut c_void,
    size: usize,
    error: *mut blik_error,
    scene: *mut *mut blik_scene,
) -> blik_status {
    call(error, || {
        let to = needed(scene)?;
        // SAFETY: by the caller's promise.
        let (mesh, parts, memory) =
            unsafe { (Reader::new(mesh)?, given_parts(parts)?, bytes(memory, size)?) };
        let made = crate::scene::posed(&mesh, &parts.ok_or(blik_error::of(BLIK_ERROR_NULL))?, memory)?;
        // SAFETY: not null.
        unsafe { to.write(made) };
        Ok(())
    })
}

/// As [`blik_scene_pose_init`], in memory of the library's own.
///
/// - `mesh`: the mesh; not needed afterwards
/// - `parts`: its parts and their poses; not needed afterwards
/// - `scene`: receives the scene; to be ended by `blik_scene_destroy`
///
/// # Safety
/// Pointers are null or valid, arrays as long as the structs say.
#[cfg(feature = "std")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_scene_pose_create(
    mesh: *const blik_mesh,
    parts: *const blik_parts,
    error: *mut blik_error,
    scene: *mut *mut blik_scene,
) -> blik_status {
    call(error, || {
        let to = needed(scene)?;
        // SAFETY: by the caller's promise.
        let (mesh, parts) = unsafe { (Reader::new(mesh)?, given_parts(parts)?) };
        let made = crate::scene::owned_posed(&mesh, &parts.ok_or(blik_error::of(BLIK_ERROR_NULL))?)?;
        // SAFETY: not null.
        unsafe { to.write(made) };
        Ok(())
    })
}

/// How a kept coupling is made one of a scene.
struct Renewal<'a> {
    kept: &'static blik_coupling,
    base: &'static blik_scene,
    parts: Option<Parts<'a>>,
}

impl<'a> Renewal<'a> {
    /// # Safety
    /// As for [`object`] and [`given_parts`].
    unsafe fn new(
        kept: *const blik_coupling,
        scene: *const blik_scene,
        parts: *const blik_parts,
    ) -> Result<Renewal<'a>, blik_error> {
        // SAFETY: by the caller's promise.
        let (kept, base, parts) = unsafe { (object(kept)?, object(scene)?, given_parts(parts)?) };
        let renewal = Renewal { kept, base, parts };
        let (old, new) = (&renewal.kept.base.scene, &renewal.base.scene);
        if old.facets() != new.facets() || old.sides() != new.sides() || old.bands() != new.bands() {
            return Err(blik_error::of(BLIK_ERROR_HANDLE));
        }
        Ok(renewal)
    }

    fn with<R>(&self, with: impl FnOnce(&Update<'_>) -> Result<R, blik_error>) -> Result<R, blik_error> {
        let coupling = self.kept.matrix()?;
        with(&Update {
            old: &self.kept.base.scene,
            elements: &self.kept.elements,
            coupling: &coupling,
            settings: &self.kept.settings.asked,
            scene: &self.base.scene,
            bvh: &self.base.bvh,
            parts: self.parts,
        })
    }

    fn handle(&self, blocks: &'static [Block<'static>], fates: Fates, rays: u64) -> blik_coupling {
        let mut made = blik_coupling::new(self.base, self.kept.elements, blocks, self.kept.settings);
        (made.fates, made.traced) = (fates, rays);
        made
    }

    /// Bytes to begin with: scratch memory, tables of blocks, rows of as many bytes as those that are kept.
    fn least(&self) -> Result<usize, blik_error> {
        let unknowns = self.kept.elements.unknowns();
        let rows = self.kept.settings.asked.rows_within(&self.base.scene, unknowns);
        let row = stages::least_bytes(&self.base.scene, &rows, unknowns)?;
        let each = size_of::<BlockPlace>() + size_of::<Block<'_>>();
        let scratch = self.with(|update| Ok(update.bytes()?))?;
        let kept = self.kept.matrix()?.memory();
        let parts =
            [head::<blik_coupling>(), scratch, stages::places(unknowns) * each, row, kept, 6 * ALIGNMENT];
        Ok(parts.iter().fold(0usize, |sum, part| sum.saturating_add(*part)))
    }

    /// Builds in the caller's memory.
    fn build(
        &self,
        memory: &'static mut [u8],
        runner: &mut Runner,
    ) -> Result<*mut blik_coupling, blik_error> {
        let (given, start) = (memory.len(), memory.as_ptr() as usize);
        let least = self.least()?;
        if given < least {
            return Err(blik_error::of(BLIK_ERROR_BUFFER_TOO_SMALL).sizes(least, given));
        }
        let (place, rest) = place::<blik_coupling>(memory)?;
        let mut cutter = Cutter::new(rest);
        let (blocks, fates, rays) = self.with(|update| {
            let scratch = cutter.take_back(update.bytes()?)?;
            let (blocks, count, fates) = update.run(scratch, runner, |rows, runner| {
                let Some(rows) = rows else { return Ok(self.kept.blocks) };
                rows_in(&mut cutter, rows, self.kept.settings.fit, given, runner)
            })?;
            Ok((blocks, count, Update::rays(&Coupling::part(blocks), fates)))
        })?;
        let mut handle = self.handle(blocks, fates, rays);
        handle.extent = cutter.start as usize - start;
        // SAFETY: `place` made room for it.
        unsafe { place.write(handle) };
        Ok(place.as_ptr())
    }
}

/// Bytes of memory with which [`blik_update_init`] can begin: as for `blik_coupling_size`.
///
/// - `kept`: the coupling that is kept
/// - `scene`: the scene
/// - `parts`: what moved; null: nothing
/// - `bytes`: receives the bytes
///
/// # Safety
/// Pointers are null or valid, arrays as long as the structs say.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_update_size(
    kept: *const blik_coupling,
    scene: *const blik_scene,
    parts: *const blik_parts,
    error: *mut blik_error,
    bytes: *mut usize,
) -> blik_status {
    call(error, || {
        let to = needed(bytes)?;
        // SAFETY: by the caller's promise.
        let size = unsafe { Renewal::new(kept, scene, parts) }?.least()?;
        // SAFETY: not null.
        unsafe { to.write(size) };
        Ok(())
    })
}

/// Makes the coupling of a scene by what still holds of another's: of the same mesh with other materials, or with parts at
/// other poses, or both. Elements and settings stay. New diffuse reflectances and emissions trace no ray; rows by way of
/// mirrors are multiplied by new products of reflectances; rows whose rays can meet nothing that moved against them are kept.
/// All others are computed anew; `blik_update_get_info` says how many. Where a facet that shares an element with others has
/// another material than these, `BLIK_ERROR_UNCOUPLED` names it. Results depend on `kept` and on the scene, not on poses
/// before; they differ from a coupling from scratch by what the estimates of both tell. Memory as for `blik_coupling_init`;
/// calls on other threads may use `kept` besides.
///
/// - `kept`: the coupling that is kept, which must outlive the new one; its parts stand where its mesh has them
/// - `scene`: the scene, which must outlive the coupling: by `blik_scene_pose_init` with the same `parts`, or of the same mesh
/// - `parts`: what moved; null: nothing
/// - `coupling`: receives the coupling
///
/// # Safety
/// Pointers are null or valid, arrays as long as the structs say; nobody else uses the memory while the coupling is in use.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_update_init(
    kept: *const blik_coupling,
    scene: *const blik_scene,
    parts: *const blik_parts,
    run: *const blik_run,
    memory: *mut c_void,
    size: usize,
    error: *mut blik_error,
    coupling: *mut *mut blik_coupling,
) -> blik_status {
    call(error, || {
        let to = needed(coupling)?;
        // SAFETY: by the caller's promise.
        let (renewal, mut runner, memory) =
            unsafe { (Renewal::new(kept, scene, parts)?, Runner::new(run)?, bytes(memory, size)?) };
        let made = renewal.build(memory, &mut runner)?;
        // SAFETY: not null.
        unsafe { to.write(made) };
        Ok(())
    })
}

/// As [`blik_update_init`], in memory of the library's own.
///
/// - `kept`: the coupling that is kept, which must outlive the new one
/// - `scene`: the scene, which must outlive the coupling
/// - `parts`: what moved; null: nothing
/// - `coupling`: receives the coupling; to be ended by `blik_coupling_destroy`
///
/// # Safety
/// Pointers are null or valid, arrays as long as the structs say.
#[cfg(feature = "std")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_update_create(
    kept: *const blik_coupling,
    scene: *const blik_scene,
    parts: *const blik_parts,
    run: *const blik_run,
    error: *mut blik_error,
    coupling: *mut *mut blik_coupling,
) -> blik_status {
    call(error, || {
        let to = needed(coupling)?;
        // SAFETY: by the caller's promise.
        let (renewal, mut runner) = unsafe { (Renewal::new(kept, scene, parts)?, Runner::new(run)?) };
        let made = renewal.owned(&mut runner)?;
        // SAFETY: not null.
        unsafe { to.write(made) };
        Ok(())
    })
}

#[cfg(feature = "std")]
impl Renewal<'_> {
    /// Builds in memory of the library's own.
    fn owned(&self, runner: &mut Runner) -> Result<*mut blik_coupling, blik_error> {
        self.with(|update| {
            let mut scratch = Slab::new(update.bytes()?)?;
            // SAFETY: dropped at the end of this function, after the last use.
            let memory = unsafe { scratch.bytes_mut() };
            let ((slabs, blocks), count, fates) = update.run(memory, runner, |rows, runner| match rows {
                Some(rows) => crate::coupling::owned::fill(rows, runner),
                None => Ok((std::vec::Vec::new(), self.kept.blocks.to_vec())),
            })?;
            let rays = Update::rays(&Coupling::part(&blocks), fates);
            crate::coupling::owned::place_blocks(slabs, &blocks, |blocks| self.handle(blocks, count, rays))
        })
    }
}

/// What became of the rows of a coupling that [`blik_update_init`] made; of any other one all were computed.
///
/// - `coupling`: the coupling
/// - `info`: receives the numbers; its `struct_size` is set before
///
/// # Safety
/// Pointers are null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_update_get_info(
    coupling: *const blik_coupling,
    error: *mut blik_error,
    info: *mut blik_update_info,
) -> blik_status {
    call(error, || {
        // SAFETY: by the caller's promise.
        let (to, coupling): (_, &blik_coupling) = unsafe { (Place::new(info)?, object(coupling)?) };
        let Fates { kept, rescaled, redone } = coupling.fates;
        let rays = coupling.traced;
        to.write(blik_update_info { kept, rescaled, redone, rays, ..blik_update_info::default() });
        Ok(())
    })
}
