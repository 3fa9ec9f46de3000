//! The scene: a checked mesh with its materials, ready for rays.

use crate::intersector::Caller;
use crate::memory::*;
use crate::mesh::Reader;
use crate::run::{Runner, blik_run};
use crate::status::*;
use crate::types::*;
use crate::{call, caught};
use blik_kernel::Error;
use blik_kernel::bvh::{AnswerBuffer, Bvh};
use blik_kernel::math::Vec3;
use blik_kernel::ray::Ray;
use blik_kernel::scene::pose::Parts;
use blik_kernel::scene::{Mesh, Scene};
use blik_kernel::simd::Isa;
use blik_kernel::stages::Executor;
use core::ffi::c_void;

/// A scene in memory. Read-only once made: any number of threads may use it at once.
pub struct blik_scene {
    tag: usize,
    pub(crate) scene: Scene<'static>,
    pub(crate) bvh: Bvh<'static>,
    pub(crate) tracer: Option<Caller>,
    #[cfg(feature = "std")]
    owner: Option<std::boxed::Box<Owned>>,
}

impl Handle for blik_scene {
    const TAG: usize = 0x5ce9_e001;

    fn tag(at: *mut Self) -> *mut usize {
        // SAFETY: only the place is computed, within memory of a handle's size.
        unsafe { &raw mut (*at).tag }
    }

    #[cfg(feature = "std")]
    fn owner(&mut self) -> &mut Option<std::boxed::Box<Owned>> {
        &mut self.owner
    }
}

impl blik_scene {
    pub(crate) fn new(scene: Scene<'static>, bvh: Bvh<'static>) -> blik_scene {
        blik_scene {
            tag: blik_scene::TAG,
            scene,
            bvh,
            tracer: None,
            #[cfg(feature = "std")]
            owner: None,
        }
    }
}

/// Numbers of a scene.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct blik_scene_info {
    /// Size of this struct.
    pub struct_size: usize,
    /// Facets, degenerate ones included.
    pub facets: usize,
    /// Facets of no area: they keep their index and take no part.
    pub degenerate_facets: usize,
    /// Materials.
    pub materials: usize,
    /// Spectral bands.
    pub bands: usize,
    /// Sides of a facet that carry its material: 1 or 2.
    pub sides: usize,
    /// Bytes in use.
    pub bytes: usize,
}

impl Default for blik_scene_info {
    fn default() -> blik_scene_info {
        let struct_size = size_of::<blik_scene_info>();
        blik_scene_info {
            struct_size,
            facets: 0,
            degenerate_facets: 0,
            materials: 0,
            bands: 0,
            sides: 0,
            bytes: 0,
        }
    }
}
sized!(blik_scene_info);

/// A ray in the mesh's coordinates. Frozen: it does not grow.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct blik_ray {
    /// Where it starts.
    pub origin: [f64; 3],
    /// Unit vector along it; default (0, 0, -1).
    pub direction: [f64; 3],
    /// Hits at this distance and beyond do not count, 0 or more; default the largest number: no limit.
    pub t_max: f64,
    /// Index of the facet that it leaves and never hits; default `BLIK_NO_FACET`: none.
    pub skip: u32,
}

impl Default for blik_ray {
    fn default() -> blik_ray {
        blik_ray { origin: [0.0; 3], direction: [0.0, 0.0, -1.0], t_max: f64::MAX, skip: BLIK_NO_FACET }
    }
}

/// "No facet" in [`blik_ray`] and [`blik_hit`].
pub const BLIK_NO_FACET: u32 = 0xffff_ffff;

/// Where a ray meets the mesh first. Frozen: it does not grow.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct blik_hit {
    /// Distance along the ray in the mesh's unit; infinity where it meets nothing.
    pub t: f64,
    /// Barycentric weight of the facet's second corner.
    pub u: f64,
    /// Barycentric weight of the facet's third corner.
    pub v: f64,
    /// Index of the facet, or `BLIK_NO_FACET`.
    pub facet: u32,
    /// 1 where it meets the side on which the corners run counter-clockwise.
    pub front: i32,
}

