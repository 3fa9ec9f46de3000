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
 * must outlive its couplings, a coupling its solutions: temporaries in their place do not compile. Const objects may be
 * used by any number of threads at once. With BLIK_NO_STD, too, objects own their memory: by new.
 *
 * Exceptions.  A refused call throws blik::error. What a function of blik_run throws, the caller's pool or progress,
 *   does not pass through the library: it ends the stage, and is thrown again where the stage was called. A pool that
 *   throws must have waited for the tasks that it started. Functions of a blik_intersector and of a sky must not throw.
 *
 * SPDX-License-Identifier: MIT OR Apache-2.0
 */

#ifndef BLIK_HPP
#define BLIK_HPP

#include <blik.h>
#include <blik_form_factor.h>
#include <blik_lights.h>
#include <blik_update.h>
#include <blik_plane.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <functional>
#include <initializer_list>
#include <iterator>
#include <memory>
#include <stdexcept>
#include <string>
#include <system_error>
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
    blik_status status() const noexcept { return info_.status; }

private:
    static std::string message(const blik_error &info) {
        std::string text(blik_error_text(&info, nullptr, 0) + 1, '\0');
        blik_error_text(&info, &text[0], text.size());
        text.pop_back();
        return "blik: " + text;
    }
    blik_error info_;
};

/* Throws unless a call that was given `info` returned BLIK_OK. */
inline void check(blik_status status, const blik_error &info) {
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
constexpr blik_format format() {
    if constexpr (std::is_same_v<T, double>) {
        return BLIK_F64;
    } else if constexpr (std::is_same_v<T, float>) {
        return BLIK_F32;
    } else {
        static_assert(std::is_integral_v<T> && sizeof(T) <= 8, "float, double or integers");
        return sizeof(T) == 1 ? BLIK_U8 : sizeof(T) == 2 ? BLIK_U16 : sizeof(T) == 4 ? BLIK_U32 : BLIK_U64;
    }
}

/* What an expression needs to be there. */
template <template <typename> class Expression, typename T, typename = void>
struct is_there : std::false_type {};
template <template <typename> class Expression, typename T>
struct is_there<Expression, T, std::void_t<Expression<T>>> : std::true_type {};

template <typename T>
using named = decltype(std::declval<T &>().x + std::declval<T &>().y + std::declval<T &>().z);
template <typename T>
using scalar = typename T::Scalar;
template <typename T>
using value = typename T::value_type;
template <typename T>
using subscript = decltype(std::declval<const T &>()[0]);
template <typename T>
using matrix = decltype(std::declval<const T &>().rows() + std::declval<const T &>().cols());
template <typename T>
using eigen = decltype(std::declval<const T &>().outerStride() + T::ColsAtCompileTime + T::IsRowMajor);
template <typename T>
using plain_number = std::enable_if_t<std::is_arithmetic_v<T>, T>;

/* Whether `count` numbers N, as variables, make a T in braces without loss. */
template <typename T, typename N, std::size_t... I>
constexpr auto braces(std::index_sequence<I...>, int)
    -> decltype(T{(static_cast<void>(I), std::declval<N &>())...}, bool()) {
    return true;
}
template <typename T, typename N, std::size_t... I>
constexpr bool braces(std::index_sequence<I...>, ...) {
    return false;
}

/* The type of number that a struct of `Width` equal numbers and nothing else is made of; void: it is none. */
template <typename T, std::size_t Width, typename... N>
struct equal_numbers {
    using type = void;
};
template <typename T, std::size_t Width, typename N, typename... More>
struct equal_numbers<T, Width, N, More...> {
    static constexpr bool fits =
        sizeof(T) == Width * sizeof(N) && braces<T, N>(std::make_index_sequence<Width>(), 0);
    using type =
        typename std::conditional_t<fits, std::common_type<N>, equal_numbers<T, Width, More...>>::type;
};

/* The number that an entry is made of: a number, a struct with x, y and z, a vector class of Eigen's or GLM's kind, an
 * array, a class with a subscript, or a struct of `Width` equal numbers. */
template <std::size_t Width, typename T>
auto number_of() {
    if constexpr (std::is_array_v<T>) {
        return std::remove_cv_t<std::remove_all_extents_t<T>>();
    } else if constexpr (std::is_arithmetic_v<T>) {
        return T();
    } else if constexpr (Width == 3 && is_there<named, T>::value) {
        using number = std::decay_t<decltype(std::declval<T &>().x)>;
        static_assert(std::is_same_v<number, std::decay_t<decltype(std::declval<T &>().y)>> &&
                          std::is_same_v<number, std::decay_t<decltype(std::declval<T &>().z)>>,
                      "x, y and z of one type");
        return number();
    } else if constexpr (is_there<scalar, T>::value) {
        return typename T::Scalar();
    } else if constexpr (is_there<value, T>::value) {
        return number_of<Width, std::remove_cv_t<typename T::value_type>>();
    } else if constexpr (is_there<subscript, T>::value) {
        return number_of<Width, std::decay_t<subscript<T>>>();
    } else {
        using number = typename equal_numbers<T, Width, double, float, int32_t, uint32_t, int64_t, uint64_t, int16_t,
                                              uint16_t, int8_t, uint8_t>::type;
        static_assert(!std::is_void_v<number>, "an entry is no number and no struct of as many equal numbers");
        return number();
    }
}

/* `count` entries of `Width` numbers that stand `stride` bytes apart. */
template <std::size_t Width, typename T>
blik_array entries(const T *first, std::size_t count, std::size_t stride) {
    using number = decltype(number_of<Width, std::remove_cv_t<T>>());
    const void *start = first;
    if constexpr (Width == 3 && is_there<named, T>::value) {
        if (count != 0) {
            if (&first->y != &first->x + 1 || &first->z != &first->x + 2) {
                throw std::invalid_argument("blik: x, y and z of an entry do not follow each other");
            }
            start = &first->x;
        }
    } else {
        static_assert(sizeof(T) == Width * sizeof(number), "an entry has more or fewer numbers: see blik::strided");
    }
    return blik_array{start, count, stride, format<number>()};
}

/* Entries of `Width` numbers each, from a container of numbers or of what has as many numbers. */
template <std::size_t Width, typename C>
blik_array array(const C &container) {
    if constexpr (std::is_same_v<C, blik_array>) {
        return container;
    } else if constexpr (is_there<eigen, C>::value) {
        using number = std::remove_cv_t<typename C::Scalar>;
        const auto outer = static_cast<std::size_t>(container.outerStride()) * sizeof(number);
        const auto inner = static_cast<std::size_t>(container.innerStride()) * sizeof(number);
        if constexpr (Width == 1) {
            static_assert(C::RowsAtCompileTime == 1 || C::ColsAtCompileTime == 1, "one number an entry: a vector");
            return blik_array{container.data(), static_cast<std::size_t>(container.size()), inner, format<number>()};
        } else {
            constexpr bool of_rows = C::IsRowMajor, fixed_rows = C::RowsAtCompileTime == static_cast<int>(Width);
            constexpr bool fixed_columns = C::ColsAtCompileTime == static_cast<int>(Width);
            static_assert(!(fixed_rows && fixed_columns), "as many rows as columns: entries may be either");
            static_assert(of_rows ? !fixed_rows : fixed_rows,
                          "column-major: entries must be rows of a row-major matrix, or columns of one of as many rows "
                          "as an entry has numbers, as Eigen::Matrix3Xd");
            const auto numbers = static_cast<std::size_t>(of_rows ? container.cols() : container.rows());
            const auto count = static_cast<std::size_t>(of_rows ? container.rows() : container.cols());
            if (numbers != Width || (inner != sizeof(number) && count != 0)) {
                throw std::invalid_argument("blik: " + std::to_string(numbers) + " numbers an entry, or gaps in it");
            }
            return blik_array{container.data(), count, outer, format<number>()};
        }
    } else {
        static_assert(!is_there<matrix, C>::value, "rows and columns of an order that is not known: see blik::strided");
        using entry = std::remove_cv_t<std::remove_pointer_t<decltype(std::data(container))>>;
        const std::size_t size = std::size(container);
        if constexpr (std::is_arithmetic_v<entry>) {
            if (size % Width != 0) {
                throw std::invalid_argument("blik: " + std::to_string(size) + " numbers, which is no multiple of " +
                                            std::to_string(Width));
            }
            return blik_array{std::data(container), size / Width, Width * sizeof(entry), format<entry>()};
        } else {
            return entries<Width>(std::data(container), size, sizeof(entry));
        }
    }
}

/* What a thrown exception of a callback is kept in until the call that it ended has returned. */
class guard {
public:
    explicit guard(const blik_run &run) noexcept : given_(run), run_(run) {
        if (run.parallel != nullptr) {
            run_.parallel = parallel;
            run_.parallel_user = this;
        }
        if (run.progress != nullptr) {
            run_.progress = progress;
            run_.progress_user = this;
        }
    }
    guard(const guard &) = delete;
    guard &operator=(const guard &) = delete;
    const blik_run *get() const noexcept { return &run_; }
    /* Throws what a callback threw, or what a call of status `status` refused. */
    void check(blik_status status, const blik_error &info) {
        if (thrown_) {
            std::rethrow_exception(std::exchange(thrown_, nullptr));
        }
        blik::check(status, info);
    }

private:
    static void parallel(void *user, std::size_t count, blik_task task, void *context) noexcept {
        guard &self = *static_cast<guard *>(user);
        try {
            self.given_.parallel(self.given_.parallel_user, count, task, context);
        } catch (...) {
            self.keep();
        }
    }
    static int32_t progress(void *user, double done) noexcept {
        guard &self = *static_cast<guard *>(user);
        try {
            return self.given_.progress(self.given_.progress_user, done);
        } catch (...) {
            self.keep();
            return 1;
        }
    }
    void keep() noexcept {
        if (!taken_.exchange(true)) {
            thrown_ = std::current_exception();
        }
    }
    blik_run given_, run_;
    std::atomic<bool> taken_{false};
    std::exception_ptr thrown_;
};

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
    explicit owner(H *handle, std::unique_ptr<unsigned char[]> memory = nullptr) noexcept
        : handle_(handle), memory_(std::move(memory)) {}
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
    H *get() noexcept { return handle_; }
    /* Where a call puts the handle. */
    H **place() noexcept { return &handle_; }

private:
    static void destroy(blik_scene *handle) noexcept { blik_scene_destroy(handle); }
    static void destroy(blik_coupling *handle) noexcept { blik_coupling_destroy(handle); }
    static void destroy(blik_solution *handle) noexcept { blik_solution_destroy(handle); }
    static void destroy(blik_plane_scene *handle) noexcept { blik_plane_scene_destroy(handle); }
    static void destroy(blik_plane_coupling *handle) noexcept { blik_plane_coupling_destroy(handle); }
    static void destroy(blik_plane_solution *handle) noexcept { blik_plane_solution_destroy(handle); }
    H *handle_ = nullptr;
    std::unique_ptr<unsigned char[]> memory_;
};

