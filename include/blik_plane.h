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

/* How rays stand for the lobe of a blik_plane_material. */
typedef enum blik_plane_ray_set {
    BLIK_PLANE_RAYS_AUTO = 0, /* The rays that the tolerance needs. */
    BLIK_PLANE_RAYS_PAPER = 1, /* Three rays as in the paper; those below the surface are lost. */
    BLIK_PLANE_RAYS_RENORMALISED = 2, /* Three rays, of which those above the surface share the lobe's albedo. */
    BLIK_PLANE_RAYS_GAUSS = 3, /* Gauss nodes in the visible lobe's energy. */
    BLIK_PLANE_RAYS_EQUAL = 4, /* Midpoints of equal shares of the visible lobe's energy. */
    BLIK_PLANE_RAYS_SPLIT = 5, /* Gauss nodes in each part of the lobe between silhouettes. */
    BLIK_PLANE_RAY_SET_MAX_ENUM = 0x7fffffff
} blik_plane_ray_set;

/* Reflectances of a body of the plane model. Arrays of it have a stride: it may grow. */
typedef struct blik_plane_material {
    double diffuse; /* Diffuse reflectance, in [0, 1]; default 0. */
    /* Mirror reflectance, in [0, 1], diffuse + specular <= 1; with gloss the lobe's albedo at normal view; default 0. */
    double specular;
    /* 0 (default): an ideal mirror; else long over short axis of the lobe, >= 1 (1e4 and above: an ideal mirror). */
    double gloss_axis_ratio;
    double spacing; /* Full angle between the side rays of the paper's three, radians, 0 to 3.2. */
    blik_plane_ray_set ray_set; /* How rays stand for the lobe; default AUTO. */
    /* Rays of GAUSS, EQUAL and SPLIT at the first lobe of a path, at the second, and later: 1 to 4096. */
    uint32_t rays[3];
} blik_plane_material;

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

/* Shape of a blik_plane_body. */
typedef enum blik_plane_shape {
    BLIK_PLANE_CIRCLE = 0, /* A circle, seen from outside. */
    BLIK_PLANE_POLYLINE = 1, /* Straight segments from point to point. */
    BLIK_PLANE_POLYGON = 2, /* Straight segments, the last of which joins the first point. */
    BLIK_PLANE_SHAPE_MAX_ENUM = 0x7fffffff
} blik_plane_shape;

/* A body of the plane model: a circle, or segments whose fronts are on the right of their direction (counter-clockwise
 * for a solid body, clockwise for a cavity) and whose backs are black and opaque. Bodies touch at most in corners.
 * Arrays of it have a stride: it may grow. */
typedef struct blik_plane_body {
    blik_plane_shape shape; /* Circle (default), polyline or polygon. */
    /* Not 0: the segments stand for a smooth curve, whose normals and radiance are interpolated; default 0. */
    int32_t smooth;
    uint32_t material; /* Index of the material; default 0. */
    uint32_t elements; /* Elements of the circle, or of each segment, 1 to 2^20; default 1. */
    double centre[2]; /* Centre of a circle. */
    double radius; /* Radius of a circle, positive; default 1. */
    const double *points; /* Two numbers a point; not read for a circle. */
    size_t point_count; /* At least 2 of a polyline, 3 of a polygon, whose first is not repeated. */
} blik_plane_body;

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

/* What a plane scene is made of. Read during the call only. */
typedef struct blik_plane_bodies {
    size_t struct_size; /* Size of this struct. */
    const blik_plane_body *bodies; /* The bodies, at least one. */
    size_t body_count; /* Number of bodies. */
    size_t body_stride; /* Bytes from one body to the next; set by the init function. */
    const blik_plane_material *materials; /* The materials, at least one. */
    size_t material_count; /* Number of materials. */
    size_t material_stride; /* Bytes from one material to the next; set by the init function. */
} blik_plane_bodies;

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

