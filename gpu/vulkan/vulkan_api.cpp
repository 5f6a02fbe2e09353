#include "gpu/vulkan/vulkan_api.h"

#include <sys/mman.h>

#include <algorithm>
#include <iterator>

// The one source that holds volk itself.
#define VOLK_IMPLEMENTATION
#include <volk.h>

namespace mray::gpu {
namespace {

struct Failure {
    VkResult result;
    const char* name;
    ErrorKind kind;
};

#define FAILURE(result, kind) \
    { result, #result, ErrorKind::kind }

constexpr Failure kFailures[] = {
    FAILURE(VK_TIMEOUT, kDeviceLost),
    FAILURE(VK_ERROR_DEVICE_LOST, kDeviceLost),
    FAILURE(VK_ERROR_OUT_OF_HOST_MEMORY, kLimit),
    FAILURE(VK_ERROR_OUT_OF_DEVICE_MEMORY, kLimit),
    FAILURE(VK_ERROR_OUT_OF_POOL_MEMORY, kLimit),
    FAILURE(VK_ERROR_TOO_MANY_OBJECTS, kLimit),
    FAILURE(VK_ERROR_FRAGMENTED_POOL, kLimit),
    FAILURE(VK_ERROR_FRAGMENTATION, kLimit),
    FAILURE(VK_ERROR_MEMORY_MAP_FAILED, kLimit),
    FAILURE(VK_ERROR_INITIALIZATION_FAILED, kUnavailable),
    FAILURE(VK_ERROR_LAYER_NOT_PRESENT, kUnavailable),
    FAILURE(VK_ERROR_EXTENSION_NOT_PRESENT, kUnavailable),
    FAILURE(VK_ERROR_FEATURE_NOT_PRESENT, kUnavailable),
    FAILURE(VK_ERROR_INCOMPATIBLE_DRIVER, kUnavailable),
};

#undef FAILURE

const Failure* find_failure(VkResult result) {
    const auto failure = std::ranges::find(kFailures, result, &Failure::result);
    return failure != std::end(kFailures) ? failure : nullptr;
}

}  // namespace

std::string result_name(VkResult result) {
    const Failure* const failure = find_failure(result);
    return failure != nullptr ? failure->name : "VkResult " + std::to_string(result);
}

ErrorKind error_kind_of(VkResult result) {
    const Failure* const failure = find_failure(result);
    return failure != nullptr ? failure->kind : ErrorKind::kInternal;
}

void throw_unavailable(const std::string& text) {
    // A driver reserves nearly as much. Under `ulimit -v` it fails with any result.
    constexpr std::size_t kDriverBytes = std::size_t{256} << 20;
    void* const space =
        ::mmap(nullptr, kDriverBytes, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (space == MAP_FAILED)
        throw Error(ErrorKind::kLimit,
                    "Vulkan: memory is too short for a driver; raise its limit (ulimit -v)");
    ::munmap(space, kDriverBytes);
    throw Error(ErrorKind::kUnavailable, "Vulkan: " + text);
}

void throw_result(VkResult result, const char* action) {
    const ErrorKind kind = error_kind_of(result);
    std::string text = std::string("cannot ") + action + ": " + result_name(result);
    if (kind == ErrorKind::kUnavailable) throw_unavailable(text);
    if (kind == ErrorKind::kLimit) text += "; use a smaller scene or image, or another device";
    if (kind == ErrorKind::kDeviceLost) text += "; the device is lost to this run";
    throw Error(kind, "Vulkan: " + text);
}

}  // namespace mray::gpu
