/*
 * Blik for C++17 and later: blik.h with owners, moves, containers and exceptions. Header only; adds no cost but the
 * exception's message where a call is refused.
 *
 *     blik::mesh mesh(vertices, indices);                        // any containers: 3 numbers a vertex, 3 indices a facet
 *     mesh.material({0.3}, {0.1});                               // diffuse, specular: one value per band
 *     blik::scene scene(mesh);
 *     blik::coupling coupling(scene, blik::settings(), blik::threads());
 *     blik::solution solution(coupling, blik::light(blik::sky()));
 *     blik::image image = solution.image(camera);
 *
 * The names and units are those of blik.h, which says what every member means. Objects move and do not copy; a scene
 * must outlive its couplings, a coupling its solutions. Const objects may be used by any number of threads at once.
 * With BLIK_NO_STD, too, objects own their memory: by new.
 *
 * SPDX-License-Identifier: MIT OR Apache-2.0
 */

#ifndef BLIK_HPP
#define BLIK_HPP

#include <blik.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <functional>
#include <initializer_list>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <type_traits>
#include <utility>
#include <vector>

namespace blik {

/* A refused call: the words for the status, and what blik_error tells besides. */
class error : public std::runtime_error {
public:
    explicit error(const blik_error &info) : std::runtime_error(message(info)), info_(info) {}
    const blik_error &info() const noexcept { return info_; }
    int32_t status() const noexcept { return info_.status; }

private:
    static std::string message(const blik_error &info) {
        std::string text = std::string("blik: ") + blik_status_text(info.status);
        const std::string field = blik_field_text(info.field);
        text += field.empty() ? "" : ": " + field;
        switch (info.status) {
        case BLIK_ERROR_MATERIAL:
        case BLIK_ERROR_RANGE:
        case BLIK_ERROR_CHOICE:
        case BLIK_ERROR_VERTEX_INDEX:
        case BLIK_ERROR_NORMAL_INDEX:
        case BLIK_ERROR_MATERIAL_INDEX: {
            char value[32];
            std::snprintf(value, sizeof value, "%.10g", info.value);
            text += std::string(", value ") + value + (info.band != 0 ? " in band " + std::to_string(info.band) : "");
        }
        }
        switch (info.status) {
        case BLIK_ERROR_VERTEX:
        case BLIK_ERROR_NORMAL:
        case BLIK_ERROR_VERTEX_INDEX:
        case BLIK_ERROR_NORMAL_INDEX:
        case BLIK_ERROR_MATERIAL_INDEX:
        case BLIK_ERROR_MATERIAL:
        case BLIK_ERROR_REFLECTANCE_SUM:
        case BLIK_ERROR_BODY:
            text += ", index " + std::to_string(info.index);
        }
        if (info.needed != 0) {
            text += ", needed " + std::to_string(info.needed) + ", given " + std::to_string(info.given);
        }
        return text;
    }
    blik_error info_;
};

/* Throws unless a call that was given `info` returned BLIK_OK. */
inline void check(int32_t status, const blik_error &info) {
    if (status != BLIK_OK) {
        throw error(info);
    }
}

/* A contiguous array of somebody else: any container with data() and size(), or a pointer with a length. */
template <typename T>
class view {
public:
    constexpr view() noexcept = default;
    constexpr view(T *data, std::size_t size) noexcept : data_(data), size_(size) {}
    template <std::size_t N>
    constexpr view(T (&array)[N]) noexcept : data_(array), size_(N) {}
    /* A temporary lives to the end of the call that it is given to. */
    template <typename C, typename = std::enable_if_t<
                              std::is_convertible_v<decltype(std::declval<C &>().data()), T *> &&
                              !std::is_same_v<std::decay_t<C>, view>>>
    constexpr view(C &&container) noexcept : data_(container.data()), size_(container.size()) {}
    constexpr T *data() const noexcept { return data_; }
    constexpr std::size_t size() const noexcept { return size_; }
    constexpr bool empty() const noexcept { return size_ == 0; }
    constexpr T *begin() const noexcept { return data_; }
    constexpr T *end() const noexcept { return data_ + size_; }
    constexpr T &operator[](std::size_t index) const noexcept { return data_[index]; }

private:
    T *data_ = nullptr;
    std::size_t size_ = 0;
};

namespace detail {

template <typename T>
constexpr int32_t format() {
    if constexpr (std::is_same_v<T, double>) {
        return BLIK_F64;
    } else if constexpr (std::is_same_v<T, float>) {
        return BLIK_F32;
    } else {
        static_assert(std::is_integral_v<T> && sizeof(T) <= 8, "float, double or integers");
        return sizeof(T) == 1 ? BLIK_U8 : sizeof(T) == 2 ? BLIK_U16 : sizeof(T) == 4 ? BLIK_U32 : BLIK_U64;
    }
}

template <typename T>
struct numbers {
    using type = T;
};
template <typename T, std::size_t N>
struct numbers<std::array<T, N>> {
    using type = T;
};

/* Entries of `width` numbers each, from a container of numbers or of std::array of them. */
template <typename C>
blik_array array(const C &container, std::size_t width) {
    using entry = std::decay_t<decltype(*container.data())>;
    using number = typename numbers<entry>::type;
    const std::size_t all = container.size() * (sizeof(entry) / sizeof(number));
    if (all % width != 0) {
        throw std::invalid_argument("blik: " + std::to_string(all) + " numbers, which is no multiple of " +
                                    std::to_string(width));
    }
    return blik_array{container.data(), all / width, width * sizeof(number), format<number>()};
}

/* Any layout. */
inline blik_array array(const blik_array &layout, std::size_t) { return layout; }

inline void run_on_threads(void *, std::size_t count, blik_task task, void *context) noexcept {
    std::vector<std::thread> threads;
    try {
        threads.reserve(count);
        for (std::size_t i = 1; i < count; ++i) {
            threads.emplace_back(task, context, i);
        }
    } catch (...) {
        // no more threads, or no memory for them: the first one takes all work that is left
    }
    task(context, 0);
    for (std::thread &thread : threads) {
        thread.join();
    }
}

/* Scratch memory of the size that `size` tells. */
class scratch {
public:
    template <typename Size>
    explicit scratch(Size size) {
        blik_error info{};
        check(size(&info, &size_), info);
        memory_.reset(new unsigned char[size_]);
    }
    unsigned char *data() const noexcept { return memory_.get(); }
    std::size_t size() const noexcept { return size_; }

private:
    std::unique_ptr<unsigned char[]> memory_;
    std::size_t size_ = 0;
};

/* Frees a handle and, without the standard library, the memory in which it stands. */
template <typename H>
class owner {
public:
    owner() = default;
    owner(owner &&other) noexcept
        : handle_(std::exchange(other.handle_, nullptr)), memory_(std::move(other.memory_)) {}
    owner &operator=(owner &&other) noexcept {
        owner(std::move(other)).swap(*this);
        return *this;
    }
    ~owner() { destroy(handle_); }
    void swap(owner &other) noexcept {
        std::swap(handle_, other.handle_);
        memory_.swap(other.memory_);
    }
    const H *get() const noexcept { return handle_; }

