//! What callers hand over: plain structs, each with a function that sets its defaults.

use crate::status::*;
use core::ffi::c_void;
use core::ptr::{NonNull, null};

/// Type of the numbers of a [`blik_array`].
pub type blik_format = i32;

/// Floating point, 32 bits.
pub const BLIK_F32: i32 = 1;
/// Floating point, 64 bits.
pub const BLIK_F64: i32 = 2;
/// Unsigned integers, 8 bits.
pub const BLIK_U8: i32 = 3;
/// Unsigned integers, 16 bits.
pub const BLIK_U16: i32 = 4;
/// Unsigned integers, 32 bits.
pub const BLIK_U32: i32 = 5;
/// Unsigned integers, 64 bits.
pub const BLIK_U64: i32 = 6;

/// "No vertex normal" among the indices of normals.
pub const BLIK_NO_NORMAL: u32 = 0xffff_ffff;

/// An array as the caller keeps it: entries `stride` bytes apart, each of as many numbers as its use needs, packed.
/// `count` 0: absent. Frozen: it does not grow.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct blik_array {
    /// First entry, aligned as its numbers need; not read when `count` is 0.
    pub data: *const c_void,
    /// Number of entries.
    pub count: usize,
    /// Bytes from one entry to the next; 0: the size of an entry.
    pub stride: usize,
    /// Type of the numbers.
    pub format: blik_format,
}

impl blik_array {
    const NONE: blik_array = blik_array { data: null(), count: 0, stride: 0, format: 0 };
}

/// Reflectances and emission of one material, one value per band each; a null pointer stands for zeros.
/// Arrays of it have a stride: it may grow.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct blik_material {
    /// Diffuse reflectance, in [0, 1].
    pub diffuse: *const f64,
    /// Mirror reflectance, in [0, 1]; diffuse + specular <= 1. With gloss: the lobe's albedo at normal view.
    pub specular: *const f64,
    /// Own diffuse radiance, >= 0, W m-2 sr-1.
    pub emission: *const f64,
    /// 0: an ideal mirror; else long over short axis of the lobe, >= 1 (1e4 and above: an ideal mirror).
    pub gloss_axis_ratio: f64,
    /// Rays at the first hit of the lobe, up to 65536; 0: by tolerance.
    pub gloss_rays: u32,
}

/// A mesh with its materials. Read during the call only.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct blik_mesh {
    /// Size of this struct.
    pub struct_size: usize,
    /// Positions: three `BLIK_F64` or `BLIK_F32` each, in any unit and at any offset.
    pub vertices: blik_array,
    /// Three vertex indices (`BLIK_U8` to `BLIK_U64`) a facet, counter-clockwise seen from the front.
    pub facets: blik_array,
    /// Material of each facet (`BLIK_U8` to `BLIK_U64`); absent: all 0.
    pub facet_materials: blik_array,
    /// Normals for interpolated mirror directions, three `BLIK_F64` or `BLIK_F32` each; absent: mirrors are flat.
    pub normals: blik_array,
    /// Three normal indices a facet (`BLIK_U32` or `BLIK_U64`), all bits set for none; absent: as `facets`.
    pub facet_normals: blik_array,
    /// The materials.
    pub materials: *const blik_material,
    /// Number of materials, at least 1.
    pub material_count: usize,
    /// Bytes from one material to the next; set by the init function.
    pub material_stride: usize,
    /// Spectral bands, 1 to 64; default 1.
    pub bands: usize,
    /// Not 0: both sides carry material and emission; default 0: backs are black and opaque.
    pub two_sided: i32,
}

