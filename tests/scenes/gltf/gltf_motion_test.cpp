// Animations, skins and morph targets of glTF files, compared with long double.
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <random>

#include "scenes/gltf/gltf_animation.h"
#include "tests/scenes/gltf/gltf_builder.h"
#include "tests/scenes/gltf/motion_reference.h"
#include "tests/scenes/gltf/opened_gltf.h"

namespace mray {
namespace {

using namespace test;

const std::vector<float> kTimes = {0.5f, 1, 2};

void expect_near(const vec3& actual, const Point3& expected, double most = 1e-6) {
    expect_point(actual, static_cast<double>(expected[0]), static_cast<double>(expected[1]),
                 static_cast<double>(expected[2]), most);
}

GltfBuilder moved_triangle(const std::string& path, const std::vector<float>& values,
                           const std::string& type, const std::string& interpolation) {
    GltfBuilder builder = triangle_file();
    builder.add_animation(0, path, kTimes, builder.add_accessor(values, type), interpolation);
    return builder;
}

/// x of the first vertex at seconds.
float x_at(const OpenedGltf& scene, double seconds) { return scene.at(seconds * 24)[0].x; }

TEST(GltfAnimation, StepHoldsAndLinearInterpolates) {
    const std::vector<float> values = {0, 0, 0, 1, 0, 0, 5, 0, 0};
    const OpenedGltf step(moved_triangle("translation", values, "VEC3", "STEP").gltf());
    EXPECT_EQ(step.animation().last_frame(), 48);
    EXPECT_EQ(step.animation().fps(), 24);
    EXPECT_EQ(x_at(step, 0), 0);
    EXPECT_EQ(x_at(step, 0.99), 0);
    EXPECT_EQ(x_at(step, 1), 1);
    EXPECT_EQ(x_at(step, 1.99), 1);
    EXPECT_EQ(x_at(step, 2), 5);
    const OpenedGltf linear(moved_triangle("translation", values, "VEC3", "LINEAR").gltf());
    EXPECT_EQ(x_at(linear, 0.25), 0);
    EXPECT_EQ(x_at(linear, 0.75), 0.5);
    EXPECT_EQ(x_at(linear, 1), 1);
    EXPECT_EQ(x_at(linear, 1.5), 3);
    EXPECT_EQ(x_at(linear, 99), 5);
    EXPECT_EQ(linear.at(std::nan(""))[0].x, 0);
}

TEST(GltfAnimation, CubicSplinesHaveTheSlopesOfTheirTangents) {
    // In-tangent, value and out-tangent of each key.
    const std::vector<float> values = {9, 9, 9, 0, 0, 0, 2, 0, 0,  //
                                       4, 0, 0, 1, 0, 0, 0, 0, 0,  //
                                       0, 0, 0, 5, 0, 0, 9, 9, 9};
    const OpenedGltf scene(moved_triangle("translation", values, "VEC3", "CUBICSPLINE").gltf());
    for (const Real t : {0.5L, 0.6L, 0.75L, 0.9L}) {
        const Real u = (t - 0.5L) / 0.5L;
        const Real expected = (u * u * u - 2 * u * u + u) * 0.5L * 2 + (3 * u * u - 2 * u * u * u) +
                              (u * u * u - u * u) * 0.5L * 4;
        EXPECT_NEAR(static_cast<double>(x_at(scene, static_cast<double>(t))),
                    static_cast<double>(expected), 1e-7)
            << static_cast<double>(t);
    }
    EXPECT_EQ(x_at(scene, 1), 1);
    EXPECT_NEAR(static_cast<double>(x_at(scene, 1.5)), 3, 1e-6);
}

TEST(GltfAnimation, RotationsTakeTheShorterArcAtEvenSpeed) {
    const Quaternion a = turn({1, 2, 3}, 0.3L);
    const Quaternion b = turn({-1, 0.5L, 1}, 2.1L);
    std::vector<float> values;
    for (const Quaternion& q : {a, b, a})
        for (const Real component : q) values.push_back(static_cast<float>(component));
    // The same rotation with the other sign.
    for (std::size_t k = 4; k < 8; ++k) values[k] = -values[k];
    const OpenedGltf scene(moved_triangle("rotation", values, "VEC4", "LINEAR").gltf());
    for (const Real t : {0.5L, 0.61L, 0.75L, 0.99L}) {
        const Quaternion q = exact_slerp(a, b, (t - 0.5L) / 0.5L);
        const std::vector<vec3> p = scene.at(static_cast<double>(t) * 24);
        expect_near(p[1], rotated(q, {1, 0, 0}));
        expect_near(p[2], rotated(q, {0, 1, 0}));
    }
}

TEST(GltfAnimation, RotationsOfNormalizedIntegersAndOfSplinesHaveLengthOne) {
    const std::vector<std::int16_t> shorts = {0, 0, 0, 32767, 0, 0, 23170, 23170, 0, 0, 32767, 0};
    GltfBuilder builder = triangle_file();
    builder.add_animation(0, "rotation", kTimes, builder.add_accessor(shorts, "VEC4", true));
    const std::vector<vec3> p = OpenedGltf(builder.gltf()).at(24);
    expect_point(p[1], 0, 1, 0);
    std::vector<float> spline;
    for (const auto& q : {std::array<float, 4>{0, 0, 0, 1}, {0, 0, 1, 1}, {0, 1, 0, 1}}) {
        spline.insert(spline.end(), {0, 0, 1, 0});
        spline.insert(spline.end(), q.begin(), q.end());
        spline.insert(spline.end(), {0, 1, 0, 0});
    }
    const OpenedGltf curve(moved_triangle("rotation", spline, "VEC4", "CUBICSPLINE").gltf());
    for (int frame = 0; frame <= 48; ++frame) {
        const vec3 x = curve.at(frame)[1];
        EXPECT_NEAR(std::hypot(static_cast<double>(x.x), static_cast<double>(x.y),
                               static_cast<double>(x.z)),
                    1, 1e-6);
    }
}

TEST(GltfAnimation, IsChosenByNameOrIndex) {
    GltfBuilder builder = triangle_file();
    for (const float x : {1.0f, 2.0f, 3.0f}) {
        const int values = builder.add_accessor<float>({0, 0, 0, x, 0, 0}, "VEC3");
        builder.add_animation(0, "translation", {0, x}, values);
    }
    builder.json["animations"][0]["name"] = "walk";
    builder.json["animations"][1]["name"] = "run";
    builder.json["animations"][2]["name"] = "1";
    const auto seconds = [&](const std::string& animation) {
        return OpenedGltf(builder.gltf(), {.animation = animation}).animation().last_frame() / 24;
    };
    EXPECT_EQ(seconds(""), 1);
    EXPECT_EQ(seconds("run"), 2);
    EXPECT_EQ(seconds("2"), 3);
    // A name comes before an index.
    EXPECT_EQ(seconds("1"), 3);
    EXPECT_EQ(
        gltf_error(builder.gltf(), {.animation = "jump"}),
        "animation 'jump': scene.gltf has no such one; choose one of 0 'walk', 1 'run', 2 '1'");
    EXPECT_EQ(gltf_error(triangle_file().gltf(), {.animation = "jump"}),
              "animation 'jump': scene.gltf has no animations");
    EXPECT_EQ(OpenedGltf(builder.gltf(), {.fps = 30}).animation().last_frame(), 30);
}

/// Two morph targets, the second of them sparse, with weights that move.
GltfBuilder morphed() {
    GltfBuilder builder;
    const int base = builder.add_accessor<float>({0, 0, 0, 1, 0, 0, 0, 1, 0}, "VEC3");
    const int dense = builder.add_accessor<float>({0, 0, 1, 0, 0, 2, 0, 0, 3}, "VEC3");
    const int indices = builder.add_view<std::uint8_t>({2});
    const int deltas = builder.add_view<float>({10, 20, 30});
    const int sparse =
        builder.add("accessors", {{"componentType", 5126},
                                  {"count", 3},
                                  {"type", "VEC3"},
                                  {"sparse",
                                   {{"count", 1},
                                    {"indices", {{"bufferView", indices}, {"componentType", 5121}}},
                                    {"values", {{"bufferView", deltas}}}}}});
    const Json targets = Json::array({{{"POSITION", dense}}, {{"POSITION", sparse}}});
    const int mesh = builder.add_mesh({{"POSITION", base}}, {{"targets", targets}});
    builder.json["meshes"][0]["weights"] = {0.5, 0};
    builder.add("nodes", {{"mesh", mesh}});
    return builder;
}

TEST(GltfMorphTargets, WeightsOfMeshNodeAndAnimation) {
    GltfBuilder builder = morphed();
    EXPECT_EQ(OpenedGltf(builder.gltf()).at(0)[2], vec3(0, 1, 1.5f));
    builder.json["nodes"][0]["weights"] = {0, 0.25};
    EXPECT_EQ(OpenedGltf(builder.gltf()).at(0)[2], vec3(2.5f, 6, 7.5f));
    EXPECT_EQ(OpenedGltf(builder.gltf()).at(0)[1], vec3(1, 0, 0));
    const int weights = builder.add_accessor<float>({0, 0, 1, 0, 1, 1}, "SCALAR");
    builder.add_animation(0, "weights", kTimes, weights);
    const OpenedGltf scene(builder.gltf());
    EXPECT_EQ(scene.at(0)[2], vec3(0, 1, 0));
    EXPECT_EQ(scene.at(18)[1], vec3(1, 0, 1));
    EXPECT_EQ(scene.at(36)[2], vec3(5, 11, 18));
    EXPECT_EQ(scene.at(48)[2], vec3(10, 21, 33));
}

/// A row of vertices along x, bent by a chain of joints that turn.
class SkinnedRow {
public:
    static constexpr int kVertices = 40;
    static constexpr std::size_t kJoints = 3;