#ifndef BLIK_STD
/* Memory of the size that `size` tells, handed to `init`, and more as long as that asks for more. */
template <typename H, typename Size, typename Init>
owner<H> in_memory(Size size, Init init, guard *run = nullptr) {
    blik_error info{};
    std::size_t bytes = 0;
    check(size(&info, &bytes), info);
    for (;;) {
        H *handle = nullptr;
        std::unique_ptr<unsigned char[]> memory(new unsigned char[bytes]);
        const blik_status status = init(memory.get(), bytes, &info, &handle);
        if (status == BLIK_ERROR_BUFFER_TOO_SMALL && info.needed > bytes) {
            bytes = info.needed;
            continue;
        }
        if (run != nullptr) {
            run->check(status, info);
        }
        check(status, info);
        return owner<H>(handle, std::move(memory));
    }
}
#endif

} // namespace detail

/* Entries that stand `stride` bytes apart in the caller's memory, by the first number of the first of them, or by the
 * first of them where it is a struct of three numbers:
 *
 *     struct vertex { float position[3], normal[3], u, v; };
 *     blik::mesh mesh(blik::strided(vertices[0].position, vertices.size(), sizeof(vertex)), indices);
 */
template <typename T>
blik_array strided(const T *first, std::size_t count, std::size_t stride) {
    if constexpr (std::is_arithmetic_v<T>) {
        return blik_array{first, count, stride, detail::format<T>()};
    } else {
        return detail::entries<3>(first, count, stride);
    }
}

