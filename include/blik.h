/*
 * Blik: photometric images of faceted diffuse-mirror objects. C interface.
 *
 * Generated from ffi/src by cbindgen; after a change there: UPDATE_HEADER=1 cargo test --test header
 *
 * From a mesh to an image:
 *
 *     blik_mesh, blik_material     the caller's arrays, in any layout
 *       -> blik_scene              checked and ready for rays          once per mesh
 *       -> blik_coupling           extended form factors               once per mesh and materials
 *       -> blik_solution           sky and sun, solved                 once per light
 *       -> blik_image, blik_signatures, blik_radiance, blik_facets     once per view
 *
 * and the same in two dimensions, the plane model (circles and polylines), whose functions start with blik_plane:
 *
 *     blik_plane_bodies -> blik_plane_scene -> blik_plane_coupling -> blik_plane_solution -> blik_plane_image
 *
 * Memory.  The library never takes memory by itself but in the functions called create (and where an image's scratch
 *   memory is null), which the variant without the standard library (BLIK_NO_STD) does not have. Everything else works
 *   in memory of the caller: ask for its size, hand it over to init, and keep it as long as the handle is in use.
 *   Addresses need no alignment. A handle may not be moved. Handles made by init need no end.
 * Threads.  The library starts none and has no global state. Functions that take const handles may be called by any
 *   number of threads at once on the same handles; outputs and memory are the call's own. Long stages run on threads
 *   of the caller where blik_run says so. Results are the same, bit for bit, however the work is split.
 * Errors.  Every function that can fail returns a status, BLIK_OK or BLIK_ERROR_*, and fills in *error where that is
 *   not null: the field, the index of the facet, vertex or material, the value, the bytes needed. Other outputs are
 *   written on success only. Pointers are valid or null; a null that is not allowed is an error.
 * Structs.  Set every struct that starts with struct_size by its init function before the members that differ.
 * Units.  Radiance in W m-2 sr-1 and irradiance in W m-2, or any consistent unit; lengths in any unit. One value per
 *   spectral band, 1 to 64 bands. Directions of light point toward it. Front is counter-clockwise.
 *
 * SPDX-License-Identifier: MIT OR Apache-2.0
 */

#ifndef BLIK_H
#define BLIK_H

#include <stddef.h>
#include <stdint.h>

/* Define BLIK_NO_STD to use the library that was built without the standard library. */
#ifndef BLIK_NO_STD
#define BLIK_STD
#endif

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

/**
 * Boundary, in bytes, on which a baked block starts.
 */
#define BLIK_BLOCK_ALIGNMENT 64

/**
 * blik_plane_material: the rays that the tolerance needs.
 */
#define BLIK_PLANE_RAYS_AUTO 0

/**
 * blik_plane_material: three rays as eq. (18) has them; those below the surface are lost.
 */
#define BLIK_PLANE_RAYS_PAPER 1

/**
 * blik_plane_material: three rays, of which those above the surface share the lobe's albedo.
 */
#define BLIK_PLANE_RAYS_RENORMALISED 2

/**
 * blik_plane_material: Gauss nodes in the visible lobe's energy.
 */
#define BLIK_PLANE_RAYS_GAUSS 3

/**
 * blik_plane_material: midpoints of equal shares of the visible lobe's energy.
 */
#define BLIK_PLANE_RAYS_EQUAL 4

/**
 * blik_plane_material: Gauss nodes in each part of the lobe between silhouettes.
 */
#define BLIK_PLANE_RAYS_SPLIT 5

/**
 * blik_plane_body: a circle, seen from outside.
 */
#define BLIK_PLANE_CIRCLE 0

/**
 * blik_plane_body: straight segments from point to point.
 */
#define BLIK_PLANE_POLYLINE 1

/**
 * blik_plane_body: straight segments, the last of which joins the first point.
 */
#define BLIK_PLANE_POLYGON 2

/**
 * A choice of blik_plane_settings that follows from the tolerance.
 */
#define BLIK_PLANE_AUTO 0

/**
 * `basis` of blik_plane_settings: radiance is constant on each element, as in the paper.
 */
#define BLIK_PLANE_CONSTANT 1

/**
 * `basis` of blik_plane_settings: linear between the elements' centres.
 */
#define BLIK_PLANE_LINEAR 2

/**
 * `basis` of blik_plane_settings: polynomials through `order` Gauss points of each element.
 */
#define BLIK_PLANE_PANELS 3

/**
 * `method` of blik_plane_settings: exact form factors of elements times the radiance at their centres, with
 * `points` mirror chains for each, as in the paper.
 */
#define BLIK_PLANE_FACETS 1

/**
 * `method` of blik_plane_settings: the half circle is split where chains change, each part with `points` nodes.
 */
#define BLIK_PLANE_SPLIT 2

/**
 * Most jumps of a plane sky.
 */
#define BLIK_PLANE_MAX_JUMPS 12

/**
 * `limited_by` of blik_report: the estimate is 0.
 */
#define BLIK_LIMIT_NOTHING 0

/**
 * `limited_by` of blik_report: rays and elements of the diffuse solution.
 */
#define BLIK_LIMIT_VISIBILITY 1

/**
 * `limited_by` of blik_report: rays through pixels.
 */
#define BLIK_LIMIT_SAMPLING 2

/**
 * `limited_by` of blik_report: sweeps that were not done.
 */
#define BLIK_LIMIT_SOLVER 3

/**
 * `limited_by` of blik_report: chains that were cut.
 */
#define BLIK_LIMIT_CHAIN 4

/**
 * "No facet" in blik_ray and blik_hit.
 */
#define BLIK_NO_FACET 4294967295

/**
 * Done.
 */
#define BLIK_OK 0

/**
 * A pointer that must not be null is.
 */
#define BLIK_ERROR_NULL 1

/**
 * A struct's `struct_size` is none that this library knows: it was not set by its init function.
 */
#define BLIK_ERROR_STRUCT_SIZE 2

/**
 * A number stands for no choice: a type, a model, a projection, a sampling.
 */
#define BLIK_ERROR_CHOICE 3

/**
 * A handle was not made by this library, is destroyed, or belongs to other handles than those given beside it.
 */
#define BLIK_ERROR_HANDLE 4

/**
 * Memory is smaller than needed: `needed` and `given` are in bytes.
 */
#define BLIK_ERROR_BUFFER_TOO_SMALL 5

/**
 * An array has the wrong number of entries, or a stride shorter than an entry: `needed` and `given`.
 */
#define BLIK_ERROR_LENGTH 6

/**
 * More of something than there may be; `needed` is the limit.
 */
#define BLIK_ERROR_TOO_MANY 7

/**
 * The mesh has no facets, or the plane scene no bodies.
 */
#define BLIK_ERROR_NO_FACETS 8

/**
 * The mesh or the plane scene has no materials.
 */
#define BLIK_ERROR_NO_MATERIALS 9

/**
 * The number of spectral bands is outside 1 to 64; `given`.
 */
#define BLIK_ERROR_BANDS 10

/**
 * Vertex `index` is not finite.
 */
#define BLIK_ERROR_VERTEX 11

/**
 * Vertex normal `index` is zero or not finite.
 */
#define BLIK_ERROR_NORMAL 12

/**
 * The mesh is too large or too small for double precision.
 */
#define BLIK_ERROR_EXTENT 13

/**
 * Facet `index` has a vertex index (`value`) out of range.
 */
#define BLIK_ERROR_VERTEX_INDEX 14

/**
 * Facet `index` has a normal index (`value`) out of range.
 */
#define BLIK_ERROR_NORMAL_INDEX 15

/**
 * Facet or plane body `index` has a material (`value`) that there is not.
 */
#define BLIK_ERROR_MATERIAL_INDEX 16

/**
 * `field` of material `index` is out of range in `band`.
 */
#define BLIK_ERROR_MATERIAL 17

/**
 * Diffuse and mirror reflectance of material `index` add up to more than 1 in `band`.
 */
#define BLIK_ERROR_REFLECTANCE_SUM 18

/**
 * `field` is out of range (`value`, in `band`).
 */
#define BLIK_ERROR_RANGE 19

/**
 * The direction `field` is zero or not finite.
 */
#define BLIK_ERROR_DIRECTION 20

/**
 * The camera's `field` coincides with the eye or is parallel to the viewing direction.
 */
#define BLIK_ERROR_CAMERA 21

/**
 * The light grows without bound: a closed part of the scene reflects all of it.
 */
#define BLIK_ERROR_DIVERGES 22

/**
 * The progress callback asked to stop.
 */
#define BLIK_ERROR_CANCELLED 23

/**
 * The coupling kept no directions, which a sky that is not uniform needs.
 */