    explicit SkinnedRow(int sets) : sets_(sets) {
        std::mt19937 random(static_cast<unsigned>(sets));
        std::uniform_real_distribution<float> any(0, 1);
        for (int i = 0; i < kVertices; ++i) {
            positions_.insert(positions_.end(),
                              {static_cast<float>(i) / 10, any(random), any(random)});
            for (int k = 0; k < 4 * sets; ++k) {
                weights_.push_back(k % 3 == 2 ? 0 : any(random));
                joints_.push_back(static_cast<std::uint8_t>(random() % kJoints));
            }
        }
        write();
    }

    std::string gltf() const { return builder_.gltf(); }

    /// The place of a vertex at a time, in [0, 1] seconds.
    Point3 place(int vertex, Real time) const {
        Point3 sum = {0, 0, 0};
        Real total = 0;
        const auto first = static_cast<std::size_t>(vertex);
        for (std::size_t k = 0; k < static_cast<std::size_t>(4 * sets_); ++k) {
            const std::size_t joint = joints_[first * static_cast<std::size_t>(4 * sets_) + k];
            const Real weight = weights_[first * static_cast<std::size_t>(4 * sets_) + k];
            Point3 p = {positions_[3 * first] - static_cast<Real>(joint), positions_[3 * first + 1],
                        positions_[3 * first + 2]};
            // From the joint up to the root.
            for (std::size_t up = joint + 1; up-- > 0;) {
                const Quaternion q = exact_slerp({0, 0, 0, 1}, as_float(turns()[up]), time);
                p = placed({{up == 0 ? 0.0L : 1.0L, 0, 0}, q, {1, 1, 1}}, p);
            }
            for (std::size_t axis = 0; axis < 3; ++axis) sum[axis] += weight * p[axis];
            total += weight;
        }
        for (Real& x : sum) x /= total;
        return sum;
    }

private:
    static const std::array<Quaternion, kJoints>& turns() {
        static const std::array<Quaternion, kJoints> turns = {
            turn({0, 0, 1}, 0.7L), turn({0, 1, 1}, 1.9L), turn({1, 1, 0}, -2.5L)};
        return turns;
    }
    /// As the file has it.
    static Quaternion as_float(const Quaternion& q) {
        Quaternion rounded = {};
        for (std::size_t k = 0; k < 4; ++k) rounded[k] = static_cast<float>(q[k]);
        return unit(rounded);
    }