/* A point or direction: three numbers, from any struct with x, y and z or class with a subscript. */
class vector3 {
public:
    constexpr vector3(double x, double y, double z) noexcept : values_{x, y, z} {}
    template <typename T, typename = std::enable_if_t<!std::is_arithmetic_v<T> && !std::is_base_of_v<vector3, T>>>
    vector3(const T &from) : values_{} {
        if constexpr (detail::is_there<detail::named, T>::value) {
            values_ = {static_cast<double>(from.x), static_cast<double>(from.y), static_cast<double>(from.z)};
        } else {
            values_ = {static_cast<double>(from[0]), static_cast<double>(from[1]), static_cast<double>(from[2])};
        }
    }
    void put(double (&to)[3]) const noexcept {
        for (std::size_t k = 0; k < 3; ++k) {
            to[k] = values_[k];
        }
    }
    double operator[](std::size_t index) const noexcept { return values_[index]; }

private:
    std::array<double, 3> values_;
};

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
    blik_run on(blik_run run = alone()) & noexcept {
        run.progress = call;
        run.progress_user = this;
        return run;
    }
    blik_run on(blik_run run = alone()) && = delete;
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

/* A ray from `origin` along `direction`, which is made a unit vector, without a limit. */
inline blik_ray ray(const vector3 &origin, const vector3 &direction) {
    blik_ray value;
    blik_ray_init(&value);
    origin.put(value.origin);
    const double squared =
        direction[0] * direction[0] + direction[1] * direction[1] + direction[2] * direction[2];
    for (std::size_t k = 0; k < 3; ++k) {
        // zero stays zero, and is refused
        value.direction[k] = squared > 0 ? direction[k] / std::sqrt(squared) : direction[k];
    }
    return value;
}

/* blik_settings with its defaults; an image tolerance of 0 is the tolerance. */
inline blik_settings settings(double tolerance = 2e-3, double image_tolerance = 0) {
    blik_settings value;
    blik_settings_init(&value);
    value.tolerance = tolerance;
    value.image_tolerance = image_tolerance;
    return value;
}

/* blik_sky with its defaults: radiance 1 in all bands. */
inline blik_sky sky(blik_sky_model model = BLIK_SKY_UNIFORM) {
    blik_sky value;
    blik_sky_init(&value);
    value.model = model;
    return value;
}

/* blik_sun with its defaults: irradiance pi in all bands. */
inline blik_sun sun(const vector3 &direction) {
    blik_sun value;
    blik_sun_init(&value);
    direction.put(value.direction);
    return value;
}

/* A sky, a sun, both or none; copied, but for the arrays that they point to. */
class light {
public:
    /* What emission alone lights. */
    light() = default;
    explicit light(const blik_sky &sky) : sky_(sky), has_sky_(true) {}
    explicit light(const blik_sun &sun) : sun_(sun), has_sun_(true) {}
    light(const blik_sky &sky, const blik_sun &sun) : sky_(sky), sun_(sun), has_sky_(true), has_sun_(true) {}
    /* One value per band, to which tolerance and errors are related. */
    light &reference_radiance(std::vector<double> values) {
        reference_ = std::move(values);
        return *this;
    }
    /* Own diffuse radiance of each facet, side and band, bands innermost, in place of the materials' emission. */
    light &emission(std::vector<double> values) {
        emission_ = std::move(values);
        return *this;
    }
    /* The struct of the C interface, which points into this object. */
    blik_light get() const & noexcept {
        blik_light value;
        blik_light_init(&value);
        value.sky = has_sky_ ? &sky_ : nullptr;
        value.sun = has_sun_ ? &sun_ : nullptr;
        value.reference_radiance = reference_.empty() ? nullptr : reference_.data();
        value.emission = emission_.empty() ? nullptr : emission_.data();
        value.emission_count = emission_.size();
        return value;
    }
    blik_light get() && = delete;

private:
    blik_sky sky_{};
    blik_sun sun_{};
    bool has_sky_ = false;
    bool has_sun_ = false;
    std::vector<double> reference_, emission_;
};

/* An orthographic camera; height in the mesh's unit. */
inline blik_camera orthographic(const vector3 &eye, const vector3 &target, double height, std::size_t columns,
                                std::size_t rows) {
    blik_camera camera;
    blik_camera_init(&camera);
    eye.put(camera.eye);
    target.put(camera.target);
    camera.height = height;
    camera.columns = columns;
    camera.rows = rows;
    return camera;
}

/* A perspective camera; vertical field of view in degrees. */
inline blik_camera perspective(const vector3 &eye, const vector3 &target, double fov_deg, std::size_t columns,
                               std::size_t rows) {
    blik_camera camera = orthographic(eye, target, 0.0, columns, rows);
    camera.projection = BLIK_PERSPECTIVE;
    camera.fov_deg = fov_deg;
    return camera;
}

/* A mesh and its materials. Arrays that have a name are read where a scene is made of the mesh, and must live until then;
 * temporaries are moved into it.
 *
 * An array of entries of three numbers is a container of numbers, of std::array, of C arrays, of structs with x, y and z
 * (and more), of structs of three equal numbers, of vectors of Eigen or GLM; an Eigen matrix of three rows, or of three
 * columns in row-major order; or strided(). Numbers are float, double or integers of any size. */
