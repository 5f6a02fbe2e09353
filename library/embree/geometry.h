// Buffers and geometries. Programs write through the pointers of those that commits refuse, too.
#pragma once

#include <cstddef>
#include <map>

#include <glm/ext/matrix_double4x3.hpp>

#include "library/embree/device.h"
#include "morphray/geometry.hpp"

namespace mray::embree {

class SceneObject;

/// Geometries share these bytes, which are the caller's or our own.
class Buffer final : public Object {
public:
    /// Owns `size` bytes, and 16 more that a reader of vectors may touch.
    Buffer(Device& device, std::size_t size);
    /// Borrows `size` bytes.
    Buffer(Device& device, void* data, std::size_t size);

    Device& device() const { return *device_; }
    char* data() const { return data_; }
    std::size_t size() const { return size_; }

private:
    Ref<Device> device_;
    std::size_t size_;
    struct alignas(64) Block {
        char bytes[64];
    };
    std::unique_ptr<Block[]> own_;
    char* data_;
};

struct BufferView {
    Ref<Buffer> buffer;
    RTCFormat format = RTC_FORMAT_UNDEFINED;
    char* data = nullptr;
    std::size_t stride = 0;
    std::size_t count = 0;

    template <class Item>
    const Item* at(std::size_t i) const {
        return reinterpret_cast<const Item*>(data + i * stride);
    }
};

/// Maps a point p to the product with (p, 1), and a vector v to that with (v, 0).
using Transform = glm::dmat4x3;

/// The product with (p, w), rounded to floats.
morphray::Vec3 mapped(const Transform& transform, const morphray::Vec3& p, double w);
/// The inverse; that of a matrix without one has numbers that are not finite.
Transform inverse_of(const Transform& transform);

/// Reads a matrix of 3x4 or 4x4 floats, row or column major. Throws Failure for another format.
Transform read_transform(RTCFormat format, const void* floats);
void write_transform(const Transform& transform, RTCFormat format, void* floats);

/// A scene finds by these counts what has changed since its last commit.
struct GeometryVersion {
    /// Triangles and buffers count here, and whether it is enabled.
    std::uint64_t shape = 0;
    /// Positions and transformations count here.
    std::uint64_t pose = 0;
    /// Masks, filters and qualities count here.
    std::uint64_t settings = 0;

    bool operator==(const GeometryVersion&) const = default;
};

/// One thread at a time may change it. What changes a member counts it in `version`.
class Geometry final : public Object {
public:
    /// Throws Failure for types that Embree does not have.
    Geometry(Device& device, RTCGeometryType type);

    Device& device() const { return *device_; }
    bool is_instance() const { return type_ == RTC_GEOMETRY_TYPE_INSTANCE; }
    bool is_quads() const { return type_ == RTC_GEOMETRY_TYPE_QUAD; }
    /// Null if type and time steps are supported, else the subject of a sentence: "curves are".
    const char* unsupported() const;
    void require_instance() const {
        if (!is_instance()) fail_operation("the geometry is no instance");
    }

    /// Throws Failure for a buffer that this type does not have.
    void set_buffer(RTCBufferType type, unsigned int slot, BufferView view);
    /// Throws Failure if there is none.
    const BufferView& buffer(RTCBufferType type, unsigned int slot) const;

    GeometryVersion version;
    bool is_enabled = true;
    bool has_mask = false;
    unsigned int mask = kDefaultMask;
    RTCBuildQuality quality = RTC_BUILD_QUALITY_MEDIUM;
    unsigned int time_steps = 1;
    /// Only instances have one.
    Ref<SceneObject> instanced;
    Transform transform = Transform(1.0);

    void* user = nullptr;
    RTCFilterFunctionN intersect_filter = nullptr;
    RTCFilterFunctionN occluded_filter = nullptr;
    RTCPointQueryFunction point_query = nullptr;
    /// It asked for the filter of a query's arguments.
    bool takes_argument_filter = false;

private:
    Ref<Device> device_;
    RTCGeometryType type_;
    std::map<std::pair<RTCBufferType, unsigned int>, BufferView> buffers_;
};

}  // namespace mray::embree