enum {
    BLIK_PLANE_AUTO = 0, /* A choice of blik_plane_settings that follows from the tolerance. */
    BLIK_PLANE_CONSTANT = 1, /* basis of blik_plane_settings: radiance is constant on each element, as in the paper. */
    BLIK_PLANE_LINEAR = 2, /* basis of blik_plane_settings: linear between the elements' centres. */
    BLIK_PLANE_PANELS = 3, /* basis of blik_plane_settings: polynomials through order Gauss points of each element. */
    /* method of blik_plane_settings: exact form factors of elements times the radiance at their centres, with
     * points mirror chains for each, as in the paper. */
    BLIK_PLANE_FACETS = 1,
    /* method of blik_plane_settings: the half circle is split where chains change, each part with points nodes. */
    BLIK_PLANE_SPLIT = 2,
};

/* How a plane scene is solved. All but the tolerance follows from it. */
typedef struct blik_plane_settings {
    size_t struct_size; /* Size of this struct. */
    /* Wanted error relative to the sky, 1e-13 to 0.1, on bodies that are cut finely enough (a circle of 12 elements at
     * 1e-4, 16 at 1e-5); default 1e-4. */
    double tolerance;
    int32_t basis; /* How the diffuse radiance varies, BLIK_PLANE_AUTO (default), _CONSTANT, _LINEAR or _PANELS. */
    uint32_t order; /* Gauss points of an element, 1 to 6, where basis is PANELS. */
    int32_t method; /* How rows are integrated, BLIK_PLANE_AUTO (default), _FACETS or _SPLIT. */
    uint32_t points; /* Nodes or chains of the method, up to 4096, where that is not AUTO. */
    int32_t max_bounces; /* Light reflected more often does not count, 1 to 64; below 0 (default): by cutoff. */
    /* Chains end where their mirrors leave less than this share, up to 1; below 0 (default): by tolerance. */
    double cutoff;
    /* Bound on the solver's error relative to the brightest light, up to 1; below 0 (default): by tolerance. */
    double solver;
} blik_plane_settings;

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

/* A plane scene in memory. Read-only once made: any number of threads may use it at once. */
typedef struct blik_plane_scene blik_plane_scene;

/* Bytes of memory that blik_plane_scene_init needs for these bodies, at any address.
 *
 *   bodies  the bodies and materials
 *   error   receives what is wrong where the call is refused; null: not wanted
 *   bytes   receives the bytes */
BLIK_API blik_status blik_plane_scene_size(const blik_plane_bodies *bodies, blik_error *error, size_t *bytes);

/* Checks bodies and settings and makes a plane scene of them in the caller's memory.
 *
 *   bodies    the bodies and materials; not needed afterwards
 *   settings  how they are solved
 *   memory    memory of the caller, at any address
 *   size      its bytes
 *   error     receives what is wrong where the call is refused; null: not wanted
 *   scene     receives the scene */
BLIK_API blik_status blik_plane_scene_init(const blik_plane_bodies *bodies, const blik_plane_settings *settings,
    void *memory, size_t size, blik_error *error, blik_plane_scene **scene);

#ifdef BLIK_STD
/* Checks bodies and settings and makes a plane scene of them in memory of its own.
 *
 *   bodies    the bodies and materials; not needed afterwards
 *   settings  how they are solved
 *   error     receives what is wrong where the call is refused; null: not wanted
 *   scene     receives the scene; to be ended by blik_plane_scene_destroy */
BLIK_API blik_status blik_plane_scene_create(const blik_plane_bodies *bodies, const blik_plane_settings *settings,
    blik_error *error, blik_plane_scene **scene);
#endif

/* Ends a plane scene and frees what it owns.
 *
 *   scene  the scene, whose couplings have ended before; null: nothing */
BLIK_API void blik_plane_scene_destroy(blik_plane_scene *scene);

/* Numbers of a plane scene. */
typedef struct blik_plane_scene_info {
    size_t struct_size; /* Size of this struct. */
    size_t bodies; /* Bodies. */
    size_t primitives; /* Circles and segments. */
    size_t unknowns; /* Unknowns of the linear system. */
    size_t bytes; /* Bytes in use. */
} blik_plane_scene_info;

/* Sets struct_size of a blik_plane_scene_info. */
static inline void blik_plane_scene_info_init(blik_plane_scene_info *info)
{
    info->struct_size = sizeof *info;
}

/* Numbers of a plane scene.
 *
 *   scene  the scene
 *   error  receives what is wrong where the call is refused; null: not wanted
 *   info   receives them; its struct_size is set before */
BLIK_API blik_status blik_plane_scene_get_info(const blik_plane_scene *scene, blik_error *error,
    blik_plane_scene_info *info);