    void write() {
        Json attributes = {{"POSITION", builder_.add_accessor(positions_, "VEC3")}};
        for (int set = 0; set < sets_; ++set) {
            std::vector<std::uint8_t> joints;
            std::vector<float> weights;
            for (int i = 0; i < kVertices; ++i) {
                for (int k = 0; k < 4; ++k) {
                    const auto at = static_cast<std::size_t>(4 * sets_ * i + 4 * set + k);
                    joints.push_back(joints_[at]);
                    weights.push_back(weights_[at]);
                }
            }
            attributes["JOINTS_" + std::to_string(set)] = builder_.add_accessor(joints, "VEC4");
            attributes["WEIGHTS_" + std::to_string(set)] = builder_.add_accessor(weights, "VEC4");
        }
        const int mesh = builder_.add_mesh(attributes, {{"mode", 5}});
        std::vector<float> inverse_binds;
        for (std::size_t joint = 0; joint < kJoints; ++joint) {
            inverse_binds.insert(inverse_binds.end(), {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0,
                                                       -static_cast<float>(joint), 0, 0, 1});
        }
        const int matrices = builder_.add_accessor(inverse_binds, "MAT4");
        builder_.json["skins"] =
            Json::array({{{"joints", {1, 2, 3}}, {"inverseBindMatrices", matrices}}});
        // The transformation of the node itself has no effect on a skinned mesh.
        builder_.add("nodes", {{"mesh", mesh}, {"skin", 0}, {"translation", {100, 0, 0}}});
        builder_.add("nodes", {{"children", {2}}});
        builder_.add("nodes", {{"children", {3}}, {"translation", {1, 0, 0}}});
        builder_.add("nodes", {{"translation", {1, 0, 0}}});
        add_turns();
    }

