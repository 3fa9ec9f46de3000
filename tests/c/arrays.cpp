// Arrays in all layouts that blik.hpp takes without being told: each makes the same mesh. Exit 0 when all is as stated;
// compiled as C++17 to C++23; with -DWITH_EIGEN the matrices are Eigen's own.
#include <blik.hpp>

#include <cstdio>
#include <string>
#include <vector>

#ifdef WITH_EIGEN
#include <Eigen/Core>
using columns_of_3 = Eigen::Matrix<double, 3, Eigen::Dynamic>;
using rows_of_3 = Eigen::Matrix<float, Eigen::Dynamic, 3, Eigen::RowMajor>;
using rows_of_any = Eigen::Matrix<int, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using numbers_in_a_column = Eigen::Matrix<int, Eigen::Dynamic, 1>;
#else
// What Eigen's dense matrices tell of themselves.
template <typename T, int Rows, int Columns, bool RowMajor>
class matrix {
public:
    using Scalar = T;
    enum { RowsAtCompileTime = Rows, ColsAtCompileTime = Columns, IsRowMajor = RowMajor };
    matrix(long rows, long columns) : rows_(rows), columns_(columns), values_(static_cast<std::size_t>(rows * columns)) {}
    explicit matrix(long size) : matrix(size, 1) {}
    long rows() const { return rows_; }
    long cols() const { return columns_; }
    long size() const { return rows_ * columns_; }
    long innerStride() const { return 1; }
    long outerStride() const { return RowMajor ? columns_ : rows_; }
    const T *data() const { return values_.data(); }
    T &operator()(long row, long column) { return values_[place(row, column)]; }
    T &operator()(long row) { return values_[static_cast<std::size_t>(row)]; }

private:
    std::size_t place(long row, long column) const {
        return static_cast<std::size_t>(RowMajor ? row * columns_ + column : column * rows_ + row);
    }
    long rows_, columns_;
    std::vector<T> values_;
};
using columns_of_3 = matrix<double, 3, -1, false>;
using rows_of_3 = matrix<float, -1, 3, true>;
using rows_of_any = matrix<int, -1, -1, true>;
using numbers_in_a_column = matrix<int, -1, 1, false>;
#endif

#include "require.hpp"

namespace {

constexpr double positions[6][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {0, 1, 1}};
constexpr unsigned corners[4][3] = {{0, 1, 2}, {0, 2, 3}, {0, 3, 5}, {0, 5, 4}};

struct three {
    double a, b, c;
};
// Names of its own.
struct three_numbers {
    double x, y, z;
};
struct of_array {
    float at[3];
};
struct wide {
    int id;
    float x, y, z, u, v;
};
struct with_a_subscript { // GLM's kind
    using value_type = float;
    float values[3];
    float operator[](int index) const { return values[index]; }
};
struct corner_indices {
    uint16_t a, b, c;
};
struct face {
    int32_t first, second, third;
};

// Vertices of any struct, made by `of`.
template <typename V, typename F>
std::vector<V> vertices(F of) {
    std::vector<V> all;
    for (const auto &p : positions) {
        all.push_back(of(p[0], p[1], p[2]));
    }
    return all;
}
template <typename I, typename F>
std::vector<I> facets(F of) {
    std::vector<I> all;
    for (const auto &c : corners) {
        all.push_back(of(c[0], c[1], c[2]));
    }
    return all;
}

// The areas of the facets, which tell whether vertices and indices were read as they are meant.
std::vector<double> areas(blik::mesh &mesh) {
    mesh.material({0.5});
    const blik::scene scene(mesh);
    const blik::coupling coupling(scene, blik::settings(0.1));
    const blik::solution solution(coupling, blik::light(blik::sky()));
    REQUIRE(scene.info().degenerate_facets == 0);
    return solution.facets(scene).areas;
}

template <typename V, typename F>
void same(V &&v, F &&f) {
    blik::mesh mesh(std::forward<V>(v), std::forward<F>(f));
    REQUIRE(areas(mesh) == std::vector<double>(4, 0.5));
}

} // namespace

