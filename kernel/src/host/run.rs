//! Ranges of rows on the pool of a [`Host`].

use super::Host;
use crate::base::error::Error;
use crate::stages::{Executor, Merge};
use rayon::prelude::*;
use std::boxed::Box;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// The caller's progress function.
pub(super) struct Progress(Mutex<Box<dyn FnMut(f64) -> bool + Send>>);

impl Progress {
    pub fn new(told: impl FnMut(f64) -> bool + Send + 'static) -> Progress {
        Progress(Mutex::new(Box::new(told)))
    }

    /// Tells the share that is done, unless another thread is about to.
    fn tell(&self, done: f64) -> Result<(), Error> {
        let Ok(mut told) = self.0.try_lock() else { return Ok(()) };
        if told(done) { Ok(()) } else { Err(Error::Cancelled) }
    }
}

impl core::fmt::Debug for Progress {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("Progress")
    }
}

/// A call of a host at work, whose progress goes from 0 to 1 over several stages.
pub(super) struct Run<'h> {
    host: &'h Host,
    done: f64,
}

impl<'h> Run<'h> {
    pub fn new(host: &'h Host) -> Run<'h> {
        Run { host, done: 0.0 }
    }

    /// Notes that another of a stage's `parts` is done, the stage being `share` of the call.
    pub fn tell(&self, finished: &AtomicUsize, parts: usize, share: f64) -> Result<(), Error> {
        let Some(progress) = &self.host.progress else { return Ok(()) };
        let finished = finished.fetch_add(1, Ordering::Relaxed) + 1;
        progress.tell((self.done + share * finished as f64 / parts as f64).min(1.0))
    }
}

impl Executor for Run<'_> {
    type Error = Error;

    fn lanes(&self) -> usize {
        self.host.pool.current_num_threads()
    }

    fn pieces<T: Send, R: Merge>(
        &mut self,
        out: &mut [T],
        piece: usize,
        share: f64,
        work: impl Fn(usize, &mut [T]) -> Result<R, Error> + Sync,
    ) -> Result<R, Error> {
        let (piece, finished) = (piece.max(1), AtomicUsize::new(0));
        let parts = out.len().div_ceil(piece);
        let this = &*self;
        let one = |(number, part): (usize, &mut [T])| {
            let result = work(number, part)?;
            this.tell(&finished, parts, share)?;
            Ok(result)
        };
        let merge = |mut all: R, one: R| {
            all.merge(one);
            Ok(all)
        };
        let merged = self
            .host
            .pool
            .install(|| out.par_chunks_mut(piece).enumerate().map(one).try_reduce(R::default, merge))?;
        self.done += share;
        Ok(merged)
    }
}
