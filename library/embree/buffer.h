// Memory of the caller or of our own, and views into it.
#pragma once

#include <cstddef>
#include <cstdint>

#include "library/embree/device.h"
#include "library/embree/object.h"

namespace mray::embree {

/// Bytes that geometries share.
class Buffer final : public Object {
public:
    /// Owns `size` bytes, and 16 more that a reader of vectors may touch.
    Buffer(Device& device, std::size_t size);
    /// Borrows `size` bytes.
    Buffer(Device& device, void* data, std::size_t size);
    ~Buffer() override;

    Device& device() const { return *device_; }
    char* data() const { return data_; }
    std::size_t size() const { return size_; }

private:
    Ref<Device> device_;
    std::size_t size_;
    bool is_own_ = false;
    char* data_;
};

/// `count` items in a buffer, `stride` bytes apart.
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

}  // namespace mray::embree
