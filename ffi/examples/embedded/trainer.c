/*
 * Blik without heap and operating system: a small craft from its facets to its image, and the same from a block that a
 * workstation baked. Everything stands in one static array; `board.h` is all that it needs of the machine.
 *
 * Compiled with RENDER_ONLY it reads the baked block alone and lights it anew; with RENDER_SOLVED it shows it under the
 * light that was baked with it. What it prints are checksums of the bits of its results: they are the same on every
 * machine.
 */
#include "board.h"
#ifdef RENDER_SOLVED
#define RENDER_ONLY
#endif

#include <blik.h>
#ifndef RENDER_ONLY
#include "../craft.h"
#endif

enum { COLUMNS = 24, ROWS = 16, MEMORY = 512 * 1024, PAINT = 0x5a };

static _Alignas(64) unsigned char memory[MEMORY];
static size_t used;
static float pixels[COLUMNS * ROWS];

/* The deepest stack of the library, on machines that tell where theirs ends: what was painted below its caller's and is not
 * any more. To be called by who calls the library next. */
static uintptr_t caller;
static size_t deepest;

__attribute__((noinline)) static void watch_stack(void)
{
    unsigned char here;
    unsigned char *at = board_stack;
    if (at == NULL) {
        return;
    }
    while (caller != 0 && *at == PAINT) {
        ++at;
    }
    if (caller != 0 && caller - (uintptr_t)at > deepest) {
        deepest = (size_t)(caller - (uintptr_t)at);
    }
    caller = (uintptr_t)&here;
    /* what is near `here` is this call's own */
    for (at = board_stack; (uintptr_t)at + 64 < caller; ++at) {
        *at = PAINT;
    }
}

static void *take(size_t bytes)
{
    void *place = memory + used;
    if (bytes > sizeof memory - used) {
        board_print("out of memory\n");
        board_end(1);
    }
    used += (bytes + 63) / 64 * 64;
    return place;
}

static void require(blik_status status)
{
    if (status != BLIK_OK) {
        board_print(blik_status_text(status));
        board_print("\n");
        board_end(1);
    }
}

static void number(uint32_t value)
{
    char text[11];
    char *at = text + sizeof text - 1;
    *at = 0;
    do {
        *--at = (char)('0' + value % 10);
        value /= 10;
    } while (value != 0);
    board_print(at);
}

static void say(const char *what, uint32_t value, const char *unit)
{
    board_print(what);
    board_print(" ");
    number(value);
    board_print(unit);
}

/* FNV-1a */
static uint32_t checksum(const void *data, size_t bytes)
{
    const unsigned char *at = (const unsigned char *)data, *end = at + bytes;
    uint32_t sum = 2166136261U;
    while (at != end) {
        sum = (sum ^ *at++) * 16777619U;
    }
    return sum;
}

#ifndef RENDER_SOLVED
static void light(const blik_coupling *coupling, double toward, blik_solution **solution)
{
    blik_error error;
    blik_sky sky;
    blik_sun sun;
    blik_light light;
    size_t bytes = 0;
    void *place;
    watch_stack();
    blik_sky_init(&sky);
    sky.model = BLIK_SKY_OVERCAST;
    blik_sun_init(&sun);
    sun.direction[0] = toward;
    sun.direction[1] = 1;
    sun.direction[2] = 2;
    blik_light_init(&light);
    light.sky = &sky;
    light.sun = &sun;
    require(blik_solution_size(coupling, &light, &error, &bytes));
    place = take(bytes);
    require(blik_solution_init(coupling, &light, NULL, place, bytes, &error, solution));
}
#endif

static void show(const char *what, const blik_solution *solution)
{
    blik_error error;
    blik_camera camera;
    size_t bytes = 0, before = used;
    void *scratch;
    watch_stack();
    blik_camera_init(&camera);
    camera.eye[0] = 4;
    camera.eye[1] = -6;
    camera.eye[2] = 5;
    camera.height = 4.5;
    camera.columns = COLUMNS;
    camera.rows = ROWS;
    require(blik_image_scratch_size(solution, &camera, NULL, &error, &bytes));
    scratch = take(bytes);
    require(blik_image(solution, &camera, NULL, scratch, bytes, &error, pixels, COLUMNS * ROWS, NULL, 0, NULL));
    used = before;
    say(what, checksum(pixels, sizeof pixels), "\n");
}

#ifndef RENDER_ONLY
static void picture(void)
{
    size_t row, column;
    for (row = 0; row < ROWS; ++row) {
        char line[COLUMNS + 2];
        for (column = 0; column < COLUMNS; ++column) {
            const float level = pixels[row * COLUMNS + column] * 8;
            line[column] = " .:-=+*#%@"[level < 9 ? (int)level : 9];
        }
        line[COLUMNS] = '\n';
        line[COLUMNS + 1] = 0;
        board_print(line);
    }
}

