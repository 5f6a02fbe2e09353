// Backends that come and go leave no memory behind. Not part of sanitizer builds, which keep freed
// memory for a while and find leaks in their own way.
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

#include "tests/gpu/test_scenes.h"

namespace mray::test {
namespace {

/// Resident memory of the process.
std::size_t resident_bytes() {
    std::size_t pages = 0;
    std::size_t resident = 0;
    std::ifstream("/proc/self/statm") >> pages >> resident;
    return resident * static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
}

void use_a_backend_once() {
    const std::unique_ptr<Backend> backend = gpu::make_vulkan_backend();
    const TestScene scene = torus(24, 12);
    MovingScene moving(*backend, scene, built_tree(scene));
    Frame frame;
    moving.refit(swayed(scene, 1));
    backend->trace_image(view(64, 64, kRaysShadow), frame);
    moving.refit(swayed(scene, 2));
    backend->trace_image(view(64, 64, kRaysAo), frame);
    moving.refit(swayed(scene, 3));
}

TEST(Lifetime, MemoryStaysFlatWhileBackendsComeAndGo) {
    // By then drivers hold the memory that they keep.
    for (int i = 0; i < 8; ++i) use_a_backend_once();
    const std::size_t before = resident_bytes();
    constexpr int kBackends = 16;
    for (int i = 0; i < kBackends; ++i) use_a_backend_once();
    // Each touches some 2 MB of buffers. Heaps become 0.2 MB larger with each on the way.
    EXPECT_LT(resident_bytes(), before + kBackends * (std::size_t{1} << 20));
}

}  // namespace
}  // namespace mray::test
