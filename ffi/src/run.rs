//! How long stages run: on the caller's threads, with reports of progress, and until cancelled.

use crate::status::*;
use crate::types::{Sized_, read, sized};
use blik_kernel::Error;
use blik_kernel::stages::{Executor, LANES_MOST, Merge};
use core::cell::UnsafeCell;
use core::ffi::c_void;
use core::ptr::null_mut;
use core::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// One task of a stage: to be called once with each index, on any thread.
pub type blik_task = Option<unsafe extern "C" fn(context: *mut c_void, index: usize)>;

/// Calls `task(context, i)` once for each i in 0 .. `count`, in any order, on any threads, and returns when all have
/// returned. It must not throw or jump out; where it returns without having called all, the stage is cancelled.
pub type blik_parallel =
    Option<unsafe extern "C" fn(user: *mut c_void, count: usize, task: blik_task, context: *mut c_void)>;

/// Told the share (0 to 1) of a stage that is done, never by two threads at once; not 0 asks the stage to stop, which
/// then returns `BLIK_ERROR_CANCELLED`. It must not throw or jump out.
pub type blik_progress = Option<unsafe extern "C" fn(user: *mut c_void, done: f64) -> i32>;

/// How a long stage runs. A null pointer to it stands for its defaults. The results
/// do not depend on it.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct blik_run {
    /// Size of this struct.
    pub struct_size: usize,
    /// Runs tasks on threads of the caller; null (default): the calling thread alone.
    pub parallel: blik_parallel,
    /// Handed to `parallel`.
    pub parallel_user: *mut c_void,
    /// Tasks that `parallel` is given at once, 1 to 256: as many as there are threads; default 1.
    pub lanes: usize,
    /// Told the progress; null (default): nobody.
    pub progress: blik_progress,
    /// Handed to `progress`.
    pub progress_user: *mut c_void,
}
sized!(blik_run);

impl Default for blik_run {
    fn default() -> blik_run {
        blik_run {
            struct_size: size_of::<blik_run>(),
            parallel: None,
            parallel_user: null_mut(),
            lanes: 1,
            progress: None,
            progress_user: null_mut(),
        }
    }
}

/// A value that threads take turns at. Held for a few instructions only.
pub(crate) struct Turns<T> {
    taken: AtomicBool,
    value: UnsafeCell<T>,
}

// SAFETY: `with` lets one thread at a time at the value.
unsafe impl<T: Send> Sync for Turns<T> {}

impl<T> Turns<T> {
    pub fn new(value: T) -> Turns<T> {
        Turns { taken: AtomicBool::new(false), value: UnsafeCell::new(value) }
    }

    pub fn with<R>(&self, work: impl FnOnce(&mut T) -> R) -> R {
        while self.taken.swap(true, Ordering::Acquire) {
            core::hint::spin_loop();
        }
        // SAFETY: `taken` was false, and nobody else gets here until it is again.
        let result = work(unsafe { &mut *self.value.get() });
        self.taken.store(false, Ordering::Release);
        result
    }

    pub fn into_inner(self) -> T {
        self.value.into_inner()
    }
}

/// A [`blik_run`] at work on one call, whose progress goes from 0 to 1 over several stages.
pub(crate) struct Runner {
    run: blik_run,
    done: f64,
}

/// One stage on its way.
struct Job<'a> {
    runner: &'a Runner,
    items: usize,
    share: f64,
    next: AtomicUsize,
    finished: AtomicUsize,
    stop: AtomicBool,
    failed: Turns<Option<(usize, blik_error)>>,
    work: &'a (dyn Fn(usize, usize) -> Result<(), blik_error> + Sync),
}

impl Runner {
    /// # Safety
    /// As for [`read`]; the callbacks keep their promises.
    pub unsafe fn new(run: *const blik_run) -> Result<Runner, blik_error> {
        // SAFETY: by the caller's promise.
        let run = if run.is_null() { blik_run::default() } else { unsafe { read(run) }? };
        if !(1..=LANES_MOST).contains(&run.lanes) {
            let error = blik_error::of(BLIK_ERROR_TOO_MANY).field(BLIK_FIELD_LANES);
            return Err(error.sizes(LANES_MOST, run.lanes));
        }
        Ok(Runner { run, done: 0.0 })
    }

    /// Tasks that run at once.
    pub fn lanes(&self) -> usize {
        if self.run.parallel.is_some() { self.run.lanes } else { 1 }
    }

