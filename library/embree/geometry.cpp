#include "library/embree/geometry.h"

#include <new>

#include <glm/ext/matrix_double3x3.hpp>
#include <glm/matrix.hpp>

#include "library/embree/scene.h"

namespace mray::embree {
namespace {

/// Calls visit(column, row, index) for all floats of a matrix, the last row of 4x4 too.
template <class Visit>
void for_each_float(RTCFormat format, const void* floats, Visit visit) {
    const bool is_by_row =
        format == RTC_FORMAT_FLOAT3X4_ROW_MAJOR || format == RTC_FORMAT_FLOAT4X4_ROW_MAJOR;
    const bool has_last_row =
        format == RTC_FORMAT_FLOAT4X4_COLUMN_MAJOR || format == RTC_FORMAT_FLOAT4X4_ROW_MAJOR;
    if (!is_by_row && !has_last_row && format != RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR)
        fail_operation("the format of a transformation is neither 3x4 nor 4x4 floats");
    if (floats == nullptr) fail_argument("the transformation is null");
    const int rows = has_last_row ? 4 : 3;
    for (int column = 0; column < 4; ++column)
        for (int row = 0; row < rows; ++row)
            visit(column, row, is_by_row ? 4 * row + column : rows * column + row);
}

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
    return {share(buffer), format, data, stride, count};
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

Buffer::Buffer(Device& device, std::size_t size) : device_(share(device)), size_(size) {
    constexpr std::size_t kPadding = 16;
    if (size > SIZE_MAX / 2) throw std::bad_alloc();
    own_.reset(new Block[(size + kPadding + sizeof(Block) - 1) / sizeof(Block)]);
    data_ = own_[0].bytes;
}

Buffer::Buffer(Device& device, void* data, std::size_t size)
    : device_(share(device)), size_(size), data_(static_cast<char*>(data)) {}

Geometry::Geometry(Device& device, RTCGeometryType type) : device_(share(device)), type_(type) {
    const bool is_mesh = type == RTC_GEOMETRY_TYPE_TRIANGLE || type == RTC_GEOMETRY_TYPE_QUAD;
    if (!is_mesh && !is_instance() && unsupported() == nullptr)
        fail_argument("the type of geometry is unknown");
    if (!is_mesh) return;
    buffers_[{RTC_BUFFER_TYPE_INDEX, 0}] = {};
    buffers_[{RTC_BUFFER_TYPE_VERTEX, 0}] = {};
}

const char* Geometry::unsupported() const {
    if (type_ == RTC_GEOMETRY_TYPE_GRID) return "grids are";
    if (type_ == RTC_GEOMETRY_TYPE_SUBDIVISION) return "subdivision surfaces are";
    if (type_ == RTC_GEOMETRY_TYPE_USER) return "user geometries are";
    if (type_ >= RTC_GEOMETRY_TYPE_SPHERE_POINT && type_ <= RTC_GEOMETRY_TYPE_ORIENTED_DISC_POINT)
        return "points are";
    if (type_ >= RTC_GEOMETRY_TYPE_CONE_LINEAR_CURVE &&
        type_ <= RTC_GEOMETRY_TYPE_NORMAL_ORIENTED_CATMULL_ROM_CURVE)
        return "curves are";
#if MORPHRAY_EMBREE == 4
    if (type_ == RTC_GEOMETRY_TYPE_INSTANCE_ARRAY) return "instance arrays are";
#endif
    return time_steps > 1 ? "motion blur is" : nullptr;
}

const BufferView& Geometry::buffer(RTCBufferType type, unsigned int slot) const {
    const auto found = buffers_.find({type, slot});
    if (found == buffers_.end()) fail_argument("this geometry has no buffer of this type and slot");
    return found->second;
}

void Geometry::set_buffer(RTCBufferType type, unsigned int slot, BufferView view) {
    if (unsupported() == nullptr) {
        // Nothing reads attributes.
        if (is_instance() || type != RTC_BUFFER_TYPE_VERTEX_ATTRIBUTE) buffer(type, slot);
        if (view.count > 0xFFFFFFFFu) fail_argument("the buffer has more than 2^32 - 1 items");
        const RTCFormat indices = is_quads() ? RTC_FORMAT_UINT4 : RTC_FORMAT_UINT3;
        if (type == RTC_BUFFER_TYPE_INDEX && view.format != indices)
            fail_operation("indices have the format UINT3 for triangles and UINT4 for quads");
        if (type == RTC_BUFFER_TYPE_VERTEX && view.format != RTC_FORMAT_FLOAT3)
            fail_operation("vertices have the format FLOAT3");
    }
    buffers_[{type, slot}] = std::move(view);
    if (type != RTC_BUFFER_TYPE_VERTEX_ATTRIBUTE) ++version.shape;
}

morphray::Vec3 mapped(const Transform& transform, const morphray::Vec3& p, double w) {
    const glm::vec3 sum(transform * glm::dvec4(p.x, p.y, p.z, w));
    return {sum.x, sum.y, sum.z};
}

Transform inverse_of(const Transform& transform) {
    const glm::dmat3 linear = glm::inverse(glm::dmat3(transform));
    return {linear[0], linear[1], linear[2], -(linear * transform[3])};
}

Transform read_transform(RTCFormat format, const void* floats) {
    Transform result(1.0);
    for_each_float(format, floats, [&](int column, int row, int i) {
        if (row < 3) result[column][row] = double{static_cast<const float*>(floats)[i]};
    });
    return result;
}

void write_transform(const Transform& transform, RTCFormat format, void* floats) {
    for_each_float(format, floats, [&](int column, int row, int i) {
        const double last = column == 3 ? 1 : 0;
        static_cast<float*>(floats)[i] =
            static_cast<float>(row < 3 ? transform[column][row] : last);
    });
}

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
        g.instanced = share(*reinterpret_cast<SceneObject*>(scene));
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
    return with<SceneObject>(__func__, scene, [&](SceneObject& s) { return s.at(id).user; });
}
void rtcGetGeometryTransformFromScene(RTCScene scene, unsigned int id, float time,
                                      enum RTCFormat format, void* floats) {
    with<SceneObject>(__func__, scene, [&](SceneObject& s) {
        rtcGetGeometryTransform(reinterpret_cast<RTCGeometry>(&s.at(id)), time, format, floats);
    });
}
#endif