#define BLIK_ERROR_NOT_DIRECTIONAL 24

/**
 * A baked block is damaged, of another version or byte order, or not a block.
 */
#define BLIK_ERROR_BLOCK 25

/**
 * Memory does not start on the boundary that it must start on.
 */
#define BLIK_ERROR_ALIGNMENT 26

/**
 * The system gave no memory.
 */
#define BLIK_ERROR_MEMORY 27

/**
 * A fault of the library; please report it.
 */
#define BLIK_ERROR_INTERNAL 28

/**
 * Body `index` of a plane scene is no circle or polyline; `field` tells why.
 */
#define BLIK_ERROR_BODY 29

/**
 * No field.
 */
#define BLIK_FIELD_NONE 0

/**
 * Diffuse reflectance of a material.
 */
#define BLIK_FIELD_DIFFUSE 1

/**
 * Mirror reflectance of a material.
 */
#define BLIK_FIELD_SPECULAR 2

/**
 * Emission of a material, or of the whole scene where radiances exceed 1e37.
 */
#define BLIK_FIELD_EMISSION 3

/**
 * Axis ratio of a material's lobe.
 */
#define BLIK_FIELD_GLOSS_AXIS_RATIO 4

/**
 * Rays of a material's lobe.
 */
#define BLIK_FIELD_GLOSS_RAYS 5

/**
 * The tolerance.
 */
#define BLIK_FIELD_TOLERANCE 6

/**
 * The reference radiance.
 */
#define BLIK_FIELD_REFERENCE_RADIANCE 7

/**
 * Radiance of the sky.
 */
#define BLIK_FIELD_SKY_RADIANCE 8

/**
 * Radiance of the ground.
 */
#define BLIK_FIELD_SKY_GROUND 9

/**
 * The sky's up.
 */
#define BLIK_FIELD_SKY_UP 10

/**
 * Type of the CIE sky.
 */
#define BLIK_FIELD_SKY_CIE_TYPE 11

/**
 * Table of the sky.
 */
#define BLIK_FIELD_SKY_TABLE 12

/**
 * The CIE sky's sun.
 */
#define BLIK_FIELD_SKY_SUN_DIRECTION 13

/**
 * The table's azimuth 0.
 */
#define BLIK_FIELD_SKY_AZIMUTH_ZERO 14

/**
 * Direction of the sun.
 */
#define BLIK_FIELD_SUN_DIRECTION 15

/**
 * Irradiance of the sun.
 */
#define BLIK_FIELD_SUN_IRRADIANCE 16

/**
 * Half angle of the sun.
 */
#define BLIK_FIELD_SUN_HALF_ANGLE 17

/**
 * The camera's eye.
 */
#define BLIK_FIELD_CAMERA_EYE 18

/**
 * The camera's target.
 */
#define BLIK_FIELD_CAMERA_TARGET 19

/**
 * The camera's up.
 */
#define BLIK_FIELD_CAMERA_UP 20

/**
 * The camera's height.
 */
#define BLIK_FIELD_CAMERA_HEIGHT 21

/**
 * The camera's field of view.
 */
#define BLIK_FIELD_CAMERA_FOV 22

/**
 * Columns or rows of the image.
 */
#define BLIK_FIELD_RESOLUTION 23

/**
 * A direction given to the call.
 */
#define BLIK_FIELD_DIRECTION 24

/**
 * A range of rows.
 */
#define BLIK_FIELD_ROWS 25

/**
 * Reflections that count.
 */
#define BLIK_FIELD_MAX_BOUNCES 26

/**
 * Gauss points of an element of the plane model.
 */
#define BLIK_FIELD_PLANE_ORDER 27

/**
 * Nodes or chains of a method of the plane model.
 */
#define BLIK_FIELD_PLANE_POINTS 28

/**
 * Elements of a body of the plane model.
 */
#define BLIK_FIELD_BODY_ELEMENTS 29

/**
 * Radius of a body of the plane model.
 */
#define BLIK_FIELD_BODY_RADIUS 30

/**
 * Coordinates of a body of the plane model: not finite, beyond 1e100, too few points, or two that coincide.
 */
#define BLIK_FIELD_BODY_POINTS 31

/**
 * What a tally says of errors.
 */
#define BLIK_FIELD_TALLY 32

/**
 * The mesh's vertices.
 */
#define BLIK_FIELD_VERTICES 33

/**
 * The mesh's facets.
 */
#define BLIK_FIELD_FACETS 34

/**
 * The materials of the mesh's facets.
 */
#define BLIK_FIELD_FACET_MATERIALS 35

/**
 * The mesh's normals.
 */
#define BLIK_FIELD_NORMALS 36

/**
 * The normals of the mesh's facets.
 */
#define BLIK_FIELD_FACET_NORMALS 37

/**
 * The mesh's materials.
 */
#define BLIK_FIELD_MATERIALS 38

/**
 * Tasks at once.
 */
#define BLIK_FIELD_LANES 39

/**
 * Numbers of blik_array: 32-bit floating point.
 */
#define BLIK_F32 1

/**
 * Numbers of blik_array: 64-bit floating point.
 */
#define BLIK_F64 2

/**
 * Numbers of blik_array: unsigned, 8 bits.
 */
#define BLIK_U8 3

/**
 * Numbers of blik_array: unsigned, 16 bits.
 */
#define BLIK_U16 4

/**
 * Numbers of blik_array: unsigned, 32 bits.
 */
#define BLIK_U32 5

/**
 * Numbers of blik_array: unsigned, 64 bits.
 */
#define BLIK_U64 6

/**
 * "No vertex normal" among the indices of normals.
 */
#define BLIK_NO_NORMAL 4294967295

/**
 * blik_sky: the same radiance from the whole sphere.
 */
#define BLIK_SKY_UNIFORM 0

/**
 * blik_sky: the same radiance from above the horizon.
 */
#define BLIK_SKY_HEMISPHERE 1

/**
 * blik_sky: radiance (1 + 2 sin(elevation))/3.
 */
#define BLIK_SKY_OVERCAST 2

/**
 * blik_sky: one of the fifteen types of ISO 15469.
 */
#define BLIK_SKY_CIE 3

/**
 * blik_sky: linear in the height from ground (nadir) to radiance (zenith).
 */
#define BLIK_SKY_GRADIENT 4

/**
 * blik_sky: samples by elevation and azimuth.
 */
#define BLIK_SKY_TABLE 5

/**
 * blik_camera: parallel rays.
 */
#define BLIK_ORTHOGRAPHIC 0

/**
 * blik_camera: rays through the eye.
 */
#define BLIK_PERSPECTIVE 1

/**
 * blik_camera: mean radiance over the pixel's square, background included.
 */
#define BLIK_SAMPLE_AREA 0

/**
 * blik_camera: radiance along the ray through the pixel's centre.
 */
#define BLIK_SAMPLE_CENTRE 1

/**
 * A coupling in memory. Read-only once made: any number of threads may use it at once.
 */
typedef struct blik_coupling blik_coupling;

/**
 * The coupling of a plane scene in memory. Read-only once made: any number of threads may use it at once.
 */
typedef struct blik_plane_coupling blik_plane_coupling;

/**
 * A plane scene in memory. Read-only once made: any number of threads may use it at once.
 */
typedef struct blik_plane_scene blik_plane_scene;

/**
 * A solved plane scene in memory. Any number of threads may use it at once.
 */
typedef struct blik_plane_solution blik_plane_solution;

/**
 * A scene in memory. Read-only once made: any number of threads may use it at once.
 */
typedef struct blik_scene blik_scene;

/**
 * A solved scene in memory. Read-only once made: any number of threads may use it at once.
 */
typedef struct blik_solution blik_solution;

/**
 * What is wrong with a refused call. Written where a call is refused and the pointer to it is not null; nothing has
 * to be set before.
 */
typedef struct blik_error {
    /**
     * The status that the call returned.
     */
    int32_t status;
    /**
     * The field that it is about, one of `BLIK_FIELD_*`.
     */
    int32_t field;
    /**
     * Index of the facet, vertex, normal or material that it is about; else 0.
     */
    size_t index;
    /**
     * Spectral band; else 0.
     */
    size_t band;
    /**
     * The offending value; else 0.
     */
    double value;
    /**
     * Bytes or entries needed, or the limit; else 0.
     */
    size_t needed;
    /**
     * Bytes or entries given; else 0.
     */
    size_t given;
} blik_error;

/**
 * What decides the coupling besides the scene. Set by blik_settings_init first.
 */
