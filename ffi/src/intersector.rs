//! A ray tracer of the caller's behind a scene.

use crate::call;
use crate::memory::*;
use crate::scene::{blik_ray, blik_scene};
use crate::status::*;
use crate::types::{Sized_, read, sized};
use blik_kernel::bvh::{INTERSECTOR_RAYS_MOST, Intersector, NO_FACET};
use blik_kernel::ray::Ray;
use blik_kernel::scene::Scene;
use core::ffi::c_void;
use core::ptr::null_mut;

/// Finds the first facet that each of `count` rays meets: their indices, or `BLIK_NO_FACET`, to `facets`. The facet
/// `skip` of a ray and what lies at `t_max` or beyond do not count. Called by any number of threads at once.
pub type blik_first_facets =
    Option<unsafe extern "C" fn(user: *mut c_void, rays: *const blik_ray, count: usize, facets: *mut u32)>;

/// Finds whether each of `count` rays meets any facet, as blik_first_facets does: not 0 or 0, to `hits`.
pub type blik_any_facets =
    Option<unsafe extern "C" fn(user: *mut c_void, rays: *const blik_ray, count: usize, hits: *mut u8)>;

/// A ray tracer of the caller's over the mesh of a scene.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct blik_intersector {
    /// Size of this struct.
    pub struct_size: usize,
    /// Finds first facets; must not be null.
    pub first_facets: blik_first_facets,
    /// Finds whether there is any; null (default): by `first_facets`.
    pub any_facets: blik_any_facets,
    /// Handed to both.
    pub user: *mut c_void,
}
sized!(blik_intersector);

impl Default for blik_intersector {
    fn default() -> blik_intersector {
        blik_intersector {
            struct_size: size_of::<blik_intersector>(),
            first_facets: None,
            any_facets: None,
            user: null_mut(),
        }
    }
}

/// Has rays traced by the caller's tracer instead of the library's tree.
///
/// Facets alone are taken from the tracer; where on them rays arrive is computed anew, and where a ray does not meet the
/// facet that was named, the tree finds the right one. Images are the same bits where the tracer names the same facets.
/// Rays come up to 32 at once (8 without the standard library) where none depends on what another meets (the first rays of
/// form factors, of elements and of pixels, and those from elements toward the sun), else one by one (chains by way of
/// mirrors).
///
/// - `scene`: the scene, which nobody else uses meanwhile
/// - `intersector`: the tracer, of which the scene keeps a copy; in use as long as the scene. Null: the tree again
///
/// # Safety
/// Pointers are null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_scene_set_intersector(
    scene: *mut blik_scene,
    intersector: *const blik_intersector,
    error: *mut blik_error,
) -> blik_status {
    call(error, || {
        // SAFETY: by the caller's promise.
        let corners = unsafe { object(scene.cast_const()) }?.scene.corners();
        let tracer = match intersector.is_null() {
            true => None,
            // SAFETY: by the caller's promise.
            false => Some(unsafe { read(intersector) }?),
        };
        if tracer.is_some_and(|t| t.first_facets.is_none()) {
            return Err(blik_error::of(BLIK_ERROR_NULL));
        }
        let at = scene;
        // SAFETY: a handle, which nobody else uses now and which does not move as long as it is used.
        unsafe {
            (*at).tracer = tracer.map(|tracer| Caller { tracer, scene: (*at).scene });
            let placed: &'static Option<Caller> = &(*at).tracer;
            let placed = placed.as_ref().map(|t| t as &dyn Intersector);
            (*at).bvh = (*at).bvh.with_intersector(placed, corners);
        }
        Ok(())
    })
}

/// The caller's tracer, in the mesh's coordinates.
pub(crate) struct Caller {
    tracer: blik_intersector,
    scene: Scene<'static>,
}

// SAFETY: the caller promises functions that any number of threads may call at once.
unsafe impl Sync for Caller {}

impl Caller {
    fn outside(&self, ray: &Ray) -> blik_ray {
        blik_ray {
            origin: self.scene.to_caller(ray.origin).to_array(),
            direction: ray.direction.to_array(),
            t_max: ray.t_max / self.scene.scale(),
            skip: ray.skip,
        }
    }

    /// Hands the rays out in batches, each with its place among the answers.
    fn batches(&self, rays: &[Ray], answers: &mut [u32], ask: impl Fn(&[blik_ray], &mut [u32])) {
        let none =
            blik_ray { origin: [0.0; 3], direction: [0.0; 3], t_max: 0.0, skip: crate::scene::BLIK_NO_FACET };
        let (mut rays, mut answers) = (rays, answers);
        while !rays.is_empty() {
            let count = rays.len().min(INTERSECTOR_RAYS_MOST);
            let (Some((now, later)), Some((out, rest))) =
                (rays.split_at_checked(count), answers.split_at_mut_checked(count))
            else {
                return;
            };
            let mut outside = [none; INTERSECTOR_RAYS_MOST];
            for (to, ray) in outside.iter_mut().zip(now) {
                *to = self.outside(ray);
            }
            ask(outside.get(..count).unwrap_or_default(), out);
            (rays, answers) = (later, rest);
        }
    }
}

impl Intersector for Caller {
    fn first(&self, rays: &[Ray], facets: &mut [u32]) {
        facets.fill(NO_FACET);
        let Some(find) = self.tracer.first_facets else { return };
        self.batches(rays, facets, |rays, facets| {
            // SAFETY: the caller's function, with the caller's pointer, and as many answers as rays.
            unsafe { find(self.tracer.user, rays.as_ptr(), rays.len(), facets.as_mut_ptr()) };
        });
    }

    fn any(&self, rays: &[Ray], hits: &mut [u32]) -> bool {
        let Some(find) = self.tracer.any_facets else { return false };
        self.batches(rays, hits, |rays, hits| {
            let mut found = [0; INTERSECTOR_RAYS_MOST];
            // SAFETY: as above; a batch is no longer than the array.
            unsafe { find(self.tracer.user, rays.as_ptr(), rays.len(), found.as_mut_ptr()) };
            hits.iter_mut().zip(found).for_each(|(hit, found)| *hit = u32::from(found));
        });
        true
    }
}