int main() {
    const auto triples = facets<std::array<uint32_t, 3>>([](unsigned a, unsigned b, unsigned c) {
        return std::array<uint32_t, 3>{a, b, c};
    });
    same(positions, corners); // C arrays
    same(vertices<three>([](double a, double b, double c) { return three{a, b, c}; }), triples);
    same(vertices<of_array>([](double a, double b, double c) {
             return of_array{{static_cast<float>(a), static_cast<float>(b), static_cast<float>(c)}};
         }),
         triples);
    const auto records = vertices<wide>([](double a, double b, double c) {
        return wide{7, static_cast<float>(a), static_cast<float>(b), static_cast<float>(c), 8, 9};
    });
    same(records, triples);
    same(blik::strided(records.data(), records.size(), sizeof(wide)), triples);
    same(blik::view<const wide>(records), triples);
    same(vertices<with_a_subscript>([](double a, double b, double c) {
             return with_a_subscript{{static_cast<float>(a), static_cast<float>(b), static_cast<float>(c)}};
         }),
         triples);
    same(positions, facets<corner_indices>([](unsigned a, unsigned b, unsigned c) {
             return corner_indices{static_cast<uint16_t>(a), static_cast<uint16_t>(b), static_cast<uint16_t>(c)};
         }));
    same(positions, facets<face>([](unsigned a, unsigned b, unsigned c) {
             return face{static_cast<int32_t>(a), static_cast<int32_t>(b), static_cast<int32_t>(c)};
         }));

    // matrices: columns of three, rows of three, rows of as many as they have
    columns_of_3 columns(3, 6);
    rows_of_3 rows(6, 3);
    rows_of_any indices(4, 3), two(6, 2);
    numbers_in_a_column materials(4);
    for (int i = 0; i < 6; ++i) {
        for (int k = 0; k < 3; ++k) {
            columns(k, i) = positions[i][k];
            rows(i, k) = static_cast<float>(positions[i][k]);
            indices(i % 4, k) = static_cast<int>(corners[i % 4][k]);
        }
        materials(i % 4) = 0;
    }
    same(columns, triples);
    same(rows, indices);
    blik::mesh numbered(rows, indices);
    numbered.facet_materials(materials);
    REQUIRE(areas(numbered) == std::vector<double>(4, 0.5));
    bool refused = false;
    try {
        blik::mesh wrong(rows, two);
    } catch (const std::invalid_argument &error) {
        refused = std::string(error.what()).find("2 numbers") != std::string::npos;
    }
    REQUIRE(refused);
#ifdef WITH_EIGEN
    const Eigen::Vector3d up(0, 0, 1);
    REQUIRE(blik::sun(up).direction[2] == 1.0 && blik::orthographic(up, Eigen::Vector3f(1, 2, 3), 1, 2, 2).target[1] == 2.0);
    std::vector<Eigen::Vector3d> points;
    std::vector<Eigen::Vector3i> triangles;
    for (const auto &p : positions) {
        points.emplace_back(p[0], p[1], p[2]);
    }
    for (const auto &c : corners) {
        triangles.emplace_back(c[0], c[1], c[2]);
    }
    same(points, triangles);
    // a part of a matrix: rows further apart than they are long
    Eigen::Matrix<float, Eigen::Dynamic, 5, Eigen::RowMajor> table(6, 5);
    table.setConstant(7);
    table.middleCols<3>(1) = rows;
    same(table.middleCols<3>(1), triples);
#endif
    REQUIRE(blik::sun(three_numbers{1, 2, 3}).direction[1] == 2.0);
    REQUIRE(blik::sun(std::array<float, 3>{1, 2, 3}).direction[2] == 3.0 && blik::sun({1, 2, 3}).direction[0] == 1.0);

    // normals of facets: a mirror whose normals are those of the facet shows what a flat one does
    const std::vector<double> normals = {0, 0, 1, 1, 0, 0};
    const std::vector<uint32_t> of_facets = {0, 0, 0, 0, 0, 0, 1, 1, 1, BLIK_NO_NORMAL, BLIK_NO_NORMAL, BLIK_NO_NORMAL};
    const blik_camera camera = blik::orthographic({3, 0.5, 2}, {0.5, 0.5, 0.3}, 1.6, 16, 12);
    const blik::light light(blik::sky(BLIK_SKY_OVERCAST));
    std::vector<float> images[2];
    for (int curved = 0; curved < 2; ++curved) {
        blik::mesh mesh(positions, corners);
        mesh.material({0.3}, {0.5});
        if (curved != 0) {
            mesh.normals(normals).facet_normals(of_facets);
        }
        const blik::scene scene(mesh);
        const blik::coupling coupling(scene, blik::settings(2e-2));
        images[curved] = blik::solution(coupling, light).image(camera).pixels;
    }
    for (std::size_t i = 0; i < images[0].size(); ++i) {
        REQUIRE(images[0][i] - images[1][i] < 1e-2F && images[1][i] - images[0][i] < 1e-2F);
    }

    // temporaries are kept, whoever copies the mesh
    blik::mesh kept(std::vector<double>(positions[0], positions[0] + 18), std::vector<unsigned>(corners[0], corners[0] + 12));
    kept.facet_materials(std::vector<int>(4, 0));
    blik::mesh copy = kept;
    REQUIRE(areas(copy) == std::vector<double>(4, 0.5));
    std::puts("ok");
    return 0;
}
