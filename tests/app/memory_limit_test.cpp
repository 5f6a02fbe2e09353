// An address space that is too small, refused with numbers instead of a kill. Not for programs
// under AddressSanitizer, which reserves more than any limit.
#include <gtest/gtest.h>

#include "tests/app/program.h"

namespace mray::test {
namespace {

constexpr rlim_t kMebibyte = 1 << 20;

TEST(MemoryLimit, WorkBeyondTheAddressSpaceLimitIsRefusedWithNumbers) {
    TemporaryFolder folder;
    const Outcome outcome =
        run({"render", "builtin:cloth:20000000", "--backend", "cpu", "--out", folder.file("out")},
            {.address_space = 512 * kMebibyte});
    EXPECT_EQ(outcome.code, 6) << outcome.err;
    EXPECT_EQ(lines(outcome.err).size(), 1u) << outcome.err;
    EXPECT_NE(outcome.err.find("MiB"), std::string::npos) << outcome.err;
    EXPECT_NE(outcome.err.find("address space"), std::string::npos) << outcome.err;
    EXPECT_TRUE(folder.names().empty());
}

TEST(MemoryLimit, ImageBeyondTheAddressSpaceLimitIsRefused) {
    TemporaryFolder folder;
    const Outcome outcome = run({"render", "builtin:cloth:500", "--backend", "cpu", "--size",
                                 "16000x16000", "--out", folder.file("out")},
                                {.address_space = 512 * kMebibyte});
    EXPECT_EQ(outcome.code, 6) << outcome.err;
    EXPECT_TRUE(folder.names().empty());
}

TEST(MemoryLimit, SmallWorkFitsASmallAddressSpace) {
    TemporaryFolder folder;
    const Outcome outcome = run({"render", "builtin:cloth:500", "--backend", "cpu", "--size",
                                 "16x16", "--frames", "0", "--out", folder.file("out")},
                                {.address_space = 512 * kMebibyte});
    EXPECT_EQ(outcome.code, 0) << outcome.err;
}

TEST(MemoryLimit, DriverIsNotLoadedIntoAnAddressSpaceThatIsTooSmall) {
    TemporaryFolder folder;
    const std::vector<std::string> arguments = {"render", "builtin:cloth:500", "--size",
                                                "16x16",  "--frames",          "0",
                                                "--out",  folder.file("out")};
    const Surroundings small = {.address_space = 400 * kMebibyte};
    const Outcome automatic = run(arguments, small);
    EXPECT_EQ(automatic.code, 0) << automatic.err;
    EXPECT_EQ(lines(automatic.err).size(), 1u) << automatic.err;
}

}  // namespace
}  // namespace mray::test
