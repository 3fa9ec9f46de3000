//! Status codes, the fields that they speak of, and what a refused call tells besides.

use blik_kernel::plane::scene::{BODY_ELEMENTS, BODY_RADIUS};
use blik_kernel::{Error, Field};
use core::ffi::{CStr, c_char};

/// Status that a call returns: whether it was done, and if not, why.
pub type blik_status = i32;

/// Done.
pub const BLIK_OK: i32 = 0;

/// A pointer that must not be null is.
pub const BLIK_ERROR_NULL: i32 = 1;

/// A struct's `struct_size` was not set, or is of a newer header than the library: `needed` is the library's, `given` the
/// struct's.
pub const BLIK_ERROR_STRUCT_SIZE: i32 = 2;

/// A number stands for no choice: a type, a model, a projection, a sampling.
pub const BLIK_ERROR_CHOICE: i32 = 3;

/// A handle was not made by this library, is destroyed, or belongs to other handles than those given beside it.
pub const BLIK_ERROR_HANDLE: i32 = 4;

/// Memory is smaller than needed: `needed` and `given` are in bytes.
pub const BLIK_ERROR_BUFFER_TOO_SMALL: i32 = 5;

/// An array has the wrong number of entries, or a stride shorter than an entry: `needed` and `given`.
pub const BLIK_ERROR_LENGTH: i32 = 6;

/// More of something than there may be; `needed` is the limit.
pub const BLIK_ERROR_TOO_MANY: i32 = 7;

/// The mesh has no facets, or the plane scene no bodies.
pub const BLIK_ERROR_NO_FACETS: i32 = 8;

/// The mesh or the plane scene has no materials.
pub const BLIK_ERROR_NO_MATERIALS: i32 = 9;

/// The number of spectral bands is outside 1 to 64; `given`.
pub const BLIK_ERROR_BANDS: i32 = 10;

/// Vertex `index` is not finite.
pub const BLIK_ERROR_VERTEX: i32 = 11;

/// Vertex normal `index` is zero or not finite.
pub const BLIK_ERROR_NORMAL: i32 = 12;

/// The mesh is too large or too small for double precision.
pub const BLIK_ERROR_EXTENT: i32 = 13;

/// Facet `index` has a vertex index (`value`) out of range.
pub const BLIK_ERROR_VERTEX_INDEX: i32 = 14;

/// Facet `index` has a normal index (`value`) out of range.
pub const BLIK_ERROR_NORMAL_INDEX: i32 = 15;

/// Facet or plane body `index` has a material (`value`) that there is not.
pub const BLIK_ERROR_MATERIAL_INDEX: i32 = 16;

/// `field` of material `index` is out of range in `band`.
pub const BLIK_ERROR_MATERIAL: i32 = 17;

/// Diffuse and mirror reflectance of material `index` add up to more than 1 in `band`.
pub const BLIK_ERROR_REFLECTANCE_SUM: i32 = 18;

/// `field` is out of range (`value`, in `band`; of facet `index` where it is one of each facet).
pub const BLIK_ERROR_RANGE: i32 = 19;

/// The direction `field` is zero or not finite.
pub const BLIK_ERROR_DIRECTION: i32 = 20;

/// The camera's `field` coincides with the eye or is parallel to the viewing direction.
pub const BLIK_ERROR_CAMERA: i32 = 21;

/// The light grows without bound: a closed part of the scene reflects all of it.
pub const BLIK_ERROR_DIVERGES: i32 = 22;

/// The progress callback asked to stop.
pub const BLIK_ERROR_CANCELLED: i32 = 23;

/// The coupling kept no directions, which a sky that is not uniform needs.
pub const BLIK_ERROR_NOT_DIRECTIONAL: i32 = 24;

/// A baked block is damaged, of another version or byte order, or not a block.
pub const BLIK_ERROR_BLOCK: i32 = 25;

/// Memory does not start on the boundary that it must start on.
pub const BLIK_ERROR_ALIGNMENT: i32 = 26;

/// The system gave no memory.
pub const BLIK_ERROR_MEMORY: i32 = 27;

/// A fault of the library; please report it.
pub const BLIK_ERROR_INTERNAL: i32 = 28;

/// Body `index` of a plane scene is no circle or polyline; `field` tells why.
pub const BLIK_ERROR_BODY: i32 = 29;

