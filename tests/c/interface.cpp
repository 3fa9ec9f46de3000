// The C++ header: moves, exceptions, threads, containers. Exit 0 when all is as stated; compiled as C++17 to C++23.
#include <blik.hpp>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <thread>
#include <vector>

#include "require.hpp"

static_assert(!std::is_copy_constructible_v<blik::scene> && std::is_nothrow_move_constructible_v<blik::scene>);
static_assert(!std::is_copy_assignable_v<blik::solution> && std::is_nothrow_move_assignable_v<blik::solution>);

// Most rays that the caller's ray tracer is asked for at once.
#ifdef BLIK_STD
constexpr std::size_t batch = 32;
#else
constexpr std::size_t batch = 8;
#endif

int main() {
    const std::vector<std::array<double, 3>> vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {0, 1, 1}};
    const std::array<std::array<uint32_t, 3>, 4> facets = {{{0, 1, 2}, {0, 2, 3}, {0, 3, 5}, {0, 5, 4}}};
    const std::vector<uint16_t> materials = {0, 0, 1, 1};
    blik::mesh mesh(vertices, facets, 2);
    mesh.facet_materials(materials).material({0.5, 0.4}).material({0.1, 0.2}, {0.5, 0.3}, {}, 20.0, 4);

    blik::scene first(mesh);
    blik::scene scene(std::move(first));
    REQUIRE(first.get() == nullptr && scene.get() != nullptr);
    first = std::move(scene);
    scene = std::move(first);
    REQUIRE(scene.info().facets == 4 && scene.info().bands == 2);

    const blik::coupling coupling(scene, blik::settings(2e-2), blik::threads(3));
    const std::array<double, 2> radiance = {1.0, 0.5};
    blik_sky sky = blik::sky(BLIK_SKY_HEMISPHERE);
    sky.radiance = radiance.data();
    const blik_camera camera = blik::orthographic({3, 0.5, 2}, {0.5, 0.5, 0.3}, 2.0, 9, 7);
    blik::solution solution(coupling, blik::light(sky, blik::sun({1, 0, 1})), blik::threads(2));
    const blik::image alone = solution.image(camera), threaded = solution.image(camera, blik::threads(4));
    REQUIRE(alone.pixels == threaded.pixels && alone.pixels.size() == 9 * 7 * 2);

    // rows by rows, and relit: the same coupling, other light
    blik_tally sum = blik::tally();
    std::vector<float> pixels;
    for (std::size_t row = 0; row < 7; ++row) {
        const blik::image part = solution.image_rows(camera, row, 1);
        pixels.insert(pixels.end(), part.pixels.begin(), part.pixels.end());
        blik::add(sum, part.tally);
    }
    REQUIRE(pixels == alone.pixels && sum.object_pixels == alone.tally.object_pixels);
    REQUIRE(solution.report(alone.tally).tolerance == 2e-2);
    solution = blik::solution(coupling, blik::light(blik::sky()));
    REQUIRE(solution.image(camera).pixels != alone.pixels);
    const std::vector<std::array<double, 3>> directions = {{-1, 0, -1}, {0, 0, -1}};
    const std::vector<blik_signature> signatures = solution.signatures(directions, blik::threads(2));
    REQUIRE(signatures.size() == 4 && signatures[2].projected_area > 0.99 && signatures[2].projected_area < 1.01);

    // many lights at once are each alone; an emission of its own warms what it shines on
    std::vector<blik::light> lights = {blik::light(sky, blik::sun({1, 0, 1})), blik::light(sky), blik::light()};
    lights[2].emission(std::vector<double>(4 * 2, 0.25)).reference_radiance({1, 1});
    const blik::lit all = blik::lights(coupling, lights, directions, blik::threads(2));
    REQUIRE(all.irradiance.size() == 3 * 8 && all.signatures.size() == 3 * 4);
    for (std::size_t i = 0; i < lights.size(); ++i) {
        const blik::solution one(coupling, lights[i]);
        const blik::facets each = one.facets();
        REQUIRE(std::equal(each.irradiance.begin(), each.irradiance.end(), all.irradiance.begin() + 8 * i));
        REQUIRE(std::equal(each.radiance.begin(), each.radiance.end(), all.radiance.begin() + 8 * i));
        REQUIRE(one.signatures(directions)[3].radiant_intensity == all.signatures[4 * i + 3].radiant_intensity);
    }
    REQUIRE(all.radiance[16] > 0.25 && blik::lights(coupling, {}).irradiance.empty());

    // what a signature is made of adds up to it
    const blik::explanation why = blik::explain(coupling, lights[0], directions);
    REQUIRE(why.signatures[3].radiant_intensity == all.signatures[3].radiant_intensity);
    REQUIRE(why.shares.size() == 16 && why.by_diffuse.size() == 16 && why.by_emission.size() == 16 && why.terms.size() == 12);
    double shares = 0, terms = 0;
    for (std::size_t facet = 0; facet < 4; ++facet) {
        shares += why.shares[8 + 2 * facet + 1];
    }
    for (std::size_t term = 0; term < 3; ++term) {
        terms += why.terms[6 + 2 * term + 1];
    }
    const double whole = why.signatures[3].radiant_intensity;
    REQUIRE(std::abs(shares - whole) < 1e-12 * whole && std::abs(terms - whole) < 1e-12 * whole);
    REQUIRE(why.by_diffuse[8] > 0 && why.by_emission[8] > 0);

    // what is kept of a coupling where a part is moved: nothing of what it faces; all of it where both move as one
    const blik_pose lifted = blik::pose({1, 0, 0, 0}, {0, 0, 0.5});
    for (const blik_pose &other : {blik::rest(), lifted}) {
        const blik::parts parts{{0, 0, 1, 1}, {other, lifted}};
        const blik::scene posed(mesh, parts);
        const blik::coupling now(coupling, posed, parts, blik::threads(2));
        REQUIRE(now.update().kept + now.update().redone == now.info().unknowns && now.update().rescaled == 0);
        const blik::lit light = blik::lights(now, lights, directions);
        const double was = all.signatures[3].radiant_intensity, is = light.signatures[3].radiant_intensity;
        REQUIRE(std::abs(is - was) < 0.2 * was + all.signatures[3].error_estimate + light.signatures[3].error_estimate);
    }
    const blik::coupling unmoved(coupling, scene);
    REQUIRE(unmoved.update().rays == 0 && unmoved.update().redone == 0);

    std::vector<blik_ray> rays(1);
    rays[0] = {{0.5, 0.5, 2}, {0, 0, -1}, 1e9, BLIK_NO_FACET};
    std::vector<blik_hit> hits(1);
    scene.closest_hits(rays, hits);
    REQUIRE(hits[0].t == 2.0 && hits[0].facet < 2 && hits[0].front == 1);

    std::vector<uint8_t> any(1);
    scene.any_hits(rays, any);
    REQUIRE(any[0] == 1);
    const std::vector<double> seen = solution.radiance(rays);
    const blik::facets values = solution.facets(scene);
    REQUIRE(seen.size() == 2 && seen[0] > 0 && solution.reference().size() == 2);
    REQUIRE(values.areas[0] == 0.5 && values.radiance.size() == 8 && values.radiance[0] > 0);

    // baked, moved elsewhere, read again: the same bits; and lit anew
    const blik::block block(coupling, solution), unsolved(coupling);
    std::vector<unsigned char> kept(block.size() + 64);
    unsigned char *place = kept.data() + (64 - reinterpret_cast<std::uintptr_t>(kept.data()) % 64) % 64;
    std::copy(block.data(), block.data() + block.size(), place);
    blik::loaded loaded(blik::view<const unsigned char>(place, block.size()));
    const blik::loaded moved(std::move(loaded));
    REQUIRE(moved.solution() != nullptr && moved.solution()->image(camera).pixels == solution.image(camera).pixels);
    const blik::light sun(sky, blik::sun({1, 0, 1}));
    REQUIRE(blik::solution(moved.coupling(), sun).image(camera).pixels == alone.pixels);
    const blik::loaded dark(unsolved);
    REQUIRE(dark.solution() == nullptr && moved.scene().info().facets == 4);

    // rays traced by somebody else: another scene's tree, and one whose answers are all wrong
    struct tracer {
        blik::scene scene;
        bool right;
        std::atomic<std::size_t> rays{0}, calls{0}, shadows{0}, shadow_calls{0}, most{0};
    };
    const auto first_facets = [](void *user, const blik_ray *sent, std::size_t count, uint32_t *found) {
        tracer &self = *static_cast<tracer *>(user);
        self.rays += count;
        self.most = std::max<std::size_t>(self.most, count);
        self.calls += 1;
        for (std::size_t i = 0; i < count; ++i) {
            blik_hit hit;
            hit.facet = 3;
            if (self.right && blik_closest_hits(self.scene.get(), sent + i, 1, nullptr, nullptr, &hit, 1) != BLIK_OK) {
                std::abort();
            }
            found[i] = self.right || i % 2 == 0 ? hit.facet : 1000;
        }
    };
    const auto any_facets = [](void *user, const blik_ray *sent, std::size_t count, uint8_t *found) {
        static_cast<tracer *>(user)->shadows += count;
        static_cast<tracer *>(user)->shadow_calls += 1;
        if (blik_any_hits(static_cast<tracer *>(user)->scene.get(), sent, count, nullptr, nullptr, found, count) != BLIK_OK) {
            std::abort();
        }
    };
    for (const bool right : {true, false}) {
        tracer other{blik::scene(mesh), right, {}, {}, {}, {}, {}};
        blik_intersector intersector;
        blik_intersector_init(&intersector);
        intersector.first_facets = first_facets;
        intersector.any_facets = any_facets;
        intersector.user = &other;
        blik::scene traced(mesh);
        traced.set_intersector(intersector);
        const blik::coupling own(traced, blik::settings(2e-2), blik::threads(2));
        REQUIRE(blik::solution(own, sun).image(camera, blik::threads(2)).pixels == alone.pixels && other.rays > 1000);
        // in batches where the library may
        REQUIRE(other.most == batch && other.rays > other.calls && other.shadows > other.shadow_calls);
        std::vector<blik_ray> many(100, rays[0]);
        std::vector<blik_hit> found(100);
        const std::size_t before = other.calls;
        traced.closest_hits(many, found);
        REQUIRE(found[99].t == 2.0 && other.calls - before <= 320 / batch);
        // without a function for any facets: facets that rays do not meet are found out there, too
        intersector.any_facets = nullptr;
        traced.set_intersector(intersector);
        const std::size_t shadows = other.shadows;
        REQUIRE(blik::solution(own, sun).image(camera).pixels == alone.pixels && other.shadows == shadows);
    }
    REQUIRE(blik_scene_set_intersector(scene.get(), nullptr, nullptr) == BLIK_OK);

    // many threads at the same objects at once
    std::vector<int> same(4, 0);
    std::vector<std::thread> threads;
    for (int &equal : same) {
        threads.emplace_back([&] {
            const blik::solution own(moved.coupling(), sun, blik::threads(2));
            equal = own.image(camera).pixels == alone.pixels && solution.radiance(rays) == seen;
        });
    }
    for (std::thread &thread : threads) {
        thread.join();
    }
    REQUIRE(same == std::vector<int>(4, 1));

    // budgets: fewer rays, in less memory, and a report that says what it costs
    blik_settings fine = blik::settings(2e-3);
    const blik::coupling full(scene, fine);
    fine.ray_budget = full.info().rays / 8;
    const blik::coupling few(scene, fine);
    REQUIRE(few.info().rays < full.info().rays / 2 && few.info().pairs > 0);
    const blik::solution dim(few, sun), bright_one(full, sun);
    const blik_report rough = dim.report(dim.image(camera).tally), exact = bright_one.report(bright_one.image(camera).tally);
    REQUIRE(rough.error_estimate > exact.error_estimate && rough.visibility_rays == few.info().rays);
    fine.ray_budget = 0;
    fine.fit_memory = 1;
    std::size_t room = 0;
    blik_error told_why{};
    REQUIRE(blik_coupling_size(scene.get(), &fine, &told_why, &room) == BLIK_OK);
    room += full.info().bytes / 4;
    std::vector<unsigned char> little(room);
    blik_coupling *squeezed = nullptr;
    REQUIRE(blik_coupling_init(scene.get(), &fine, nullptr, little.data(), room, &told_why, &squeezed) == BLIK_OK);
    blik_coupling_info squeezed_info;
    blik_coupling_info_init(&squeezed_info);
    REQUIRE(blik_coupling_get_info(squeezed, nullptr, &squeezed_info) == BLIK_OK);
    REQUIRE(squeezed_info.bytes <= room && squeezed_info.rays < full.info().rays && squeezed_info.pairs > 0);
    fine.fit_memory = 0;
    REQUIRE(blik_coupling_init(scene.get(), &fine, nullptr, little.data(), room, &told_why, &squeezed) ==
            BLIK_ERROR_BUFFER_TOO_SMALL);
    REQUIRE(told_why.needed > room && told_why.given == room);
    blik_tally odd = alone.tally;
    odd.noise_squared = std::numeric_limits<double>::quiet_NaN();
    blik_report none_of_it{};
    blik_report_init(&none_of_it);
    REQUIRE(blik_get_report(solution.get(), &odd, &told_why, &none_of_it) == BLIK_ERROR_RANGE);
    REQUIRE(told_why.field == BLIK_FIELD_TALLY && none_of_it.tolerance == 0.0);
    odd.chain_rays = UINT64_MAX;
    blik::add(odd, odd);

    // an exception of a callback stops the stage and comes out where the caller asks for it
    int caught = 0;
    blik::progress throwing([](double) -> bool { throw std::range_error("mine"); });
    try {
        const blik::coupling never(scene, blik::settings(2e-2), throwing.on(blik::threads(2)));
    } catch (const blik::error &error) {
        caught += error.status() == BLIK_ERROR_CANCELLED;
    }
    try {
        throwing.rethrow();
    } catch (const std::range_error &) {
        caught += 1;
    }
    REQUIRE(caught == 2);
    double last = 0;
    blik::progress telling([&](double done) { return (last = done) <= 1.0; });
    const blik::coupling told(scene, blik::settings(2e-2), telling.on());
    REQUIRE(last == 1.0 && told.info().pairs == coupling.info().pairs);

    caught = 0;
    try {
        kept[kept.size() / 2] ^= 1;
        const blik::loaded damaged(blik::view<const unsigned char>(place, block.size()));
    } catch (const blik::error &error) {
        caught += error.status() == BLIK_ERROR_BLOCK;
    }
    REQUIRE(caught == 1);
    caught = 0;
    try {
        blik::coupling(scene, blik::settings(0.5));
    } catch (const blik::error &error) {
        caught += error.status() == BLIK_ERROR_RANGE && error.info().field == BLIK_FIELD_TOLERANCE;
    }
    try {
        const std::array<std::array<uint32_t, 3>, 1> wrong = {{{0, 1, 6}}};
        blik::mesh bad(vertices, wrong);
        bad.material({0.5});
        const blik::scene none(bad);
    } catch (const blik::error &error) {
        caught += error.status() == BLIK_ERROR_VERTEX_INDEX && error.info().value == 6.0;
    }
    REQUIRE(caught == 2);

    // the plane model: between two walls, and errors
    blik::plane::bodies bodies;
    bodies.circle(-1.25, 0, 1, 0, 12).circle(1.25, 0, 1, 0, 12).material(0.3, 0.1);
    bodies.polygon({{-1, -3}, {1, -3}, {1, -2}, {-1, -2}}, 1, 2).material(0.5, 0.2, 8.0);
    const blik::plane::scene flat(bodies, blik::plane::settings(1e-3));
    const blik::plane::coupling rows(flat, blik::threads(2));
    blik::plane::solution even(rows, blik::plane::light(blik::plane::sky()));
    const std::vector<blik_plane_sample> line = even.image(0.3, 200);
    REQUIRE(flat.info().primitives == 6 && rows.info().unknowns == even.unknowns(flat).size());
    REQUIRE(std::all_of(line.begin(), line.end(), [](const blik_plane_sample &s) {
        return s.object == 0 ? s.radiance == 1.0 : s.radiance > 0.05 && s.radiance < 1.0;
    }));
    const blik::plane::light both(blik::plane::sky(), blik::plane::sun({1, 2}));
    const blik::plane::solution lit(rows, both, blik::threads(3));
    const std::vector<blik_plane_sample> bright = lit.image(0.3, 200), again = lit.image(0.3, 200, blik::threads(3));
    for (std::size_t i = 0; i < 200; ++i) {
        REQUIRE(bright[i].radiance >= line[i].radiance && bright[i].radiance == again[i].radiance);
    }
    const std::vector<blik_plane_ray> down = {{{-1.25, 5}, {0, -1}}};
    REQUIRE(flat.first_hits(down)[0].primitive == 0 && lit.radiance(down)[0].object == 1);
    REQUIRE(flat.visible({0, 5}, {0, 1}).size() == 1 && flat.visible({0, 5}, {0, -1}).size() >= 5);
    even = blik::plane::solution(rows, both);
    REQUIRE(even.info().contraction < 1.0 && even.info().sweeps > 1);
    caught = 0;
    try {
        const blik::plane::scene none{blik::plane::bodies()};
    } catch (const blik::error &error) {
        caught += error.status() == BLIK_ERROR_NO_FACETS;
    }
    try {
        const blik::plane::scene none(blik::plane::bodies().circle(0, 0, -1, 0, 1).material(0.5));
    } catch (const blik::error &error) {
        caught += error.status() == BLIK_ERROR_BODY && error.info().field == BLIK_FIELD_BODY_RADIUS;
    }
    REQUIRE(caught == 2);
    std::puts("ok");
    return 0;
}
