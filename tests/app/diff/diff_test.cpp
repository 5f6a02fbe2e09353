// The comparison of two files of hits.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstring>

#include "tests/app/program.h"

namespace mray::test {
namespace {

/// The hits of two frames of the cloth.
std::string write_hits(const TemporaryFolder& folder, const std::string& name,
                       const Words& more = {}, const std::string& size = "24x24") {
    const std::string file = folder.file(name);
    const Outcome outcome =
        run(words("render builtin:cloth:400 --backend cpu --frames 0..1 --quiet --size " + size +
                      " --hits " + file + " --out " + folder.file("out"),
                  more));
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    return file;
}

constexpr std::size_t kHeader = 20;
constexpr std::size_t kPixels = 24 * 24;
constexpr std::size_t kImage = kPixels * 20;

/// The bytes of a hit of the second image.
char* hit_at(std::string& bytes, std::size_t pixel) {
    return bytes.data() + kHeader + kImage + 16 * pixel;
}

std::size_t find_hit(std::string& bytes) {
    std::size_t pixel = 0;
    while (std::memcmp(hit_at(bytes, pixel) + 12, "\xFF\xFF\xFF\xFF", 4) == 0) ++pixel;
    return pixel;
}

TEST(Diff, FindsFilesOfTheSameSceneEqual) {
    const TemporaryFolder folder;
    const std::string a = write_hits(folder, "a", {"--simd", "off"});
    const std::string b = write_hits(folder, "b", {"--update", "rebuild"});
    const Outcome outcome = run({"diff", a, b});
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_EQ(outcome.out, "2 images of 24x24: equal bit by bit\n");
}

TEST(Diff, FindsALastBitOfT) {
    const TemporaryFolder folder;
    const std::string a = write_hits(folder, "a");
    std::string bytes = read_file(a);
    EXPECT_EQ(bytes.substr(0, kHeader),
              std::string("MRHITS1\0\x18\0\0\0\x18\0\0\0\2\0\0\0", kHeader));
    const std::size_t pixel = find_hit(bytes);
    hit_at(bytes, pixel)[0] ^= 1;
    const std::string b = folder.write("b", bytes);
    const Outcome outcome = run({"diff", a, b});
    EXPECT_EQ(outcome.code, 1);
    EXPECT_TRUE(has(outcome.out, "image 1: 1 pixel differs: 1 t\n"));
    const std::string verdict = "2 images of 24x24: 1 pixel of 1 image differs\n";
    EXPECT_TRUE(outcome.out.ends_with(verdict)) << outcome.out;
    EXPECT_EQ(outcome.err, "");
    const Outcome quiet = run({"diff", a, b, "-q"});
    EXPECT_EQ(quiet.code, 1);
    EXPECT_EQ(quiet.out, "");
    EXPECT_EQ(quiet.err, "morphray: " + verdict);
    EXPECT_EQ(run({"diff", a, a, "-q"}).err, "");
}

TEST(Diff, NamesMissesAndOcclusion) {
    const TemporaryFolder folder;
    const std::string a = write_hits(folder, "a", {"--rays", "shadow"});
    std::string bytes = read_file(a);
    const std::size_t pixel = find_hit(bytes);
    constexpr char kMiss[16] = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, -1, -1, -1, -1};
    std::memcpy(hit_at(bytes, pixel), kMiss, sizeof(kMiss));
    bytes[kHeader + kPixels * 16] ^= 1;  // the occlusion of the first image's first pixel
    const std::string b = folder.write("b", bytes);
    const Outcome outcome = run({"diff", a, b});
    EXPECT_EQ(outcome.code, 1) << outcome.err;
    EXPECT_TRUE(has(outcome.out, "image 0: 1 pixel differs: 1 occlusion\n"));
    EXPECT_TRUE(has(outcome.out, "image 1: 1 pixel differs: 1 false miss"));
    EXPECT_TRUE(
        has(outcome.out, fmt::format("  pixel {},{}\n    expected t 0x", pixel % 24, pixel / 24)));
    EXPECT_TRUE(has(outcome.out, "    actual   miss\n"));
}

TEST(Diff, RefusesWhatCannotBeCompared) {
    const TemporaryFolder folder;
    const std::string a = write_hits(folder, "a");
    const std::string small = write_hits(folder, "small", {}, "8x8");
    const auto expect_refused = [](const Words& words, int code, const std::string& text) {
        const Outcome outcome = run(words);
        EXPECT_EQ(outcome.code, code) << outcome.err;
        EXPECT_TRUE(code != 3 || !outcome.err.starts_with("morphray:")) << outcome.err;
        EXPECT_TRUE(has(outcome.err, text));
        EXPECT_EQ(outcome.out, "");
    };
    expect_refused({"diff", a, small}, 3, "has 2 images of 8x8, but ");
    expect_refused({"diff", a, folder.file("none")}, 3, "none");
    expect_refused({"diff", a, folder.write("text", "hello")}, 3, "not a file of hits");
    const std::string bytes = read_file(a);
    expect_refused({"diff", folder.write("cut", bytes.substr(0, bytes.size() - 1)), a}, 3,
                   "do not fit 2 images of 24x24");
    expect_refused({"diff", a}, 2, "FILES");
}

}  // namespace
}  // namespace mray::test
