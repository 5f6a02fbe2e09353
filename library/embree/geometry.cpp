#include "library/embree/geometry.h"

#include <new>

#include "library/embree/scene.h"

namespace mray::embree {
namespace {

constexpr std::size_t kPadding = 16;
constexpr std::align_val_t kAlignment{64};

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

}  // namespace mray::embree
