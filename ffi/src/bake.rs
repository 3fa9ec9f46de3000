//! A prepared scene as one block of bytes: made on a workstation, loaded by a trainer without a copy.

use crate::call;
use crate::coupling::{Settings, blik_coupling};
use crate::memory::*;
use crate::scene::blik_scene;
use crate::solution::blik_solution;
use crate::status::*;
use blik_kernel::arena::ALIGNMENT;
use blik_kernel::bake::{self, Baked};
use blik_kernel::coupling::Block;
use blik_kernel::light::{Light, LightInput};
use blik_kernel::simd::Isa;
use core::ffi::c_void;
use core::ptr::{NonNull, null_mut};

/// Boundary, in bytes, on which a baked block starts.
pub const BLIK_BLOCK_ALIGNMENT: usize = 64;
const _: () = assert!(BLIK_BLOCK_ALIGNMENT == ALIGNMENT);

/// Content of a block to be baked.
fn baked(
    coupling: &'static blik_coupling,
    solution: Option<&'static blik_solution>,
) -> Result<Baked<'static>, blik_error> {
    if solution.is_some_and(|s| !core::ptr::eq(s.coupling, coupling)) {
        return Err(blik_error::of(BLIK_ERROR_HANDLE));
    }
    let solution = solution.map(|s| bake::Solution {
        sky: s.input.sky,
        sun: s.input.sun,
        emission: s.input.emission,
        record: s.record,
    });
    Ok(Baked {
        scene: coupling.base.scene,
        bvh: coupling.base.bvh,
        elements: coupling.elements,
        blocks: coupling.blocks,
        settings: coupling.settings.asked,
        solution,
    })
}

/// Bytes of the block that [`blik_bake`] writes.
///
/// - `coupling`: the coupling
/// - `solution`: a solution of it; null: none
/// - `bytes`: receives the bytes
///
/// # Safety
/// Pointers are null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_bake_size(
    coupling: *const blik_coupling,
    solution: *const blik_solution,
    error: *mut blik_error,
    bytes: *mut usize,
) -> blik_status {
    call(error, || {
        let to = needed(bytes)?;
        // SAFETY: by the caller's promise.
        let baked = unsafe { baked(object(coupling)?, optional(solution)?) }?;
        let size = baked.bytes()?;
        // SAFETY: not null.
        unsafe { to.write(size) };
        Ok(())
    })
}

/// A handle that may be null.
///
/// # Safety
/// As for [`object`].
unsafe fn optional<'a, T: Handle>(at: *const T) -> Result<Option<&'a T>, blik_error> {
    // SAFETY: by the caller's promise.
    if at.is_null() { Ok(None) } else { unsafe { object(at) }.map(Some) }
}

/// Writes scene, tree, coupling and perhaps a solution as one relocatable block, with version, byte order, size and
/// checksum.
///
/// - `coupling`: the coupling
/// - `solution`: a solution of it; null: none
/// - `block`: receives the block; starts on a boundary of `BLIK_BLOCK_ALIGNMENT` bytes
/// - `size`: bytes that there is room for
///
/// # Safety
/// Pointers are null or valid; `block` has `size` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_bake(
    coupling: *const blik_coupling,
    solution: *const blik_solution,
    block: *mut c_void,
    size: usize,
    error: *mut blik_error,
) -> blik_status {
    call(error, || {
        // SAFETY: by the caller's promise.
        let (baked, memory) =
            unsafe { (baked(object(coupling)?, optional(solution)?)?, bytes(block, size)?) };
        aligned(memory)?;
        baked.write(memory)?;
        Ok(())
    })
}

fn aligned(memory: &[u8]) -> Result<(), blik_error> {
    if memory.as_ptr().align_offset(ALIGNMENT) == 0 {
        Ok(())
    } else {
        Err(blik_error::of(BLIK_ERROR_ALIGNMENT).sizes(ALIGNMENT, 0))
    }
}

/// Bytes for the handles of a block of `blocks` parts.
fn load_bytes(blocks: usize) -> usize {
    let handles = head::<blik_scene>() + head::<blik_coupling>() + head::<blik_solution>();
    blocks.saturating_mul(size_of::<Block<'_>>()).saturating_add(handles + 2 * ALIGNMENT)
}

/// Bytes of memory that [`blik_load`] needs for the handles of a block: some hundred, and some for each part of the
/// coupling.
///
/// - `block`: the block, of which the head alone is read
/// - `size`: its bytes
/// - `bytes`: receives the bytes
///
/// # Safety
/// Pointers are null or valid; `block` has `size` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_load_size(
    block: *const c_void,
    size: usize,
    error: *mut blik_error,
    bytes: *mut usize,
) -> blik_status {
    call(error, || {
        let to = needed(bytes)?;
        // SAFETY: by the caller's promise.
        let block = unsafe { input(there(block)?, size) }?;
        aligned(block)?;
        let size = load_bytes(Baked::count(block)?);
        // SAFETY: not null.
        unsafe { to.write(size) };
        Ok(())
    })
}

