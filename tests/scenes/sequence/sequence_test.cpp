#include "scenes/sequence/streamed_animation.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <atomic>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <tuple>
#include <vector>

#include "scenes/mesh/mesh_file.h"
#include "tests/scenes/opened_scene.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/thrown_error.h"

namespace mray {
namespace {

using namespace test;

void write_all(const TemporaryFolder& folder, std::initializer_list<const char*> names) {
    for (const char* name : names) folder.write(name, "");
}

using Listed = std::vector<std::pair<double, std::string>>;

Listed listed(const std::vector<KeyframeFile>& files) {
    Listed result;
    for (const KeyframeFile& file : files)
        result.emplace_back(file.frame, file.path.filename().native());
    return result;
}

TEST(KeyframeFilesOfFolder, AreInTheOrderOfTheirNumbersAndTheLeastStepIsOneFrame) {
    const struct {
        std::vector<const char*> names;
        Listed expected;
    } cases[] = {{{"f10.obj", "f9.obj", "f8.obj", "f11.obj", "readme.txt", "f.mtl", ".f7.obj"},
                  {{0, "f8.obj"}, {1, "f9.obj"}, {2, "f10.obj"}, {3, "f11.obj"}}},
                 {{"a_0100.obj", "a_0110.obj", "a_0120.obj"},
                  {{0, "a_0100.obj"}, {1, "a_0110.obj"}, {2, "a_0120.obj"}}},
                 {{"mesh.obj"}, {{0, "mesh.obj"}}}};
    for (const auto& [names, expected] : cases) {
        const TemporaryFolder folder;
        for (const char* name : names) folder.write(name, "");
        folder.write("f12.obj/file", "");
        EXPECT_EQ(listed(files_of_folder(folder.path(), {})), expected);
    }
}

TEST(KeyframeFilesOfFolder, WithoutObjFilesIsBadInput) {
    const TemporaryFolder folder;
    EXPECT_EQ(kind_of([&] { files_of_folder(folder.path(), {}); }), ErrorKind::kBadInput);
    write_all(folder, {"a.txt", ".obj"});
    EXPECT_EQ(kind_of([&] { files_of_folder(folder.path(), {}); }), ErrorKind::kBadInput);
    EXPECT_EQ(kind_of([&] { files_of_folder(folder.path() / "none", {}); }), ErrorKind::kBadInput);
}

TEST(KeyframeFilesOfFolder, NamesThatDifferAreRefused) {
    for (const auto& names : {std::vector<const char*>{"a_1.obj", "b_2.obj"},
                              {"a_1.obj", "a_2_low.obj"},
                              {"a.obj", "b.obj"},
                              {"a.obj", "a1.obj"},
                              {"a_01.obj", "a_1.obj"},
                              {"a_1.obj", "a_2.ply"},
                              {"a_1.obj", "a_1234567890123456789.obj"}}) {
        const TemporaryFolder folder;
        for (const char* name : names) folder.write(name, "");
        const auto error = error_of([&] { files_of_folder(folder.path(), {}); });
        ASSERT_TRUE(error) << names[0];
        EXPECT_EQ(error->kind(), ErrorKind::kBadInput);
        EXPECT_TRUE(has(error->what(), names[1]));
    }
}

TEST(KeyframeFilesOfFolder, MissingFrameIsRefusedByNameUnlessAskedFor) {
    const TemporaryFolder folder;
    for (int i = 1; i <= 12; ++i) {
        if (i != 7) folder.write(fmt::format("f_{:02}.obj", i), "");
    }
    const std::string message = message_of([&] { files_of_folder(folder.path(), {}); });
    EXPECT_TRUE(has(message, "f_07.obj: frame is missing; "));
    std::vector<std::string> warnings;
    const AnimationOptions options = {.skip_missing = true, .warn = [&](const Warning& warning) {
                                          warnings.push_back(warning.line());
                                      }};
    const Listed files = listed(files_of_folder(folder.path(), options));
    EXPECT_EQ(files.size(), 11u);
    EXPECT_EQ(files[6], (std::pair<double, std::string>{7, "f_08.obj"}));
    ASSERT_EQ(warnings.size(), 1u);
    EXPECT_TRUE(has(warnings[0], "f_07.obj: warning: frame is missing; "));
}

TEST(KeyframeFilesOfPattern, KeepTheNumbersOfTheirNames) {
    const TemporaryFolder folder;
    write_all(folder, {"f_009.obj", "f_010.obj", "f_011.obj", "g_001.obj", "f_x.obj", "f_.obj"});
    EXPECT_EQ(listed(files_of_pattern((folder.path() / "f_%03d.obj").native(), {})),
              (Listed{{9, "f_009.obj"}, {10, "f_010.obj"}, {11, "f_011.obj"}}));
    EXPECT_EQ(listed(files_of_pattern(folder.file("g_*.obj"), {})), (Listed{{1, "g_001.obj"}}));
    folder.write("g_01.obj", "");
    EXPECT_EQ(kind_of([&] { files_of_pattern(folder.file("g_*.obj"), {}); }), ErrorKind::kBadInput);
}

TEST(KeyframeFilesOfPattern, AStarThatIsNoNumberStandsForTheFilesOfAFolder) {
    const TemporaryFolder folder;
    write_all(folder, {"f_2.obj", "f_3.obj", "f.mtl"});
    for (const char* pattern : {"*.obj", "f*.obj"})
        EXPECT_EQ(listed(files_of_pattern((folder.path() / pattern).native(), {})),
                  (Listed{{0, "f_2.obj"}, {1, "f_3.obj"}}));
    write_all(folder, {"g_3.obj"});
    const std::string message =
        message_of([&] { files_of_pattern((folder.path() / "*.obj").native(), {}); });
    EXPECT_TRUE(has(message, "f_2.obj and g_3.obj are not frames of one sequence"));
}

TEST(KeyframeFilesOfPattern, MissingFrameIsRefusedByNameUnlessAskedFor) {
    const TemporaryFolder folder;
    write_all(folder, {"f_5.obj", "f_6.obj", "f_9.obj", "f_11.obj"});
    const std::string pattern = (folder.path() / "f_%d.obj").native();
    const std::string message = message_of([&] { files_of_pattern(pattern, {}); });
    EXPECT_TRUE(has(message, "f_7.obj: frame is missing and 2 more; "));
    EXPECT_EQ(listed(files_of_pattern(pattern, {.skip_missing = true})),
              (Listed{{5, "f_5.obj"}, {6, "f_6.obj"}, {9, "f_9.obj"}, {11, "f_11.obj"}}));
}

TEST(KeyframeFilesOfPattern, WithoutFilesAreBadInput) {
    const TemporaryFolder folder;
    EXPECT_EQ(kind_of([&] { files_of_pattern((folder.path() / "f_%d.obj").native(), {}); }),
              ErrorKind::kBadInput);
    EXPECT_EQ(kind_of([&] { files_of_pattern((folder.path() / "none/f_%d.obj").native(), {}); }),
              ErrorKind::kBadInput);
    EXPECT_EQ(kind_of([&] { files_of_pattern((folder.path() / "f_%s.obj").native(), {}); }),
              ErrorKind::kBadArgument);
}

// A triangle at x, moved by frame.
std::string triangle_at(const std::string& x) {
    return "v " + x + " 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
}

/// Files with these texts, but for empty ones. They are read when frames need them.
struct OpenedFrames : private TemporaryFolder, public OpenedScene {
    explicit OpenedFrames(const std::vector<std::string>& texts,
                          const AnimationOptions& options = {})
        : OpenedScene(written(texts), options) {}

