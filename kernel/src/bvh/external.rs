//! A ray tracer of the caller's in place of the tree.

use crate::math::Vec3;
use crate::ray::{self, Hit, Ray};
use core::fmt;

/// Which facets rays meet, in place of the tree's walk: for programs that own a ray tracer over the same mesh.
///
/// Only the facet is taken from it; distance and place are those of [`ray::intersect`].
pub trait Intersector: Sync {
    /// Index of the first facet that the ray meets, but for `ray.skip` and beyond `ray.t_max`; `None`: none.
    fn first(&self, ray: &Ray) -> Option<u32>;
    /// Whether the ray meets any.
    fn any(&self, ray: &Ray) -> bool;
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

impl External<'_> {
    /// What the tracer says; `Err` for a facet that the ray does not meet in the kernel's arithmetic.
    pub fn closest(&self, ray: &Ray) -> Result<Option<Hit>, ()> {
        let Some(facet) = self.tracer.first(ray) else { return Ok(None) };
        let corners = self.corners.get(facet as usize).ok_or(())?;
        ray::intersect(ray, facet, corners).map(Some).ok_or(())
    }
}