class mesh {
public:
    /* 3 numbers a vertex, 3 indices a facet. */
    template <typename V, typename F>
    mesh(V &&vertices, F &&facets, std::size_t bands = 1) {
        blik_mesh_init(&mesh_);
        mesh_.vertices = keep<3>(std::forward<V>(vertices));
        mesh_.facets = keep<3>(std::forward<F>(facets));
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
    mesh &facet_materials(M &&indices) {
        mesh_.facet_materials = keep<1>(std::forward<M>(indices));
        return *this;
    }
    /* 3 numbers a normal, one normal a vertex unless facet_normals says otherwise: mirror directions follow them. */
    template <typename N>
    mesh &normals(N &&normals) {
        mesh_.normals = keep<3>(std::forward<N>(normals));
        return *this;
    }
    /* 3 indices of normals a facet, of 32 or 64 bits; BLIK_NO_NORMAL: the facet's own. */
    template <typename I>
    mesh &facet_normals(I &&indices) {
        mesh_.facet_normals = keep<3>(std::forward<I>(indices));
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
    template <std::size_t Width, typename C>
    blik_array keep(C &&container) {
        if constexpr (std::is_lvalue_reference_v<C> || std::is_same_v<std::decay_t<C>, blik_array>) {
            return detail::array<Width>(container);
        } else {
            auto own = std::make_shared<const std::remove_cv_t<C>>(std::forward<C>(container));
            kept_.push_back(own);
            return detail::array<Width>(*own);
        }
    }
    blik_mesh mesh_;
    std::vector<owned> materials_;
    std::vector<std::shared_ptr<const void>> kept_;
};

/* A checked mesh, ready for rays. */
/* The rigid parts of a mesh, one part a facet, and where they stand. */
struct parts {
    std::vector<uint32_t> facets;
    std::vector<blik_pose> poses;

    blik_parts get() const {
        blik_parts value;
        blik_parts_init(&value);
        value.facet_parts = facets.data();
        value.facet_count = facets.size();
        value.poses = poses.data();
        value.pose_count = poses.size();
        return value;
    }
};

/* Where the mesh has a part. */
inline blik_pose rest() { return {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}}; }

/* By a quaternion w, x, y, z of any length but zero, and a translation. */
inline blik_pose pose(const std::array<double, 4> &quaternion, const vector3 &translation = {0, 0, 0}) {
    const double moved[3] = {translation[0], translation[1], translation[2]};
    blik_error info{};
    blik_pose value;
    check(blik_pose_from_quaternion(quaternion.data(), moved, &info, &value), info);
    return value;
}

class scene {
public:
    /* A mesh whose parts stand elsewhere. */
    scene(const mesh &mesh, const parts &parts) {
        const blik_parts moved = parts.get();
        mesh.with([&](const blik_mesh &arrays) {
#ifdef BLIK_STD
            blik_error info{};
            check(blik_scene_pose_create(&arrays, &moved, &info, owner_.place()), info);
#else
            owner_ = detail::in_memory<blik_scene>(
                [&](blik_error *e, std::size_t *bytes) { return blik_scene_size(&arrays, e, bytes); },
                [&](void *memory, std::size_t bytes, blik_error *e, blik_scene **out) {
                    return blik_scene_pose_init(&arrays, &moved, memory, bytes, e, out);
                });
#endif
        });
    }
    explicit scene(const mesh &mesh) {
        mesh.with([&](const blik_mesh &arrays) {
#ifdef BLIK_STD
            blik_error info{};
            check(blik_scene_create(&arrays, &info, owner_.place()), info);
#else
            owner_ = detail::in_memory<blik_scene>(
                [&](blik_error *e, std::size_t *bytes) { return blik_scene_size(&arrays, e, bytes); },
                [&](void *memory, std::size_t bytes, blik_error *e, blik_scene **out) {
                    return blik_scene_init(&arrays, memory, bytes, e, out);
                });
#endif
        });
    }
    const blik_scene *get() const noexcept { return owner_.get(); }
    blik_scene *get() noexcept { return owner_.get(); }
    blik_scene_info info() const {
        blik_error info{};
        blik_scene_info value;
        blik_scene_info_init(&value);
        check(blik_scene_get_info(get(), &info, &value), info);
        return value;
    }
    /* The first facet that each ray meets. */
    void closest_hits(view<const blik_ray> rays, view<blik_hit> hits, const blik_run &run = alone()) const {
        blik_error info{};
        detail::guard on(run);
        on.check(blik_closest_hits(get(), rays.data(), rays.size(), on.get(), &info, hits.data(), hits.size()), info);
    }
    /* Whether each ray meets any facet: 1 or 0. */
    void any_hits(view<const blik_ray> rays, view<uint8_t> hits, const blik_run &run = alone()) const {
        blik_error info{};
        detail::guard on(run);
        on.check(blik_any_hits(get(), rays.data(), rays.size(), on.get(), &info, hits.data(), hits.size()), info);
    }
    /* Has rays traced by the caller's tracer, whose functions must not throw; nobody else may use the scene meanwhile. */
    void set_intersector(const blik_intersector &intersector) {
        blik_error info{};
        check(blik_scene_set_intersector(get(), &intersector, &info), info);
    }

private:
    friend class loaded;
    scene() = default;
    explicit scene(blik_scene *handle) : owner_(handle) {}
    detail::owner<blik_scene> owner_;
};

/* Extended form factors of a scene, which must outlive it. */
class coupling {
public:
    explicit coupling(const scene &scene, const blik_settings &settings = blik::settings(),
                      const blik_run &run = alone())
        : scene_(scene.get()) {
        detail::guard on(run);
#ifdef BLIK_STD
        blik_error info{};
        on.check(blik_coupling_create(scene.get(), &settings, on.get(), &info, owner_.place()), info);
#else
        owner_ = detail::in_memory<blik_coupling>(
            [&](blik_error *e, std::size_t *bytes) { return blik_coupling_size(scene.get(), &settings, e, bytes); },
            [&](void *memory, std::size_t bytes, blik_error *e, blik_coupling **out) {
                return blik_coupling_init(scene.get(), &settings, on.get(), memory, bytes, e, out);
            },
            &on);
#endif
    }
    /* By what still holds of another coupling, which must outlive it: of a scene of the same mesh with other materials. */
    coupling(const coupling &kept, const scene &scene, const blik_run &run = alone()) : scene_(scene.get()) {
        renew(kept, nullptr, run);
    }
    /* As well where parts stand elsewhere in the scene. */
    coupling(const coupling &kept, const scene &scene, const parts &parts, const blik_run &run = alone())
        : scene_(scene.get()) {
        const blik_parts moved = parts.get();
        renew(kept, &moved, run);
    }
    /* A temporary scene would be gone before its coupling is used. */
    explicit coupling(const scene &&, const blik_settings & = blik::settings(), const blik_run & = alone()) = delete;
    coupling(const coupling &, const scene &&, const blik_run & = alone()) = delete;
    coupling(const coupling &, const scene &&, const parts &, const blik_run & = alone()) = delete;
    /* What became of its rows. */
    blik_update_info update() const {
        blik_error info{};
        blik_update_info value;
        blik_update_info_init(&value);
        check(blik_update_get_info(get(), &info, &value), info);
        return value;
    }
    const blik_coupling *get() const noexcept { return owner_.get(); }
    blik_coupling_info info() const {
        blik_error info{};
        blik_coupling_info value;
        blik_coupling_info_init(&value);
        check(blik_coupling_get_info(get(), &info, &value), info);
        return value;
    }

private:
    friend class loaded;
    friend class solution;
    coupling() = default;
    void renew(const coupling &kept, const blik_parts *moved, const blik_run &run) {
        detail::guard on(run);
#ifdef BLIK_STD
        blik_error info{};
        on.check(blik_update_create(kept.get(), scene_, moved, on.get(), &info, owner_.place()), info);
#else
        owner_ = detail::in_memory<blik_coupling>(
            [&](blik_error *e, std::size_t *bytes) { return blik_update_size(kept.get(), scene_, moved, e, bytes); },
            [&](void *memory, std::size_t bytes, blik_error *e, blik_coupling **out) {
                return blik_update_init(kept.get(), scene_, moved, on.get(), memory, bytes, e, out);
            },
            &on);
#endif
    }
    coupling(blik_coupling *handle, const blik_scene *scene) : scene_(scene), owner_(handle) {}
    const blik_scene *scene_ = nullptr;
    detail::owner<blik_coupling> owner_;
};

/* Asks an image for its terms, too. */
struct with_components_t {};
constexpr with_components_t with_components{};

/* Radiance by row (0 at the top), column and band. */
struct image {
    std::size_t columns = 0, rows = 0, bands = 0;
    std::vector<float> pixels;
    /* Where asked for, its terms one after the other, each like `pixels`: diffuse, mirrored sky and sun, mirrored diffuse. */
    std::vector<float> components;
    blik_tally tally{};

