#include "library/embree/buffer.h"

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

}  // namespace mray::embree

using namespace mray::embree;

RTCBuffer rtcNewBuffer(RTCDevice device, size_t size) {
    return with<Device>("rtcNewBuffer", device, [&](Device& d) {
        return reinterpret_cast<RTCBuffer>(new Buffer(d, size));
    });
}

RTCBuffer rtcNewSharedBuffer(RTCDevice device, void* data, size_t size) {
    return with<Device>("rtcNewSharedBuffer", device, [&](Device& d) {
        if (data == nullptr && size != 0) fail_argument("no data");
        return reinterpret_cast<RTCBuffer>(new Buffer(d, data, size));
    });
}

void* rtcGetBufferData(RTCBuffer buffer) {
    return with<Buffer>("rtcGetBufferData", buffer, [](Buffer& b) -> void* { return b.data(); });
}

void rtcRetainBuffer(RTCBuffer buffer) {
    with<Buffer>("rtcRetainBuffer", buffer, [](Buffer& b) { b.retain(); });
}

void rtcReleaseBuffer(RTCBuffer buffer) {
    with<Buffer>("rtcReleaseBuffer", buffer, [](Buffer& b) { b.release(); });
}