    H *handle_ = nullptr;
    std::unique_ptr<unsigned char[]> memory_;

private:
    static void destroy(blik_scene *handle) noexcept { blik_scene_destroy(handle); }
    static void destroy(blik_coupling *handle) noexcept { blik_coupling_destroy(handle); }
    static void destroy(blik_solution *handle) noexcept { blik_solution_destroy(handle); }
    static void destroy(blik_plane_scene *handle) noexcept { blik_plane_scene_destroy(handle); }
    static void destroy(blik_plane_coupling *handle) noexcept { blik_plane_coupling_destroy(handle); }
    static void destroy(blik_plane_solution *handle) noexcept { blik_plane_solution_destroy(handle); }
};

#ifndef BLIK_STD
/* Memory of the size that `size` tells, handed to `init`, and more as long as that asks for more. */
template <typename H, typename Size, typename Init>
owner<H> in_memory(Size size, Init init) {
    blik_error info{};
    std::size_t bytes = 0;
    check(size(&info, &bytes), info);
    for (;;) {
        owner<H> made;
        const H *handle = nullptr;
        made.memory_.reset(new unsigned char[bytes]);
        const int32_t status = init(made.memory_.get(), bytes, &info, &handle);
        if (status == BLIK_ERROR_BUFFER_TOO_SMALL && info.needed > bytes) {
            bytes = info.needed;
            continue;
        }
        check(status, info);
        made.handle_ = const_cast<H *>(handle);
        return made;
    }
}
#endif

} // namespace detail

/* Entries that stand `stride` bytes apart in the caller's memory, by the first number of the first of them:
 *
 *     struct vertex { float position[3], normal[3], u, v; };
 *     blik::mesh mesh(blik::strided(vertices[0].position, vertices.size(), sizeof(vertex)), indices);
 */
template <typename T>
blik_array strided(const T *first, std::size_t count, std::size_t stride) {
    return blik_array{first, count, stride, detail::format<T>()};
}

/* How long stages run: on the calling thread. */
inline blik_run alone() {
    blik_run run;
    blik_run_init(&run);
    return run;
}

/* How long stages run: on `count` threads, 0 for as many as there are processors. */
inline blik_run threads(unsigned count = 0) {
    blik_run run = alone();
    const unsigned all = count != 0 ? count : std::thread::hardware_concurrency();
    run.lanes = all == 0 ? 1 : all > 256 ? 256 : all;
    run.parallel = detail::run_on_threads;
    return run;
}

/* Tells the share of a stage that is done to `told`, which returns whether to go on; where it returns false or throws,
 * the stage ends with BLIK_ERROR_CANCELLED. No exception passes through the library: rethrow() throws what was thrown.
 *
 *     blik::progress progress([&](double done) { return !window.closed(done); });
 *     blik::coupling coupling(scene, blik::settings(), progress.on(blik::threads()));
 */
class progress {
public:
    explicit progress(std::function<bool(double)> told) : told_(std::move(told)) {}
    progress(const progress &) = delete;
    progress &operator=(const progress &) = delete;
    /* `run` with this progress, which must outlive its use. */
    blik_run on(blik_run run = alone()) noexcept {
        run.progress = call;
        run.progress_user = this;
        return run;
    }
    void rethrow() {
        if (thrown_) {
            std::rethrow_exception(std::exchange(thrown_, nullptr));
        }
    }

private:
    static int32_t call(void *user, double done) noexcept {
        progress &self = *static_cast<progress *>(user);
        try {
            return self.told_(done) ? 0 : 1;
        } catch (...) {
            self.thrown_ = std::current_exception();
            return 1;
        }
    }
    std::function<bool(double)> told_;
    std::exception_ptr thrown_;
};

/* blik_settings with its defaults; an image tolerance of 0 is the tolerance. */
inline blik_settings settings(double tolerance = 2e-3, double image_tolerance = 0) {
    blik_settings value;
    blik_settings_init(&value);
    value.tolerance = tolerance;
    value.image_tolerance = image_tolerance;
    return value;
}

/* blik_sky with its defaults: radiance 1 in all bands. */
inline blik_sky sky(int32_t model = BLIK_SKY_UNIFORM) {
    blik_sky value;
    blik_sky_init(&value);
    value.model = model;
    return value;
}

/* blik_sun with its defaults: irradiance pi in all bands. */
inline blik_sun sun(const std::array<double, 3> &direction) {
    blik_sun value;
    blik_sun_init(&value);
    for (std::size_t k = 0; k < 3; ++k) {
        value.direction[k] = direction[k];
    }
    return value;
}

/* A sky, a sun or both; copied, but for the arrays that they point to. */
class light {
public:
    explicit light(const blik_sky &sky) : sky_(sky), has_sky_(true) {}
    explicit light(const blik_sun &sun) : sun_(sun), has_sun_(true) {}
    light(const blik_sky &sky, const blik_sun &sun) : sky_(sky), sun_(sun), has_sky_(true), has_sun_(true) {}
    /* One value per band, to which tolerance and errors are related. */
    light &reference_radiance(std::vector<double> values) {
        reference_ = std::move(values);
        return *this;
    }
    blik_light get() const noexcept {
        blik_light value;
        blik_light_init(&value);
        value.sky = has_sky_ ? &sky_ : nullptr;
        value.sun = has_sun_ ? &sun_ : nullptr;
        value.reference_radiance = reference_.empty() ? nullptr : reference_.data();
        return value;
    }

private:
    blik_sky sky_{};
    blik_sun sun_{};
    bool has_sky_ = false;
    bool has_sun_ = false;
    std::vector<double> reference_;
};

/* An orthographic camera; height in the mesh's unit. */
inline blik_camera orthographic(const std::array<double, 3> &eye, const std::array<double, 3> &target, double height,
                                std::size_t columns, std::size_t rows) {
    blik_camera camera;
    blik_camera_init(&camera);
    for (std::size_t k = 0; k < 3; ++k) {
        camera.eye[k] = eye[k];
        camera.target[k] = target[k];
    }
    camera.height = height;
    camera.columns = columns;
    camera.rows = rows;
    return camera;
}

/* A perspective camera; vertical field of view in degrees. */
inline blik_camera perspective(const std::array<double, 3> &eye, const std::array<double, 3> &target, double fov_deg,
                               std::size_t columns, std::size_t rows) {
    blik_camera camera = orthographic(eye, target, 0.0, columns, rows);
    camera.projection = BLIK_PERSPECTIVE;
    camera.fov_deg = fov_deg;
    return camera;
}

/* A mesh over arrays of the caller, which are read where a scene is made of it, and materials of its own. */
class mesh {
public:
    /* 3 numbers a vertex, 3 indices a facet: containers of numbers or of std::array of 3, or strided(). */
    template <typename V, typename F>
    mesh(const V &vertices, const F &facets, std::size_t bands = 1) {
        blik_mesh_init(&mesh_);
        mesh_.vertices = detail::array(vertices, 3);
        mesh_.facets = detail::array(facets, 3);
        mesh_.bands = bands;
    }
    /* Any layout. */
    explicit mesh(const blik_mesh &arrays) : mesh_(arrays) {}

