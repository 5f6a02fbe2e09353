// Animations, skins and morph targets of glTF files, compared with long double.
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstring>
#include <random>
#include <vector>

#include "scenes/gltf/gltf_animation.h"
#include "scenes/gltf/pose.h"
#include "scenes/gltf/transforms.h"
#include "tests/scenes/gltf/gltf_builder.h"
#include "tests/scenes/gltf/opened_gltf.h"

namespace mray {
namespace {

using namespace test;
using namespace gltf;

// Transformations in long double, as the specification writes them, to compare with.

using Real = long double;
using Point3 = std::array<Real, 3>;
using Quaternion = std::array<Real, 4>;  // x, y, z, w

Real dot(const Quaternion& a, const Quaternion& b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
}

Quaternion unit(const Quaternion& q) {
    const Real length = std::sqrt(dot(q, q));
    return {q[0] / length, q[1] / length, q[2] / length, q[3] / length};
}

/// A turn by an angle about an axis, which needs no length of 1.
Quaternion turn(const Point3& axis, Real angle) {
    const Real length = std::sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]);
    const Real s = std::sin(angle / 2) / length;
    return {axis[0] * s, axis[1] * s, axis[2] * s, std::cos(angle / 2)};
}

/// Spherical interpolation by an angle and sines (glTF 2.0, appendix C.4). An arc cosine would lose
/// the angle of quaternions that are close together.
Quaternion exact_slerp(const Quaternion& a, const Quaternion& b, Real u) {
    const Real d = dot(a, b);
    const Real sign = d < 0 ? -1 : 1;
    Quaternion sum = {};
    Quaternion difference = {};
    for (std::size_t k = 0; k < 4; ++k) {
        sum[k] = a[k] + sign * b[k];
        difference[k] = a[k] - sign * b[k];
    }
    const Real angle =
        2 * std::atan2(std::sqrt(dot(difference, difference)), std::sqrt(dot(sum, sum)));
    if (angle == 0) return a;
    const Real from = std::sin((1 - u) * angle) / std::sin(angle);
    const Real to = sign * std::sin(u * angle) / std::sin(angle);
    Quaternion result = {};
    for (std::size_t k = 0; k < 4; ++k) result[k] = from * a[k] + to * b[k];
    return result;
}

/// q * p * q^-1 for a quaternion of length 1: p + 2 w (v x p) + 2 v x (v x p).
Point3 rotated(const Quaternion& q, const Point3& p) {
    const auto cross = [](const Point3& a, const Point3& b) {
        return Point3{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
                      a[0] * b[1] - a[1] * b[0]};
    };
    const Point3 v = {q[0], q[1], q[2]};
    const Point3 once = cross(v, p);
    const Point3 twice = cross(v, once);
    Point3 result = {};
    for (std::size_t k = 0; k < 3; ++k) result[k] = p[k] + 2 * q[3] * once[k] + 2 * twice[k];
    return result;
}

glm::dvec4 in_double(const Quaternion& q) {
    return {static_cast<double>(q[0]), static_cast<double>(q[1]), static_cast<double>(q[2]),
            static_cast<double>(q[3])};
}
Quaternion exact(const glm::dvec4& q) { return {q.x, q.y, q.z, q.w}; }

Real distance(const glm::dvec4& a, const Quaternion& b) {
    Real largest = 0;
    for (int k = 0; k < 4; ++k)
        largest =
            std::max(largest, std::fabs(static_cast<Real>(a[k]) - b[static_cast<std::size_t>(k)]));
    return largest;
}

TEST(Slerp, IsThatOfSines) {
    std::mt19937_64 random(1);
    std::normal_distribution<long double> component;
    std::uniform_real_distribution<double> share(0, 1);
    Real worst = 0;
    for (int i = 0; i < 200000; ++i) {
        const Quaternion a =
            unit({component(random), component(random), component(random), component(random)});
        Quaternion b =
            unit({component(random), component(random), component(random), component(random)});
        // A part of the pairs is close together, or almost a half turn apart.
        const Real closeness = std::pow(Real{10}, -static_cast<Real>(i % 17));
        if (i % 2 == 0) {
            for (std::size_t k = 0; k < 4; ++k) b[k] = a[k] + closeness * b[k];
            b = unit(b);
        }
        const glm::dvec4 from = unit_quaternion(in_double(a));
        const glm::dvec4 to = unit_quaternion(in_double(b));
        const double u = i % 5 == 0 ? 0.5 : share(random);
        const Quaternion expected = unit(exact_slerp(unit(exact(from)), unit(exact(to)), u));
        worst = std::max(worst, distance(slerp(from, to, u), expected));
    }
    EXPECT_LT(worst, 1e-15L);
}

