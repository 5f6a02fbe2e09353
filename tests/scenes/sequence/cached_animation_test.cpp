#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include "scenes/animation.h"
#include "scenes/sequence/streamed_animation.h"
#include "tests/support/animation_positions.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/thrown_error.h"

namespace mray {
namespace {

using namespace test;

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
        std::string text = message_of([&] { open(); });
        const std::string folder = folder_.path().native() + "/";
        for (std::size_t at = text.find(folder); at != text.npos; at = text.find(folder))
            text.erase(at, folder.size());
        return text;
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
    EXPECT_EQ(CachedScene("").error(), "cloth.pc2: not a point cache; give a .pc2 file");
    EXPECT_EQ(CachedScene("v 0 0 0\nf 1 1 1\n").error(),
              "cloth.pc2: not a point cache; give a .pc2 file");
    EXPECT_EQ(CachedScene(pc2({.version = 2}, {1, 2, 3})).error(),
              "cloth.pc2: has version 2; only 1 is known");
    EXPECT_EQ(CachedScene(pc2({.samples = 0}, {})).error(),
              "cloth.pc2: has no samples; write it again");
    EXPECT_EQ(CachedScene(pc2({.points = 0}, {1, 2, 3})).error(),
              "cloth.pc2: has no points; write it again");
    EXPECT_EQ(CachedScene(pc2({}, {1, 2, 3}),
                          "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 1\n"
                          "f 1 2 3\n")
                  .error(),
              "cloth.pc2: has 3 points, but mesh.obj has 4 vertices; give the mesh that the cache "
              "was written for");
    for (const float step : {0.0f, -1.0f, std::nanf(""), kInfinity, 1e30f}) {
        const std::string error = CachedScene(pc2({.frames_per_sample = step}, {1, 2, 3})).error();
        EXPECT_NE(error.find("steps must be above 0"), error.npos) << error;
    }
    for (const float first : {std::nanf(""), -kInfinity, 1e20f}) {
        const std::string error = CachedScene(pc2({.first_frame = first}, {1, 2, 3})).error();
        EXPECT_NE(error.find("has 3 samples from frame"), error.npos) << error;
    }
    EXPECT_EQ(
        CachedScene(pc2({.samples = 0xFFFFFFFF}, {1, 2, 3})).error(),
        "cloth.pc2: has 4294967295 samples from frame 0 in steps of 1; steps must be above 0, "
        "and frames within 1000000000");
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
