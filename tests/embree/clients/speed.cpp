// speed A.so B.so [SIDE]: times two libraries with the interface of Embree 3 or 4 in turn, in one
// thread, on a wavy sphere of 2 * SIDE * SIDE triangles, and prints millions of rays a second of
// both and the ratio of B to A: the median over rounds.
#include <dlfcn.h>

#if MORPHRAY_EMBREE == 3
#include <embree3/rtcore.h>
#else
#include <embree4/rtcore.h>
#endif

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace {

constexpr int kRounds = 9;
constexpr int kImage = 256;

double now() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch())
        .count();
}

/// A library's functions, and the scene in it.
struct Library {
    void* handle;
    RTCDevice device;
    RTCScene scene;
    RTCGeometry mesh;

    template <class Function>
    Function* find(const char* name, Function*) const {
        return reinterpret_cast<Function*>(dlsym(handle, name));
    }
};
#define CALL(library, name) (library).find(#name, &name)

struct Mesh {
    std::vector<float> vertices;
    std::vector<unsigned int> indices;
};

Mesh make_mesh(unsigned int side, float phase) {
    Mesh mesh;
    for (unsigned int y = 0; y <= side; ++y) {
        for (unsigned int x = 0; x <= side; ++x) {
            const float a = 6.2831853f * static_cast<float>(x) / static_cast<float>(side);
            const float b = 3.1415927f * static_cast<float>(y) / static_cast<float>(side);
            const float r = 1 + 0.1f * std::sin(9 * a + phase) * std::sin(11 * b);
            mesh.vertices.insert(
                mesh.vertices.end(),
                {r * std::cos(a) * std::sin(b), r * std::cos(b), r * std::sin(a) * std::sin(b)});
        }
    }
    for (unsigned int y = 0; y < side; ++y) {
        for (unsigned int x = 0; x < side; ++x) {
            const unsigned int a = y * (side + 1) + x;
            const unsigned int c = a + side + 1;
            mesh.indices.insert(mesh.indices.end(), {a, a + 1, c, a + 1, c + 1, c});
        }
    }
    return mesh;
}

/// Attaches the mesh, `scale` times as large.
RTCGeometry add_mesh(const Library& library, const Mesh& mesh, float scale = 1) {
    RTCGeometry made = CALL(library, rtcNewGeometry)(library.device, RTC_GEOMETRY_TYPE_TRIANGLE);
    CALL(library, rtcSetGeometryBuildQuality)(made, RTC_BUILD_QUALITY_REFIT);
    const auto set = CALL(library, rtcSetNewGeometryBuffer);
    auto* const vertices = static_cast<float*>(
        set(made, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, mesh.vertices.size() / 3));
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i) vertices[i] = scale * mesh.vertices[i];
    std::memcpy(set(made, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, mesh.indices.size() / 3),
                mesh.indices.data(), 4 * mesh.indices.size());
    CALL(library, rtcCommitGeometry)(made);
    CALL(library, rtcAttachGeometry)(library.scene, made);
    return made;
}

Library open_library(const char* path, const Mesh& mesh) {
    Library library = {};
    library.handle = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    if (library.handle == nullptr) {
        std::fprintf(stderr, "speed: %s\n", dlerror());
        std::exit(3);
    }
    library.device = CALL(library, rtcNewDevice)("threads=1");
    library.scene = CALL(library, rtcNewScene)(library.device);
    library.mesh = add_mesh(library, mesh);
    CALL(library, rtcCommitScene)(library.scene);
    return library;
}

RTCRayHit make_ray(float ox, float oy, float oz, float dx, float dy, float dz) {
    RTCRayHit ray;
    std::memset(&ray, 0, sizeof ray);
    ray.ray.org_x = ox, ray.ray.org_y = oy, ray.ray.org_z = oz;
    ray.ray.dir_x = dx, ray.ray.dir_y = dy, ray.ray.dir_z = dz;
    ray.ray.tfar = INFINITY;
    ray.ray.mask = 0xFFFFFFFFu;
    ray.hit.geomID = ray.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    return ray;
}

