// What callbacks throw comes out where the stage was called, whatever the stage; what is another scene's is refused; blocks
// go through files. Exit 0 when all is as stated; compiled as C++17 to C++23, and with the sanitizers.
#include <blik.hpp>

#include <cstdio>
#include <new>
#include <string>
#include <vector>

#include "require.hpp"

namespace {

int calls = 0;

// A pool without memory for its queue.
void no_memory(void *, std::size_t, blik_task, void *) {
    ++calls;
    throw std::bad_alloc();
}
// A pool that fails when its work is done.
void late(void *, std::size_t count, blik_task task, void *context) {
    for (std::size_t i = 0; i < count; ++i) {
        task(context, i);
    }
    ++calls;
    throw std::runtime_error("late");
}
// A pool that loses tasks.
void loses(void *, std::size_t, blik_task, void *) {}
int32_t no_progress(void *, double) {
    ++calls;
    throw std::runtime_error("no progress");
}

// What a call throws.
template <typename F>
std::string thrown(F call) {
    try {
        call();
    } catch (const std::bad_alloc &) {
        return "no memory";
    } catch (const std::exception &error) {
        return error.what();
    }
    return "";
}

} // namespace

int main() {
    // a wall, and a floor of many facets, so that there is work for more than one lane
    std::vector<float> vertices = {0, 0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1};
    std::vector<int> facets = {0, 1, 2, 0, 2, 3};
    constexpr int side = 12;
    for (int i = 0; i <= side * (side + 2); ++i) {
        const int row = i / (side + 1), column = i % (side + 1), at = 4 + i;
        vertices.insert(vertices.end(), {static_cast<float>(column) / side, static_cast<float>(row) / side, 0});
        if (row < side && column < side) {
            facets.insert(facets.end(), {at, at + 1, at + side + 2, at, at + side + 2, at + side + 1});
        }
    }
    constexpr std::size_t count = 2 + 2 * side * side;
    blik::mesh mesh(vertices, facets);
    mesh.material({0.5}, {0.2});
    const blik::scene scene(mesh);
    const blik_settings settings = blik::settings(0.1);
    const blik::coupling coupling(scene, settings);
    const blik::light light(blik::sky(BLIK_SKY_OVERCAST), blik::sun({1, 0.5, 2}));
    const blik::solution solution(coupling, light);
    const blik_camera camera = blik::orthographic({3, 0.5, 2}, {0.5, 0.5, 0.3}, 1.6, 40, 60);
    std::vector<blik_ray> rays(1000, blik::ray({0.5, 0.5, 2}, {0, 0, -3}));
    std::vector<blik_hit> hits(1000);
    std::vector<uint8_t> any(1000);
    const std::vector<std::array<double, 3>> directions(50, {0, 0.1, -1});
    blik::plane::bodies bodies;
    bodies.circle(-1.25, 0, 1, 0, 12).circle(1.25, 0, 1, 0, 12).material(0.3, 0.1);
    const blik::plane::scene flat(bodies, blik::plane::settings(1e-3));
    const blik::plane::coupling flat_rows(flat);
    const blik::plane::light flat_light(blik::plane::sky(), blik::plane::sun({1, 2}));
    const blik::plane::solution flat_solution(flat_rows, flat_light);

    // every stage that runs on the caller's threads
    const auto everywhere = [&](const blik_run &run, const std::string &expected) {
        REQUIRE(thrown([&] { blik::coupling none(scene, settings, run); }) == expected);
        REQUIRE(thrown([&] { blik::solution none(coupling, light, run); }) == expected);
        REQUIRE(thrown([&] { solution.image(camera, run); }) == expected);
        REQUIRE(thrown([&] { solution.image(camera, blik::with_components, run); }) == expected);
        REQUIRE(thrown([&] { solution.signatures(directions, run); }) == expected);
        REQUIRE(thrown([&] { solution.radiance(rays, run); }) == expected);
        REQUIRE(thrown([&] { scene.closest_hits(rays, hits, run); }) == expected);
        REQUIRE(thrown([&] { scene.any_hits(rays, any, run); }) == expected);
        REQUIRE(thrown([&] { blik::plane::coupling none(flat, run); }) == expected);
        REQUIRE(thrown([&] { blik::plane::solution none(flat_rows, flat_light, run); }) == expected);
        REQUIRE(thrown([&] { flat_solution.image(0.3, 200, run); }) == expected);
    };
    blik_run run = blik::alone();
    run.lanes = 2;
    run.parallel = no_memory;
    everywhere(run, "no memory");
    REQUIRE(calls == 11);
    run.parallel = late;
    everywhere(run, "late");
    run.parallel = loses;
    everywhere(run, "blik: cancelled");
    run = blik::threads(3);
    run.progress = no_progress;
    everywhere(run, "no progress");
    // and what was made before is as good as ever
    const std::vector<float> pixels = solution.image(camera).pixels;
    REQUIRE(solution.image(camera, blik::threads(2)).pixels == pixels);

    // facets are as many as the solution has; another scene's are refused
    blik::mesh rich_mesh(vertices, facets, 8);
    rich_mesh.two_sided().material(std::vector<double>(8, 0.5));
    const blik::scene rich(rich_mesh);
    const blik::coupling rich_coupling(rich, settings);
    const blik::solution rich_solution(rich_coupling, blik::light(blik::sky()));
    REQUIRE(rich_solution.facets().irradiance.size() == count * 2 * 8 && rich_solution.facets(rich).areas.size() == count);
    REQUIRE(thrown([&] { rich_solution.facets(scene); }).find("belongs to another scene") != std::string::npos);
    const blik::facets all = solution.facets(), some = solution.facets(1, 2);
    REQUIRE(some.areas.size() == 2 && some.irradiance[0] == all.irradiance[1] && some.radiance[1] == all.radiance[2]);
    REQUIRE(thrown([&] { solution.facets(count - 1, 2); }).find("rows") != std::string::npos);
    REQUIRE(thrown([&] { solution.facets(0, ~std::size_t{0}); }) != "");

    // the terms add up to the image, and rows have theirs
    const blik::image terms = solution.image(camera, blik::with_components);
    const blik::image rows = solution.image_rows(camera, 20, 3, blik::with_components);
    REQUIRE(terms.pixels == pixels && terms.components.size() == 3 * pixels.size());
    for (std::size_t column = 0; column < camera.columns; ++column) {
        float sum = 0;
        for (std::size_t term = 0; term < 3; ++term) {
            sum += terms.component(term, 21, column);
            REQUIRE(rows.component(term, 1, column) == terms.component(term, 21, column));
        }
        // three roundings to single precision
        const float off = sum - terms.at(21, column);
        REQUIRE(off < 4e-7F * (1 + sum) && -off < 4e-7F * (1 + sum));
    }
    REQUIRE(thrown([&] { terms.component(3, 0, 0); }) != "" && thrown([&] { terms.at(60, 0); }) != "");

    // rays that are none
    const auto odd = [&](double x) {
        std::vector<blik_ray> wrong = rays;
        wrong[7].direction[2] = x;
        return thrown([&] { solution.radiance(wrong); });
    };
    REQUIRE(odd(0).find("ray direction, index 7") != std::string::npos && odd(-3) != "" && odd(-1).empty());
    REQUIRE(blik::ray({0, 0, 0}, {0, 0, -3}).direction[2] == -1.0 && blik::ray({0, 0, 0}, {0, 0, 0}).direction[2] == 0.0);

    // a block by way of a file, kept by what reads it
    const std::string path = "callbacks.block";
    blik::block(coupling, solution).save(path);
    const blik::loaded read(blik::block::from_file(path));
    REQUIRE(read.solution()->image(camera).pixels == pixels && read.solution()->facets(read.scene()).areas.size() == count);
    REQUIRE(std::remove(path.c_str()) == 0);
    REQUIRE(thrown([&] { blik::block::from_file(path); }).find("callbacks.block") != std::string::npos);
    REQUIRE(thrown([&] { blik::block(coupling).save("/nowhere/to/be/found"); }).find("nowhere") != std::string::npos);
    std::puts("ok");
    return 0;
}
