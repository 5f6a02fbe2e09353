// The number that README.md has.
#include <gtest/gtest.h>

#include "morphray/morphray.hpp"

namespace mray::test {
namespace {

using morphray::Device;

TEST(Digest, IsTheDocumentedNumberOnAnyInstructionSetAndNumberOfThreads) {
    EXPECT_EQ(morphray::kDigest, 0x7694761A36AD1DDBu);
    std::vector<std::string> targets = morphray::simd_targets();
    targets.emplace_back("off");
    for (const std::string& simd : targets) {
        for (const int threads : {1, 2}) {
            const Device device = Device::cpu({.threads = threads, .simd = simd});
            EXPECT_EQ(morphray::digest(device), morphray::kDigest) << device.description();
        }
    }
}

}  // namespace
}  // namespace mray::test
