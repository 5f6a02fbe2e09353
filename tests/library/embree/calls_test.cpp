// Random sequences of calls, compared with a model: a scene of the public library, which brute
// force answers, of what was attached and enabled when the scene was committed last.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "morphray/morphray.hpp"
#include "tests/library/embree/embree_api.h"
#include "tests/support/random.h"

namespace mray {
namespace {

using namespace embree_test;
using Dice = test::Random;

constexpr float kFar = 2e18f;

/// A geometry of triangles or quads in buffers of the Embree API.
struct Mesh {
    RTCGeometry geometry = nullptr;
    bool is_quads = false;
    bool is_enabled = true;
    /// That of a new geometry.
    unsigned int mask = MORPHRAY_EMBREE == 3 ? kInvalid : 1;
    std::vector<Point> vertices;
    /// Three or four numbers a primitive.
    std::vector<unsigned int> indices;
    Point* buffer = nullptr;

    std::size_t corners() const { return is_quads ? 4 : 3; }
};

Point draw_point(Dice& dice) {
    const test::dvec3 p = dice.one_in(2) ? dice.grid_point() : dice.exact_point(1);
    return {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)};
}

/// The library's scene of the meshes, which ascend by their IDs.
struct Model {
    struct TracedMesh {
        unsigned int geom_id;
        bool is_quads;
        unsigned int mask;
        std::vector<Point> vertices;
        std::vector<std::uint32_t> triangles;
    };
    std::vector<TracedMesh> traced;
    bool is_robust = false;
    std::optional<morphray::Scene> scene;

    void commit(const std::map<unsigned int, Mesh>& meshes, bool robust) {
        is_robust = robust;
        traced.clear();
        for (const auto& [id, mesh] : meshes) {
            if (!mesh.is_enabled) continue;
            TracedMesh part{id, mesh.is_quads, mesh.mask, mesh.vertices, {}};
            const std::size_t count = mesh.vertices.size();
            // No primitive has a vertex so far away.
            for (Point& p : part.vertices)
                if (p[1] == kFar) p[1] = kNan;
            for (std::size_t i = 0; i < mesh.indices.size(); i += mesh.corners()) {
                const unsigned int* const c = &mesh.indices[i];
                const bool is_bad = std::any_of(c, c + mesh.corners(), [&](unsigned int k) {
                    return k >= count || (part.is_quads && std::isnan(part.vertices[k][1]));
                });
                const auto add = [&](unsigned int x, unsigned int y, unsigned int z) {
                    // A triangle without area has no hits.
                    part.triangles.insert(part.triangles.end(),
                                          {is_bad ? 0 : x, is_bad ? 0 : y, is_bad ? 0 : z});
                };
                if (mesh.is_quads) {
                    add(c[0], c[1], c[3]);
                    add(c[2], c[3], c[1]);
                } else {
                    add(c[0], c[1], c[2]);
                }
            }
            traced.push_back(std::move(part));
        }
        std::vector<morphray::MeshView> views;
        for (const TracedMesh& part : traced)
            views.push_back({morphray::packed(part.vertices), part.triangles});
        scene = morphray::Scene::build(views, morphray::Device::brute_force({.threads = 1}));
    }