/// Settings of a coupling.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct blik_settings {
    /// Size of this struct.
    pub struct_size: usize,
    /// The wanted rms error of an image's pixels relative to the reference radiance: 1e-6 to 0.1; default 2e-3.
    pub tolerance: f64,
    /// Light reflected more often does not count; below 0 (default): by tolerance.
    pub max_bounces: i32,
    /// Not 0: irradiance of all facets is wanted, also of those that reflect nothing diffusely; default 0.
    pub all_irradiances: i32,
    /// Not 0 (default): any sky can light the scene without new rays; 0: uniform skies only, in less memory, and in
    /// closed form, sooner and more exactly, where nothing is hidden.
    pub directional: i32,
    /// Not 0: where the caller's memory is too small for the rows, their rays are halved until it is not; what that costs
    /// is in the report's error estimate. Default 0: the call is refused and tells the bytes that it would need.
    pub fit_memory: i32,
    /// Most rays that rows may send, those by way of mirrors not counted, but for 64 a row at least; 0 (default): as many
    /// as the tolerance needs. What fewer cost is in the report's error estimate. It is a budget of time, too: coupling
    /// goes on at a steady number of rays a second.
    pub ray_budget: u64,
    /// Wanted error of images, 1e-6 to 0.1; 0 (default): `tolerance`. If it is smaller than `tolerance`, the diffuse
    /// solution is computed to `tolerance` only, and final gathering at the points that an image shows removes the
    /// rest: faster for one or two precise images, slower for many. There is no final gathering without the standard
    /// library, where `max_bounces` is given, or where lobes or curved mirrors reflect sunlight onto facets: the
    /// report's error estimate tells. Baked blocks do not keep it.
    pub image_tolerance: f64,
}

/// How the radiance of a [`blik_sky`] varies with the direction.
pub type blik_sky_model = i32;

/// The same radiance from the whole sphere.
pub const BLIK_SKY_UNIFORM: i32 = 0;
/// The same radiance from above the horizon.
pub const BLIK_SKY_HEMISPHERE: i32 = 1;
/// Above the horizon radiance (1 + 2 sin(elevation))/3.
pub const BLIK_SKY_OVERCAST: i32 = 2;
/// One of the fifteen types of ISO 15469.
pub const BLIK_SKY_CIE: i32 = 3;
/// Linear in the height from ground (nadir) to radiance (zenith).
pub const BLIK_SKY_GRADIENT: i32 = 4;
/// Samples by elevation and azimuth, as in an environment map.
pub const BLIK_SKY_TABLE: i32 = 5;

/// A sky. Read during the call only: its arrays are copied.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct blik_sky {
    /// Size of this struct.
    pub struct_size: usize,
    /// How radiance varies; default `BLIK_SKY_UNIFORM`.
    pub model: blik_sky_model,
    /// 1 to 15: the type of a CIE sky; default 1.
    pub cie_type: u32,
    /// Radiance per band as the model uses it (for a table a factor), W m-2 sr-1; null (default): 1.
    pub radiance: *const f64,
    /// Radiance below the horizon per band; null (default): 0.
    pub ground: *const f64,
    /// Toward the zenith, of any length but zero; default (0, 0, 1).
    pub up: [f64; 3],
    /// Toward the sun of a CIE sky, above the horizon.
    pub sun_direction: [f64; 3],
    /// Samples of a table: `table_rows` x `table_columns` x `table_bands`, row by row from the zenith down, columns
    /// counter-clockwise seen from above; bilinear between the centres.
    pub table: *const f32,
    /// Steps of elevation.
    pub table_rows: usize,
    /// Steps of azimuth.
    pub table_columns: usize,
    /// 1, or the scene's number of bands; default 1.
    pub table_bands: usize,
    /// Azimuth 0 of a table, projected off `up`; zeros (default): (1, 0, 0), or (0, 1, 0) where that is up.
    pub table_azimuth_zero: [f64; 3],
}

/// The sun. Read during the call only.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct blik_sun {
    /// Size of this struct.
    pub struct_size: usize,
    /// Toward the centre of the sun, of any length but zero; default (0, 0, 1).
    pub direction: [f64; 3],
    /// Irradiance per band of an unshaded plane that faces the sun, W m-2; null (default): pi.
    pub irradiance: *const f64,
    /// Angular radius in degrees: 0 (a point) or 1e-4 to 10; default 0.2665.
    pub half_angle_deg: f64,
}