/// Facet `index` emits or reflects (`field`) light for which the coupling has no entries: it was made for another material.
pub const BLIK_ERROR_UNCOUPLED: i32 = 30;

/// Facet `index` belongs to a part (`value`) that has no pose.
pub const BLIK_ERROR_PART: i32 = 31;

/// The pose of part `index` is not finite, or its matrix is no rotation.
pub const BLIK_ERROR_POSE: i32 = 32;

pub(crate) fn status_text(number: i32) -> &'static CStr {
    match number {
        BLIK_OK => c"done",
        BLIK_ERROR_NULL => c"a pointer is null",
        BLIK_ERROR_STRUCT_SIZE => c"struct_size is not set, or of a newer header than the library",
        BLIK_ERROR_CHOICE => c"a number stands for no choice",
        BLIK_ERROR_HANDLE => c"a handle is not valid, or belongs to another scene",
        BLIK_ERROR_BUFFER_TOO_SMALL => c"memory is too small",
        BLIK_ERROR_LENGTH => c"an array has the wrong number of entries, or too short a stride",
        BLIK_ERROR_TOO_MANY => c"more of something than there may be",
        BLIK_ERROR_NO_FACETS => c"there are no facets",
        BLIK_ERROR_NO_MATERIALS => c"there are no materials",
        BLIK_ERROR_BANDS => c"the number of bands is not in 1 to 64",
        BLIK_ERROR_VERTEX => c"a vertex is not finite",
        BLIK_ERROR_NORMAL => c"a vertex normal is zero or not finite",
        BLIK_ERROR_EXTENT => c"the mesh is too large or too small",
        BLIK_ERROR_VERTEX_INDEX => c"a vertex index is out of range",
        BLIK_ERROR_NORMAL_INDEX => c"a normal index is out of range",
        BLIK_ERROR_MATERIAL_INDEX => c"a material index is out of range",
        BLIK_ERROR_MATERIAL => c"a material's value is out of range",
        BLIK_ERROR_REFLECTANCE_SUM => c"diffuse and specular reflectance exceed 1 together",
        BLIK_ERROR_RANGE => c"a value is out of range",
        BLIK_ERROR_DIRECTION => c"a direction is zero or not finite",
        BLIK_ERROR_CAMERA => c"the camera's target is its eye, or its up is parallel to its direction",
        BLIK_ERROR_DIVERGES => c"the interreflections diverge: a closed part reflects all light",
        BLIK_ERROR_CANCELLED => c"cancelled",
        BLIK_ERROR_NOT_DIRECTIONAL => c"the coupling was made without directions, which this sky needs",
        BLIK_ERROR_BLOCK => c"the baked block is damaged, of another version, or none",
        BLIK_ERROR_ALIGNMENT => c"memory is not aligned",
        BLIK_ERROR_MEMORY => c"out of memory",
        BLIK_ERROR_INTERNAL => c"internal error",
        BLIK_ERROR_UNCOUPLED => c"the coupling has no entries for a facet's light",
        BLIK_ERROR_PART => c"a facet's part has no pose",
        BLIK_ERROR_POSE => c"a pose is not finite, or no rotation",
        BLIK_ERROR_BODY => c"a body of the plane model is not valid",
        _ => c"unknown status",
    }
}

/// Field that a refused call is about.
pub type blik_field = i32;

/// No field.
pub const BLIK_FIELD_NONE: i32 = 0;

/// Diffuse reflectance of a material.
pub const BLIK_FIELD_DIFFUSE: i32 = 1;

/// Mirror reflectance of a material.
pub const BLIK_FIELD_SPECULAR: i32 = 2;

/// Emission of a material, or of the whole scene where radiances exceed 1e37.
pub const BLIK_FIELD_EMISSION: i32 = 3;

/// Axis ratio of a material's lobe.
pub const BLIK_FIELD_GLOSS_AXIS_RATIO: i32 = 4;

/// Rays of a material's lobe.
pub const BLIK_FIELD_GLOSS_RAYS: i32 = 5;

/// The tolerance.
pub const BLIK_FIELD_TOLERANCE: i32 = 6;

/// The reference radiance.
pub const BLIK_FIELD_REFERENCE_RADIANCE: i32 = 7;

/// Radiance of the sky.
pub const BLIK_FIELD_SKY_RADIANCE: i32 = 8;

/// Radiance of the ground.
pub const BLIK_FIELD_SKY_GROUND: i32 = 9;

