//! Ranges of rows on the pool of a [`Host`].

use super::Host;
use crate::base::error::Error;
use crate::stages::{Executor, Merge};
use rayon::prelude::*;

/// A call of a host at work.
pub(super) struct Run<'h> {
    host: &'h Host,
}

impl<'h> Run<'h> {
    pub fn new(host: &'h Host) -> Run<'h> {
        Run { host }
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
        _share: f64,
        work: impl Fn(usize, &mut [T]) -> Result<R, Error> + Sync,
    ) -> Result<R, Error> {
        let merge = |mut all: R, one: R| {
            all.merge(one);
            Ok(all)
        };
        self.host.pool.install(|| {
            let parts = out.par_chunks_mut(piece.max(1)).enumerate();
            parts.map(|(number, part)| work(number, part)).try_reduce(R::default, merge)
        })
    }
}