/// The light of a scene. Read during the call only.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct blik_light {
    /// Size of this struct.
    pub struct_size: usize,
    /// The sky; null (default): none.
    pub sky: *const blik_sky,
    /// The sun; null (default): none.
    pub sun: *const blik_sun,
    /// The radiance per band to which errors are related; null (default): from the light.
    pub reference_radiance: *const f64,
    /// Own diffuse radiance of each facet, side and band, bands innermost, 0 to 1e37 W m-2 sr-1, in place of the materials'
    /// emission: new temperatures ask for no ray. Facets whose materials neither reflect diffusely nor emit may emit nothing
    /// here, either (`BLIK_ERROR_UNCOUPLED`). Null (default): the materials'.
    pub emission: *const f64,
    /// Number of those values: facets x sides x bands; 0 (default) without them.
    pub emission_count: usize,
}

/// Projection of a [`blik_camera`].
pub type blik_projection = i32;

/// Parallel rays.
pub const BLIK_ORTHOGRAPHIC: i32 = 0;
/// Rays through the eye.
pub const BLIK_PERSPECTIVE: i32 = 1;

/// Sampling of a pixel of a [`blik_camera`].
pub type blik_sampling = i32;

/// Mean radiance over the pixel's square, background included.
pub const BLIK_SAMPLE_AREA: i32 = 0;
/// Radiance along the ray through the pixel's centre.
pub const BLIK_SAMPLE_CENTRE: i32 = 1;

/// A camera. Row 0 is the top; nothing before the eye is seen.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct blik_camera {
    /// Size of this struct.
    pub struct_size: usize,
    /// `BLIK_ORTHOGRAPHIC` (default) or `BLIK_PERSPECTIVE`.
    pub projection: blik_projection,
    /// `BLIK_SAMPLE_AREA` (default) or `BLIK_SAMPLE_CENTRE`.
    pub sampling: blik_sampling,
    /// Position of the eye, in the mesh's coordinates.
    pub eye: [f64; 3],
    /// The point in the image's middle.
    pub target: [f64; 3],
    /// Direction that is up in the image; default (0, 0, 1).
    pub up: [f64; 3],
    /// Orthographic: height of the image in the mesh's unit.
    pub height: f64,
    /// Perspective: vertical field of view in degrees.
    pub fov_deg: f64,
    /// Pixels across, 1 to 65536.
    pub columns: usize,
    /// Pixels down, 1 to 65536.
    pub rows: usize,
}

/// Structs whose first member tells their size, which programs of older headers have shorter.
pub(crate) trait Sized_: Copy + Default {
    /// Bytes of the shortest that there ever was.
    const FIRST: usize;
    /// The first member.
    fn size_mut(&mut self) -> &mut usize;
}

/// `NAME from MEMBER`: the struct ended before MEMBER once.
macro_rules! sized {
    (@first $name:ident) => { size_of::<$name>() };
    (@first $name:ident $member:ident) => { core::mem::offset_of!($name, $member) };
    ($($name:ident $(from $member:ident)?),*) => { $(
        impl Sized_ for $name {
            const FIRST: usize = sized!(@first $name $($member)?);
            fn size_mut(&mut self) -> &mut usize {
                &mut self.struct_size
            }
        }
    )* };
}
sized!(blik_mesh, blik_settings from image_tolerance, blik_sky, blik_sun, blik_light from emission, blik_camera);
pub(crate) use sized;

/// The size that a struct of the caller tells: not null, aligned, and of this library's or an older header.
///
/// # Safety
/// `at` is null or points to a size.
unsafe fn told<T: Sized_>(at: *const T) -> Result<usize, blik_error> {
    if at.is_null() {
        return Err(blik_error::of(BLIK_ERROR_NULL));
    }
    if !at.is_aligned() {
        return Err(blik_error::of(BLIK_ERROR_ALIGNMENT));
    }
    // SAFETY: not null, aligned, and by the caller's promise at least a size.
    let given = unsafe { at.cast::<usize>().read() };
    if !(T::FIRST..=size_of::<T>()).contains(&given) {
        return Err(blik_error::of(BLIK_ERROR_STRUCT_SIZE).sizes(size_of::<T>(), given));
    }
    Ok(given)
}

/// Reads a struct of the caller; members that its header did not have yet have their defaults.
///
/// # Safety
/// `at` is null or points to a size that is followed by as many bytes as it says.
pub(crate) unsafe fn read<T: Sized_>(at: *const T) -> Result<T, blik_error> {
    let mut value = T::default();
    // SAFETY: the caller's struct is as long as it says, and no longer than T; any bytes make a T.
    unsafe {
        let given = told(at)?;
        core::ptr::copy_nonoverlapping(at.cast::<u8>(), (&raw mut value).cast::<u8>(), given);
    }
    *value.size_mut() = size_of::<T>();
    Ok(value)
}