/// The sky's up.
pub const BLIK_FIELD_SKY_UP: i32 = 10;

/// Type of the CIE sky.
pub const BLIK_FIELD_SKY_CIE_TYPE: i32 = 11;

/// Table of the sky.
pub const BLIK_FIELD_SKY_TABLE: i32 = 12;

/// The CIE sky's sun.
pub const BLIK_FIELD_SKY_SUN_DIRECTION: i32 = 13;

/// The table's azimuth 0.
pub const BLIK_FIELD_SKY_AZIMUTH_ZERO: i32 = 14;

/// Direction of the sun.
pub const BLIK_FIELD_SUN_DIRECTION: i32 = 15;

/// Irradiance of the sun.
pub const BLIK_FIELD_SUN_IRRADIANCE: i32 = 16;

/// Half angle of the sun.
pub const BLIK_FIELD_SUN_HALF_ANGLE: i32 = 17;

/// The camera's eye.
pub const BLIK_FIELD_CAMERA_EYE: i32 = 18;

/// The camera's target.
pub const BLIK_FIELD_CAMERA_TARGET: i32 = 19;

/// The camera's up.
pub const BLIK_FIELD_CAMERA_UP: i32 = 20;

/// The camera's height.
pub const BLIK_FIELD_CAMERA_HEIGHT: i32 = 21;

/// The camera's field of view.
pub const BLIK_FIELD_CAMERA_FOV: i32 = 22;

/// Columns or rows of the image.
pub const BLIK_FIELD_RESOLUTION: i32 = 23;

/// A direction given to the call.
pub const BLIK_FIELD_DIRECTION: i32 = 24;

/// A range of rows.
pub const BLIK_FIELD_ROWS: i32 = 25;

/// Reflections that count.
pub const BLIK_FIELD_MAX_BOUNCES: i32 = 26;

/// Gauss points of an element of the plane model.
pub const BLIK_FIELD_PLANE_ORDER: i32 = 27;

/// Nodes or chains of a method of the plane model.
pub const BLIK_FIELD_PLANE_POINTS: i32 = 28;

/// Elements of a body of the plane model.
pub const BLIK_FIELD_BODY_ELEMENTS: i32 = 29;

/// Radius of a body of the plane model.
pub const BLIK_FIELD_BODY_RADIUS: i32 = 30;

/// Coordinates of a body of the plane model: not finite, beyond 1e100, too few points, or two that coincide.
pub const BLIK_FIELD_BODY_POINTS: i32 = 31;

/// Errors in a tally.
pub const BLIK_FIELD_TALLY: i32 = 32;

/// The mesh's vertices.
pub const BLIK_FIELD_VERTICES: i32 = 33;

/// The mesh's facets.
pub const BLIK_FIELD_FACETS: i32 = 34;

/// The materials of the mesh's facets.
pub const BLIK_FIELD_FACET_MATERIALS: i32 = 35;

/// The mesh's normals.
pub const BLIK_FIELD_NORMALS: i32 = 36;

/// The normals of the mesh's facets.
pub const BLIK_FIELD_FACET_NORMALS: i32 = 37;

/// The mesh's materials.
pub const BLIK_FIELD_MATERIALS: i32 = 38;

/// Tasks at once.
pub const BLIK_FIELD_LANES: i32 = 39;

/// Where a ray starts.
pub const BLIK_FIELD_RAY_ORIGIN: i32 = 40;

/// Direction of a ray: not finite, or of no unit length.
pub const BLIK_FIELD_RAY_DIRECTION: i32 = 41;

/// Where hits of a ray no longer count.
pub const BLIK_FIELD_RAY_T_MAX: i32 = 42;

/// The facet that a ray leaves.
pub const BLIK_FIELD_RAY_SKIP: i32 = 43;

/// Pixels of an image.
pub const BLIK_FIELD_PIXELS: i32 = 44;

/// Terms of the radiance of an image.
pub const BLIK_FIELD_COMPONENTS: i32 = 45;

/// Areas of facets.
pub const BLIK_FIELD_AREAS: i32 = 46;

/// Irradiance of facets.
pub const BLIK_FIELD_IRRADIANCE: i32 = 47;

/// Radiance of facets or along rays.
pub const BLIK_FIELD_RADIANCE: i32 = 48;

/// Hits of rays.
pub const BLIK_FIELD_HITS: i32 = 49;

/// Signatures.
pub const BLIK_FIELD_SIGNATURES: i32 = 50;

