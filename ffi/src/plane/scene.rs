//! The plane scene: checked bodies with their materials.

use super::types::*;
use crate::memory::*;
use crate::status::*;
use crate::types::{Place, Sized_, read, sized};
use crate::{call, caught};
use blik_kernel::arena::ALIGNMENT;
use blik_kernel::plane::Vec2;
use blik_kernel::plane::scene::{BodyInput, PlaneInput, PlaneMaterial, PlaneScene, Shape};
use blik_kernel::plane::settings::Settings;
use core::ffi::c_void;

/// A plane scene in memory. Read-only once made: any number of threads may use it at once.
pub struct blik_plane_scene {
    tag: usize,
    pub(super) scene: PlaneScene<'static>,
    pub(super) settings: Settings,
    bytes: usize,
    #[cfg(feature = "std")]
    owner: Option<std::boxed::Box<Owned>>,
}

impl Handle for blik_plane_scene {
    const TAG: usize = 0x5ce9_e011;

    fn tag(at: *mut Self) -> *mut usize {
        // SAFETY: only the place is computed, within memory of a handle's size.
        unsafe { &raw mut (*at).tag }
    }

    #[cfg(feature = "std")]
    fn owner(&mut self) -> &mut Option<std::boxed::Box<Owned>> {
        &mut self.owner
    }
}

/// Numbers of a plane scene.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct blik_plane_scene_info {
    /// Size of this struct.
    pub struct_size: usize,
    /// Bodies.
    pub bodies: usize,
    /// Circles and segments.
    pub primitives: usize,
    /// Unknowns of the linear system.
    pub unknowns: usize,
    /// Bytes in use.
    pub bytes: usize,
}

impl Default for blik_plane_scene_info {
    fn default() -> blik_plane_scene_info {
        let struct_size = size_of::<blik_plane_scene_info>();
        blik_plane_scene_info { struct_size, bodies: 0, primitives: 0, unknowns: 0, bytes: 0 }
    }
}
sized!(blik_plane_scene_info);

/// A ray of the plane. Frozen: it does not grow.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct blik_plane_ray {
    /// Where it starts.
    pub origin: [f64; 2],
    /// Unit vector along it.
    pub direction: [f64; 2],
}

/// Where a ray of the plane meets a body first. Frozen: it does not grow.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct blik_plane_hit {
    /// The point; (0, 0) where nothing is met.
    pub point: [f64; 2],
    /// Unit normal of the front.
    pub normal: [f64; 2],
    /// Circle or segment, counted over all bodies; `BLIK_NO_FACET` where nothing is met.
    pub primitive: u32,
    /// 1 where its front is met.
    pub front: i32,
}

/// Checked [`blik_plane_bodies`]: no pointer is null where it is read.
struct Reader(blik_plane_bodies);

/// Refuses an array that is null, or whose stride does not hold its entries.
fn check(at: *const c_void, count: usize, stride: usize, size: usize) -> Result<(), blik_error> {
    if count > 0 && at.is_null() {
        return Err(blik_error::of(BLIK_ERROR_NULL));
    }
    if stride < size {
        return Err(blik_error::of(BLIK_ERROR_STRUCT_SIZE).sizes(size, stride));
    }
    match stride.checked_mul(count) {
        Some(bytes) if bytes <= isize::MAX as usize => Ok(()),
        _ => Err(blik_error::of(BLIK_ERROR_TOO_MANY).sizes(isize::MAX as usize, count)),
    }
}

impl Reader {
    /// # Safety
    /// As for [`read`]; the arrays are as long as the struct says.
    unsafe fn new(bodies: *const blik_plane_bodies) -> Result<Reader, blik_error> {
        // SAFETY: by the caller's promise.
        let all = unsafe { read(bodies) }?;
        check(all.bodies.cast(), all.body_count, all.body_stride, size_of::<blik_plane_body>())?;
        let size = size_of::<blik_plane_material>();
        check(all.materials.cast(), all.material_count, all.material_stride, size)?;
        let all = Reader(all);
        for index in 0..all.0.body_count {
            let body = all.body(index);
            if !(BLIK_PLANE_CIRCLE..=BLIK_PLANE_POLYGON).contains(&body.shape) {
                return Err(blik_error::of(BLIK_ERROR_CHOICE).at(index, 0, f64::from(body.shape)));
            }
            if body.shape != BLIK_PLANE_CIRCLE {
                let numbers = body.point_count.checked_mul(2).ok_or(blik_error::of(BLIK_ERROR_TOO_MANY))?;
                // SAFETY: by the caller's promise.
                unsafe { input(body.points, numbers) }.map_err(|e| blik_error { index, ..e })?;
            }
        }
        Ok(all)
    }

