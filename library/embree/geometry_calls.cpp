// The functions of Embree about geometries and their buffers.
#include <cstdint>
#include <utility>

#include "library/embree/device.h"
#include "library/embree/geometry.h"
#include "library/embree/scene/scene.h"

namespace mray::embree {
namespace {

template <class Work>
auto with_geometry(const char* call, RTCGeometry geometry, Work work) {
    return with<Geometry>(call, geometry, work);
}

/// Refuses a call about what no supported geometry has. A geometry that has it was refused when it
/// was made.
void refuse(const char* call, RTCGeometry geometry, const char* what) {
    with_geometry(call, geometry, [&](const Geometry& g) {
        if (g.unsupported() == nullptr) fail_unsupported(what);
    });
}

unsigned int refuse_half_edge(const char* call, RTCGeometry geometry) {
    refuse(call, geometry, "subdivision surfaces are");
    return kInvalid;
}

/// Flags of curves are bytes, so the buffers of other types may lie anywhere.
void check_places(const Geometry& geometry, std::size_t first, std::size_t stride) {
    if (geometry.unsupported() == nullptr && (first % 4 != 0 || stride % 4 != 0))
        fail_operation("offset and stride of a buffer are multiples of 4 bytes");
}

void require_filters(const Geometry& geometry) {
    if (geometry.is_instance()) fail_operation("instances have no filters");
}

BufferView make_view(const Geometry& geometry, Ref<Buffer> buffer, RTCFormat format,
                     std::size_t offset, std::size_t stride, std::size_t count) {
    check_places(geometry, reinterpret_cast<std::uintptr_t>(buffer->data()) + offset, stride);
    char* const data = buffer->data() == nullptr ? nullptr : buffer->data() + offset;
    if (data == nullptr && count > 0) fail_argument("the buffer has no data");
    return {std::move(buffer), format, data, stride, count};
}

}  // namespace
}  // namespace mray::embree

using namespace mray::embree;

/// Geometries that are not supported are errors here and at the commit of a scene with them.
RTCGeometry rtcNewGeometry(RTCDevice device, enum RTCGeometryType type) {
    return with<Device>("rtcNewGeometry", device, [&](Device& d) {
        auto* const made = new Geometry(d, type);
        with<Geometry>("rtcNewGeometry", reinterpret_cast<RTCGeometry>(made), [](Geometry& g) {
            if (const char* const name = g.unsupported()) fail_unsupported(name);
        });
        return reinterpret_cast<RTCGeometry>(made);
    });
}

void rtcRetainGeometry(RTCGeometry geometry) {
    with_geometry("rtcRetainGeometry", geometry, [](Geometry& g) { g.retain(); });
}

void rtcReleaseGeometry(RTCGeometry geometry) {
    with_geometry("rtcReleaseGeometry", geometry, [](Geometry& g) { g.release(); });
}

/// Changes count at the commit of a scene, whether they were committed here or not.
void rtcCommitGeometry(RTCGeometry geometry) {
    with_geometry("rtcCommitGeometry", geometry, [](Geometry& g) { g.commit(); });
}

void rtcEnableGeometry(RTCGeometry geometry) {
    with_geometry("rtcEnableGeometry", geometry, [](Geometry& g) { g.enable(true); });
}

void rtcDisableGeometry(RTCGeometry geometry) {
    with_geometry("rtcDisableGeometry", geometry, [](Geometry& g) { g.enable(false); });
}

void rtcSetGeometryTimeStepCount(RTCGeometry geometry, unsigned int count) {
    with_geometry("rtcSetGeometryTimeStepCount", geometry,
                  [&](Geometry& g) { g.set_time_steps(count); });
}

/// Without motion blur a range of times says nothing.
void rtcSetGeometryTimeRange(RTCGeometry geometry, float begin, float end) {
    with_geometry("rtcSetGeometryTimeRange", geometry, [&](Geometry&) {
        if (begin > end) fail_argument("the range of times ends before it begins");
    });
}

void rtcSetGeometryVertexAttributeCount(RTCGeometry geometry, unsigned int count) {
    with_geometry("rtcSetGeometryVertexAttributeCount", geometry,
                  [&](Geometry& g) { g.set_attribute_count(count); });
}

void rtcSetGeometryMask(RTCGeometry geometry, unsigned int mask) {
    with_geometry("rtcSetGeometryMask", geometry, [&](Geometry& g) { g.set_mask(mask); });
}

void rtcSetGeometryBuildQuality(RTCGeometry geometry, enum RTCBuildQuality quality) {
    with_geometry("rtcSetGeometryBuildQuality", geometry,
                  [&](Geometry& g) { g.set_build_quality(quality); });
}

void rtcSetGeometryMaxRadiusScale(RTCGeometry geometry, float) {
    refuse("rtcSetGeometryMaxRadiusScale", geometry, "curves and points are");
}

