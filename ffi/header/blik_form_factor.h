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

@blik_form_factor_point
@blik_form_factor_polygon
@blik_form_factor_scratch_size
@blik_form_factor_visible
@blik_gloss
#ifdef __cplusplus
}
#endif

#endif /* BLIK_FORM_FACTOR_H */