typedef struct blik_settings {
    /**
     * Set by the init function.
     */
    size_t struct_size;
    /**
     * The wanted error of an image, eq. 16 of the paper, relative to the reference radiance: 1e-6 to 0.1; default
     * 2e-3.
     */
    double tolerance;
    /**
     * Light reflected more often does not count; below 0 (default): by tolerance.
     */
    int32_t max_bounces;
    /**
     * Not 0: irradiance of all facets is wanted, also of those that reflect nothing diffusely; default 0.
     */
    int32_t all_irradiances;
    /**
     * Not 0 (default): any sky can light the scene without new rays; 0: uniform skies only, in less memory, and in
     * closed form, sooner and more exactly, where nothing is hidden.
     */
    int32_t directional;
    /**
     * Not 0: where the caller's memory is too small for the rows, their rays are halved until it is not; what that costs
     * is in the report's error estimate. Default 0: the call is refused and tells the bytes that it would need.
     */
    int32_t fit_memory;
    /**
     * Most rays that rows may send, those by way of mirrors not counted, but for 64 a row at least; 0 (default): as many
     * as the tolerance needs. What fewer cost is in the report's error estimate. It is a budget of time, too: coupling
     * goes on at a steady number of rays a second.
     */
    uint64_t ray_budget;
    /**
     * 0 (default), or 1e-6 to 0.1. Where it is above 0 and below the tolerance, that is the solution's alone, and this the
     * wanted error of images: rays from the points that an image shows find what a solution lacks that is there sooner. For
     * few images of little error, which take longer each. No such rays are sent without the standard library, nor where
     * `max_bounces` is given, or lobes or curved mirrors throw sunlight: the report's error estimate tells. Baked blocks do
     * not keep it.
     */
    double image_tolerance;
} blik_settings;

/**
 * One task of a stage: to be called once with each index, on any thread.
 */
typedef void (*blik_task)(void *context, size_t index);

/**
 * Calls `task(context, i)` once for each i in 0 .. `count`, in any order, on any threads, and returns when all have
 * returned.
 */
typedef void (*blik_parallel)(void *user, size_t count, blik_task task, void *context);

/**
 * Told the share (0 to 1) of a stage that is done, never by two threads at once; not 0 asks the stage to stop, which
 * then returns `BLIK_ERROR_CANCELLED`.
 */
typedef int32_t (*blik_progress)(void *user, double done);

/**
 * How a long stage runs. Set by blik_run_init first; a null pointer to it stands for its defaults. The results
 * do not depend on it.
 */
typedef struct blik_run {
    /**
     * Set by the init function.
     */
    size_t struct_size;
    /**
     * Runs tasks on threads of the caller; null (default): the calling thread alone.
     */
    blik_parallel parallel;
    /**
     * Handed to `parallel`.
     */
    void *parallel_user;
    /**
     * Tasks that `parallel` is given at once, 1 to 256: as many as there are threads; default 1.
     */
    size_t lanes;
    /**
     * Told the progress; null (default): nobody.
     */
    blik_progress progress;
    /**
     * Handed to `progress`.
     */
    void *progress_user;
} blik_run;

/**
 * Numbers of a coupling.
 */
typedef struct blik_coupling_info {
    /**
     * Elements that the facets are cut into.
     */
    size_t elements;
    /**
     * Sides of elements: rows of the coupling.
     */
    size_t unknowns;
    /**
     * Form factors kept.
     */
    uint64_t pairs;
    /**
     * Rows that nothing needs: of degenerate facets, or of facets that reflect nothing diffusely.
     */
    uint64_t skipped_rows;
    /**
     * Rows that see the sky alone: no ray was traced.
     */
    uint64_t open_rows;
    /**
     * Rays traced.
     */
    uint64_t rays;
    /**
     * Largest weight of mirror chains that were cut, as a share of the hemisphere: a bound.
     */
    double dropped;
    /**
     * Bytes in use. Of a coupling that blik_coupling_init made: from the start of its memory, the rest of which is
     * free again.
     */
    size_t bytes;
} blik_coupling_info;

/**
 * A ray for blik_closest_hits and blik_any_hits, in the mesh's coordinates.
 */
typedef struct blik_ray {
    /**
     * Where it starts.
     */
    double origin[3];
    /**
     * Unit vector along it.
     */
    double direction[3];
    /**
     * Hits at this distance and beyond do not count; infinity for no limit.
     */
    double t_max;
    /**
     * Index of the facet that it leaves and never hits; `BLIK_NO_FACET` for none.
     */
    uint32_t skip;
} blik_ray;

/**
 * Finds the first facet that each of `count` rays meets: their indices, or `BLIK_NO_FACET`, to `facets`. The facet
 * `skip` of a ray and what lies at `t_max` or beyond do not count. Called by any number of threads at once.
 */
typedef void (*blik_first_facets)(void *user, const struct blik_ray *rays, size_t count, uint32_t *facets);

/**
 * Finds whether each of `count` rays meets any facet, as blik_first_facets does: not 0 or 0, to `hits`.
 */
typedef void (*blik_any_facets)(void *user, const struct blik_ray *rays, size_t count, uint8_t *hits);

/**
 * A ray tracer of the caller's over the mesh of a scene. Set by blik_intersector_init first.
 */
typedef struct blik_intersector {
    /**
     * Set by the init function.
     */
    size_t struct_size;
    /**
     * Finds first facets; must not be null.
     */
    blik_first_facets first_facets;
    /**
     * Finds whether there is any; null (default): by `first_facets`.
     */
    blik_any_facets any_facets;
    /**
     * Handed to both.
     */
    void *user;
} blik_intersector;

/**
 * Numbers of a plane coupling.
 */
typedef struct blik_plane_coupling_info {
    /**
     * Unknowns: rows.
     */
    size_t unknowns;
    /**
     * Rows kept for each unknown: one for each number of reflections that is told apart.
     */
    size_t classes;
    /**
     * Rows that see something of the object.
     */
    size_t coupled_rows;
    /**
     * Rays traced.
     */
    uint64_t rays;
    /**
     * Largest share of the brightest light that chains of a row could still have brought which were cut: a bound.
     */
    double dropped;
    /**
     * Bytes in use.
     */
    size_t bytes;
} blik_plane_coupling_info;

/**
 * A body of the plane model: a circle, or segments whose fronts are on the right of their direction (counter-clockwise
 * for a solid body, clockwise for a cavity) and whose backs are black and opaque. Bodies touch at most in corners. Set
 * by blik_plane_body_init first.
 */
typedef struct blik_plane_body {
    /**
     * `BLIK_PLANE_*`; default a circle.
     */
    int32_t shape;
    /**
     * Not 0: the segments stand for a smooth curve, whose normals and radiance are interpolated; default 0.
     */
    int32_t smooth;
    /**
     * Index of the material; default 0.
     */
    uint32_t material;
    /**
     * Elements of the circle, or of each segment, 1 to 2^20; default 1.
     */
    uint32_t elements;
    /**
     * Centre of a circle.
     */
    double centre[2];
    /**
     * Radius of a circle, positive; default 1.
     */
    double radius;
    /**
     * Two numbers a point; not read for a circle.
     */
    const double *points;
    /**
     * At least 2 of a polyline, 3 of a polygon, whose first is not repeated.
     */
    size_t point_count;
} blik_plane_body;

/**
 * Reflectances of a body of the plane model. Set by blik_plane_material_init first.
 */
typedef struct blik_plane_material {
    /**
     * Diffuse reflectance, in [0, 1]; default 0.
     */
    double diffuse;
    /**
     * Mirror reflectance, in [0, 1], diffuse + specular <= 1; with gloss the lobe's albedo at normal view; default 0.
     */
    double specular;
    /**
     * 0 (default): an ideal mirror; else long over short axis of the lobe, >= 1 (1e4 and above: an ideal mirror).
     */
    double gloss_axis_ratio;
    /**
     * Full angle between the side rays of the paper's three, radians, 0 to 3.2.
     */
    double spacing;
    /**
     * `BLIK_PLANE_RAYS_*`: how rays stand for the lobe; default AUTO.
     */
    int32_t ray_set;
    /**
     * Rays of GAUSS, EQUAL and SPLIT at the first lobe of a path, at the second, and later: 1 to 4096.
     */
    uint32_t rays[3];
} blik_plane_material;

/**
 * What a plane scene is made of. Set by blik_plane_bodies_init first. Read during the call only.
 */
typedef struct blik_plane_bodies {
    /**
     * Set by the init function.
     */
    size_t struct_size;
    /**
     * The bodies, at least one.
     */
    const struct blik_plane_body *bodies;
    /**
     * Number of bodies.
     */
    size_t body_count;
    /**
     * Bytes from one body to the next; set by the init function.
     */
    size_t body_stride;
    /**
     * The materials, at least one.
     */
    const struct blik_plane_material *materials;
    /**
     * Number of materials.
     */
    size_t material_count;
    /**
     * Bytes from one material to the next; set by the init function.
     */
    size_t material_stride;
} blik_plane_bodies;