    float at(std::size_t row, std::size_t column, std::size_t band = 0) const {
        return pixels.at(index(row, column, band));
    }
    /* One of its three terms. */
    float component(std::size_t term, std::size_t row, std::size_t column, std::size_t band = 0) const {
        return components.at(term * pixels.size() + index(row, column, band));
    }

private:
    std::size_t index(std::size_t row, std::size_t column, std::size_t band) const {
        if (row >= rows || column >= columns || band >= bands) {
            throw std::out_of_range("blik: a row, column or band outside the image");
        }
        return (row * columns + column) * bands + band;
    }
    friend class solution;
};

/* What arrives at facets and leaves them: one value per facet, side and band, bands innermost. */
struct facets {
    std::vector<double> areas, irradiance, radiance;
};

/* A scene under one light, solved; its coupling must outlive it. */
class solution {
public:
    solution(const coupling &coupling, const light &light, const blik_run &run = alone()) : scene_(coupling.scene_) {
        const blik_light value = light.get();
        detail::guard on(run);
#ifdef BLIK_STD
        blik_error info{};
        on.check(blik_solution_create(coupling.get(), &value, on.get(), &info, owner_.place()), info);
#else
        owner_ = detail::in_memory<blik_solution>(
            [&](blik_error *e, std::size_t *bytes) { return blik_solution_size(coupling.get(), &value, e, bytes); },
            [&](void *memory, std::size_t bytes, blik_error *e, blik_solution **out) {
                return blik_solution_init(coupling.get(), &value, on.get(), memory, bytes, e, out);
            },
            &on);
#endif
        bands_ = this->info().bands;
    }
    /* A temporary coupling would be gone before its solution is used. */
    solution(const coupling &&, const light &, const blik_run & = alone()) = delete;
    const blik_solution *get() const noexcept { return owner_.get(); }
    std::size_t bands() const noexcept { return bands_; }
    blik_solution_info info() const {
        blik_error info{};
        blik_solution_info value;
        blik_solution_info_init(&value);
        check(blik_solution_get_info(get(), &info, &value), info);
        return value;
    }

