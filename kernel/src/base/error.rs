//! What can be wrong with an input, with the index of the offender.

use core::fmt;

/// The input field that an [`Error`] speaks of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum Field {
    Diffuse,
    Specular,
    Emission,
    AxisRatio,
    GlossRays,
    VertexNormals,
    FacetMaterials,
    Tolerance,
    MaxBounces,
    ReferenceRadiance,
    SkyRadiance,
    SkyGround,
    SkyUp,
    SkyType,
    SkyTable,
    SkySunDirection,
    SkyAzimuthZero,
    SunDirection,
    SunIrradiance,
    SunHalfAngle,
    CameraEye,
    CameraTarget,
    CameraUp,
    CameraHeight,
    CameraFieldOfView,
    Resolution,
    Background,
    Direction,
    Rows,
}

impl Field {
    /// The words for messages.
    pub const fn name(self) -> &'static str {
        match self {
            Field::Diffuse => "diffuse reflectance",
            Field::Specular => "specular reflectance",
            Field::Emission => "emission",
            Field::AxisRatio => "gloss axis_ratio",
            Field::GlossRays => "gloss rays",
            Field::VertexNormals => "vertex normals",
            Field::FacetMaterials => "facet materials",
            Field::Tolerance => "tolerance",
            Field::MaxBounces => "max_bounces",
            Field::ReferenceRadiance => "reference_radiance",
            Field::SkyRadiance => "sky radiance",
            Field::SkyGround => "sky ground",
            Field::SkyUp => "sky up",
            Field::SkyType => "sky type",
            Field::SkyTable => "sky table",
            Field::SkySunDirection => "sky sun_direction",
            Field::SkyAzimuthZero => "sky azimuth_zero",
            Field::SunDirection => "sun direction",
            Field::SunIrradiance => "sun irradiance",
            Field::SunHalfAngle => "sun half_angle_deg",
            Field::CameraEye => "camera eye",
            Field::CameraTarget => "camera target",
            Field::CameraUp => "camera up",
            Field::CameraHeight => "camera height",
            Field::CameraFieldOfView => "camera fov_deg",
            Field::Resolution => "resolution",
            Field::Background => "background",
            Field::Direction => "direction",
            Field::Rows => "row range",
        }
    }
}