void rtcSetGeometryBuffer(RTCGeometry geometry, enum RTCBufferType type, unsigned int slot,
                          enum RTCFormat format, RTCBuffer buffer, size_t offset, size_t stride,
                          size_t count) {
    with_geometry("rtcSetGeometryBuffer", geometry, [&](Geometry& g) {
        if (buffer == nullptr) fail_argument("the buffer is null");
        const Ref<Buffer> shared(reinterpret_cast<Buffer*>(buffer));
        if (&shared->device() != &g.device()) fail_argument("the buffer is of another device");
        if (offset > shared->size() ||
            (stride != 0 && count > (shared->size() - offset + stride - 1) / stride))
            fail_argument("the items reach beyond the end of the buffer");
        g.set_buffer(type, slot, make_view(g, shared, format, offset, stride, count));
    });
}

void rtcSetSharedGeometryBuffer(RTCGeometry geometry, enum RTCBufferType type, unsigned int slot,
                                enum RTCFormat format, const void* data, size_t offset,
                                size_t stride, size_t count) {
    with_geometry("rtcSetSharedGeometryBuffer", geometry, [&](Geometry& g) {
        auto* const made = new Buffer(g.device(), const_cast<void*>(data), offset + stride * count);
        const Ref<Buffer> shared(made);
        made->release();
        g.set_buffer(type, slot, make_view(g, shared, format, offset, stride, count));
    });
}

void* rtcSetNewGeometryBuffer(RTCGeometry geometry, enum RTCBufferType type, unsigned int slot,
                              enum RTCFormat format, size_t stride, size_t count) {
    return with_geometry("rtcSetNewGeometryBuffer", geometry, [&](Geometry& g) -> void* {
        if (stride != 0 && count > SIZE_MAX / 2 / stride) throw std::bad_alloc();
        check_places(g, 0, stride);
        auto* const made = new Buffer(g.device(), stride * count);
        const Ref<Buffer> own(made);
        made->release();
        g.set_buffer(type, slot, make_view(g, own, format, 0, stride, count));
        return own->data();
    });
}

void* rtcGetGeometryBufferData(RTCGeometry geometry, enum RTCBufferType type, unsigned int slot) {
    return with_geometry("rtcGetGeometryBufferData", geometry, [&](Geometry& g) -> void* {
        const BufferView* const view = g.find_buffer(type, slot);
        if (view == nullptr) fail_argument("this geometry has no buffer of this type and slot");
        return view->data;
    });
}

void rtcUpdateGeometryBuffer(RTCGeometry geometry, enum RTCBufferType type, unsigned int slot) {
    with_geometry("rtcUpdateGeometryBuffer", geometry,
                  [&](Geometry& g) { g.touch_buffer(type, slot); });
}

void rtcSetGeometryIntersectFilterFunction(RTCGeometry geometry, RTCFilterFunctionN filter) {
    with_geometry("rtcSetGeometryIntersectFilterFunction", geometry, [&](Geometry& g) {
        require_filters(g);
        g.intersect_filter = filter;
        g.settings_changed();
    });
}

void rtcSetGeometryOccludedFilterFunction(RTCGeometry geometry, RTCFilterFunctionN filter) {
    with_geometry("rtcSetGeometryOccludedFilterFunction", geometry, [&](Geometry& g) {
        require_filters(g);
        g.occluded_filter = filter;
        g.settings_changed();
    });
}

void rtcSetGeometryUserData(RTCGeometry geometry, void* user) {
    with_geometry("rtcSetGeometryUserData", geometry, [&](Geometry& g) { g.user = user; });
}

void* rtcGetGeometryUserData(RTCGeometry geometry) {
    return with_geometry("rtcGetGeometryUserData", geometry, [](Geometry& g) { return g.user; });
}

void rtcSetGeometryPointQueryFunction(RTCGeometry geometry, RTCPointQueryFunction function) {
    with_geometry("rtcSetGeometryPointQueryFunction", geometry,
                  [&](Geometry& g) { g.point_query = function; });
}

void rtcSetGeometryInstancedScene(RTCGeometry geometry, RTCScene scene) {
    with_geometry("rtcSetGeometryInstancedScene", geometry, [&](Geometry& g) {
        g.set_instanced_scene(reinterpret_cast<SceneObject*>(scene));
    });
}

void rtcSetGeometryTransform(RTCGeometry geometry, unsigned int step, enum RTCFormat format,
                             const void* floats) {
    with_geometry("rtcSetGeometryTransform", geometry,
                  [&](Geometry& g) { g.set_transform(step, read_transform(format, floats)); });
}

void rtcSetGeometryTransformQuaternion(RTCGeometry geometry, unsigned int,
                                       const struct RTCQuaternionDecomposition*) {
    refuse("rtcSetGeometryTransformQuaternion", geometry, "quaternions are");
}

void rtcGetGeometryTransform(RTCGeometry geometry, float, enum RTCFormat format, void* floats) {
    with_geometry("rtcGetGeometryTransform", geometry, [&](Geometry& g) {
        if (!g.is_instance()) fail_operation("the geometry is no instance");
        write_transform(g.transform(), format, floats);
    });
}

