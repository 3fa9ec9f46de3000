/*
 * An image on all processors, written as a grey picture (PGM):
 *
 *     threaded FILE.pgm [THREADS]
 */
#include <blik.h>

#include "craft.h"

#include <stdio.h>
#include <stdlib.h>

enum { COLUMNS = 320, ROWS = 240 };

static void require(blik_status status, const blik_error *error)
{
    if (status != BLIK_OK) {
        char text[256];
        blik_error_text(error, text, sizeof text);
        fprintf(stderr, "%s\n", text);
        exit(1);
    }
}

/* Tells the share of a stage that is done; returning anything but 0 would stop it. */
static int32_t progress(void *user, double done)
{
    fprintf(stderr, "\r%s %3.0f %%", (const char *)user, 100 * done);
    return 0;
}

int main(int count, char **arguments)
{
    static const double grey = 0.4, dark = 0.1, shine = 0.5;
    static char coupling_text[] = "coupling", image_text[] = "image   ";
    static float pixels[ROWS * COLUMNS];
    blik_material materials[3] = {{0}};
    blik_error error;
    blik_mesh mesh;
    blik_settings settings;
    blik_run run;
    blik_sky sky;
    blik_sun sun;
    blik_light light;
    blik_camera camera;
    blik_tally tally;
    blik_report report;
    blik_scene *scene = NULL;
    blik_coupling *coupling = NULL;
    blik_solution *solution = NULL;
    FILE *file;
    size_t i;

    if (count < 2 || (file = fopen(arguments[1], "wb")) == NULL) {
        fputs("usage: threaded FILE.pgm [THREADS]\n", stderr);
        return 2;
    }
    materials[0].diffuse = &grey;
    materials[1].diffuse = &dark;
    materials[1].specular = &shine;
    materials[2].diffuse = &grey;
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
    require(blik_scene_create(&mesh, &error, &scene), &error);

    blik_settings_init(&settings);
    settings.tolerance = 1e-2;
    blik_run_init(&run);
    run.parallel = blik_run_on_threads;
    run.lanes = count > 2 ? (size_t)atoi(arguments[2]) : 4;
    run.progress = progress;
    run.progress_user = coupling_text;
    require(blik_coupling_create(scene, &settings, &run, &error, &coupling), &error);

    blik_sky_init(&sky);
    sky.model = BLIK_SKY_OVERCAST;
    blik_sun_init(&sun);
    sun.direction[0] = 1;
    sun.direction[1] = -1;
    blik_light_init(&light);
    light.sky = &sky;
    light.sun = &sun;
    run.progress = NULL;
    require(blik_solution_create(coupling, &light, &run, &error, &solution), &error);

    blik_camera_init(&camera);
    camera.eye[0] = 4;
    camera.eye[1] = -6;
    camera.eye[2] = 5;
    camera.height = 5;
    camera.columns = COLUMNS;
    camera.rows = ROWS;
    blik_tally_init(&tally);
    blik_report_init(&report);
    run.progress = progress;
    run.progress_user = image_text;
    require(blik_image(solution, &camera, &run, NULL, 0, &error, pixels, ROWS * COLUMNS, NULL, 0, &tally), &error);
    require(blik_get_report(solution, &tally, &error, &report), &error);
    fprintf(stderr, "\n");

    fprintf(file, "P5\n%d %d\n255\n", COLUMNS, ROWS);
    for (i = 0; i < ROWS * COLUMNS; ++i) {
        const float level = 160 * pixels[i];
        fputc(level < 255 ? (int)level : 255, file);
    }
    if (fclose(file) != 0) {
        return 1;
    }
    printf("%lu pixels of the craft, error estimate %.1e\n", (unsigned long)tally.object_pixels,
           report.error_estimate);
    blik_solution_destroy(solution);
    blik_coupling_destroy(coupling);
    blik_scene_destroy(scene);
    return 0;
}
