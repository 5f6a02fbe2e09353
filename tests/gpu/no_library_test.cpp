// A machine without a Vulkan library: this program's dlopen finds nothing.
#include <gtest/gtest.h>

#include "gpu/vulkan_backend.h"
#include "tests/support/thrown_error.h"

extern "C" void* dlopen(const char*, int) { return nullptr; }

namespace mray::test {
namespace {

TEST(NoVulkanLibrary, IsSaidInTheError) {
    const std::optional<Error> error = error_of([] { gpu::list_devices(); });
    ASSERT_TRUE(error.has_value());
    EXPECT_EQ(error->kind(), ErrorKind::kUnavailable);
    EXPECT_NE(std::string(error->what()).find("no Vulkan library"), std::string::npos);
}

TEST(NoVulkanLibrary, LeavesNoBackend) { EXPECT_THROW(gpu::make_vulkan_backend(), Error); }

}  // namespace
}  // namespace mray::test
