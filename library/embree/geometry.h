// Geometries: triangle meshes, quad meshes and instances, and those of other types, which take
// buffers and are refused by commits: programs write through the pointers that they ask for.
#pragma once

#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "library/embree/buffer.h"
#include "library/embree/device.h"
#include "library/embree/object.h"
#include "library/embree/transform.h"

namespace mray::embree {

class SceneObject;

/// Numbers of changes, by which a scene finds what happened since its last commit.
struct GeometryVersion {
    /// Triangles, buffers, and whether it is enabled.
    std::uint64_t shape = 0;
    /// Positions and transformations.
    std::uint64_t pose = 0;
    /// Masks, filters and qualities.
    std::uint64_t settings = 0;

    bool operator==(const GeometryVersion&) const = default;
};

/// One thread at a time may change it. Members that queries read are public.
class Geometry final : public Object {
public:
    /// Throws Failure for types that Embree does not have.
    Geometry(Device& device, RTCGeometryType type);
    ~Geometry() override;

    Device& device() const { return *device_; }
    bool is_instance() const { return type_ == RTC_GEOMETRY_TYPE_INSTANCE; }
    bool is_instance_array() const;
    bool is_quads() const { return type_ == RTC_GEOMETRY_TYPE_QUAD; }
    /// The type as the subject of a sentence, "curves are", if it is not supported; otherwise null.
    const char* unsupported() const;
    const GeometryVersion& version() const { return version_; }

    bool is_enabled() const { return is_enabled_; }
    void enable(bool is_enabled);
    void set_time_steps(unsigned int count);
    void set_attribute_count(unsigned int count);
    void set_mask(unsigned int mask);
    unsigned int mask() const { return mask_; }
    bool has_mask() const { return has_mask_; }
    void set_build_quality(RTCBuildQuality quality);
    bool is_refitted() const { return quality_ == RTC_BUILD_QUALITY_REFIT; }

    /// Throws Failure for a buffer that this type does not have.
    void set_buffer(RTCBufferType type, unsigned int slot, BufferView view);
    void touch_buffer(RTCBufferType type, unsigned int slot);
    /// Null if there is none.
    const BufferView* find_buffer(RTCBufferType type, unsigned int slot) const;

    const BufferView& indices() const { return indices_; }
    const BufferView& vertices() const { return vertices_.front(); }
    /// Throws Unsupported if time steps differ, which is motion blur.
    void require_static() const;

    void set_instanced_scene(SceneObject* scene);
    /// Null if there is none.
    const SceneObject* instanced_scene() const { return instanced_.get(); }
    void set_transform(unsigned int step, const Transform& transform);
    const Transform& transform() const { return transforms_.front(); }

    /// Takes positions that were written in place, of which nothing else may tell.
    void commit();

    /// For filters and other settings that queries read: to be called after a change.
    void settings_changed() { ++version_.settings; }

    void* user = nullptr;
    RTCFilterFunctionN intersect_filter = nullptr;
    RTCFilterFunctionN occluded_filter = nullptr;
    RTCPointQueryFunction point_query = nullptr;
    /// Whether it asked for the filter of a query's arguments.
    bool takes_argument_filter = false;

private:
    BufferView& buffer(RTCBufferType type, unsigned int slot);

    Ref<Device> device_;
    RTCGeometryType type_;
    GeometryVersion version_ = {1, 1, 1};
    /// At the last commit().
    GeometryVersion committed_version_;
    bool is_enabled_ = true;
    bool has_mask_ = false;
    unsigned int mask_ = kDefaultMask;
    RTCBuildQuality quality_ = RTC_BUILD_QUALITY_MEDIUM;
    BufferView indices_;
    /// One for each time step.
    std::vector<BufferView> vertices_ = std::vector<BufferView>(1);
    std::vector<BufferView> attributes_;
    /// The buffers of types that are not supported, by type and slot.
    std::map<std::pair<RTCBufferType, unsigned int>, BufferView> others_;
    Ref<SceneObject> instanced_;
    std::vector<Transform> transforms_ = std::vector<Transform>(1);
};

}  // namespace mray::embree