    /* Adds a material; empty: zeros. Its index is its place. */
    mesh &material(std::vector<double> diffuse, std::vector<double> specular = {}, std::vector<double> emission = {},
                   double gloss_axis_ratio = 0.0, uint32_t gloss_rays = 0) {
        for (const std::vector<double> *values : {&diffuse, &specular, &emission}) {
            if (!values->empty() && values->size() != mesh_.bands) {
                throw std::invalid_argument("blik: a material needs one value per band");
            }
        }
        materials_.push_back({std::move(diffuse), std::move(specular), std::move(emission), gloss_axis_ratio, gloss_rays});
        return *this;
    }
    /* One material index a facet. */
    template <typename M>
    mesh &facet_materials(const M &indices) {
        mesh_.facet_materials = detail::array(indices, 1);
        return *this;
    }
    /* 3 numbers a normal, one normal a vertex: mirror directions follow them. */
    template <typename N>
    mesh &normals(const N &normals) {
        mesh_.normals = detail::array(normals, 3);
        return *this;
    }
    mesh &two_sided(bool both = true) {
        mesh_.two_sided = both ? 1 : 0;
        return *this;
    }

    /* Calls `with` with the struct of the C interface. */
    template <typename W>
    auto with(W with) const {
        std::vector<blik_material> materials;
        const auto values = [](const std::vector<double> &v) { return v.empty() ? nullptr : v.data(); };
        for (const owned &m : materials_) {
            materials.push_back({values(m.diffuse), values(m.specular), values(m.emission), m.gloss_axis_ratio, m.gloss_rays});
        }
        blik_mesh all = mesh_;
        if (!materials.empty()) {
            all.materials = materials.data();
            all.material_count = materials.size();
        }
        return with(all);
    }

private:
    struct owned {
        std::vector<double> diffuse, specular, emission;
        double gloss_axis_ratio;
        uint32_t gloss_rays;
    };
    blik_mesh mesh_;
    std::vector<owned> materials_;
};

/* A checked mesh, ready for rays. */
class scene {
public:
    explicit scene(const mesh &mesh) {
        mesh.with([&](const blik_mesh &arrays) {
#ifdef BLIK_STD
            blik_error info{};
            check(blik_scene_create(&arrays, &info, &owner_.handle_), info);
#else
            owner_ = detail::in_memory<blik_scene>(
                [&](blik_error *e, std::size_t *bytes) { return blik_scene_size(&arrays, e, bytes); },
                [&](void *memory, std::size_t bytes, blik_error *e, const blik_scene **out) {
                    return blik_scene_init(&arrays, memory, bytes, e, out);
                });
#endif
        });
    }
    const blik_scene *get() const noexcept { return owner_.get(); }
    blik_scene_info info() const {
        blik_error info{};
        blik_scene_info value{};
        check(blik_scene_get_info(get(), &info, &value), info);
        return value;
    }
    /* The first facet that each ray meets. */
    void closest_hits(view<const blik_ray> rays, view<blik_hit> hits, const blik_run &run = alone()) const {
        if (rays.size() != hits.size()) {
            throw std::invalid_argument("blik: one hit per ray");
        }
        blik_error info{};
        check(blik_closest_hits(get(), rays.data(), rays.size(), &run, &info, hits.data()), info);
    }
    /* Has rays traced by the caller's tracer, whose functions must not throw; nobody else may use the scene meanwhile. */
    void set_intersector(const blik_intersector &intersector) {
        blik_error info{};
        check(blik_scene_set_intersector(get(), &intersector, &info), info);
    }
    /* Whether each ray meets any facet: 1 or 0. */
    void any_hits(view<const blik_ray> rays, view<uint8_t> hits, const blik_run &run = alone()) const {
        if (rays.size() != hits.size()) {
            throw std::invalid_argument("blik: one hit per ray");
        }
        blik_error info{};
        check(blik_any_hits(get(), rays.data(), rays.size(), &run, &info, hits.data()), info);
    }

private:
    friend class loaded;
    scene() = default;
    explicit scene(const blik_scene *handle) { owner_.handle_ = const_cast<blik_scene *>(handle); }
    detail::owner<blik_scene> owner_;
};

/* Extended form factors of a scene, which must outlive it. */
class coupling {
public:
    explicit coupling(const scene &scene, const blik_settings &settings = blik::settings(),
                      const blik_run &run = alone()) {
#ifdef BLIK_STD
        blik_error info{};
        check(blik_coupling_create(scene.get(), &settings, &run, &info, &owner_.handle_), info);
#else
        owner_ = detail::in_memory<blik_coupling>(
            [&](blik_error *e, std::size_t *bytes) { return blik_coupling_size(scene.get(), &settings, e, bytes); },
            [&](void *memory, std::size_t bytes, blik_error *e, const blik_coupling **out) {
                return blik_coupling_init(scene.get(), &settings, &run, memory, bytes, e, out);
            });
#endif
        bands_ = scene.info().bands;
    }
    const blik_coupling *get() const noexcept { return owner_.get(); }
    std::size_t bands() const noexcept { return bands_; }
    blik_coupling_info info() const {
        blik_error info{};
        blik_coupling_info value{};
        check(blik_coupling_get_info(get(), &info, &value), info);
        return value;
    }

private:
    friend class loaded;
    coupling() = default;
    coupling(const blik_coupling *handle, std::size_t bands) : bands_(bands) {
        owner_.handle_ = const_cast<blik_coupling *>(handle);
    }
    detail::owner<blik_coupling> owner_;
    std::size_t bands_ = 0;
};

/* Radiance by row (0 at the top), column and band. */
struct image {
    std::size_t columns = 0, rows = 0, bands = 0;
    std::vector<float> pixels;
    blik_tally tally{};