/// Views of a signature.
pub const BLIK_FIELD_CELLS: i32 = 51;

/// Samples of the plane model.
pub const BLIK_FIELD_SAMPLES: i32 = 52;

/// Form factors.
pub const BLIK_FIELD_FACTORS: i32 = 53;

/// Shares of facets in signatures.
pub const BLIK_FIELD_SHARES: i32 = 54;

/// Parts of a mesh.
pub const BLIK_FIELD_PARTS: i32 = 55;

pub(crate) fn field_text(number: i32) -> &'static CStr {
    match number {
        BLIK_FIELD_NONE => c"",
        BLIK_FIELD_DIFFUSE => c"diffuse",
        BLIK_FIELD_SPECULAR => c"specular",
        BLIK_FIELD_EMISSION => c"emission",
        BLIK_FIELD_GLOSS_AXIS_RATIO => c"gloss_axis_ratio",
        BLIK_FIELD_GLOSS_RAYS => c"gloss_rays",
        BLIK_FIELD_TOLERANCE => c"tolerance",
        BLIK_FIELD_REFERENCE_RADIANCE => c"reference_radiance",
        BLIK_FIELD_SKY_RADIANCE => c"sky radiance",
        BLIK_FIELD_SKY_GROUND => c"sky ground",
        BLIK_FIELD_SKY_UP => c"sky up",
        BLIK_FIELD_SKY_CIE_TYPE => c"sky cie_type",
        BLIK_FIELD_SKY_TABLE => c"sky table",
        BLIK_FIELD_SKY_SUN_DIRECTION => c"sky sun_direction",
        BLIK_FIELD_SKY_AZIMUTH_ZERO => c"sky azimuth_zero",
        BLIK_FIELD_SUN_DIRECTION => c"sun direction",
        BLIK_FIELD_SUN_IRRADIANCE => c"sun irradiance",
        BLIK_FIELD_SUN_HALF_ANGLE => c"sun half_angle_deg",
        BLIK_FIELD_CAMERA_EYE => c"camera eye",
        BLIK_FIELD_CAMERA_TARGET => c"camera target",
        BLIK_FIELD_CAMERA_UP => c"camera up",
        BLIK_FIELD_CAMERA_HEIGHT => c"camera height",
        BLIK_FIELD_CAMERA_FOV => c"camera fov_deg",
        BLIK_FIELD_RESOLUTION => c"camera columns or rows",
        BLIK_FIELD_DIRECTION => c"direction",
        BLIK_FIELD_ROWS => c"rows",
        BLIK_FIELD_MAX_BOUNCES => c"max_bounces",
        BLIK_FIELD_PLANE_ORDER => c"plane order",
        BLIK_FIELD_PLANE_POINTS => c"plane points",
        BLIK_FIELD_BODY_ELEMENTS => c"body elements",
        BLIK_FIELD_BODY_RADIUS => c"body radius",
        BLIK_FIELD_BODY_POINTS => c"body points",
        BLIK_FIELD_TALLY => c"tally",
        BLIK_FIELD_VERTICES => c"vertices",
        BLIK_FIELD_FACETS => c"facets",
        BLIK_FIELD_FACET_MATERIALS => c"facet_materials",
        BLIK_FIELD_NORMALS => c"normals",
        BLIK_FIELD_FACET_NORMALS => c"facet_normals",
        BLIK_FIELD_MATERIALS => c"materials",
        BLIK_FIELD_LANES => c"lanes",
        BLIK_FIELD_RAY_ORIGIN => c"ray origin",
        BLIK_FIELD_RAY_DIRECTION => c"ray direction",
        BLIK_FIELD_RAY_T_MAX => c"ray t_max",
        BLIK_FIELD_RAY_SKIP => c"ray skip",
        BLIK_FIELD_PIXELS => c"pixels",
        BLIK_FIELD_COMPONENTS => c"components",
        BLIK_FIELD_AREAS => c"areas",
        BLIK_FIELD_IRRADIANCE => c"irradiance",
        BLIK_FIELD_RADIANCE => c"radiance",
        BLIK_FIELD_HITS => c"hits",
        BLIK_FIELD_SIGNATURES => c"signatures",
        BLIK_FIELD_CELLS => c"cells",
        BLIK_FIELD_SAMPLES => c"samples",
        BLIK_FIELD_FACTORS => c"factors",
        BLIK_FIELD_SHARES => c"shares",
        BLIK_FIELD_PARTS => c"parts",
        _ => c"",
    }
}

