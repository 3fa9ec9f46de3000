//! What callers hand over.

use crate::status::*;
use crate::types::{Sized_, read, sized};
use blik_kernel::plane::rows::Method;
use blik_kernel::plane::scene::{Basis, PlaneGloss, PlaneMaterial, RaySet};
use blik_kernel::plane::settings::Settings;
use blik_kernel::plane::stencil::MAX_ORDER;
use core::ffi::c_void;
use core::ptr::{null, null_mut};

/// How rays stand for the lobe of a [`blik_plane_material`].
pub type blik_plane_ray_set = i32;

/// The rays that the tolerance needs.
pub const BLIK_PLANE_RAYS_AUTO: i32 = 0;
/// Three rays as in the paper; those below the surface are lost.
pub const BLIK_PLANE_RAYS_PAPER: i32 = 1;
/// Three rays, of which those above the surface share the lobe's albedo.
pub const BLIK_PLANE_RAYS_RENORMALISED: i32 = 2;
/// Gauss nodes in the visible lobe's energy.
pub const BLIK_PLANE_RAYS_GAUSS: i32 = 3;
/// Midpoints of equal shares of the visible lobe's energy.
pub const BLIK_PLANE_RAYS_EQUAL: i32 = 4;
/// Gauss nodes in each part of the lobe between silhouettes.
pub const BLIK_PLANE_RAYS_SPLIT: i32 = 5;

/// Reflectances of a body of the plane model. Arrays of it have a stride: it may grow.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct blik_plane_material {
    /// Diffuse reflectance, in [0, 1]; default 0.
    pub diffuse: f64,
    /// Mirror reflectance, in [0, 1], diffuse + specular <= 1; with gloss the lobe's albedo at normal view; default 0.
    pub specular: f64,
    /// 0 (default): an ideal mirror; else long over short axis of the lobe, >= 1 (1e4 and above: an ideal mirror).
    pub gloss_axis_ratio: f64,
    /// Full angle between the side rays of the paper's three, radians, 0 to 3.2.
    pub spacing: f64,
    /// How rays stand for the lobe; default AUTO.
    pub ray_set: blik_plane_ray_set,
    /// Rays of GAUSS, EQUAL and SPLIT at the first lobe of a path, at the second, and later: 1 to 4096.
    pub rays: [u32; 3],
}

/// Shape of a [`blik_plane_body`].
pub type blik_plane_shape = i32;

/// A circle, seen from outside.
pub const BLIK_PLANE_CIRCLE: i32 = 0;
/// Straight segments from point to point.
pub const BLIK_PLANE_POLYLINE: i32 = 1;
/// Straight segments, the last of which joins the first point.
pub const BLIK_PLANE_POLYGON: i32 = 2;

/// A body of the plane model: a circle, or segments whose fronts are on the right of their direction (counter-clockwise
/// for a solid body, clockwise for a cavity) and whose backs are black and opaque. Bodies touch at most in corners.
/// Arrays of it have a stride: it may grow.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct blik_plane_body {
    /// Circle (default), polyline or polygon.
    pub shape: blik_plane_shape,
    /// Not 0: the segments stand for a smooth curve, whose normals and radiance are interpolated; default 0.
    pub smooth: i32,
    /// Index of the material; default 0.
    pub material: u32,
    /// Elements of the circle, or of each segment, 1 to 2^20; default 1.
    pub elements: u32,
    /// Centre of a circle.
    pub centre: [f64; 2],
    /// Radius of a circle, positive; default 1.
    pub radius: f64,
    /// Two numbers a point; not read for a circle.
    pub points: *const f64,
    /// At least 2 of a polyline, 3 of a polygon, whose first is not repeated.
    pub point_count: usize,
}

/// What a plane scene is made of. Read during the call only.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct blik_plane_bodies {
    /// Size of this struct.
    pub struct_size: usize,
    /// The bodies, at least one.
    pub bodies: *const blik_plane_body,
    /// Number of bodies.
    pub body_count: usize,
    /// Bytes from one body to the next; set by the init function.
    pub body_stride: usize,
    /// The materials, at least one.
    pub materials: *const blik_plane_material,
    /// Number of materials.
    pub material_count: usize,
    /// Bytes from one material to the next; set by the init function.
    pub material_stride: usize,
}

/// A choice of [`blik_plane_settings`] that follows from the tolerance.
pub const BLIK_PLANE_AUTO: i32 = 0;
/// `basis` of [`blik_plane_settings`]: radiance is constant on each element, as in the paper.
pub const BLIK_PLANE_CONSTANT: i32 = 1;
/// `basis` of [`blik_plane_settings`]: linear between the elements' centres.
pub const BLIK_PLANE_LINEAR: i32 = 2;
/// `basis` of [`blik_plane_settings`]: polynomials through `order` Gauss points of each element.
pub const BLIK_PLANE_PANELS: i32 = 3;
/// `method` of [`blik_plane_settings`]: exact form factors of elements times the radiance at their centres, with
/// `points` mirror chains for each, as in the paper.
pub const BLIK_PLANE_FACETS: i32 = 1;
/// `method` of [`blik_plane_settings`]: the half circle is split where chains change, each part with `points` nodes.
pub const BLIK_PLANE_SPLIT: i32 = 2;

