#include "library/embree/geometry.h"

#include <cstring>
#include <utility>

#include "library/embree/scene/scene.h"

namespace mray::embree {
namespace {

const char* name_of_unsupported(RTCGeometryType type) {
    if (type == RTC_GEOMETRY_TYPE_GRID) return "grids are";
    if (type == RTC_GEOMETRY_TYPE_SUBDIVISION) return "subdivision surfaces are";
    if (type == RTC_GEOMETRY_TYPE_USER) return "user geometries are";
    if (type >= RTC_GEOMETRY_TYPE_SPHERE_POINT && type <= RTC_GEOMETRY_TYPE_ORIENTED_DISC_POINT)
        return "points are";
    if (type >= RTC_GEOMETRY_TYPE_CONE_LINEAR_CURVE &&
        type <= RTC_GEOMETRY_TYPE_NORMAL_ORIENTED_CATMULL_ROM_CURVE)
        return "curves are";
#if MORPHRAY_EMBREE == 4
    if (type == RTC_GEOMETRY_TYPE_INSTANCE_ARRAY) return "instance arrays are";
#endif
    return nullptr;
}

bool holds_floats(RTCFormat format) {
    return format >= RTC_FORMAT_FLOAT && format <= RTC_FORMAT_FLOAT16;
}

}  // namespace

Geometry::Geometry(Device& device, RTCGeometryType type) : device_(&device), type_(type) {
    const bool is_mesh = type == RTC_GEOMETRY_TYPE_TRIANGLE || type == RTC_GEOMETRY_TYPE_QUAD;
    if (!is_mesh && !is_instance() && unsupported() == nullptr)
        fail_argument("the type of geometry is unknown");
}

bool Geometry::is_instance_array() const {
#if MORPHRAY_EMBREE == 4
    return type_ == RTC_GEOMETRY_TYPE_INSTANCE_ARRAY;
#else
    return false;
#endif
}

const char* Geometry::unsupported() const { return name_of_unsupported(type_); }

Geometry::~Geometry() = default;

void Geometry::enable(bool is_enabled) {
    if (is_enabled_ == is_enabled) return;
    is_enabled_ = is_enabled;
    ++version_.shape;
}

void Geometry::set_time_steps(unsigned int count) {
    if (count < 1 || count > RTC_MAX_TIME_STEP_COUNT)
        fail_argument("the number of time steps is not from 1 to 129");
    if (is_instance()) {
        transforms_.resize(count);
    } else {
        vertices_.resize(count);
    }
    ++version_.shape;
}

void Geometry::set_attribute_count(unsigned int count) {
    constexpr unsigned int kMost = 1u << 16;
    if (is_instance()) fail_operation("instances have no vertex attributes");
    if (count > kMost) fail_argument("there are too many vertex attributes");
    attributes_.resize(count);
}

void Geometry::set_mask(unsigned int mask) {
    mask_ = mask;
    has_mask_ = true;
    settings_changed();
}

void Geometry::set_build_quality(RTCBuildQuality quality) {
    if (quality > RTC_BUILD_QUALITY_REFIT) fail_argument("the build quality is unknown");
    if (quality_ == quality) return;
    quality_ = quality;
    settings_changed();
}

const BufferView* Geometry::find_buffer(RTCBufferType type, unsigned int slot) const {
    if (is_instance()) return nullptr;
    if (unsupported() != nullptr) {
        const auto found = others_.find({type, slot});
        return found == others_.end() ? nullptr : &found->second;
    }
    if (type == RTC_BUFFER_TYPE_INDEX) return slot == 0 ? &indices_ : nullptr;
    if (type == RTC_BUFFER_TYPE_VERTEX) return slot < vertices_.size() ? &vertices_[slot] : nullptr;
    if (type == RTC_BUFFER_TYPE_VERTEX_ATTRIBUTE)
        return slot < attributes_.size() ? &attributes_[slot] : nullptr;
    return nullptr;
}

BufferView& Geometry::buffer(RTCBufferType type, unsigned int slot) {
    const BufferView* const found = find_buffer(type, slot);
    if (found == nullptr) fail_argument("this geometry has no buffer of this type and slot");
    return const_cast<BufferView&>(*found);
}

void Geometry::set_buffer(RTCBufferType type, unsigned int slot, BufferView view) {
    if (unsupported() != nullptr) {
        others_[{type, slot}] = std::move(view);
        return;
    }
    BufferView& place = buffer(type, slot);
    if (view.count > 0xFFFFFFFFu) fail_argument("the buffer has more than 2^32 - 1 items");
    if (type == RTC_BUFFER_TYPE_INDEX) {
        const RTCFormat wanted = is_quads() ? RTC_FORMAT_UINT4 : RTC_FORMAT_UINT3;
        if (view.format != wanted)
            fail_operation("indices have the format UINT3 for triangles and UINT4 for quads");
    } else if (type == RTC_BUFFER_TYPE_VERTEX) {
        if (view.format != RTC_FORMAT_FLOAT3) fail_operation("vertices have the format FLOAT3");
    } else if (!holds_floats(view.format)) {
        fail_operation("vertex attributes have the formats FLOAT to FLOAT16");
    }
    place = std::move(view);
    if (type != RTC_BUFFER_TYPE_VERTEX_ATTRIBUTE) ++version_.shape;
}

void Geometry::touch_buffer(RTCBufferType type, unsigned int slot) {
    if (unsupported() != nullptr) return;
    buffer(type, slot);
    if (type == RTC_BUFFER_TYPE_INDEX) ++version_.shape;
    if (type == RTC_BUFFER_TYPE_VERTEX) ++version_.pose;
}

void Geometry::commit() {
    if (version_.shape == committed_version_.shape && version_.pose == committed_version_.pose)
        ++version_.pose;
    committed_version_ = version_;
}

void Geometry::require_static() const {
    for (std::size_t step = 1; step < transforms_.size(); ++step) {
        if (!(transforms_[step] == transforms_.front()))
            fail_unsupported("motion blur (transformations that differ between time steps) is");
    }
    for (std::size_t step = 1; step < vertices_.size(); ++step) {
        const BufferView& first = vertices_.front();
        const BufferView& view = vertices_[step];
        if (view.count != first.count) fail_argument("time steps have different vertex counts");
        for (std::size_t i = 0; i < view.count; ++i) {
            if (std::memcmp(view.at<float>(i), first.at<float>(i), 12) != 0)
                fail_unsupported("motion blur (positions that differ between time steps) is");
        }
    }
}

void Geometry::set_instanced_scene(SceneObject* scene) {
    if (!is_instance()) fail_operation("the geometry is no instance");
    if (scene == nullptr) fail_argument("the scene is null");
    instanced_ = Ref<SceneObject>(scene);
    ++version_.shape;
}

void Geometry::set_transform(unsigned int step, const Transform& transform) {
    if (!is_instance()) fail_operation("the geometry is no instance");
    if (step >= transforms_.size()) fail_operation("there is no such time step");
    transforms_[step] = transform;
    ++version_.pose;
}

}  // namespace mray::embree
