//! A ray tracer of the caller's in place of the tree.
//!
//! Constants of this file are measured by `cargo test --test c_library` (calls of a caller's tracer).

use super::{Bvh, traverse};
use crate::base::index::{Index, IndexMut};
use crate::base::math::Vec3;
use crate::rays::ray::{self, Hit, Ray};
use core::fmt;

/// Most rays that an [`Intersector`] is asked for at once: they wait on the stack, which is small where there is no
/// standard library.
pub const INTERSECTOR_RAYS_MOST: usize = if cfg!(feature = "std") { 32 } else { 8 };

/// No facet among the answers.
pub const NO_FACET: u32 = u32::MAX;

/// Which facets rays meet, in place of the tree's walk: for programs that own a ray tracer over the same mesh. It is asked
/// for up to [`INTERSECTOR_RAYS_MOST`] rays at once where rays do not depend on what others meet.
///
/// Only the facet is taken from it; distance and place are those of [`ray::intersect`].
pub trait Intersector: Sync {
    /// Index of the first facet that each ray meets, but for its `skip` and beyond its `t_max`; [`NO_FACET`]: none.
    fn first(&self, rays: &[Ray], facets: &mut [u32]);
    /// Whether each ray meets any: 1 or 0. False where it cannot tell sooner than [`Intersector::first`], which is then
    /// asked instead.
    fn any(&self, rays: &[Ray], hits: &mut [u32]) -> bool;
}

/// A tracer and the facets that its answers name.
#[derive(Clone, Copy)]
pub(super) struct External<'m> {
    pub tracer: &'m dyn Intersector,
    pub corners: &'m [[Vec3; 3]],
}

impl fmt::Debug for External<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("External")
    }
}

// None of these is compiled into its callers, which are many and as a rule have no such tracer.
impl External<'_> {
    /// The tracer's answer, or that of `tree`.
    #[inline(never)]
    pub fn closest(&self, tree: &Bvh<'_>, ray: &Ray) -> Option<Hit> {
        let mut facet = [NO_FACET];
        self.tracer.first(core::slice::from_ref(ray), &mut facet);
        self.first(tree, ray, facet[0])
    }

    /// Whether rays, at most [`INTERSECTOR_RAYS_MOST`], meet anything: 1 or 0, to `hits`. Where the tracer names
    /// facets, those that the ray does not meet are left to `tree`.
    #[inline(never)]
    fn any_batch(&self, tree: &Bvh<'_>, rays: &[Ray], hits: &mut [u32]) {
        if self.tracer.any(rays, hits) {
            return;
        }
        hits.fill(NO_FACET);
        self.tracer.first(rays, hits);
        for (ray, hit) in rays.iter().zip(hits) {
            let met = self.hit(ray, *hit).map_or_else(|()| traverse::occluded(tree, ray), |h| h.is_some());
            *hit = u32::from(met);
        }
    }

    /// The tracer's answer.
    #[inline(never)]
    pub fn any(&self, tree: &Bvh<'_>, ray: &Ray) -> bool {
        let mut hit = [0];
        self.any_batch(tree, core::slice::from_ref(ray), &mut hit);
        hit[0] != 0
    }

    /// The tracer's answers to many rays, or those of `tree`.
    #[inline(never)]
    pub fn closest_many(&self, tree: &Bvh<'_>, rays: &[Ray], hits: &mut [Option<Hit>]) {
        let mut facets = [NO_FACET; INTERSECTOR_RAYS_MOST];
        for (rays, hits) in rays.chunks(INTERSECTOR_RAYS_MOST).zip(hits.chunks_mut(INTERSECTOR_RAYS_MOST)) {
            let facets = facets.head_mut(rays.len());
            facets.fill(NO_FACET);
            self.tracer.first(rays, facets);
            for ((ray, hit), &facet) in rays.iter().zip(hits).zip(&*facets) {
                *hit = self.first(tree, ray, facet);
            }
        }
    }

    /// The tracer's answers to many rays.
    #[inline(never)]
    pub fn any_many(&self, tree: &Bvh<'_>, rays: &[Ray], occluded: &mut [bool]) {
        let mut answers = [0; INTERSECTOR_RAYS_MOST];
        for (rays, places) in
            rays.chunks(INTERSECTOR_RAYS_MOST).zip(occluded.chunks_mut(INTERSECTOR_RAYS_MOST))
        {
            let answers = answers.head_mut(rays.len());
            answers.fill(0);
            self.any_batch(tree, rays, answers);
            places.iter_mut().zip(&*answers).for_each(|(place, answer)| *place = *answer != 0);
        }
    }

    /// The hit with the facet that the tracer named; that of `tree` where the ray does not meet it, or meets its back, with
    /// which a front may coincide.
    #[inline(never)]
    fn first(&self, tree: &Bvh<'_>, ray: &Ray, facet: u32) -> Option<Hit> {
        match self.hit(ray, facet) {
            Ok(hit) if hit.is_none_or(|hit| hit.front) => hit,
            _ => traverse::closest(tree, ray),
        }
    }

    /// The hit with the facet that the tracer named; `Err` for one that the ray does not meet in the kernel's arithmetic.
    #[inline(never)]
    fn hit(&self, ray: &Ray, facet: u32) -> Result<Option<Hit>, ()> {
        if facet == NO_FACET {
            return Ok(None);
        }
        let corners = self.corners.get(facet as usize).ok_or(())?;
        ray::intersect(ray, facet, corners).map(Some).ok_or(())
    }
}

