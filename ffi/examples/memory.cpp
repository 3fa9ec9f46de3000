// Bytes that scene, coupling, solution and baked block take per facet: two spheres, one of them half a mirror, over a floor.
//
//     memory [TOLERANCE]
#include <blik.hpp>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>

namespace {

struct arrays {
    std::vector<std::array<double, 3>> vertices;
    std::vector<std::array<unsigned, 3>> facets;
    std::vector<unsigned char> materials;

    // A sphere of 2 (n - 1) m facets.
    void sphere(double x, double radius, unsigned n, unsigned m, unsigned char material) {
        const double pi = 3.14159265358979323846;
        const auto first = static_cast<unsigned>(vertices.size());
        for (unsigned i = 0; i <= n; ++i) {
            for (unsigned j = 0; j < m; ++j) {
                const double polar = pi * i / n, around = 2 * pi * j / m;
                vertices.push_back({x + radius * std::sin(polar) * std::cos(around),
                                    radius * std::sin(polar) * std::sin(around), 1 + radius * std::cos(polar)});
            }
        }
        for (unsigned i = 0; i < n; ++i) {
            for (unsigned j = 0; j < m; ++j) {
                const unsigned a = first + i * m + j, b = first + i * m + (j + 1) % m;
                if (i > 0) {
                    add({a, a + m, b}, material);
                }
                if (i + 1 < n) {
                    add({b, a + m, b + m}, material);
                }
            }
        }
    }
    void add(const std::array<unsigned, 3> &facet, unsigned char material) {
        facets.push_back(facet);
        materials.push_back(material);
    }
};

} // namespace

int main(int count, char **arguments) try {
    arrays all;
    all.sphere(-1.2, 0.9, 12, 24, 0);
    all.sphere(1.2, 0.9, 12, 24, 1);
    const auto corner = static_cast<unsigned>(all.vertices.size());
    all.vertices.insert(all.vertices.end(), {{-3, -3, 0}, {3, -3, 0}, {3, 3, 0}, {-3, 3, 0}});
    all.add({corner, corner + 1, corner + 2}, 0);
    all.add({corner, corner + 2, corner + 3}, 0);
    blik::mesh mesh(all.vertices, all.facets);
    mesh.facet_materials(all.materials).material({0.4}).material({0.1}, {0.5});

    const double tolerance = count > 1 ? std::atof(arguments[1]) : 2e-2;
    const blik::scene scene(mesh);
    const blik::coupling coupling(scene, blik::settings(tolerance), blik::threads());
    const blik::solution solution(coupling, blik::light(blik::sky()), blik::threads());
    const std::size_t facets = scene.info().facets, total = solution.report(blik::tally()).bytes;
    const std::size_t kept = scene.info().bytes + coupling.info().bytes;
    std::printf("%zu facets at %g, bytes a facet: scene %zu, coupling %zu, solution %zu, baked block %zu\n", facets,
                tolerance, scene.info().bytes / facets, coupling.info().bytes / facets, (total - kept) / facets,
                blik::block(coupling).size() / facets);
} catch (const std::exception &error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
}