    float at(std::size_t row, std::size_t column, std::size_t band = 0) const {
        if (column >= columns || band >= bands) {
            throw std::out_of_range("blik: a column or band outside the image");
        }
        return pixels.at((row * columns + column) * bands + band);
    }
};

/* What arrives at facets and leaves them: one value per facet, side and band, bands innermost. */
struct facets {
    std::vector<double> areas, irradiance, radiance;
};

/* A scene under one light, solved; its coupling must outlive it. */
class solution {
public:
    solution(const coupling &coupling, const light &light, const blik_run &run = alone()) : bands_(coupling.bands()) {
        const blik_light value = light.get();
#ifdef BLIK_STD
        blik_error info{};
        check(blik_solution_create(coupling.get(), &value, &run, &info, &owner_.handle_), info);
#else
        owner_ = detail::in_memory<blik_solution>(
            [&](blik_error *e, std::size_t *bytes) { return blik_solution_size(coupling.get(), &value, e, bytes); },
            [&](void *memory, std::size_t bytes, blik_error *e, const blik_solution **out) {
                return blik_solution_init(coupling.get(), &value, &run, memory, bytes, e, out);
            });
#endif
    }
    const blik_solution *get() const noexcept { return owner_.get(); }
    std::size_t bands() const noexcept { return bands_; }

