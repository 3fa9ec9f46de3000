/*
 * Blik: form factors between points and polygons, and the lobe of glossy materials: closed forms without a scene.
 *
 * Generated from ffi/src and ffi/header; after a change there: UPDATE_HEADER=1 cargo test --test header
 *
 * A form factor is the share that a polygon fills of the cosine-weighted hemisphere of a point, or its mean over the
 * points of another polygon. Coordinates are three numbers of double precision each. blik.h says what holds for memory,
 * threads and errors; these functions are stable as those are.
 *
 * SPDX-License-Identifier: MIT OR Apache-2.0
 */
#ifndef BLIK_FORM_FACTOR_H
#define BLIK_FORM_FACTOR_H

#include <blik.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Form factor from a point with a normal to a convex planar polygon, nothing in the way: the share that it fills of the
 * point's cosine-weighted hemisphere.
 *
 *   point            three numbers
 *   normal           three numbers, of any length but zero
 *   polygon          corners in order, three numbers each
 *   polygon_corners  number of corners
 *   error            receives what is wrong where the call is refused; null: not wanted
 *   factor           receives the form factor */
BLIK_API blik_status blik_form_factor_point(const double *point, const double *normal, const double *polygon,
    size_t polygon_corners, blik_error *error, double *factor);

/* Form factor from one convex planar polygon to another, nothing in the way. Only the sides from which the corners run
 * counter-clockwise see each other.
 *
 *   from             corners in order, three numbers each
 *   from_corners     number of corners
 *   polygon          corners of the other
 *   polygon_corners  number of corners
 *   error            receives what is wrong where the call is refused; null: not wanted
 *   factor           receives the form factor
 *   exchange_area    receives the area of the first times the factor, the same bits for both orders; null: not wanted */
BLIK_API blik_status blik_form_factor_polygon(const double *from, size_t from_corners, const double *polygon,
    size_t polygon_corners, blik_error *error, double *factor, double *exchange_area);

/* Bytes of scratch memory for blik_form_factor_visible.
 *
 *   pieces  convex pieces that the visible part may fall into: each occluder cuts every piece that its outline crosses
 *           into at most four */
BLIK_API size_t blik_form_factor_scratch_size(size_t pieces);

/* Form factor from one convex planar polygon to what opaque triangles leave visible of another.
 *
 *   from             corners in order, three numbers each
 *   from_corners     number of corners
 *   polygon          corners of the other
 *   polygon_corners  number of corners
 *   occluders        the triangles, nine numbers each
 *   occluder_count   number of triangles
 *   tolerance        wanted absolute error, above 0
 *   scratch          memory of blik_form_factor_scratch_size bytes
 *   scratch_size     its bytes
 *   error            receives what is wrong where the call is refused; null: not wanted
 *   factor           receives the form factor
 *   error_estimate   receives its expected error; null: not wanted */
BLIK_API blik_status blik_form_factor_visible(const double *from, size_t from_corners, const double *polygon,
    size_t polygon_corners, const double *occluders, size_t occluder_count, double tolerance, void *scratch,
    size_t scratch_size, blik_error *error, double *factor, double *error_estimate);

/* The lobe of a glossy material, for a specular reflectance of 1.
 *
 *   gloss_axis_ratio  long over short axis of the lobe, 1 or more
 *   cos_view          cosine of the angle between view and normal
 *   cos_off           cosine of the angle from the mirror direction
 *   error             receives what is wrong where the call is refused; null: not wanted
 *   albedo            receives the share of light from everywhere that it mirrors toward the view, at most 1; null: not
 *                     wanted
 *   value             receives its value in sr-1; null: not wanted */
BLIK_API blik_status blik_gloss(double gloss_axis_ratio, double cos_view, double cos_off, blik_error *error,
    double *albedo, double *value);

#ifdef __cplusplus
}
#endif

#endif /* BLIK_FORM_FACTOR_H */
