// Memory ends in each call of the library: at one allocation, or at all from one on. The call
// throws limit, and the scene is as the documentation promises. This program has the allocator of
// the preloaded library in itself.
#include <gtest/gtest.h>

#include <array>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <functional>
#include <limits>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "tests/faults/fault.h"
#include "tests/library/scenes.h"
#include "tests/support/temporary_folder.h"

namespace mray::test {
namespace {

using morphray::Device;
using morphray::Error;
using morphray::ErrorCode;
using morphray::Scene;
using morphray::SceneOptions;

/// While it lives, one allocation fails, or all from that one on.
class Shortage {
public:
    Shortage(std::uint64_t at, bool lasts) {
        faults.at = faults.counts->calls[kAllocation] + at;
        faults.lasts = lasts;
        faults.error = ENOMEM;
        faults.kind = kAllocation;
    }
    ~Shortage() { faults.kind = -1; }
    Shortage(const Shortage&) = delete;

    static bool is_met() { return faults.counts->calls[kAllocation] > faults.at; }
};

// Enough that rays in any order are sorted.
constexpr std::size_t kRays = 9000;

/// Room for answers, made before memory ends.
struct Answers {
    std::vector<morphray::Ray> rays;
    std::vector<morphray::Vec3> points;
    std::vector<morphray::Hit> hits;
    std::vector<std::uint8_t> flags;
    std::vector<std::uint64_t> counts;
    std::vector<std::int32_t> windings;
    std::vector<float> distances;
    std::vector<morphray::ClosestPoint> closest;
    morphray::AllHits all;
    morphray::Image image;
    std::vector<morphray::Box> boxes;
    std::optional<Scene> copy;
    std::uint64_t number = 0;

    explicit Answers(const UserMesh& mesh) : rays(world_rays(mesh, kRays, 3)) {
        for (const morphray::Ray& ray : rays) points.push_back(ray.org);
        hits.resize(kRays);
        flags.resize(kRays);
        counts.resize(kRays);
        windings.resize(kRays);
        distances.resize(kRays);
        closest.resize(kRays);
    }