/// How a plane scene is solved. All but the tolerance follows from it.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct blik_plane_settings {
    /// Size of this struct.
    pub struct_size: usize,
    /// Wanted error relative to the sky, 1e-13 to 0.1, on bodies that are cut finely enough (a circle of 12 elements at
    /// 1e-4, 16 at 1e-5); default 1e-4.
    pub tolerance: f64,
    /// How the diffuse radiance varies, `BLIK_PLANE_AUTO` (default), `_CONSTANT`, `_LINEAR` or `_PANELS`.
    pub basis: i32,
    /// Gauss points of an element, 1 to 6, where `basis` is PANELS.
    pub order: u32,
    /// How rows are integrated, `BLIK_PLANE_AUTO` (default), `_FACETS` or `_SPLIT`.
    pub method: i32,
    /// Nodes or chains of the method, up to 4096, where that is not AUTO.
    pub points: u32,
    /// Light reflected more often does not count, 1 to 64; below 0 (default): by `cutoff`.
    pub max_bounces: i32,
    /// Chains end where their mirrors leave less than this share, up to 1; below 0 (default): by tolerance.
    pub cutoff: f64,
    /// Bound on the solver's error relative to the brightest light, up to 1; below 0 (default): by tolerance.
    pub solver: f64,
}
sized!(blik_plane_bodies, blik_plane_settings, blik_plane_sky, blik_plane_sun, blik_plane_light);

/// Radiance that arrives from the direction (x, y), a unit vector away from the object: finite, 0 to 1e37. Called by any
/// number of threads at once.
pub type blik_plane_radiance_of = Option<unsafe extern "C" fn(user: *mut c_void, x: f64, y: f64) -> f64>;

/// Most jumps of a plane sky.
pub const BLIK_PLANE_MAX_JUMPS: usize = 12;

/// The sky of a plane scene.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct blik_plane_sky {
    /// Size of this struct.
    pub struct_size: usize,
    /// Radiance from everywhere where `radiance_of` is null; default 1.
    pub radiance: f64,
    /// Radiance by direction; null (default): `radiance`. It must not throw, and is in use as long as the solution.
    pub radiance_of: blik_plane_radiance_of,
    /// Handed to `radiance_of`.
    pub user: *mut c_void,
    /// Directions, two numbers each, at which `radiance_of` jumps or bends; copied.
    pub jumps: *const f64,
    /// At most `BLIK_PLANE_MAX_JUMPS`.
    pub jump_count: usize,
}

/// A point sun of a plane scene.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct blik_plane_sun {
    /// Size of this struct.
    pub struct_size: usize,
    /// Toward the sun, of any length but zero; default (0, 1).
    pub direction: [f64; 2],
    /// Irradiance of a surface that faces it, radiance times angle; default 2, which gives a white one the radiance 1.
    pub irradiance: f64,
    /// The paper's cone: rays that leave the object after a mirror within this angle of the sun see it, radians up to
    /// 1.5. 0 (default): lobes are evaluated at the sun's direction, and ideal mirrors do not show it.
    pub capture_half_angle: f64,
    /// Radiance that such rays see; below 0 (default): the one that keeps the energy, irradiance over the cone's width.
    pub capture_radiance: f64,
}

/// The light of a plane scene. Read during the call only.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct blik_plane_light {
    /// Size of this struct.
    pub struct_size: usize,
    /// The sky; null (default): none.
    pub sky: *const blik_plane_sky,
    /// The sun; null (default): none.
    pub sun: *const blik_plane_sun,
}

impl Default for blik_plane_material {
    fn default() -> blik_plane_material {
        blik_plane_material {
            diffuse: 0.0,
            specular: 0.0,
            gloss_axis_ratio: 0.0,
            spacing: 0.0,
            ray_set: BLIK_PLANE_RAYS_AUTO,
            rays: [0; 3],
        }
    }
}

impl Default for blik_plane_body {
    fn default() -> blik_plane_body {
        blik_plane_body {
            shape: BLIK_PLANE_CIRCLE,
            smooth: 0,
            material: 0,
            elements: 1,
            centre: [0.0; 2],
            radius: 1.0,
            points: null(),
            point_count: 0,
        }
    }
}

impl Default for blik_plane_bodies {
    fn default() -> blik_plane_bodies {
        blik_plane_bodies {
            struct_size: size_of::<blik_plane_bodies>(),
            bodies: null(),
            body_count: 0,
            body_stride: size_of::<blik_plane_body>(),
            materials: null(),
            material_count: 0,
            material_stride: size_of::<blik_plane_material>(),
        }
    }
}