/// Every way in which a call can be refused. Nothing is written when one is returned.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum Error {
    /// The memory handed over is smaller than the stage needs; both in bytes.
    BufferTooSmall {
        needed: usize,
        given: usize,
    },
    /// An output slice has the wrong number of entries.
    Length {
        what: &'static str,
        expected: usize,
        given: usize,
    },
    /// More of something than the index type holds.
    TooMany {
        what: &'static str,
        limit: usize,
    },
    /// The mesh has no facet.
    NoFacets,
    /// The scene has no material.
    NoMaterials,
    /// Number of spectral bands outside 1..=64.
    Bands {
        given: usize,
    },
    VertexNotFinite {
        vertex: usize,
    },
    NormalNotFinite {
        normal: usize,
    },
    /// The mesh is larger than f64 can square.
    Extent,
    IndexOutOfRange {
        facet: usize,
        index: usize,
        vertices: usize,
    },
    NormalIndexOutOfRange {
        facet: usize,
        index: usize,
        normals: usize,
    },
    MaterialOutOfRange {
        facet: usize,
        material: usize,
        materials: usize,
    },
    /// A material's array has not one value per band.
    BandCount {
        material: usize,
        field: Field,
        expected: usize,
        given: usize,
    },
    /// A material's value is not finite or outside its range.
    MaterialRange {
        material: usize,
        band: usize,
        field: Field,
        value: f64,
    },
    /// rho_d + rho_s > 1.
    ReflectanceSum {
        material: usize,
        band: usize,
        sum: f64,
    },
    /// A facet's value is not finite or outside its range.
    FacetRange {
        facet: usize,
        band: usize,
        field: Field,
        value: f64,
    },
    /// A facet sends or receives light for which the coupling has no entries: it was made for another material.
    Uncoupled {
        facet: usize,
        field: Field,
    },
    /// A facet belongs to a part that has no pose.
    PartOutOfRange {
        facet: usize,
        part: usize,
        parts: usize,
    },
    /// A part's pose is not finite, or its matrix no rotation.
    Pose {
        part: usize,
    },
    /// A light's array has not one value per band, or per facet, side and band.
    LightBandCount {
        field: Field,
        expected: usize,
        given: usize,
    },
    /// A value is not finite or outside its range.
    Range {
        field: Field,
        band: usize,
        value: f64,
    },
    /// A direction is zero or not finite.
    Direction {
        field: Field,
    },
    /// The camera's up is parallel to the viewing direction, or eye and target coincide.
    CameraFrame {
        field: Field,
    },
    /// A body of the plane model is no circle or polyline, or has too few elements.
    Body {
        body: usize,
        what: &'static str,
    },
    /// The stage's inputs were made from another scene.
    Mismatch {
        what: &'static str,
    },
    /// The light grows without bound: some closed part of the scene reflects all of it.
    Diverges {
        row_sum: f64,
    },
    /// The system gives no more memory.
    OutOfMemory {
        bytes: usize,
    },
    /// The caller's progress function asked to stop.
    Cancelled,
    /// A baked block is damaged, of another version or byte order, or none.
    Block,
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Error::BufferTooSmall { needed, given } => {
                write!(f, "buffer of {given} bytes is too small: {needed} bytes are needed")
            }
            Error::Length { what, expected, given } => {
                write!(f, "{what}: expected {expected} entries, got {given}")
            }
            Error::TooMany { what, limit } => write!(f, "too many {what}: at most {limit}"),
            Error::NoFacets => write!(f, "the mesh has no facets"),
            Error::NoMaterials => write!(f, "the scene has no materials"),
            Error::Bands { given } => write!(f, "bands: expected 1 to 64, got {given}"),
            Error::VertexNotFinite { vertex } => write!(f, "vertex {vertex} is not finite"),
            Error::NormalNotFinite { normal } => write!(f, "vertex normal {normal} is zero or not finite"),
            Error::Extent => write!(f, "the mesh's extent is too large or too small for f64"),
            Error::IndexOutOfRange { facet, index, vertices } => {
                write!(f, "facet {facet}: vertex index {index} is out of range (vertices: {vertices})")
            }
            Error::NormalIndexOutOfRange { facet, index, normals } => {
                write!(f, "facet {facet}: normal index {index} is out of range (normals: {normals})")
            }
            Error::MaterialOutOfRange { facet, material, materials } => {
                write!(f, "facet {facet}: material {material} is out of range (materials: {materials})")
            }
            Error::BandCount { material, field, expected, given } => {
                write!(
                    f,
                    "material {material}: {}: expected {expected} values (one per band), got {given}",
                    field.name()
                )
            }
            Error::MaterialRange { material, band, field, value } => {
                write!(f, "material {material}, band {band}: {} {value} is out of range", field.name())
            }
            Error::ReflectanceSum { material, band, sum } => {
                write!(f, "material {material}, band {band}: diffuse + specular = {sum} exceeds 1")
            }
            Error::FacetRange { facet, band, field, value } => {
                write!(f, "facet {facet}, band {band}: {} {value} is out of range", field.name())
            }
            Error::Uncoupled { facet, field } => {
                write!(f, "facet {facet}: {}: the coupling was made without entries for it", field.name())
            }
            Error::PartOutOfRange { facet, part, parts } => {
                write!(f, "facet {facet}: part {part} is out of range (parts: {parts})")
            }
            Error::Pose { part } => write!(f, "part {part}: its pose is not finite or no rotation"),
            Error::LightBandCount { field, expected, given } => {
                write!(f, "{}: expected {expected} values, got {given}", field.name())
            }
            Error::Range { field, band, value } => {
                write!(f, "{}: value {value} (band {band}) is out of range", field.name())
            }
            Error::Direction { field } => write!(f, "{}: zero or not finite", field.name()),
            Error::CameraFrame { field } => {
                write!(f, "{}: coincides with or is parallel to the viewing direction", field.name())
            }
            Error::Body { body, what } => write!(f, "body {body}: {what}"),
            Error::Mismatch { what } => write!(f, "{what} belongs to another scene"),
            Error::Diverges { row_sum } => {
                write!(
                    f,
                    "the interreflections diverge: a closed part reflects all light (row sum {row_sum})"
                )
            }
            Error::OutOfMemory { bytes } => write!(f, "the system gives no {bytes} bytes of memory"),
            Error::Cancelled => write!(f, "cancelled"),
            Error::Block => {
                write!(f, "the baked block is damaged, of another version or byte order, or none")
            }
        }
    }
}

impl core::error::Error for Error {}
