// A simulator's own arrays in, an image out, as text.
#include <blik.hpp>

#include <cstdio>
#include <exception>
#include <vector>

int main() try {
    // a diffuse floor and a half-mirroring wall that meet at a right angle
    const std::vector<float> vertices = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1};
    const std::vector<int> facets = {0, 1, 2, 0, 2, 3, 0, 3, 5, 0, 5, 4};
    const std::vector<unsigned char> materials = {0, 0, 1, 1};

    blik::mesh mesh(vertices, facets);
    mesh.facet_materials(materials).material({0.5}).material({0.1}, {0.5}); // diffuse, specular

    const blik::scene scene(mesh);
    const blik::coupling coupling(scene, blik::settings(1e-2), blik::threads());
    const blik::light light(blik::sky(BLIK_SKY_OVERCAST), blik::sun({1.0, 0.5, 2.0}));
    const blik::solution solution(coupling, light, blik::threads());
    const blik::image image =
        solution.image(blik::orthographic({3, 0.5, 2}, {0.5, 0.5, 0.3}, 1.6, 48, 24), blik::threads());

    for (std::size_t row = 0; row < image.rows; ++row) {
        for (std::size_t column = 0; column < image.columns; ++column) {
            const float level = image.at(row, column) * 6; // the sun alone gives 1 on a white plane
            std::putchar(" .:-=+*#%@"[level < 9 ? static_cast<int>(level) : 9]);
        }
        std::putchar('\n');
    }
    std::printf("error estimate %.1e\n", solution.report(image.tally).error_estimate);
} catch (const std::exception &error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
}