/// Error of a refused call. Written where a call is refused and the pointer to it is not null; nothing has
/// to be set before. Frozen: it does not grow.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct blik_error {
    /// The status that the call returned.
    pub status: blik_status,
    /// The field that it is about.
    pub field: blik_field,
    /// Index of the facet, vertex, normal, material, ray or direction that it is about; else 0.
    pub index: usize,
    /// Spectral band; else 0.
    pub band: usize,
    /// The offending value; else 0.
    pub value: f64,
    /// Bytes or entries needed, or the limit; else 0.
    pub needed: usize,
    /// Bytes or entries given; else 0.
    pub given: usize,
}

impl blik_error {
    pub(crate) const fn of(status: i32) -> blik_error {
        blik_error { status, field: 0, index: 0, band: 0, value: 0.0, needed: 0, given: 0 }
    }

    pub(crate) const fn field(self, field: i32) -> blik_error {
        blik_error { field, ..self }
    }

    pub(crate) const fn sizes(self, needed: usize, given: usize) -> blik_error {
        blik_error { needed, given, ..self }
    }

    pub(crate) const fn at(self, index: usize, band: usize, value: f64) -> blik_error {
        blik_error { index, band, value, ..self }
    }
}

impl From<Error> for blik_error {
    fn from(error: Error) -> blik_error {
        use blik_error as e;
        match error {
            Error::BufferTooSmall { needed, given } => {
                e::of(BLIK_ERROR_BUFFER_TOO_SMALL).sizes(needed, given)
            }
            Error::Length { what, expected, given } => {
                let field = match what {
                    "facet_materials" => BLIK_FIELD_FACET_MATERIALS,
                    "facet_normals" => BLIK_FIELD_FACET_NORMALS,
                    "parts" => BLIK_FIELD_PARTS,
                    _ => BLIK_FIELD_NONE,
                };
                e::of(BLIK_ERROR_LENGTH).field(field).sizes(expected, given)
            }
            Error::TooMany { limit, .. } => e::of(BLIK_ERROR_TOO_MANY).sizes(limit, 0),
            Error::NoFacets => e::of(BLIK_ERROR_NO_FACETS),
            Error::NoMaterials => e::of(BLIK_ERROR_NO_MATERIALS),
            Error::Bands { given } => e::of(BLIK_ERROR_BANDS).sizes(64, given),
            Error::VertexNotFinite { vertex } => e::of(BLIK_ERROR_VERTEX).at(vertex, 0, 0.0),
            Error::NormalNotFinite { normal } => e::of(BLIK_ERROR_NORMAL).at(normal, 0, 0.0),
            Error::Extent => e::of(BLIK_ERROR_EXTENT),
            Error::IndexOutOfRange { facet, index, .. } => {
                e::of(BLIK_ERROR_VERTEX_INDEX).at(facet, 0, index as f64)
            }
            Error::NormalIndexOutOfRange { facet, index, .. } => {
                e::of(BLIK_ERROR_NORMAL_INDEX).at(facet, 0, index as f64)
            }
            Error::MaterialOutOfRange { facet, material, .. } => {
                e::of(BLIK_ERROR_MATERIAL_INDEX).at(facet, 0, material as f64)
            }
            Error::BandCount { material, field, expected, given } => {
                let error = e::of(BLIK_ERROR_LENGTH).at(material, 0, 0.0);
                error.field(number(field)).sizes(expected, given)
            }
            Error::MaterialRange { material, band, field, value } => {
                e::of(BLIK_ERROR_MATERIAL).field(number(field)).at(material, band, value)
            }
            Error::ReflectanceSum { material, band, sum } => {
                e::of(BLIK_ERROR_REFLECTANCE_SUM).at(material, band, sum)
            }
            Error::FacetRange { facet, band, field, value } => {
                e::of(BLIK_ERROR_RANGE).field(number(field)).at(facet, band, value)
            }
            Error::Uncoupled { facet, field } => {
                e::of(BLIK_ERROR_UNCOUPLED).field(number(field)).at(facet, 0, 0.0)
            }
            Error::PartOutOfRange { facet, part, .. } => e::of(BLIK_ERROR_PART).at(facet, 0, part as f64),
            Error::Pose { part } => e::of(BLIK_ERROR_POSE).at(part, 0, 0.0),
            Error::LightBandCount { field, expected, given } => {
                e::of(BLIK_ERROR_LENGTH).field(number(field)).sizes(expected, given)
            }
            Error::Range { field, band, value } => {
                e::of(BLIK_ERROR_RANGE).field(number(field)).at(0, band, value)
            }
            Error::Direction { field } => e::of(BLIK_ERROR_DIRECTION).field(number(field)),
            Error::CameraFrame { field } => e::of(BLIK_ERROR_CAMERA).field(number(field)),
            Error::Body { body, what } => {
                let field = match what {
                    BODY_ELEMENTS => BLIK_FIELD_BODY_ELEMENTS,
                    BODY_RADIUS => BLIK_FIELD_BODY_RADIUS,
                    _ => BLIK_FIELD_BODY_POINTS,
                };
                e::of(BLIK_ERROR_BODY).field(field).at(body, 0, 0.0)
            }
            Error::Mismatch { what: "coupling without directions" } => e::of(BLIK_ERROR_NOT_DIRECTIONAL),
            Error::Mismatch { .. } => e::of(BLIK_ERROR_HANDLE),
            Error::Diverges { row_sum } => e::of(BLIK_ERROR_DIVERGES).at(0, 0, row_sum),
            Error::OutOfMemory { bytes } => e::of(BLIK_ERROR_MEMORY).sizes(bytes, 0),
            Error::Cancelled => e::of(BLIK_ERROR_CANCELLED),
            Error::Block => e::of(BLIK_ERROR_BLOCK),
            _ => e::of(BLIK_ERROR_INTERNAL),
        }
    }
}

