#include "lab/accuracy/methods/method.h"

#ifdef MORPHRAY_EMBREE
#include <memory>

#include "lab/embree.h"

namespace mray::accuracy {
namespace {

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

}  // namespace

std::vector<Method> embree_methods(const ChartScene& scene) {
    return {embree_method("Embree fast", scene, RTC_SCENE_FLAG_NONE),
            embree_method("Embree robust", scene, RTC_SCENE_FLAG_ROBUST)};
}

}  // namespace mray::accuracy
#else
namespace mray::accuracy {

std::vector<Method> embree_methods(const ChartScene&) { return {}; }

}  // namespace mray::accuracy
#endif