    /// All answers as bytes.
    std::string bytes() const {
        std::string result;
        const auto add = [&](const auto& values) {
            if (values.empty()) return;
            result.append(reinterpret_cast<const char*>(values.data()),
                          values.size() * sizeof(values[0]));
        };
        add(hits);
        add(flags);
        add(counts);
        add(windings);
        add(distances);
        add(closest);
        add(all.offsets);
        add(all.hits);
        add(boxes);
        add(std::array{image.hits_hash, image.image_hash, number});
        if (copy) add(hits_of(*copy, rays));
        return result;
    }
};

struct Question {
    const char* name;
    void (*ask)(const Scene&, Answers&);
};
void PrintTo(const Question& question, std::ostream* out) { *out << question.name; }

void render(const Scene& scene, Answers& a, const morphray::View& view) {
    scene.render(view, a.image);
}

const Question kQuestions[] = {
    {"Intersect", [](const Scene& s, Answers& a) { s.intersect(a.rays, a.hits); }},
    {"IntersectInTheCallingThread",
     [](const Scene& s, Answers& a) { s.intersect(a.rays, a.hits, morphray::Threads::calling); }},
    {"IntersectOne",
     [](const Scene& s, Answers& a) {
         for (std::size_t i = 0; i < 20; ++i) a.hits[i] = s.intersect(a.rays[i]);
     }},
    {"IntersectNext",
     [](const Scene& s, Answers& a) {
         for (std::size_t i = 0; i < 20; ++i)
             a.hits[i] = s.intersect(a.rays[i], {.t = -1, .prim_id = 0, .geom_id = 0});
     }},
    {"IntersectVisible",
     [](const Scene& s, Answers& a) {
         for (std::size_t i = 0; i < 20; ++i)
             a.hits[i] = s.intersect_visible(a.rays[i], std::array<std::uint8_t, 2>{0, 1});
     }},
    {"Occluded", [](const Scene& s, Answers& a) { s.occluded(a.rays, a.flags); }},
    {"OccludedOne",
     [](const Scene& s, Answers& a) {
         for (std::size_t i = 0; i < 20; ++i) a.flags[i] = s.occluded(a.rays[i]) ? 1 : 0;
     }},
    {"IntersectAll", [](const Scene& s, Answers& a) { a.all = s.intersect_all(a.rays); }},
    {"Count", [](const Scene& s, Answers& a) { s.count(a.rays, a.counts); }},
    {"Winding", [](const Scene& s, Answers& a) { s.winding(a.points, a.windings); }},
    {"Contains", [](const Scene& s, Answers& a) { s.contains(a.points, a.flags); }},
    {"ClosestPoints", [](const Scene& s, Answers& a) { s.closest_points(a.points, a.closest); }},
    {"SignedDistance",
     [](const Scene& s, Answers& a) { s.signed_distance(a.points, a.distances); }},
    {"RenderPlain",
     [](const Scene& s, Answers& a) {
         render(s, a, {.width = 40, .height = 30, .rays = morphray::Rays::ao, .ao_count = 2});
     }},
    {"RenderLit",
     [](const Scene& s, Answers& a) {
         render(s, a,
                {.width = 40,
                 .height = 30,
                 .rays = morphray::Rays::shadow,
                 .shading = morphray::Shading::lit,
                 .samples = 4,
                 .ao_count = 1});
     }},
    {"RenderSteps",
     [](const Scene& s, Answers& a) {
         render(s, a, {.width = 40, .height = 30, .shading = morphray::Shading::steps});
     }},
    {"TreeStatistics", [](const Scene& s, Answers& a) { a.number = s.tree_statistics().hash; }},
    {"TreeBoxes", [](const Scene& s, Answers& a) { a.boxes = s.tree_boxes(1); }},
    {"On", [](const Scene& s, Answers& a) { a.copy = s.on(s.device()); }},
    {"LastUpdate", [](const Scene& s,
                      Answers& a) { a.number = static_cast<std::uint64_t>(s.last_update().step); }},
    {"Compare",
     [](const Scene& s, Answers& a) { a.number = morphray::compare(s, s, a.rays).compared; }},
};

struct Outcome {
    std::optional<ErrorCode> error = {};
    /// Whether the allocation that fails was reached.
    bool is_met = false;
};

/// Calls `work` while memory is short.
Outcome call_short(const std::function<void()>& work, std::uint64_t at, bool lasts) {
    Outcome outcome;
    const Shortage shortage(at, lasts);
    try {
        work();
    } catch (const Error& error) {
        outcome.error = error.code();
    }
    outcome.is_met = Shortage::is_met();
    return outcome;
}

/// Calls `attempt` with memory that ends at each of the first allocations and at some of the later
/// ones, or at all with MORPHRAY_EVERY_FAULT, until one does not reach it. An attempt returns
/// whether it did.
void at_each_allocation(const std::function<bool(std::uint64_t at, bool lasts)>& attempt) {
    const bool every = std::getenv("MORPHRAY_EVERY_FAULT") != nullptr;
    for (const bool lasts : {false, true}) {
        std::uint64_t at = 0;
        for (; !::testing::Test::HasFailure(); at += every ? 1 : 1 + at / 16) {
            SCOPED_TRACE("allocation " + std::to_string(at) + (lasts ? " and all later ones" : ""));
            if (!attempt(at, lasts)) break;
        }
        ::testing::Test::RecordProperty("allocations", std::to_string(at));
    }
}

std::vector<Device> devices() { return {Device::cpu({.threads = 1}), Device::cpu({.threads = 2})}; }

class MemoryEndsIn : public ::testing::TestWithParam<Question> {};
INSTANTIATE_TEST_SUITE_P(All, MemoryEndsIn, ::testing::ValuesIn(kQuestions),
                         [](const auto& question) { return std::string(question.param.name); });

// A call that throws has changed nothing.
TEST_P(MemoryEndsIn, AQuestion) {
    const UserMesh mesh(torus(30, 20));
    for (const Device& device : devices()) {
        const Scene reference = Scene::build(mesh.view(), device);
        Answers expected(mesh);
        GetParam().ask(reference, expected);
        at_each_allocation([&](std::uint64_t at, bool lasts) {
            // First questions make what later ones use.
            const Scene scene = reference.on(device);
            Answers answers(mesh);
            const Outcome outcome = call_short([&] { GetParam().ask(scene, answers); }, at, lasts);
            if (outcome.error) {
                EXPECT_EQ(*outcome.error, ErrorCode::limit);
                answers = Answers(mesh);
                GetParam().ask(scene, answers);
            }
            EXPECT_TRUE(answers.bytes() == expected.bytes());
            return outcome.is_met;
        });
    }
}

struct Meshes {
    UserMesh first{torus(30, 20)};
    UserMesh second{torus(12, 10)};

