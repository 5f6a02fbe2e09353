// The functions of Embree about geometries and their buffers.
#include <cstdint>
#include <utility>
#include <vector>

#include "embree/device.h"
#include "embree/geometry.h"
#include "embree/scene/scene.h"

namespace mray::embree {
namespace {

template <class Work>
auto with_geometry(const char* call, RTCGeometry geometry, Work work) {
    return with<Geometry>(call, geometry, work);
}

/// For calls about what no supported geometry has: calls `work` for a geometry that has it. Without
/// a twin such a geometry was refused when it was made.
template <class Work>
auto with_unsupported(const char* call, RTCGeometry geometry, const char* what, Work work) {
    return with_geometry(call, geometry, [&](Geometry& g) {
        if (g.unsupported() == nullptr) fail_unsupported(what);
        return work(g);
    });
}

/// The same for a function that the twin alone has.
template <class Function, class... Arguments>
void tell_twin(const char* call, RTCGeometry geometry, const char* what,
               Function Fallback::*function, Arguments... arguments) {
    with_unsupported(call, geometry, what,
                     [&](Geometry& g) { on_twin(g, function, arguments...); });
}

/// The same for a question about the half edges of a subdivision surface.
template <class Function, class... Arguments>
unsigned int ask_twin(const char* call, RTCGeometry geometry, Function Fallback::*function,
                      Arguments... arguments) {
    unsigned int answer = kInvalid;
    with_unsupported(call, geometry, "subdivision surfaces are", [&](Geometry& g) {
        if (g.twin() != nullptr)
            answer = (g.device().fallback()->*function)(g.twin(), arguments...);
    });
    return answer;
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

/// Geometries that are not supported, and have no twin, are errors here and at the commit of a
/// scene with them.
RTCGeometry rtcNewGeometry(RTCDevice device, enum RTCGeometryType type) {
    return with<Device>("rtcNewGeometry", device, [&](Device& d) {
        auto* const made = new Geometry(d, type);
        with<Geometry>("rtcNewGeometry", reinterpret_cast<RTCGeometry>(made), [](Geometry& g) {
            if (g.unsupported() != nullptr && g.twin() == nullptr)
                fail_unsupported(g.unsupported());
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

/// Changes count at the commit of a scene, whether they were committed here or not; for a twin they
/// count if they were.
void rtcCommitGeometry(RTCGeometry geometry) {
    with_geometry("rtcCommitGeometry", geometry, [](Geometry& g) {
        g.commit();
        on_twin(g, &Fallback::rtcCommitGeometry);
    });
}

void rtcEnableGeometry(RTCGeometry geometry) {
    with_geometry("rtcEnableGeometry", geometry, [](Geometry& g) {
        g.enable(true);
        on_twin(g, &Fallback::rtcEnableGeometry);
    });
}

void rtcDisableGeometry(RTCGeometry geometry) {
    with_geometry("rtcDisableGeometry", geometry, [](Geometry& g) {
        g.enable(false);
        on_twin(g, &Fallback::rtcDisableGeometry);
    });
}

void rtcSetGeometryTimeStepCount(RTCGeometry geometry, unsigned int count) {
    with_geometry("rtcSetGeometryTimeStepCount", geometry, [&](Geometry& g) {
        g.set_time_steps(count);
        on_twin(g, &Fallback::rtcSetGeometryTimeStepCount, count);
    });
}

/// Without motion blur a range of times says nothing.
void rtcSetGeometryTimeRange(RTCGeometry geometry, float begin, float end) {
    with_geometry("rtcSetGeometryTimeRange", geometry, [&](Geometry& g) {
        if (begin > end) fail_argument("the range of times ends before it begins");
        on_twin(g, &Fallback::rtcSetGeometryTimeRange, begin, end);
    });
}

void rtcSetGeometryVertexAttributeCount(RTCGeometry geometry, unsigned int count) {
    with_geometry("rtcSetGeometryVertexAttributeCount", geometry, [&](Geometry& g) {
        g.set_attribute_count(count);
        on_twin(g, &Fallback::rtcSetGeometryVertexAttributeCount, count);
    });
}

void rtcSetGeometryMask(RTCGeometry geometry, unsigned int mask) {
    with_geometry("rtcSetGeometryMask", geometry, [&](Geometry& g) {
        g.set_mask(mask);
        on_twin(g, &Fallback::rtcSetGeometryMask, mask);
    });
}

void rtcSetGeometryBuildQuality(RTCGeometry geometry, enum RTCBuildQuality quality) {
    with_geometry("rtcSetGeometryBuildQuality", geometry, [&](Geometry& g) {
        g.set_build_quality(quality);
        on_twin(g, &Fallback::rtcSetGeometryBuildQuality, quality);
    });
}

void rtcSetGeometryMaxRadiusScale(RTCGeometry geometry, float scale) {
    tell_twin("rtcSetGeometryMaxRadiusScale", geometry, "curves and points are",
              &Fallback::rtcSetGeometryMaxRadiusScale, scale);
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
    with_geometry("rtcUpdateGeometryBuffer", geometry, [&](Geometry& g) {
        g.touch_buffer(type, slot);
        on_twin(g, &Fallback::rtcUpdateGeometryBuffer, type, slot);
    });
}

void rtcSetGeometryIntersectFilterFunction(RTCGeometry geometry, RTCFilterFunctionN filter) {
    with_geometry("rtcSetGeometryIntersectFilterFunction", geometry, [&](Geometry& g) {
        require_filters(g);
        g.intersect_filter = filter;
        g.settings_changed();
        on_twin(g, &Fallback::rtcSetGeometryIntersectFilterFunction, filter);
    });
}

void rtcSetGeometryOccludedFilterFunction(RTCGeometry geometry, RTCFilterFunctionN filter) {
    with_geometry("rtcSetGeometryOccludedFilterFunction", geometry, [&](Geometry& g) {
        require_filters(g);
        g.occluded_filter = filter;
        g.settings_changed();
        on_twin(g, &Fallback::rtcSetGeometryOccludedFilterFunction, filter);
    });
}

void rtcSetGeometryUserData(RTCGeometry geometry, void* user) {
    with_geometry("rtcSetGeometryUserData", geometry, [&](Geometry& g) {
        g.user = user;
        on_twin(g, &Fallback::rtcSetGeometryUserData, user);
    });
}

void* rtcGetGeometryUserData(RTCGeometry geometry) {
    return with_geometry("rtcGetGeometryUserData", geometry, [](Geometry& g) { return g.user; });
}

void rtcSetGeometryPointQueryFunction(RTCGeometry geometry, RTCPointQueryFunction function) {
    with_geometry("rtcSetGeometryPointQueryFunction", geometry, [&](Geometry& g) {
        g.point_query = function;
        on_twin(g, &Fallback::rtcSetGeometryPointQueryFunction, function);
    });
}

void rtcSetGeometryInstancedScene(RTCGeometry geometry, RTCScene scene) {
    with_geometry("rtcSetGeometryInstancedScene", geometry, [&](Geometry& g) {
        auto* const object = reinterpret_cast<SceneObject*>(scene);
        g.set_instanced_scenes({&object, 1});
        on_twin(g, &Fallback::rtcSetGeometryInstancedScene, object->twin());
    });
}

void rtcSetGeometryTransform(RTCGeometry geometry, unsigned int step, enum RTCFormat format,
                             const void* floats) {
    with_geometry("rtcSetGeometryTransform", geometry, [&](Geometry& g) {
        g.set_transform(step, read_transform(format, floats));
        on_twin(g, &Fallback::rtcSetGeometryTransform, step, format, floats);
    });
}

void rtcSetGeometryTransformQuaternion(RTCGeometry geometry, unsigned int step,
                                       const struct RTCQuaternionDecomposition* parts) {
    with_geometry("rtcSetGeometryTransformQuaternion", geometry, [&](Geometry& g) {
        if (parts == nullptr) fail_argument("the transformation is null");
        g.set_transform(step, to_transform(*parts));
        on_twin(g, &Fallback::rtcSetGeometryTransformQuaternion, step, parts);
    });
}

void rtcGetGeometryTransform(RTCGeometry geometry, float time, enum RTCFormat format,
                             void* floats) {
    with_geometry("rtcGetGeometryTransform", geometry, [&](Geometry& g) {
        if (g.twin() != nullptr && g.is_blurred())
            return on_twin(g, &Fallback::rtcGetGeometryTransform, time, format, floats);
        if (!g.is_instance()) fail_operation("the geometry is no instance");
        write_transform(g.transform(), format, floats);
    });
}

void rtcSetGeometryUserPrimitiveCount(RTCGeometry geometry, unsigned int count) {
    tell_twin("rtcSetGeometryUserPrimitiveCount", geometry, "user geometries are",
              &Fallback::rtcSetGeometryUserPrimitiveCount, count);
}
void rtcSetGeometryBoundsFunction(RTCGeometry geometry, RTCBoundsFunction function, void* user) {
    tell_twin("rtcSetGeometryBoundsFunction", geometry, "user geometries are",
              &Fallback::rtcSetGeometryBoundsFunction, function, user);
}
void rtcSetGeometryIntersectFunction(RTCGeometry geometry, RTCIntersectFunctionN function) {
    tell_twin("rtcSetGeometryIntersectFunction", geometry, "user geometries are",
              &Fallback::rtcSetGeometryIntersectFunction, function);
}
void rtcSetGeometryOccludedFunction(RTCGeometry geometry, RTCOccludedFunctionN function) {
    tell_twin("rtcSetGeometryOccludedFunction", geometry, "user geometries are",
              &Fallback::rtcSetGeometryOccludedFunction, function);
}
void rtcSetGeometryTessellationRate(RTCGeometry geometry, float rate) {
    tell_twin("rtcSetGeometryTessellationRate", geometry, "curves and subdivision surfaces are",
              &Fallback::rtcSetGeometryTessellationRate, rate);
}
void rtcSetGeometryTopologyCount(RTCGeometry geometry, unsigned int count) {
    tell_twin("rtcSetGeometryTopologyCount", geometry, "subdivision surfaces are",
              &Fallback::rtcSetGeometryTopologyCount, count);
}
void rtcSetGeometrySubdivisionMode(RTCGeometry geometry, unsigned int topology,
                                   enum RTCSubdivisionMode mode) {
    tell_twin("rtcSetGeometrySubdivisionMode", geometry, "subdivision surfaces are",
              &Fallback::rtcSetGeometrySubdivisionMode, topology, mode);
}
void rtcSetGeometryVertexAttributeTopology(RTCGeometry geometry, unsigned int attribute,
                                           unsigned int topology) {
    tell_twin("rtcSetGeometryVertexAttributeTopology", geometry, "subdivision surfaces are",
              &Fallback::rtcSetGeometryVertexAttributeTopology, attribute, topology);
}
void rtcSetGeometryDisplacementFunction(RTCGeometry geometry, RTCDisplacementFunctionN function) {
    with_unsupported("rtcSetGeometryDisplacementFunction", geometry, "subdivision surfaces are",
                     [&](Geometry& g) { g.set_displacement(function); });
}
unsigned int rtcGetGeometryFirstHalfEdge(RTCGeometry geometry, unsigned int face) {
    return ask_twin("rtcGetGeometryFirstHalfEdge", geometry, &Fallback::rtcGetGeometryFirstHalfEdge,
                    face);
}
unsigned int rtcGetGeometryFace(RTCGeometry geometry, unsigned int edge) {
    return ask_twin("rtcGetGeometryFace", geometry, &Fallback::rtcGetGeometryFace, edge);
}
unsigned int rtcGetGeometryNextHalfEdge(RTCGeometry geometry, unsigned int edge) {
    return ask_twin("rtcGetGeometryNextHalfEdge", geometry, &Fallback::rtcGetGeometryNextHalfEdge,
                    edge);
}
unsigned int rtcGetGeometryPreviousHalfEdge(RTCGeometry geometry, unsigned int edge) {
    return ask_twin("rtcGetGeometryPreviousHalfEdge", geometry,
                    &Fallback::rtcGetGeometryPreviousHalfEdge, edge);
}
unsigned int rtcGetGeometryOppositeHalfEdge(RTCGeometry geometry, unsigned int topology,
                                            unsigned int edge) {
    return ask_twin("rtcGetGeometryOppositeHalfEdge", geometry,
                    &Fallback::rtcGetGeometryOppositeHalfEdge, topology, edge);
}

#if MORPHRAY_EMBREE == 4

void rtcSetGeometryEnableFilterFunctionFromArguments(RTCGeometry geometry, bool is_enabled) {
    with_geometry("rtcSetGeometryEnableFilterFunctionFromArguments", geometry, [&](Geometry& g) {
        g.takes_argument_filter = is_enabled;
        g.settings_changed();
        on_twin(g, &Fallback::rtcSetGeometryEnableFilterFunctionFromArguments, is_enabled);
    });
}

void rtcGetGeometryTransformEx(RTCGeometry geometry, unsigned int instance, float time,
                               enum RTCFormat format, void* floats) {
    const auto* const object = reinterpret_cast<Geometry*>(geometry);
    if (object == nullptr || !object->is_instance_array())
        return rtcGetGeometryTransform(geometry, time, format, floats);
    tell_twin("rtcGetGeometryTransformEx", geometry, "instance arrays are",
              &Fallback::rtcGetGeometryTransformEx, instance, time, format, floats);
}

void rtcSetGeometryInstancedScenes(RTCGeometry geometry, RTCScene* scenes, size_t count) {
    with_unsupported("rtcSetGeometryInstancedScenes", geometry, "instance arrays are",
                     [&](Geometry& g) {
                         if (g.twin() == nullptr) return;
                         if (scenes == nullptr) fail_argument("the scenes are null");
                         g.set_instanced_scenes({reinterpret_cast<SceneObject**>(scenes), count});
                         std::vector<RTCScene> twins;
                         for (const SceneObject* const scene : g.instanced_scenes())
                             twins.push_back(scene->twin());
                         on_twin(g, &Fallback::rtcSetGeometryInstancedScenes, twins.data(), count);
                     });
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