    /* The whole image. */
    blik::image image(const blik_camera &camera, const blik_run &run = alone()) const {
        // refuses a camera of too many pixels
        const detail::scratch scratch(
            [&](blik_error *e, std::size_t *bytes) { return blik_image_scratch_size(get(), &camera, &run, e, bytes); });
        blik::image out{camera.columns, camera.rows, bands_, {}, {}};
        out.pixels.resize(camera.columns * camera.rows * bands_);
        blik_error info{};
        check(blik_image(get(), &camera, &run, scratch.data(), scratch.size(), &info, out.pixels.data(),
                         out.pixels.size(), nullptr, &out.tally),
              info);
        return out;
    }
    /* Rows first .. first + rows of it, for schedulers and processes of the caller. */
    blik::image image_rows(const blik_camera &camera, std::size_t first, std::size_t rows) const {
        const detail::scratch scratch(
            [&](blik_error *e, std::size_t *bytes) { return blik_image_scratch_size(get(), &camera, nullptr, e, bytes); });
        blik::image out{camera.columns, rows <= camera.rows ? rows : 0, bands_, {}, {}};
        out.pixels.resize(out.columns * out.rows * bands_);
        blik_error info{};
        check(blik_image_rows(get(), &camera, first, rows, scratch.data(), scratch.size(), &info,
                              out.pixels.data(), out.pixels.size(), nullptr, &out.tally),
              info);
        return out;
    }
    /* How good an image is; `tally` of all its rows. */
    blik_report report(const blik_tally &tally) const {
        blik_error info{};
        blik_report value{};
        check(blik_get_report(get(), &tally, &info, &value), info);
        return value;
    }
    /* One entry per direction and band; three numbers a direction, toward the object. */
    std::vector<blik_signature> signatures(view<const std::array<double, 3>> directions,
                                           const blik_run &run = alone(), std::size_t cells = 0) const {
        std::vector<blik_signature> out(directions.size() * bands_);
        blik_error info{};
        const double *first = directions.empty() ? nullptr : directions.data()->data();
        const detail::scratch scratch(
            [&](blik_error *e, std::size_t *bytes) { return blik_radiance_scratch_size(get(), &run, e, bytes); });
        check(blik_signatures(get(), first, directions.size(), cells, &run, scratch.data(), scratch.size(), &info,
                              out.data()),
              info);
        return out;
    }
    /* Radiance against each ray, one value per band. */
    std::vector<double> radiance(view<const blik_ray> rays, const blik_run &run = alone()) const {
        std::vector<double> out(rays.size() * bands_);
        blik_error info{};
        const detail::scratch scratch(
            [&](blik_error *e, std::size_t *bytes) { return blik_radiance_scratch_size(get(), &run, e, bytes); });
        check(blik_radiance(get(), rays.data(), rays.size(), &run, scratch.data(), scratch.size(), &info, out.data()),
              info);
        return out;
    }
    /* All facets of the scene that it was made of. */
    blik::facets facets(const blik::scene &scene) const {
        const blik_scene_info all = scene.info();
        const std::size_t values = all.facets * all.sides * all.bands;
        blik::facets out{std::vector<double>(all.facets), std::vector<double>(values), std::vector<double>(values)};
        blik_error info{};
        check(blik_facets(get(), 0, all.facets, &info, out.areas.data(), out.irradiance.data(), out.radiance.data()),
              info);
        return out;
    }
    /* The radiance per band to which errors are related. */
    std::vector<double> reference() const {
        std::vector<double> out(bands_);
        blik_error info{};
        check(blik_solution_get_reference(get(), &info, out.data()), info);
        return out;
    }

private:
    friend class loaded;
    solution() = default;
    solution(const blik_solution *handle, std::size_t bands) : bands_(bands) {
        owner_.handle_ = const_cast<blik_solution *>(handle);
    }
    detail::owner<blik_solution> owner_;
    std::size_t bands_ = 0;
};

/* The tolerance to which an image had better be computed again, whose rounds, to have the error `asked`, had these
 * reports; 0: no more.
 *
 *     std::vector<blik_report> rounds;
 *     for (double tolerance = 0; (tolerance = blik::next_tolerance(rounds, 5e-4)) > 0;) {
 *         const blik::coupling coupling(scene, blik::settings(tolerance, 5e-4));
 *         const blik::solution solution(coupling, light);
 *         image = solution.image(camera);
 *         rounds.push_back(solution.report(image.tally));
 *     }
 */
inline double next_tolerance(view<const blik_report> rounds, double asked) {
    const blik_report *last = rounds.empty() ? nullptr : rounds.end() - 1;
    blik_error info{};
    double tolerance = 0.0;
    check(blik_next_tolerance(last, rounds.size() > 1 ? last - 1 : nullptr, asked, static_cast<uint32_t>(rounds.size()),
                              &info, &tolerance),
          info);
    return tolerance;
}

/* Scene, coupling and perhaps a solution as one relocatable block, on the boundary that it needs. */
class block {
public:
    explicit block(const coupling &coupling) : block(coupling.get(), nullptr) {}
    block(const coupling &coupling, const solution &solution) : block(coupling.get(), solution.get()) {}
    block(block &&other) noexcept
        : memory_(std::move(other.memory_)), start_(std::exchange(other.start_, nullptr)),
          size_(std::exchange(other.size_, 0)) {}
    block &operator=(block &&other) noexcept {
        block moved(std::move(other));
        memory_.swap(moved.memory_);
        std::swap(start_, moved.start_);
        std::swap(size_, moved.size_);
        return *this;
    }
    const unsigned char *data() const noexcept { return start_; }
    std::size_t size() const noexcept { return size_; }

private:
    block(const blik_coupling *coupling, const blik_solution *solution) {
        blik_error info{};
        check(blik_bake_size(coupling, solution, &info, &size_), info);
        std::size_t room = size_ + BLIK_BLOCK_ALIGNMENT;
        memory_.reset(new unsigned char[room]);
        void *start = memory_.get();
        start_ = static_cast<unsigned char *>(std::align(BLIK_BLOCK_ALIGNMENT, size_, start, room));
        check(blik_bake(coupling, solution, start_, size_, &info), info);
    }
    std::unique_ptr<unsigned char[]> memory_;
    unsigned char *start_ = nullptr;
    std::size_t size_ = 0;
};

/* What a baked block holds, read where it stands: the block must outlive it. */
class loaded {
public:
    explicit loaded(view<const unsigned char> block) {
        blik_error info{};
        std::size_t bytes = 0;
        check(blik_load_size(block.data(), block.size(), &info, &bytes), info);
        memory_.reset(new unsigned char[bytes]);
        const blik_scene *scene = nullptr;
        const blik_coupling *coupling = nullptr;
        const blik_solution *solution = nullptr;
        check(blik_load(block.data(), block.size(), memory_.get(), bytes, &info, &scene, &coupling, &solution), info);
        scene_ = blik::scene(scene);
        const std::size_t bands = scene_.info().bands;
        coupling_ = blik::coupling(coupling, bands);
        solution_ = blik::solution(solution, bands);
    }
    loaded(loaded &&) noexcept = default;
    /* The handles end before the memory in which they stand. */
    loaded &operator=(loaded &&other) noexcept {
        loaded moved(std::move(other));
        std::swap(memory_, moved.memory_);
        std::swap(scene_, moved.scene_);
        std::swap(coupling_, moved.coupling_);
        std::swap(solution_, moved.solution_);
        return *this;
    }
    const blik::scene &scene() const noexcept { return scene_; }
    const blik::coupling &coupling() const noexcept { return coupling_; }
    /* Null where the block has none. */
    const blik::solution *solution() const noexcept { return solution_.get() != nullptr ? &solution_ : nullptr; }

private:
    std::unique_ptr<unsigned char[]> memory_;
    blik::scene scene_;
    blik::coupling coupling_;
    blik::solution solution_;
};

/* The plane model: circles and polylines in two dimensions.
 *
 *     blik::plane::bodies bodies;
 *     bodies.circle(-1.25, 0, 1, 0, 12).circle(1.25, 0, 1, 0, 12).material(0.3, 0.1);
 *     blik::plane::scene scene(bodies, blik::plane::settings(1e-4));
 *     blik::plane::coupling coupling(scene);
 *     blik::plane::solution solution(coupling, blik::plane::light(blik::plane::sky(1.0)));
 *     std::vector<blik_plane_sample> image = solution.image(0.3, 1000);
 */
namespace plane {

/* Bodies and materials. */
class bodies {
public:
    bodies &circle(double x, double y, double radius, uint32_t material, uint32_t elements) {
        blik_plane_body body = blank(BLIK_PLANE_CIRCLE, material, elements);
        body.centre[0] = x;
        body.centre[1] = y;
        body.radius = radius;
        return add(body, {});
    }
    /* Segments from point to point, fronts on the right of their direction. */
    bodies &polyline(std::vector<std::array<double, 2>> points, uint32_t material, uint32_t elements,
                     bool smooth = false) {
        blik_plane_body body = blank(BLIK_PLANE_POLYLINE, material, elements);
        body.smooth = smooth;
        return add(body, std::move(points));
    }
    /* The same, closed; counter-clockwise for a solid body. */
    bodies &polygon(std::vector<std::array<double, 2>> points, uint32_t material, uint32_t elements,
                    bool smooth = false) {
        blik_plane_body body = blank(BLIK_PLANE_POLYGON, material, elements);
        body.smooth = smooth;
        return add(body, std::move(points));
    }
    /* Adds a material; its index is its place. */
    bodies &material(double diffuse, double specular = 0.0, double gloss_axis_ratio = 0.0) {
        blik_plane_material value;
        blik_plane_material_init(&value);
        value.diffuse = diffuse;
        value.specular = specular;
        value.gloss_axis_ratio = gloss_axis_ratio;
        return material(value);
    }
    bodies &material(const blik_plane_material &value) {
        materials_.push_back(value);
        return *this;
    }

