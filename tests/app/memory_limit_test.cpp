// An address space that is too small, refused with numbers instead of a kill. Not for programs
// under AddressSanitizer, which reserves more than any limit.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "tests/app/program.h"
#include "tests/support/test_scene.h"

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

/// A file of separate triangles, which share no vertices.
std::string write_soup(const TemporaryFolder& folder, std::uint32_t triangles) {
    const std::string name = folder.file("soup.ply");
    std::ofstream out(name, std::ios::binary);
    out << "ply\nformat binary_little_endian 1.0\nelement vertex " << 3 * triangles
        << "\nproperty float x\nproperty float y\nproperty float z\nelement face " << triangles
        << "\nproperty list uchar uint vertex_indices\nend_header\n";
    Random random(1);
    const double size = 1 / std::sqrt(triangles);
    for (std::uint32_t i = 0; i < triangles; ++i) {
        const vec3 centre = random.point(1);
        for (int corner = 0; corner < 3; ++corner) {
            const vec3 p = centre + random.point(size);
            out.write(reinterpret_cast<const char*>(&p), 3 * sizeof(float));
        }
    }
    for (std::uint32_t i = 0; i < triangles; ++i) {
        const std::uint32_t corners[3] = {3 * i, 3 * i + 1, 3 * i + 2};
        out.put(3);
        out.write(reinterpret_cast<const char*>(corners), sizeof corners);
    }
    return name;
}

std::vector<std::string> with_limit(std::vector<std::string> arguments, double bytes) {
    arguments.insert(arguments.end(),
                     {"--memory-limit", std::to_string(static_cast<std::uint64_t>(bytes))});
    return arguments;
}

TEST(MemoryLimit, EstimatesAreWithinAFifthOfWhatIsHeld) {
    TemporaryFolder folder;
    const std::string out = folder.file("out");
    const std::string soup = write_soup(folder, 400'000);
    const std::vector<std::vector<std::string>> commands = {
        {"render", "--backend", "cpu", "--size", "64x64", "--frames", "0", "--out", out},
        {"render", "--backend", "cpu", "--update", "rebuild", "--size", "512x512", "--samples", "1",
         "--ao-samples", "0", "--frames", "0", "--out", out},
        {"profile", "--backend", "cpu", "--size", "64x64", "--frames", "0", "--repeat", "1"},
        {"crosscheck", "--backend", "cpu", "--reference", "cpu", "--rays", "primary", "--size",
         "16x16", "--frames", "0"},
    };
    for (const std::string& scene : {std::string("builtin:cloth:400000"), soup}) {
        for (std::vector<std::string> arguments : commands) {
            arguments.push_back(scene);
            const Outcome free = run(arguments);
            ASSERT_EQ(free.code, 0) << free.err;
            const auto peak = static_cast<double>(free.peak_bytes);
            const std::string what = arguments.front() + ' ' + scene;
            const Outcome refused = run(with_limit(arguments, peak / 1.2));
            EXPECT_EQ(refused.code, 6) << what << ": " << refused.err << refused.out;
            EXPECT_LE(refused.peak_bytes, 0.7 * peak) << what;
            const Outcome taken = run(with_limit(arguments, 1.2 * peak));
            EXPECT_EQ(taken.code, 0) << what << ", peak " << peak / 0x1p20 << " MiB: " << taken.err;
        }
    }
}

TEST(MemoryLimit, OfTheOptionIsNamedWithTheSceneAndTheNeed) {
    TemporaryFolder folder;
    const std::string out = folder.file("out");
    const std::string rays = folder.file("rays");
    std::ofstream(rays) << "0 9 0 0 -1 0\n";
    const std::string points = folder.file("points");
    std::ofstream(points) << "0 9 0\n";
    for (const std::vector<std::string>& arguments : std::vector<std::vector<std::string>>{
             {"render", "--out", out},
             {"crosscheck", "--out", out},
             {"profile"},
             {"probe", "--frame", "0", "--pixel", "1,1"},
             {"trace", "--rays", rays, "--out", out},
             {"query", "--points", points, "--ask", "inside", "--out", out},
             {"info"},
             {"index", "--out", out},
         }) {
        std::vector<std::string> all = arguments;
        all.insert(all.end(), {"builtin:cloth:1000000", "--memory-limit", "30M"});
        const Outcome outcome = run(all);
        EXPECT_EQ(outcome.code, 6) << arguments.front() << outcome.err;
        EXPECT_EQ(lines(outcome.err).size(), 1u) << outcome.err;
        EXPECT_NE(outcome.err.find("builtin:cloth:1000000: this needs about "), std::string::npos)
            << outcome.err;
        EXPECT_NE(outcome.err.find("but --memory-limit leaves 30 MiB"), std::string::npos)
            << outcome.err;
    }
    EXPECT_EQ(folder.names(), (std::vector<std::string>{"points", "rays"}));
}

// Triangles that overlap fill leaves badly, so that a tree takes several times the estimate.
TEST(MemoryLimit, HoldsWhereTheEstimateIsTooLow) {
    TemporaryFolder folder;
    const std::string name = folder.file("scattered.ply");
    constexpr std::uint32_t kTriangles = 1'500'000;
    constexpr std::uint32_t kVertices = kTriangles / 2;
    {
        std::ofstream out(name, std::ios::binary);
        out << "ply\nformat binary_little_endian 1.0\nelement vertex " << kVertices
            << "\nproperty float x\nproperty float y\nproperty float z\nelement face " << kTriangles
            << "\nproperty list uchar uint vertex_indices\nend_header\n";
        Random random(1);
        for (std::uint32_t i = 0; i < kVertices; ++i) {
            const vec3 p = random.point(1);
            out.write(reinterpret_cast<const char*>(&p), 3 * sizeof(float));
        }
        for (std::uint32_t i = 0; i < kTriangles; ++i) {
            const std::uint32_t corners[3] = {random.below(kVertices), random.below(kVertices),
                                              random.below(kVertices)};
            out.put(3);
            out.write(reinterpret_cast<const char*>(corners), sizeof corners);
        }
    }
    const Outcome outcome = run({"profile", name, "--backend", "cpu", "--threads", "2", "--size",
                                 "8x8", "--repeat", "1", "--memory-limit", "620M"});
    EXPECT_EQ(outcome.code, 6) << outcome.out;
    EXPECT_EQ(lines(outcome.err).size(), 1u) << outcome.err;
    EXPECT_LE(outcome.peak_bytes, (930 + 256 + 2 * 8) * std::uint64_t{kMebibyte});
}

TEST(MemoryLimit, IsABadArgumentIfItIsNoSize) {
    for (const char* const size : {"0", "", "M", "-1", "1.5G", "2g", "1P", "99999999999G",
                                   "16777216T", "99999999999999999999"}) {
        const Outcome outcome = run({"info", "builtin:cloth:500", "--memory-limit", size});
        EXPECT_EQ(outcome.code, 2) << size;
        EXPECT_EQ(lines(outcome.err).size(), 1u) << outcome.err;
    }
    EXPECT_EQ(run({"info", "builtin:cloth:500", "--memory-limit", "1T"}).code, 0);
}

}  // namespace
}  // namespace mray::test
