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

@blik_pose
@blik_pose_from_quaternion
@blik_parts
/* Sets struct_size of a blik_parts, all else to 0. */
static inline void blik_parts_init(blik_parts *parts)
{
    const blik_parts none = {sizeof(blik_parts), 0, 0, 0, 0};
    *parts = none;
}

@blik_scene_pose_init
@blik_scene_pose_create
/* ---- Couplings that are kept ------------------------------------------------------------------------------------- */

@blik_update_size
@blik_update_init
@blik_update_create
@blik_update_info
/* Sets struct_size of a blik_update_info. */
static inline void blik_update_info_init(blik_update_info *info)
{
    info->struct_size = sizeof(blik_update_info);
}

@blik_update_get_info
#ifdef __cplusplus
}
#endif

#endif /* BLIK_UPDATE_H */
