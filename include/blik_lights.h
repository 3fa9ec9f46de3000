/*
 * Blik: many lights in one call, and what signatures are made of and depend on.
 *
 * Generated from ffi/src and ffi/header; after a change there: UPDATE_HEADER=1 cargo test --test header
 *
 * Both start from a blik_coupling and solve it in scratch memory: no blik_solution is kept. blik.h says what holds for
 * memory, threads, errors and structs; these functions are stable as those are.
 *
 * SPDX-License-Identifier: MIT OR Apache-2.0
 */
#ifndef BLIK_LIGHTS_H
#define BLIK_LIGHTS_H

#include <blik.h>

#ifdef __cplusplus
extern "C" {
#endif

/* ---- Many lights in one call ------------------------------------------------------------------------------------- */

/* Bytes of scratch memory with which blik_lights keeps all lanes of run busy. More speeds up scenes with mirrors that
 * scatter sunlight.
 *
 *   coupling      the coupling
 *   lights        the lights
 *   light_count   number of lights
 *   light_stride  bytes from one light to the next: sizeof(blik_light)
 *   run           how the call runs; null: on the calling thread
 *   error         receives what is wrong where the call is refused; null: not wanted
 *   bytes         receives the bytes; less is for fewer lanes */
BLIK_API blik_status blik_lights_scratch_size(const blik_coupling *coupling, const blik_light *lights,
    size_t light_count, size_t light_stride, const blik_run *run, blik_error *error, size_t *bytes);

/* Solves many lights against one coupling: suns, skies, emissions of facets. Each is solved by one task; lights of the same
 * sky share what is known of it. The results have the bits of blik_solution_init, blik_facets and blik_signatures one by
 * one. To have what sun, sky and emission bring apart, light the scene by each alone (an emission of zeros where facets emit),
 * with one reference_radiance: they add up to what all bring together, to the tolerance. Outputs of lights that
 * were done before one is refused are written. An error's index is the light's number; where a facet's emission
 * is refused, index is the facet and given the light's number.
 *
 *   coupling          the coupling
 *   lights            the lights
 *   light_count       number of lights
 *   light_stride      bytes from one light to the next: sizeof(blik_light)
 *   directions        three numbers a view, from the observer toward the object, of any length but zero
 *   direction_count   number of views
 *   cells             cells along each side of the projection, one ray each, up to 65536; 0: by tolerance
 *   run               how the call runs; null: on the calling thread
 *   scratch           scratch memory; with the standard library null takes it from the heap
 *   scratch_size      its bytes
 *   error             receives what is wrong where the call is refused; null: not wanted
 *   irradiance        receives mean irradiance, one value a light, facet, side and band, bands innermost; null: not
 *                     wanted
 *   irradiance_count  number of values that there is room for: lights x facets x sides x bands
 *   radiance          receives as many diffuse radiances; null: not wanted
 *   radiance_count    number of values that there is room for: lights x facets x sides x bands
 *   signatures        receives one entry a light, view and band, bands innermost; null where there are no views
 *   signature_count   number of entries that there is room for: lights x views x bands
 *   signature_stride  bytes from one entry to the next: sizeof(blik_signature) */
BLIK_API blik_status blik_lights(const blik_coupling *coupling, const blik_light *lights, size_t light_count,
    size_t light_stride, const double *directions, size_t direction_count, size_t cells, const blik_run *run,
    void *scratch, size_t scratch_size, blik_error *error, double *irradiance, size_t irradiance_count,
    double *radiance, size_t radiance_count, blik_signature *signatures, size_t signature_count,
    size_t signature_stride);

/* ---- What signatures are made of and depend on ------------------------------------------------------------------- */

/* Bytes of scratch memory for blik_explain. More is for scenes with mirrors that scatter sunlight.
 *
 *   coupling  the coupling
 *   light     the light
 *   error     receives what is wrong where the call is refused; null: not wanted
 *   bytes     receives the bytes */
BLIK_API blik_status blik_explain_scratch_size(const blik_coupling *coupling, const blik_light *light,
    blik_error *error, size_t *bytes);

/* Solves a scene for its light and tells of the signature in each direction what it is made of and how it changes with
 * diffuse reflectances and emissions of all facets, by the transposed system. Shares of facets, and terms, add up to the radiant
 * intensity. Derivatives are those of the numbers that the solver's equations define, of elements and rays as they are; chains
 * between mirrors that are cut at the tolerance end there for them. With sky and sun signatures are linear: their derivatives by
 * those are the signatures under each alone (blik_lights). Refused where max_bounces counts reflections
 * (BLIK_ERROR_RANGE). The whole call runs on the calling thread; calls on other threads may run besides.
 *
 *   coupling           the coupling
 *   light              the light
 *   directions         three numbers a view, from the observer toward the object, of any length but zero
 *   direction_count    number of views
 *   cells              cells along each side of the projection, one ray each, up to 65536; 0: by tolerance
 *   run                the defaults or a progress function, told once a view; tasks are not used
 *   scratch            scratch memory; with the standard library null takes it from the heap
 *   scratch_size       its bytes
 *   error              receives what is wrong where the call is refused; null: not wanted
 *   signatures         receives one entry a view and band, bands innermost: the bits of blik_signatures
 *   signature_count    number of entries that there is room for: views x bands
 *   signature_stride   bytes from one entry to the next: sizeof(blik_signature)
 *   shares             receives what the observer sees of each facet first, W/sr, one value a view, facet and band;
 *                      null: not wanted
 *   share_count        number of values that there is room for: views x facets x bands
 *   terms              receives three values a view and band, W/sr: all bands' diffuse, then mirrored sky and sun, then
 *                      mirrored diffuse; null: not wanted
 *   term_count         number of values that there is room for: views x 3 x bands
 *   by_diffuse         receives derivatives of the radiant intensity by each facet's diffuse reflectance, W/sr, one
 *                      value a view, facet and band; 0 where a facet reflects nothing diffusely in the band; null: not
 *                      wanted
 *   by_diffuse_count   number of values that there is room for: views x facets x bands
 *   by_emission        receives derivatives by the emission of each facet and side, in the square of the mesh's unit,
 *                      one value a view, facet, side and band; null: not wanted
 *   by_emission_count  number of values that there is room for: views x facets x sides x bands */
BLIK_API blik_status blik_explain(const blik_coupling *coupling, const blik_light *light, const double *directions,
    size_t direction_count, size_t cells, const blik_run *run, void *scratch, size_t scratch_size, blik_error *error,
    blik_signature *signatures, size_t signature_count, size_t signature_stride, double *shares, size_t share_count,
    double *terms, size_t term_count, double *by_diffuse, size_t by_diffuse_count, double *by_emission,
    size_t by_emission_count);

#ifdef __cplusplus
}
#endif

#endif /* BLIK_LIGHTS_H */
