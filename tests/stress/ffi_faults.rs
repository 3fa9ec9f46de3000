//! Memory that the system does not give and callers who cancel, at every place where either can happen: a clear status,
//! no leak, and what was there before is as usable as ever.
//!
//! Blocks are refused one by one that the library asks for by itself. The few small boxes of its handles and the heap
//! of the tree's builder end the program as in all of Rust; `blik_*_init`, in the caller's memory, needs none of them.

use crate::*;
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

thread_local! {
    /// Blocks that this thread may still take before one is refused.
    static LEFT: Cell<u64> = const { Cell::new(u64::MAX) };
    /// Bytes that this thread has.
    static BYTES: Cell<isize> = const { Cell::new(0) };
}

/// The alignment by which the library's blocks are told from others.
const ALIGNMENT: usize = 64;

struct Miser;

// SAFETY: hands calls on to the system's allocator, or refuses as allocators may.
unsafe impl GlobalAlloc for Miser {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        BYTES.set(BYTES.get() + layout.size() as isize);
        // SAFETY: the caller's promises are passed on.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        if layout.align() == ALIGNMENT {
            if LEFT.get() == 0 {
                return null_mut();
            }
            LEFT.set(LEFT.get() - 1);
        }
        BYTES.set(BYTES.get() + layout.size() as isize);
        // SAFETY: as above.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        BYTES.set(BYTES.get() - layout.size() as isize);
        // SAFETY: as above.
        unsafe { System.dealloc(memory, layout) }
    }

    unsafe fn realloc(&self, memory: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        BYTES.set(BYTES.get() + size as isize - layout.size() as isize);
        // SAFETY: as above.
        unsafe { System.realloc(memory, layout, size) }
    }
}

#[global_allocator]
static MISER: Miser = Miser;

/// How a run is disturbed.
#[derive(Clone, Copy)]
enum Fault {
    /// Number of blocks after which the next is refused.
    Memory(u64),
    /// The caller asks to stop at this call of the progress function.
    Stop(u32),
}

unsafe extern "C" fn stop(user: *mut c_void, _: f64) -> i32 {
    // SAFETY: `disturbed` hands over its counter.
    let left = unsafe { &mut *user.cast::<u32>() };
    *left -= 1;
    i32::from(*left == 0)
}

/// Calls `work` while the fault waits to happen; false where it did: `status` says so then.
fn disturbed(fault: Fault, work: impl FnOnce(*const blik_run) -> i32) -> bool {
    let (mut calls, wanted) = match fault {
        Fault::Memory(left) => {
            LEFT.set(left);
            (u32::MAX, BLIK_ERROR_MEMORY)
        }
        Fault::Stop(calls) => (calls, BLIK_ERROR_CANCELLED),
    };
    let user = (&raw mut calls).cast();
    let run = blik_run { progress: Some(stop), progress_user: user, ..blik_run::default() };
    let status = work(&run);
    LEFT.set(u64::MAX);
    assert!(status == BLIK_OK || status == wanted, "status {status}, not {wanted}");
    status == BLIK_OK
}

/// Repeats `make` with ever later faults until none happens, and then what it makes is there. `make` may be called
/// again after each failure, and leaves its pointer null then.
fn until_made<T>(
    what: &str,
    fault: impl Fn(u32) -> Fault,
    make: impl Fn(*const blik_run, *mut *mut T) -> i32,
) -> *mut T {
    let mut place: *mut T = null_mut();
    for number in 1..100_000 {
        let before = BYTES.get();
        if disturbed(fault(number), |run| make(run, &mut place)) {
            // nothing is printed here: captured output is memory, too
            assert!(number > 1 && !place.is_null(), "{what}: no fault happened");
            return place;
        }
        assert!(place.is_null(), "{what}: fault {number} left a handle");
        assert_eq!(BYTES.get(), before, "{what}: fault {number} left memory");
    }
    panic!("{what}: never made");
}

/// The whole way to an image with a fault at every place.
fn pixels_in_spite_of(fault: fn(u32) -> Fault, scene_too: bool) -> Vec<u32> {
    let inputs = Inputs { gloss: [0.0, 9.0], ..Inputs::new() };
    let mut made = Handles { scene: null_mut(), coupling: null_mut(), solution: null_mut() };
    let settings = blik_settings { tolerance: inputs.tolerance, ..blik_settings::default() };
    with_mesh(&inputs, |mesh| {
        // SAFETY: valid structs and handles throughout.
        let create =
            |_: *const blik_run, to: *mut *mut blik_scene| unsafe { blik_scene_create(mesh, null_mut(), to) };
        made.scene = if scene_too {
            until_made("scene", fault, create)
        } else {
            let mut scene = null_mut();
            assert_eq!(create(null(), &mut scene), BLIK_OK);
            scene
        };
    });
    // SAFETY: as above.
    made.coupling = until_made("coupling", fault, |run, to| unsafe {
        blik_coupling_create(made.scene, &settings, run, null_mut(), to)
    });
    // SAFETY: as above.
    made.solution = until_made("solution", fault, |run, to| {
        with_light(&inputs, |light| unsafe {
            blik_solution_create(made.coupling, light, run, null_mut(), to)
        })
    });
    let turned = blik_pose { translation: [0.0, 0.0, 0.2], ..REST };
    with_parts(&inputs, turned, |parts| {
        let mut scene = null_mut();
        // SAFETY: as above.
        let renewed = unsafe {
            let posed = |mesh: &blik_mesh| blik_scene_pose_create(mesh, parts, null_mut(), &mut scene);
            assert_eq!(with_mesh(&inputs, posed), BLIK_OK);
            until_made("update", fault, |run, to| {
                blik_update_create(made.coupling, scene, parts, run, null_mut(), to)
            })
        };
        drop(Handles { scene, coupling: renewed, solution: null_mut() });
    });
    for number in 1.. {
        let (mut written, before) = (None, BYTES.get());
        let done = disturbed(fault(number), |run| {
            match explain(made.coupling, &inputs, run)
                .and_then(|bits| lights(made.coupling, &inputs, run).map(|more| [bits, more].concat()))
            {
                Ok(bits) => {
                    written = Some(bits.len());
                    BLIK_OK
                }
                Err(status) => status,
            }
        });
        assert_eq!(BYTES.get(), before, "lights: fault {number} left memory");
        assert_eq!(done, written.is_some());
        if done {
            assert!(number > 1, "no fault happened");
            break;
        }
    }
    image(made.solution, &inputs).unwrap()
}

#[test]
fn memory_refused_and_runs_cancelled_anywhere_leave_no_trace() {
    let inputs = Inputs { gloss: [0.0, 9.0], ..Inputs::new() };
    let made = prepare(&inputs).unwrap();
    let calm = image(made.solution, &inputs).unwrap();
    drop(made);
    let before = BYTES.get();
    let refused = pixels_in_spite_of(|number| Fault::Memory(u64::from(number) - 1), true);
    assert!(refused == calm, "memory refused");
    drop(refused);
    assert_eq!(BYTES.get(), before, "memory left");
    assert!(pixels_in_spite_of(Fault::Stop, false) == calm, "cancelled");
    assert_eq!(BYTES.get(), before, "memory left");
}