/**
 * How a plane scene is solved. Set by blik_plane_settings_init first: all but the tolerance follows from it.
 */
typedef struct blik_plane_settings {
    /**
     * Set by the init function.
     */
    size_t struct_size;
    /**
     * Wanted error relative to the sky, 1e-13 to 0.1, on bodies that are cut finely enough (a circle of 12 elements at
     * 1e-4, 16 at 1e-5); default 1e-4.
     */
    double tolerance;
    /**
     * How the diffuse radiance varies, `BLIK_PLANE_AUTO` (default), `_CONSTANT`, `_LINEAR` or `_PANELS`.
     */
    int32_t basis;
    /**
     * Gauss points of an element, 1 to 6, where `basis` is PANELS.
     */
    uint32_t order;
    /**
     * How rows are integrated, `BLIK_PLANE_AUTO` (default), `_FACETS` or `_SPLIT`.
     */
    int32_t method;
    /**
     * Nodes or chains of the method, up to 4096, where that is not AUTO.
     */
    uint32_t points;
    /**
     * Light reflected more often does not count, 1 to 64; below 0 (default): by `cutoff`.
     */
    int32_t max_bounces;
    /**
     * Chains end where their mirrors leave less than this share, up to 1; below 0 (default): by tolerance.
     */
    double cutoff;
    /**
     * Bound on the solver's error relative to the brightest light, up to 1; below 0 (default): by tolerance.
     */
    double solver;
} blik_plane_settings;

/**
 * Numbers of a plane scene.
 */
typedef struct blik_plane_scene_info {
    /**
     * Bodies.
     */
    size_t bodies;
    /**
     * Circles and segments.
     */
    size_t primitives;
    /**
     * Unknowns of the linear system.
     */
    size_t unknowns;
    /**
     * Bytes in use.
     */
    size_t bytes;
} blik_plane_scene_info;

/**
 * A ray for blik_plane_first_hits and blik_plane_radiance.
 */
typedef struct blik_plane_ray {
    /**
     * Where it starts.
     */
    double origin[2];
    /**
     * Unit vector along it.
     */
    double direction[2];
} blik_plane_ray;

/**
 * Where a ray of the plane meets a body first.
 */
typedef struct blik_plane_hit {
    /**
     * The point; (0, 0) where nothing is met.
     */
    double point[2];
    /**
     * Unit normal of the front.
     */
    double normal[2];
    /**
     * Circle or segment, counted over all bodies; `BLIK_NO_FACET` where nothing is met.
     */
    uint32_t primitive;
    /**
     * 1 where its front is met.
     */
    int32_t front;
} blik_plane_hit;

/**
 * Radiance that arrives from the direction (x, y), a unit vector away from the object: finite, 0 to 1e37. Called by any
 * number of threads at once.
 */
typedef double (*blik_plane_radiance_of)(void *user, double x, double y);

/**
 * The sky of a plane scene. Set by blik_plane_sky_init first.
 */
typedef struct blik_plane_sky {
    /**
     * Set by the init function.
     */
    size_t struct_size;
    /**
     * Radiance from everywhere where `radiance_of` is null; default 1.
     */
    double radiance;
    /**
     * Radiance by direction; null (default): `radiance`. It must not throw, and is in use as long as the solution.
     */
    blik_plane_radiance_of radiance_of;
    /**
     * Handed to `radiance_of`.
     */
    void *user;
    /**
     * Directions, two numbers each, at which `radiance_of` jumps or bends; copied.
     */
    const double *jumps;
    /**
     * At most `BLIK_PLANE_MAX_JUMPS`.
     */
    size_t jump_count;
} blik_plane_sky;

/**
 * A point sun of a plane scene. Set by blik_plane_sun_init first.
 */
typedef struct blik_plane_sun {
    /**
     * Set by the init function.
     */
    size_t struct_size;
    /**
     * Toward the sun, of any length but zero; default (0, 1).
     */
    double direction[2];
    /**
     * Irradiance of a surface that faces it, radiance times angle; default 2, which gives a white one the radiance 1.
     */
    double irradiance;
    /**
     * The paper's cone: rays that leave the object after a mirror within this angle of the sun see it, radians up to
     * 1.5. 0 (default): lobes are evaluated at the sun's direction, and ideal mirrors do not show it.
     */
    double capture_half_angle;
    /**
     * Radiance that such rays see; below 0 (default): the one that keeps the energy, irradiance over the cone's width.
     */
    double capture_radiance;
} blik_plane_sun;

/**
 * The light of a plane scene. Set by blik_plane_light_init first. Read during the call only.
 */
typedef struct blik_plane_light {
    /**
     * Set by the init function.
     */
    size_t struct_size;
    /**
     * The sky; null (default): none.
     */
    const struct blik_plane_sky *sky;
    /**
     * The sun; null (default): none.
     */
    const struct blik_plane_sun *sun;
} blik_plane_light;

/**
 * Numbers of a plane solution.
 */
typedef struct blik_plane_solution_info {
    /**
     * Contraction of a sweep over the linear system.
     */
    double contraction;
    /**
     * Bound on the solver's error of all radiances: certain where the contraction is below 1, else by the sweeps' decay.
     */
    double solver_error;
    /**
     * Sweeps made.
     */
    uint32_t sweeps;
    /**
     * Bytes in use.
     */
    size_t bytes;
} blik_plane_solution_info;

/**
 * What a ray of the plane brings.
 */
typedef struct blik_plane_sample {
    /**
     * Place of an image's sample, along the direction that is clockwise of the view; 0 of blik_plane_radiance.
     */
    double abscissa;
    /**
     * Radiance: the sky's where nothing is met.
     */
    double radiance;
    /**
     * Bound on the light that chains could still have brought which were cut, as a share of the brightest.
     */
    double chain_tail;
    /**
     * Rays traced.
     */
    uint32_t rays;
    /**
     * 1 where the ray meets the object.
     */
    int32_t object;
} blik_plane_sample;

/**
 * An unknown of a plane solution.
 */
typedef struct blik_plane_unknown {
    /**
     * Where it stands.
     */
    double point[2];
    /**
     * Unit normal of the surface there.
     */
    double normal[2];
    /**
     * Diffuse radiance without the sun's direct part.
     */
    double radiance;
    /**
     * Circle or segment, counted over all bodies.
     */
    uint32_t primitive;
} blik_plane_unknown;

/**
 * A part of what a point of the plane sees.
 */
typedef struct blik_plane_span {
    /**
     * Sine of the angle to the normal at which it begins, counter-clockwise positive.
     */
    double from;
    /**
     * Sine at which it ends: half the difference is its form factor.
     */
    double to;
    /**
     * The circle or segment that is seen, `BLIK_NO_FACET` for the sky.
     */
    uint32_t primitive;
} blik_plane_span;

/**
 * Closed forms of the lobe in the plane, for a specular reflectance of 1.
 */
typedef struct blik_plane_lobe {
    /**
     * Share of light from everywhere that it mirrors toward the view: 1 at normal view, 1/2 at grazing.
     */
    double albedo;
    /**
     * Its value per radian at the angle from the mirror direction.
     */
    double value;
    /**
     * Width of a top hat of its peak and visible energy, radians, eq. (19).
     */
    double equivalent_width;
    /**
     * Mean of the albedo over the angle of incidence, eq. (17).
     */
    double mean_albedo;
    /**
     * Mean of the albedo weighed by the cosine.
     */
    double cosine_mean_albedo;
} blik_plane_lobe;

/**
 * What was done on rows of an image; tallies of all its rows add up by blik_tally_add.
 */
typedef struct blik_tally {
    /**
     * Pixels whose centre ray meets the object.
     */
    uint64_t object_pixels;
    /**
     * Rays through pixels.
     */
    uint64_t primary_rays;
    /**
     * Rays of chains and toward the sun.
     */
    uint64_t chain_rays;
    /**
     * Pixels sampled more than once.
     */
    uint64_t refined_pixels;
    /**
     * Sum over object pixels of the squared expected error from the diffuse solution.
     */
    double noise_squared;
    /**
     * The same of the error from sampling the pixel's area.
     */
    double sampling_squared;
    /**
     * Largest bound on what cut chains could still have brought.
     */
    double chain_tail;
} blik_tally;

/**
 * What comes back with an image.
 */
