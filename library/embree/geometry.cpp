#include "library/embree/geometry.h"

#include <new>

#include <glm/geometric.hpp>

#include "library/embree/scene.h"

namespace mray::embree {
namespace {

constexpr std::size_t kPadding = 16;
constexpr std::align_val_t kAlignment{64};

struct MatrixLayout {
    int row_step;
    int column_step;
    bool has_last_row;
};

MatrixLayout layout_of(RTCFormat format) {
    switch (format) {
        case RTC_FORMAT_FLOAT3X4_ROW_MAJOR:
            return {4, 1, false};
        case RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR:
            return {1, 3, false};
        case RTC_FORMAT_FLOAT4X4_ROW_MAJOR:
            return {4, 1, true};
        case RTC_FORMAT_FLOAT4X4_COLUMN_MAJOR:
            return {1, 4, true};
        default:
            fail_operation("the format of a transformation is neither 3x4 nor 4x4 floats");
    }
}

morphray::Vec3 mapped(const glm::dvec3 (&columns)[4], const morphray::Vec3& p, double w) {
    const glm::vec3 sum(columns[0] * double{p.x} + columns[1] * double{p.y} +
                        columns[2] * double{p.z} + columns[3] * w);
    return {sum.x, sum.y, sum.z};
}

}  // namespace

Buffer::Buffer(Device& device, std::size_t size) : device_(&device), size_(size), is_own_(true) {
    if (size > SIZE_MAX / 2) throw std::bad_alloc();
    data_ = static_cast<char*>(::operator new(size + kPadding, kAlignment));
}

Buffer::Buffer(Device& device, void* data, std::size_t size)
    : device_(&device), size_(size), data_(static_cast<char*>(data)) {}

Buffer::~Buffer() {
    if (is_own_) ::operator delete(data_, kAlignment);
}

Geometry::Geometry(Device& device, RTCGeometryType type) : device_(&device), type_(type) {
    const bool is_mesh = type == RTC_GEOMETRY_TYPE_TRIANGLE || type == RTC_GEOMETRY_TYPE_QUAD;
    if (!is_mesh && !is_instance() && unsupported() == nullptr)
        fail_argument("the type of geometry is unknown");
    if (!is_mesh) return;
    buffers_[{RTC_BUFFER_TYPE_INDEX, 0}] = {};
    buffers_[{RTC_BUFFER_TYPE_VERTEX, 0}] = {};
}

Geometry::~Geometry() = default;

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

morphray::Vec3 Transform::point(const morphray::Vec3& p) const { return mapped(columns, p, 1); }
morphray::Vec3 Transform::vector(const morphray::Vec3& v) const { return mapped(columns, v, 0); }

Transform Transform::inverse() const {
    const auto& [a, b, c, d] = columns;
    const glm::dvec3 rows[] = {glm::cross(b, c), glm::cross(c, a), glm::cross(a, b)};
    const double determinant = glm::dot(a, rows[0]);
    Transform result;
    for (int row = 0; row < 3; ++row) {
        double moved = 0;
        for (int column = 0; column < 3; ++column) {
            result.columns[column][row] = rows[row][column] / determinant;
            moved += result.columns[column][row] * d[column];
        }
        result.columns[3][row] = -moved;
    }
    return result;
}

Transform read_transform(RTCFormat format, const void* floats) {
    const MatrixLayout layout = layout_of(format);
    if (floats == nullptr) fail_argument("the transformation is null");
    const auto* const values = static_cast<const float*>(floats);
    Transform result;
    for (int column = 0; column < 4; ++column) {
        for (int row = 0; row < 3; ++row) {
            result.columns[column][row] =
                double{values[row * layout.row_step + column * layout.column_step]};
        }
    }
    return result;
}

void write_transform(const Transform& transform, RTCFormat format, void* floats) {
    const MatrixLayout layout = layout_of(format);
    if (floats == nullptr) fail_argument("the transformation is null");
    auto* const values = static_cast<float*>(floats);
    for (int column = 0; column < 4; ++column) {
        float* const first = values + column * layout.column_step;
        for (int row = 0; row < 3; ++row)
            first[row * layout.row_step] = static_cast<float>(transform.columns[column][row]);
        if (layout.has_last_row) first[3 * layout.row_step] = column == 3 ? 1.0f : 0.0f;
    }
}

}  // namespace mray::embree