/* A ray of the plane. Frozen: it does not grow. */
typedef struct blik_plane_ray {
    double origin[2]; /* Where it starts. */
    double direction[2]; /* Unit vector along it. */
} blik_plane_ray;

/* Where a ray of the plane meets a body first. Frozen: it does not grow. */
typedef struct blik_plane_hit {
    double point[2]; /* The point; (0, 0) where nothing is met. */
    double normal[2]; /* Unit normal of the front. */
    uint32_t primitive; /* Circle or segment, counted over all bodies; BLIK_NO_FACET where nothing is met. */
    int32_t front; /* 1 where its front is met. */
} blik_plane_hit;

/* The first circle or segment that each ray meets.
 *
 *   scene      the scene
 *   rays       the rays; one that is not finite or of no unit direction is refused with its index
 *   count      number of rays
 *   error      receives what is wrong where the call is refused; null: not wanted
 *   hits       receives one hit a ray
 *   hit_count  number of hits that there is room for: count */
BLIK_API blik_status blik_plane_first_hits(const blik_plane_scene *scene, const blik_plane_ray *rays, size_t count,
    blik_error *error, blik_plane_hit *hits, size_t hit_count);

/* A part of what a point of the plane sees. Frozen: it does not grow. */
typedef struct blik_plane_span {
    double from; /* Sine of the angle to the normal at which it begins, counter-clockwise positive. */
    double to; /* Sine at which it ends: half the difference is its form factor. */
    uint32_t primitive; /* The circle or segment that is seen, BLIK_NO_FACET for the sky. */
} blik_plane_span;

/* Bytes of scratch memory for blik_plane_visible, and the most spans that it finds.
 *
 *   scene       the scene
 *   error       receives what is wrong where the call is refused; null: not wanted
 *   bytes       receives the bytes
 *   most_spans  receives the number of spans */
BLIK_API blik_status blik_plane_visible_size(const blik_plane_scene *scene, blik_error *error, size_t *bytes,
    size_t *most_spans);

/* What a point sees of a plane scene, split at every silhouette.
 *
 *   scene         the scene
 *   point         two numbers
 *   normal        two numbers, of any length but zero
 *   skip          the circle or segment on which the point is, or BLIK_NO_FACET
 *   scratch       scratch memory; with the standard library null takes it from the heap
 *   scratch_size  its bytes
 *   error         receives what is wrong where the call is refused; null: not wanted
 *   spans         receives the spans, in the order of rising sines
 *   capacity      number of spans that there is room for; more are an error that tells how many
 *   count         receives the number of spans */
BLIK_API blik_status blik_plane_visible(const blik_plane_scene *scene, const double *point, const double *normal,
    uint32_t skip, void *scratch, size_t scratch_size, blik_error *error, blik_plane_span *spans, size_t capacity,
    size_t *count);

/* ---- Coupling: extended form factors between the unknowns of a scene --------------------------------------------- */

/* The coupling of a plane scene in memory. Read-only once made: any number of threads may use it at once. */
typedef struct blik_plane_coupling blik_plane_coupling;

/* Bytes of memory with which blik_plane_coupling_init keeps all lanes of run busy.
 *
 *   scene  the scene
 *   run    how the call runs; null: on the calling thread
 *   error  receives what is wrong where the call is refused; null: not wanted
 *   bytes  receives the bytes; less is for fewer lanes */
BLIK_API blik_status blik_plane_coupling_size(const blik_plane_scene *scene, const blik_run *run, blik_error *error,
    size_t *bytes);

/* Computes the extended form factors of all unknowns of a plane scene in the caller's memory: once for its bodies and
 * materials, whatever the light.
 *
 *   scene     the scene, which must outlive the coupling
 *   run       how the call runs; null: on the calling thread
 *   memory    memory of the caller, at any address
 *   size      its bytes
 *   error     receives what is wrong where the call is refused; null: not wanted
 *   coupling  receives the coupling */
BLIK_API blik_status blik_plane_coupling_init(const blik_plane_scene *scene, const blik_run *run, void *memory,
    size_t size, blik_error *error, blik_plane_coupling **coupling);