typedef struct blik_report {
    /**
     * The wanted error, of the solution where images have one of their own.
     */
    double tolerance;
    /**
     * Expected error of the image (eps of eq. 16), relative to the reference radiance.
     */
    double error_estimate;
    /**
     * Certain bound on the distance of the radiances from the solution of the discrete system.
     */
    double certified_solver;
    /**
     * Certain bound on what chains that were cut could still have brought to a pixel.
     */
    double certified_chain_tail;
    /**
     * Certain bound on the weight of couplings that were cut, as a share of the hemisphere.
     */
    double certified_dropped;
    /**
     * Rays that coupling traced.
     */
    uint64_t visibility_rays;
    /**
     * Rays toward the sun, and of the beams that mirrors throw.
     */
    uint64_t sun_rays;
    /**
     * Rays through pixels.
     */
    uint64_t primary_rays;
    /**
     * Rays of specular chains and toward the sun from what pixels see.
     */
    uint64_t chain_rays;
    /**
     * Form factors kept.
     */
    uint64_t pairs;
    /**
     * Rows of the coupling that nothing needed.
     */
    uint64_t skipped_rows;
    /**
     * Rows of the coupling that see the sky alone.
     */
    uint64_t open_rows;
    /**
     * Elements.
     */
    size_t elements;
    /**
     * Bytes of the scene, of the coupling and of the solution.
     */
    size_t bytes;
    /**
     * Sweeps over the linear system.
     */
    uint32_t sweeps;
    /**
     * 1 where the estimate is at most the wanted error of images.
     */
    int32_t tolerance_met;
    /**
     * The largest part of the estimate, `BLIK_LIMIT_*`.
     */
    int32_t limited_by;
} blik_report;

/**
 * An array as the caller keeps it: entries `stride` bytes apart, each of as many numbers as its use needs, packed.
 * `count` 0: absent.
 */
typedef struct blik_array {
    /**
     * First entry, aligned as its numbers need; not read when `count` is 0.
     */
    const void *data;
    /**
     * Number of entries.
     */
    size_t count;
    /**
     * Bytes from one entry to the next; 0: the size of an entry.
     */
    size_t stride;
    /**
     * `BLIK_F32`, `BLIK_F64`, `BLIK_U8`, `BLIK_U16`, `BLIK_U32` or `BLIK_U64`.
     */
    int32_t format;
} blik_array;

/**
 * Reflectances and emission of one material, one value per band each; a null pointer stands for zeros.
 */
typedef struct blik_material {
    /**
     * Diffuse reflectance, in [0, 1].
     */
    const double *diffuse;
    /**
     * Mirror reflectance, in [0, 1]; diffuse + specular <= 1. With gloss: the lobe's albedo at normal view.
     */
    const double *specular;
    /**
     * Own diffuse radiance, >= 0, W m-2 sr-1.
     */
    const double *emission;
    /**
     * 0: an ideal mirror; else long over short axis of the lobe, >= 1 (1e4 and above: an ideal mirror).
     */
    double gloss_axis_ratio;
    /**
     * Rays at the first hit of the lobe, up to 65536; 0: by tolerance.
     */
    uint32_t gloss_rays;
} blik_material;

/**
 * A mesh with its materials. Set by blik_mesh_init first. Read during the call only.
 */
typedef struct blik_mesh {
    /**
     * Set by the init function.
     */
    size_t struct_size;
    /**
     * Positions: three `BLIK_F64` or `BLIK_F32` each, in any unit and at any offset.
     */
    struct blik_array vertices;
    /**
     * Three vertex indices (`BLIK_U8` to `BLIK_U64`) a facet, counter-clockwise seen from the front.
     */
    struct blik_array facets;
    /**
     * Material of each facet (`BLIK_U8` to `BLIK_U64`); absent: all 0.
     */
    struct blik_array facet_materials;
    /**
     * Normals for interpolated mirror directions, three `BLIK_F64` or `BLIK_F32` each; absent: mirrors are flat.
     */
    struct blik_array normals;
    /**
     * Three normal indices a facet (`BLIK_U32` or `BLIK_U64`), all bits set for none; absent: as `facets`.
     */
    struct blik_array facet_normals;
    /**
     * The materials.
     */
    const struct blik_material *materials;
    /**
     * Number of materials, at least 1.
     */
    size_t material_count;
    /**
     * Bytes from one material to the next; set by the init function.
     */
    size_t material_stride;
    /**
     * Spectral bands, 1 to 64; default 1.
     */
    size_t bands;
    /**
     * Not 0: both sides carry material and emission; default 0: backs are black and opaque.
     */
    int32_t two_sided;
} blik_mesh;

/**
 * Numbers of a scene.
 */
typedef struct blik_scene_info {
    /**
     * Facets, degenerate ones included.
     */
    size_t facets;
    /**
     * Facets of no area: they keep their index and take no part.
     */
    size_t degenerate_facets;
    /**
     * Materials.
     */
    size_t materials;
    /**
     * Spectral bands.
     */
    size_t bands;
    /**
     * Sides of a facet that carry its material: 1 or 2.
     */
    size_t sides;
    /**
     * Bytes in use.
     */
    size_t bytes;
} blik_scene_info;

/**
 * Where a ray meets the mesh first.
 */
typedef struct blik_hit {
    /**
     * Distance along the ray in the mesh's unit; infinity where it meets nothing.
     */
    double t;
    /**
     * Barycentric weight of the facet's second corner.
     */
    double u;
    /**
     * Barycentric weight of the facet's third corner.
     */
    double v;
    /**
     * Index of the facet, or `BLIK_NO_FACET`.
     */
    uint32_t facet;
    /**
     * 1 where it meets the side on which the corners run counter-clockwise.
     */
    int32_t front;
} blik_hit;

/**
 * A sky. Set by blik_sky_init first. Read during the call only: its arrays are copied.
 */
typedef struct blik_sky {
    /**
     * Set by the init function.
     */
    size_t struct_size;
    /**
     * `BLIK_SKY_*`; default uniform.
     */
    int32_t model;
    /**
     * 1 to 15: the type of a CIE sky; default 1.
     */
    uint32_t cie_type;
    /**
     * Radiance per band as the model uses it (for a table a factor), W m-2 sr-1; null (default): 1.
     */
    const double *radiance;
    /**
     * Radiance below the horizon per band; null (default): 0.
     */
    const double *ground;
    /**
     * Toward the zenith, of any length but zero; default (0, 0, 1).
     */
    double up[3];
    /**
     * Toward the sun of a CIE sky, above the horizon.
     */
    double sun_direction[3];
    /**
     * Samples of a table: `table_rows` x `table_columns` x `table_bands`, row by row from the zenith down, columns
     * counter-clockwise seen from above; bilinear between the centres.
     */
    const float *table;
    /**
     * Steps of elevation.
     */
    size_t table_rows;
    /**
     * Steps of azimuth.
     */
    size_t table_columns;
    /**
     * 1, or the scene's number of bands; default 1.
     */
    size_t table_bands;
    /**
     * Azimuth 0 of a table, projected off `up`; zeros (default): (1, 0, 0), or (0, 1, 0) where that is up.
     */
    double table_azimuth_zero[3];
} blik_sky;

/**
 * The sun. Set by blik_sun_init first. Read during the call only.
 */
typedef struct blik_sun {
    /**
     * Set by the init function.
     */
    size_t struct_size;
    /**
     * Toward the centre of the sun, of any length but zero; default (0, 0, 1).
     */
    double direction[3];
    /**
     * Irradiance per band of an unshaded plane that faces the sun, W m-2; null (default): pi.
     */
    const double *irradiance;
    /**
     * Angular radius in degrees: 0 (a point) or 1e-4 to 10; default 0.2665.
     */
    double half_angle_deg;
} blik_sun;

/**
 * The light of a scene. Set by blik_light_init first. Read during the call only.
 */
typedef struct blik_light {
    /**
     * Set by the init function.
     */
    size_t struct_size;
    /**
     * The sky; null (default): none.
     */
    const struct blik_sky *sky;
    /**
     * The sun; null (default): none.
     */
    const struct blik_sun *sun;
    /**
     * The radiance per band to which errors are related; null (default): from the light.
     */
    const double *reference_radiance;
} blik_light;

/**
 * A camera. Set by blik_camera_init first. Row 0 is the top; nothing before the eye is seen.
 */
typedef struct blik_camera {
    /**
     * Set by the init function.
     */
    size_t struct_size;
    /**
     * `BLIK_ORTHOGRAPHIC` (default) or `BLIK_PERSPECTIVE`.
     */
    int32_t projection;
    /**
     * `BLIK_SAMPLE_AREA` (default) or `BLIK_SAMPLE_CENTRE`.
     */
    int32_t sampling;
    /**
     * Position of the eye, in the mesh's coordinates.
     */
    double eye[3];
    /**
     * The point in the image's middle.
     */
    double target[3];
    /**
     * What is up in the image; default (0, 0, 1).
     */
    double up[3];
    /**
     * Orthographic: height of the image in the mesh's unit.
     */
    double height;
    /**
     * Perspective: vertical field of view in degrees.
     */
    double fov_deg;
    /**
     * Pixels across, 1 to 65536.
     */
    size_t columns;
    /**
     * Pixels down, 1 to 65536.
     */
    size_t rows;
} blik_camera;