fn size(mesh: &Reader) -> Result<usize, blik_error> {
    let parts = [head::<blik_scene>(), Scene::bytes(mesh)?, Bvh::bytes(mesh.facets())?];
    let sum = parts.iter().try_fold(0usize, |sum, part| sum.checked_add(*part));
    sum.ok_or(blik_error::of(BLIK_ERROR_TOO_MANY).sizes(usize::MAX, 0))
}

/// One of the kernel's builders of trees: the hits are the same.
type Builder = fn(&[[Vec3; 3]], &[f64], Isa, &'static mut [u8]) -> Result<Bvh<'static>, Error>;

fn build(mesh: &Reader, builder: Builder, memory: &'static mut [u8]) -> Result<*mut blik_scene, blik_error> {
    build_at(mesh, None, builder, memory)
}

/// Builds a scene of a mesh whose parts stand elsewhere.
pub(crate) fn posed(
    mesh: &Reader,
    parts: &Parts<'_>,
    memory: &'static mut [u8],
) -> Result<*mut blik_scene, blik_error> {
    build_at(mesh, Some(parts), Bvh::build, memory)
}

fn build_at(
    mesh: &Reader,
    parts: Option<&Parts<'_>>,
    builder: Builder,
    memory: &'static mut [u8],
) -> Result<*mut blik_scene, blik_error> {
    let needed = size(mesh)?;
    if memory.len() < needed {
        return Err(blik_error::of(BLIK_ERROR_BUFFER_TOO_SMALL).sizes(needed, memory.len()));
    }
    let (place, rest) = place::<blik_scene>(memory)?;
    let short = blik_error::of(BLIK_ERROR_INTERNAL);
    let (own, tree) = rest.split_at_mut_checked(Scene::bytes(mesh)?).ok_or(short)?;
    let scene = match parts {
        None => Scene::new(mesh, own)?,
        Some(parts) => Scene::posed(mesh, parts, own)?,
    };
    let bvh = builder(scene.corners(), scene.areas(), Isa::detect(), tree)?;
    // SAFETY: `place` made room for it.
    unsafe { place.write(blik_scene::new(scene, bvh)) };
    Ok(place.as_ptr())
}

/// Bytes of memory that [`blik_scene_init`] needs for a mesh, at any address.
///
/// - `mesh`: the mesh
/// - `bytes`: receives the bytes
///
/// # Safety
/// Pointers are null or valid, arrays as long as the structs say.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_scene_size(
    mesh: *const blik_mesh,
    error: *mut blik_error,
    bytes: *mut usize,
) -> blik_status {
    call(error, || {
        let to = needed(bytes)?;
        // SAFETY: by the caller's promise.
        let mesh = unsafe { Reader::new(mesh) }?;
        let size = size(&mesh)?;
        // SAFETY: not null.
        unsafe { to.write(size) };
        Ok(())
    })
}

/// Checks a mesh and makes a scene of it in the caller's memory, where it lives until that is used for something else.
///
/// - `mesh`: the mesh; not needed afterwards
/// - `scene`: receives the scene
///
/// # Safety
/// Pointers are null or valid; nobody else uses the memory while the scene is in use.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_scene_init(
    mesh: *const blik_mesh,
    memory: *mut c_void,
    size: usize,
    error: *mut blik_error,
    scene: *mut *mut blik_scene,
) -> blik_status {
    call(error, || {
        let to = needed(scene)?;
        // SAFETY: by the caller's promise.
        let (mesh, memory) = unsafe { (Reader::new(mesh)?, bytes(memory, size)?) };
        let made = build(&mesh, Bvh::build, memory)?;
        // SAFETY: not null.
        unsafe { to.write(made) };
        Ok(())
    })
}

