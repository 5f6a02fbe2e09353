// Whole tracers are under test here: ours, and Embree where the program was built with it.
#include <memory>

#include "common/base/errors.h"
#include "cpu/image/tile_tracer.h"
#include "cpu/reference/scalar_tracer.h"
#include "cpu/single_ray/single_ray_tracer.h"
#include "lab/accuracy/methods/method.h"
#ifdef MORPHRAY_EMBREE
#include "lab/embree.h"
#endif

namespace mray::accuracy {
namespace {

constexpr std::uint32_t kSide = kChartTileSide;
static_assert(kSide == cpu::kCameraSide);

Method ours(std::string name, TraceBatch trace) {
    Method method;
    method.name = std::move(name);
    method.in_scene_space = true;
    method.trace = std::move(trace);
    return method;
}

Method single(const ChartScene& scene, const SimdTarget& target) {
    return ours("single", [tracer = cpu::SingleRayTracer(scene.scene_space.bvh, target)](
                              std::span<const Ray> rays, std::span<Hit> hits) {
        tracer.intersect(rays, hits);
    });
}

/// Traces the camera's pixels in packets and any other rays as single rays.
Method packets(const ChartScene& scene, const SimdTarget& target) {
    Method method = ours("packets", single(scene, target).trace);
    const auto tracer = std::make_shared<const cpu::TileTracer>(scene.scene_space.bvh, target,
                                                                cpu::PacketUse::kAlways);
    method.trace_tile = [tracer, &scene](std::size_t tile, std::span<Hit> hits) {
        const cpu::ImageTiles tiles(scene.params.width, scene.params.height, kSide);
        tracer->intersect_camera(scene.params, tiles[static_cast<std::uint32_t>(tile)], hits.data(),
                                 kSide);
    };
    return method;
}

void add_vulkan(const ChartScene& scene, const MakeBackend& make_vulkan,
                std::vector<Method>& methods) {
    std::shared_ptr<Backend> backend;
    try {
        backend = make_vulkan();
    } catch (const Error& error) {
        if (error.kind() != ErrorKind::kUnavailable) throw;
        return;
    }
    backend->set_scene(scene.topology, scene.scene_space.positions, scene.scene_space.bvh);
    methods.push_back(ours("Vulkan", [backend](std::span<const Ray> rays, std::span<Hit> hits) {
        backend->trace({rays, hits});
    }));
    methods.back().alone = true;
}

#ifdef MORPHRAY_EMBREE
class EmbreeScene {
public:
    EmbreeScene(const ChartScene& scene, RTCSceneFlags flags)
        : device_(rtcNewDevice(nullptr)), scene_(rtcNewScene(device_.get())) {
        const embree::Owned<RTCGeometry> geometry(
            rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_TRIANGLE));
        const std::vector<vec3>& positions = scene.world_space.positions;
        const std::vector<uvec3>& triangles = scene.topology.triangles;
        auto* const vertices = static_cast<vec3*>(
            rtcSetNewGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                    sizeof(vec3), positions.size()));
        std::copy(positions.begin(), positions.end(), vertices);
        auto* const indices = static_cast<uvec3*>(
            rtcSetNewGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                    sizeof(uvec3), triangles.size()));
        std::copy(triangles.begin(), triangles.end(), indices);
        rtcCommitGeometry(geometry.get());
        rtcAttachGeometry(scene_.get(), geometry.get());
        rtcSetSceneFlags(scene_.get(), flags);
        rtcCommitScene(scene_.get());
    }

    void trace(std::span<const Ray> rays, std::span<Hit> hits) const {
        embree::Query query(embree::Coherence::kCoherent);
        for (std::size_t i = 0; i < rays.size(); ++i) {
            RTCRayHit record{};
            embree::set_ray(record.ray, 0, rays[i]);
            embree::clear_hit(record, 0);
            query.trace(scene_.get(), record, nullptr);
            hits[i] = embree::hit_of(record, 0);
        }
    }

private:
    embree::Owned<RTCDevice> device_;
    embree::Owned<RTCScene> scene_;
};

Method embree_method(const char* name, const ChartScene& scene, RTCSceneFlags flags) {
    Method method;
    method.name = name;
    const auto made = std::make_shared<const EmbreeScene>(scene, flags);
    method.trace = [made](std::span<const Ray> rays, std::span<Hit> hits) {
        made->trace(rays, hits);
    };
    return method;
}
#endif

}  // namespace

Method single_method(const ChartScene& scene) {
    return single(scene, supported_simd_targets().front());
}

std::vector<Method> our_methods(const ChartScene& scene, const MakeBackend& make_vulkan) {
    const Bvh& bvh = scene.scene_space.bvh;
    std::vector<Method> methods;
    methods.push_back(ours("scalar", [tracer = cpu::ScalarTracer(bvh)](std::span<const Ray> rays,
                                                                       std::span<Hit> hits) {
        for (std::size_t i = 0; i < rays.size(); ++i) hits[i] = tracer.intersect(rays[i]);
    }));
    methods.push_back(single_method(scene));
    methods.push_back(packets(scene, supported_simd_targets().front()));
    add_vulkan(scene, make_vulkan, methods);
    return methods;
}

#ifdef MORPHRAY_EMBREE
std::vector<Method> embree_methods(const ChartScene& scene) {
    return {embree_method("Embree fast", scene, RTC_SCENE_FLAG_NONE),
            embree_method("Embree robust", scene, RTC_SCENE_FLAG_ROBUST)};
}
#else
std::vector<Method> embree_methods(const ChartScene&) { return {}; }
#endif

}  // namespace mray::accuracy