/// Buffer of a tracer's answers to consecutive rays of a numbered series, asked for together.
#[derive(Debug, Default)]
pub struct AnswerBuffer {
    answers: [u32; INTERSECTOR_RAYS_MOST],
    first: u32,
    count: u32,
}

impl AnswerBuffer {
    /// Forgets all answers: before another series.
    pub fn clear(&mut self) {
        self.count = 0;
    }

    /// The answer to ray `number`, for which the tracer is asked with those that follow where it is not known yet.
    #[cold]
    #[inline(never)]
    fn answer(
        &mut self,
        number: u32,
        end: u32,
        ray: &dyn Fn(u32) -> Ray,
        ask: &dyn Fn(&[Ray], &mut [u32]),
    ) -> u32 {
        let at = number.wrapping_sub(self.first);
        if at < self.count {
            return self.answers.at(at as usize);
        }
        let mut rays = [Ray::new(Vec3::ZERO, Vec3::ZERO); INTERSECTOR_RAYS_MOST];
        let count = (end.saturating_sub(number) as usize).clamp(1, INTERSECTOR_RAYS_MOST);
        let rays = rays.head_mut(count);
        for (ahead, place) in (number..).zip(&mut *rays) {
            *place = ray(ahead);
        }
        ask(rays, self.answers.head_mut(count));
        (self.first, self.count) = (number, count as u32);
        self.answers.at(0)
    }
}

impl Bvh<'_> {
    /// [`Bvh::closest`] of ray `number` of a series: a caller's tracer is asked for it together with those that follow,
    /// up to `end`, which may be traced or not. `ray(n)` is ray n of the series, always the same.
    #[inline(always)]
    pub fn closest_of(
        &self,
        ahead: &mut AnswerBuffer,
        number: u32,
        end: u32,
        ray: impl Fn(u32) -> Ray,
    ) -> Option<Hit> {
        let own = ray(number);
        let Some(external) = &self.external else { return traverse::closest(self, &own) };
        let facet = ahead.answer(number, end, &ray, &|rays, facets| external.tracer.first(rays, facets));
        external.first(self, &own, facet)
    }

    /// [`Bvh::occluded`] of ray `number` of a series, as [`Bvh::closest_of`].
    #[inline(always)]
    pub fn occluded_of(
        &self,
        ahead: &mut AnswerBuffer,
        number: u32,
        end: u32,
        ray: impl Fn(u32) -> Ray,
    ) -> bool {
        let Some(external) = &self.external else { return traverse::occluded(self, &ray(number)) };
        ahead.answer(number, end, &ray, &|rays, hits| external.any_batch(self, rays, hits)) != 0
    }
}
