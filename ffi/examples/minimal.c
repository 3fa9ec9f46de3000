/* A mesh in, an image out, as text; after an error the program ends with what is wrong. */
#include <blik.h>
#include <stdio.h>
#include <stdlib.h>

enum { COLUMNS = 48, ROWS = 24 };

static blik_error error;

static void done(blik_status status)
{
    char text[256];
    if (status != BLIK_OK) {
        blik_error_text(&error, text, sizeof text);
        fprintf(stderr, "%s\n", text);
        exit(1);
    }
}

int main(void)
{
    /* a diffuse floor and a half-mirroring wall that meet at a right angle */
    static const float vertices[6][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {0, 1, 1}};
    static const uint16_t facets[4][3] = {{0, 1, 2}, {0, 2, 3}, {0, 3, 5}, {0, 5, 4}};
    static const uint8_t of_facets[4] = {0, 0, 1, 1};
    static const double floor_diffuse = 0.5, wall_diffuse = 0.1, wall_specular = 0.5;
    const blik_material materials[2] = {{&floor_diffuse, NULL, NULL, 0, 0}, {&wall_diffuse, &wall_specular, NULL, 0, 0}};
    static float pixels[ROWS * COLUMNS];
    blik_mesh mesh; blik_mesh_init(&mesh);
    blik_settings settings; blik_settings_init(&settings);
    blik_sky sky; blik_sky_init(&sky);
    blik_light light; blik_light_init(&light);
    blik_camera camera; blik_camera_init(&camera);
    blik_scene *scene; blik_coupling *coupling; blik_solution *solution;
    mesh.vertices = (blik_array){vertices, 6, 0, BLIK_F32};
    mesh.facets = (blik_array){facets, 4, 0, BLIK_U16};
    mesh.facet_materials = (blik_array){of_facets, 4, 0, BLIK_U8};
    mesh.materials = materials; mesh.material_count = 2;
    light.sky = &sky;
    camera.eye[0] = 3; camera.eye[1] = 0.5; camera.eye[2] = 2;
    camera.target[0] = 0.5; camera.target[1] = 0.5; camera.target[2] = 0.3;
    camera.height = 1.6; camera.columns = COLUMNS; camera.rows = ROWS;
    done(blik_scene_create(&mesh, &error, &scene));
    done(blik_coupling_create(scene, &settings, NULL, &error, &coupling));
    done(blik_solution_create(coupling, &light, NULL, &error, &solution));
    done(blik_image(solution, &camera, NULL, NULL, 0, &error, pixels, ROWS * COLUMNS, NULL, 0, NULL));
    for (int i = 0; i < ROWS * COLUMNS; ++i) printf("%c%s", " .:-=+*#%@"[(int)(pixels[i] * 9.5F)], i % COLUMNS == COLUMNS - 1 ? "\n" : "");
    blik_solution_destroy(solution); blik_coupling_destroy(coupling); blik_scene_destroy(scene);
}