    /* Calls `with` with the struct of the C interface. */
    template <typename W>
    auto with(W with) const {
        std::vector<blik_plane_body> all = bodies_;
        for (std::size_t i = 0; i < all.size(); ++i) {
            all[i].points = points_[i].empty() ? nullptr : points_[i].data()->data();
            all[i].point_count = points_[i].size();
        }
        blik_plane_bodies value;
        blik_plane_bodies_init(&value);
        value.bodies = all.data();
        value.body_count = all.size();
        value.materials = materials_.data();
        value.material_count = materials_.size();
        return with(value);
    }

private:
    static blik_plane_body blank(int32_t shape, uint32_t material, uint32_t elements) {
        blik_plane_body body;
        blik_plane_body_init(&body);
        body.shape = shape;
        body.material = material;
        body.elements = elements;
        return body;
    }
    bodies &add(const blik_plane_body &body, std::vector<std::array<double, 2>> points) {
        points_.push_back(std::move(points));
        bodies_.push_back(body);
        return *this;
    }
    std::vector<blik_plane_body> bodies_;
    std::vector<std::vector<std::array<double, 2>>> points_;
    std::vector<blik_plane_material> materials_;
};

/* blik_plane_settings with its defaults. */
inline blik_plane_settings settings(double tolerance = 1e-4) {
    blik_plane_settings value;
    blik_plane_settings_init(&value);
    value.tolerance = tolerance;
    return value;
}

/* The same radiance from everywhere. */
inline blik_plane_sky sky(double radiance = 1.0) {
    blik_plane_sky value;
    blik_plane_sky_init(&value);
    value.radiance = radiance;
    return value;
}

/* A point sun; irradiance 2 by default. */
inline blik_plane_sun sun(const std::array<double, 2> &direction, double irradiance = 2.0) {
    blik_plane_sun value;
    blik_plane_sun_init(&value);
    value.direction[0] = direction[0];
    value.direction[1] = direction[1];
    value.irradiance = irradiance;
    return value;
}

/* A sky, a sun or both; copied, but for what they point to. */
class light {
public:
    explicit light(const blik_plane_sky &sky) : sky_(sky), has_sky_(true) {}
    explicit light(const blik_plane_sun &sun) : sun_(sun), has_sun_(true) {}
    light(const blik_plane_sky &sky, const blik_plane_sun &sun)
        : sky_(sky), sun_(sun), has_sky_(true), has_sun_(true) {}
    blik_plane_light get() const noexcept {
        blik_plane_light value;
        blik_plane_light_init(&value);
        value.sky = has_sky_ ? &sky_ : nullptr;
        value.sun = has_sun_ ? &sun_ : nullptr;
        return value;
    }

private:
    blik_plane_sky sky_{};
    blik_plane_sun sun_{};
    bool has_sky_ = false;
    bool has_sun_ = false;
};

/* Checked bodies with the settings by which they are solved. */
class scene {
public:
    explicit scene(const bodies &bodies, const blik_plane_settings &settings = plane::settings()) {
        bodies.with([&](const blik_plane_bodies &all) {
#ifdef BLIK_STD
            blik_error info{};
            check(blik_plane_scene_create(&all, &settings, &info, &owner_.handle_), info);
#else
            owner_ = detail::in_memory<blik_plane_scene>(
                [&](blik_error *e, std::size_t *bytes) { return blik_plane_scene_size(&all, e, bytes); },
                [&](void *memory, std::size_t bytes, blik_error *e, const blik_plane_scene **out) {
                    return blik_plane_scene_init(&all, &settings, memory, bytes, e, out);
                });
#endif
        });
    }
    const blik_plane_scene *get() const noexcept { return owner_.get(); }
    blik_plane_scene_info info() const {
        blik_error info{};
        blik_plane_scene_info value{};
        check(blik_plane_scene_get_info(get(), &info, &value), info);
        return value;
    }
    /* The first circle or segment that each ray meets. */
    std::vector<blik_plane_hit> first_hits(view<const blik_plane_ray> rays) const {
        std::vector<blik_plane_hit> out(rays.size());
        blik_error info{};
        check(blik_plane_first_hits(get(), rays.data(), rays.size(), &info, out.data()), info);
        return out;
    }
    /* What a point with a normal sees; `skip`: the circle or segment on which it is. */
    std::vector<blik_plane_span> visible(const std::array<double, 2> &point, const std::array<double, 2> &normal,
                                         uint32_t skip = BLIK_NO_FACET) const {
        blik_error info{};
        std::size_t bytes = 0, most = 0;
        check(blik_plane_visible_size(get(), &info, &bytes, &most), info);
        const std::unique_ptr<unsigned char[]> scratch(new unsigned char[bytes]);
        std::vector<blik_plane_span> out(most);
        check(blik_plane_visible(get(), point.data(), normal.data(), skip, scratch.get(), bytes, &info, out.data(),
                                 out.size(), &most),
              info);
        out.resize(most);
        return out;
    }

private:
    detail::owner<blik_plane_scene> owner_;
};

/* Extended form factors of a plane scene, which must outlive it. */
class coupling {
public:
    explicit coupling(const scene &scene, const blik_run &run = alone()) {
#ifdef BLIK_STD
        blik_error info{};
        check(blik_plane_coupling_create(scene.get(), &run, &info, &owner_.handle_), info);
#else
        owner_ = detail::in_memory<blik_plane_coupling>(
            [&](blik_error *e, std::size_t *bytes) { return blik_plane_coupling_size(scene.get(), &run, e, bytes); },
            [&](void *memory, std::size_t bytes, blik_error *e, const blik_plane_coupling **out) {
                return blik_plane_coupling_init(scene.get(), &run, memory, bytes, e, out);
            });
#endif
    }
    const blik_plane_coupling *get() const noexcept { return owner_.get(); }
    blik_plane_coupling_info info() const {
        blik_error info{};
        blik_plane_coupling_info value{};
        check(blik_plane_coupling_get_info(get(), &info, &value), info);
        return value;
    }

private:
    detail::owner<blik_plane_coupling> owner_;
};

/* A plane scene under one light, solved; its coupling must outlive it. */
class solution {
public:
    solution(const coupling &coupling, const light &light, const blik_run &run = alone()) {
        const blik_plane_light value = light.get();
#ifdef BLIK_STD
        blik_error info{};
        check(blik_plane_solution_create(coupling.get(), &value, &run, &info, &owner_.handle_), info);
#else
        owner_ = detail::in_memory<blik_plane_solution>(
            [&](blik_error *e, std::size_t *bytes) {
                return blik_plane_solution_size(coupling.get(), &value, &run, e, bytes);
            },
            [&](void *memory, std::size_t bytes, blik_error *e, const blik_plane_solution **out) {
                return blik_plane_solution_init(coupling.get(), &value, &run, memory, bytes, e, out);
            });
#endif
    }
    const blik_plane_solution *get() const noexcept { return owner_.get(); }
    blik_plane_solution_info info() const {
        blik_error info{};
        blik_plane_solution_info value{};
        check(blik_plane_solution_get_info(get(), &info, &value), info);
        return value;
    }
    /* The image seen from the direction (sin angle, cos angle). */
    std::vector<blik_plane_sample> image(double angle, std::size_t samples, const blik_run &run = alone()) const {
        std::vector<blik_plane_sample> out(samples);
        with_scratch(run, [&](void *scratch, std::size_t bytes, blik_error *info) {
            return blik_plane_image(get(), angle, samples, 0, samples, &run, scratch, bytes, info, out.data());
        });
        return out;
    }
    /* Radiance against each ray. */
    std::vector<blik_plane_sample> radiance(view<const blik_plane_ray> rays, const blik_run &run = alone()) const {
        std::vector<blik_plane_sample> out(rays.size());
        with_scratch(run, [&](void *scratch, std::size_t bytes, blik_error *info) {
            return blik_plane_radiance(get(), rays.data(), rays.size(), &run, scratch, bytes, info, out.data());
        });
        return out;
    }
    /* All unknowns of the scene that it was made of. */
    std::vector<blik_plane_unknown> unknowns(const plane::scene &scene) const {
        std::vector<blik_plane_unknown> out(scene.info().unknowns);
        blik_error info{};
        check(blik_plane_get_unknowns(get(), 0, out.size(), &info, out.data()), info);
        return out;
    }

private:
    template <typename F>
    void with_scratch(const blik_run &run, F call) const {
        blik_error info{};
        const detail::scratch scratch(
            [&](blik_error *e, std::size_t *bytes) { return blik_plane_scratch_size(get(), &run, e, bytes); });
        check(call(scratch.data(), scratch.size(), &info), info);
    }
    detail::owner<blik_plane_solution> owner_;
};

} // namespace plane

} // namespace blik

#endif /* BLIK_HPP */