/// Checks a mesh and makes a scene of it in memory of its own.
///
/// - `mesh`: the mesh; not needed afterwards
/// - `scene`: receives the scene; to be ended by [`blik_scene_destroy`]
///
/// # Safety
/// Pointers are null or valid, arrays as long as the structs say.
#[cfg(feature = "std")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_scene_create(
    mesh: *const blik_mesh,
    error: *mut blik_error,
    scene: *mut *mut blik_scene,
) -> blik_status {
    call(error, || {
        let to = needed(scene)?;
        // SAFETY: by the caller's promise.
        let mesh = unsafe { Reader::new(mesh) }?;
        let made = owned(&mesh, None, Bvh::build_obvhs)?;
        // SAFETY: not null.
        unsafe { to.write(made) };
        Ok(())
    })
}

/// Builds a scene in memory of its own.
#[cfg(feature = "std")]
fn owned(mesh: &Reader, parts: Option<&Parts<'_>>, builder: Builder) -> Result<*mut blik_scene, blik_error> {
    let mut slab = Slab::new(size(mesh)?)?;
    // SAFETY: the handle owns the slab, or is never made.
    let made = build_at(mesh, parts, builder, unsafe { slab.bytes_mut() })?;
    // SAFETY: just made.
    unsafe { (*made).owner = Some(std::boxed::Box::new(Owned(std::vec![slab]))) };
    Ok(made)
}

/// As [`posed`], in memory of its own: by the kernel's builder, which is sooner done.
#[cfg(feature = "std")]
pub(crate) fn owned_posed(mesh: &Reader, parts: &Parts<'_>) -> Result<*mut blik_scene, blik_error> {
    owned(mesh, Some(parts), Bvh::build)
}

/// Ends a scene and frees what it owns.
///
/// - `scene`: the scene, whose couplings have ended before; null: nothing
///
/// # Safety
/// Null or a scene that nobody uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_scene_destroy(scene: *mut blik_scene) {
    let _ = caught(|| {
        // SAFETY: by the caller's promise.
        unsafe { end(scene) };
        Ok(())
    });
}

/// Numbers of a scene.
///
/// - `scene`: the scene
/// - `info`: receives them; its `struct_size` is set before
///
/// # Safety
/// Pointers are null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_scene_get_info(
    scene: *const blik_scene,
    error: *mut blik_error,
    info: *mut blik_scene_info,
) -> blik_status {
    call(error, || {
        // SAFETY: by the caller's promise.
        let (to, blik_scene { scene, bvh, .. }) = unsafe { (Place::new(info)?, object(scene)?) };
        to.write(blik_scene_info {
            facets: scene.facets(),
            degenerate_facets: scene.degenerate(),
            materials: scene.materials(),
            bands: scene.bands(),
            sides: scene.sides(),
            bytes: scene.memory() + bvh.memory(),
            ..blik_scene_info::default()
        });
        Ok(())
    })
}

/// Stands where there is no ray.
const NO_RAY: blik_ray = blik_ray { origin: [0.0; 3], direction: [0.0; 3], t_max: 0.0, skip: BLIK_NO_FACET };

/// By how much the squared length of a unit vector may differ from 1: single precision's rounding many times over.
const UNIT_SLACK: f64 = 1e-5;

/// Refuses the first ray that is none.
pub(crate) fn check(scene: &Scene<'_>, rays: &[blik_ray]) -> Result<(), blik_error> {
    for (index, ray) in rays.iter().enumerate() {
        let refused = |status, field, value| Err(blik_error::of(status).field(field).at(index, 0, value));
        if let Some(&x) = ray.origin.iter().find(|x| !x.is_finite()) {
            return refused(BLIK_ERROR_RANGE, BLIK_FIELD_RAY_ORIGIN, x);
        }
        let squared = Vec3::from_array(ray.direction).length_squared();
        if !(1.0 - UNIT_SLACK..=1.0 + UNIT_SLACK).contains(&squared) {
            return refused(BLIK_ERROR_DIRECTION, BLIK_FIELD_RAY_DIRECTION, squared);
        }
        if !(0.0..=f64::INFINITY).contains(&ray.t_max) {
            return refused(BLIK_ERROR_RANGE, BLIK_FIELD_RAY_T_MAX, ray.t_max);
        }
        if ray.skip != BLIK_NO_FACET && ray.skip as usize >= scene.facets() {
            return refused(BLIK_ERROR_RANGE, BLIK_FIELD_RAY_SKIP, f64::from(ray.skip));
        }
    }
    Ok(())
}