/* What two distant observers measure. */
static void signatures(const blik_solution *solution)
{
    static const double directions[2][3] = {{-4, 6, -5}, {1, 0, -1}};
    blik_error error;
    blik_signature measured[2];
    size_t bytes = 0, before = used;
    void *scratch;
    watch_stack();
    require(blik_radiance_scratch_size(solution, NULL, &error, &bytes));
    scratch = take(bytes);
    require(blik_signatures(solution, directions[0], 2, 0, NULL, scratch, bytes, &error, measured, 2, sizeof measured[0]));
    used = before;
    say("signatures", checksum(measured, sizeof measured), "\n");
}

/* From facets to a coupling, to an image, to a block; its size in `bytes`. */
static const void *compute(size_t *bytes)
{
    static const double grey = .4, dark = .1, shine = .5, some = .2;
    blik_material materials[3] = {{0}};
    blik_error error;
    blik_mesh mesh;
    blik_settings settings;
    blik_scene *scene = NULL;
    blik_coupling *coupling = NULL;
    blik_solution *solution = NULL;
    void *place;
    watch_stack();
    materials[0].diffuse = &grey;
    materials[1].diffuse = &dark;
    materials[1].specular = &shine;
    materials[2].diffuse = &grey;
    materials[2].specular = &some;
    materials[2].gloss_axis_ratio = 10;
    materials[2].gloss_rays = 3;
    blik_mesh_init(&mesh);
    mesh.vertices.data = craft_vertices;
    mesh.vertices.count = CRAFT_VERTICES;
    mesh.vertices.format = BLIK_F32;
    mesh.facets.data = craft_facets;
    mesh.facets.count = CRAFT_FACETS;
    mesh.facets.format = BLIK_U16;
    mesh.facet_materials.data = craft_materials;
    mesh.facet_materials.count = CRAFT_FACETS;
    mesh.facet_materials.format = BLIK_U8;
    mesh.materials = materials;
    mesh.material_count = 3;
    require(blik_scene_size(&mesh, &error, bytes));
    place = take(*bytes);
    require(blik_scene_init(&mesh, place, *bytes, &error, &scene));

    blik_settings_init(&settings);
    settings.tolerance = 0.05;
    /* all that is left; what it does not take goes back */
    *bytes = sizeof memory - used;
    place = take(*bytes);
    require(blik_coupling_init(scene, &settings, NULL, place, *bytes, &error, &coupling));
    {
        blik_coupling_info info;
        blik_coupling_info_init(&info);
        require(blik_coupling_get_info(coupling, &error, &info));
        used -= (*bytes - info.bytes) / 64 * 64;
        say("coupling", (uint32_t)info.pairs, " form factors\n");
    }
    light(coupling, 1, &solution);
    say("computed in", (uint32_t)used, " bytes\n");
    show("image", solution);
    picture();
    signatures(solution);
    watch_stack();
    require(blik_bake_size(coupling, solution, &error, bytes));
    place = take(*bytes);
    require(blik_bake(coupling, solution, place, *bytes, &error));
    say("block of", (uint32_t)*bytes, " bytes\n");
    say("block", checksum(place, *bytes), "\n");
    return place;
}
#endif

/* An image from a baked block, under another sun, or under the one that was baked with it. */
static void render(const char *what, const void *block, size_t size)
{
    blik_error error;
    blik_scene *scene = NULL;
    blik_coupling *coupling = NULL;
    blik_solution *solution = NULL;
    size_t bytes = 0, before = used;
    void *place;
    watch_stack();
    require(blik_load_size(block, size, &error, &bytes));
    place = take(bytes);
    require(blik_load(block, size, place, bytes, &error, &scene, &coupling, &solution));
#ifndef RENDER_SOLVED
    light(coupling, -1, &solution);
#endif
    say("rendered in", (uint32_t)(used - before), " bytes\n");
    show(what, solution);
    used = before;
}

static void whole(void)
{
#ifndef RENDER_ONLY
    size_t size = 0;
    const void *own = compute(&size);
    board_block = board_block != NULL ? board_block : own;
    board_block_size = board_block_size != 0 ? board_block_size : size;
    render("image of its block", own, size);
    board_keep(own, size);
#endif
    render("image of baked block", board_block, board_block_size);
}

int main(void)
{
    whole();
    watch_stack();
    if (board_stack != NULL) {
        say("stack", (uint32_t)deepest, " bytes\n");
    }
    board_print("done\n");
    board_end(0);
    return 0;
}
