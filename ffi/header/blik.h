/*
 * Blik: photometric images of faceted diffuse-mirror objects. C interface, and its manual.
 *
 * Generated from ffi/src and ffi/header; after a change there: UPDATE_HEADER=1 cargo test --test header
 *
 * From a mesh to an image, in this order, which is that of the file:
 *
 *     blik_mesh, blik_material     the caller's arrays, in any layout
 *       -> blik_scene              checked and ready for rays          once per mesh
 *       -> blik_coupling           extended form factors               once per mesh and materials
 *       -> blik_solution           sky and sun, solved                 once per light
 *       -> blik_image, blik_signatures, blik_radiance, blik_facets     once per view
 *
 * ffi/examples/minimal.c does so in 50 lines. blik_lights.h has many lights in one call and what signatures depend on,
 * blik_update.h couplings that are kept while parts move and materials change, blik_form_factor.h form factors of polygons
 * without a scene, blik_plane.h the same photometry in two dimensions, blik.hpp owners and exceptions for C++17.
 *
 * What is computed.  The diffuse radiance of a facet is its emission plus its diffuse reflectance over pi times what
 *   arrives: from sky and sun, straight and by way of mirrors, and from all other facets, straight and by way of mirrors.
 *   The radiance of a pixel is that of the facet that its ray meets, plus, along the chain of mirror directions, that of
 *   each further facet times the reflectances of the mirrors before it, plus the sky's or the sun's where the chain ends.
 * Tolerance.  The caller states one number, the wanted error of an image: the root of the mean squared error over the
 *   pixels that meet the object, divided by the reference radiance, in the worst band. Everything else follows from it,
 *   and blik_report says how large the error is expected to be.
 * Reference radiance.  What a white plane that faces the sky's brighter half would show, plus the sun's irradiance over
 *   pi; without sky and sun the mean irradiance of what reflects diffusely, over pi. blik_light overrides it.
 * Units.  Radiance in W m-2 sr-1 and irradiance in W m-2, or any consistent unit; lengths in any unit. One value per
 *   spectral band, 1 to 64 bands. Directions of light point toward it. Front is counter-clockwise.
 * Memory.  The library never takes memory by itself but in the functions called create (and where scratch memory is
 *   null), which the variant without the standard library (BLIK_NO_STD) does not have. Everything else works in memory
 *   of the caller: ask for its size, hand it over to init, and keep it as long as the handle is in use. Addresses need
 *   no alignment. A handle may not be moved. Handles made by init need no end.
 * Threads.  The library starts none and has no global state. A function may be called by any number of threads at once
 *   on handles that it takes as const, and on no handle that another thread hands over as not const; outputs and memory
 *   are the call's own. Long stages run on threads of the caller where blik_run says so. Results are the same, bit for
 *   bit, however the work is split.
 * Errors.  A function that can fail returns a blik_status and fills in *error where that is not null. Other outputs are
 *   written on success only. Pointers are valid or null; a null that is not allowed is an error. Every array that is
 *   written is followed by the number of entries that there is room for, which must be exactly what the call writes.
 * Structs.  Set those that start with struct_size by their init function (inline, below), outputs too, before the
 *   members that differ: a library that is newer than the header reads and writes no more than the header knows.
 * Stability.  The functions and structs of blik.h, blik_lights.h, blik_update.h and blik_form_factor.h are stable:
 *   within a minor version nothing is taken away, and structs that are not called frozen may get members at their end.
 *   blik_plane.h may change with every minor version. While the major version is 0 a new minor version may change all of
 *   it; CHANGELOG.md says how callers adapt.
 *
 * SPDX-License-Identifier: MIT OR Apache-2.0
 */
#ifndef BLIK_H
#define BLIK_H

#include <float.h>
#include <stddef.h>
#include <stdint.h>

/* Define BLIK_NO_STD to use the library that was built without the standard library. */
#ifndef BLIK_NO_STD
#define BLIK_STD
#endif

/* How functions are declared: BLIK_DLL is for the shared library on Windows. */
#ifndef BLIK_API
#if defined(_WIN32) && defined(BLIK_DLL)
#define BLIK_API __declspec(dllimport)
#else
#define BLIK_API
#endif
#endif

