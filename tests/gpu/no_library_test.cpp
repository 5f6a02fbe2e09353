// A machine without a Vulkan library: this program's dlopen finds nothing.
#include <gtest/gtest.h>

#include "gpu/vulkan_backend.h"
#include "tests/support/thrown_error.h"

extern "C" void* dlopen(const char*, int) { return nullptr; }

namespace mray::test {
namespace {

TEST(NoVulkanLibrary, IsSaidInTheErrorAndLeavesNoBackend) {
    EXPECT_EQ(kind_of([] { gpu::list_devices(); }), ErrorKind::kUnavailable);
    EXPECT_TRUE(has(message_of([] { gpu::list_devices(); }), "no Vulkan library"));
    EXPECT_THROW(gpu::make_vulkan_backend(), Error);
}

}  // namespace
}  // namespace mray::test
