/*
 * Blik: photometric images of faceted diffuse-mirror objects. C interface.
 *
 * Generated from ffi/src by cbindgen; after a change there: UPDATE_HEADER=1 cargo test --test header
 *
 * SPDX-License-Identifier: MIT OR Apache-2.0
 */

#ifndef BLIK_H
#define BLIK_H

#include <stddef.h>
#include <stdint.h>

/**
 * Major version of the library that this header belongs to.
 */
#define BLIK_VERSION_MAJOR 0

/**
 * Minor version of the library that this header belongs to. While the major version is 0, a new minor version
 * may change the interface.
 */
#define BLIK_VERSION_MINOR 1

/**
 * Patch version of the library that this header belongs to.
 */
#define BLIK_VERSION_PATCH 0

/**
 * Version of the library that this header belongs to, as `major * 10000 + minor * 100 + patch`.
 */
#define BLIK_VERSION (((BLIK_VERSION_MAJOR * 10000) + (BLIK_VERSION_MINOR * 100)) + BLIK_VERSION_PATCH)

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/**
 * Version of the library that is linked, as `major * 10000 + minor * 100 + patch`; `BLIK_VERSION` is that of
 * the header. May be called by any number of threads at once.
 */
uint32_t blik_version(void);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* BLIK_H */
