//! Form factors between points, polygons and polygons, in f64, without memory of their own.
//!
//! The form factor from a point to a polygon is the share of the point's cosine hemisphere that the polygon
//! fills, (1/pi) int cos cos' / r^2 dS'; between two polygons it is the mean of that over the first. What
//! eq. 3 and eq. 12 of the paper call the kernel of the coupling is this number where nothing is in the way;
//! [`visible_point_to_polygon`] takes what is in the way out. [`Polygons`] finds those of many pairs at once.
//!
//! Polygons are slices of corners in order, convex and planar; any number of corners is taken. Lengths are in
//! any one unit between about 1e-60 and 1e60; beyond, factors come out as 0. Finite input never gives NaN.
//!
//! This work is based on:
//! * J. H. Lambert, Photometria, 1760: the contour sum from a point;
//! * E. M. Sparrow, "A new and simpler formulation for radiative angle factors", J. Heat Transfer 85, 1963;
//! * G. N. Walton, NISTIR 6925, 2002: one of the two contour integrals in closed form ("1LI");
//! * T. Nishita, E. Nakamae, "Continuous tone representation of three-dimensional objects", SIGGRAPH 1985:
//!   occlusion from a point by subtracting projected polygons.

pub(crate) mod angle;
mod batch;
mod contour;
mod convex;
mod cubature;
mod pair;
mod patch;
mod point;
mod polygons;
mod product;
mod rule;
mod visible;

pub use batch::{TRIANGLE_LANES, TriangleBlock, point_to_triangles};
pub use convex::Convex;
pub use pair::{exchange_area, polygon_to_polygon};
pub use point::{point_to_polygon, point_to_triangle};
pub use polygons::Polygons;
pub use visible::{Estimate, visible_point_to_polygon, visible_polygon_to_polygon};
