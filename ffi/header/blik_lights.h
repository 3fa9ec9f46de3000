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

@blik_lights_scratch_size
@blik_lights
/* ---- What signatures are made of and depend on ------------------------------------------------------------------- */

@blik_explain_scratch_size
@blik_explain
#ifdef __cplusplus
}
#endif

#endif /* BLIK_LIGHTS_H */