    /* The whole image. */
    blik::image image(const blik_camera &camera, const blik_run &run = alone()) const {
        return whole(camera, run, false);
    }
    /* The whole image with its terms. */
    blik::image image(const blik_camera &camera, with_components_t, const blik_run &run = alone()) const {
        return whole(camera, run, true);
    }
    /* Rows first .. first + rows of it, for schedulers and processes of the caller. */
    blik::image image_rows(const blik_camera &camera, std::size_t first, std::size_t rows) const {
        return part(camera, first, rows, false);
    }
    /* The same with their terms. */
    blik::image image_rows(const blik_camera &camera, std::size_t first, std::size_t rows, with_components_t) const {
        return part(camera, first, rows, true);
    }
    /* How good an image is; `tally` of all its rows. */
    blik_report report(const blik_tally &tally) const {
        blik_error info{};
        blik_report value;
        blik_report_init(&value);
        check(blik_get_report(get(), &tally, &info, &value), info);
        return value;
    }
    /* One entry per direction and band; directions are any container of what a vector3 is made of, toward the object. */
    template <typename C>
    std::vector<blik_signature> signatures(const C &directions, const blik_run &run = alone(),
                                           std::size_t cells = 0) const {
        std::vector<double> numbers;
        for (const auto &direction : directions) {
            const vector3 from(direction);
            numbers.insert(numbers.end(), {from[0], from[1], from[2]});
        }
        const std::size_t views = numbers.size() / 3;
        std::vector<blik_signature> out(views * bands_);
        blik_error info{};
        detail::guard on(run);
        const detail::scratch scratch(
            [&](blik_error *e, std::size_t *bytes) { return blik_radiance_scratch_size(get(), on.get(), e, bytes); });
        on.check(blik_signatures(get(), numbers.data(), views, cells, on.get(), scratch.data(), scratch.size(), &info,
                                 out.data(), out.size(), sizeof(blik_signature)),
                 info);
        return out;
    }
    std::vector<blik_signature> signatures(std::initializer_list<vector3> directions, const blik_run &run = alone(),
                                           std::size_t cells = 0) const {
        return signatures<std::initializer_list<vector3>>(directions, run, cells);
    }
    /* Radiance against each ray, one value per band. */
    std::vector<double> radiance(view<const blik_ray> rays, const blik_run &run = alone()) const {
        std::vector<double> out(rays.size() * bands_);
        blik_error info{};
        detail::guard on(run);
        const detail::scratch scratch(
            [&](blik_error *e, std::size_t *bytes) { return blik_radiance_scratch_size(get(), on.get(), e, bytes); });
        on.check(blik_radiance(get(), rays.data(), rays.size(), on.get(), scratch.data(), scratch.size(), &info,
                               out.data(), out.size()),
                 info);
        return out;
    }
    /* Facets first .. first + count. */
    blik::facets facets(std::size_t first, std::size_t count) const {
        const blik_solution_info all = info();
        // more than there are: refused by the call
        const std::size_t some = count <= all.facets ? count : 0, values = some * all.sides * all.bands;
        blik::facets out{std::vector<double>(some), std::vector<double>(values), std::vector<double>(values)};
        blik_error info{};
        check(blik_facets(get(), first, count, &info, out.areas.data(), out.areas.size(), out.irradiance.data(),
                          out.irradiance.size(), out.radiance.data(), out.radiance.size()),
              info);
        return out;
    }
    /* All facets. */
    blik::facets facets() const { return facets(0, info().facets); }
    /* All facets of the scene that it was made of; another is refused. */
    blik::facets facets(const blik::scene &scene) const {
        if (scene.get() != scene_) {
            blik_error info{};
            info.status = BLIK_ERROR_HANDLE;
            throw error(info);
        }
        return facets();
    }
    /* The radiance per band to which errors are related. */
    std::vector<double> reference() const {
        std::vector<double> out(bands_);
        blik_error info{};
        check(blik_solution_get_reference(get(), &info, out.data(), out.size()), info);
        return out;
    }

private:
    friend class loaded;
    solution() = default;
    solution(blik_solution *handle, const blik_scene *scene) : scene_(scene), owner_(handle) {
        bands_ = handle != nullptr ? this->info().bands : 0;
    }
    blik::image blank(const blik_camera &camera, std::size_t rows, bool terms) const {
        blik::image out{camera.columns, rows, bands_, {}, {}, {}};
        out.pixels.resize(out.columns * out.rows * bands_);
        out.components.resize(terms ? 3 * out.pixels.size() : 0);
        blik_tally_init(&out.tally);
        return out;
    }
    blik::image whole(const blik_camera &camera, const blik_run &run, bool terms) const {
        // refuses a camera of too many pixels
        const detail::scratch scratch(
            [&](blik_error *e, std::size_t *bytes) { return blik_image_scratch_size(get(), &camera, &run, e, bytes); });
        blik::image out = blank(camera, camera.rows, terms);
        blik_error info{};
        detail::guard on(run);
        on.check(blik_image(get(), &camera, on.get(), scratch.data(), scratch.size(), &info, out.pixels.data(),
                            out.pixels.size(), terms ? out.components.data() : nullptr, out.components.size(), &out.tally),
                 info);
        return out;
    }
    blik::image part(const blik_camera &camera, std::size_t first, std::size_t rows, bool terms) const {
        const detail::scratch scratch(
            [&](blik_error *e, std::size_t *bytes) { return blik_image_scratch_size(get(), &camera, nullptr, e, bytes); });
        blik::image out = blank(camera, rows <= camera.rows ? rows : 0, terms);
        blik_error info{};
        check(blik_image_rows(get(), &camera, first, rows, scratch.data(), scratch.size(), &info, out.pixels.data(),
                              out.pixels.size(), terms ? out.components.data() : nullptr, out.components.size(),
                              &out.tally),
              info);
        return out;
    }
    const blik_scene *scene_ = nullptr;
    detail::owner<blik_solution> owner_;
    std::size_t bands_ = 0;
};

/* What many lights give: of each light one value per facet, side and band, bands innermost; of each light one entry per view
 * and band. */
struct lit {
    std::vector<double> irradiance, radiance;
    std::vector<blik_signature> signatures;
};

/* Solves many lights against one coupling: the numbers of a solution of each, sooner. Directions are any container of what a
 * vector3 is made of, toward the object. */
template <typename C>
lit lights(const coupling &coupling, const std::vector<light> &all, const C &directions, const blik_run &run = alone(),
           std::size_t cells = 0) {
    std::vector<blik_light> values;
    for (const light &one : all) {
        values.push_back(one.get());
    }
    std::vector<double> numbers;
    for (const auto &direction : directions) {
        const vector3 from(direction);
        numbers.insert(numbers.end(), {from[0], from[1], from[2]});
    }
    const std::size_t views = numbers.size() / 3;
    const blik_coupling_info sizes = coupling.info();
    lit out;
    out.irradiance.resize(all.size() * sizes.facets * sizes.sides * sizes.bands);
    out.radiance.resize(out.irradiance.size());
    out.signatures.resize(all.size() * views * sizes.bands);
    blik_error info{};
    detail::guard on(run);
    const detail::scratch scratch([&](blik_error *e, std::size_t *bytes) {
        return blik_lights_scratch_size(coupling.get(), values.data(), values.size(), sizeof(blik_light), on.get(), e, bytes);
    });
    on.check(blik_lights(coupling.get(), values.data(), values.size(), sizeof(blik_light), numbers.data(), views, cells,
                         on.get(), scratch.data(), scratch.size(), &info, out.irradiance.data(), out.irradiance.size(),
                         out.radiance.data(), out.radiance.size(), out.signatures.data(), out.signatures.size(),
                         sizeof(blik_signature)),
             info);
    return out;
}
inline lit lights(const coupling &coupling, const std::vector<light> &all, std::initializer_list<vector3> directions = {},
                  const blik_run &run = alone(), std::size_t cells = 0) {
    return lights<std::initializer_list<vector3>>(coupling, all, directions, run, cells);
}

/* What signatures are made of and depend on: of each view one entry per band; one value per facet and band; three terms per
 * band; one value per facet and band; one per facet, side and band. */
struct explanation {
    std::vector<blik_signature> signatures;
    std::vector<double> shares, terms, by_diffuse, by_emission;
};

/* Solves for a light and explains the signature in each direction, any container of what a vector3 is made of. */
template <typename C>
explanation explain(const coupling &coupling, const light &light, const C &directions, std::size_t cells = 0,
                    const blik_run &run = alone()) {
    const blik_light value = light.get();
    std::vector<double> numbers;
    for (const auto &direction : directions) {
        const vector3 from(direction);
        numbers.insert(numbers.end(), {from[0], from[1], from[2]});
    }
    const std::size_t views = numbers.size() / 3;
    const blik_coupling_info sizes = coupling.info();
    const std::size_t values = views * sizes.facets * sizes.bands;
    explanation out;
    out.signatures.resize(views * sizes.bands);
    out.shares.resize(values);
    out.terms.resize(views * 3 * sizes.bands);
    out.by_diffuse.resize(values);
    out.by_emission.resize(values * sizes.sides);
    blik_error info{};
    detail::guard on(run);
    const detail::scratch scratch(
        [&](blik_error *e, std::size_t *bytes) { return blik_explain_scratch_size(coupling.get(), &value, e, bytes); });
    on.check(blik_explain(coupling.get(), &value, numbers.data(), views, cells, on.get(), scratch.data(), scratch.size(),
                          &info, out.signatures.data(), out.signatures.size(), sizeof(blik_signature), out.shares.data(),
                          out.shares.size(), out.terms.data(), out.terms.size(), out.by_diffuse.data(),
                          out.by_diffuse.size(), out.by_emission.data(), out.by_emission.size()),
             info);
    return out;
}
inline explanation explain(const coupling &coupling, const light &light, std::initializer_list<vector3> directions,
                           std::size_t cells = 0, const blik_run &run = alone()) {
    return explain<std::initializer_list<vector3>>(coupling, light, directions, cells, run);
}

/* A tally of nothing, to which add() adds. */
inline blik_tally tally() {
    blik_tally value;
    blik_tally_init(&value);
    return value;
}

/* Adds the tally of other rows of an image. */
inline void add(blik_tally &sum, const blik_tally &next) {
    blik_error info{};
    check(blik_tally_add(&sum, &next, &info), info);
}

/* The rounds of an image of which the error `asked` is wanted: how fine each solution is to be, and whether another is:
 *
 *     blik::rounds rounds(5e-4);
 *     do {
 *         const blik::coupling coupling(scene, rounds.settings());
 *         const blik::solution solution(coupling, light);
 *         image = solution.image(camera);
 *         report = solution.report(image.tally);
 *     } while (rounds.again(report));
 */
class rounds {
public:
    explicit rounds(double asked) {
        blik_rounds_init(&rounds_, asked);
        next(nullptr);
    }
    /* Tolerance of the round to come; 0 where there is none. */
    double tolerance() const noexcept { return rounds_.tolerance; }
    blik_settings settings() const { return blik::settings(rounds_.tolerance, rounds_.asked); }
    /* Whether another round is wanted after one with this report. */
    bool again(const blik_report &report) {
        next(&report);
        return rounds_.tolerance > 0;
    }

private:
    void next(const blik_report *report) {
        blik_error info{};
        check(blik_rounds_next(&rounds_, report, &info), info);
    }
    blik_rounds rounds_;
};

/* Scene, coupling and perhaps a solution as one relocatable block, on the boundary that it needs. */
class block {
public:
    explicit block(const coupling &coupling) { bake(coupling.get(), nullptr); }
    block(const coupling &coupling, const solution &solution) { bake(coupling.get(), solution.get()); }
    /* What save() wrote; a file that cannot be read is a std::system_error. What is in it, `loaded` checks. */
    static block from_file(const std::string &path) {
        const file opened(path, "rb");
        block out;
        if (std::fseek(opened.get(), 0, SEEK_END) != 0) {
            fail(path);
        }
        const long size = std::ftell(opened.get());
        if (size < 0 || std::fseek(opened.get(), 0, SEEK_SET) != 0) {
            fail(path);
        }
        out.take(static_cast<std::size_t>(size));
        if (std::fread(out.start_, 1, out.size_, opened.get()) != out.size_) {
            fail(path);
        }
        return out;
    }
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
    /* Writes it to a file, which is there whole or not at all. */
    void save(const std::string &path) const {
        const std::string part = path + ".tmp";
        {
            file opened(part, "wb");
            if (std::fwrite(start_, 1, size_, opened.get()) != size_ || opened.close() != 0) {
                const int error = errno;
                std::remove(part.c_str());
                errno = error;
                fail(part);
            }
        }
        if (std::rename(part.c_str(), path.c_str()) != 0) {
            const int error = errno;
            std::remove(part.c_str());
            errno = error;
            fail(path);
        }
    }

private:
    /* An open file. */
    class file {
    public:
        file(const std::string &path, const char *mode) : file_(std::fopen(path.c_str(), mode)) {
            if (file_ == nullptr) {
                fail(path);
            }
        }
        file(const file &) = delete;
        file &operator=(const file &) = delete;
        ~file() { close(); }
        std::FILE *get() const noexcept { return file_; }
        int close() noexcept {
            std::FILE *open = std::exchange(file_, nullptr);
            return open != nullptr ? std::fclose(open) : 0;
        }