TEST(Slerp, KeepsItsEndsTakesTheShorterArcAndIsSymmetricHalfway) {
    const glm::dvec4 a = unit_quaternion({1, 2, 3, 4});
    const glm::dvec4 b = unit_quaternion({4, -3, 2, 1});
    EXPECT_EQ(slerp(a, b, 0), a);
    EXPECT_EQ(slerp(a, b, 1), b);
    // The same rotation, written with the other sign.
    EXPECT_LT(distance(slerp(a, -a, 0.5), exact(a)), 1e-15L);
    const glm::dvec4 middle = slerp({0, 0, 0, 1}, {0, 0, 1, 0}, 0.5);
    EXPECT_EQ(middle.z, middle.w);
}

TEST(UnitQuaternion, OfNoDirectionIsTheIdentity) {
    EXPECT_EQ(unit_quaternion({0, 0, 0, 0}), glm::dvec4(0, 0, 0, 1));
    const double nan = std::nan("");
    EXPECT_EQ(unit_quaternion({nan, 0, 0, 1}), glm::dvec4(0, 0, 0, 1));
}

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
    EXPECT_EQ(step.animation->last_frame(), 48);
    EXPECT_EQ(step.animation->fps(), 24);
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
        return OpenedGltf(builder.gltf(), {.animation = animation}).animation->last_frame() / 24;
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
    EXPECT_EQ(OpenedGltf(builder.gltf(), {.fps = 30}).animation->last_frame(), 30);
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

/// A row of vertices along x, bent by a chain of joints that turn in a second.
class SkinnedRow {
public:
    static constexpr std::size_t kVertices = 40;
    static constexpr std::size_t kJoints = 3;

    explicit SkinnedRow(std::size_t sets) : weights_(sets), joints_(sets) {
        std::mt19937 random(static_cast<unsigned>(sets));
        std::uniform_real_distribution<float> any(0, 1);
        for (std::size_t i = 0; i < kVertices; ++i) {
            positions_.insert(positions_.end(),
                              {static_cast<float>(i) / 10, any(random), any(random)});
            for (std::size_t k = 0; k < 4 * sets; ++k) {
                weights_[k / 4].push_back(k % 3 == 2 ? 0 : any(random));
                joints_[k / 4].push_back(static_cast<std::uint8_t>(random() % kJoints));
            }
        }
    }

    /// The place of a vertex at a time, in [0, 1] seconds.
    Point3 place(std::size_t vertex, Real time) const {
        Point3 sum = {0, 0, 0};
        Real total = 0;
        for (std::size_t k = 0; k < 4 * joints_.size(); ++k) {
            const std::size_t joint = joints_[k / 4][4 * vertex + k % 4];
            const Real weight = weights_[k / 4][4 * vertex + k % 4];
            Point3 p = {positions_[3 * vertex] - static_cast<Real>(joint),
                        positions_[3 * vertex + 1], positions_[3 * vertex + 2]};
            // From the joint up to the root.
            for (std::size_t up = joint + 1; up-- > 0;) {
                p = rotated(exact_slerp({0, 0, 0, 1}, as_float(kTurns[up]), time), p);
                p[0] += up == 0 ? 0 : 1;
            }
            for (std::size_t axis = 0; axis < 3; ++axis) sum[axis] += weight * p[axis];
            total += weight;
        }
        for (Real& x : sum) x /= total;
        return sum;
    }

    std::string gltf() const {
        GltfBuilder builder;
        Json attributes = {{"POSITION", builder.add_accessor(positions_, "VEC3")}};
        for (std::size_t set = 0; set < joints_.size(); ++set) {
            attributes["JOINTS_" + std::to_string(set)] =
                builder.add_accessor(joints_[set], "VEC4");
            attributes["WEIGHTS_" + std::to_string(set)] =
                builder.add_accessor(weights_[set], "VEC4");
        }
        const int mesh = builder.add_mesh(attributes, {{"mode", 5}});
        std::vector<float> inverse_binds;
        Json samplers = Json::array();
        Json channels = Json::array();
        const int times = builder.add_accessor<float>({0, 1}, "SCALAR");
        for (std::size_t joint = 0; joint < kJoints; ++joint) {
            inverse_binds.insert(inverse_binds.end(), {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0,
                                                       -static_cast<float>(joint), 0, 0, 1});
            std::vector<float> values = {0, 0, 0, 1};
            for (const Real component : kTurns[joint])
                values.push_back(static_cast<float>(component));
            samplers.push_back(
                {{"input", times}, {"output", builder.add_accessor(values, "VEC4")}});
            channels.push_back(
                {{"sampler", joint}, {"target", {{"node", joint + 1}, {"path", "rotation"}}}});
        }
        builder.json["skins"] = {
            {{"joints", {1, 2, 3}},
             {"inverseBindMatrices", builder.add_accessor(inverse_binds, "MAT4")}}};
        builder.add("animations", {{"samplers", samplers}, {"channels", channels}});
        // The transformation of the node itself has no effect on a skinned mesh.
        builder.add("nodes", {{"mesh", mesh}, {"skin", 0}, {"translation", {100, 0, 0}}});
        builder.add("nodes", {{"children", {2}}});
        builder.add("nodes", {{"children", {3}}, {"translation", {1, 0, 0}}});
        builder.add("nodes", {{"translation", {1, 0, 0}}});
        return builder.gltf();
    }

private:
    inline static const Quaternion kTurns[kJoints] = {turn({0, 0, 1}, 0.7L), turn({0, 1, 1}, 1.9L),
                                                      turn({1, 1, 0}, -2.5L)};
    /// As the file has it.
    static Quaternion as_float(const Quaternion& q) {
        Quaternion rounded = {};
        for (std::size_t k = 0; k < 4; ++k) rounded[k] = static_cast<float>(q[k]);
        return unit(rounded);
    }

