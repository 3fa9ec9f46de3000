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

/// A ray for [`blik_closest_hits`] and [`blik_any_hits`], in the mesh's coordinates.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct blik_ray {
    /// Where it starts.
    pub origin: [f64; 3],
    /// Unit vector along it.
    pub direction: [f64; 3],
    /// Hits at this distance and beyond do not count; infinity for no limit.
    pub t_max: f64,
    /// Index of the facet that it leaves and never hits; `BLIK_NO_FACET` for none.
    pub skip: u32,
}

/// "No facet" in [`blik_ray`] and [`blik_hit`].
pub const BLIK_NO_FACET: u32 = 0xffff_ffff;

/// Where a ray meets the mesh first.
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
    let needed = size(mesh)?;
    if memory.len() < needed {
        return Err(blik_error::of(BLIK_ERROR_BUFFER_TOO_SMALL).sizes(needed, memory.len()));
    }
    let (place, rest) = place::<blik_scene>(memory)?;
    let short = blik_error::of(BLIK_ERROR_INTERNAL);
    let (own, tree) = rest.split_at_mut_checked(Scene::bytes(mesh)?).ok_or(short)?;
    let scene = Scene::new(mesh, own)?;
    let bvh = builder(scene.corners(), scene.areas(), Isa::detect(), tree)?;
    // SAFETY: `place` made room for it.
    unsafe { place.write(blik_scene::new(scene, bvh)) };
    Ok(place.as_ptr())
}

/// Bytes of memory that [`blik_scene_init`] needs for this mesh, at any address.
///
/// # Safety
/// Pointers are null or valid, arrays as long as the structs say.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_scene_size(
    mesh: *const blik_mesh,
    error: *mut blik_error,
    bytes: *mut usize,
) -> i32 {
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

/// Checks a mesh and makes a scene of it in the caller's memory, where it lives until that is used for something
/// else. The mesh is not needed afterwards.
///
/// # Safety
/// Pointers are null or valid; nobody else uses the memory while the scene is in use.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_scene_init(
    mesh: *const blik_mesh,
    memory: *mut c_void,
    size: usize,
    error: *mut blik_error,
    scene: *mut *const blik_scene,
) -> i32 {
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

/// Checks a mesh and makes a scene of it in memory of its own; to be ended by [`blik_scene_destroy`].
///
/// # Safety
/// Pointers are null or valid, arrays as long as the structs say.
#[cfg(feature = "std")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_scene_create(
    mesh: *const blik_mesh,
    error: *mut blik_error,
    scene: *mut *mut blik_scene,
) -> i32 {
    call(error, || {
        let to = needed(scene)?;
        // SAFETY: by the caller's promise.
        let mesh = unsafe { Reader::new(mesh) }?;
        let mut slab = Slab::new(size(&mesh)?)?;
        // SAFETY: the handle owns the slab, or is never made.
        let made = build(&mesh, Bvh::build_obvhs, unsafe { slab.bytes_mut() })?;
        // SAFETY: just made, and not null.
        unsafe {
            (*made).owner = Some(std::boxed::Box::new(Owned(std::vec![slab])));
            to.write(made);
        }
        Ok(())
    })
}

/// Ends a scene and frees what it owns; nothing for null. Couplings made from it must have ended before.
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
/// # Safety
/// Pointers are null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_scene_get_info(
    scene: *const blik_scene,
    error: *mut blik_error,
    info: *mut blik_scene_info,
) -> i32 {
    call(error, || {
        let to = needed(info)?;
        // SAFETY: by the caller's promise.
        let blik_scene { scene, bvh, .. } = unsafe { object(scene) }?;
        let info = blik_scene_info {
            facets: scene.facets(),
            degenerate_facets: scene.degenerate(),
            materials: scene.materials(),
            bands: scene.bands(),
            sides: scene.sides(),
            bytes: scene.memory() + bvh.memory(),
        };
        // SAFETY: not null.
        unsafe { to.write(info) };
        Ok(())
    })
}

/// Stands where there is no ray.
const NO_RAY: blik_ray = blik_ray { origin: [0.0; 3], direction: [0.0; 3], t_max: 0.0, skip: BLIK_NO_FACET };

/// The kernel's ray for a caller's: scene coordinates, in which distances are `scale` times as long.
fn inside(scene: &Scene<'_>, ray: &blik_ray) -> Ray {
    Ray {
        origin: scene.to_scene(Vec3::from_array(ray.origin)),
        direction: Vec3::from_array(ray.direction),
        t_max: ray.t_max * scene.scale(),
        skip: ray.skip,
    }
}

/// The first facet that each ray meets: least distance, then lowest index, whatever the machine.
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
) -> i32 {
    call(error, || {
        // SAFETY: by the caller's promise.
        let (handle, rays, out, mut runner) =
            unsafe { (object(scene)?, input(rays, count)?, output(hits, count)?, Runner::new(run)?) };
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

/// Whether each ray meets any facet: 1 or 0.
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
) -> i32 {
    call(error, || {
        // SAFETY: by the caller's promise.
        let (handle, rays, out, mut runner) =
            unsafe { (object(scene)?, input(rays, count)?, output(hits, count)?, Runner::new(run)?) };
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
