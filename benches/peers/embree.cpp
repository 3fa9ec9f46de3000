// Embree's side of the comparison: rays per second on one thread, single rays and packets of 16.
//   embree FOLDER    FOLDER/vertices.f32: three corners a triangle; FOLDER/rays.f32: origin, direction
// Prints one line of JSON. Build: c++ -O3 -march=native embree.cpp -lembree3
#include <embree3/rtcore.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <functional>
#include <iterator>
#include <limits>
#include <string>
#include <vector>

static std::vector<float> floats(const std::string& path) {
    std::ifstream file(path, std::ios::binary | std::ios::ate);
    std::vector<float> values(static_cast<size_t>(file.tellg()) / sizeof(float));
    file.seekg(0);
    file.read(reinterpret_cast<char*>(values.data()), static_cast<std::streamsize>(values.size() * sizeof(float)));
    return values;
}

static double median(int runs, const std::function<void()>& work) {
    std::vector<double> seconds;
    for (int i = 0; i < runs; ++i) {
        const auto start = std::chrono::steady_clock::now();
        work();
        seconds.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    }
    std::sort(seconds.begin(), seconds.end());
    return seconds[seconds.size() / 2];
}

static RTCScene build(RTCDevice device, const std::vector<float>& vertices) {
    const size_t corners = vertices.size() / 3;
    RTCGeometry mesh = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* to = static_cast<float*>(
        rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, corners));
    std::copy(vertices.begin(), vertices.end(), to);
    auto* index = static_cast<uint32_t*>(
        rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, corners / 3));
    for (uint32_t i = 0; i < corners; ++i) index[i] = i;
    rtcCommitGeometry(mesh);
    RTCScene scene = rtcNewScene(device);
    rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_HIGH);
    rtcAttachGeometry(scene, mesh);
    rtcReleaseGeometry(mesh);
    rtcCommitScene(scene);
    return scene;
}

static const float INF = std::numeric_limits<float>::infinity();

template <class Ray> static void set(Ray& ray, size_t at, const float* r);
template <> void set(RTCRay& ray, size_t, const float* r) {
    ray = {r[0], r[1], r[2], 0, r[3], r[4], r[5], 0, INF, ~0u, 0, 0};
}
template <> void set(RTCRay16& ray, size_t k, const float* r) {
    ray.org_x[k] = r[0], ray.org_y[k] = r[1], ray.org_z[k] = r[2], ray.tnear[k] = 0;
    ray.dir_x[k] = r[3], ray.dir_y[k] = r[4], ray.dir_z[k] = r[5], ray.time[k] = 0;
    ray.tfar[k] = INF, ray.mask[k] = ~0u, ray.id[k] = 0, ray.flags[k] = 0;
}

int main(int, char** arguments) {
    const std::string folder = arguments[1];
    const auto vertices = floats(folder + "/vertices.f32"), rays = floats(folder + "/rays.f32");
    const size_t count = rays.size() / 6 / 16 * 16;
    RTCDevice device = rtcNewDevice("threads=1");
    RTCScene scene = nullptr;
    const double built = median(3, [&] {
        if (scene) rtcReleaseScene(scene);
        scene = build(device, vertices);
    });
    // as a path tracer sends them: nothing is known of how the rays lie
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    size_t hits = 0, blocked = 0;
    alignas(64) static const int all[16] = {-1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1};
    const auto closest1 = [&] {
        hits = 0;
        for (size_t i = 0; i < count; ++i) {
            RTCRayHit hit;
            set(hit.ray, 0, &rays[6 * i]);
            hit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
            hit.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
            rtcIntersect1(scene, &context, &hit);
            hits += hit.hit.geomID != RTC_INVALID_GEOMETRY_ID;
        }
    };
    const auto closest16 = [&] {
        for (size_t i = 0; i < count; i += 16) {
            RTCRayHit16 hit;
            for (size_t k = 0; k < 16; ++k) {
                set(hit.ray, k, &rays[6 * (i + k)]);
                hit.hit.geomID[k] = RTC_INVALID_GEOMETRY_ID;
                hit.hit.instID[0][k] = RTC_INVALID_GEOMETRY_ID;
            }
            rtcIntersect16(all, scene, &context, &hit);
        }
    };
    const auto any1 = [&] {
        blocked = 0;
        for (size_t i = 0; i < count; ++i) {
            RTCRay ray;
            set(ray, 0, &rays[6 * i]);
            rtcOccluded1(scene, &context, &ray);
            blocked += ray.tfar < 0;
        }
    };
    const auto any16 = [&] {
        for (size_t i = 0; i < count; i += 16) {
            RTCRay16 ray;
            for (size_t k = 0; k < 16; ++k) set(ray, k, &rays[6 * (i + k)]);
            rtcOccluded16(all, scene, &context, &ray);
        }
    };
    const auto rate = [&](const std::function<void()>& work) { return count * 1e-6 / median(5, work); };
    const double c1 = rate(closest1), c16 = rate(closest16), a1 = rate(any1), a16 = rate(any16);
    std::printf("{\"build\": %.6f, \"closest\": %.4f, \"closest16\": %.4f, \"any\": %.4f, \"any16\": %.4f, "
                "\"hits\": %zu, \"blocked\": %zu}\n",
                built, c1, c16, a1, a16, hits, blocked);
}