    fn body(&self, index: usize) -> blik_plane_body {
        let at = self.0.bodies.cast::<u8>().wrapping_add(index * self.0.body_stride);
        // SAFETY: indices are below `body_count`, and the stride holds a body.
        unsafe { at.cast::<blik_plane_body>().read_unaligned() }
    }

    fn material(&self, index: usize) -> blik_plane_material {
        let at = self.0.materials.cast::<u8>().wrapping_add(index * self.0.material_stride);
        // SAFETY: as above.
        unsafe { at.cast::<blik_plane_material>().read_unaligned() }
    }

    /// Circles and segments.
    fn primitives(&self) -> usize {
        let of = |index| {
            let body = self.body(index);
            match body.shape {
                BLIK_PLANE_CIRCLE => 1,
                BLIK_PLANE_POLYLINE => body.point_count.saturating_sub(1),
                _ => body.point_count,
            }
        };
        (0..self.0.body_count).map(of).fold(0, usize::saturating_add)
    }

    /// A body as the kernel reads it.
    fn kernel(&self, index: usize) -> BodyInput<'_> {
        let body = self.body(index);
        // SAFETY: checked by `new`.
        let numbers = unsafe { input(body.points, 2 * body.point_count) }.unwrap_or_default();
        let shape = match body.shape {
            BLIK_PLANE_CIRCLE => Shape::Circle { centre: body.centre, radius: body.radius },
            _ => Shape::Polyline {
                points: numbers.as_chunks::<2>().0,
                closed: body.shape == BLIK_PLANE_POLYGON,
                smooth: body.smooth != 0,
            },
        };
        BodyInput { shape, material: body.material as usize, elements: body.elements }
    }

    /// Bytes of what stays, and of the tables that the kernel reads the input from.
    fn bytes(&self) -> Result<(usize, usize), blik_error> {
        let kept = PlaneScene::bytes_for(self.primitives(), self.0.body_count, self.0.material_count)?;
        let tables = (size_of::<BodyInput<'_>>().checked_mul(self.0.body_count))
            .zip(size_of::<PlaneMaterial>().checked_mul(self.0.material_count))
            .and_then(|(a, b)| a.checked_add(b)?.checked_add(3 * ALIGNMENT));
        let too_many = blik_error::of(BLIK_ERROR_TOO_MANY).sizes(usize::MAX, 0);
        Ok((kept, tables.ok_or(too_many)?))
    }

    fn size(&self) -> Result<usize, blik_error> {
        let (kept, tables) = self.bytes()?;
        let sum = head::<blik_plane_scene>().checked_add(kept).and_then(|s| s.checked_add(tables));
        sum.ok_or(blik_error::of(BLIK_ERROR_TOO_MANY).sizes(usize::MAX, 0))
    }

    /// Makes the scene.
    fn build(
        &self,
        settings: &Settings,
        memory: &'static mut [u8],
    ) -> Result<*mut blik_plane_scene, blik_error> {
        let (needed, given) = (self.size()?, memory.len());
        if given < needed {
            return Err(blik_error::of(BLIK_ERROR_BUFFER_TOO_SMALL).sizes(needed, given));
        }
        let (place, rest) = place::<blik_plane_scene>(memory)?;
        let (kept, _) = self.bytes()?;
        let short = blik_error::of(BLIK_ERROR_INTERNAL);
        let (own, tables) = rest.split_at_mut_checked(kept).ok_or(short)?;
        let none =
            BodyInput { shape: Shape::Circle { centre: [0.0; 2], radius: 1.0 }, material: 0, elements: 1 };
        let (bodies, tables) = table(tables, self.0.body_count, none)?;
        let blank = PlaneMaterial { diffuse: 0.0, specular: 0.0, gloss: None };
        let (materials, _) = table(tables, self.0.material_count, blank)?;
        for (index, body) in bodies.iter_mut().enumerate() {
            *body = self.kernel(index);
        }
        for (index, material) in materials.iter_mut().enumerate() {
            *material = self.material(index).kernel(index)?;
        }
        let input = PlaneInput { bodies, materials };
        let scene = PlaneScene::new(&input, settings.basis, settings.tolerance, own)?;
        let handle = blik_plane_scene {
            tag: blik_plane_scene::TAG,
            scene,
            settings: *settings,
            bytes: kept,
            #[cfg(feature = "std")]
            owner: None,
        };
        // SAFETY: `place` made room for it.
        unsafe { place.write(handle) };
        Ok(place.as_ptr())
    }
}

