/*
 * Blik: the plane model, the same photometry in two dimensions, on circles and polylines, where the truth is known to
 * 1e-7.
 *
 * Generated from ffi/src and ffi/header; after a change there: UPDATE_HEADER=1 cargo test --test header
 *
 *     blik_plane_bodies -> blik_plane_scene -> blik_plane_coupling -> blik_plane_solution -> blik_plane_image
 *
 * blik.h says what holds for memory, threads, errors and structs. This header may change with every minor version.
 *
 * SPDX-License-Identifier: MIT OR Apache-2.0
 */
#ifndef BLIK_PLANE_H
#define BLIK_PLANE_H

#include <blik.h>

#ifdef __cplusplus
extern "C" {
#endif

/* ---- Scene: bodies with their materials, checked ----------------------------------------------------------------- */

@enum blik_plane_ray_set BLIK_PLANE_RAYS_
@blik_plane_material
/* Sets the defaults of a blik_plane_material: black. */
static inline void blik_plane_material_init(blik_plane_material *material)
{
    material->diffuse = 0.0;
    material->specular = 0.0;
    material->gloss_axis_ratio = 0.0;
    material->spacing = 0.0;
    material->ray_set = BLIK_PLANE_RAYS_AUTO;
    material->rays[0] = material->rays[1] = material->rays[2] = 0;
}

@enum blik_plane_shape BLIK_PLANE_CIRCLE BLIK_PLANE_POLYLINE BLIK_PLANE_POLYGON
@blik_plane_body
/* Sets the defaults of a blik_plane_body: a circle of radius 1 at the origin. */
static inline void blik_plane_body_init(blik_plane_body *body)
{
    body->shape = BLIK_PLANE_CIRCLE;
    body->smooth = 0;
    body->material = 0;
    body->elements = 1;
    body->centre[0] = body->centre[1] = 0.0;
    body->radius = 1.0;
    body->points = NULL;
    body->point_count = 0;
}

@blik_plane_bodies
/* Sets the defaults of a blik_plane_bodies: none. */
static inline void blik_plane_bodies_init(blik_plane_bodies *bodies)
{
    bodies->struct_size = sizeof *bodies;
    bodies->bodies = NULL;
    bodies->body_count = 0;
    bodies->body_stride = sizeof(blik_plane_body);
    bodies->materials = NULL;
    bodies->material_count = 0;
    bodies->material_stride = sizeof(blik_plane_material);
}

@constants BLIK_PLANE_AUTO BLIK_PLANE_CONSTANT BLIK_PLANE_LINEAR BLIK_PLANE_PANELS BLIK_PLANE_FACETS BLIK_PLANE_SPLIT
@blik_plane_settings
/* Sets the defaults of a blik_plane_settings. */
static inline void blik_plane_settings_init(blik_plane_settings *settings)
{
    settings->struct_size = sizeof *settings;
    settings->tolerance = 1e-4;
    settings->basis = BLIK_PLANE_AUTO;
    settings->order = 0;
    settings->method = BLIK_PLANE_AUTO;
    settings->points = 0;
    settings->max_bounces = -1;
    settings->cutoff = -1.0;
    settings->solver = -1.0;
}

@blik_plane_scene
@blik_plane_scene_size
@blik_plane_scene_init
@blik_plane_scene_create
@blik_plane_scene_destroy
@blik_plane_scene_info
/* Sets struct_size of a blik_plane_scene_info. */
static inline void blik_plane_scene_info_init(blik_plane_scene_info *info)
{
    info->struct_size = sizeof *info;
}

@blik_plane_scene_get_info
@blik_plane_ray
@blik_plane_hit
@blik_plane_first_hits
@blik_plane_span
@blik_plane_visible_size
@blik_plane_visible
/* ---- Coupling: extended form factors between the unknowns of a scene --------------------------------------------- */

@blik_plane_coupling
@blik_plane_coupling_size
@blik_plane_coupling_init
@blik_plane_coupling_create
@blik_plane_coupling_destroy
@blik_plane_coupling_info
/* Sets struct_size of a blik_plane_coupling_info. */
static inline void blik_plane_coupling_info_init(blik_plane_coupling_info *info)
{
    info->struct_size = sizeof *info;
}

@blik_plane_coupling_get_info
@blik_plane_coupling_get_rows
/* ---- Solution: a scene under one light --------------------------------------------------------------------------- */

@BLIK_PLANE_MAX_JUMPS
@blik_plane_radiance_of
@blik_plane_sky
/* Sets the defaults of a blik_plane_sky: radiance 1 from everywhere. */
static inline void blik_plane_sky_init(blik_plane_sky *sky)
{
    sky->struct_size = sizeof *sky;
    sky->radiance = 1.0;
    sky->radiance_of = NULL;
    sky->user = NULL;
    sky->jumps = NULL;
    sky->jump_count = 0;
}

@blik_plane_sun
/* Sets the defaults of a blik_plane_sun. */
static inline void blik_plane_sun_init(blik_plane_sun *sun)
{
    sun->struct_size = sizeof *sun;
    sun->direction[0] = 0.0;
    sun->direction[1] = 1.0;
    sun->irradiance = 2.0;
    sun->capture_half_angle = 0.0;
    sun->capture_radiance = -1.0;
}

@blik_plane_light
/* Sets the defaults of a blik_plane_light: none. */
static inline void blik_plane_light_init(blik_plane_light *light)
{
    light->struct_size = sizeof *light;
    light->sky = NULL;
    light->sun = NULL;
}

@blik_plane_solution
@blik_plane_solution_size
@blik_plane_solution_init
@blik_plane_solution_create
@blik_plane_solution_destroy
@blik_plane_solution_info
/* Sets struct_size of a blik_plane_solution_info. */
static inline void blik_plane_solution_info_init(blik_plane_solution_info *info)
{
    info->struct_size = sizeof *info;
}

@blik_plane_solution_get_info
@blik_plane_unknown
@blik_plane_get_unknowns
/* ---- Images, rays, the lobe -------------------------------------------------------------------------------------- */

@blik_plane_sample
@blik_plane_scratch_size
@blik_plane_image
@blik_plane_radiance
@blik_plane_lobe
@blik_plane_gloss
#ifdef __cplusplus
}
#endif

#endif /* BLIK_PLANE_H */