void rtcInterpolate(const struct RTCInterpolateArguments* asked) {
    refuse("rtcInterpolate", asked == nullptr ? nullptr : asked->geometry, "interpolation is");
}
void rtcInterpolateN(const struct RTCInterpolateNArguments* asked) {
    refuse("rtcInterpolateN", asked == nullptr ? nullptr : asked->geometry, "interpolation is");
}
void rtcSetGeometryUserPrimitiveCount(RTCGeometry geometry, unsigned int) {
    refuse("rtcSetGeometryUserPrimitiveCount", geometry, "user geometries are");
}
void rtcSetGeometryBoundsFunction(RTCGeometry geometry, RTCBoundsFunction, void*) {
    refuse("rtcSetGeometryBoundsFunction", geometry, "user geometries are");
}
void rtcSetGeometryIntersectFunction(RTCGeometry geometry, RTCIntersectFunctionN) {
    refuse("rtcSetGeometryIntersectFunction", geometry, "user geometries are");
}
void rtcSetGeometryOccludedFunction(RTCGeometry geometry, RTCOccludedFunctionN) {
    refuse("rtcSetGeometryOccludedFunction", geometry, "user geometries are");
}
void rtcSetGeometryTessellationRate(RTCGeometry geometry, float) {
    refuse("rtcSetGeometryTessellationRate", geometry, "curves and subdivision surfaces are");
}
void rtcSetGeometryTopologyCount(RTCGeometry geometry, unsigned int) {
    refuse("rtcSetGeometryTopologyCount", geometry, "subdivision surfaces are");
}
void rtcSetGeometrySubdivisionMode(RTCGeometry geometry, unsigned int, enum RTCSubdivisionMode) {
    refuse("rtcSetGeometrySubdivisionMode", geometry, "subdivision surfaces are");
}
void rtcSetGeometryVertexAttributeTopology(RTCGeometry geometry, unsigned int, unsigned int) {
    refuse("rtcSetGeometryVertexAttributeTopology", geometry, "subdivision surfaces are");
}
void rtcSetGeometryDisplacementFunction(RTCGeometry geometry, RTCDisplacementFunctionN) {
    refuse("rtcSetGeometryDisplacementFunction", geometry, "subdivision surfaces are");
}
unsigned int rtcGetGeometryFirstHalfEdge(RTCGeometry geometry, unsigned int) {
    return refuse_half_edge("rtcGetGeometryFirstHalfEdge", geometry);
}
unsigned int rtcGetGeometryFace(RTCGeometry geometry, unsigned int) {
    return refuse_half_edge("rtcGetGeometryFace", geometry);
}
unsigned int rtcGetGeometryNextHalfEdge(RTCGeometry geometry, unsigned int) {
    return refuse_half_edge("rtcGetGeometryNextHalfEdge", geometry);
}
unsigned int rtcGetGeometryPreviousHalfEdge(RTCGeometry geometry, unsigned int) {
    return refuse_half_edge("rtcGetGeometryPreviousHalfEdge", geometry);
}
unsigned int rtcGetGeometryOppositeHalfEdge(RTCGeometry geometry, unsigned int, unsigned int) {
    return refuse_half_edge("rtcGetGeometryOppositeHalfEdge", geometry);
}

#if MORPHRAY_EMBREE == 4

void rtcSetGeometryEnableFilterFunctionFromArguments(RTCGeometry geometry, bool is_enabled) {
    with_geometry("rtcSetGeometryEnableFilterFunctionFromArguments", geometry, [&](Geometry& g) {
        g.takes_argument_filter = is_enabled;
        g.settings_changed();
    });
}

void rtcGetGeometryTransformEx(RTCGeometry geometry, unsigned int, float time,
                               enum RTCFormat format, void* floats) {
    const auto* const object = reinterpret_cast<Geometry*>(geometry);
    if (object == nullptr || !object->is_instance_array())
        return rtcGetGeometryTransform(geometry, time, format, floats);
    refuse("rtcGetGeometryTransformEx", geometry, "instance arrays are");
}

void rtcSetGeometryInstancedScenes(RTCGeometry geometry, RTCScene*, size_t) {
    refuse("rtcSetGeometryInstancedScenes", geometry, "instance arrays are");
}

void* rtcGetGeometryUserDataFromScene(RTCScene scene, unsigned int id) {
    return with<SceneObject>("rtcGetGeometryUserDataFromScene", scene, [&](SceneObject& s) {
        const Geometry* const geometry = s.find(id);
        if (geometry == nullptr) fail_argument("no geometry has this ID");
        return geometry->user;
    });
}

void rtcGetGeometryTransformFromScene(RTCScene scene, unsigned int id, float time,
                                      enum RTCFormat format, void* floats) {
    with<SceneObject>("rtcGetGeometryTransformFromScene", scene, [&](SceneObject& s) {
        Geometry* const geometry = s.find(id);
        if (geometry == nullptr) fail_argument("no geometry has this ID");
        rtcGetGeometryTransform(reinterpret_cast<RTCGeometry>(geometry), time, format, floats);
    });
}

#endif
