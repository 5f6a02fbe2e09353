#include "lab/bench/embree/embree_peer.h"

#include <fmt/format.h>

#include <limits>

#include "common/base/errors.h"
#include "common/bvh/box.h"
#include "lab/bench/report.h"
#include "lab/embree.h"

namespace mray::bench {
namespace {

RTCBuildQuality scene_quality(EmbreeTree tree) {
    switch (tree) {
        case EmbreeTree::kMedium:
            return RTC_BUILD_QUALITY_MEDIUM;
        case EmbreeTree::kHigh:
            return RTC_BUILD_QUALITY_HIGH;
        case EmbreeTree::kLow:
        case EmbreeTree::kRefitted:
            break;
    }
    return RTC_BUILD_QUALITY_LOW;
}

}  // namespace

EmbreeDevice::EmbreeDevice(int threads, const std::string& isa) : isa_(isa.empty() ? "all" : isa) {
    const std::string settings =
        fmt::format("threads={}{}{}", threads, isa.empty() ? "" : ",isa=", isa);
    handle_.reset(rtcNewDevice(settings.c_str()));
    if (!handle_)
        throw Error(ErrorKind::kUnavailable,
                    fmt::format("Embree: no device with \"{}\"", settings));
}

std::vector<EmbreeDevice> embree_devices(int threads) {
    std::vector<EmbreeDevice> devices;
    const std::string machine = machine_isa();
    if (machine == "AVX-512") devices.emplace_back(threads, "avx512");
    devices.emplace_back(threads, machine.starts_with("AVX") ? "avx2" : "");
    return devices;
}

void EmbreeDevice::check(const char* action) const {
    const RTCError error = rtcGetDeviceError(handle());
    if (error == RTC_ERROR_NONE) return;
    throw Error(ErrorKind::kInternal,
                fmt::format("Embree: {}: error {}", action, static_cast<int>(error)));
}

std::string EmbreeDevice::version() {
    return fmt::format("{}{}", RTC_VERSION_STRING,
                       embree::kHasStreams ? "" : ", which has no streams");
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

EmbreeScene::EmbreeScene(const EmbreeDevice& device, const EmbreeMesh& mesh, EmbreeTree tree,
                         bool robust)
    : device_(&device),
      geometry_(rtcNewGeometry(device.handle(), RTC_GEOMETRY_TYPE_TRIANGLE)),
      scene_(rtcNewScene(device.handle())) {
    const Topology& topology = mesh.topology();
    rtcSetSharedGeometryBuffer(geometry_.get(), RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                               mesh.vertices(), 0, sizeof(vec3), topology.vertex_count);
    rtcSetSharedGeometryBuffer(geometry_.get(), RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                               topology.triangles.data(), 0, sizeof(uvec3),
                               topology.triangles.size());
    const bool refits = tree == EmbreeTree::kRefitted;
    rtcSetGeometryBuildQuality(geometry_.get(),
                               refits ? RTC_BUILD_QUALITY_REFIT : scene_quality(tree));
    rtcSetSceneBuildQuality(scene_.get(), scene_quality(tree));
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

}  // namespace mray::bench