/**
 * What a distant observer measures in one direction and band.
 */
typedef struct blik_signature {
    /**
     * Radiant intensity toward the observer, W/sr.
     */
    double radiant_intensity;
    /**
     * Area of the object's projection, in the square of the mesh's unit.
     */
    double projected_area;
    /**
     * Radiant intensity over projected area; 0 where nothing is seen.
     */
    double mean_radiance;
    /**
     * Radiance of the sky behind.
     */
    double background;
    /**
     * (mean radiance - background)/background; 0 where the background is 0.
     */
    double contrast;
    /**
     * What the radiant intensity is expected to be wrong by, W/sr.
     */
    double error;
    /**
     * Glints that may lie between cells, or be met by chance and count too much: what they bring on the mean, W/sr; not
     * among the error.
     */
    double unresolved_glints;
} blik_signature;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/**
 * Version of the library that is linked, as `major * 10000 + minor * 100 + patch`; `BLIK_VERSION` is that of
 * the header. May be called by any number of threads at once.
 */
uint32_t blik_version(void);

/**
 * Bytes of the block that blik_bake writes.
 */
int32_t blik_bake_size(const struct blik_coupling *coupling,
                       const struct blik_solution *solution,
                       struct blik_error *error,
                       size_t *bytes);

/**
 * Writes scene, tree, coupling and, where it is not null, a solution of this coupling as one relocatable block, with
 * version, byte order, size and checksum, to `block`, which starts on a boundary of `BLIK_BLOCK_ALIGNMENT`.
 */
int32_t blik_bake(const struct blik_coupling *coupling,
                  const struct blik_solution *solution,
                  void *block,
                  size_t size,
                  struct blik_error *error);

/**
 * Bytes of memory that blik_load needs for the handles of a block: some hundred, and some for each part of the
 * coupling. Only the block's head is read.
 */
int32_t blik_load_size(const void *block,
                       size_t size,
                       struct blik_error *error,
                       size_t *bytes);

/**
 * Checks the block in `block` from end to end and makes handles over it, in `memory`; the block itself is read where
 * it stands (read-only memory will do) for as long as the handles are in use. `*solution` becomes null where the block
 * has none. A block that is damaged or hostile is refused by `BLIK_ERROR_BLOCK`.
 */
int32_t blik_load(const void *block,
                  size_t size,
                  void *memory,
                  size_t memory_size,
                  struct blik_error *error,
                  const struct blik_scene **scene,
                  const struct blik_coupling **coupling,
                  const struct blik_solution **solution);

/**
 * Bytes of memory with which blik_coupling_init can begin. The rows' own part is not known before: where it does
 * not fit, the call returns `BLIK_ERROR_BUFFER_TOO_SMALL` and `error->needed` says how many bytes probably do.
 */
int32_t blik_coupling_size(const struct blik_scene *scene,
                           const struct blik_settings *settings,
                           struct blik_error *error,
                           size_t *bytes);

/**
 * Computes the coupling of a scene in the caller's memory: once for a mesh and its materials, whatever the light.
 *
 * With `run` the rows are computed on the caller's threads, each in its part of the memory. The scene must outlive
 * the coupling.
 */
int32_t blik_coupling_init(const struct blik_scene *scene,
                           const struct blik_settings *settings,
                           const struct blik_run *run,
                           void *memory,
                           size_t size,
                           struct blik_error *error,
                           const struct blik_coupling **coupling);

#if defined(BLIK_STD)
/**
 * Computes the coupling of a scene in memory of its own; to be ended by blik_coupling_destroy. The scene must
 * outlive it.
 */
int32_t blik_coupling_create(const struct blik_scene *scene,
                             const struct blik_settings *settings,
                             const struct blik_run *run,
                             struct blik_error *error,
                             struct blik_coupling **coupling);
#endif

/**
 * Ends a coupling and frees what it owns; nothing for null. Solutions made from it must have ended before.
 */
void blik_coupling_destroy(struct blik_coupling *coupling);

/**
 * Numbers of a coupling; reads all of it.
 */
int32_t blik_coupling_get_info(const struct blik_coupling *coupling,
                               struct blik_error *error,
                               struct blik_coupling_info *info);

/**
 * Form factor from a point with a normal to a convex planar polygon, nothing in the way: the share that it fills of
 * the point's cosine-weighted hemisphere. Corners are three numbers each, in order.
 */
int32_t blik_form_factor_point(const double *point,
                               const double *normal,
                               const double *polygon,
                               size_t polygon_corners,
                               struct blik_error *error,
                               double *factor);

/**
 * Form factor from one convex planar polygon to another, nothing in the way, and their exchange area (area of the
 * first times the factor; the same bits for both orders). Only the sides from which the corners run
 * counter-clockwise see each other. `exchange_area` may be null.
 */
int32_t blik_form_factor_polygon(const double *from,
                                 size_t from_corners,
                                 const double *polygon,
                                 size_t polygon_corners,
                                 struct blik_error *error,
                                 double *factor,
                                 double *exchange_area);

/**
 * Bytes of scratch memory for blik_form_factor_visible with so many convex pieces of the visible part: each
 * occluder cuts every piece that its outline crosses into at most four.
 */
size_t blik_form_factor_scratch_size(size_t pieces);

/**
 * Form factor from one convex planar polygon to what of another the opaque triangles `occluders` (nine numbers each)
 * leave visible, to an absolute `tolerance` > 0, and its expected error. `error_estimate` may be null.
 */
int32_t blik_form_factor_visible(const double *from,
                                 size_t from_corners,
                                 const double *polygon,
                                 size_t polygon_corners,
                                 const double *occluders,
                                 size_t occluder_count,
                                 double tolerance,
                                 void *scratch,
                                 size_t scratch_size,
                                 struct blik_error *error,
                                 double *factor,
                                 double *error_estimate);

/**
 * The lobe of a glossy material with `gloss_axis_ratio`, for a specular reflectance of 1: what share of light from
 * everywhere it mirrors toward a view whose angle with the normal has the cosine `cos_view` (`albedo`, at most 1), and
 * its value in sr-1 at an angle of cosine `cos_off` from the mirror direction. Either output may be null.
 */
int32_t blik_gloss(double gloss_axis_ratio,
                   double cos_view,
                   double cos_off,
                   struct blik_error *error,
                   double *albedo,
                   double *value);

/**
 * Sets the defaults; does nothing with a null pointer.
 */
void blik_intersector_init(struct blik_intersector *intersector);

/**
 * Has rays traced by the caller's tracer, or, with a null pointer, by the library again. To be called while nobody else
 * uses the scene, which keeps a copy; its functions must not throw and are in use as long as the scene.
 *
 * Facets alone are taken from the tracer; where on them rays arrive is computed anew, and where a ray does not meet the
 * facet that was named, the library finds the right one. Images are the same bits where the tracer names the same facets.
 * Rays come up to 32 at once (8 without the standard library) where none depends on what another meets (the first rays of
 * form factors, of elements and of pixels, and those from elements toward the sun), else one by one (chains by way of
 * mirrors).
 */
int32_t blik_scene_set_intersector(const struct blik_scene *scene,
                                   const struct blik_intersector *intersector,
                                   struct blik_error *error);

/**
 * Bytes of memory with which blik_plane_coupling_init keeps all lanes of `run` busy; less is for fewer lanes.
 */
int32_t blik_plane_coupling_size(const struct blik_plane_scene *scene,
                                 const struct blik_run *run,
                                 struct blik_error *error,
                                 size_t *bytes);

/**
 * Computes the extended form factors of all unknowns of a plane scene, eq. (12), in the caller's memory: once for its
 * bodies and materials, whatever the light. The scene must outlive the coupling.
 */
int32_t blik_plane_coupling_init(const struct blik_plane_scene *scene,
                                 const struct blik_run *run,
                                 void *memory,
                                 size_t size,
                                 struct blik_error *error,
                                 const struct blik_plane_coupling **coupling);

#if defined(BLIK_STD)
/**
 * As blik_plane_coupling_init, in memory of its own; to be ended by blik_plane_coupling_destroy.
 */
int32_t blik_plane_coupling_create(const struct blik_plane_scene *scene,
                                   const struct blik_run *run,
                                   struct blik_error *error,
                                   struct blik_plane_coupling **coupling);
#endif

/**
 * Ends a plane coupling and frees what it owns; nothing for null. Solutions made from it must have ended before.
 */
