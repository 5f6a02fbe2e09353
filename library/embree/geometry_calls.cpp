// The functions of Embree about buffers and geometries.
#include <cstdint>
#include <new>
#include <utility>

#include "library/embree/geometry.h"
#include "library/embree/scene.h"

namespace mray::embree {
namespace {

/// Flags of curves are bytes, so the buffers of other types may lie anywhere.
void check_places(const Geometry& geometry, std::size_t first, std::size_t stride) {
    if (geometry.unsupported() == nullptr && (first % 4 != 0 || stride % 4 != 0))
        fail_operation("offset and stride of a buffer are multiples of 4 bytes");
}

BufferView make_view(const Geometry& geometry, Buffer& buffer, RTCFormat format, std::size_t offset,
                     std::size_t stride, std::size_t count) {
    check_places(geometry, reinterpret_cast<std::uintptr_t>(buffer.data()) + offset, stride);
    if (buffer.data() == nullptr && count > 0) fail_argument("the buffer has no data");
    char* const data = buffer.data() == nullptr ? nullptr : buffer.data() + offset;
    return {Ref<Buffer>(&buffer), format, data, stride, count};
}

/// A buffer that only the views of it keep alive.
Ref<Buffer> owned(Buffer* made) {
    const Ref<Buffer> buffer(made);
    made->release();
    return buffer;
}

void set_enabled(const char* call, RTCGeometry geometry, bool is_enabled) {
    with<Geometry>(call, geometry, [&](Geometry& g) {
        if (std::exchange(g.is_enabled, is_enabled) != is_enabled) ++g.version.shape;
    });
}

void set_filter(const char* call, RTCGeometry geometry, RTCFilterFunctionN Geometry::*member,
                RTCFilterFunctionN filter) {
    with<Geometry>(call, geometry, [&](Geometry& g) {
        if (g.is_instance()) fail_operation("instances have no filters");
        g.*member = filter;
        ++g.version.settings;
    });
}

}  // namespace
}  // namespace mray::embree

using namespace mray::embree;

RTCBuffer rtcNewBuffer(RTCDevice device, size_t size) {
    return with<Device>(__func__, device, [&](Device& d) {
        return reinterpret_cast<RTCBuffer>(new Buffer(d, size));
    });
}

RTCBuffer rtcNewSharedBuffer(RTCDevice device, void* data, size_t size) {
    return with<Device>(__func__, device, [&](Device& d) {
        if (data == nullptr && size != 0) fail_argument("no data");
        return reinterpret_cast<RTCBuffer>(new Buffer(d, data, size));
    });
}

void* rtcGetBufferData(RTCBuffer buffer) {
    return with<Buffer>(__func__, buffer, [](Buffer& b) -> void* { return b.data(); });
}

MORPHRAY_COUNTED(Buffer, Buffer)

/// Geometries that are not supported are errors here and at the commit of a scene with them.
RTCGeometry rtcNewGeometry(RTCDevice device, enum RTCGeometryType type) {
    return with<Device>(__func__, device, [&](Device& d) {
        auto* const made = new Geometry(d, type);
        with<Geometry>(__func__, reinterpret_cast<RTCGeometry>(made), [](Geometry& g) {
            if (const char* const name = g.unsupported()) fail_unsupported(name);
        });
        return reinterpret_cast<RTCGeometry>(made);
    });
}

MORPHRAY_COUNTED(Geometry, Geometry)

/// Changes count at the commit of a scene, whether they were committed here or not.
void rtcCommitGeometry(RTCGeometry geometry) {
    with<Geometry>(__func__, geometry, [](Geometry& g) {
        // Positions may have been written in place, of which nothing else may tell.
        ++g.version.pose;
    });
}

void rtcEnableGeometry(RTCGeometry geometry) { set_enabled(__func__, geometry, true); }
void rtcDisableGeometry(RTCGeometry geometry) { set_enabled(__func__, geometry, false); }

void rtcSetGeometryTimeStepCount(RTCGeometry geometry, unsigned int count) {
    with<Geometry>(__func__, geometry, [&](Geometry& g) {
        if (count < 1 || count > RTC_MAX_TIME_STEP_COUNT)
            fail_argument("the number of time steps is not from 1 to 129");
        if (std::exchange(g.time_steps, count) != count) ++g.version.shape;
        if (count > 1) fail_unsupported(g.unsupported());
    });
}

/// Without motion blur a range of times says nothing.
void rtcSetGeometryTimeRange(RTCGeometry geometry, float begin, float end) {
    with<Geometry>(__func__, geometry, [&](Geometry&) {
        if (begin > end) fail_argument("the range of times ends before it begins");
    });
}

/// Nothing reads attributes.
void rtcSetGeometryVertexAttributeCount(RTCGeometry geometry, unsigned int) {
    with<Geometry>(__func__, geometry, [](Geometry&) {});
}

void rtcSetGeometryMask(RTCGeometry geometry, unsigned int mask) {
    with<Geometry>(__func__, geometry, [&](Geometry& g) {
        g.mask = mask;
        g.has_mask = true;
        ++g.version.settings;
    });
}

void rtcSetGeometryBuildQuality(RTCGeometry geometry, enum RTCBuildQuality quality) {
    with<Geometry>(__func__, geometry, [&](Geometry& g) {
        if (quality > RTC_BUILD_QUALITY_REFIT) fail_argument("the build quality is unknown");
        if (std::exchange(g.quality, quality) != quality) ++g.version.settings;
    });
}

