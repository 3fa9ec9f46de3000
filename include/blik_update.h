/*
 * Blik: couplings that are kept while materials change and parts of the mesh move.
 *
 * Generated from ffi/src and ffi/header; after a change there: UPDATE_HEADER=1 cargo test --test header
 *
 * A coupling is made once, of the mesh as it is. Then, for each set of poses and materials:
 *
 *     blik_scene_pose_create(&mesh, &parts, &error, &scene);                     the parts where they stand now
 *     blik_update_create(kept, scene, &parts, NULL, &error, &coupling);          what still holds, and the rest anew
 *     ... solutions, lights, signatures of it ...
 *     blik_coupling_destroy(coupling); blik_scene_destroy(scene);
 *
 * Where only materials change, the scene is that of the same mesh with other materials, and parts are null. blik.h says
 * what holds for memory, threads, errors and structs; these functions are stable as those are.
 *
 * SPDX-License-Identifier: MIT OR Apache-2.0
 */
#ifndef BLIK_UPDATE_H
#define BLIK_UPDATE_H

#include <blik.h>

#ifdef __cplusplus
extern "C" {
#endif

/* ---- Parts and poses --------------------------------------------------------------------------------------------- */

/* Where a rigid part stands: what is at x in the mesh is at R x + t. Frozen: it does not grow. */
typedef struct blik_pose {
    double rotation[9]; /* The rotation R, row by row. */
    double translation[3]; /* The translation t, in the mesh's unit. */
} blik_pose;

/* A pose by a quaternion w, x, y, z of any length but zero, and a translation.
 *
 *   quaternion   four numbers
 *   translation  three numbers, in the mesh's unit
 *   error        receives what is wrong where the call is refused; null: not wanted
 *   pose         receives the pose */
BLIK_API blik_status blik_pose_from_quaternion(const double *quaternion, const double *translation, blik_error *error,
    blik_pose *pose);

/* The rigid parts of a mesh, and where they stand. */
typedef struct blik_parts {
    size_t struct_size; /* Size of this struct. */
    const uint32_t *facet_parts; /* The part of each facet. */
    size_t facet_count; /* Number of facets. */
    const blik_pose *poses; /* Where each part stands. */
    size_t pose_count; /* Number of parts. */
} blik_parts;

/* Sets struct_size of a blik_parts, all else to 0. */
static inline void blik_parts_init(blik_parts *parts)
{
    const blik_parts none = {sizeof(blik_parts), 0, 0, 0, 0};
    *parts = none;
}

/* As blik_scene_init, of a mesh whose parts stand elsewhere: blik_scene_size tells the bytes.
 *
 *   mesh    the mesh; not needed afterwards
 *   parts   its parts and their poses; not needed afterwards
 *   memory  memory of the caller, at any address
 *   size    its bytes
 *   error   receives what is wrong where the call is refused; null: not wanted
 *   scene   receives the scene */
BLIK_API blik_status blik_scene_pose_init(const blik_mesh *mesh, const blik_parts *parts, void *memory, size_t size,
    blik_error *error, blik_scene **scene);

#ifdef BLIK_STD
/* As blik_scene_pose_init, in memory of the library's own.
 *
 *   mesh   the mesh; not needed afterwards
 *   parts  its parts and their poses; not needed afterwards
 *   error  receives what is wrong where the call is refused; null: not wanted
 *   scene  receives the scene; to be ended by blik_scene_destroy */
BLIK_API blik_status blik_scene_pose_create(const blik_mesh *mesh, const blik_parts *parts, blik_error *error,
    blik_scene **scene);
#endif

/* ---- Couplings that are kept ------------------------------------------------------------------------------------- */

/* Bytes of memory with which blik_update_init can begin: as for blik_coupling_size.
 *
 *   kept   the coupling that is kept
 *   scene  the scene
 *   parts  what moved; null: nothing
 *   error  receives what is wrong where the call is refused; null: not wanted
 *   bytes  receives the bytes */
BLIK_API blik_status blik_update_size(const blik_coupling *kept, const blik_scene *scene, const blik_parts *parts,
    blik_error *error, size_t *bytes);

/* Makes the coupling of a scene by what still holds of another's: of the same mesh with other materials, or with parts at
 * other poses, or both. Elements and settings stay. New diffuse reflectances and emissions trace no ray; rows by way of
 * mirrors are multiplied by new products of reflectances; rows whose rays can meet nothing that moved against them are kept.
 * All others are computed anew; blik_update_get_info says how many. Where a facet that shares an element with others has
 * another material than these, BLIK_ERROR_UNCOUPLED names it. Results depend on kept and on the scene, not on poses
 * before; they differ from a coupling from scratch by what the estimates of both tell. Memory as for blik_coupling_init;
 * calls on other threads may use kept besides.
 *
 *   kept      the coupling that is kept, which must outlive the new one; its parts stand where its mesh has them
 *   scene     the scene, which must outlive the coupling: by blik_scene_pose_init with the same parts, or of the same
 *             mesh
 *   parts     what moved; null: nothing
 *   run       how the call runs; null: on the calling thread
 *   memory    memory of the caller, at any address
 *   size      its bytes
 *   error     receives what is wrong where the call is refused; null: not wanted
 *   coupling  receives the coupling */
BLIK_API blik_status blik_update_init(const blik_coupling *kept, const blik_scene *scene, const blik_parts *parts,
    const blik_run *run, void *memory, size_t size, blik_error *error, blik_coupling **coupling);

#ifdef BLIK_STD
/* As blik_update_init, in memory of the library's own.
 *
 *   kept      the coupling that is kept, which must outlive the new one
 *   scene     the scene, which must outlive the coupling
 *   parts     what moved; null: nothing
 *   run       how the call runs; null: on the calling thread
 *   error     receives what is wrong where the call is refused; null: not wanted
 *   coupling  receives the coupling; to be ended by blik_coupling_destroy */
BLIK_API blik_status blik_update_create(const blik_coupling *kept, const blik_scene *scene, const blik_parts *parts,
    const blik_run *run, blik_error *error, blik_coupling **coupling);
#endif

/* What became of the rows of a coupling that was kept. */
typedef struct blik_update_info {
    size_t struct_size; /* Size of this struct. */
    uint64_t kept; /* Rows kept as they are. */
    uint64_t rescaled; /* Rows kept with other products of mirror reflectances. */
    uint64_t redone; /* Rows computed anew. */
    uint64_t rays; /* Rays traced for these. */
} blik_update_info;

/* Sets struct_size of a blik_update_info. */
static inline void blik_update_info_init(blik_update_info *info)
{
    info->struct_size = sizeof(blik_update_info);
}

/* What became of the rows of a coupling that blik_update_init made; of any other one all were computed.
 *
 *   coupling  the coupling
 *   error     receives what is wrong where the call is refused; null: not wanted
 *   info      receives the numbers; its struct_size is set before */
BLIK_API blik_status blik_update_get_info(const blik_coupling *coupling, blik_error *error, blik_update_info *info);

#ifdef __cplusplus
}
#endif

#endif /* BLIK_UPDATE_H */