fn number(field: Field) -> i32 {
    match field {
        Field::Diffuse => BLIK_FIELD_DIFFUSE,
        Field::Specular => BLIK_FIELD_SPECULAR,
        Field::Emission => BLIK_FIELD_EMISSION,
        Field::AxisRatio => BLIK_FIELD_GLOSS_AXIS_RATIO,
        Field::GlossRays => BLIK_FIELD_GLOSS_RAYS,
        Field::Tolerance => BLIK_FIELD_TOLERANCE,
        Field::ReferenceRadiance => BLIK_FIELD_REFERENCE_RADIANCE,
        Field::SkyRadiance => BLIK_FIELD_SKY_RADIANCE,
        Field::SkyGround => BLIK_FIELD_SKY_GROUND,
        Field::SkyUp => BLIK_FIELD_SKY_UP,
        Field::SkyType => BLIK_FIELD_SKY_CIE_TYPE,
        Field::SkyTable => BLIK_FIELD_SKY_TABLE,
        Field::SkySunDirection => BLIK_FIELD_SKY_SUN_DIRECTION,
        Field::SkyAzimuthZero => BLIK_FIELD_SKY_AZIMUTH_ZERO,
        Field::SunDirection => BLIK_FIELD_SUN_DIRECTION,
        Field::SunIrradiance => BLIK_FIELD_SUN_IRRADIANCE,
        Field::SunHalfAngle => BLIK_FIELD_SUN_HALF_ANGLE,
        Field::CameraEye => BLIK_FIELD_CAMERA_EYE,
        Field::CameraTarget => BLIK_FIELD_CAMERA_TARGET,
        Field::CameraUp => BLIK_FIELD_CAMERA_UP,
        Field::CameraHeight => BLIK_FIELD_CAMERA_HEIGHT,
        Field::CameraFieldOfView => BLIK_FIELD_CAMERA_FOV,
        Field::Resolution => BLIK_FIELD_RESOLUTION,
        Field::Direction => BLIK_FIELD_DIRECTION,
        Field::Rows => BLIK_FIELD_ROWS,
        Field::MaxBounces => BLIK_FIELD_MAX_BOUNCES,
        _ => BLIK_FIELD_NONE,
    }
}

/// The words for a status: never null, never to be freed.
///
/// - `status`: a `blik_status`, as the number that it is
#[unsafe(no_mangle)]
pub extern "C" fn blik_status_text(status: i32) -> *const c_char {
    status_text(status).as_ptr()
}

/// The name of a field as the structs spell it: never null, never to be freed; empty for no field.
///
/// - `field`: a `blik_field`, as the number that it is
#[unsafe(no_mangle)]
pub extern "C" fn blik_field_text(field: i32) -> *const c_char {
    field_text(field).as_ptr()
}