void rtcSetGeometryBuffer(RTCGeometry geometry, enum RTCBufferType type, unsigned int slot,
                          enum RTCFormat format, RTCBuffer buffer, size_t offset, size_t stride,
                          size_t count) {
    with<Geometry>(__func__, geometry, [&](Geometry& g) {
        if (buffer == nullptr) fail_argument("the buffer is null");
        auto& shared = *reinterpret_cast<Buffer*>(buffer);
        if (&shared.device() != &g.device()) fail_argument("the buffer is of another device");
        if (offset > shared.size() ||
            (stride != 0 && count > (shared.size() - offset + stride - 1) / stride))
            fail_argument("the items reach beyond the end of the buffer");
        g.set_buffer(type, slot, make_view(g, shared, format, offset, stride, count));
    });
}

void rtcSetSharedGeometryBuffer(RTCGeometry geometry, enum RTCBufferType type, unsigned int slot,
                                enum RTCFormat format, const void* data, size_t offset,
                                size_t stride, size_t count) {
    with<Geometry>(__func__, geometry, [&](Geometry& g) {
        const Ref<Buffer> shared =
            owned(new Buffer(g.device(), const_cast<void*>(data), offset + stride * count));
        g.set_buffer(type, slot, make_view(g, *shared, format, offset, stride, count));
    });
}

void* rtcSetNewGeometryBuffer(RTCGeometry geometry, enum RTCBufferType type, unsigned int slot,
                              enum RTCFormat format, size_t stride, size_t count) {
    return with<Geometry>(__func__, geometry, [&](Geometry& g) -> void* {
        if (stride != 0 && count > SIZE_MAX / 2 / stride) throw std::bad_alloc();
        check_places(g, 0, stride);
        const Ref<Buffer> own = owned(new Buffer(g.device(), stride * count));
        g.set_buffer(type, slot, make_view(g, *own, format, 0, stride, count));
        return own->data();
    });
}

void* rtcGetGeometryBufferData(RTCGeometry geometry, enum RTCBufferType type, unsigned int slot) {
    return with<Geometry>(__func__, geometry,
                          [&](Geometry& g) -> void* { return g.buffer(type, slot).data; });
}

void rtcUpdateGeometryBuffer(RTCGeometry geometry, enum RTCBufferType type, unsigned int slot) {
    with<Geometry>(__func__, geometry, [&](Geometry& g) {
        if (g.unsupported() != nullptr) return;
        g.buffer(type, slot);
        if (type == RTC_BUFFER_TYPE_INDEX) ++g.version.shape;
        if (type == RTC_BUFFER_TYPE_VERTEX) ++g.version.pose;
    });
}

void rtcSetGeometryIntersectFilterFunction(RTCGeometry geometry, RTCFilterFunctionN filter) {
    set_filter(__func__, geometry, &Geometry::intersect_filter, filter);
}

void rtcSetGeometryOccludedFilterFunction(RTCGeometry geometry, RTCFilterFunctionN filter) {
    set_filter(__func__, geometry, &Geometry::occluded_filter, filter);
}

void rtcSetGeometryUserData(RTCGeometry geometry, void* user) {
    with<Geometry>(__func__, geometry, [&](Geometry& g) { g.user = user; });
}

void* rtcGetGeometryUserData(RTCGeometry geometry) {
    return with<Geometry>(__func__, geometry, [](Geometry& g) { return g.user; });
}

void rtcSetGeometryPointQueryFunction(RTCGeometry geometry, RTCPointQueryFunction function) {
    with<Geometry>(__func__, geometry, [&](Geometry& g) { g.point_query = function; });
}

void rtcSetGeometryInstancedScene(RTCGeometry geometry, RTCScene scene) {
    with<Geometry>(__func__, geometry, [&](Geometry& g) {
        g.require_instance();
        if (scene == nullptr) fail_argument("the scene is null");
        g.instanced = Ref<SceneObject>(reinterpret_cast<SceneObject*>(scene));
        ++g.version.shape;
    });
}

void rtcSetGeometryTransform(RTCGeometry geometry, unsigned int step, enum RTCFormat format,
                             const void* floats) {
    with<Geometry>(__func__, geometry, [&](Geometry& g) {
        g.require_instance();
        if (step >= g.time_steps) fail_operation("there is no such time step");
        const Transform transform = read_transform(format, floats);
        if (step > 0) return;
        g.transform = transform;
        ++g.version.pose;
    });
}

void rtcGetGeometryTransform(RTCGeometry geometry, float, enum RTCFormat format, void* floats) {
    with<Geometry>(__func__, geometry, [&](Geometry& g) {
        g.require_instance();
        write_transform(g.transform, format, floats);
    });
}

#if MORPHRAY_EMBREE == 4

void rtcSetGeometryEnableFilterFunctionFromArguments(RTCGeometry geometry, bool is_enabled) {
    with<Geometry>(__func__, geometry, [&](Geometry& g) {
        g.takes_argument_filter = is_enabled;
        ++g.version.settings;
    });
}

void rtcGetGeometryTransformEx(RTCGeometry geometry, unsigned int, float time,
                               enum RTCFormat format, void* floats) {
    rtcGetGeometryTransform(geometry, time, format, floats);
}

void* rtcGetGeometryUserDataFromScene(RTCScene scene, unsigned int id) {
    return with<SceneObject>(__func__, scene, [&](SceneObject& s) {
        const Geometry* const geometry = s.find(id);
        if (geometry == nullptr) fail_argument("no geometry has this ID");
        return geometry->user;
    });
}

void rtcGetGeometryTransformFromScene(RTCScene scene, unsigned int id, float time,
                                      enum RTCFormat format, void* floats) {
    with<SceneObject>(__func__, scene, [&](SceneObject& s) {
        Geometry* const geometry = s.find(id);
        if (geometry == nullptr) fail_argument("no geometry has this ID");
        rtcGetGeometryTransform(reinterpret_cast<RTCGeometry>(geometry), time, format, floats);
    });
}

#endif