/// The block's bytes, not null even where there are none.
fn there(block: *const c_void) -> Result<*const u8, blik_error> {
    if block.is_null() { Err(blik_error::of(BLIK_ERROR_NULL)) } else { Ok(block.cast()) }
}

/// The table of a block's parts, all empty yet, in memory for which [`load_bytes`] counted room.
fn block_table(memory: &'static mut [u8], parts: usize) -> &'static mut [Block<'static>] {
    let start = memory.as_mut_ptr();
    let table = start.wrapping_add(start.align_offset(align_of::<Block<'_>>())).cast::<Block<'static>>();
    for i in 0..parts {
        // SAFETY: `load_bytes` counted room for them.
        unsafe { table.add(i).write(Block::EMPTY) };
    }
    // SAFETY: all have just been written.
    unsafe { core::slice::from_raw_parts_mut(table, parts) }
}

/// Makes the handles over a block, under the light of its solution; returns the solution's, null where it has none.
///
/// # Safety
/// There is room for each, for as long as the block is there.
// apart: handles being made do not burden the stack of checking the block
#[inline(never)]
unsafe fn make_handles(
    baked: &Baked<'static>,
    light: Option<&Light<'static>>,
    (scene_at, coupling_at, solution_at): (
        NonNull<blik_scene>,
        NonNull<blik_coupling>,
        NonNull<blik_solution>,
    ),
) -> *mut blik_solution {
    let settings = Settings { asked: baked.settings, fit: false };
    // SAFETY: by the caller's promise.
    unsafe {
        scene_at.write(blik_scene::new(baked.scene, baked.bvh));
        let base: &'static blik_scene = &*scene_at.as_ptr();
        coupling_at.write(blik_coupling::new(base, baked.elements, baked.blocks, settings));
        let coupled: &'static blik_coupling = &*coupling_at.as_ptr();
        let (Some(own), Some(light)) = (&baked.solution, light) else { return null_mut() };
        let (record, emission) = (own.record, own.emission);
        let input = LightInput { sky: own.sky, sun: own.sun, emission, reference: None };
        solution_at.write(blik_solution::new(coupled, *light, input, record, record.memory()));
        solution_at.as_ptr()
    }
}

/// Checks a block from end to end and makes handles over it. A block that is damaged or hostile is refused by
/// `BLIK_ERROR_BLOCK`.
///
/// - `block`: the block; read where it stands (read-only memory will do) for as long as the handles are in use
/// - `size`: its bytes
/// - `memory`: memory for the handles, at any address
/// - `memory_size`: its bytes
/// - `scene`: receives the scene
/// - `coupling`: receives the coupling
/// - `solution`: receives the solution; null where the block has none
///
/// # Safety
/// Pointers are null or valid; `block` has `size` bytes, `memory` has `memory_size`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_load(
    block: *const c_void,
    size: usize,
    memory: *mut c_void,
    memory_size: usize,
    error: *mut blik_error,
    scene: *mut *mut blik_scene,
    coupling: *mut *mut blik_coupling,
    solution: *mut *mut blik_solution,
) -> blik_status {
    call(error, || {
        let (to_scene, to_coupling, to_solution) = (needed(scene)?, needed(coupling)?, needed(solution)?);
        // SAFETY: by the caller's promise.
        let (block, memory): (&'static [u8], &'static mut [u8]) =
            unsafe { (input(there(block)?, size)?, bytes(memory, memory_size)?) };
        aligned(block)?;
        let parts = Baked::count(block)?;
        let (wanted, given) = (load_bytes(parts), memory.len());
        if given < wanted {
            return Err(blik_error::of(BLIK_ERROR_BUFFER_TOO_SMALL).sizes(wanted, given));
        }
        let (scene_at, rest) = place::<blik_scene>(memory)?;
        let (coupling_at, rest) = place::<blik_coupling>(rest)?;
        let (solution_at, rest) = place::<blik_solution>(rest)?;
        let table = block_table(rest, parts);
        // in one place of the stack each: they are large
        let baked = Baked::load(block, Isa::detect(), table);
        let baked = baked.as_ref().map_err(|error| *error)?;
        let light = baked.solution.as_ref().map(|solution| solution.light(&baked.scene));
        let light = match &light {
            Some(light) => Some(light.as_ref().map_err(|error| *error)?),
            None => None,
        };
        // SAFETY: `place` made room for each; the handles live as long as the caller's memory.
        unsafe {
            let solved = make_handles(baked, light, (scene_at, coupling_at, solution_at));
            to_scene.write(scene_at.as_ptr());
            to_coupling.write(coupling_at.as_ptr());
            to_solution.write(solved);
        }
        Ok(())
    })
}