impl Default for blik_plane_settings {
    fn default() -> blik_plane_settings {
        blik_plane_settings {
            struct_size: size_of::<blik_plane_settings>(),
            tolerance: 1e-4,
            basis: BLIK_PLANE_AUTO,
            order: 0,
            method: BLIK_PLANE_AUTO,
            points: 0,
            max_bounces: -1,
            cutoff: -1.0,
            solver: -1.0,
        }
    }
}

impl Default for blik_plane_sky {
    fn default() -> blik_plane_sky {
        blik_plane_sky {
            struct_size: size_of::<blik_plane_sky>(),
            radiance: 1.0,
            radiance_of: None,
            user: null_mut(),
            jumps: null(),
            jump_count: 0,
        }
    }
}

impl Default for blik_plane_sun {
    fn default() -> blik_plane_sun {
        blik_plane_sun {
            struct_size: size_of::<blik_plane_sun>(),
            direction: [0.0, 1.0],
            irradiance: 2.0,
            capture_half_angle: 0.0,
            capture_radiance: -1.0,
        }
    }
}

impl Default for blik_plane_light {
    fn default() -> blik_plane_light {
        blik_plane_light { struct_size: size_of::<blik_plane_light>(), sky: null(), sun: null() }
    }
}

impl blik_plane_material {
    /// The kernel's; `index` is its place.
    pub(super) fn kernel(&self, index: usize) -> Result<PlaneMaterial, blik_error> {
        let rays = match self.ray_set {
            BLIK_PLANE_RAYS_AUTO => None,
            BLIK_PLANE_RAYS_PAPER => Some(RaySet::Paper { spacing: self.spacing, renormalised: false }),
            BLIK_PLANE_RAYS_RENORMALISED => Some(RaySet::Paper { spacing: self.spacing, renormalised: true }),
            BLIK_PLANE_RAYS_GAUSS => Some(RaySet::Gauss(self.rays)),
            BLIK_PLANE_RAYS_EQUAL => Some(RaySet::Equal(self.rays)),
            BLIK_PLANE_RAYS_SPLIT => Some(RaySet::Split(self.rays)),
            other => return Err(blik_error::of(BLIK_ERROR_CHOICE).at(index, 0, f64::from(other))),
        };
        let axis_ratio = self.gloss_axis_ratio;
        let gloss = (axis_ratio != 0.0).then_some(PlaneGloss { axis_ratio, rays });
        Ok(PlaneMaterial { diffuse: self.diffuse, specular: self.specular, gloss })
    }
}

/// The kernel's settings, checked.
///
/// # Safety
/// As for [`read`].
pub(super) unsafe fn settings(settings: *const blik_plane_settings) -> Result<Settings, blik_error> {
    // SAFETY: by the caller's promise.
    let given = unsafe { read(settings) }?;
    let usual = Settings::for_tolerance(given.tolerance);
    let choice = |number: i32| Err(blik_error::of(BLIK_ERROR_CHOICE).at(0, 0, f64::from(number)));
    let range =
        |field, value: u32| Err(blik_error::of(BLIK_ERROR_RANGE).field(field).at(0, 0, f64::from(value)));
    let basis = match given.basis {
        BLIK_PLANE_AUTO => usual.basis,
        BLIK_PLANE_CONSTANT => Basis::Constant,
        BLIK_PLANE_LINEAR => Basis::Linear,
        BLIK_PLANE_PANELS if !(1..=MAX_ORDER as u32).contains(&given.order) => {
            return range(BLIK_FIELD_PLANE_ORDER, given.order);
        }
        BLIK_PLANE_PANELS => Basis::Panels(given.order),
        other => return choice(other),
    };
    let points = given.points;
    let method = match given.method {
        BLIK_PLANE_AUTO => usual.method,
        BLIK_PLANE_FACETS | BLIK_PLANE_SPLIT if points > MOST_POINTS => {
            return range(BLIK_FIELD_PLANE_POINTS, points);
        }
        BLIK_PLANE_FACETS => Method::Facets { chains: points },
        BLIK_PLANE_SPLIT if points == 0 => return range(BLIK_FIELD_PLANE_POINTS, points),
        BLIK_PLANE_SPLIT => Method::Split { points },
        other => return choice(other),
    };
    let or = |value: f64, usual| if value < 0.0 { usual } else { value };
    let settings = Settings {
        basis,
        method,
        max_bounces: u32::try_from(given.max_bounces).ok(),
        cutoff: or(given.cutoff, usual.cutoff),
        solver: or(given.solver, usual.solver),
        tolerance: given.tolerance,
    };
    settings.check()?;
    Ok(settings)
}

/// Nodes or chains of a method.
const MOST_POINTS: u32 = 4096;