    private:
        std::FILE *file_;
    };
    block() = default;
    [[noreturn]] static void fail(const std::string &path) {
        throw std::system_error(errno != 0 ? errno : EIO, std::generic_category(), "blik: " + path);
    }
    void take(std::size_t size) {
        size_ = size;
        std::size_t room = size_ + BLIK_BLOCK_ALIGNMENT;
        memory_.reset(new unsigned char[room]);
        void *start = memory_.get();
        start_ = static_cast<unsigned char *>(std::align(BLIK_BLOCK_ALIGNMENT, size_, start, room));
    }
    void bake(const blik_coupling *coupling, const blik_solution *solution) {
        blik_error info{};
        std::size_t size = 0;
        check(blik_bake_size(coupling, solution, &info, &size), info);
        take(size);
        check(blik_bake(coupling, solution, start_, size_, &info), info);
    }
    std::unique_ptr<unsigned char[]> memory_;
    unsigned char *start_ = nullptr;
    std::size_t size_ = 0;
};

/* What a baked block holds, read where it stands: the block must outlive it, unless it is moved into it. */
class loaded {
public:
    /* A block, or its bytes on the boundary that it needs. */
    explicit loaded(const block &block) { load(block.data(), block.size()); }
    explicit loaded(view<const unsigned char> bytes) { load(bytes.data(), bytes.size()); }
    /* Keeps the block. */
    explicit loaded(block &&block) : own_(new blik::block(std::move(block))) { load(own_->data(), own_->size()); }
    /* Bytes of a temporary would be gone, and may not stand on the boundary. */
    template <typename A>
    explicit loaded(const std::vector<unsigned char, A> &&) = delete;
    loaded(loaded &&) noexcept = default;
    /* The handles end before the memory in which they stand. */
    loaded &operator=(loaded &&other) noexcept {
        loaded moved(std::move(other));
        std::swap(own_, moved.own_);
        std::swap(memory_, moved.memory_);
        std::swap(scene_, moved.scene_);
        std::swap(coupling_, moved.coupling_);
        std::swap(solution_, moved.solution_);
        return *this;
    }
    const blik::scene &scene() const & noexcept { return scene_; }
    const blik::scene &scene() const && = delete;
    const blik::coupling &coupling() const & noexcept { return coupling_; }
    const blik::coupling &coupling() const && = delete;
    /* Null where the block has none. */
    const blik::solution *solution() const & noexcept { return solution_.get() != nullptr ? &solution_ : nullptr; }
    const blik::solution *solution() const && = delete;

private:
    void load(const unsigned char *block, std::size_t size) {
        blik_error info{};
        std::size_t bytes = 0;
        check(blik_load_size(block, size, &info, &bytes), info);
        memory_.reset(new unsigned char[bytes]);
        blik_scene *scene = nullptr;
        blik_coupling *coupling = nullptr;
        blik_solution *solution = nullptr;
        check(blik_load(block, size, memory_.get(), bytes, &info, &scene, &coupling, &solution), info);
        scene_ = blik::scene(scene);
        coupling_ = blik::coupling(coupling, scene);
        solution_ = blik::solution(solution, scene);
    }
    std::unique_ptr<blik::block> own_;
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
    static blik_plane_body blank(blik_plane_shape shape, uint32_t material, uint32_t elements) {
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
    blik_plane_light get() const & noexcept {
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
            check(blik_plane_scene_create(&all, &settings, &info, owner_.place()), info);
#else
            owner_ = detail::in_memory<blik_plane_scene>(
                [&](blik_error *e, std::size_t *bytes) { return blik_plane_scene_size(&all, e, bytes); },
                [&](void *memory, std::size_t bytes, blik_error *e, blik_plane_scene **out) {
                    return blik_plane_scene_init(&all, &settings, memory, bytes, e, out);
                });
#endif
        });
    }
    const blik_plane_scene *get() const noexcept { return owner_.get(); }
    blik_plane_scene_info info() const {
        blik_error info{};
        blik_plane_scene_info value;
        blik_plane_scene_info_init(&value);
        check(blik_plane_scene_get_info(get(), &info, &value), info);
        return value;
    }
    /* The first circle or segment that each ray meets. */
    std::vector<blik_plane_hit> first_hits(view<const blik_plane_ray> rays) const {
        std::vector<blik_plane_hit> out(rays.size());
        blik_error info{};
        check(blik_plane_first_hits(get(), rays.data(), rays.size(), &info, out.data(), out.size()), info);
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
        detail::guard on(run);
#ifdef BLIK_STD
        blik_error info{};
        on.check(blik_plane_coupling_create(scene.get(), on.get(), &info, owner_.place()), info);
#else
        owner_ = detail::in_memory<blik_plane_coupling>(
            [&](blik_error *e, std::size_t *bytes) { return blik_plane_coupling_size(scene.get(), &run, e, bytes); },
            [&](void *memory, std::size_t bytes, blik_error *e, blik_plane_coupling **out) {
                return blik_plane_coupling_init(scene.get(), on.get(), memory, bytes, e, out);
            },
            &on);
#endif
    }
    explicit coupling(const scene &&, const blik_run & = alone()) = delete;
    const blik_plane_coupling *get() const noexcept { return owner_.get(); }
    blik_plane_coupling_info info() const {
        blik_error info{};
        blik_plane_coupling_info value;
        blik_plane_coupling_info_init(&value);
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
        detail::guard on(run);
#ifdef BLIK_STD
        blik_error info{};
        on.check(blik_plane_solution_create(coupling.get(), &value, on.get(), &info, owner_.place()), info);
#else
        owner_ = detail::in_memory<blik_plane_solution>(
            [&](blik_error *e, std::size_t *bytes) {
                return blik_plane_solution_size(coupling.get(), &value, &run, e, bytes);
            },
            [&](void *memory, std::size_t bytes, blik_error *e, blik_plane_solution **out) {
                return blik_plane_solution_init(coupling.get(), &value, on.get(), memory, bytes, e, out);
            },
            &on);
#endif
    }
    solution(const coupling &&, const light &, const blik_run & = alone()) = delete;
    const blik_plane_solution *get() const noexcept { return owner_.get(); }
    blik_plane_solution_info info() const {
        blik_error info{};
        blik_plane_solution_info value;
        blik_plane_solution_info_init(&value);
        check(blik_plane_solution_get_info(get(), &info, &value), info);
        return value;
    }
    /* The image seen from the direction (sin angle, cos angle). */
    std::vector<blik_plane_sample> image(double angle, std::size_t samples, const blik_run &run = alone()) const {
        std::vector<blik_plane_sample> out(samples);
        with_scratch(run, [&](const blik_run *on, void *scratch, std::size_t bytes, blik_error *info) {
            return blik_plane_image(get(), angle, samples, 0, samples, on, scratch, bytes, info, out.data(), out.size());
        });
        return out;
    }
    /* Radiance against each ray. */
    std::vector<blik_plane_sample> radiance(view<const blik_plane_ray> rays, const blik_run &run = alone()) const {
        std::vector<blik_plane_sample> out(rays.size());
        with_scratch(run, [&](const blik_run *on, void *scratch, std::size_t bytes, blik_error *info) {
            return blik_plane_radiance(get(), rays.data(), rays.size(), on, scratch, bytes, info, out.data(), out.size());
        });
        return out;
    }
    /* All unknowns of the scene that it was made of. */
    std::vector<blik_plane_unknown> unknowns(const plane::scene &scene) const {
        std::vector<blik_plane_unknown> out(scene.info().unknowns);
        blik_error info{};
        check(blik_plane_get_unknowns(get(), 0, out.size(), &info, out.data(), out.size()), info);
        return out;
    }

private:
    template <typename F>
    void with_scratch(const blik_run &run, F call) const {
        blik_error info{};
        const detail::scratch scratch(
            [&](blik_error *e, std::size_t *bytes) { return blik_plane_scratch_size(get(), &run, e, bytes); });
        detail::guard on(run);
        on.check(call(on.get(), scratch.data(), scratch.size(), &info), info);
    }
    detail::owner<blik_plane_solution> owner_;
};

} // namespace plane

} // namespace blik

#endif /* BLIK_HPP */
