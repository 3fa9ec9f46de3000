//! Where the observer stands: pixel rays of orthographic and perspective cameras.
//!
//! Constants of this file are measured by `cargo run --release --example calibrate` (errors).

use crate::base::error::{Error, Field};
use crate::base::index::Index;
use crate::base::math::{FRAC_PI_2, Vec3, fabs, sqrt, tan, unit};
use crate::rays::ray::Ray;
use crate::scene::Scene;
use crate::view::raster::Samples;

/// How the image is projected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// Parallel rays; `height` of the image in the caller's length units.
    Orthographic {
        /// Height of the image.
        height: f64,
    },
    /// Rays through the eye; vertical field of view in degrees.
    Perspective {
        /// Vertical field of view, in (0, 180) degrees.
        fov_deg: f64,
    },
}

/// What a pixel's value is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sampling {
    /// Mean radiance over the pixel's square, background included.
    Area,
    /// Radiance along the ray through the pixel's centre.
    Centre,
}

/// A camera as the caller states it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraInput {
    /// Orthographic or perspective.
    pub projection: Projection,
    /// Position of the eye; an orthographic camera's rays start in the plane through it.
    pub eye: [f64; 3],
    /// The point in the image's middle.
    pub target: [f64; 3],
    /// The direction that is up in the image; not parallel to the viewing direction.
    pub up: [f64; 3],
    /// Pixels across.
    pub columns: usize,
    /// Pixels down.
    pub rows: usize,
    /// What a pixel's value is.
    pub sampling: Sampling,
}

/// Largest ratio of the squared distance of a facet to its squared size at which it counts as near.
const NEAR_DISTANCE2: f64 = 4.0;

/// Most pixels along either side of an image.
pub const MAX_RESOLUTION: usize = 1 << 16;

/// A validated camera, in scene coordinates.
#[derive(Clone, Copy, Debug)]
pub struct Camera {
    eye: Vec3,
    forward: Vec3,
    right: Vec3,
    up: Vec3,
    /// Half the image's width and height: at the eye (orthographic) or at distance 1 (perspective).
    half: (f64, f64),
    parallel: bool,
    columns: usize,
    rows: usize,
    sampling: Sampling,
}

impl Camera {
    /// Checks the input and puts the camera into the scene's coordinates.
    ///
    /// # Errors
    /// Names the field that is not finite, out of range or parallel to the viewing direction.
    pub fn new(input: &CameraInput, scene: &Scene<'_>) -> Result<Camera, Error> {
        let finite = |field: Field, v: [f64; 3]| match v.iter().find(|x| !x.is_finite()) {
            Some(&value) => Err(Error::Range { field, band: 0, value }),
            None => Ok(Vec3::from_array(v)),
        };
        let eye = finite(Field::CameraEye, input.eye)?;
        let target = finite(Field::CameraTarget, input.target)?;
        let up =
            unit(finite(Field::CameraUp, input.up)?).ok_or(Error::Direction { field: Field::CameraUp })?;
        let forward = unit(target - eye).ok_or(Error::CameraFrame { field: Field::CameraTarget })?;
        let across = forward.cross(up);
        // below this the direction of `across` is rounding noise
        let right = unit(across)
            .filter(|_| across.length_squared() > 1e-24)
            .ok_or(Error::CameraFrame { field: Field::CameraUp })?;
        for value in [input.columns, input.rows] {
            if !(1..=MAX_RESOLUTION).contains(&value) {
                return Err(Error::Range { field: Field::Resolution, band: 0, value: value as f64 });
            }
        }
        let (half_height, parallel) = match input.projection {
            Projection::Orthographic { height } if height > 0.0 && height.is_finite() => {
                (0.5 * height * scene.scale(), true)
            }
            Projection::Orthographic { height } => {
                return Err(Error::Range { field: Field::CameraHeight, band: 0, value: height });
            }
            Projection::Perspective { fov_deg } if fov_deg > 0.0 && fov_deg < 180.0 => {
                (tan(fov_deg / 180.0 * FRAC_PI_2), false)
            }
            Projection::Perspective { fov_deg } => {
                return Err(Error::Range { field: Field::CameraFieldOfView, band: 0, value: fov_deg });
            }
        };
        Ok(Camera {
            eye: scene.to_scene(eye),
            forward,
            right,
            up: right.cross(forward),
            half: (half_height * input.columns as f64 / input.rows as f64, half_height),
            parallel,
            columns: input.columns,
            rows: input.rows,
            sampling: input.sampling,
        })
    }

    /// The ray through a point of the image: `column` and `row` in pixels from the upper left corner (the
    /// centre of pixel (i, j) is (j + 0.5, i + 0.5)).
    #[inline]
    pub fn ray(&self, column: f64, row: f64) -> Ray {
        let x = (2.0 * (column / self.columns as f64) - 1.0) * self.half.0;
        let y = (1.0 - 2.0 * (row / self.rows as f64)) * self.half.1;
        let aside = self.right * x + self.up * y;
        let (origin, direction) = if self.parallel {
            (self.eye + aside, self.forward)
        } else {
            let d = self.forward + aside;
            (self.eye, unit(d).unwrap_or(self.forward))
        };
        Ray::new(origin, direction)
    }

    /// The centres of the pixels, sample j of row i that of pixel (i, j).
    pub fn samples(&self) -> Samples {
        let ((x, y), (columns, rows)) = (self.half, (self.columns as f64, self.rows as f64));
        Samples {
            eye: self.eye,
            forward: self.forward,
            right: self.right,
            up: self.up,
            parallel: self.parallel,
            first: (x / columns - x, y - y / rows),
            step: (2.0 * x / columns, -2.0 * y / rows),
            shear: 0.0,
            turn: 0.0,
        }
    }

    /// Viewing direction of the image's middle.
    pub fn forward(&self) -> Vec3 {
        self.forward
    }

    /// True for parallel rays.
    pub fn is_parallel(&self) -> bool {
        self.parallel
    }

    /// Area of a pixel of an orthographic image in scene coordinates; of a perspective one at distance 1.
    pub fn pixel_area(&self) -> f64 {
        4.0 * self.half.0 * self.half.1 / (self.columns as f64 * self.rows as f64)
    }

    /// Pixels that the fronts of the facets fill if none hides another; where the eye is near to one, for its size, that is
    /// not told, and infinite.
    pub(crate) fn most_pixels(&self, scene: &Scene<'_>) -> f64 {
        let of = |facet: usize| {
            let ([a, b, c], normal) = (scene.corners().at(facet), scene.normals().at(facet));
            let middle = (a + b + c) / 3.0;
            let from = if self.parallel { -self.forward } else { self.eye - middle };
            let cosine = from.dot(normal);
            let seen = if scene.sides() == 2 { fabs(cosine) } else { cosine.max(0.0) };
            let distance = if self.parallel { 1.0 } else { sqrt(from.length_squared()) };
            let size = [a, b, c].iter().map(|corner| (*corner - middle).length_squared()).fold(0.0, f64::max);
            if !self.parallel && seen > 0.0 && distance * distance < NEAR_DISTANCE2 * size {
                return f64::INFINITY;
            }
            scene.areas().at(facet) * seen / (distance * distance * distance).max(f64::MIN_POSITIVE)
        };
        (0..scene.facets()).map(of).sum::<f64>() / self.pixel_area()
    }

    /// Pixels across.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Pixels down.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// What a pixel's value is.
    pub fn sampling(&self) -> Sampling {
        self.sampling
    }
}