void blik_plane_coupling_destroy(struct blik_plane_coupling *coupling);

/**
 * Numbers of a plane coupling.
 */
int32_t blik_plane_coupling_get_info(const struct blik_plane_coupling *coupling,
                                     struct blik_error *error,
                                     struct blik_plane_coupling_info *info);

/**
 * Rows `first` .. `first + count`: to `factors` for each row and class the extended form factors toward all unknowns, to
 * `open` for each row and class what shows the sky. Either may be null.
 */
int32_t blik_plane_coupling_get_rows(const struct blik_plane_coupling *coupling,
                                     size_t first,
                                     size_t count,
                                     struct blik_error *error,
                                     double *factors,
                                     double *open);

/**
 * Bytes of memory that blik_plane_scene_init needs for these bodies, at any address.
 */
int32_t blik_plane_scene_size(const struct blik_plane_bodies *bodies,
                              struct blik_error *error,
                              size_t *bytes);

/**
 * Checks bodies and settings and makes a plane scene of them in the caller's memory.
 */
int32_t blik_plane_scene_init(const struct blik_plane_bodies *bodies,
                              const struct blik_plane_settings *settings,
                              void *memory,
                              size_t size,
                              struct blik_error *error,
                              const struct blik_plane_scene **scene);

#if defined(BLIK_STD)
/**
 * As blik_plane_scene_init, in memory of its own; to be ended by blik_plane_scene_destroy.
 */
int32_t blik_plane_scene_create(const struct blik_plane_bodies *bodies,
                                const struct blik_plane_settings *settings,
                                struct blik_error *error,
                                struct blik_plane_scene **scene);
#endif

/**
 * Ends a plane scene and frees what it owns; nothing for null. Couplings made from it must have ended before.
 */
void blik_plane_scene_destroy(struct blik_plane_scene *scene);

/**
 * Numbers of a plane scene.
 */
int32_t blik_plane_scene_get_info(const struct blik_plane_scene *scene,
                                  struct blik_error *error,
                                  struct blik_plane_scene_info *info);

/**
 * The first circle or segment that each of `count` rays meets.
 */
int32_t blik_plane_first_hits(const struct blik_plane_scene *scene,
                              const struct blik_plane_ray *rays,
                              size_t count,
                              struct blik_error *error,
                              struct blik_plane_hit *hits);

/**
 * Bytes of memory with which blik_plane_solution_init keeps all lanes of `run` busy; less is for fewer lanes.
 */
int32_t blik_plane_solution_size(const struct blik_plane_coupling *coupling,
                                 const struct blik_plane_light *light,
                                 const struct blik_run *run,
                                 struct blik_error *error,
                                 size_t *bytes);

/**
 * Lights a plane scene and solves for its diffuse radiance in the caller's memory. The coupling must outlive the solution,
 * and so must the sky's function, which must return finite values from 0 to 1e37: a solution whose sky ever returned
 * another refuses that call and all later ones.
 */
int32_t blik_plane_solution_init(const struct blik_plane_coupling *coupling,
                                 const struct blik_plane_light *light,
                                 const struct blik_run *run,
                                 void *memory,
                                 size_t size,
                                 struct blik_error *error,
                                 const struct blik_plane_solution **solution);

#if defined(BLIK_STD)
/**
 * As blik_plane_solution_init, in memory of its own; to be ended by blik_plane_solution_destroy.
 */
int32_t blik_plane_solution_create(const struct blik_plane_coupling *coupling,
                                   const struct blik_plane_light *light,
                                   const struct blik_run *run,
                                   struct blik_error *error,
                                   struct blik_plane_solution **solution);
#endif

/**
 * Ends a plane solution and frees what it owns; nothing for null.
 */
void blik_plane_solution_destroy(struct blik_plane_solution *solution);

/**
 * Numbers of a plane solution.
 */
int32_t blik_plane_solution_get_info(const struct blik_plane_solution *solution,
                                     struct blik_error *error,
                                     struct blik_plane_solution_info *info);

/**
 * Sets the defaults; does nothing with a null pointer.
 */
void blik_plane_material_init(struct blik_plane_material *material);

/**
 * Sets the defaults; does nothing with a null pointer.
 */
void blik_plane_body_init(struct blik_plane_body *body);

/**
 * Sets the defaults; does nothing with a null pointer.
 */
void blik_plane_bodies_init(struct blik_plane_bodies *bodies);

/**
 * Sets the defaults; does nothing with a null pointer.
 */
void blik_plane_settings_init(struct blik_plane_settings *settings);

/**
 * Sets the defaults; does nothing with a null pointer.
 */
void blik_plane_sky_init(struct blik_plane_sky *sky);

/**
 * Sets the defaults; does nothing with a null pointer.
 */
void blik_plane_sun_init(struct blik_plane_sun *sun);

/**
 * Sets the defaults; does nothing with a null pointer.
 */
void blik_plane_light_init(struct blik_plane_light *light);

/**
 * Bytes of scratch memory with which blik_plane_image and blik_plane_radiance keep all lanes of `run` busy.
 */
int32_t blik_plane_scratch_size(const struct blik_plane_solution *solution,
                                const struct blik_run *run,
                                struct blik_error *error,
                                size_t *bytes);

/**
 * Samples `first` .. `first + count` of the orthographic image of a plane scene with `samples` across, seen from the
 * direction (sin `angle`, cos `angle`): samples are the centres of equal cells over the object's projection. However an
 * image is split into calls, its bits are the same.
 *
 * `scratch` is memory of blik_plane_scratch_size bytes, or less, for fewer lanes; with the standard library it may be
 * null, and is then taken from the heap. A call that is cancelled leaves part of the samples written.
 */
int32_t blik_plane_image(const struct blik_plane_solution *solution,
                         double angle,
                         size_t samples,
                         size_t first,
                         size_t count,
                         const struct blik_run *run,
                         void *scratch,
                         size_t scratch_size,
                         struct blik_error *error,
                         struct blik_plane_sample *out);

/**
 * Radiance against each of `count` rays, which start on no body. Scratch memory as for blik_plane_image.
 */
int32_t blik_plane_radiance(const struct blik_plane_solution *solution,
                            const struct blik_plane_ray *rays,
                            size_t count,
                            const struct blik_run *run,
                            void *scratch,
                            size_t scratch_size,
                            struct blik_error *error,
                            struct blik_plane_sample *out);

/**
 * Unknowns `first` .. `first + count` of a plane solution.
 */
int32_t blik_plane_get_unknowns(const struct blik_plane_solution *solution,
                                size_t first,
                                size_t count,
                                struct blik_error *error,
                                struct blik_plane_unknown *unknowns);

/**
 * Bytes of scratch memory for blik_plane_visible, and the most spans that it finds.
 */
int32_t blik_plane_visible_size(const struct blik_plane_scene *scene,
                                struct blik_error *error,
                                size_t *bytes,
                                size_t *most_spans);

/**
 * What a point with a normal (of any length but zero) sees of a plane scene, split at every silhouette: spans in the order
 * of rising sines. `skip` is the circle or segment on which the point is, or `BLIK_NO_FACET`. `capacity` entries of
 * `spans` are there; more are an error that tells how many.
 */
int32_t blik_plane_visible(const struct blik_plane_scene *scene,
                           const double *point,
                           const double *normal,
                           uint32_t skip,
                           void *scratch,
                           size_t scratch_size,
                           struct blik_error *error,
                           struct blik_plane_span *spans,
                           size_t capacity,
                           size_t *count);

/**
 * The lobe of a glossy material of the plane, seen at an angle to the normal of cosine `cos_view` in [0, 1], at `off`
 * radians from the mirror direction.
 */
int32_t blik_plane_gloss(double gloss_axis_ratio,
                         double cos_view,
                         double off,
                         struct blik_error *error,
                         struct blik_plane_lobe *lobe);

/**
 * The report of an image from the tally of all its rows; reads the whole coupling.
 */
int32_t blik_get_report(const struct blik_solution *solution,
                        const struct blik_tally *tally,
                        struct blik_error *error,
                        struct blik_report *report);

/**
 * Whether an image had better be computed again, to a finer tolerance: `report` is that of the last round, which was
 * number `rounds` (1 for the first), `before` that of the round before it, or null, and `asked` the wanted error. Writes the
 * tolerance of the next round's coupling, or 0 where the image is good enough, would hardly be better, would take too
 * much, or has had three rounds. With a null `report` it is the first round's: coarser than `asked` where that is little,
 * since rays from the image's points find the rest; `image_tolerance` of the settings is `asked` in every round. This is
 * what the program `render` and the Rust interface go by; an estimate of up to one and three quarters of the error asked
 * for passes, after a round coarser than that up to 1.35.
 */