    /// Calls `work(lane, item)` for all `items`, those of one lane one after the other; `share` of the whole call's
    /// progress. The error of the lowest item that failed.
    #[inline(never)]
    pub fn each(
        &mut self,
        items: usize,
        lanes: usize,
        share: f64,
        work: &(dyn Fn(usize, usize) -> Result<(), blik_error> + Sync),
    ) -> Result<(), blik_error> {
        let job = Job {
            runner: self,
            items,
            share,
            next: AtomicUsize::new(0),
            finished: AtomicUsize::new(0),
            stop: AtomicBool::new(false),
            failed: Turns::new(None),
            work,
        };
        let lanes = lanes.min(items);
        match job.runner.run.parallel {
            Some(parallel) if lanes > 1 => {
                let context = (&raw const job).cast_mut().cast();
                // SAFETY: the caller's function keeps its promise to call `lane` with each index below `lanes`
                // before it returns; an index beyond does nothing.
                unsafe { parallel(job.runner.run.parallel_user, lanes, Some(lane), context) };
            }
            _ => job.lane(0),
        }
        let complete = job.finished.load(Ordering::Acquire) == items;
        match job.failed.into_inner() {
            Some((_, error)) => Err(error),
            None if complete => {
                self.done += share;
                Ok(())
            }
            // a parallel function that did not call all tasks
            None => Err(blik_error::of(BLIK_ERROR_CANCELLED)),
        }
    }

    /// Tells the caller's progress function; false where it asks to stop.
    pub fn told(&self, done: f64) -> bool {
        let Some(progress) = self.run.progress else { return true };
        // SAFETY: the caller's function, with the caller's pointer.
        (unsafe { progress(self.run.progress_user, done) }) == 0
    }
}

impl Executor for Runner {
    type Error = blik_error;

    fn lanes(&self) -> usize {
        Runner::lanes(self)
    }

    fn pieces<T: Send, R: Merge>(
        &mut self,
        out: &mut [T],
        piece: usize,
        share: f64,
        work: impl Fn(usize, &mut [T]) -> Result<R, Error> + Sync,
    ) -> Result<R, blik_error> {
        let (piece, all) = (piece.max(1), out.len());
        let start = Start(out.as_mut_ptr());
        let merged = Turns::new(R::default());
        self.each(all.div_ceil(piece), Runner::lanes(self), share, &|_, item| {
            let first = item * piece;
            // SAFETY: `each` hands out every item once, so that the parts are disjoint; they lie within `out`.
            let part = unsafe { core::slice::from_raw_parts_mut(start.at(first), piece.min(all - first)) };
            let one = work(item, part)?;
            merged.with(|all| all.merge(one));
            Ok(())
        })?;
        Ok(merged.into_inner())
    }
}

/// The start of an array of which every task takes another part.
pub(crate) struct Start<T>(pub *mut T);

// SAFETY: only the address is shared; who makes slices from it promises that they are disjoint.
unsafe impl<T: Send> Sync for Start<T> {}

impl<T> Start<T> {
    pub fn at(&self, index: usize) -> *mut T {
        self.0.wrapping_add(index)
    }
}

impl Job<'_> {
    /// Takes items until none is left.
    #[inline(never)]
    fn lane(&self, index: usize) {
        while !self.stop.load(Ordering::Relaxed) {
            let item = self.next.fetch_add(1, Ordering::Relaxed);
            if item >= self.items {
                return;
            }
            if let Err(error) = crate::caught(|| (self.work)(index, item)) {
                self.fail(item, error);
                return;
            }
            let finished = self.finished.fetch_add(1, Ordering::AcqRel) + 1;
            let done = self.runner.done + self.share * (finished as f64 / self.items as f64);
            // one lane alone tells, so that the caller's function is not called by two threads at once
            if index == 0 && !self.runner.told(done.min(1.0)) {
                self.fail(item, blik_error::of(BLIK_ERROR_CANCELLED));
                return;
            }
        }
    }

    // apart: does not burden the stack of the items
    #[inline(never)]
    fn fail(&self, item: usize, error: blik_error) {
        self.stop.store(true, Ordering::Relaxed);
        self.failed.with(|first| {
            if first.is_none_or(|(at, _)| item < at) {
                *first = Some((item, error));
            }
        });
    }
}

/// Entry point of a caller's threads.
unsafe extern "C" fn lane(context: *mut c_void, index: usize) {
    // SAFETY: `Runner::each` passed its job, which lives until all tasks have returned.
    unsafe { &*context.cast::<Job<'_>>() }.lane(index);
}

/// A [`blik_parallel`] that starts a thread for each task of a stage and waits for them.
///
/// - `user`: not looked at: there for the signature
/// - `count`: number of tasks
/// - `task`: the task
/// - `context`: handed to the task
///
/// # Safety
/// `task` may be called with `context` on any thread.
#[cfg(feature = "std")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_run_on_threads(
    user: *mut c_void,
    count: usize,
    task: blik_task,
    context: *mut c_void,
) {
    let _ = user;
    let Some(task) = task else { return };
    let context = Start(context);
    std::thread::scope(|scope| {
        for index in 1..count {
            let context = &context;
            let work = move || {
                // SAFETY: by the caller's promise.
                unsafe { task(context.0, index) }
            };
            // where the system gives no more threads, the first takes all items
            if std::thread::Builder::new().spawn_scoped(scope, work).is_err() {
                break;
            }
        }
        // SAFETY: as above.
        unsafe { task(context.0, 0) };
    });
}
