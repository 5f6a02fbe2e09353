#include "lab/bench/embree/embree_peer.h"

#include <fmt/format.h>

#include <limits>

#include "common/base/errors.h"
#include "common/bvh/box.h"
#include "common/simd/simd_target.h"
#include "lab/embree.h"

namespace mray::bench {

EmbreeDevice::EmbreeDevice(int threads, const std::string& isa) : isa_(isa.empty() ? "all" : isa) {
    const std::string settings =
        fmt::format("threads={}{}{}", threads, isa.empty() ? "" : ",isa=", isa);
    handle_.reset(rtcNewDevice(settings.c_str()));
    if (!handle_) throw Error(ErrorKind::kUnavailable, "Embree: no device with \"{}\"", settings);
}

std::vector<EmbreeDevice> embree_devices(int threads) {
    std::vector<EmbreeDevice> devices;
    const std::string best = best_simd_target().name;
    if (best == "avx512") devices.emplace_back(threads, "avx512");
    devices.emplace_back(threads, best.starts_with("avx") ? "avx2" : "");
    return devices;
}

void EmbreeDevice::check(const char* action) const {
    const RTCError error = rtcGetDeviceError(handle());
    if (error == RTC_ERROR_NONE) return;
    throw Error(ErrorKind::kInternal, "Embree: {}: error {}", action, static_cast<int>(error));
}

EmbreeMesh::EmbreeMesh(const Topology& topology, std::span<const vec3> positions)
    : topology_(&topology) {
    // Embree loads 16 bytes at each vertex.
    vertices_.resize(positions.size() + 1);
    set_positions(positions);
}

void EmbreeMesh::set_positions(std::span<const vec3> positions) {
    // Embree ignores triangles with NaN vertices, as morphray does those that are not finite.
    constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
    for (std::size_t i = 0; i < positions.size(); ++i) {
        vertices_[i] = is_finite_vertex(positions[i]) ? positions[i] : vec3(kNan, kNan, kNan);
    }
}

EmbreeScene::EmbreeScene(const EmbreeDevice& device, const EmbreeMesh& mesh,
                         RTCBuildQuality quality, bool robust)
    : device_(&device),
      geometry_(rtcNewGeometry(device.handle(), RTC_GEOMETRY_TYPE_TRIANGLE)),
      scene_(rtcNewScene(device.handle())) {
    const Topology& topology = mesh.topology();
    rtcSetSharedGeometryBuffer(geometry_.get(), RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                               mesh.vertices(), 0, sizeof(vec3), topology.vertex_count);
    rtcSetSharedGeometryBuffer(geometry_.get(), RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                               topology.triangles.data(), 0, sizeof(uvec3),
                               topology.triangles.size());
    // Embree refits only with these three; otherwise it rebuilds silently.
    const bool refits = quality == RTC_BUILD_QUALITY_REFIT;
    rtcSetGeometryBuildQuality(geometry_.get(), quality);
    rtcSetSceneBuildQuality(scene_.get(), refits ? RTC_BUILD_QUALITY_LOW : quality);
    const int flags = (refits ? RTC_SCENE_FLAG_DYNAMIC : RTC_SCENE_FLAG_NONE) |
                      (robust ? RTC_SCENE_FLAG_ROBUST : RTC_SCENE_FLAG_NONE);
    rtcSetSceneFlags(scene_.get(), static_cast<RTCSceneFlags>(flags));
    rtcCommitGeometry(geometry_.get());
    rtcAttachGeometry(scene_.get(), geometry_.get());
    rtcCommitScene(scene_.get());
    device.check("build a scene");
}

void EmbreeScene::update() {
    rtcUpdateGeometryBuffer(geometry_.get(), RTC_BUFFER_TYPE_VERTEX, 0);
    rtcCommitGeometry(geometry_.get());
    rtcCommitScene(scene_.get());
    device_->check("update a scene");
}

EmbreeScenes::EmbreeScenes(std::span<const EmbreeDevice> devices, const BenchScene& scene)
    : mesh_(scene.topology(), scene.positions) {
    for (const EmbreeDevice& device : devices) {
        for (const auto quality : {RTC_BUILD_QUALITY_MEDIUM, RTC_BUILD_QUALITY_HIGH}) {
            const char* const name = quality == RTC_BUILD_QUALITY_MEDIUM ? "MEDIUM" : "HIGH";
            for (const bool robust : {false, true}) {
                variants_.push_back({EmbreeScene(device, mesh_, quality, robust), robust,
                                     fmt::format("{} {}", name, device.isa())});
            }
        }
    }
}

}  // namespace mray::bench
