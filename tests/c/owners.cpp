// Owners of blik.hpp that are moved in all ways, arrays in all layouts, and what refused calls say. Exit 0 when all is as
// stated; compiled as C++17 to C++23, and with the sanitizers.
#include <blik.hpp>

#include <cmath>
#include <cstdio>
#include <cstring>
#include <string>
#include <vector>

#include "require.hpp"

namespace {

// What a call says that is refused; empty where it is not.
template <typename F>
std::string refused(F call) {
    try {
        call();
    } catch (const std::exception &error) {
        return error.what();
    }
    return "";
}

bool has(const std::string &text, const char *part) { return text.find(part) != std::string::npos; }

const std::vector<float> vertices = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1};
const std::vector<int> facets = {0, 1, 2, 0, 2, 3, 0, 3, 5, 0, 5, 4};

blik::scene made() {
    blik::mesh mesh(vertices, facets);
    mesh.material({0.5}, {0.2});
    return blik::scene(mesh);
}

} // namespace

int main() {
    const blik_camera camera = blik::orthographic({3, 0.5, 2}, {0.5, 0.5, 0.3}, 1.6, 16, 12);
    const blik::light light(blik::sky(BLIK_SKY_OVERCAST), blik::sun({1, 0.5, 2}));

    // moved into each other and into themselves, owners keep what they own; what was moved from is refused
    blik::scene first = made(), scene = made();
    scene = std::move(first);
    blik::scene &same_scene = scene;
    scene = std::move(same_scene);
    REQUIRE(scene.info().facets == 4);
    REQUIRE(has(refused([&] { first.info(); }), "null") && has(refused([&] { blik::coupling none(first); }), "null"));
    blik::coupling begun(scene, blik::settings(1e-2)), coupling(std::move(begun));
    blik::solution solution(coupling, light);
    blik::solution &same_solution = solution;
    solution = std::move(same_solution);
    const std::vector<float> pixels = solution.image(camera).pixels;
    blik::block block(coupling), other(coupling, solution);
    block = std::move(other);
    blik::block &same_block = block;
    block = std::move(same_block);
    REQUIRE(other.data() == nullptr && other.size() == 0 && block.size() > 1000);
    blik::loaded loaded{blik::view<const unsigned char>(block.data(), block.size())};
    blik::loaded other_loaded{blik::view<const unsigned char>(block.data(), block.size())};
    loaded = std::move(other_loaded);
    blik::loaded &same_loaded = loaded;
    loaded = std::move(same_loaded);
    REQUIRE(loaded.solution() != nullptr && loaded.solution()->image(camera).pixels == pixels);
    const blik::solution relit(loaded.coupling(), light);
    REQUIRE(relit.image(camera).pixels == pixels);

    // the same mesh in other layouts: a simulator's structs, 64-bit and 8-bit indices
    struct vertex {
        float u, position[3], v;
    };
    std::vector<vertex> structs(6);
    for (std::size_t i = 0; i < 6; ++i) {
        std::memcpy(structs[i].position, &vertices[3 * i], sizeof structs[i].position);
    }
    struct triangle {
        long long corners[3];
        short material;
    };
    std::vector<triangle> triangles(4);
    std::vector<unsigned char> small(facets.begin(), facets.end());
    for (std::size_t i = 0; i < 12; ++i) {
        triangles[i / 3].corners[i % 3] = facets[i];
        triangles[i / 3].material = 0;
    }
    blik::mesh wide(blik::strided(structs[0].position, 6, sizeof(vertex)),
                    blik::strided(triangles[0].corners, 4, sizeof(triangle)));
    wide.facet_materials(blik::strided(&triangles[0].material, 4, sizeof(triangle))).material({0.5}, {0.2});
    blik::mesh narrow(vertices, small);
    narrow.material({0.5}, {0.2});
    for (const blik::mesh *mesh : {&wide, &narrow}) {
        const blik::scene laid(*mesh);
        const blik::coupling rows(laid, blik::settings(1e-2));
        REQUIRE(blik::solution(rows, light).image(camera).pixels == pixels);
    }

    // many views at once, from a temporary; as many lanes as there is scratch memory for
    const auto views = [](int count) {
        std::vector<std::array<double, 3>> all;
        for (int i = 0; i < count; ++i) {
            all.push_back({std::cos(0.1 * i), std::sin(0.1 * i), -1});
        }
        return all;
    };
    const std::vector<blik_signature> alone = solution.signatures(views(40)), many = solution.signatures(views(40), blik::threads(3));
    std::vector<blik_signature> tight(40);
    std::size_t bytes = 0;
    blik_error error{};
    REQUIRE(blik_radiance_scratch_size(solution.get(), nullptr, &error, &bytes) == BLIK_OK);
    std::vector<unsigned char> scratch(bytes + 1);
    const blik_run three = blik::threads(3);
    const auto directions = views(40);
    REQUIRE(blik_signatures(solution.get(), directions[0].data(), 40, 0, &three, scratch.data() + 1, bytes, &error,
                            tight.data(), 40, sizeof(blik_signature)) == BLIK_OK);
    REQUIRE(blik_signatures(solution.get(), directions[0].data(), 40, 0, &three, scratch.data(), bytes - 1, &error,
                            tight.data(), 40, sizeof(blik_signature)) == BLIK_ERROR_BUFFER_TOO_SMALL);
    REQUIRE(error.needed == bytes && error.given == bytes - 1);
    for (std::size_t i = 0; i < 40; ++i) {
        REQUIRE(alone[i].radiant_intensity == many[i].radiant_intensity && many[i].projected_area > 0);
        REQUIRE(alone[i].radiant_intensity == tight[i].radiant_intensity);
    }

    // computed again while the estimate is too high, at most three times, each time finer
    blik::rounds wanted(1e-3);
    std::vector<blik_report> rounds;
    do {
        REQUIRE(rounds.empty() || (wanted.tolerance() < rounds.back().tolerance && rounds.back().error_estimate > 1.3e-3));
        const blik::coupling rows(scene, wanted.settings());
        const blik::solution lit(rows, light);
        rounds.push_back(lit.report(lit.image(camera).tally));
    } while (wanted.again(rounds.back()));
    REQUIRE(rounds.size() <= 3 && wanted.tolerance() == 0);
#ifdef BLIK_NO_STD
    const double worse = 1.05; // elements beside contacts, which nothing mends there, carry it: a finer round brings little
    const double begin = 1e-3;
#else
    const double worse = 1;
    const double begin = 3.0 * 1e-3 * std::sqrt(std::sqrt(2e-3 / 1e-3)); // rays from the image's points do the rest
#endif
    REQUIRE(rounds.back().error_estimate <= worse * rounds[0].error_estimate);
    // a solution as coarse as before, and rays from the image's points
    const blik::coupling loose(scene, blik::settings(1e-2)), sharp(scene, blik::settings(1e-2, 1e-3));
    const blik::solution blurred(loose, light), precise(sharp, light);
    const blik_report by_rows = blurred.report(blurred.image(camera).tally);
    const blik_report by_rays = precise.report(precise.image(camera).tally);
    REQUIRE(by_rays.tolerance == 1e-2 && by_rays.visibility_rays == by_rows.visibility_rays);
#ifndef BLIK_NO_STD
    REQUIRE(by_rays.chain_rays > by_rows.chain_rays && by_rays.error_estimate < 0.5 * by_rows.error_estimate);
#endif
    REQUIRE(has(refused([&] { blik::coupling(scene, blik::settings(1e-2, 1e-7)); }), "tolerance, value 1e-07"));
    blik_report coarse{};
    blik_report_init(&coarse);
    coarse.tolerance = 1e-3;
    coarse.error_estimate = 2e-3;
    coarse.limited_by = BLIK_LIMIT_VISIBILITY;
    blik::rounds again(1e-3), limited(1e-3);
    REQUIRE(again.tolerance() == begin && again.again(coarse) && again.tolerance() == 5e-4);
    REQUIRE(!again.again(coarse)); // no better than before
    coarse.limited_by = BLIK_LIMIT_SAMPLING;
    REQUIRE(!limited.again(coarse));
    REQUIRE(has(refused([&] { blik::rounds none(1); }), "tolerance, value 1"));

    // refused calls say which field, value and index
    const auto mesh_of = [](const std::vector<float> &v, const std::vector<int> &f) {
        blik::mesh mesh(v, f);
        mesh.material({0.5});
        blik::scene none(mesh);
    };
    REQUIRE(has(refused([&] { mesh_of({0, 0, 0, 1}, facets); }), "4 numbers, which is no multiple of 3"));
    REQUIRE(has(refused([&] { mesh_of(vertices, {0, 1, 2, 0}); }), "no multiple of 3"));
    REQUIRE(has(refused([&] { mesh_of(vertices, {0, 1, 2, 0, 2, -1}); }), "value 4294967295, index 1"));
    REQUIRE(has(refused([&] { mesh_of(vertices, {}); }), "no facets"));
    REQUIRE(has(refused([&] { blik::coupling none(scene, blik::settings(1e-9)); }), "tolerance, value 1e-09"));
    triangles[2].corners[1] = 1LL << 40;
    REQUIRE(has(refused([&] { blik::scene none(wide); }), "index 2"));
    blik_camera large = camera;
    large.columns = large.rows = ~std::size_t{0} / 2 + 2; // as many pixels as wrap around to a few
    REQUIRE(has(refused([&] { solution.image(large); }), "columns or rows"));
    REQUIRE(has(refused([&] { solution.image_rows(camera, 10, ~std::size_t{0} / 4); }), "rows"));
    blik_sky sky = blik::sky(static_cast<blik_sky_model>(99));
    REQUIRE(has(refused([&] { blik::solution none(coupling, blik::light(sky)); }), "value 99"));
    blik_array array = blik::strided(vertices.data(), vertices.size() / 3, 8);
    REQUIRE(has(refused([&] { blik::scene none(blik::mesh(array, facets).material({0.5})); }),
                "stride: vertices, needed 12, given 8"));
    array.data = nullptr;
    array.stride = 0;
    REQUIRE(has(refused([&] { blik::scene none(blik::mesh(array, facets).material({0.5})); }), "null: vertices"));
    REQUIRE(has(refused([&] { blik::scene none(blik::mesh(vertices, vertices).material({0.5})); }), "facets, value"));
    REQUIRE(has(refused([&] {
                    blik::mesh mesh(vertices, facets);
                    blik::scene none(mesh.facet_materials(std::vector<int>{0, 0}).material({0.5}));
                }),
                "facet_materials, needed 4, given 2"));
    blik_run none = blik::alone();
    none.lanes = 0;
    REQUIRE(has(refused([&] { solution.image(camera, none); }), "lanes, needed 256, given 0"));
    REQUIRE(has(refused([&] { blik::loaded nothing(blik::view<const unsigned char>{}); }), "null"));
    REQUIRE(has(refused([&] { solution.image(camera).at(0, camera.columns); }), "outside the image"));
    std::puts("ok");
    return 0;
}