/// Row by row.
std::vector<RTCRayHit> camera_rays() {
    std::vector<RTCRayHit> rays;
    for (int y = 0; y < kImage; ++y)
        for (int x = 0; x < kImage; ++x)
            rays.push_back(make_ray(0.3f, 0.4f, 2.5f,
                                    1.1f * (static_cast<float>(x) / kImage - 0.5f),
                                    1.1f * (static_cast<float>(y) / kImage - 0.5f), -1));
    return rays;
}

std::vector<RTCRayHit> random_rays() {
    std::vector<RTCRayHit> rays;
    unsigned int state = 1;
    const auto next = [&] {
        state = state * 1664525u + 1013904223u;
        return static_cast<float>(state >> 8) / 8388608.0f - 1;
    };
    for (int i = 0; i < kImage * kImage; ++i) {
        const float x = 2 * next(), y = 2 * next(), z = 2 * next();
        rays.push_back(make_ray(x, y, z, next() - x, next() - y, next() - z));
    }
    return rays;
}

/// Blocks of 4 x 4 pixels.
std::vector<RTCRayHit16> packets_of(const std::vector<RTCRayHit>& rays) {
    std::vector<RTCRayHit16> packets(rays.size() / 16);
    constexpr std::size_t kMembers = sizeof(RTCRayHit16) / 64;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        const std::size_t x = i % kImage, y = i / kImage;
        const std::size_t packet = y / 4 * (kImage / 4) + x / 4, lane = y % 4 * 4 + x % 4;
        for (std::size_t k = 0; k < kMembers; ++k)
            std::memcpy(reinterpret_cast<float*>(&packets[packet]) + k * 16 + lane,
                        reinterpret_cast<const float*>(&rays[i]) + k, 4);
    }
    return packets;
}

/// Times work(library) for both in turn; returns the seconds of each.
std::pair<double, double> compare(const Library& a, const Library& b,
                                  const std::function<double(const Library&)>& work) {
    std::vector<double> first, second;
    for (int round = 0; round < kRounds; ++round) {
        first.push_back(work(a));
        second.push_back(work(b));
    }
    std::sort(first.begin(), first.end());
    std::sort(second.begin(), second.end());
    return {first[kRounds / 2], second[kRounds / 2]};
}

void print(const char* name, std::pair<double, double> seconds) {
    const double rays = kImage * kImage * 1e-6;
    std::printf("%-28s %8.2f %8.2f Mray/s  ratio %.2f\n", name, rays / seconds.first,
                rays / seconds.second, seconds.first / seconds.second);
}

void compare_rays(const char* name, const Library& a, const Library& b,
                  const std::vector<RTCRayHit>& rays) {
    const auto time = [&](auto each) {
        return compare(a, b, [&](const Library& library) {
            std::vector<RTCRayHit> asked = rays;
            const double begin = now();
            each(library, asked);
            return now() - begin;
        });
    };
#if MORPHRAY_EMBREE == 3
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    if (std::strcmp(name, "camera") == 0) context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
#endif
    print((std::string(name) + " rtcIntersect1").c_str(),
          time([&](const Library& library, std::vector<RTCRayHit>& asked) {
              const auto call = CALL(library, rtcIntersect1);
#if MORPHRAY_EMBREE == 3
              for (RTCRayHit& ray : asked) call(library.scene, &context, &ray);
#else
              for (RTCRayHit& ray : asked) call(library.scene, &ray, nullptr);
#endif
          }));
    print((std::string(name) + " rtcOccluded1").c_str(),
          time([&](const Library& library, std::vector<RTCRayHit>& asked) {
              const auto call = CALL(library, rtcOccluded1);
#if MORPHRAY_EMBREE == 3
              for (RTCRayHit& ray : asked) call(library.scene, &context, &ray.ray);
#else
              for (RTCRayHit& ray : asked) call(library.scene, &ray.ray, nullptr);
#endif
          }));
    const std::vector<RTCRayHit16> packets = packets_of(rays);
    print((std::string(name) + " rtcIntersect16").c_str(),
          compare(a, b, [&](const Library& library) {
              std::vector<RTCRayHit16> asked = packets;
              alignas(64) int valid[16];
              std::fill(valid, valid + 16, -1);
              const auto call = CALL(library, rtcIntersect16);
              const double begin = now();
#if MORPHRAY_EMBREE == 3
              for (RTCRayHit16& packet : asked) call(valid, library.scene, &context, &packet);
#else
              for (RTCRayHit16& packet : asked) call(valid, library.scene, &packet, nullptr);
#endif
              return now() - begin;
          }));
#if MORPHRAY_EMBREE == 3
    print((std::string(name) + " rtcIntersect1M").c_str(),
          time([&](const Library& library, std::vector<RTCRayHit>& asked) {
              CALL(library, rtcIntersect1M)
              (library.scene, &context, asked.data(), static_cast<unsigned int>(asked.size()),
               sizeof(RTCRayHit));
          }));
    print((std::string(name) + " rtcOccluded1M").c_str(),
          time([&](const Library& library, std::vector<RTCRayHit>& asked) {
              CALL(library, rtcOccluded1M)
              (library.scene, &context, &asked.data()->ray, static_cast<unsigned int>(asked.size()),
               sizeof(RTCRayHit));
          }));
#endif
}