    void add_turns() {
        Json samplers = Json::array();
        Json channels = Json::array();
        const int times = builder_.add_accessor<float>({0, 1}, "SCALAR");
        for (std::size_t joint = 0; joint < kJoints; ++joint) {
            std::vector<float> values = {0, 0, 0, 1};
            for (const Real component : turns()[joint])
                values.push_back(static_cast<float>(component));
            samplers.push_back(
                {{"input", times}, {"output", builder_.add_accessor(values, "VEC4")}});
            channels.push_back(
                {{"sampler", joint}, {"target", {{"node", joint + 1}, {"path", "rotation"}}}});
        }
        builder_.add("animations", {{"samplers", samplers}, {"channels", channels}});
    }

    int sets_;
    std::vector<float> positions_;
    std::vector<float> weights_;
    std::vector<std::uint8_t> joints_;
    GltfBuilder builder_;
};

TEST(GltfSkins, VerticesFollowTheirJointsByNormalizedWeights) {
    for (const int sets : {1, 2, 3}) {
        const SkinnedRow row(sets);
        const OpenedGltf scene(row.gltf());
        for (const double frame : {0.0, 5.5, 12.0, 23.0, 24.0}) {
            const std::vector<vec3> p = scene.at(frame);
            for (int i = 0; i < SkinnedRow::kVertices; ++i)
                expect_near(p[static_cast<std::size_t>(i)],
                            row.place(i, static_cast<Real>(frame) / 24), 2e-6);
        }
    }
}

TEST(GltfSkins, TheBindPoseIsTheMeshBitForBit) {
    GltfBuilder builder;
    const std::vector<float> positions = {0.1f, 0.2f, 0.3f, 1e-7f, 5, 6, 7, 8, 9.1f};
    const int mesh = builder.add_mesh(
        {{"POSITION", builder.add_accessor(positions, "VEC3")},
         {"JOINTS_0",
          builder.add_accessor<std::uint8_t>({0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}, "VEC4")},
         {"WEIGHTS_0", builder.add_accessor<std::uint8_t>({255, 0, 0, 0, 100, 0, 0, 0, 1, 0, 0, 0},
                                                          "VEC4", true)}});
    builder.json["skins"] = Json::array({{{"joints", {1}}}});
    builder.add("nodes", {{"mesh", mesh}, {"skin", 0}});
    builder.add("nodes", Json::object());
    const std::vector<vec3> p = OpenedGltf(builder.gltf()).at(0);
    for (std::size_t i = 0; i < 3; ++i)
        EXPECT_EQ(p[i], vec3(positions[3 * i], positions[3 * i + 1], positions[3 * i + 2]));
}

TEST(GltfAnimation, BitsDoNotDependOnThreads) {
    const OpenedGltf scene(SkinnedRow(2).gltf());
    const std::vector<vec3> expected = scene.at(7.25);
    for (const std::size_t threads : {1u, 2u, 5u}) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        EXPECT_EQ(scene.at(7.25), expected);
    }
}

TEST(GltfAnimation, BoundsAreThoseOfTheFirstFrame) {
    const std::vector<float> jump = {2, 0, 0, 100, 0, 0, 5, -7, 0};
    const OpenedGltf scene(moved_triangle("translation", jump, "VEC3", "STEP").gltf());
    const WorldBounds first = bounds_of(scene.at(0));
    for (int axis = 0; axis < 3; ++axis) {
        EXPECT_EQ(scene.animation().bounds().lower[axis], first.lower[axis]);
        EXPECT_EQ(scene.animation().bounds().upper[axis], first.upper[axis]);
    }
}

TEST(GltfAnimation, SpeaksOfTheFrameWhoseVerticesAreTooFar) {
    const std::vector<float> values = {0, 0, 0, 0, 0, 0, 2e30f, 0, 0};
    const std::string file = moved_triangle("translation", values, "VEC3", "LINEAR").gltf();
    const OpenedGltf strict(file);
    EXPECT_EQ(strict.at(0)[0].x, 0.0f);
    EXPECT_TRUE(message_of([&] { strict.at(48); })
                    .ends_with("scene.gltf: frame 48: vertex 0 has a coordinate that is not finite "
                               "or beyond 1e30; repair it"));
    const OpenedGltf lenient(file, {.lenient = true});
    EXPECT_EQ(lenient.at(48)[0].x, 2e30f);
    const std::vector<float> first = {2e30f, 0, 0, 0, 0, 0, 0, 0, 0};
    const std::string bad = moved_triangle("translation", first, "VEC3", "LINEAR").gltf();
    EXPECT_EQ(gltf_error(bad),
              "scene.gltf: frame 0: vertex 0 has a coordinate that is not finite or beyond 1e30; "
              "repair it");
    const OpenedGltf warned(bad, {.lenient = true});
    ASSERT_EQ(warned.warnings().size(), 1u);
    EXPECT_TRUE(warned.warnings()[0].ends_with(
        "scene.gltf: warning: frame 0: vertex 0 has a coordinate that is not finite or beyond "
        "1e30; kept as it is"));
}

}  // namespace
}  // namespace mray