int32_t blik_next_tolerance(const struct blik_report *report,
                            const struct blik_report *before,
                            double asked,
                            uint32_t rounds,
                            struct blik_error *error,
                            double *tolerance);

/**
 * Sets the defaults; does nothing with a null pointer.
 */
void blik_run_init(struct blik_run *run);

#if defined(BLIK_STD)
/**
 * A blik_parallel that starts `count` threads for each stage and waits for them; `user` is not looked at.
 */
void blik_run_on_threads(void *user, size_t count, blik_task task, void *context);
#endif

/**
 * Bytes of memory that blik_scene_init needs for this mesh, at any address.
 */
int32_t blik_scene_size(const struct blik_mesh *mesh, struct blik_error *error, size_t *bytes);

/**
 * Checks a mesh and makes a scene of it in the caller's memory, where it lives until that is used for something
 * else. The mesh is not needed afterwards.
 */
int32_t blik_scene_init(const struct blik_mesh *mesh,
                        void *memory,
                        size_t size,
                        struct blik_error *error,
                        const struct blik_scene **scene);

#if defined(BLIK_STD)
/**
 * Checks a mesh and makes a scene of it in memory of its own; to be ended by blik_scene_destroy.
 */
int32_t blik_scene_create(const struct blik_mesh *mesh, struct blik_error *error, struct blik_scene **scene);
#endif

/**
 * Ends a scene and frees what it owns; nothing for null. Couplings made from it must have ended before.
 */
void blik_scene_destroy(struct blik_scene *scene);

/**
 * Numbers of a scene.
 */
int32_t blik_scene_get_info(const struct blik_scene *scene,
                            struct blik_error *error,
                            struct blik_scene_info *info);

/**
 * The first facet that each ray meets: least distance, then lowest index, whatever the machine.
 */
int32_t blik_closest_hits(const struct blik_scene *scene,
                          const struct blik_ray *rays,
                          size_t count,
                          const struct blik_run *run,
                          struct blik_error *error,
                          struct blik_hit *hits);

/**
 * Whether each ray meets any facet: 1 or 0.
 */
int32_t blik_any_hits(const struct blik_scene *scene,
                      const struct blik_ray *rays,
                      size_t count,
                      const struct blik_run *run,
                      struct blik_error *error,
                      uint8_t *hits);

/**
 * Bytes of memory that blik_solution_init needs for this light, at any address. More speeds up scenes with
 * mirrors and a sun on several threads. Where mirrors scatter sunlight over many more elements than usual, the call
 * returns `BLIK_ERROR_BUFFER_TOO_SMALL` and `error->needed` says how many bytes probably do.
 */
int32_t blik_solution_size(const struct blik_coupling *coupling,
                           const struct blik_light *light,
                           struct blik_error *error,
                           size_t *bytes);

/**
 * Lights a scene and solves for its diffuse radiance, in the caller's memory. For another light call it again, with
 * the same memory or other: the coupling is not computed anew, and no ray toward the sky is traced. The coupling must
 * outlive the solution.
 */
int32_t blik_solution_init(const struct blik_coupling *coupling,
                           const struct blik_light *light,
                           const struct blik_run *run,
                           void *memory,
                           size_t size,
                           struct blik_error *error,
                           const struct blik_solution **solution);

#if defined(BLIK_STD)
/**
 * As blik_solution_init, in memory of its own; to be ended by blik_solution_destroy.
 */
int32_t blik_solution_create(const struct blik_coupling *coupling,
                             const struct blik_light *light,
                             const struct blik_run *run,
                             struct blik_error *error,
                             struct blik_solution **solution);
#endif

/**
 * Ends a solution and frees what it owns; nothing for null.
 */
void blik_solution_destroy(struct blik_solution *solution);

/**
 * Reference radiance of each band, to which tolerance and errors are related.
 */
int32_t blik_solution_get_reference(const struct blik_solution *solution,
                                    struct blik_error *error,
                                    double *radiance);

/**
 * The words for a status: never null, never to be freed. May be called by any number of threads at once.
 */
const char *blik_status_text(int32_t status);

/**
 * The name of a field as the structs spell it: never null, never to be freed; empty for no field. May be called by
 * any number of threads at once.
 */
const char *blik_field_text(int32_t field);

/**
 * Sets the defaults; does nothing with a null pointer.
 */
void blik_mesh_init(struct blik_mesh *mesh);

/**
 * Sets the defaults; does nothing with a null pointer.
 */
void blik_settings_init(struct blik_settings *settings);

/**
 * Sets the defaults; does nothing with a null pointer.
 */
void blik_sky_init(struct blik_sky *sky);

/**
 * Sets the defaults; does nothing with a null pointer.
 */
void blik_sun_init(struct blik_sun *sun);

/**
 * Sets the defaults; does nothing with a null pointer.
 */
void blik_light_init(struct blik_light *light);

/**
 * Sets the defaults; does nothing with a null pointer.
 */
void blik_camera_init(struct blik_camera *camera);

/**
 * Adds `next` to `sum`; nothing where either is null.
 */
void blik_tally_add(struct blik_tally *sum, const struct blik_tally *next);

/**
 * Bytes of scratch memory with which blik_image keeps all lanes of `run` busy.
 */
int32_t blik_image_scratch_size(const struct blik_solution *solution,
                                const struct blik_camera *camera,
                                const struct blik_run *run,
                                struct blik_error *error,
                                size_t *bytes);

/**
 * The whole image that a camera sees: `pixels` holds rows x columns x bands values, row 0 at the top, bands innermost,
 * and `count` is their number. `components` is null or has room for three such images, the terms of eq. (11): diffuse,
 * mirrored sky, mirrored diffuse. `tally` may be null.
 *
 * `scratch` is memory of blik_image_scratch_size bytes, or less, for fewer lanes; with the standard library it may
 * be null, and is then taken from the heap. Bits do not depend on `run`. A call that is cancelled leaves part of the
 * pixels written.
 */
int32_t blik_image(const struct blik_solution *solution,
                   const struct blik_camera *camera,
                   const struct blik_run *run,
                   void *scratch,
                   size_t scratch_size,
                   struct blik_error *error,
                   float *pixels,
                   size_t count,
                   float *components,
                   struct blik_tally *tally);

/**
 * Rows `first` .. `first + rows` of the image that a camera sees, for schedulers and processes of the caller: `pixels`
 * holds rows x columns x bands values. However an image is split into rows, its bits are the same. `scratch` as for
 * blik_image, of one lane; `components` and `tally` as there.
 */
int32_t blik_image_rows(const struct blik_solution *solution,
                        const struct blik_camera *camera,
                        size_t first,
                        size_t rows,
                        void *scratch,
                        size_t scratch_size,
                        struct blik_error *error,
                        float *pixels,
                        size_t count,
                        float *components,
                        struct blik_tally *tally);

/**
 * Bytes of scratch memory with which blik_radiance and blik_signatures keep all lanes of `run` busy.
 */
int32_t blik_radiance_scratch_size(const struct blik_solution *solution,
                                   const struct blik_run *run,
                                   struct blik_error *error,
                                   size_t *bytes);

/**
 * Radiance against each of `count` rays of any origin and direction: `radiance` has one value per band for each.
 *
 * `scratch` is memory of blik_radiance_scratch_size bytes, or less, for fewer lanes; with the standard library it
 * may be null, and is then taken from the heap.
 */
int32_t blik_radiance(const struct blik_solution *solution,
                      const struct blik_ray *rays,
                      size_t count,
                      const struct blik_run *run,
                      void *scratch,
                      size_t scratch_size,
                      struct blik_error *error,
                      double *radiance);

/**
 * What distant observers measure of the whole object, without an image: for each of `views` directions (three numbers,
 * from the observer toward the object) one entry per band. `cells` along each side of the projection are sampled by
 * one ray each; 0: by tolerance; at most 65536. Views are shared out over the lanes of `run`. Scratch memory as for
 * blik_radiance.
 */
int32_t blik_signatures(const struct blik_solution *solution,
                        const double *directions,
                        size_t views,
                        size_t cells,
                        const struct blik_run *run,
                        void *scratch,
                        size_t scratch_size,
                        struct blik_error *error,
                        struct blik_signature *signatures);

/**
 * Area, mean irradiance (all that arrives, not divided by pi) and diffuse radiance of facets `first` ..
 * `first + count`: `areas` has one value a facet, `irradiance` and `radiance` one per facet, side and band, bands
 * innermost. Any of the three may be null. Degenerate facets: zeros.
 */
int32_t blik_facets(const struct blik_solution *solution,
                    size_t first,
                    size_t count,
                    struct blik_error *error,
                    double *areas,
                    double *irradiance,
                    double *radiance);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* BLIK_H */