/// Two shells with masks 1, outside, and 2: rays that see both, and rays that see the inner one
/// through the outer one.
void compare_masks(const Library& a, const Library& b, const Mesh& mesh,
                   const std::vector<RTCRayHit>& rays) {
    Library shells[] = {a, b};
    for (Library& library : shells) {
        library.scene = CALL(library, rtcNewScene)(library.device);
        for (unsigned int mask = 1; mask <= 2; ++mask) {
            const RTCGeometry shell = add_mesh(library, mesh, mask == 1 ? 1.05f : 1.0f);
            CALL(library, rtcSetGeometryMask)(shell, mask);
            CALL(library, rtcCommitGeometry)(shell);
        }
        CALL(library, rtcCommitScene)(library.scene);
    }
    const std::pair<const char*, unsigned int> cases[] = {{"mask of both", 3},
                                                          {"mask of inner", 2}};
    for (const auto& [name, mask] : cases) {
        std::vector<RTCRayHit> asked = rays;
        for (RTCRayHit& ray : asked) ray.ray.mask = mask;
        compare_rays(name, shells[0], shells[1], asked);
    }
}

void compare_commits(const Library& a, const Library& b, unsigned int side) {
    const Mesh poses[] = {make_mesh(side, 0), make_mesh(side, 0.1f)};
    int turn = 0;
    const auto seconds = compare(a, b, [&](const Library& library) {
        const Mesh& pose = poses[turn++ / 2 % 2];
        std::memcpy(
            CALL(library, rtcGetGeometryBufferData)(library.mesh, RTC_BUFFER_TYPE_VERTEX, 0),
            pose.vertices.data(), 4 * pose.vertices.size());
        CALL(library, rtcUpdateGeometryBuffer)(library.mesh, RTC_BUFFER_TYPE_VERTEX, 0);
        CALL(library, rtcCommitGeometry)(library.mesh);
        const double begin = now();
        CALL(library, rtcCommitScene)(library.scene);
        return now() - begin;
    });
    std::printf("%-28s %8.2f %8.2f ms      ratio %.2f\n", "commit with REFIT", seconds.first * 1e3,
                seconds.second * 1e3, seconds.first / seconds.second);
}

}  // namespace

int main(int argc, char** argv) {
    if (argc < 3) {
        std::fprintf(stderr, "usage: speed A.so B.so [SIDE]\n");
        return 2;
    }
    const unsigned int side = argc > 3 ? static_cast<unsigned int>(std::atoi(argv[3])) : 300;
    const Mesh mesh = make_mesh(side, 0);
    const Library a = open_library(argv[1], mesh);
    const Library b = open_library(argv[2], mesh);
    compare_rays("camera", a, b, camera_rays());
    compare_rays("random", a, b, random_rays());
    compare_masks(a, b, mesh, camera_rays());
    compare_commits(a, b, side);
}
