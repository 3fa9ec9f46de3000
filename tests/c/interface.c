/* The C interface from C: caller memory, own memory, errors. Exit 0 when all is as stated; compiled as C99 to C23. */
#include <blik.h>
#include <blik_plane.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define REQUIRE(condition)                                                   \
    do {                                                                     \
        if (!(condition)) {                                                  \
            fprintf(stderr, "%s:%d: %s\n", __FILE__, __LINE__, #condition);  \
            exit(1);                                                         \
        }                                                                    \
    } while (0)

/* A white room's inside, lit by nothing but its glowing walls: radiance is 1/(1 - 0.5) everywhere. */
static const double vertices[8][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                      {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
static const uint16_t facets[12][3] = {{0, 1, 2}, {0, 2, 3}, {4, 6, 5}, {4, 7, 6}, {0, 5, 1}, {0, 4, 5},
                                       {1, 6, 2}, {1, 5, 6}, {2, 7, 3}, {2, 6, 7}, {3, 4, 0}, {3, 7, 4}};
static const double half = 0.5, one = 1.0;

static blik_mesh room(const blik_material *material)
{
    blik_mesh mesh;
    blik_mesh_init(&mesh);
    mesh.vertices.data = vertices;
    mesh.vertices.count = 8;
    mesh.facets.data = facets;
    mesh.facets.count = 12;
    mesh.facets.format = BLIK_U16;
    mesh.materials = material;
    mesh.material_count = 1;
    return mesh;
}

static void *memory(size_t bytes)
{
    void *block = malloc(bytes);
    REQUIRE(block != NULL);
    memset(block, 0xa5, bytes);
    return block;
}

static int32_t count_calls(void *user, double done)
{
    REQUIRE(done >= 0 && done <= 1.0000001);
    ++*(int *)user;
    return 0;
}

static void check_facets(const blik_solution *solution)
{
    blik_error error;
    double radiance[12], irradiance[12], areas[12];
    int i;
    REQUIRE(blik_facets(solution, 0, 12, &error, areas, 12, irradiance, 12, radiance, 12) == BLIK_OK);
    for (i = 0; i < 12; ++i) {
        REQUIRE(fabs(areas[i] - 0.5) < 1e-12);
        /* the sweeps end at a thousandth of the tolerance */
        REQUIRE(fabs(radiance[i] - 2.0) < 2e-4);
    }
    REQUIRE(blik_facets(solution, 5, 8, &error, areas, 8, irradiance, 8, radiance, 8) == BLIK_ERROR_RANGE);
    REQUIRE(error.field == BLIK_FIELD_ROWS);
    /* arrays for fewer facets, sides or bands than the solution has */
    REQUIRE(blik_facets(solution, 0, 12, &error, NULL, 0, irradiance, 6, NULL, 0) == BLIK_ERROR_LENGTH);
    REQUIRE(error.field == BLIK_FIELD_IRRADIANCE && error.needed == 12 && error.given == 6);
}

static void check_image(const blik_solution *solution)
{
    blik_error error;
    blik_camera camera;
    blik_tally tally;
    blik_report report;
    float pixels[64];
    size_t bytes = 0, i;
    void *scratch;
    blik_tally_init(&tally);
    blik_report_init(&report);
    blik_camera_init(&camera);
    camera.projection = BLIK_PERSPECTIVE;
    camera.fov_deg = 60;
    camera.eye[0] = 0.5;
    camera.eye[1] = 0.2;
    camera.eye[2] = 0.5;
    camera.target[0] = 0.5;
    camera.target[1] = 1.0;
    camera.target[2] = 0.5;
    camera.columns = 8;
    camera.rows = 8;
    REQUIRE(blik_image_scratch_size(solution, &camera, NULL, &error, &bytes) == BLIK_OK);
    scratch = memory(bytes);
    REQUIRE(blik_image(solution, &camera, NULL, scratch, bytes, &error, pixels, 64, NULL, 0,
                       &tally) == BLIK_OK);
    for (i = 0; i < 64; ++i) {
        REQUIRE(fabs((double)pixels[i] - 2.0) < 2e-2);
    }
    REQUIRE(tally.object_pixels == 64);
    REQUIRE(blik_get_report(solution, &tally, &error, &report) == BLIK_OK);
    REQUIRE(report.tolerance == 1e-2 && report.error_estimate < 0.1);
    REQUIRE(blik_image(solution, &camera, NULL, scratch, 8, &error, pixels, 64, NULL, 0, NULL) ==
            BLIK_ERROR_BUFFER_TOO_SMALL);
    REQUIRE(error.needed > 8 && error.given == 8);
    REQUIRE(blik_image(solution, &camera, NULL, scratch, bytes, &error, pixels, 63, NULL, 0, NULL) ==
            BLIK_ERROR_LENGTH);
    free(scratch);
}

/* Two grey circles side by side, in the plane. */
static void check_plane(void)
{
    blik_error error;
    blik_plane_body bodies[2];
    blik_plane_material material;
    blik_plane_bodies all;
    blik_plane_settings settings;
    blik_plane_sky sky;
    blik_plane_light light;
    blik_plane_sample samples[50];
    blik_plane_lobe lobe;
    blik_plane_scene *scene = NULL;
    blik_plane_coupling *coupling = NULL;
    blik_plane_solution *solution = NULL;
    void *blocks[4];
    size_t bytes = 0;
    int i;
    blik_plane_body_init(&bodies[0]);
    bodies[0].elements = 12;
    bodies[1] = bodies[0];
    bodies[1].centre[0] = 2.5;
    blik_plane_material_init(&material);
    material.diffuse = 0.3;
    material.specular = 0.1;
    blik_plane_bodies_init(&all);
    all.bodies = bodies;
    all.body_count = 2;
    all.materials = &material;
    all.material_count = 1;
    blik_plane_settings_init(&settings);
    blik_plane_sky_init(&sky);
    blik_plane_light_init(&light);
    light.sky = &sky;

    REQUIRE(blik_plane_scene_size(&all, &error, &bytes) == BLIK_OK);
    blocks[0] = memory(bytes);
    REQUIRE(blik_plane_scene_init(&all, &settings, blocks[0], bytes, &error, &scene) == BLIK_OK);
    REQUIRE(blik_plane_coupling_size(scene, NULL, &error, &bytes) == BLIK_OK);
    blocks[1] = memory(bytes);
    REQUIRE(blik_plane_coupling_init(scene, NULL, blocks[1], bytes - 1, &error, &coupling) ==
            BLIK_ERROR_BUFFER_TOO_SMALL);
    REQUIRE(error.needed == bytes && coupling == NULL);
    REQUIRE(blik_plane_coupling_init(scene, NULL, blocks[1], bytes, &error, &coupling) == BLIK_OK);
    REQUIRE(blik_plane_solution_size(coupling, &light, NULL, &error, &bytes) == BLIK_OK);
    blocks[2] = memory(bytes);
    REQUIRE(blik_plane_solution_init(coupling, &light, NULL, blocks[2], bytes, &error, &solution) == BLIK_OK);
    REQUIRE(blik_plane_scratch_size(solution, NULL, &error, &bytes) == BLIK_OK);
    blocks[3] = memory(bytes);
    REQUIRE(blik_plane_image(solution, 0.0, 50, 0, 50, NULL, blocks[3], bytes, &error, samples, 50) == BLIK_OK);
    for (i = 0; i < 50; ++i) {
        REQUIRE(samples[i].object == 1 ? samples[i].radiance > 0.15 && samples[i].radiance < 0.5
                                       : samples[i].radiance == 1.0);
    }
    /* seen from the side on which the line between the centres is the axis, the image is its own mirror image */
    REQUIRE(fabs(samples[3].radiance - samples[46].radiance) < 1e-4);
    REQUIRE(blik_plane_image(solution, 0.0, 50, 1, 50, NULL, blocks[3], bytes, &error, samples, 50) ==
            BLIK_ERROR_RANGE);
    REQUIRE(blik_plane_gloss(10.0, 1.0, 0.0, &error, &lobe) == BLIK_OK && lobe.albedo == 1.0);
    for (i = 4; i > 0; --i) {
        free(blocks[i - 1]);
    }
}

int main(void)
{
    blik_error error;
    blik_material material;
    blik_mesh mesh;
    blik_settings settings;
    blik_light light;
    blik_run run;
    blik_scene *scene = NULL;
    blik_coupling *coupling = NULL;
    blik_solution *solution = NULL;
    size_t bytes = 0;
    blik_status status;
    int calls = 0;
    void *blocks[3];

    memset(&material, 0, sizeof material);
    material.diffuse = &half;
    material.emission = &one;
    mesh = room(&material);
    blik_settings_init(&settings);
    settings.tolerance = 1e-2;
    blik_light_init(&light);
    blik_run_init(&run);
    run.progress = count_calls;
    run.progress_user = &calls;

    REQUIRE(blik_version() == BLIK_VERSION);
    REQUIRE(strcmp(blik_status_text(BLIK_OK), "done") == 0);
    REQUIRE(blik_scene_size(&mesh, &error, &bytes) == BLIK_OK);
    blocks[0] = memory(bytes);
    REQUIRE(blik_scene_init(&mesh, blocks[0], bytes - 1, &error, &scene) == BLIK_ERROR_BUFFER_TOO_SMALL);
    REQUIRE(scene == NULL && error.needed == bytes);
    REQUIRE(blik_scene_init(&mesh, blocks[0], bytes, &error, &scene) == BLIK_OK);

    REQUIRE(blik_coupling_size(scene, &settings, &error, &bytes) == BLIK_OK);
    for (;;) {
        blocks[1] = memory(bytes);
        status = blik_coupling_init(scene, &settings, &run, blocks[1], bytes, &error, &coupling);
        if (status != BLIK_ERROR_BUFFER_TOO_SMALL) {
            break;
        }
        REQUIRE(coupling == NULL && error.needed > bytes);
        bytes = error.needed;
        free(blocks[1]);
    }
    REQUIRE(status == BLIK_OK && calls > 0);

    REQUIRE(blik_solution_size(coupling, &light, &error, &bytes) == BLIK_OK);
    blocks[2] = memory(bytes);
    REQUIRE(blik_solution_init(coupling, &light, NULL, blocks[2], bytes, &error, &solution) == BLIK_OK);
    check_facets(solution);
    check_image(solution);
    {
        static const double down[3] = {0, 0, -1};
        blik_signature signature;
        REQUIRE(blik_signatures(solution, down, 1, 65537, NULL, NULL, 0, &error, &signature, 1, sizeof signature) ==
                BLIK_ERROR_TOO_MANY);
        REQUIRE(error.needed == 65536);
        material.emission = (const double *)(const void *)((const char *)&one + 1);
        REQUIRE(blik_scene_size(&mesh, &error, &bytes) == BLIK_ERROR_ALIGNMENT && error.index == 0);
        material.emission = &one;
    }
    free(blocks[2]);
    free(blocks[1]);
    free(blocks[0]);

#ifdef BLIK_STD
    {
        blik_scene *own_scene = NULL;
        blik_coupling *own_coupling = NULL;
        blik_solution *own_solution = NULL;
        run.parallel = blik_run_on_threads;
        run.lanes = 3;
        REQUIRE(blik_scene_create(&mesh, &error, &own_scene) == BLIK_OK);
        REQUIRE(blik_coupling_create(own_scene, &settings, &run, &error, &own_coupling) == BLIK_OK);
        REQUIRE(blik_solution_create(own_coupling, &light, &run, &error, &own_solution) == BLIK_OK);
        check_facets(own_solution);
        blik_solution_destroy(own_solution);
        blik_coupling_destroy(own_coupling);
        blik_scene_destroy(own_scene);
    }
#endif
    check_plane();
    puts("ok");
    return 0;
}