#ifdef BLIK_STD
/* Computes the extended form factors of all unknowns of a plane scene in memory of its own.
 *
 *   scene     the scene, which must outlive the coupling
 *   run       how the call runs; null: on the calling thread
 *   error     receives what is wrong where the call is refused; null: not wanted
 *   coupling  receives the coupling; to be ended by blik_plane_coupling_destroy */
BLIK_API blik_status blik_plane_coupling_create(const blik_plane_scene *scene, const blik_run *run, blik_error *error,
    blik_plane_coupling **coupling);
#endif

/* Ends a plane coupling and frees what it owns.
 *
 *   coupling  the coupling, whose solutions have ended before; null: nothing */
BLIK_API void blik_plane_coupling_destroy(blik_plane_coupling *coupling);

/* Numbers of a plane coupling. */
typedef struct blik_plane_coupling_info {
    size_t struct_size; /* Size of this struct. */
    size_t unknowns; /* Unknowns: rows. */
    size_t classes; /* Rows kept for each unknown: one for each number of reflections that is told apart. */
    size_t coupled_rows; /* Rows that see something of the object. */
    uint64_t rays; /* Rays traced. */
    /* Largest share of the brightest light that chains of a row could still have brought which were cut: a bound. */
    double dropped;
    size_t bytes; /* Bytes in use. */
} blik_plane_coupling_info;

/* Sets struct_size of a blik_plane_coupling_info. */
static inline void blik_plane_coupling_info_init(blik_plane_coupling_info *info)
{
    info->struct_size = sizeof *info;
}

/* Numbers of a plane coupling.
 *
 *   coupling  the coupling
 *   error     receives what is wrong where the call is refused; null: not wanted
 *   info      receives them; its struct_size is set before */
BLIK_API blik_status blik_plane_coupling_get_info(const blik_plane_coupling *coupling, blik_error *error,
    blik_plane_coupling_info *info);

/* Rows of extended form factors.
 *
 *   coupling      the coupling
 *   first         index of the first row
 *   count         number of rows
 *   error         receives what is wrong where the call is refused; null: not wanted
 *   factors       receives for each row and class the factors toward all unknowns; null: not wanted
 *   factor_count  number of values that there is room for: count x classes x unknowns
 *   open          receives for each row and class the share that shows the sky; null: not wanted
 *   open_count    number of values that there is room for: count x classes */
BLIK_API blik_status blik_plane_coupling_get_rows(const blik_plane_coupling *coupling, size_t first, size_t count,
    blik_error *error, double *factors, size_t factor_count, double *open, size_t open_count);

/* ---- Solution: a scene under one light --------------------------------------------------------------------------- */

/* Most jumps of a plane sky. */
#define BLIK_PLANE_MAX_JUMPS 12

/* Radiance that arrives from the direction (x, y), a unit vector away from the object: finite, 0 to 1e37. Called by any
 * number of threads at once. */
typedef double (*blik_plane_radiance_of)(void *user, double x, double y);

/* The sky of a plane scene. */
typedef struct blik_plane_sky {
    size_t struct_size; /* Size of this struct. */
    double radiance; /* Radiance from everywhere where radiance_of is null; default 1. */
    /* Radiance by direction; null (default): radiance. It must not throw, and is in use as long as the solution. */
    blik_plane_radiance_of radiance_of;
    void *user; /* Handed to radiance_of. */
    const double *jumps; /* Directions, two numbers each, at which radiance_of jumps or bends; copied. */
    size_t jump_count; /* At most BLIK_PLANE_MAX_JUMPS. */
} blik_plane_sky;

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

/* A point sun of a plane scene. */
typedef struct blik_plane_sun {
    size_t struct_size; /* Size of this struct. */
    double direction[2]; /* Toward the sun, of any length but zero; default (0, 1). */
    /* Irradiance of a surface that faces it, radiance times angle; default 2, which gives a white one the radiance 1. */
    double irradiance;
    /* The paper's cone: rays that leave the object after a mirror within this angle of the sun see it, radians up to
     * 1.5. 0 (default): lobes are evaluated at the sun's direction, and ideal mirrors do not show it. */
    double capture_half_angle;
    /* Radiance that such rays see; below 0 (default): the one that keeps the energy, irradiance over the cone's width. */
    double capture_radiance;
} blik_plane_sun;

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