/// The kernel's ray for a caller's: scene coordinates, in which distances are `scale` times as long.
pub(crate) fn inside(scene: &Scene<'_>, ray: &blik_ray) -> Ray {
    Ray {
        origin: scene.to_scene(Vec3::from_array(ray.origin)),
        direction: Vec3::from_array(ray.direction),
        t_max: ray.t_max * scene.scale(),
        skip: ray.skip,
    }
}

/// The first facet that each ray meets: at the least distance; among equals a front before a back, then the lowest index.
///
/// - `scene`: the scene
/// - `rays`: the rays; one that is not finite, of no unit direction or of no such `skip` is refused with its index
/// - `count`: number of rays
/// - `hits`: receives one hit a ray
/// - `hit_count`: number of hits that there is room for: `count`
///
/// # Safety
/// Pointers are null or valid; `rays` and `hits` have `count` entries.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_closest_hits(
    scene: *const blik_scene,
    rays: *const blik_ray,
    count: usize,
    run: *const blik_run,
    error: *mut blik_error,
    hits: *mut blik_hit,
    hit_count: usize,
) -> blik_status {
    call(error, || {
        // SAFETY: by the caller's promise.
        let (handle, rays, out, mut runner) = unsafe {
            let handle: &blik_scene = object(scene)?;
            let out = output_of((hits, hit_count), count, BLIK_FIELD_HITS)?;
            (handle, input(rays, count)?, out, Runner::new(run)?)
        };
        check(&handle.scene, rays)?;
        runner.rows(out, 1, 1.0, |range, out| {
            let (mut ahead, own) = (AnswerBuffer::default(), rays.get(range).unwrap_or_default());
            let any = |n: u32| inside(&handle.scene, own.get(n as usize).unwrap_or(&NO_RAY));
            for (n, out) in (0..own.len() as u32).zip(out) {
                let hit = handle.bvh.closest_of(&mut ahead, n, own.len() as u32, any);
                *out = match hit {
                    None => blik_hit { t: f64::INFINITY, u: 0.0, v: 0.0, facet: BLIK_NO_FACET, front: 0 },
                    Some(hit) => blik_hit {
                        t: hit.t / handle.scene.scale(),
                        u: hit.u,
                        v: hit.v,
                        facet: hit.facet,
                        front: i32::from(hit.front),
                    },
                };
            }
            Ok(())
        })
    })
}

/// Whether each ray meets any facet.
///
/// - `scene`: the scene
/// - `rays`: the rays, as for [`blik_closest_hits`]
/// - `count`: number of rays
/// - `hits`: receives 1 or 0 for each ray
/// - `hit_count`: number of values that there is room for: `count`
///
/// # Safety
/// Pointers are null or valid; `rays` and `hits` have `count` entries.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_any_hits(
    scene: *const blik_scene,
    rays: *const blik_ray,
    count: usize,
    run: *const blik_run,
    error: *mut blik_error,
    hits: *mut u8,
    hit_count: usize,
) -> blik_status {
    call(error, || {
        // SAFETY: by the caller's promise.
        let (handle, rays, out, mut runner) = unsafe {
            let handle: &blik_scene = object(scene)?;
            let out = output_of((hits, hit_count), count, BLIK_FIELD_HITS)?;
            (handle, input(rays, count)?, out, Runner::new(run)?)
        };
        check(&handle.scene, rays)?;
        runner.rows(out, 1, 1.0, |range, out| {
            let (mut ahead, own) = (AnswerBuffer::default(), rays.get(range).unwrap_or_default());
            let any = |n: u32| inside(&handle.scene, own.get(n as usize).unwrap_or(&NO_RAY));
            for (n, out) in (0..own.len() as u32).zip(out) {
                *out = u8::from(handle.bvh.occluded_of(&mut ahead, n, own.len() as u32, any));
            }
            Ok(())
        })
    })
}