    RTCRayHit trace(RTCRayHit ray) const {
        const RTCRay& r = ray.ray;
        const float tnear = std::max(r.tnear, 0.0f);
        if (!(r.tnear <= r.tfar)) return ray;
        const morphray::Ray asked{
            {r.org_x, r.org_y, r.org_z}, tnear, {r.dir_x, r.dir_y, r.dir_z}, r.tfar};
        for (morphray::Hit hit = scene->intersect(asked); hit; hit = scene->intersect(asked, hit)) {
            const TracedMesh& part = traced[hit.geom_id];
            if ((part.mask & r.mask) == 0 || !(is_robust || hit.t > tnear)) continue;
            const bool is_second = part.is_quads && hit.prim_id % 2 == 1;
            ray.ray.tfar = hit.t;
            ray.hit.u = is_second ? 1 - hit.u : hit.u;
            ray.hit.v = is_second ? 1 - hit.v : hit.v;
            ray.hit.primID = part.is_quads ? hit.prim_id / 2 : hit.prim_id;
            ray.hit.geomID = part.geom_id;
            break;
        }
        return ray;
    }
};

/// A scene of the Embree API and the model beside it.
class Play {
public:
    explicit Play(std::uint64_t seed) : dice_(seed), has_masks_(dice_.one_in(3)) {
        // They hold the bounds, and so the last bits of all hits, where they are.
        Mesh& frame = meshes_[0];
        frame.vertices = {{-4, -4, -4}, {-3.75f, -4, -4}, {-4, -3.75f, -4},
                          {4, 4, 4},    {3.75f, 4, 4},    {4, 3.75f, 4}};
        frame.indices = {0, 1, 2, 3, 4, 5};
        frame.mask = kInvalid;
        attach(0, frame);
        if (has_masks_) rtcSetGeometryMask(frame.geometry, kInvalid);
        const int steps = dice_.from(4, 20);
        for (int i = 0; i < steps && !testing::Test::HasFailure(); ++i) step();
        EXPECT_EQ(device_.error(), RTC_ERROR_NONE);
    }
    ~Play() { rtcReleaseScene(scene_); }
    Play(const Play&) = delete;

private:
    void attach(unsigned int id, Mesh& mesh) {
        mesh.geometry = device_.mesh(mesh.corners(), mesh.vertices, mesh.indices.data(),
                                     mesh.indices.size() / mesh.corners());
        mesh.buffer =
            static_cast<Point*>(rtcGetGeometryBufferData(mesh.geometry, RTC_BUFFER_TYPE_VERTEX, 0));
        rtcCommitGeometry(mesh.geometry);
        rtcAttachGeometryByID(scene_, mesh.geometry, id);
        rtcReleaseGeometry(mesh.geometry);
    }

    void add_mesh() {
        const unsigned int id = dice_.one_in(8) ? 1000 : 1 + dice_.below(5);
        if (meshes_.count(id) != 0) return;
        Mesh& mesh = meshes_[id];
        mesh.is_quads = dice_.one_in(3);
        const std::uint32_t count = 4 + dice_.below(20);
        for (std::uint32_t i = 0; i < count; ++i) mesh.vertices.push_back(draw_point(dice_));
        const std::size_t corners = mesh.corners() * (1 + dice_.below(24));
        for (std::size_t i = 0; i < corners; ++i) mesh.indices.push_back(dice_.below(count));
        if (dice_.one_in(8)) mesh.indices.back() = count + dice_.below(3);
        attach(id, mesh);
    }

    void move(Mesh& mesh) {
        for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
            if (dice_.one_in(2)) mesh.vertices[i] = draw_point(dice_);
            if (dice_.one_in(64)) mesh.vertices[i][1] = dice_.one_in(2) ? kNan : kFar;
        }
        std::copy(mesh.vertices.begin(), mesh.vertices.end(), mesh.buffer);
        constexpr std::array kQualities = {RTC_BUILD_QUALITY_REFIT, RTC_BUILD_QUALITY_LOW,
                                           RTC_BUILD_QUALITY_MEDIUM};
        rtcSetGeometryBuildQuality(mesh.geometry, dice_.pick(kQualities));
        rtcUpdateGeometryBuffer(mesh.geometry, RTC_BUFFER_TYPE_VERTEX, 0);
        rtcCommitGeometry(mesh.geometry);
    }

    void step() {
        auto chosen = meshes_.begin();
        std::advance(chosen, dice_.below(static_cast<std::uint32_t>(meshes_.size())));
        Mesh& mesh = chosen->second;
        const bool is_frame = chosen->first == 0;
        switch (dice_.below(9)) {
            case 0:
            case 1:
                add_mesh();
                break;
            case 2:
                if (is_frame) break;
                rtcDetachGeometry(scene_, chosen->first);
                meshes_.erase(chosen);
                break;
            case 3:
                if (is_frame) break;
                mesh.is_enabled = !mesh.is_enabled;
                (mesh.is_enabled ? rtcEnableGeometry : rtcDisableGeometry)(mesh.geometry);
                rtcCommitGeometry(mesh.geometry);
                break;
            case 4:
                if (!has_masks_) break;
                mesh.mask = 1 + dice_.below(3);
                rtcSetGeometryMask(mesh.geometry, mesh.mask);
                rtcCommitGeometry(mesh.geometry);
                break;
            case 5:
                set_flags();
                break;
            case 6:
                renew();
                break;
            default:
                if (!is_frame) move(mesh);
        }
        if (dice_.one_in(2)) ask();
    }

    void set_flags() {
        int flags = RTC_SCENE_FLAG_NONE;
        if (dice_.one_in(2)) flags |= RTC_SCENE_FLAG_ROBUST;
        if (dice_.one_in(2)) flags |= RTC_SCENE_FLAG_DYNAMIC;
        rtcSetSceneFlags(scene_, static_cast<RTCSceneFlags>(flags));
    }