/* The light of a plane scene. Read during the call only. */
typedef struct blik_plane_light {
    size_t struct_size; /* Size of this struct. */
    const blik_plane_sky *sky; /* The sky; null (default): none. */
    const blik_plane_sun *sun; /* The sun; null (default): none. */
} blik_plane_light;

/* Sets the defaults of a blik_plane_light: none. */
static inline void blik_plane_light_init(blik_plane_light *light)
{
    light->struct_size = sizeof *light;
    light->sky = NULL;
    light->sun = NULL;
}

/* A solved plane scene in memory. Any number of threads may use it at once. */
typedef struct blik_plane_solution blik_plane_solution;

/* Bytes of memory with which blik_plane_solution_init keeps all lanes of run busy.
 *
 *   coupling  the coupling
 *   light     the light
 *   run       how the call runs; null: on the calling thread
 *   error     receives what is wrong where the call is refused; null: not wanted
 *   bytes     receives the bytes; less is for fewer lanes */
BLIK_API blik_status blik_plane_solution_size(const blik_plane_coupling *coupling, const blik_plane_light *light,
    const blik_run *run, blik_error *error, size_t *bytes);

/* Lights a plane scene and solves for its diffuse radiance in the caller's memory. A solution whose sky ever returned what
 * is not finite, below 0 or above 1e37 refuses that call and all later ones.
 *
 *   coupling  the coupling, which must outlive the solution
 *   light     the light, whose sky's function must outlive the solution
 *   run       how the call runs; null: on the calling thread
 *   memory    memory of the caller, at any address
 *   size      its bytes
 *   error     receives what is wrong where the call is refused; null: not wanted
 *   solution  receives the solution */
BLIK_API blik_status blik_plane_solution_init(const blik_plane_coupling *coupling, const blik_plane_light *light,
    const blik_run *run, void *memory, size_t size, blik_error *error, blik_plane_solution **solution);

#ifdef BLIK_STD
/* Lights a plane scene and solves for its diffuse radiance in memory of its own.
 *
 *   coupling  the coupling, which must outlive the solution
 *   light     the light, whose sky's function must outlive the solution
 *   run       how the call runs; null: on the calling thread
 *   error     receives what is wrong where the call is refused; null: not wanted
 *   solution  receives the solution; to be ended by blik_plane_solution_destroy */
BLIK_API blik_status blik_plane_solution_create(const blik_plane_coupling *coupling, const blik_plane_light *light,
    const blik_run *run, blik_error *error, blik_plane_solution **solution);
#endif

/* Ends a plane solution and frees what it owns.
 *
 *   solution  the solution; null: nothing */
BLIK_API void blik_plane_solution_destroy(blik_plane_solution *solution);

/* Numbers of a plane solution. */
typedef struct blik_plane_solution_info {
    size_t struct_size; /* Size of this struct. */
    double contraction; /* Contraction of a sweep over the linear system. */
    /* Bound on the solver's error of all radiances: certain where the contraction is below 1, else by the sweeps' decay. */
    double solver_error;
    uint32_t sweeps; /* Sweeps made. */
    size_t bytes; /* Bytes in use. */
} blik_plane_solution_info;

/* Sets struct_size of a blik_plane_solution_info. */
static inline void blik_plane_solution_info_init(blik_plane_solution_info *info)
{
    info->struct_size = sizeof *info;
}

/* Numbers of a plane solution.
 *
 *   solution  the solution
 *   error     receives what is wrong where the call is refused; null: not wanted
 *   info      receives them; its struct_size is set before */
BLIK_API blik_status blik_plane_solution_get_info(const blik_plane_solution *solution, blik_error *error,
    blik_plane_solution_info *info);

/* An unknown of a plane solution. Frozen: it does not grow. */
typedef struct blik_plane_unknown {
    double point[2]; /* Where it stands. */
    double normal[2]; /* Unit normal of the surface there. */
    double radiance; /* Diffuse radiance without the sun's direct part. */
    uint32_t primitive; /* Circle or segment, counted over all bodies. */
} blik_plane_unknown;

/* Unknowns of a plane solution.
 *
 *   solution       the solution
 *   first          index of the first unknown
 *   count          number of unknowns
 *   error          receives what is wrong where the call is refused; null: not wanted
 *   unknowns       receives the unknowns
 *   unknown_count  number of unknowns that there is room for: count */
