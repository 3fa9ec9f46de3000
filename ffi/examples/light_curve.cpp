// A craft that rolls while the sun moves: its radiant intensity toward an observer over time, as CSV on standard output.
//
//     light_curve [STEPS]
//
// The craft's coupling is computed once; each step turns sky, sun and observer into the craft's own coordinates.
#include <blik.hpp>

#include "craft.h"

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>

namespace {

using vector = std::array<double, 3>;
constexpr double degree = 3.14159265358979323846 / 180;

// A direction of the world as the craft sees it, which has rolled by `angle` about its axis x.
vector in_craft(const vector &v, double angle) {
    const double c = std::cos(angle), s = std::sin(angle);
    return {v[0], c * v[1] + s * v[2], c * v[2] - s * v[1]};
}

void set(double (&to)[3], const vector &from) { std::copy(from.begin(), from.end(), to); }

} // namespace

int main(int count, char **arguments) try {
    const int steps = count > 1 ? std::atoi(arguments[1]) : 90;
    blik::mesh mesh(blik::view<const float>(&craft_vertices[0][0], 3 * CRAFT_VERTICES),
                    blik::view<const uint16_t>(&craft_facets[0][0], 3 * CRAFT_FACETS));
    mesh.facet_materials(blik::view<const unsigned char>(craft_materials));
    mesh.material({0.4}).material({0.1}, {0.5}).material({0.4}, {0.2}, {}, 10.0);
    const blik::scene scene(mesh);
    const blik::coupling coupling(scene, blik::settings(1e-2), blik::threads());

    std::puts("seconds,roll_deg,sun_elevation_deg,radiant_intensity_W_per_sr,projected_area_m2,contrast");
    for (int step = 0; step < steps; ++step) {
        const double roll = 4.0 * step, elevation = 20 + 0.25 * step;
        const double turned = roll * degree, height = elevation * degree;
        blik_sky sky = blik::sky(BLIK_SKY_OVERCAST);
        set(sky.up, in_craft({0, 0, 1}, turned));
        const blik_sun sun = blik::sun(in_craft({0.3 * std::cos(height), std::cos(height), std::sin(height)}, turned));
        const blik::solution solution(coupling, blik::light(sky, sun), blik::threads());
        // the observer looks from the side and somewhat from below
        const std::array<vector, 1> views = {in_craft({-0.2, 0.95, 0.25}, turned)};
        const blik_signature seen = solution.signatures(views).front();
        std::printf("%d,%g,%g,%.6g,%.6g,%.6g\n", step, roll, elevation, seen.radiant_intensity, seen.projected_area,
                    seen.contrast);
    }
} catch (const std::exception &error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
}