/// A struct of the caller that is to be written.
pub(crate) struct Place<T> {
    at: NonNull<T>,
    size: usize,
}

impl<T: Sized_> Place<T> {
    /// # Safety
    /// `at` is null or points to a size that is followed by as many bytes as it says.
    pub unsafe fn new(at: *mut T) -> Result<Place<T>, blik_error> {
        // SAFETY: by the caller's promise.
        let size = unsafe { told(at.cast_const()) }?;
        Ok(Place { at: NonNull::new(at).ok_or(blik_error::of(BLIK_ERROR_NULL))?, size })
    }

    /// As [`Place::new`], for an output that the caller may leave out: `None` for a null pointer.
    ///
    /// # Safety
    /// As for `new`.
    pub unsafe fn optional(at: *mut T) -> Result<Option<Place<T>>, blik_error> {
        // SAFETY: by the caller's promise.
        if at.is_null() { Ok(None) } else { unsafe { Place::new(at) }.map(Some) }
    }

    /// Writes what the caller's header has of it.
    pub fn write(self, mut value: T) {
        *value.size_mut() = self.size;
        // SAFETY: by the promise of `new` there are `size` bytes, no more than a T has.
        unsafe {
            let from = (&raw const value).cast::<u8>();
            core::ptr::copy_nonoverlapping(from, self.at.as_ptr().cast::<u8>(), self.size);
        }
    }
}

impl Default for blik_mesh {
    fn default() -> blik_mesh {
        let none = blik_array::NONE;
        blik_mesh {
            struct_size: size_of::<blik_mesh>(),
            vertices: blik_array { format: BLIK_F64, ..none },
            facets: blik_array { format: BLIK_U32, ..none },
            facet_materials: blik_array { format: BLIK_U32, ..none },
            normals: blik_array { format: BLIK_F64, ..none },
            facet_normals: blik_array { format: BLIK_U32, ..none },
            materials: null(),
            material_count: 0,
            material_stride: size_of::<blik_material>(),
            bands: 1,
            two_sided: 0,
        }
    }
}

impl Default for blik_settings {
    fn default() -> blik_settings {
        blik_settings {
            struct_size: size_of::<blik_settings>(),
            tolerance: 2e-3,
            max_bounces: -1,
            all_irradiances: 0,
            directional: 1,
            fit_memory: 0,
            ray_budget: 0,
            image_tolerance: 0.0,
        }
    }
}

impl Default for blik_sky {
    fn default() -> blik_sky {
        blik_sky {
            struct_size: size_of::<blik_sky>(),
            model: BLIK_SKY_UNIFORM,
            cie_type: 1,
            radiance: null(),
            ground: null(),
            up: [0.0, 0.0, 1.0],
            sun_direction: [0.0; 3],
            table: null(),
            table_rows: 0,
            table_columns: 0,
            table_bands: 1,
            table_azimuth_zero: [0.0; 3],
        }
    }
}

impl Default for blik_sun {
    fn default() -> blik_sun {
        blik_sun {
            struct_size: size_of::<blik_sun>(),
            direction: [0.0, 0.0, 1.0],
            irradiance: null(),
            half_angle_deg: 0.2665,
        }
    }
}

impl Default for blik_light {
    fn default() -> blik_light {
        blik_light {
            struct_size: size_of::<blik_light>(),
            sky: null(),
            sun: null(),
            reference_radiance: null(),
            emission: null(),
            emission_count: 0,
        }
    }
}

impl Default for blik_camera {
    fn default() -> blik_camera {
        blik_camera {
            struct_size: size_of::<blik_camera>(),
            projection: BLIK_ORTHOGRAPHIC,
            sampling: BLIK_SAMPLE_AREA,
            eye: [0.0; 3],
            target: [0.0; 3],
            up: [0.0, 0.0, 1.0],
            height: 0.0,
            fov_deg: 0.0,
            columns: 0,
            rows: 0,
        }
    }
}