    void twist(float angle) {
        for (morphray::Vec3& p : first.points) {
            const float c = std::cos(angle * p.y);
            const float s = std::sin(angle * p.y);
            p = {p.x * c - p.z * s, p.y, p.x * s + p.z * c};
        }
    }
};

struct Change {
    const char* name;
    morphray::UpdatePolicy policy;
    void (*prepare)(Scene&, Meshes&);
    void (*act)(Scene&, Meshes&);
    /// Whether an error leaves the scene of no use; else it has changed nothing.
    bool breaks = true;
};
void PrintTo(const Change& change, std::ostream* out) { *out << change.name; }

void twist(Scene&, Meshes& meshes) { meshes.twist(2); }
void update(Scene& scene, Meshes&) { scene.update(); }
void update_part(Scene& scene, Meshes&) { scene.update(0, 3, 50); }
void attach(Scene& scene, Meshes& meshes) { scene.attach(meshes.second.view()); }
void detach(Scene& scene, Meshes&) { scene.detach(0); }
void leave_bounds(Scene&, Meshes& meshes) {
    for (morphray::Vec3& p : meshes.first.points) p.x *= 100;
}
void end_with_nan(Scene&, Meshes& meshes) {
    meshes.first.points[7].y = std::numeric_limits<float>::quiet_NaN();
}
/// The cost of a tree that has lost its shape is known when the next one is decided on.
void degrade(Scene& scene, Meshes& meshes) {
    for (int pose = 0; pose < 6; ++pose) {
        meshes.twist(1);
        scene.update();
        Answers answers(meshes.first);
        scene.intersect(answers.rays, answers.hits);
    }
    meshes.twist(1);
}

const morphray::Auto kAuto{.budget = 0.02, .deterministic = true};

const Change kChanges[] = {
    {"Refit", morphray::Refit{}, twist, update},
    {"Rebuild", morphray::Rebuild{}, twist, update},
    {"Auto", kAuto, degrade, update},
    {"Part", morphray::Refit{}, twist, update_part},
    {"Bounds", morphray::Refit{}, leave_bounds, update},
    {"NoNumber", morphray::Refit{}, end_with_nan, update},
    {"UpdateWithAnotherMesh", morphray::Refit{}, attach, update},
    {"UpdateWithoutAMesh", morphray::Refit{}, detach, update},
    {"Attach", morphray::Refit{}, twist, attach, false},
    {"Detach", morphray::Refit{}, twist, detach, false},
};

class MemoryEndsInChange : public ::testing::TestWithParam<Change> {};
INSTANTIATE_TEST_SUITE_P(All, MemoryEndsInChange, ::testing::ValuesIn(kChanges),
                         [](const auto& change) { return std::string(change.param.name); });

/// A scene that is changed. It borrows the meshes.
struct Play {
    explicit Play(const Device& device) : scene(build(device)) {}

    Scene build(const Device& device) {
        return Scene::build(meshes.first.view(), device, {.update = GetChange().policy});
    }
    static const Change& GetChange() { return MemoryEndsInChange::GetParam(); }

    /// The answers after the update that shows the change.
    std::string answers() {
        if (!GetChange().breaks) scene.update();
        Answers answers(meshes.second);
        scene.intersect(answers.rays, answers.hits);
        return answers.bytes();
    }

