// render --skip-existing: an image is kept if it is whole, of this scene, and of these options.
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "tests/app/program.h"

namespace mray::test {
namespace {

using Names = std::vector<std::string>;

/// The frames that a run renders, of four; the others are kept.
std::size_t rendered(const TemporaryFolder& folder, const Names& more = {}) {
    Names line = {
        "render", "builtin:cloth:200", "--frames", "0..3",   "--size", "16x16", "--backend",
        "cpu",    "--skip-existing",   "--json",   "r.json", "--out",  "out",   "--quiet"};
    line.insert(line.end(), more.begin(), more.end());
    const Outcome outcome = run(line, {.folder = folder.path()});
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    const std::string report = read_file(folder.path() / "r.json");
    std::size_t count = 0;
    for (std::size_t at = report.find("\"file\""); at != std::string::npos;
         at = report.find("\"file\"", at + 1))
        ++count;
    return count;
}

TEST(SkipExisting, KeepsWholeImagesOfTheSameOptions) {
    const TemporaryFolder folder;
    EXPECT_EQ(rendered(folder), 4u);
    const std::string first = read_file(folder.path() / "out/frame_0001.png");
    EXPECT_EQ(rendered(folder), 0u);
    folder.write("out/frame_0001.png", first.substr(0, first.size() / 2));
    EXPECT_EQ(rendered(folder), 1u);
    EXPECT_EQ(read_file(folder.path() / "out/frame_0001.png"), first);
    EXPECT_EQ(rendered(folder, {"--rays", "ao"}), 4u);
}

TEST(SkipExisting, RendersAgainWhatLacksAFile) {
    const TemporaryFolder folder;
    EXPECT_EQ(rendered(folder, {"--exr", "half"}), 4u);
    EXPECT_EQ(rendered(folder, {"--exr", "half"}), 0u);
    std::filesystem::remove(folder.path() / "out/frame_0002.exr");
    EXPECT_EQ(rendered(folder, {"--exr", "half"}), 1u);
}

}  // namespace
}  // namespace mray::test