BLIK_API blik_status blik_plane_get_unknowns(const blik_plane_solution *solution, size_t first, size_t count,
    blik_error *error, blik_plane_unknown *unknowns, size_t unknown_count);

/* ---- Images, rays, the lobe -------------------------------------------------------------------------------------- */

/* What a ray of the plane brings. Frozen: it does not grow. */
typedef struct blik_plane_sample {
    /* Place of an image's sample, along the direction that is clockwise of the view; 0 of blik_plane_radiance. */
    double abscissa;
    double radiance; /* Radiance: the sky's where nothing is met. */
    /* Bound on the light that chains could still have brought which were cut, as a share of the brightest. */
    double chain_tail;
    uint32_t rays; /* Rays traced. */
    int32_t object; /* 1 where the ray meets the object. */
} blik_plane_sample;

/* Bytes of scratch memory with which blik_plane_image and blik_plane_radiance keep all lanes of run busy.
 *
 *   solution  the solution
 *   run       how the call runs; null: on the calling thread
 *   error     receives what is wrong where the call is refused; null: not wanted
 *   bytes     receives the bytes; less is for fewer lanes */
BLIK_API blik_status blik_plane_scratch_size(const blik_plane_solution *solution, const blik_run *run,
    blik_error *error, size_t *bytes);

/* Samples of the orthographic image of a plane scene: the centres of equal cells over the object's projection. However an
 * image is split into calls, its bits are the same. A call that is cancelled leaves part of them written.
 *
 *   solution      the solution
 *   angle         where it is seen from: the direction (sin angle, cos angle)
 *   samples       samples across the whole image
 *   first         index of the first sample wanted
 *   count         number of samples wanted
 *   run           how the call runs; null: on the calling thread
 *   scratch       scratch memory; with the standard library null takes it from the heap
 *   scratch_size  its bytes
 *   error         receives what is wrong where the call is refused; null: not wanted
 *   out           receives the samples
 *   out_count     number of samples that there is room for: count */
BLIK_API blik_status blik_plane_image(const blik_plane_solution *solution, double angle, size_t samples, size_t first,
    size_t count, const blik_run *run, void *scratch, size_t scratch_size, blik_error *error, blik_plane_sample *out,
    size_t out_count);

/* Radiance against rays.
 *
 *   solution      the solution
 *   rays          the rays, as for blik_plane_first_hits, which start on no body
 *   count         number of rays
 *   run           how the call runs; null: on the calling thread
 *   scratch       scratch memory; with the standard library null takes it from the heap
 *   scratch_size  its bytes
 *   error         receives what is wrong where the call is refused; null: not wanted
 *   out           receives one sample a ray
 *   out_count     number of samples that there is room for: count */
BLIK_API blik_status blik_plane_radiance(const blik_plane_solution *solution, const blik_plane_ray *rays, size_t count,
    const blik_run *run, void *scratch, size_t scratch_size, blik_error *error, blik_plane_sample *out,
    size_t out_count);

/* Closed forms of the lobe in the plane, for a specular reflectance of 1. Frozen: it does not grow. */
typedef struct blik_plane_lobe {
    /* Share of light from everywhere that it mirrors toward the view: 1 at normal view, 1/2 at grazing. */
    double albedo;
    double value; /* Its value per radian at the angle from the mirror direction. */
    double equivalent_width; /* Width of a top hat of its peak and visible energy, radians. */
    double mean_albedo; /* Mean of the albedo over the angle of incidence. */
    double cosine_mean_albedo; /* Mean of the albedo weighed by the cosine. */
} blik_plane_lobe;

/* The lobe of a glossy material of the plane.
 *
 *   gloss_axis_ratio  long over short axis of the lobe, 1 or more
 *   cos_view          cosine of the angle between view and normal, 0 to 1
 *   off               angle from the mirror direction in radians
 *   error             receives what is wrong where the call is refused; null: not wanted
 *   lobe              receives the closed forms */
BLIK_API blik_status blik_plane_gloss(double gloss_axis_ratio, double cos_view, double off, blik_error *error,
    blik_plane_lobe *lobe);

#ifdef __cplusplus
}
#endif

#endif /* BLIK_PLANE_H */
