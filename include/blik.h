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

/* Major version of the library that this header belongs to. */
#define BLIK_VERSION_MAJOR 0

/* Minor version of the library that this header belongs to. While the major version is 0, a new minor version
 * may change the interface. */
#define BLIK_VERSION_MINOR 1

/* Patch version of the library that this header belongs to. */
#define BLIK_VERSION_PATCH 0

/* Version of the library that this header belongs to, as major * 10000 + minor * 100 + patch. */
#define BLIK_VERSION (((BLIK_VERSION_MAJOR * 10000) + (BLIK_VERSION_MINOR * 100)) + BLIK_VERSION_PATCH)

#ifdef __cplusplus
extern "C" {
#endif

/* Version of the library that is linked, as major * 10000 + minor * 100 + patch; BLIK_VERSION is that of the header. */
BLIK_API uint32_t blik_version(void);

/* Version, variant and processor of the library that is linked, in words: never null, never to be freed. */
BLIK_API const char *blik_build_info(void);

/* ---- Errors ------------------------------------------------------------------------------------------------------ */

/* Status that a call returns: whether it was done, and if not, why. */
typedef enum blik_status {
    BLIK_OK = 0, /* Done. */
    BLIK_ERROR_NULL = 1, /* A pointer that must not be null is. */
    /* A struct's struct_size was not set, or is of a newer header than the library: needed is the library's, given the
     * struct's. */
    BLIK_ERROR_STRUCT_SIZE = 2,
    BLIK_ERROR_CHOICE = 3, /* A number stands for no choice: a type, a model, a projection, a sampling. */
    /* A handle was not made by this library, is destroyed, or belongs to other handles than those given beside it. */
    BLIK_ERROR_HANDLE = 4,
    BLIK_ERROR_BUFFER_TOO_SMALL = 5, /* Memory is smaller than needed: needed and given are in bytes. */
    /* An array has the wrong number of entries, or a stride shorter than an entry: needed and given. */
    BLIK_ERROR_LENGTH = 6,
    BLIK_ERROR_TOO_MANY = 7, /* More of something than there may be; needed is the limit. */
    BLIK_ERROR_NO_FACETS = 8, /* The mesh has no facets, or the plane scene no bodies. */
    BLIK_ERROR_NO_MATERIALS = 9, /* The mesh or the plane scene has no materials. */
    BLIK_ERROR_BANDS = 10, /* The number of spectral bands is outside 1 to 64; given. */
    BLIK_ERROR_VERTEX = 11, /* Vertex index is not finite. */
    BLIK_ERROR_NORMAL = 12, /* Vertex normal index is zero or not finite. */
    BLIK_ERROR_EXTENT = 13, /* The mesh is too large or too small for double precision. */
    BLIK_ERROR_VERTEX_INDEX = 14, /* Facet index has a vertex index (value) out of range. */
    BLIK_ERROR_NORMAL_INDEX = 15, /* Facet index has a normal index (value) out of range. */
    BLIK_ERROR_MATERIAL_INDEX = 16, /* Facet or plane body index has a material (value) that there is not. */
    BLIK_ERROR_MATERIAL = 17, /* field of material index is out of range in band. */
    /* Diffuse and mirror reflectance of material index add up to more than 1 in band. */
    BLIK_ERROR_REFLECTANCE_SUM = 18,
    BLIK_ERROR_RANGE = 19, /* field is out of range (value, in band; of facet index where it is one of each facet). */
    BLIK_ERROR_DIRECTION = 20, /* The direction field is zero or not finite. */
    BLIK_ERROR_CAMERA = 21, /* The camera's field coincides with the eye or is parallel to the viewing direction. */
    BLIK_ERROR_DIVERGES = 22, /* The light grows without bound: a closed part of the scene reflects all of it. */
    BLIK_ERROR_CANCELLED = 23, /* The progress callback asked to stop. */
    BLIK_ERROR_NOT_DIRECTIONAL = 24, /* The coupling kept no directions, which a sky that is not uniform needs. */
    BLIK_ERROR_BLOCK = 25, /* A baked block is damaged, of another version or byte order, or not a block. */
    BLIK_ERROR_ALIGNMENT = 26, /* Memory does not start on the boundary that it must start on. */
    BLIK_ERROR_MEMORY = 27, /* The system gave no memory. */
    BLIK_ERROR_INTERNAL = 28, /* A fault of the library; please report it. */
    BLIK_ERROR_BODY = 29, /* Body index of a plane scene is no circle or polyline; field tells why. */
    /* Facet index emits or reflects (field) light for which the coupling has no entries: it was made for another material. */
    BLIK_ERROR_UNCOUPLED = 30,
    BLIK_ERROR_PART = 31, /* Facet index belongs to a part (value) that has no pose. */
    BLIK_ERROR_POSE = 32, /* The pose of part index is not finite, or its matrix is no rotation. */
    BLIK_STATUS_MAX_ENUM = 0x7fffffff
} blik_status;

/* Field that a refused call is about. */
typedef enum blik_field {
    BLIK_FIELD_NONE = 0, /* No field. */
    BLIK_FIELD_DIFFUSE = 1, /* Diffuse reflectance of a material. */
    BLIK_FIELD_SPECULAR = 2, /* Mirror reflectance of a material. */
    BLIK_FIELD_EMISSION = 3, /* Emission of a material, or of the whole scene where radiances exceed 1e37. */
    BLIK_FIELD_GLOSS_AXIS_RATIO = 4, /* Axis ratio of a material's lobe. */
    BLIK_FIELD_GLOSS_RAYS = 5, /* Rays of a material's lobe. */
    BLIK_FIELD_TOLERANCE = 6, /* The tolerance. */
    BLIK_FIELD_REFERENCE_RADIANCE = 7, /* The reference radiance. */
    BLIK_FIELD_SKY_RADIANCE = 8, /* Radiance of the sky. */
    BLIK_FIELD_SKY_GROUND = 9, /* Radiance of the ground. */
    BLIK_FIELD_SKY_UP = 10, /* The sky's up. */
    BLIK_FIELD_SKY_CIE_TYPE = 11, /* Type of the CIE sky. */
    BLIK_FIELD_SKY_TABLE = 12, /* Table of the sky. */
    BLIK_FIELD_SKY_SUN_DIRECTION = 13, /* The CIE sky's sun. */
    BLIK_FIELD_SKY_AZIMUTH_ZERO = 14, /* The table's azimuth 0. */
    BLIK_FIELD_SUN_DIRECTION = 15, /* Direction of the sun. */
    BLIK_FIELD_SUN_IRRADIANCE = 16, /* Irradiance of the sun. */
    BLIK_FIELD_SUN_HALF_ANGLE = 17, /* Half angle of the sun. */
    BLIK_FIELD_CAMERA_EYE = 18, /* The camera's eye. */
    BLIK_FIELD_CAMERA_TARGET = 19, /* The camera's target. */
    BLIK_FIELD_CAMERA_UP = 20, /* The camera's up. */
    BLIK_FIELD_CAMERA_HEIGHT = 21, /* The camera's height. */
    BLIK_FIELD_CAMERA_FOV = 22, /* The camera's field of view. */
    BLIK_FIELD_RESOLUTION = 23, /* Columns or rows of the image. */
    BLIK_FIELD_DIRECTION = 24, /* A direction given to the call. */
    BLIK_FIELD_ROWS = 25, /* A range of rows. */
    BLIK_FIELD_MAX_BOUNCES = 26, /* Reflections that count. */
    BLIK_FIELD_PLANE_ORDER = 27, /* Gauss points of an element of the plane model. */
    BLIK_FIELD_PLANE_POINTS = 28, /* Nodes or chains of a method of the plane model. */
    BLIK_FIELD_BODY_ELEMENTS = 29, /* Elements of a body of the plane model. */
    BLIK_FIELD_BODY_RADIUS = 30, /* Radius of a body of the plane model. */
    /* Coordinates of a body of the plane model: not finite, beyond 1e100, too few points, or two that coincide. */
    BLIK_FIELD_BODY_POINTS = 31,
    BLIK_FIELD_TALLY = 32, /* Errors in a tally. */
    BLIK_FIELD_VERTICES = 33, /* The mesh's vertices. */
    BLIK_FIELD_FACETS = 34, /* The mesh's facets. */
    BLIK_FIELD_FACET_MATERIALS = 35, /* The materials of the mesh's facets. */
    BLIK_FIELD_NORMALS = 36, /* The mesh's normals. */
    BLIK_FIELD_FACET_NORMALS = 37, /* The normals of the mesh's facets. */
    BLIK_FIELD_MATERIALS = 38, /* The mesh's materials. */
    BLIK_FIELD_LANES = 39, /* Tasks at once. */
    BLIK_FIELD_RAY_ORIGIN = 40, /* Where a ray starts. */
    BLIK_FIELD_RAY_DIRECTION = 41, /* Direction of a ray: not finite, or of no unit length. */
    BLIK_FIELD_RAY_T_MAX = 42, /* Where hits of a ray no longer count. */
    BLIK_FIELD_RAY_SKIP = 43, /* The facet that a ray leaves. */
    BLIK_FIELD_PIXELS = 44, /* Pixels of an image. */
    BLIK_FIELD_COMPONENTS = 45, /* Terms of the radiance of an image. */
    BLIK_FIELD_AREAS = 46, /* Areas of facets. */
    BLIK_FIELD_IRRADIANCE = 47, /* Irradiance of facets. */
    BLIK_FIELD_RADIANCE = 48, /* Radiance of facets or along rays. */
    BLIK_FIELD_HITS = 49, /* Hits of rays. */
    BLIK_FIELD_SIGNATURES = 50, /* Signatures. */
    BLIK_FIELD_CELLS = 51, /* Views of a signature. */
    BLIK_FIELD_SAMPLES = 52, /* Samples of the plane model. */
    BLIK_FIELD_FACTORS = 53, /* Form factors. */
    BLIK_FIELD_SHARES = 54, /* Shares of facets in signatures. */
    BLIK_FIELD_PARTS = 55, /* Parts of a mesh. */
    BLIK_FIELD_MAX_ENUM = 0x7fffffff
} blik_field;

/* Error of a refused call. Written where a call is refused and the pointer to it is not null; nothing has
 * to be set before. Frozen: it does not grow. */
typedef struct blik_error {
    blik_status status; /* The status that the call returned. */
    blik_field field; /* The field that it is about. */
    size_t index; /* Index of the facet, vertex, normal, material, ray or direction that it is about; else 0. */
    size_t band; /* Spectral band; else 0. */
    double value; /* The offending value; else 0. */
    size_t needed; /* Bytes or entries needed, or the limit; else 0. */
    size_t given; /* Bytes or entries given; else 0. */
} blik_error;

/* Text of a refused call's error, in one line without its end: status, field, value, index, sizes.
 *
 * Returns the length of the whole text, as snprintf does: where it is not below size, the text was cut.
 *
 *   error  what a call wrote; null: an empty text
 *   text   receives the text with a zero at its end; null: the length alone is wanted
 *   size   number of characters that there is room for, the zero included */
BLIK_API size_t blik_error_text(const blik_error *error, char *text, size_t size);

/* The words for a status: never null, never to be freed.
 *
 *   status  a blik_status, as the number that it is */
BLIK_API const char *blik_status_text(int32_t status);

/* The name of a field as the structs spell it: never null, never to be freed; empty for no field.
 *
 *   field  a blik_field, as the number that it is */
BLIK_API const char *blik_field_text(int32_t field);

/* ---- Threads and progress: optional ------------------------------------------------------------------------------ */

/* One task of a stage: to be called once with each index, on any thread. */
typedef void (*blik_task)(void *context, size_t index);

/* Calls task(context, i) once for each i in 0 .. count, in any order, on any threads, and returns when all have
 * returned. It must not throw or jump out; where it returns without having called all, the stage is cancelled. */
typedef void (*blik_parallel)(void *user, size_t count, blik_task task, void *context);

/* Told the share (0 to 1) of a stage that is done, never by two threads at once; not 0 asks the stage to stop, which
 * then returns BLIK_ERROR_CANCELLED. It must not throw or jump out. */
typedef int32_t (*blik_progress)(void *user, double done);

/* How a long stage runs. A null pointer to it stands for its defaults. The results do not depend on it. */
typedef struct blik_run {
    size_t struct_size; /* Size of this struct. */
    blik_parallel parallel; /* Runs tasks on threads of the caller; null (default): the calling thread alone. */
    void *parallel_user; /* Handed to parallel. */
    size_t lanes; /* Tasks that parallel is given at once, 1 to 256: as many as there are threads; default 1. */
    blik_progress progress; /* Told the progress; null (default): nobody. */
    void *progress_user; /* Handed to progress. */
} blik_run;

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

#ifdef BLIK_STD
/* A blik_parallel that starts a thread for each task of a stage and waits for them.
 *
 *   user     not looked at: there for the signature
 *   count    number of tasks
 *   task     the task
 *   context  handed to the task */
BLIK_API void blik_run_on_threads(void *user, size_t count, blik_task task, void *context);
#endif

/* ---- Scene: a mesh with its materials, checked ------------------------------------------------------------------- */

/* Type of the numbers of a blik_array. */
typedef enum blik_format {
    BLIK_F32 = 1, /* Floating point, 32 bits. */
    BLIK_F64 = 2, /* Floating point, 64 bits. */
    BLIK_U8 = 3, /* Unsigned integers, 8 bits. */
    BLIK_U16 = 4, /* Unsigned integers, 16 bits. */
    BLIK_U32 = 5, /* Unsigned integers, 32 bits. */
    BLIK_U64 = 6, /* Unsigned integers, 64 bits. */
    BLIK_FORMAT_MAX_ENUM = 0x7fffffff
} blik_format;

/* An array as the caller keeps it: entries stride bytes apart, each of as many numbers as its use needs, packed.
 * count 0: absent. Frozen: it does not grow. */
typedef struct blik_array {
    const void *data; /* First entry, aligned as its numbers need; not read when count is 0. */
    size_t count; /* Number of entries. */
    size_t stride; /* Bytes from one entry to the next; 0: the size of an entry. */
    blik_format format; /* Type of the numbers. */
} blik_array;

/* "No vertex normal" among the indices of normals. */
#define BLIK_NO_NORMAL 0xffffffffu

/* "No facet" in blik_ray and blik_hit. */
#define BLIK_NO_FACET 0xffffffffu

/* Reflectances and emission of one material, one value per band each; a null pointer stands for zeros.
 * Arrays of it have a stride: it may grow. */
typedef struct blik_material {
    const double *diffuse; /* Diffuse reflectance, in [0, 1]. */
    /* Mirror reflectance, in [0, 1]; diffuse + specular <= 1. With gloss: the lobe's albedo at normal view. */
    const double *specular;
    const double *emission; /* Own diffuse radiance, >= 0, W m-2 sr-1. */
    /* 0: an ideal mirror; else long over short axis of the lobe, >= 1 (1e4 and above: an ideal mirror). */
    double gloss_axis_ratio;
    uint32_t gloss_rays; /* Rays at the first hit of the lobe, up to 65536; 0: by tolerance. */
} blik_material;

/* A mesh with its materials. Read during the call only. */
typedef struct blik_mesh {
    size_t struct_size; /* Size of this struct. */
    blik_array vertices; /* Positions: three BLIK_F64 or BLIK_F32 each, in any unit and at any offset. */
    blik_array facets; /* Three vertex indices (BLIK_U8 to BLIK_U64) a facet, counter-clockwise seen from the front. */
    blik_array facet_materials; /* Material of each facet (BLIK_U8 to BLIK_U64); absent: all 0. */
    /* Normals for interpolated mirror directions, three BLIK_F64 or BLIK_F32 each; absent: mirrors are flat. */
    blik_array normals;
    /* Three normal indices a facet (BLIK_U32 or BLIK_U64), all bits set for none; absent: as facets. */
    blik_array facet_normals;
    const blik_material *materials; /* The materials. */
    size_t material_count; /* Number of materials, at least 1. */
    size_t material_stride; /* Bytes from one material to the next; set by the init function. */
    size_t bands; /* Spectral bands, 1 to 64; default 1. */
    int32_t two_sided; /* Not 0: both sides carry material and emission; default 0: backs are black and opaque. */
} blik_mesh;

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

/* A scene in memory. Read-only once made: any number of threads may use it at once. */
typedef struct blik_scene blik_scene;

/* Bytes of memory that blik_scene_init needs for a mesh, at any address.
 *
 *   mesh   the mesh
 *   error  receives what is wrong where the call is refused; null: not wanted
 *   bytes  receives the bytes */
BLIK_API blik_status blik_scene_size(const blik_mesh *mesh, blik_error *error, size_t *bytes);

/* Checks a mesh and makes a scene of it in the caller's memory, where it lives until that is used for something else.
 *
 *   mesh    the mesh; not needed afterwards
 *   memory  memory of the caller, at any address
 *   size    its bytes
 *   error   receives what is wrong where the call is refused; null: not wanted
 *   scene   receives the scene */
BLIK_API blik_status blik_scene_init(const blik_mesh *mesh, void *memory, size_t size, blik_error *error,
    blik_scene **scene);

#ifdef BLIK_STD
/* Checks a mesh and makes a scene of it in memory of its own.
 *
 *   mesh   the mesh; not needed afterwards
 *   error  receives what is wrong where the call is refused; null: not wanted
 *   scene  receives the scene; to be ended by blik_scene_destroy */
BLIK_API blik_status blik_scene_create(const blik_mesh *mesh, blik_error *error, blik_scene **scene);
#endif

/* Ends a scene and frees what it owns.
 *
 *   scene  the scene, whose couplings have ended before; null: nothing */
BLIK_API void blik_scene_destroy(blik_scene *scene);

/* Numbers of a scene. */
typedef struct blik_scene_info {
    size_t struct_size; /* Size of this struct. */
    size_t facets; /* Facets, degenerate ones included. */
    size_t degenerate_facets; /* Facets of no area: they keep their index and take no part. */
    size_t materials; /* Materials. */
    size_t bands; /* Spectral bands. */
    size_t sides; /* Sides of a facet that carry its material: 1 or 2. */
    size_t bytes; /* Bytes in use. */
} blik_scene_info;

/* Sets struct_size of a blik_scene_info. */
static inline void blik_scene_info_init(blik_scene_info *info)
{
    info->struct_size = sizeof *info;
}

/* Numbers of a scene.
 *
 *   scene  the scene
 *   error  receives what is wrong where the call is refused; null: not wanted
 *   info   receives them; its struct_size is set before */
BLIK_API blik_status blik_scene_get_info(const blik_scene *scene, blik_error *error, blik_scene_info *info);

/* ---- Rays against a scene: optional ------------------------------------------------------------------------------ */

/* A ray in the mesh's coordinates. Frozen: it does not grow. */
typedef struct blik_ray {
    double origin[3]; /* Where it starts. */
    double direction[3]; /* Unit vector along it; default (0, 0, -1). */
    double t_max; /* Hits at this distance and beyond do not count, 0 or more; default the largest number: no limit. */
    uint32_t skip; /* Index of the facet that it leaves and never hits; default BLIK_NO_FACET: none. */
} blik_ray;

/* Sets the defaults of a blik_ray: from the origin down, without a limit. */
static inline void blik_ray_init(blik_ray *ray)
{
    ray->origin[0] = ray->origin[1] = ray->origin[2] = 0.0;
    ray->direction[0] = ray->direction[1] = 0.0;
    ray->direction[2] = -1.0;
    ray->t_max = DBL_MAX;
    ray->skip = BLIK_NO_FACET;
}

/* Where a ray meets the mesh first. Frozen: it does not grow. */
typedef struct blik_hit {
    double t; /* Distance along the ray in the mesh's unit; infinity where it meets nothing. */
    double u; /* Barycentric weight of the facet's second corner. */
    double v; /* Barycentric weight of the facet's third corner. */
    uint32_t facet; /* Index of the facet, or BLIK_NO_FACET. */
    int32_t front; /* 1 where it meets the side on which the corners run counter-clockwise. */
} blik_hit;

/* The first facet that each ray meets: at the least distance; among equals a front before a back, then the lowest index.
 *
 *   scene      the scene
 *   rays       the rays; one that is not finite, of no unit direction or of no such skip is refused with its index
 *   count      number of rays
 *   run        how the call runs; null: on the calling thread
 *   error      receives what is wrong where the call is refused; null: not wanted
 *   hits       receives one hit a ray
 *   hit_count  number of hits that there is room for: count */
BLIK_API blik_status blik_closest_hits(const blik_scene *scene, const blik_ray *rays, size_t count, const blik_run *run,
    blik_error *error, blik_hit *hits, size_t hit_count);

/* Whether each ray meets any facet.
 *
 *   scene      the scene
 *   rays       the rays, as for blik_closest_hits
 *   count      number of rays
 *   run        how the call runs; null: on the calling thread
 *   error      receives what is wrong where the call is refused; null: not wanted
 *   hits       receives 1 or 0 for each ray
 *   hit_count  number of values that there is room for: count */
BLIK_API blik_status blik_any_hits(const blik_scene *scene, const blik_ray *rays, size_t count, const blik_run *run,
    blik_error *error, uint8_t *hits, size_t hit_count);

/* Finds the first facet that each of count rays meets: their indices, or BLIK_NO_FACET, to facets. The facet
 * skip of a ray and what lies at t_max or beyond do not count. Called by any number of threads at once. */
typedef void (*blik_first_facets)(void *user, const blik_ray *rays, size_t count, uint32_t *facets);

/* Finds whether each of count rays meets any facet, as blik_first_facets does: not 0 or 0, to hits. */
typedef void (*blik_any_facets)(void *user, const blik_ray *rays, size_t count, uint8_t *hits);

/* A ray tracer of the caller's over the mesh of a scene. */
typedef struct blik_intersector {
    size_t struct_size; /* Size of this struct. */
    blik_first_facets first_facets; /* Finds first facets; must not be null. */
    blik_any_facets any_facets; /* Finds whether there is any; null (default): by first_facets. */
    void *user; /* Handed to both. */
} blik_intersector;

/* Sets the defaults of a blik_intersector. */
static inline void blik_intersector_init(blik_intersector *intersector)
{
    intersector->struct_size = sizeof *intersector;
    intersector->first_facets = NULL;
    intersector->any_facets = NULL;
    intersector->user = NULL;
}

/* Has rays traced by the caller's tracer instead of the library's tree.
 *
 * Facets alone are taken from the tracer; where on them rays arrive is computed anew, and where a ray does not meet the
 * facet that was named, the tree finds the right one. Images are the same bits where the tracer names the same facets.
 * Rays come up to 32 at once (8 without the standard library) where none depends on what another meets (the first rays of
 * form factors, of elements and of pixels, and those from elements toward the sun), else one by one (chains by way of
 * mirrors).
 *
 *   scene        the scene, which nobody else uses meanwhile
 *   intersector  the tracer, of which the scene keeps a copy; in use as long as the scene. Null: the tree again
 *   error        receives what is wrong where the call is refused; null: not wanted */
BLIK_API blik_status blik_scene_set_intersector(blik_scene *scene, const blik_intersector *intersector,
    blik_error *error);

/* ---- Coupling: extended form factors between the elements of a scene --------------------------------------------- */

/* Settings of a coupling. */
typedef struct blik_settings {
    size_t struct_size; /* Size of this struct. */
    /* The wanted rms error of an image's pixels relative to the reference radiance: 1e-6 to 0.1; default 2e-3. */
    double tolerance;
    int32_t max_bounces; /* Light reflected more often does not count; below 0 (default): by tolerance. */
    /* Not 0: irradiance of all facets is wanted, also of those that reflect nothing diffusely; default 0. */
    int32_t all_irradiances;
    /* Not 0 (default): any sky can light the scene without new rays; 0: uniform skies only, in less memory, and in
     * closed form, sooner and more exactly, where nothing is hidden. */
    int32_t directional;
    /* Not 0: where the caller's memory is too small for the rows, their rays are halved until it is not; what that costs
     * is in the report's error estimate. Default 0: the call is refused and tells the bytes that it would need. */
    int32_t fit_memory;
    /* Most rays that rows may send, those by way of mirrors not counted, but for 64 a row at least; 0 (default): as many
     * as the tolerance needs. What fewer cost is in the report's error estimate. It is a budget of time, too: coupling
     * goes on at a steady number of rays a second. */
    uint64_t ray_budget;
    /* Wanted error of images, 1e-6 to 0.1; 0 (default): tolerance. If it is smaller than tolerance, the diffuse
     * solution is computed to tolerance only, and final gathering at the points that an image shows removes the
     * rest: faster for one or two precise images, slower for many. There is no final gathering without the standard
     * library, where max_bounces is given, or where lobes or curved mirrors reflect sunlight onto facets: the
     * report's error estimate tells. Baked blocks do not keep it. */
    double image_tolerance;
} blik_settings;

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

/* A coupling in memory. Read-only once made: any number of threads may use it at once. */
typedef struct blik_coupling blik_coupling;

/* Bytes of memory with which blik_coupling_init can begin. What the rows take is not known before they are computed:
 *
 *     for (;;) {
 *         memory = realloc(memory, bytes);
 *         status = blik_coupling_init(scene, &settings, NULL, memory, bytes, &error, &coupling);
 *         if (status != BLIK_ERROR_BUFFER_TOO_SMALL) break;
 *         bytes = error.needed;
 *     }
 *
 *   scene     the scene
 *   settings  the settings
 *   error     receives what is wrong where the call is refused; null: not wanted
 *   bytes     receives the bytes */
BLIK_API blik_status blik_coupling_size(const blik_scene *scene, const blik_settings *settings, blik_error *error,
    size_t *bytes);

/* Computes the coupling of a scene in the caller's memory: once for a mesh and its materials, whatever the light. Where the
 * memory does not suffice, error->needed is an extrapolation from the rows done.
 *
 *   scene     the scene, which must outlive the coupling
 *   settings  the settings
 *   run       how the call runs; null: on the calling thread
 *   memory    memory of the caller, at any address
 *   size      its bytes
 *   error     receives what is wrong where the call is refused; null: not wanted
 *   coupling  receives the coupling */
BLIK_API blik_status blik_coupling_init(const blik_scene *scene, const blik_settings *settings, const blik_run *run,
    void *memory, size_t size, blik_error *error, blik_coupling **coupling);

#ifdef BLIK_STD
/* Computes the coupling of a scene in memory of its own.
 *
 *   scene     the scene, which must outlive the coupling
 *   settings  the settings
 *   run       how the call runs; null: on the calling thread
 *   error     receives what is wrong where the call is refused; null: not wanted
 *   coupling  receives the coupling; to be ended by blik_coupling_destroy */
BLIK_API blik_status blik_coupling_create(const blik_scene *scene, const blik_settings *settings, const blik_run *run,
    blik_error *error, blik_coupling **coupling);
#endif

/* Ends a coupling and frees what it owns.
 *
 *   coupling  the coupling, whose solutions have ended before; null: nothing */
BLIK_API void blik_coupling_destroy(blik_coupling *coupling);

/* Numbers of a coupling. */
typedef struct blik_coupling_info {
    size_t struct_size; /* Size of this struct. */
    size_t elements; /* Elements that the facets are cut into. */
    size_t unknowns; /* Sides of elements: rows of the coupling. */
    uint64_t pairs; /* Form factors kept. */
    /* Rows that nothing needs: of degenerate facets, or of facets that reflect nothing diffusely. */
    uint64_t skipped_rows;
    uint64_t open_rows; /* Rows that see the sky alone: no ray was traced. */
    uint64_t rays; /* Rays traced. */
    double dropped; /* Largest weight of mirror chains that were cut, as a share of the hemisphere: a bound. */
    /* Bytes in use. Of a coupling that blik_coupling_init made: from the start of its memory, the rest of which is
     * free again. */
    size_t bytes;
    size_t facets; /* Facets of its scene, degenerate ones included. */
    size_t sides; /* Sides of a facet that carry its material: 1 or 2. */
    size_t bands; /* Spectral bands. */
} blik_coupling_info;

/* Sets struct_size of a blik_coupling_info. */
static inline void blik_coupling_info_init(blik_coupling_info *info)
{
    info->struct_size = sizeof *info;
}

/* Numbers of a coupling; reads all of it.
 *
 *   coupling  the coupling
 *   error     receives what is wrong where the call is refused; null: not wanted
 *   info      receives them; its struct_size is set before */
BLIK_API blik_status blik_coupling_get_info(const blik_coupling *coupling, blik_error *error, blik_coupling_info *info);

/* ---- Solution: a scene under one light --------------------------------------------------------------------------- */

/* How the radiance of a blik_sky varies with the direction. */
typedef enum blik_sky_model {
    BLIK_SKY_UNIFORM = 0, /* The same radiance from the whole sphere. */
    BLIK_SKY_HEMISPHERE = 1, /* The same radiance from above the horizon. */
    BLIK_SKY_OVERCAST = 2, /* Above the horizon radiance (1 + 2 sin(elevation))/3. */
    BLIK_SKY_CIE = 3, /* One of the fifteen types of ISO 15469. */
    BLIK_SKY_GRADIENT = 4, /* Linear in the height from ground (nadir) to radiance (zenith). */
    BLIK_SKY_TABLE = 5, /* Samples by elevation and azimuth, as in an environment map. */
    BLIK_SKY_MODEL_MAX_ENUM = 0x7fffffff
} blik_sky_model;

/* A sky. Read during the call only: its arrays are copied. */
typedef struct blik_sky {
    size_t struct_size; /* Size of this struct. */
    blik_sky_model model; /* How radiance varies; default BLIK_SKY_UNIFORM. */
    uint32_t cie_type; /* 1 to 15: the type of a CIE sky; default 1. */
    /* Radiance per band as the model uses it (for a table a factor), W m-2 sr-1; null (default): 1. */
    const double *radiance;
    const double *ground; /* Radiance below the horizon per band; null (default): 0. */
    double up[3]; /* Toward the zenith, of any length but zero; default (0, 0, 1). */
    double sun_direction[3]; /* Toward the sun of a CIE sky, above the horizon. */
    /* Samples of a table: table_rows x table_columns x table_bands, row by row from the zenith down, columns
     * counter-clockwise seen from above; bilinear between the centres. */
    const float *table;
    size_t table_rows; /* Steps of elevation. */
    size_t table_columns; /* Steps of azimuth. */
    size_t table_bands; /* 1, or the scene's number of bands; default 1. */
    /* Azimuth 0 of a table, projected off up; zeros (default): (1, 0, 0), or (0, 1, 0) where that is up. */
    double table_azimuth_zero[3];
} blik_sky;

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

/* The sun. Read during the call only. */
typedef struct blik_sun {
    size_t struct_size; /* Size of this struct. */
    double direction[3]; /* Toward the centre of the sun, of any length but zero; default (0, 0, 1). */
    /* Irradiance per band of an unshaded plane that faces the sun, W m-2; null (default): pi. */
    const double *irradiance;
    double half_angle_deg; /* Angular radius in degrees: 0 (a point) or 1e-4 to 10; default 0.2665. */
} blik_sun;

/* Sets the defaults of a blik_sun: irradiance pi from above. */
static inline void blik_sun_init(blik_sun *sun)
{
    sun->struct_size = sizeof *sun;
    sun->direction[0] = sun->direction[1] = 0.0;
    sun->direction[2] = 1.0;
    sun->irradiance = NULL;
    sun->half_angle_deg = 0.2665;
}

/* The light of a scene. Read during the call only. */
typedef struct blik_light {
    size_t struct_size; /* Size of this struct. */
    const blik_sky *sky; /* The sky; null (default): none. */
    const blik_sun *sun; /* The sun; null (default): none. */
    /* The radiance per band to which errors are related; null (default): from the light. */
    const double *reference_radiance;
    /* Own diffuse radiance of each facet, side and band, bands innermost, 0 to 1e37 W m-2 sr-1, in place of the materials'
     * emission: new temperatures ask for no ray. Facets whose materials neither reflect diffusely nor emit may emit nothing
     * here, either (BLIK_ERROR_UNCOUPLED). Null (default): the materials'. */
    const double *emission;
    size_t emission_count; /* Number of those values: facets x sides x bands; 0 (default) without them. */
} blik_light;

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

/* A solved scene in memory. Read-only once made: any number of threads may use it at once. */
typedef struct blik_solution blik_solution;

/* Bytes of memory that blik_solution_init needs for this light, at any address. More speeds up scenes with mirrors
 * and a sun on several threads.
 *
 *   coupling  the coupling
 *   light     the light
 *   error     receives what is wrong where the call is refused; null: not wanted
 *   bytes     receives the bytes */
BLIK_API blik_status blik_solution_size(const blik_coupling *coupling, const blik_light *light, blik_error *error,
    size_t *bytes);

/* Lights a scene and solves for its diffuse radiance, in the caller's memory. Another light is another call, in the
 * same memory or other: the coupling is not computed anew, and no ray toward the sky is traced. Where mirrors scatter
 * sunlight over many more elements than usual, the call returns BLIK_ERROR_BUFFER_TOO_SMALL, and error->needed
 * says how many bytes probably do.
 *
 *   coupling  the coupling, which must outlive the solution
 *   light     the light; not needed afterwards
 *   run       how the call runs; null: on the calling thread
 *   memory    memory of the caller, at any address
 *   size      its bytes
 *   error     receives what is wrong where the call is refused; null: not wanted
 *   solution  receives the solution */
BLIK_API blik_status blik_solution_init(const blik_coupling *coupling, const blik_light *light, const blik_run *run,
    void *memory, size_t size, blik_error *error, blik_solution **solution);

#ifdef BLIK_STD
/* Lights a scene and solves for its diffuse radiance, in memory of its own.
 *
 *   coupling  the coupling, which must outlive the solution
 *   light     the light; not needed afterwards
 *   run       how the call runs; null: on the calling thread
 *   error     receives what is wrong where the call is refused; null: not wanted
 *   solution  receives the solution; to be ended by blik_solution_destroy */
BLIK_API blik_status blik_solution_create(const blik_coupling *coupling, const blik_light *light, const blik_run *run,
    blik_error *error, blik_solution **solution);
#endif

/* Ends a solution and frees what it owns.
 *
 *   solution  the solution; null: nothing */
BLIK_API void blik_solution_destroy(blik_solution *solution);

/* Numbers of a solution. */
typedef struct blik_solution_info {
    size_t struct_size; /* Size of this struct. */
    size_t facets; /* Facets of its scene, degenerate ones included. */
    size_t sides; /* Sides of a facet that carry its material: 1 or 2. */
    size_t bands; /* Spectral bands. */
} blik_solution_info;

/* Sets struct_size of a blik_solution_info. */
static inline void blik_solution_info_init(blik_solution_info *info)
{
    info->struct_size = sizeof *info;
}

/* Numbers of a solution: what arrays of its results are as long as.
 *
 *   solution  the solution
 *   error     receives what is wrong where the call is refused; null: not wanted
 *   info      receives them; its struct_size is set before */
BLIK_API blik_status blik_solution_get_info(const blik_solution *solution, blik_error *error, blik_solution_info *info);

/* Reference radiance, to which tolerance and errors are related.
 *
 *   solution        the solution
 *   error           receives what is wrong where the call is refused; null: not wanted
 *   radiance        receives one value per band
 *   radiance_count  number of values that there is room for: bands */
BLIK_API blik_status blik_solution_get_reference(const blik_solution *solution, blik_error *error, double *radiance,
    size_t radiance_count);

/* ---- Images ------------------------------------------------------------------------------------------------------ */

/* Projection of a blik_camera. */
typedef enum blik_projection {
    BLIK_ORTHOGRAPHIC = 0, /* Parallel rays. */
    BLIK_PERSPECTIVE = 1, /* Rays through the eye. */
    BLIK_PROJECTION_MAX_ENUM = 0x7fffffff
} blik_projection;

/* Sampling of a pixel of a blik_camera. */
typedef enum blik_sampling {
    BLIK_SAMPLE_AREA = 0, /* Mean radiance over the pixel's square, background included. */
    BLIK_SAMPLE_CENTRE = 1, /* Radiance along the ray through the pixel's centre. */
    BLIK_SAMPLING_MAX_ENUM = 0x7fffffff
} blik_sampling;

/* A camera. Row 0 is the top; nothing before the eye is seen. */
typedef struct blik_camera {
    size_t struct_size; /* Size of this struct. */
    blik_projection projection; /* BLIK_ORTHOGRAPHIC (default) or BLIK_PERSPECTIVE. */
    blik_sampling sampling; /* BLIK_SAMPLE_AREA (default) or BLIK_SAMPLE_CENTRE. */
    double eye[3]; /* Position of the eye, in the mesh's coordinates. */
    double target[3]; /* The point in the image's middle. */
    double up[3]; /* Direction that is up in the image; default (0, 0, 1). */
    double height; /* Orthographic: height of the image in the mesh's unit. */
    double fov_deg; /* Perspective: vertical field of view in degrees. */
    size_t columns; /* Pixels across, 1 to 65536. */
    size_t rows; /* Pixels down, 1 to 65536. */
} blik_camera;

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

/* Counts of the work on rows of an image; tallies of all its rows add up by blik_tally_add. */
typedef struct blik_tally {
    size_t struct_size; /* Size of this struct. */
    uint64_t object_pixels; /* Pixels whose centre ray meets the object. */
    uint64_t primary_rays; /* Rays through pixels. */
    uint64_t chain_rays; /* Rays of chains and toward the sun. */
    uint64_t refined_pixels; /* Pixels sampled more than once. */
    double noise_squared; /* Sum over object pixels of the squared expected error from the diffuse solution. */
    /* Sum over object pixels of the squared expected error from sampling the pixel's area and lobes. */
    double sampling_squared;
    double chain_tail; /* Largest bound on what cut chains could still have brought. */
} blik_tally;

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

/* Bytes of scratch memory with which blik_image keeps all lanes of run busy.
 *
 *   solution  the solution
 *   camera    the camera
 *   run       how the call runs; null: on the calling thread
 *   error     receives what is wrong where the call is refused; null: not wanted
 *   bytes     receives the bytes; less is for fewer lanes */
BLIK_API blik_status blik_image_scratch_size(const blik_solution *solution, const blik_camera *camera,
    const blik_run *run, blik_error *error, size_t *bytes);

/* The image that a camera sees, row 0 at the top, bands innermost. A call that is cancelled leaves part of it written.
 *
 *   solution         the solution
 *   camera           the camera
 *   run              how the call runs; null: on the calling thread
 *   scratch          scratch memory; with the standard library null takes it from the heap
 *   scratch_size     its bytes
 *   error            receives what is wrong where the call is refused; null: not wanted
 *   pixels           receives radiance by row, column and band: rows x columns x bands values
 *   pixel_count      number of values that pixels has room for: rows x columns x bands
 *   components       receives the three terms of the radiance one after the other, each like pixels: diffuse, mirrored
 *                    sky and sun, mirrored diffuse. Null: not wanted
 *   component_count  number of values that there is room for: three times pixel_count
 *   tally            receives what was done, for blik_get_report; its struct_size is set before. Null: not wanted */
BLIK_API blik_status blik_image(const blik_solution *solution, const blik_camera *camera, const blik_run *run,
    void *scratch, size_t scratch_size, blik_error *error, float *pixels, size_t pixel_count, float *components,
    size_t component_count, blik_tally *tally);

/* Rows of the image that a camera sees, for schedulers and processes of the caller. However an image is split, its bits
 * are the same.
 *
 *   solution         the solution
 *   camera           the camera
 *   first            index of the first row
 *   rows             number of rows
 *   scratch          scratch memory; with the standard library null takes it from the heap
 *   scratch_size     its bytes
 *   error            receives what is wrong where the call is refused; null: not wanted
 *   pixels           receives radiance by row, column and band: rows x columns x bands values
 *   pixel_count      number of values that pixels has room for: rows x columns x bands
 *   components       receives the three terms of the radiance one after the other, each like pixels: diffuse, mirrored
 *                    sky and sun, mirrored diffuse. Null: not wanted
 *   component_count  number of values that there is room for: three times pixel_count
 *   tally            receives what was done, for blik_get_report; its struct_size is set before. Null: not wanted */
BLIK_API blik_status blik_image_rows(const blik_solution *solution, const blik_camera *camera, size_t first,
    size_t rows, void *scratch, size_t scratch_size, blik_error *error, float *pixels, size_t pixel_count,
    float *components, size_t component_count, blik_tally *tally);

/* Adds the tally of other rows of an image.
 *
 *   sum    the sum so far, and the new one
 *   next   what is added
 *   error  receives what is wrong where the call is refused; null: not wanted */
BLIK_API blik_status blik_tally_add(blik_tally *sum, const blik_tally *next, blik_error *error);

/* The largest part of the estimate of a blik_report. */
typedef enum blik_limit {
    BLIK_LIMIT_NOTHING = 0, /* The estimate is 0. */
    BLIK_LIMIT_VISIBILITY = 1, /* Rays and elements of the diffuse solution. */
    BLIK_LIMIT_SAMPLING = 2, /* Rays through pixels. */
    BLIK_LIMIT_SOLVER = 3, /* Sweeps that were not done. */
    BLIK_LIMIT_CHAIN = 4, /* Chains that were cut. */
    BLIK_LIMIT_MAX_ENUM = 0x7fffffff
} blik_limit;

/* Report of an image: work that was done, error estimates and bounds. */
typedef struct blik_report {
    size_t struct_size; /* Size of this struct. */
    double tolerance; /* The wanted error, of the solution where images have one of their own. */
    /* Expected error of the image (rms over the pixels that meet the object), relative to the reference radiance. */
    double error_estimate;
    /* Certain bound on the distance of the radiances from the solution of the discrete system. */
    double certified_solver;
    double certified_chain_tail; /* Certain bound on what chains that were cut could still have brought to a pixel. */
    /* Certain bound on the weight of couplings that were cut, as a share of the hemisphere. */
    double certified_dropped;
    uint64_t visibility_rays; /* Rays that coupling traced. */
    uint64_t sun_rays; /* Rays toward the sun, and of beams, which mirrors reflect. */
    uint64_t primary_rays; /* Rays through pixels. */
    uint64_t chain_rays; /* Rays of specular chains and toward the sun from what pixels see. */
    uint64_t pairs; /* Form factors kept. */
    uint64_t skipped_rows; /* Rows of the coupling that nothing needed. */
    uint64_t open_rows; /* Rows of the coupling that see the sky alone. */
    size_t elements; /* Elements. */
    size_t bytes; /* Bytes of the scene, of the coupling and of the solution. */
    uint32_t sweeps; /* Sweeps over the linear system. */
    int32_t tolerance_met; /* 1 where the estimate is at most the wanted error of images. */
    blik_limit limited_by; /* The largest part of the estimate. */
} blik_report;

/* Sets struct_size of a blik_report. */
static inline void blik_report_init(blik_report *report)
{
    report->struct_size = sizeof *report;
}

/* The report of an image; reads the whole coupling.
 *
 *   solution  the solution
 *   tally     the tally of all rows of the image
 *   error     receives what is wrong where the call is refused; null: not wanted
 *   report    receives the report; its struct_size is set before */
BLIK_API blik_status blik_get_report(const blik_solution *solution, const blik_tally *tally, blik_error *error,
    blik_report *report);

/* The rounds of an image: what was asked, and what the last round came to. */
typedef struct blik_rounds {
    size_t struct_size; /* Size of this struct. */
    /* The wanted error of the image, 1e-6 to 0.1: image_tolerance of the settings of every round; default 2e-3. */
    double asked;
    double tolerance; /* Tolerance of the coupling of the next round; set by blik_rounds_next. */
    uint32_t done; /* Rounds so far; kept by blik_rounds_next, as all that follows. */
    int32_t last_by_visibility; /* Not 0: the diffuse solution limited the last round. */
    double last_tolerance; /* Tolerance of the last round. */
    double last_estimate; /* Error estimate of the last round. */
    uint64_t last_rays; /* Rays of visibility of the last round. */
    size_t last_bytes; /* Bytes of the last round. */
} blik_rounds;

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

/* Whether an image had better be computed again, and to what tolerance: a loop that the program render and the Rust
 * interface go by, too.
 *
 * Writes to tolerance of the rounds that of the next round's coupling, or 0 where the image is good enough, would hardly
 * be better, would take too much, or has had three rounds. The first round is coarser than asked where that is little,
 * since rays from the image's points find the rest.
 *
 *   rounds  the rounds, set by blik_rounds_init and then by nothing but this call
 *   report  the report of the image of the last round; null before the first
 *   error   receives what is wrong where the call is refused; null: not wanted */
BLIK_API blik_status blik_rounds_next(blik_rounds *rounds, const blik_report *report, blik_error *error);

/* ---- Rays, signatures, facets ------------------------------------------------------------------------------------ */

/* Bytes of scratch memory with which blik_radiance and blik_signatures keep all lanes of run busy.
 *
 *   solution  the solution
 *   run       how the call runs; null: on the calling thread
 *   error     receives what is wrong where the call is refused; null: not wanted
 *   bytes     receives the bytes; less is for fewer lanes */
BLIK_API blik_status blik_radiance_scratch_size(const blik_solution *solution, const blik_run *run, blik_error *error,
    size_t *bytes);

/* Radiance against rays.
 *
 *   solution        the solution
 *   rays            the rays, as for blik_closest_hits
 *   count           number of rays
 *   run             how the call runs; null: on the calling thread
 *   scratch         scratch memory; with the standard library null takes it from the heap
 *   scratch_size    its bytes
 *   error           receives what is wrong where the call is refused; null: not wanted
 *   radiance        receives one value a ray and band, bands innermost
 *   radiance_count  number of values that there is room for: count x bands */
BLIK_API blik_status blik_radiance(const blik_solution *solution, const blik_ray *rays, size_t count,
    const blik_run *run, void *scratch, size_t scratch_size, blik_error *error, double *radiance,
    size_t radiance_count);

/* Signature in one direction and band, as a distant observer measures it. Arrays of it have a stride: it may grow. */
typedef struct blik_signature {
    double radiant_intensity; /* Radiant intensity toward the observer, W/sr. */
    double projected_area; /* Area of the object's projection, in the square of the mesh's unit. */
    double mean_radiance; /* Radiant intensity over projected area; 0 where nothing is seen. */
    double background; /* Radiance of the sky behind. */
    double contrast; /* (mean radiance - background)/background; 0 where the background is 0. */
    double error_estimate; /* Expected error of the radiant intensity, W/sr. */
    /* Glints that may lie between cells, or be met by chance and count too much: what they bring on the mean, W/sr; not
     * among the error. */
    double unresolved_glints;
} blik_signature;

/* Signatures of the whole object, as distant observers measure them, without an image.
 *
 *   solution          the solution
 *   directions        three numbers a view, from the observer toward the object, of any length but zero
 *   direction_count   number of views
 *   cells             cells along each side of the projection, one ray each, up to 65536; 0: by tolerance
 *   run               how the call runs; null: on the calling thread
 *   scratch           scratch memory; with the standard library null takes it from the heap
 *   scratch_size      its bytes
 *   error             receives what is wrong where the call is refused; null: not wanted
 *   signatures        receives one entry a view and band, bands innermost
 *   signature_count   number of entries that there is room for: views x bands
 *   signature_stride  bytes from one entry to the next: sizeof(blik_signature) */
BLIK_API blik_status blik_signatures(const blik_solution *solution, const double *directions, size_t direction_count,
    size_t cells, const blik_run *run, void *scratch, size_t scratch_size, blik_error *error,
    blik_signature *signatures, size_t signature_count, size_t signature_stride);

/* Area, mean irradiance (all that arrives, not divided by pi) and diffuse radiance of facets. Degenerate facets: zeros.
 *
 *   solution          the solution
 *   first             index of the first facet
 *   count             number of facets
 *   error             receives what is wrong where the call is refused; null: not wanted
 *   areas             receives one value a facet; null: not wanted
 *   area_count        number of values that there is room for: count
 *   irradiance        receives one value a facet, side and band, bands innermost; null: not wanted
 *   irradiance_count  number of values that there is room for: count x sides x bands
 *   radiance          receives as many; null: not wanted
 *   radiance_count    number of values that there is room for: count x sides x bands */
BLIK_API blik_status blik_facets(const blik_solution *solution, size_t first, size_t count, blik_error *error,
    double *areas, size_t area_count, double *irradiance, size_t irradiance_count, double *radiance,
    size_t radiance_count);

/* ---- Baked blocks: a prepared scene as bytes --------------------------------------------------------------------- */

/* Boundary, in bytes, on which a baked block starts. */
#define BLIK_BLOCK_ALIGNMENT 64

/* Bytes of the block that blik_bake writes.
 *
 *   coupling  the coupling
 *   solution  a solution of it; null: none
 *   error     receives what is wrong where the call is refused; null: not wanted
 *   bytes     receives the bytes */
BLIK_API blik_status blik_bake_size(const blik_coupling *coupling, const blik_solution *solution, blik_error *error,
    size_t *bytes);

/* Writes scene, tree, coupling and perhaps a solution as one relocatable block, with version, byte order, size and
 * checksum.
 *
 *   coupling  the coupling
 *   solution  a solution of it; null: none
 *   block     receives the block; starts on a boundary of BLIK_BLOCK_ALIGNMENT bytes
 *   size      bytes that there is room for
 *   error     receives what is wrong where the call is refused; null: not wanted */
BLIK_API blik_status blik_bake(const blik_coupling *coupling, const blik_solution *solution, void *block, size_t size,
    blik_error *error);

/* Bytes of memory that blik_load needs for the handles of a block: some hundred, and some for each part of the
 * coupling.
 *
 *   block  the block, of which the head alone is read
 *   size   its bytes
 *   error  receives what is wrong where the call is refused; null: not wanted
 *   bytes  receives the bytes */
BLIK_API blik_status blik_load_size(const void *block, size_t size, blik_error *error, size_t *bytes);

/* Checks a block from end to end and makes handles over it. A block that is damaged or hostile is refused by
 * BLIK_ERROR_BLOCK.
 *
 *   block        the block; read where it stands (read-only memory will do) for as long as the handles are in use
 *   size         its bytes
 *   memory       memory for the handles, at any address
 *   memory_size  its bytes
 *   error        receives what is wrong where the call is refused; null: not wanted
 *   scene        receives the scene
 *   coupling     receives the coupling
 *   solution     receives the solution; null where the block has none */
BLIK_API blik_status blik_load(const void *block, size_t size, void *memory, size_t memory_size, blik_error *error,
    blik_scene **scene, blik_coupling **coupling, blik_solution **solution);

#ifdef __cplusplus
}
#endif

#endif /* BLIK_H */