/// A table of `count` values at the front of `memory`, and the rest.
fn table<T: Copy>(memory: &mut [u8], count: usize, value: T) -> Result<(&mut [T], &mut [u8]), blik_error> {
    let short = blik_error::of(BLIK_ERROR_INTERNAL);
    let skip = memory.as_ptr().align_offset(ALIGNMENT);
    let size = count.checked_mul(size_of::<T>()).ok_or(short)?;
    let (_, memory) = memory.split_at_mut_checked(skip).ok_or(short)?;
    let (own, rest) = memory.split_at_mut_checked(size).ok_or(short)?;
    const { assert!(align_of::<T>() <= ALIGNMENT) };
    let start = own.as_mut_ptr().cast::<T>();
    for i in 0..count {
        // SAFETY: within the memory just cut off, which is aligned.
        unsafe { start.add(i).write(value) };
    }
    // SAFETY: all have just been written.
    Ok((unsafe { core::slice::from_raw_parts_mut(start, count) }, rest))
}

/// Bytes of memory that [`blik_plane_scene_init`] needs for these bodies, at any address.
///
/// - `bodies`: the bodies and materials
/// - `bytes`: receives the bytes
///
/// # Safety
/// Pointers are null or valid, arrays as long as the structs say.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_plane_scene_size(
    bodies: *const blik_plane_bodies,
    error: *mut blik_error,
    bytes: *mut usize,
) -> blik_status {
    call(error, || {
        let to = needed(bytes)?;
        // SAFETY: by the caller's promise.
        let size = unsafe { Reader::new(bodies) }?.size()?;
        // SAFETY: not null.
        unsafe { to.write(size) };
        Ok(())
    })
}

/// Checks bodies and settings and makes a plane scene of them in the caller's memory.
///
/// - `bodies`: the bodies and materials; not needed afterwards
/// - `settings`: how they are solved
/// - `scene`: receives the scene
///
/// # Safety
/// Pointers are null or valid; nobody else uses the memory while the scene is in use.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_plane_scene_init(
    bodies: *const blik_plane_bodies,
    settings: *const blik_plane_settings,
    memory: *mut c_void,
    size: usize,
    error: *mut blik_error,
    scene: *mut *mut blik_plane_scene,
) -> blik_status {
    call(error, || {
        let to = needed(scene)?;
        // SAFETY: by the caller's promise.
        let (all, settings, memory) =
            unsafe { (Reader::new(bodies)?, super::types::settings(settings)?, bytes(memory, size)?) };
        let made = all.build(&settings, memory)?;
        // SAFETY: not null.
        unsafe { to.write(made) };
        Ok(())
    })
}

