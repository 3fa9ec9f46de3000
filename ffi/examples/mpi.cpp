// One image by many processes: every rank computes rows of it, and rank 0 gathers them.
//
//     mpicxx -std=c++17 -O2 mpi.cpp -lblik -o mpi && mpirun -n 4 ./mpi
//
// Prints a checksum of the pixels' bits, which does not depend on the number of ranks. Rank 0 alone computes the coupling;
// the others get it as a baked block.
#include <blik.hpp>

#include "craft.h"

#include <mpi.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <exception>
#include <optional>

namespace {

constexpr int columns = 96, rows = 64;

blik::block computed() {
    blik::mesh mesh(blik::view<const float>(&craft_vertices[0][0], 3 * CRAFT_VERTICES),
                    blik::view<const uint16_t>(&craft_facets[0][0], 3 * CRAFT_FACETS));
    mesh.facet_materials(blik::view<const unsigned char>(craft_materials));
    mesh.material({0.4}).material({0.1}, {0.5}).material({0.4}, {0.2}, {}, 10.0);
    const blik::scene scene(mesh);
    const blik::coupling coupling(scene, blik::settings(1e-2));
    return blik::block(coupling, blik::solution(coupling, blik::light(blik::sky(BLIK_SKY_OVERCAST), blik::sun({1, -1, 1}))));
}

void work(int rank, int ranks) {
    // the block goes to every rank, on the boundary that it needs
    std::optional<blik::block> own;
    unsigned long size = 0;
    if (rank == 0) {
        own.emplace(computed());
        size = own->size();
    }
    MPI_Bcast(&size, 1, MPI_UNSIGNED_LONG, 0, MPI_COMM_WORLD);
    std::vector<unsigned char> memory(size + BLIK_BLOCK_ALIGNMENT);
    void *place = memory.data();
    std::size_t room = memory.size();
    std::align(BLIK_BLOCK_ALIGNMENT, size, place, room);
    if (own) {
        std::memcpy(place, own->data(), size);
    }
    MPI_Bcast(place, static_cast<int>(size), MPI_BYTE, 0, MPI_COMM_WORLD);
    const blik::loaded loaded(blik::view<const unsigned char>(static_cast<unsigned char *>(place), size));

    // row by row in turn, so that every rank gets its share of what is dear
    const blik_camera camera = blik::orthographic({4, -6, 5}, {0, 0, 0}, 5, columns, rows);
    std::vector<float> pixels(columns * rows, 0.0F), all(pixels.size());
    blik_tally tally = blik::tally();
    for (int row = rank; row < rows; row += ranks) {
        const blik::image part = loaded.solution()->image_rows(camera, static_cast<std::size_t>(row), 1);
        std::copy(part.pixels.begin(), part.pixels.end(), pixels.begin() + row * columns);
        blik::add(tally, part.tally);
    }
    // every pixel is one rank's; the others' are 0
    MPI_Reduce(pixels.data(), all.data(), columns * rows, MPI_FLOAT, MPI_SUM, 0, MPI_COMM_WORLD);
    unsigned long long seen = tally.object_pixels, seen_by_all = 0;
    MPI_Reduce(&seen, &seen_by_all, 1, MPI_UNSIGNED_LONG_LONG, MPI_SUM, 0, MPI_COMM_WORLD);
    if (rank == 0) {
        uint32_t sum = 2166136261U;
        for (const float pixel : all) {
            uint32_t bits = 0;
            std::memcpy(&bits, &pixel, sizeof bits);
            sum = (sum ^ bits) * 16777619U;
        }
        std::printf("%llu pixels of the craft, checksum %08x\n", seen_by_all, static_cast<unsigned>(sum));
    }
}

} // namespace

int main(int count, char **arguments) {
    MPI_Init(&count, &arguments);
    int rank = 0, ranks = 1;
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    MPI_Comm_size(MPI_COMM_WORLD, &ranks);
    try {
        work(rank, ranks);
    } catch (const std::exception &error) {
        std::fprintf(stderr, "%s\n", error.what());
        MPI_Abort(MPI_COMM_WORLD, 1);
    }
    return MPI_Finalize();
}