    float x_at(double frame) const { return at(frame)[0].x; }

private:
    std::string written(const std::vector<std::string>& texts) const {
        for (std::size_t i = 0; i < texts.size(); ++i) {
            if (!texts[i].empty()) write(fmt::format("f_{}.obj", i), texts[i]);
        }
        return file("f_%d.obj");
    }
};

TEST(KeyframeAnimation, GivesKeyframesBitForBitAndInterpolatesBetween) {
    const OpenedFrames opened({triangle_at("0.1"), triangle_at("1e-42"), triangle_at("4")});
    EXPECT_EQ(opened.animation->first_frame(), 0);
    EXPECT_EQ(opened.animation->last_frame(), 2);
    EXPECT_EQ(opened.x_at(0), 0.1f);
    EXPECT_EQ(std::bit_cast<unsigned>(opened.x_at(1)), 714u);
    EXPECT_EQ(opened.x_at(1.25), 1e-42f + (4.0f - 1e-42f) * 0.25f);
    EXPECT_EQ(opened.x_at(0.7), 0.1f + (1e-42f - 0.1f) * 0.7f);
    EXPECT_EQ(opened.x_at(2), 4.0f);
    EXPECT_EQ(opened.x_at(std::nextafter(2.0, 0.0)), 4.0f);
    // 1 + (1e-9 - 1) is 0 in float.
    const OpenedFrames shrinking({triangle_at("1"), triangle_at("1e-9")});
    EXPECT_EQ(shrinking.x_at(std::nextafter(1.0, 0.0)), 1e-9f);
}

TEST(KeyframeAnimation, IsSmoothOverVerticesOrAsTheFirstFileSays) {
    const OpenedFrames without({triangle_at("0"), triangle_at("1")});
    EXPECT_EQ(without.animation->smooth_corners().data(),
              without.animation->topology().triangles.data());
    // A square and a triangle at its edge 2 3, with a crease there at vertex 3 only.
    const std::string both =
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0 1\nvn 0 0 1\nvn 1 0 0\n"
        "f 1//1 2//1 3//1 4//1\nf 2//1 5//2 3//2\n";
    const OpenedFrames given({both, both});
    const Topology& topology = given.animation->topology();
    const std::span<const uvec3> smooth = given.animation->smooth_corners();
    ASSERT_EQ(smooth.size(), 3u);
    const auto number = [&](std::size_t prim, std::uint32_t vertex) {
        for (int k = 0; k < 3; ++k)
            if (topology.triangles[prim][k] == vertex) return smooth[prim][k];
        return ~0u;
    };
    // The same in both triangles of the square.
    for (const std::uint32_t vertex : {0u, 1u, 2u, 3u}) {
        const std::uint32_t first = number(0, vertex);
        const std::uint32_t second = number(1, vertex);
        if (first != ~0u && second != ~0u) {
            EXPECT_EQ(first, second);
        }
    }
    const auto in_square = [&](std::uint32_t vertex) {
        return std::min(number(0, vertex), number(1, vertex));
    };
    EXPECT_EQ(number(2, 1), in_square(1));
    EXPECT_NE(number(2, 2), in_square(2));
}

TEST(Interpolate, NeverLeavesTheInterval) {
    std::mt19937 random(5);
    std::uniform_real_distribution<float> mantissa(-2, 2);
    std::uniform_int_distribution<int> exponent(-149, 99);
    std::uniform_real_distribution<float> unit(0, 1);
    const float nearly_one = std::nextafter(1.0f, 0.0f);
    for (int i = 0; i < 2'000'000; ++i) {
        const int scale = exponent(random);
        const float a = std::ldexp(mantissa(random), scale);
        const float b = std::ldexp(mantissa(random), i % 2 ? scale : exponent(random));
        const float f = i % 3 == 0 ? nearly_one : std::min(unit(random), nearly_one);
        const float x = interpolate(a, b, f);
        ASSERT_GE(x, std::min(a, b)) << a << " " << b << " " << f;
        ASSERT_LE(x, std::max(a, b)) << a << " " << b << " " << f;
    }
}

TEST(KeyframeAnimation, ColoursAndTrianglesAreThoseOfTheFirstFrame) {
    const TemporaryFolder folder;
    folder.write("a.mtl", "newmtl a\nKd 1 0 0\n");
    const std::string quad = "v 0 0 0\nv 4 0 0\nv 1 1 0\nv 0 4 0\nusemtl a\nf 1 2 3 4\nf 1 2 3\n";
    // In the second frame the notch is elsewhere: the same faces, but another triangulation.
    const std::string moved = "v 0 0 0\nv 1 1 0\nv 4 4 0\nv 0 4 0\nf 1 2 3 4\nf 1 2 3\n";
    folder.write("f_0.obj", "mtllib a.mtl\n" + quad);
    folder.write("f_1.obj", moved);
    const auto animation = open_scene(folder.path().native());
    EXPECT_EQ(animation->topology().albedo, (std::vector<Albedo>{0xFF, 0xFF, 0xFF}));
    EXPECT_EQ(animation->topology().triangles.size(), 3u);
    EXPECT_EQ(animation->topology().triangles[2], uvec3(0, 1, 2));
}

TEST(KeyframeAnimation, FrameOfOtherFacesIsRefusedByName) {
    const std::string vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\n";
    const auto faces = [&](const char* text) { return vertices + text; };
    for (const auto& [first, second, counts] :
         {std::tuple(faces("f 1 2 3\nf 2 4 3\n"), faces("f 1 2 3\nf 3 2 4\n"), "2 of 4 vertices"),
          {faces("f 1 2 3\n"), faces("f 1 2 3\nf 3 2 4\n"), "2 of 4 vertices"},
          {faces("f 1 2 3 4\nf 1 2 3\n"), faces("f 1 2 3\nf 4 1 2 3\n"), "2 of 4 vertices"},
          {triangle_at("1"), "v 0 0 0\n" + triangle_at("2"), "1 of 4 vertices"}}) {
        const std::vector<std::string> texts = {first, second};
        const auto error = error_of([&] { OpenedFrames(texts, {}).x_at(1); });
        ASSERT_TRUE(error) << second;
        EXPECT_EQ(error->kind(), ErrorKind::kBadInput);
        EXPECT_TRUE(
            has(error->what(), fmt::format("f_1.obj: frame 1 has other faces ({}) than ", counts)));
        EXPECT_TRUE(has(error->what(), "separate runs"));
    }
}

TEST(KeyframeAnimation, FrameThatExplodesFailsWhenItIsAskedFor) {
    for (const char* x : {"nan", "inf", "1e31", "-3e38", "x"}) {
        const OpenedFrames opened({triangle_at("0"), triangle_at("1"), triangle_at(x),
                                   triangle_at("3"), triangle_at("4")});
        EXPECT_EQ(opened.x_at(0), 0.0f);
        EXPECT_EQ(opened.x_at(0.5), 0.5f);
        EXPECT_EQ(opened.x_at(1), 1.0f);
        for (const double frame : {1.5, 2.0, 2.75}) {
            const auto error = error_of([&] { opened.x_at(frame); });
            ASSERT_TRUE(error) << frame;
            EXPECT_EQ(error->kind(), ErrorKind::kBadInput);
            EXPECT_TRUE(has(error->what(), "f_2.obj:1: "));
            EXPECT_TRUE(has(error->what(), ": frame 2: "));
        }
        EXPECT_EQ(opened.x_at(3), 3.0f);
        EXPECT_EQ(opened.x_at(3.5), 3.5f);
        EXPECT_TRUE(opened.warnings.empty());
    }
}

TEST(KeyframeAnimation, MissingFrameIsRefusedOrInterpolated) {
    const std::vector<std::string> texts = {triangle_at("0"), "", "", triangle_at("6"),
                                            triangle_at("7")};
    EXPECT_EQ(kind_of([&] { OpenedFrames(texts, {}); }), ErrorKind::kBadInput);
    const OpenedFrames skipped(texts, {.skip_missing = true});
    EXPECT_EQ(skipped.animation->last_frame(), 4);
    EXPECT_EQ(skipped.x_at(1.5), 3.0f);
    EXPECT_EQ(skipped.x_at(3.5), 6.5f);
}

/// An animation with positions (keyframe, vertex, 0), which counts the keyframes that are read.
std::unique_ptr<Animation> counted_animation(std::size_t count, std::uint32_t vertices,
                                             std::atomic<int>& reads) {
    FirstMesh first;
    first.topology.vertex_count = vertices;
    first.topology.triangles = {{0, 1, 2}};
    first.topology.albedo = {kClay};
    Keyframes keyframes;
    for (std::size_t i = 0; i < count; ++i) keyframes.frames.push_back(static_cast<double>(i));
    keyframes.read = [&reads](std::size_t keyframe, std::span<vec3> out) {
        ++reads;
        for (std::size_t i = 0; i < out.size(); ++i)
            out[i] = vec3(static_cast<float>(keyframe), static_cast<float>(i), 0);
        return std::optional<Warning>();
    };
    return stream_keyframes("counted", std::move(first), std::move(keyframes), {});
}

// Four keyframes are beyond the 128 MiB that stay in memory.
constexpr std::uint32_t kLarge = (std::uint32_t{128} << 20) / sizeof(vec3) / 3;

TEST(StreamedAnimation, ReadsTheKeyframesOfASmallAnimationOnce) {
    std::atomic<int> reads = 0;
    const std::unique_ptr<Animation> animation = counted_animation(100, 4, reads);
    std::vector<vec3> positions(4);
    for (double frame = 0; frame <= 99; frame += 0.25) animation->positions(frame, positions);
    EXPECT_EQ(reads, 100);
    EXPECT_EQ(animation->bounds().upper[0], 0);
    // No triangle uses the fourth vertex.
    EXPECT_EQ(animation->bounds().upper[1], 2);
}

TEST(StreamedAnimation, ReadsAKeyframeOfALargeAnimationOnceWhenItIsPlayed) {
    std::atomic<int> reads = 0;
    const std::unique_ptr<Animation> animation = counted_animation(4, kLarge, reads);
    EXPECT_EQ(reads, 1);
    std::vector<vec3> positions(kLarge);
    for (const double frame : {0.25, 0.5, 1.0, 1.5, 1.75}) {
        animation->positions(frame, positions);
        EXPECT_EQ(positions[3].x, static_cast<float>(frame));
    }
    EXPECT_EQ(reads, 3);
}

TEST(StreamedAnimation, GivesAllThreadsTheirFrames) {
    std::atomic<int> reads = 0;
    const std::unique_ptr<Animation> animation = counted_animation(50, 1000, reads);
    std::atomic<int> wrong = 0;
    std::vector<std::thread> threads;
    for (int t = 0; t < 4; ++t) {
        threads.emplace_back([&, t] {
            std::vector<vec3> positions(1000);
            for (int i = 0; i < 200; ++i) {
                const double frame = (i * 37 + t * 11) % 98 / 2.0;
                animation->positions(frame, positions);
                wrong += positions[999] != vec3(static_cast<float>(frame), 999, 0);
            }
        });
    }
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(wrong, 0);
}

constexpr float kInfinity = std::numeric_limits<float>::infinity();
const std::string kMesh = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

void append(std::string& bytes, std::uint32_t word) {
    bytes.append(reinterpret_cast<const char*>(&word), sizeof word);
}
void append(std::string& bytes, float x) { append(bytes, std::bit_cast<std::uint32_t>(x)); }

/// A sample of three points, the first of them at x.
void append_sample(std::string& bytes, float x) {
    for (const float value : {x, 0.0f, 0.0f, 1.0f, 0.0f, 0.0f, 0.0f, 1.0f, 0.0f})
        append(bytes, value);
}

struct Pc2Head {
    std::uint32_t version = 1;
    std::uint32_t points = 3;
    float first_frame = 0;
    float frames_per_sample = 1;
    std::uint32_t samples = 3;
};

std::string pc2(const Pc2Head& head, const std::vector<float>& xs) {
    std::string bytes("POINTCACHE2\0", 12);
    append(bytes, head.version);
    append(bytes, head.points);
    append(bytes, head.first_frame);
    append(bytes, head.frames_per_sample);
    append(bytes, head.samples);
    for (const float x : xs) append_sample(bytes, x);
    return bytes;
}

/// A mesh with a cache, as files that exist as long as the object.
class CachedScene {
public:
    explicit CachedScene(const std::string& cache, const std::string& mesh = kMesh) {
        folder_.write("mesh.obj", mesh);
        write(cache);
    }