/// Checks bodies and settings and makes a plane scene of them in memory of its own.
///
/// - `bodies`: the bodies and materials; not needed afterwards
/// - `settings`: how they are solved
/// - `scene`: receives the scene; to be ended by [`blik_plane_scene_destroy`]
///
/// # Safety
/// Pointers are null or valid, arrays as long as the structs say.
#[cfg(feature = "std")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_plane_scene_create(
    bodies: *const blik_plane_bodies,
    settings: *const blik_plane_settings,
    error: *mut blik_error,
    scene: *mut *mut blik_plane_scene,
) -> blik_status {
    call(error, || {
        let to = needed(scene)?;
        // SAFETY: by the caller's promise.
        let (all, settings) = unsafe { (Reader::new(bodies)?, super::types::settings(settings)?) };
        let mut slab = Slab::new(all.size()?)?;
        // SAFETY: the handle owns the slab, or is never made.
        let made = all.build(&settings, unsafe { slab.bytes_mut() })?;
        // SAFETY: just made, and not null.
        unsafe {
            (*made).owner = Some(std::boxed::Box::new(Owned(std::vec![slab])));
            to.write(made);
        }
        Ok(())
    })
}

/// Ends a plane scene and frees what it owns.
///
/// - `scene`: the scene, whose couplings have ended before; null: nothing
///
/// # Safety
/// Null or a scene that nobody uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_plane_scene_destroy(scene: *mut blik_plane_scene) {
    let _ = caught(|| {
        // SAFETY: by the caller's promise.
        unsafe { end(scene) };
        Ok(())
    });
}

/// Numbers of a plane scene.
///
/// - `scene`: the scene
/// - `info`: receives them; its `struct_size` is set before
///
/// # Safety
/// Pointers are null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_plane_scene_get_info(
    scene: *const blik_plane_scene,
    error: *mut blik_error,
    info: *mut blik_plane_scene_info,
) -> blik_status {
    call(error, || {
        // SAFETY: by the caller's promise.
        let (to, handle): (_, &blik_plane_scene) = unsafe { (Place::new(info)?, object(scene)?) };
        to.write(blik_plane_scene_info {
            bodies: handle.scene.bodies().len(),
            primitives: handle.scene.primitives().len(),
            unknowns: handle.scene.unknowns(),
            bytes: handle.bytes,
            ..blik_plane_scene_info::default()
        });
        Ok(())
    })
}

/// A ray's origin and direction, refused where not finite or of no unit length.
pub(super) fn ray(ray: &blik_plane_ray, index: usize) -> Result<(Vec2, Vec2), blik_error> {
    let (origin, direction) = (Vec2::from(ray.origin), Vec2::from(ray.direction));
    let off = direction.dot(direction) - 1.0;
    if origin.is_finite() && (-1e-6..=1e-6).contains(&off) {
        return Ok((origin, direction));
    }
    Err(blik_error { index, ..blik_error::of(BLIK_ERROR_DIRECTION).field(BLIK_FIELD_RAY_DIRECTION) })
}

/// The first circle or segment that each ray meets.
///
/// - `scene`: the scene
/// - `rays`: the rays; one that is not finite or of no unit direction is refused with its index
/// - `count`: number of rays
/// - `hits`: receives one hit a ray
/// - `hit_count`: number of hits that there is room for: `count`
///
/// # Safety
/// Pointers are null or valid; `rays` and `hits` have `count` entries.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_plane_first_hits(
    scene: *const blik_plane_scene,
    rays: *const blik_plane_ray,
    count: usize,
    error: *mut blik_error,
    hits: *mut blik_plane_hit,
    hit_count: usize,
) -> blik_status {
    call(error, || {
        // SAFETY: by the caller's promise.
        let (handle, rays, out): (&blik_plane_scene, _, _) = unsafe {
            (object(scene)?, input(rays, count)?, output_of((hits, hit_count), count, BLIK_FIELD_HITS)?)
        };
        rays.iter().enumerate().try_for_each(|(index, ray)| self::ray(ray, index).map(|_| ()))?;
        for (index, (ray, out)) in rays.iter().zip(out).enumerate() {
            let (origin, direction) = self::ray(ray, index)?;
            let none = blik_plane_hit {
                point: [0.0; 2],
                normal: [0.0; 2],
                primitive: crate::scene::BLIK_NO_FACET,
                front: 0,
            };
            let hit = handle.scene.first(origin, direction, blik_kernel::plane::scene::NOWHERE);
            *out = hit.map_or(none, |hit| blik_plane_hit {
                point: hit.point.to_array(),
                normal: hit.normal.to_array(),
                primitive: hit.primitive,
                front: i32::from(hit.front),
            });
        }
        Ok(())
    })
}