    std::vector<float> positions_;
    // Of each set.
    std::vector<std::vector<float>> weights_;
    std::vector<std::vector<std::uint8_t>> joints_;
};

TEST(GltfSkins, VerticesFollowTheirJointsByNormalizedWeights) {
    for (const std::size_t sets : {1u, 2u, 3u}) {
        const SkinnedRow row(sets);
        const OpenedGltf scene(row.gltf());
        for (const double frame : {0.0, 5.5, 12.0, 23.0, 24.0}) {
            const std::vector<vec3> p = scene.at(frame);
            for (std::size_t i = 0; i < SkinnedRow::kVertices; ++i)
                expect_near(p[i], row.place(i, static_cast<Real>(frame) / 24), 2e-6);
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
        EXPECT_EQ(scene.animation->bounds().lower[axis], first.lower[axis]);
        EXPECT_EQ(scene.animation->bounds().upper[axis], first.upper[axis]);
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
    const OpenedGltf warned(bad, {.lenient = true});
    ASSERT_EQ(warned.warnings.size(), 1u);
    EXPECT_TRUE(warned.warnings[0].ends_with(
        "scene.gltf: warning: frame 0: vertex 0 has a coordinate that is not finite or beyond "
        "1e30; kept as it is"));
}

constexpr std::size_t kPerVertex = 5;
constexpr std::uint32_t kJoints = 7;

/// Vertices of one skin, whose joints turn and scale, and of which some weights are 0.
GltfScene skinned_scene(std::size_t vertex_count) {
    std::mt19937 random(3);
    std::uniform_real_distribution<float> any(-1, 1);
    GltfScene scene;
    VertexSet& set = scene.meshes[0].sets.emplace_back();
    set.influences.per_vertex = kPerVertex;
    for (std::size_t i = 0; i < vertex_count; ++i) {
        set.positions.emplace_back(any(random), any(random), any(random));
        for (std::size_t k = 0; k < kPerVertex; ++k) {
            set.influences.joints.push_back(static_cast<std::uint16_t>(random() % kJoints));
            const float weight = any(random);
            set.influences.weights.push_back(k == 0 || weight > 0 ? std::abs(weight) : 0.0f);
        }
    }
    Skin& skin = scene.skins[0];
    skin.inverse_binds.resize(kJoints);
    for (std::uint32_t joint = 0; joint <= kJoints; ++joint) {
        Node& node = scene.tree.nodes.emplace_back();
        node.trs.translation = {any(random), any(random), any(random)};
        node.trs.scale = {any(random), 2, any(random)};
        scene.tree.parents_first.push_back(joint);
        if (joint < kJoints) skin.joints.push_back(joint);
    }
    scene.tree.nodes.back().mesh = 0;
    scene.placed_sets.push_back({kJoints, &set, 0u, 0});
    scene.topology.vertex_count = static_cast<std::uint32_t>(vertex_count);
    return scene;
}

TEST(Skinning, HasTheSameBitsOnEveryTarget) {
    constexpr std::size_t kVertices = 2500;
    const GltfScene scene = skinned_scene(kVertices);
    const Pose pose = pose_at(scene, 0);
    const auto placed = [&](const SimdTarget& target) {
        std::vector<vec3> out(kVertices);
        EXPECT_TRUE(Skinning(scene, target).place(pose, out));
        return out;
    };
    const std::vector<vec3> expected = placed(find_simd_target("scalar"));
    for (const SimdTarget& target : supported_simd_targets()) {
        SCOPED_TRACE(target.name);
        const std::vector<vec3> out = placed(target);
        EXPECT_EQ(std::memcmp(out.data(), expected.data(), kVertices * sizeof(vec3)), 0);
    }
}

TEST(Skinning, TellsWhetherAVertexIsTooFar) {
    GltfScene scene = skinned_scene(2500);
    VertexSet& set = scene.meshes[0].sets[0];
    for (const std::size_t vertex : {2047u, 1030u}) set.positions[vertex].y = 1e38f;
    std::vector<vec3> out(2500);
    const Skinning skinning(scene);
    for (Node& node : scene.tree.nodes) node.trs.scale = {4, 4, 4};
    EXPECT_FALSE(skinning.place(pose_at(scene, 0), out));
    EXPECT_TRUE(has(MeshRules::check_frame("a", 0, out, true).value().text, "vertex 1030 has"));
}

}  // namespace
}  // namespace mray
