/* A program of an older header: blik_settings as it was before image_tolerance, and a library that is newer. Its own
 * variables stay what they are, and the library knows that the member is not there. Exit 0 when all is as stated. */
#include <blik.h>

#include <stdio.h>
#include <string.h>

struct old_settings {
    size_t struct_size;
    double tolerance;
    int32_t max_bounces, all_irradiances, directional, fit_memory;
    uint64_t ray_budget;
};

int main(void)
{
    static const double vertices[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0}, grey = 0.5;
    static const uint32_t facet[3] = {0, 1, 2};
    struct {
        struct old_settings settings;
        double mine;
    } frame = {{sizeof(struct old_settings), 0.01, -1, 0, 1, 0, 0}, 42.0};
    blik_material material;
    blik_mesh mesh;
    blik_error error;
    blik_scene *scene = NULL;
    blik_coupling *coupling = NULL;
    blik_settings newer;
    size_t bytes = 0;
    memset(&material, 0, sizeof material);
    material.diffuse = &grey;
    blik_mesh_init(&mesh);
    mesh.vertices.data = vertices;
    mesh.vertices.count = 3;
    mesh.facets.data = facet;
    mesh.facets.count = 1;
    mesh.materials = &material;
    mesh.material_count = 1;
    if (blik_scene_create(&mesh, &error, &scene) != BLIK_OK) {
        return 1;
    }
    /* were the member read that is not there, 42 would be refused as an image's tolerance */
    if (blik_coupling_create(scene, (const blik_settings *)(const void *)&frame.settings, NULL, &error, &coupling) != BLIK_OK) {
        return 2;
    }
    if (frame.mine != 42.0 || frame.settings.struct_size != sizeof(struct old_settings)) {
        return 3;
    }
    /* a struct of a newer header than the library, or of none */
    blik_settings_init(&newer);
    newer.struct_size += 8;
    if (blik_coupling_size(scene, &newer, &error, &bytes) != BLIK_ERROR_STRUCT_SIZE) {
        return 4;
    }
    newer.struct_size = 8;
    if (blik_coupling_size(scene, &newer, &error, &bytes) != BLIK_ERROR_STRUCT_SIZE) {
        return 5;
    }
    blik_coupling_destroy(coupling);
    blik_scene_destroy(scene);
    puts("ok");
    return 0;
}