    std::unique_ptr<Animation> open(AnimationOptions options = {}) {
        options.cache = (folder_.path() / "cloth.pc2").native();
        options.warn = [this](const Warning& warning) { warnings_.push_back(warning.line()); };
        return open_scene((folder_.path() / "mesh.obj").native(), options);
    }
    /// The error without the folder.
    std::string error() {
        return message_without(folder_, [&] { open(); });
    }
    void write(const std::string& cache) { folder_.write("cloth.pc2", cache); }
    const std::vector<std::string>& warnings() const { return warnings_; }

private:
    TemporaryFolder folder_;
    std::vector<std::string> warnings_;
};

float x_at(const Animation& animation, double frame) { return positions_at(animation, frame)[0].x; }

TEST(CachedAnimation, GivesSamplesBitForBitAndInterpolatesBetween) {
    const std::vector<float> xs = {0.1f, 1e-42f, 4.0f};
    CachedScene scene(pc2({}, xs));
    const std::unique_ptr<Animation> animation = scene.open();
    EXPECT_EQ(animation->topology().triangles.size(), 1u);
    EXPECT_EQ(animation->first_frame(), 0);
    EXPECT_EQ(animation->last_frame(), 2);
    for (std::size_t i = 0; i < xs.size(); ++i)
        EXPECT_EQ(x_at(*animation, static_cast<double>(i)), xs[i]);
    EXPECT_EQ(x_at(*animation, 0.7), interpolate(xs[0], xs[1], 0.7f));
    EXPECT_EQ(x_at(*animation, 1.25), interpolate(xs[1], xs[2], 0.25f));
    EXPECT_EQ(x_at(*animation, std::nextafter(2.0, 0.0)), 4.0f);
    EXPECT_EQ(x_at(*animation, -5), xs[0]);
    EXPECT_EQ(x_at(*animation, 9), xs[2]);
    EXPECT_EQ(x_at(*animation, std::nan("")), xs[0]);
    EXPECT_EQ(positions_at(*animation, 1)[2], vec3(0, 1, 0));
    EXPECT_EQ(animation->bounds().lower[0], 0);
    EXPECT_EQ(animation->bounds().upper[0], 1);
    EXPECT_TRUE(scene.warnings().empty());
}

TEST(CachedAnimation, TellsWhichSampleIsNotFinite) {
    for (const float bad : {std::nanf(""), kInfinity, -2e30f}) {
        CachedScene scene(pc2({.samples = 4}, {1, 2, bad, 3}));
        const std::unique_ptr<Animation> animation = scene.open();
        EXPECT_EQ(x_at(*animation, 1), 2.0f);
        EXPECT_EQ(x_at(*animation, 3), 3.0f);
        const std::string what =
            "cloth.pc2: frame 2: vertex 0 has a coordinate that is not finite or beyond 1e30";
        for (const double frame : {1.5, 2.0})
            EXPECT_TRUE(
                message_of([&] { x_at(*animation, frame); }).ends_with(what + "; repair it"));
        const std::unique_ptr<Animation> lenient = scene.open({.lenient = true});
        EXPECT_EQ(std::bit_cast<std::uint32_t>(x_at(*lenient, 2)),
                  std::bit_cast<std::uint32_t>(bad));
        ASSERT_EQ(scene.warnings().size(), 1u);
        EXPECT_TRUE(scene.warnings()[0].ends_with(
            "frame 2: vertex 0 has a coordinate that is not finite or beyond 1e30; kept as it is"));
    }
    CachedScene none(pc2({.samples = 2}, {kInfinity, kInfinity}));
    EXPECT_EQ(none.error(),
              "cloth.pc2: frame 0: vertex 0 has a coordinate that is not finite or beyond 1e30; "
              "repair it");
}

TEST(CachedAnimation, RefusesWhatIsNoCacheOfTheMesh) {
    EXPECT_EQ(CachedScene("").error(), "cloth.pc2: not a point cache; give a complete .pc2 file");
    EXPECT_EQ(CachedScene(pc2({.version = 2}, {1, 2, 3})).error(),
              "cloth.pc2: has version 2, 3 points, and 3 samples from frame 0 in steps of 1; must "
              "have version 1, points and samples, and steps above 0 to frames within 1000000000");
    EXPECT_TRUE(has(CachedScene(pc2({.samples = 0}, {})).error(), "and 0 samples"));
    EXPECT_TRUE(has(CachedScene(pc2({.points = 0}, {1, 2, 3})).error(), "0 points, and"));
    EXPECT_EQ(CachedScene(pc2({}, {1, 2, 3}),
                          "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 1\n"
                          "f 1 2 3\n")
                  .error(),
              "cloth.pc2: has 3 points, but mesh.obj has 4 vertices; give the mesh that the cache "
              "was written for");
    for (const float step : {0.0f, -1.0f, std::nanf(""), kInfinity, 1e30f}) {
        const std::string error = CachedScene(pc2({.frames_per_sample = step}, {1, 2, 3})).error();
        EXPECT_TRUE(has(error, "steps above 0"));
    }
    for (const float first : {std::nanf(""), -kInfinity, 1e20f}) {
        const std::string error = CachedScene(pc2({.first_frame = first}, {1, 2, 3})).error();
        EXPECT_TRUE(has(error, "3 samples from frame"));
    }
    EXPECT_TRUE(has(CachedScene(pc2({.samples = 0xFFFFFFFF}, {1, 2, 3})).error(),
                    "and 4294967295 samples from frame 0 in steps of 1; must have"));
}

TEST(CachedAnimation, RefusesAnySizeButThatOfTheHead) {
    const std::string whole = pc2({}, {1, 2, 3});
    CachedScene scene(whole);
    EXPECT_EQ(scene.error(), "");
    for (std::size_t size = 0; size < whole.size(); ++size) {
        scene.write(whole.substr(0, size));
        EXPECT_EQ(kind_of([&] { scene.open(); }), ErrorKind::kBadInput) << size;
    }
    scene.write(whole + "x");
    EXPECT_EQ(kind_of([&] { scene.open(); }), ErrorKind::kBadInput);
    // Every number of the head at its limits.
    for (std::size_t at = 12; at < 32; at += 4) {
        for (const std::uint32_t word : {0u, 1u, 0x7FFFFFFFu, 0x80000000u, 0xFFFFFFFFu}) {
            std::string changed = whole;
            std::memcpy(changed.data() + at, &word, sizeof word);
            if (changed == whole) continue;
            scene.write(changed);
            // The first frame may be any small number.
            const bool is_fine = at == 20 && (word < 2 || word == 0x80000000u);
            EXPECT_EQ(kind_of([&] { scene.open(); }) == ErrorKind::kBadInput, !is_fine)
                << at << " " << word;
        }
    }
}

TEST(CachedAnimation, NeedsOneMeshFile) {
    const TemporaryFolder folder;
    folder.write("a.pc2", pc2({}, {1, 2, 3}));
    folder.write("mesh.obj", kMesh);
    const AnimationOptions options{.cache = (folder.path() / "a.pc2").native()};
    for (const std::string& scene :
         {std::string("builtin:cloth"), folder.path().native(), std::string("f_%d.pc2")}) {
        EXPECT_EQ(kind_of([&] { open_scene(scene, options); }), ErrorKind::kBadArgument) << scene;
    }
    const AnimationOptions missing{.cache = (folder.path() / "b.pc2").native()};
    const std::string mesh = (folder.path() / "mesh.obj").native();
    EXPECT_TRUE(
        message_of([&] { open_scene(mesh, missing); }).ends_with("no such file; check the path"));
    const AnimationOptions is_folder{.cache = folder.path().native()};
    EXPECT_EQ(kind_of([&] { open_scene(mesh, is_folder); }), ErrorKind::kBadInput);
}

TEST(CachedAnimation, TellsOfAFileThatChangesWhileItIsOpen) {
    CachedScene scene(pc2({}, {1, 2, 3}));
    const std::unique_ptr<Animation> animation = scene.open();
    EXPECT_EQ(x_at(*animation, 0), 1.0f);
    scene.write(pc2({}, {1}));
    EXPECT_TRUE(message_of([&] {
                    x_at(*animation, 2);
                }).ends_with("changed while it was read; wait until it is complete"));
}

}  // namespace
}  // namespace mray