    Meshes meshes;
    Scene scene;
};

TEST_P(MemoryEndsInChange, AnUpdate) {
    for (const Device& device : devices()) {
        Play whole(device);
        GetParam().prepare(whole.scene, whole.meshes);
        GetParam().act(whole.scene, whole.meshes);
        const std::string expected = whole.answers();
        at_each_allocation([&](std::uint64_t at, bool lasts) {
            Play play(device);
            GetParam().prepare(play.scene, play.meshes);
            const Outcome outcome =
                call_short([&] { GetParam().act(play.scene, play.meshes); }, at, lasts);
            if (outcome.error) {
                EXPECT_EQ(*outcome.error, ErrorCode::limit);
                if (GetParam().breaks) {
                    EXPECT_EQ(error_of([&] { play.scene.update(); }), "limit");
                    Answers answers(play.meshes.second);
                    for (const Question& question : kQuestions) {
                        EXPECT_EQ(error_of([&] { question.ask(play.scene, answers); }), "limit")
                            << question.name;
                    }
                    return outcome.is_met;
                }
                GetParam().act(play.scene, play.meshes);
            }
            EXPECT_TRUE(play.answers() == expected);
            return outcome.is_met;
        });
    }
}

TEST(MemoryEnds, InABuild) {
    const UserMesh mesh(torus(30, 20));
    for (const auto split : {morphray::Split::binned, morphray::Split::sweep}) {
        for (const Device& device : devices()) {
            const Scene whole = Scene::build(mesh.view(), device, {.split = split});
            at_each_allocation([&](std::uint64_t at, bool lasts) {
                std::optional<Scene> scene;
                const Outcome outcome =
                    call_short([&] { scene = Scene::build(mesh.view(), device, {.split = split}); },
                               at, lasts);
                if (outcome.error) {
                    EXPECT_EQ(*outcome.error, ErrorCode::limit);
                } else {
                    EXPECT_EQ(scene->tree_statistics().hash, whole.tree_statistics().hash);
                }
                return outcome.is_met;
            });
        }
    }
}

TEST(MemoryEnds, InADevice) {
    at_each_allocation([&](std::uint64_t at, bool lasts) {
        const Outcome outcome =
            call_short([] { static_cast<void>(Device::cpu({.threads = 2})); }, at, lasts);
        if (outcome.error) {
            EXPECT_EQ(*outcome.error, ErrorCode::limit);
        }
        return outcome.is_met;
    });
}

TEST(MemoryEnds, InFilesOfHits) {
    const UserMesh mesh(torus(30, 20));
    const morphray::Image image = Scene::build(mesh.view()).render({.width = 20, .height = 10});
    const TemporaryFolder folder;
    const std::string file = (folder.path() / "hits").native();
    std::string expected;
    at_each_allocation([&](std::uint64_t at, bool lasts) {
        std::optional<morphray::HitsWriter> writer(std::in_place, 20, 10);
        Outcome outcome = call_short([&] { writer->add(image); }, at, lasts);
        if (outcome.error) {
            EXPECT_EQ(*outcome.error, ErrorCode::limit);
            writer->add(image);
        }
        const bool is_met = outcome.is_met;
        outcome = call_short([&] { writer->write(file); }, at, lasts);
        if (outcome.error) {
            EXPECT_EQ(*outcome.error, ErrorCode::limit);
            EXPECT_TRUE(folder.names().empty());
            writer->write(file);
        }
        const std::string bytes = read_file(file);
        if (expected.empty()) expected = bytes;
        EXPECT_EQ(bytes, expected);
        std::optional<morphray::HitsFile> read;
        const Outcome reading = call_short([&] { read = morphray::read_hits(file); }, at, lasts);
        if (reading.error) {
            EXPECT_EQ(*reading.error, ErrorCode::limit);
        } else {
            EXPECT_EQ(read->images.size(), 1u);
        }
        std::filesystem::remove(file);
        return is_met || outcome.is_met || reading.is_met;
    });
}

}  // namespace
}  // namespace mray::test