    /// Replaces the scene and its geometries by new ones, some of which have moved.
    void renew() {
        const RTCSceneFlags flags = rtcGetSceneFlags(scene_);
        rtcReleaseScene(scene_);
        scene_ = rtcNewScene(device_.handle);
        rtcSetSceneFlags(scene_, flags);
        for (auto& [id, mesh] : meshes_) {
            attach(id, mesh);
            if (!mesh.is_enabled) rtcDisableGeometry(mesh.geometry);
            if (has_masks_) rtcSetGeometryMask(mesh.geometry, mesh.mask);
            rtcCommitGeometry(mesh.geometry);
            if (id != 0 && dice_.one_in(2)) move(mesh);
        }
    }

    RTCRayHit draw_ray() {
        Point org = draw_point(dice_);
        for (float& x : org) x *= 2;
        const Point target = draw_point(dice_);
        Point dir = {target[0] - org[0], target[1] - org[1], target[2] - org[2]};
        if (dice_.one_in(6)) dir = {0, 0, dice_.one_in(2) ? 1.0f : -2.0f};
        if (dice_.one_in(40)) dir = {0, 0, 0};
        if (dice_.one_in(40)) org[dice_.below(3)] = kNan;
        RTCRayHit ray = make_ray(org, dir);
        if (dice_.one_in(6)) ray.ray.tnear = static_cast<float>(dice_.real(-1, 1));
        if (dice_.one_in(6)) ray.ray.tfar = static_cast<float>(dice_.real(-0.5, 2));
        if (has_masks_) ray.ray.mask = dice_.below(4);
        return ray;
    }

    void ask() {
        rtcCommitScene(scene_);
        model_.commit(meshes_, (rtcGetSceneFlags(scene_) & RTC_SCENE_FLAG_ROBUST) != 0);
        constexpr std::size_t kMostRays = 64;
        std::vector<RTCRayHit> rays(1 + dice_.below(40));
        for (RTCRayHit& ray : rays) ray = draw_ray();
        for (std::size_t i = 0; i < rays.size(); ++i) {
            const RTCRayHit expected = model_.trace(rays[i]);
            RTCRayHit asked = rays[i];
            if (!has_masks_) asked.ray.mask = dice_.below(4);
            const RTCRayHit found = trace(scene_, asked);
            const RTCHit& hit = found.hit;
            ASSERT_TRUE(hit.geomID == expected.hit.geomID && hit.primID == expected.hit.primID &&
                        same(found.ray.tfar, expected.ray.tfar) && same(hit.u, expected.hit.u) &&
                        same(hit.v, expected.hit.v))
                << "ray " << i << ": geometry " << hit.geomID << ", primitive " << hit.primID
                << ", t " << found.ray.tfar << "; expected geometry " << expected.hit.geomID
                << ", primitive " << expected.hit.primID << ", t " << expected.ray.tfar;
            ASSERT_EQ(is_occluded(scene_, asked), expected.hit.geomID != kInvalid);
            if (hit.geomID == kInvalid || rays.size() >= kMostRays) continue;
            // The same with an end of its interval at the hit.
            RTCRayHit again = rays[i];
            (dice_.one_in(2) ? again.ray.tnear : again.ray.tfar) = found.ray.tfar;
            rays.push_back(again);
        }
    }

    static bool same(float a, float b) { return std::memcmp(&a, &b, sizeof a) == 0; }

    Dice dice_;
    const bool has_masks_;
    const TestDevice device_;
    RTCScene scene_ = rtcNewScene(device_.handle);
    /// Those that are attached, by number.
    std::map<unsigned int, Mesh> meshes_;
    Model model_;
};

/// A number of the environment.
std::uint64_t setting(const char* name, std::uint64_t otherwise) {
    const char* const text = std::getenv(name);
    return text == nullptr ? otherwise : std::strtoull(text, nullptr, 10);
}

// MORPHRAY_EMBREE_CASES=N tries N cases, MORPHRAY_EMBREE_SEED=S from seed S on.
TEST(EmbreeCalls, AnswerAsTheModelDoes) {
    const std::uint64_t first = setting("MORPHRAY_EMBREE_SEED", 1);
    const std::uint64_t count = setting("MORPHRAY_EMBREE_CASES", 300);
    for (std::uint64_t seed = first; seed < first + count && !HasFailure(); ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        const Play play(seed);
    }
}

}  // namespace
}  // namespace mray