@BLIK_VERSION_MAJOR
@BLIK_VERSION_MINOR
@BLIK_VERSION_PATCH
@BLIK_VERSION
#ifdef __cplusplus
extern "C" {
#endif

@blik_version
@blik_build_info
/* ---- Errors ------------------------------------------------------------------------------------------------------ */

@enum blik_status BLIK_OK BLIK_ERROR_
@enum blik_field BLIK_FIELD_
@blik_error
@blik_error_text
@blik_status_text
@blik_field_text
/* ---- Threads and progress: optional ------------------------------------------------------------------------------ */

@blik_task
@blik_parallel
@blik_progress
@blik_run
/* Sets the defaults of a blik_run. */
static inline void blik_run_init(blik_run *run)
{
    run->struct_size = sizeof *run;
    run->parallel = NULL;
    run->parallel_user = NULL;
    run->lanes = 1;
    run->progress = NULL;
    run->progress_user = NULL;
}

@blik_run_on_threads
/* ---- Scene: a mesh with its materials, checked ------------------------------------------------------------------- */

@enum blik_format BLIK_F32 BLIK_F64 BLIK_U
@blik_array
@BLIK_NO_NORMAL
@BLIK_NO_FACET
@blik_material
@blik_mesh
/* Sets the defaults of a blik_mesh; its arrays are absent, of type f64 and u32. */
static inline void blik_mesh_init(blik_mesh *mesh)
{
    const blik_array reals = {NULL, 0, 0, BLIK_F64}, integers = {NULL, 0, 0, BLIK_U32};
    mesh->struct_size = sizeof *mesh;
    mesh->vertices = reals;
    mesh->facets = integers;
    mesh->facet_materials = integers;
    mesh->normals = reals;
    mesh->facet_normals = integers;
    mesh->materials = NULL;
    mesh->material_count = 0;
    mesh->material_stride = sizeof(blik_material);
    mesh->bands = 1;
    mesh->two_sided = 0;
}

@blik_scene
@blik_scene_size
@blik_scene_init
@blik_scene_create
@blik_scene_destroy
@blik_scene_info
/* Sets struct_size of a blik_scene_info. */
static inline void blik_scene_info_init(blik_scene_info *info)
{
    info->struct_size = sizeof *info;
}

@blik_scene_get_info
/* ---- Rays against a scene: optional ------------------------------------------------------------------------------ */

@blik_ray
/* Sets the defaults of a blik_ray: from the origin down, without a limit. */
static inline void blik_ray_init(blik_ray *ray)
{
    ray->origin[0] = ray->origin[1] = ray->origin[2] = 0.0;
    ray->direction[0] = ray->direction[1] = 0.0;
    ray->direction[2] = -1.0;
    ray->t_max = DBL_MAX;
    ray->skip = BLIK_NO_FACET;
}

@blik_hit
@blik_closest_hits
@blik_any_hits
@blik_first_facets
@blik_any_facets
@blik_intersector
/* Sets the defaults of a blik_intersector. */
static inline void blik_intersector_init(blik_intersector *intersector)
{
    intersector->struct_size = sizeof *intersector;
    intersector->first_facets = NULL;
    intersector->any_facets = NULL;
    intersector->user = NULL;
}

@blik_scene_set_intersector
/* ---- Coupling: extended form factors between the elements of a scene --------------------------------------------- */

@blik_settings
/* Sets the defaults of a blik_settings. */
static inline void blik_settings_init(blik_settings *settings)
{
    settings->struct_size = sizeof *settings;
    settings->tolerance = 2e-3;
    settings->max_bounces = -1;
    settings->all_irradiances = 0;
    settings->directional = 1;
    settings->fit_memory = 0;
    settings->ray_budget = 0;
    settings->image_tolerance = 0.0;
}

@blik_coupling
@blik_coupling_size
@blik_coupling_init
@blik_coupling_create
@blik_coupling_destroy
@blik_coupling_info
/* Sets struct_size of a blik_coupling_info. */
static inline void blik_coupling_info_init(blik_coupling_info *info)
{
    info->struct_size = sizeof *info;
}

@blik_coupling_get_info
/* ---- Solution: a scene under one light --------------------------------------------------------------------------- */

@enum blik_sky_model BLIK_SKY_
@blik_sky
/* Sets the defaults of a blik_sky: radiance 1 from everywhere. */
static inline void blik_sky_init(blik_sky *sky)
{
    sky->struct_size = sizeof *sky;
    sky->model = BLIK_SKY_UNIFORM;
    sky->cie_type = 1;
    sky->radiance = NULL;
    sky->ground = NULL;
    sky->up[0] = sky->up[1] = 0.0;
    sky->up[2] = 1.0;
    sky->sun_direction[0] = sky->sun_direction[1] = sky->sun_direction[2] = 0.0;
    sky->table = NULL;
    sky->table_rows = 0;
    sky->table_columns = 0;
    sky->table_bands = 1;
    sky->table_azimuth_zero[0] = sky->table_azimuth_zero[1] = sky->table_azimuth_zero[2] = 0.0;
}

@blik_sun
/* Sets the defaults of a blik_sun: irradiance pi from above. */
static inline void blik_sun_init(blik_sun *sun)
{
    sun->struct_size = sizeof *sun;
    sun->direction[0] = sun->direction[1] = 0.0;
    sun->direction[2] = 1.0;
    sun->irradiance = NULL;
    sun->half_angle_deg = 0.2665;
}

@blik_light
/* Sets the defaults of a blik_light: none. */
static inline void blik_light_init(blik_light *light)
{
    light->struct_size = sizeof *light;
    light->sky = NULL;
    light->sun = NULL;
    light->reference_radiance = NULL;
    light->emission = NULL;
    light->emission_count = 0;
}

@blik_solution
@blik_solution_size
@blik_solution_init
@blik_solution_create
@blik_solution_destroy
@blik_solution_info
/* Sets struct_size of a blik_solution_info. */
static inline void blik_solution_info_init(blik_solution_info *info)
{
    info->struct_size = sizeof *info;
}

@blik_solution_get_info
@blik_solution_get_reference
/* ---- Images ------------------------------------------------------------------------------------------------------ */

@enum blik_projection BLIK_ORTHOGRAPHIC BLIK_PERSPECTIVE
@enum blik_sampling BLIK_SAMPLE_
@blik_camera
/* Sets the defaults of a blik_camera; eye, target, height or fov_deg, columns and rows have none. */
static inline void blik_camera_init(blik_camera *camera)
{
    camera->struct_size = sizeof *camera;
    camera->projection = BLIK_ORTHOGRAPHIC;
    camera->sampling = BLIK_SAMPLE_AREA;
    camera->eye[0] = camera->eye[1] = camera->eye[2] = 0.0;
    camera->target[0] = camera->target[1] = camera->target[2] = 0.0;
    camera->up[0] = camera->up[1] = 0.0;
    camera->up[2] = 1.0;
    camera->height = 0.0;
    camera->fov_deg = 0.0;
    camera->columns = 0;
    camera->rows = 0;
}

@blik_tally
/* Sets a blik_tally to nothing done. */
static inline void blik_tally_init(blik_tally *tally)
{
    tally->struct_size = sizeof *tally;
    tally->object_pixels = 0;
    tally->primary_rays = 0;
    tally->chain_rays = 0;
    tally->refined_pixels = 0;
    tally->noise_squared = 0.0;
    tally->sampling_squared = 0.0;
    tally->chain_tail = 0.0;
}

@blik_image_scratch_size
@blik_image
@blik_image_rows
@blik_tally_add
@enum blik_limit BLIK_LIMIT_
@blik_report
/* Sets struct_size of a blik_report. */
static inline void blik_report_init(blik_report *report)
{
    report->struct_size = sizeof *report;
}

@blik_get_report
@blik_rounds
/* Sets the rounds of an image of which the error `asked` is wanted:
 *
 *     blik_rounds_init(&rounds, 5e-4);
 *     settings.image_tolerance = 5e-4;
 *     for (status = blik_rounds_next(&rounds, NULL, &error); status == BLIK_OK && rounds.tolerance > 0;
 *          status = blik_rounds_next(&rounds, &report, &error)) {
 *         settings.tolerance = rounds.tolerance;
 *         ... coupling, solution, image, report ...
 *     }
 */
static inline void blik_rounds_init(blik_rounds *rounds, double asked)
{
    rounds->struct_size = sizeof *rounds;
    rounds->asked = asked;
    rounds->tolerance = 0.0;
    rounds->done = 0;
    rounds->last_by_visibility = 0;
    rounds->last_tolerance = 0.0;
    rounds->last_estimate = 0.0;
    rounds->last_rays = 0;
    rounds->last_bytes = 0;
}

@blik_rounds_next
/* ---- Rays, signatures, facets ------------------------------------------------------------------------------------ */

@blik_radiance_scratch_size
@blik_radiance
@blik_signature
@blik_signatures
@blik_facets
/* ---- Baked blocks: a prepared scene as bytes --------------------------------------------------------------------- */

@BLIK_BLOCK_ALIGNMENT
@blik_bake_size
@blik_bake
@blik_load_size
@blik_load
#ifdef __cplusplus
}
#endif

#endif /* BLIK_H */
