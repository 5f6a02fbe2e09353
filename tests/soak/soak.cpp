// soak [--frames N] [--backend cpu|vulkan]: follows small scenes that deform for N frames
// (1,000,000), under each update policy, round and round, and checks at the end of each tenth what
// must not change: memory, file descriptors and threads; the bits of the first frame's image; how
// many trees a round takes, and what they cost against new ones. As many steps move 50 bodies by
// matrices, which come and go; their hits must be those of a new scene. Prints a row for each
// tenth; exit code 1 if a check fails.
#include <fmt/format.h>
#ifdef __GLIBC__
#include <malloc.h>
#endif

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/frame_times.h"
#include "morphray/morphray.hpp"
#include "scenes/animation.h"

namespace mray {
namespace {

constexpr const char* kScenes[] = {"builtin:twist:576", "builtin:teleport:576"};
constexpr const char* kPolicies[] = {"auto", "refit", "rebuild", "every:4"};
constexpr int kParts = 10;
constexpr std::uint32_t kSide = 32;

// Growth after the first tenth. What is allocated grows only if something leaks. Resident memory
// follows in steps, since each of a driver's threads keeps what it has freed.
constexpr std::uint64_t kMostGrowthKib = 4096;
constexpr std::uint64_t kMostResidentGrowthKib = 32 * 1024;
// The most that a tree of --update auto costs, as a multiple of a new one; it is restructured or
// built in at most every second frame.
constexpr double kMostCostRatio = 2;
constexpr double kMostTreesAFrame = 0.5;

std::uint64_t status_number(const char* key) {
    std::ifstream in("/proc/self/status");
    for (std::string line; std::getline(in, line);) {
        if (line.starts_with(key)) return std::stoull(line.substr(std::strlen(key)));
    }
    return 0;
}

/// Returns what the program has allocated and not freed, in KiB, where the C library tells.
std::uint64_t allocated_kib() {
#ifdef __GLIBC__
    const struct mallinfo2 info = mallinfo2();
    return (info.uordblks + info.hblkhd) / 1024;
#else
    return 0;
#endif
}

struct Resources {
    std::uint64_t allocated_kib = mray::allocated_kib();
    std::uint64_t resident_kib = status_number("VmRSS:");
    std::uint64_t threads = status_number("Threads:");
    std::int64_t descriptors =
        std::distance(std::filesystem::directory_iterator("/proc/self/fd"), {});
};

morphray::SceneOptions options_of(const char* policy, const WorldBounds& bounds) {
    const auto point = [](const auto& p) { return morphray::Point{p[0], p[1], p[2]}; };
    morphray::SceneOptions options;
    options.bounds = morphray::Box{point(bounds.lower), point(bounds.upper)};
    options.update = morphray::parse_update_policy(policy);
    if (auto* const automatic = std::get_if<morphray::Auto>(&options.update))
        automatic->deterministic = true;
    return options;
}

/// A scene that follows an animation under one policy.
class FollowedScene {
public:
    FollowedScene(const char* name, const char* policy, const morphray::Device& device)
        : name_(fmt::format("{}, {}", name, policy)),
          is_auto_(policy == std::string_view("auto")),
          animation_(open_scene(name)),
          first_(animation_->first_frame()),
          period_(static_cast<std::uint64_t>(animation_->last_frame() - first_) + 1),
          indices_(3 * animation_->topology().triangles.size()),
          positions_(animation_->topology().vertex_count),
          points_(positions_.size()) {
        std::memcpy(indices_.data(), animation_->topology().triangles.data(),
                    indices_.size() * sizeof(std::uint32_t));
        pose();
        scene_ = morphray::Scene::build(mesh(), device, options_of(policy, animation_->bounds()));
        view_.width = view_.height = kSide;
        view_.rays = morphray::Rays::shadow;
        first_image_ = scene_->render(view_);
        ++next_;
    }
    FollowedScene(const FollowedScene&) = delete;

    const std::string& name() const { return name_; }

    /// Traces frames, the last of them a first frame. Returns the number of them.
    std::uint64_t follow_rounds(std::uint64_t frames) {
        const std::uint64_t count = std::max<std::uint64_t>(1, frames / period_) * period_;
        std::uint64_t trees = 0;
        for (std::uint64_t i = 0; i < count; ++i) {
            pose();
            scene_->update();
            scene_->render(view_, image_);
            const morphray::Step step = scene_->last_update().step;
            trees += step != morphray::Step::keep && step != morphray::Step::refit;
            next_ = (next_ + 1) % period_;
        }
        trees_a_frame_ = static_cast<double>(trees) / static_cast<double>(count);
        return count;
    }

    /// Returns what is wrong after follow_rounds(); empty if nothing is.
    std::string problem() const {
        if (image_.pixels != first_image_.pixels || image_.hits != first_image_.hits)
            return "the first frame has other bits";
        if (!is_auto_) return {};
        if (trees_a_frame_ > kMostTreesAFrame) return "trees flap";
        return cost_ratio() > kMostCostRatio ? "trees stay bad" : "";
    }

    double trees_a_frame() const { return trees_a_frame_; }

    /// The SAH cost of the tree over that of a new one.
    double cost_ratio() const {
        const morphray::Scene fresh =
            morphray::Scene::build(mesh(), morphray::Device::cpu({.threads = 1}));
        return scene_->tree_statistics().sah_cost / fresh.tree_statistics().sah_cost;
    }

private:
    morphray::MeshView mesh() const { return {morphray::packed(points_), indices_}; }

    /// Moves the points to the next frame.
    void pose() {
        animation_->positions(first_ + static_cast<double>(next_), positions_);
        std::ranges::transform(positions_, points_.begin(), [](vec3 p) {
            return morphray::Vec3{p.x, p.y, p.z};
        });
    }

    std::string name_;
    bool is_auto_;
    std::unique_ptr<Animation> animation_;
    double first_;
    std::uint64_t period_;
    std::vector<std::uint32_t> indices_;
    std::vector<vec3> positions_;
    std::vector<morphray::Vec3> points_;
    std::optional<morphray::Scene> scene_;
    morphray::View view_;
    morphray::Image first_image_;
    morphray::Image image_;
    std::uint64_t next_ = 0;
    double trees_a_frame_ = 0;
};

/// Bodies of one shape over a cloth that deforms. Each step moves ten of them by matrices; each
/// sixteenth replaces one.
class Bodies {
public:
    explicit Bodies(const morphray::Device& device) {
        const std::unique_ptr<Animation> shape = open_scene("builtin:twist:144");
        std::vector<vec3> positions(shape->topology().vertex_count);
        shape->positions(shape->first_frame(), positions);
        for (const vec3& p : positions) points_.push_back({p.x, p.y, p.z});
        for (const uvec3& t : shape->topology().triangles)
            indices_.insert(indices_.end(), {t.x, t.y, t.z});
        cloth_ = points_;
        for (std::uint32_t id = 1; id <= kCount; ++id) poses_.push_back({id});
        scene_ = morphray::Scene::build(views(), device, kOptions);
    }

    void follow(std::uint64_t steps) {
        for (std::uint64_t i = 0; i < steps; ++i) step();
    }

    /// True if the hits of some rays are those of a new scene at these poses.
    bool is_as_new() const {
        morphray::Scene fresh =
            morphray::Scene::build(views(), morphray::Device::brute_force(), kOptions);
        fresh.update(poses_);
        std::vector<morphray::Ray> rays;
        for (int i = 0; i < 400; ++i)
            rays.push_back(
                {{0.5f * static_cast<float>(i % 20) - 5, 0.5f * static_cast<float>(i / 20) - 5, 9},
                 0,
                 {0, 0, -1}});
        return morphray::compare(*scene_, fresh, rays).equal();
    }

private:
    static constexpr std::uint32_t kCount = 50;
    static inline const morphray::SceneOptions kOptions{
        .bounds = morphray::Box{{-8, -8, -8}, {8, 8, 8}},
        .update = morphray::Auto{.deterministic = true}};

    std::vector<morphray::MeshView> views() const {
        std::vector<morphray::MeshView> meshes(kCount + 1,
                                               {morphray::packed(points_), indices_, false});
        meshes[0] = {morphray::packed(cloth_), indices_};
        return meshes;
    }

    void step() {
        ++steps_;
        if (steps_ % 16 == 0) {
            const auto id = static_cast<std::uint32_t>(1 + steps_ / 16 % kCount);
            scene_->detach(id);
            scene_->attach({morphray::packed(points_), indices_, false});
            poses_[id - 1].transform = {};
        }
        for (morphray::Vec3& p : cloth_) p.z = -p.z;
        scene_->update();
        std::vector<morphray::MeshPose> moved;
        for (std::uint64_t i = 0; i < 10; ++i) {
            const auto id = static_cast<std::uint32_t>(1 + (7 * steps_ + 5 * i) % kCount);
            const double angle = 0.01 * static_cast<double>(steps_ % 6283 + i);
            const double c = std::cos(angle);
            const double s = std::sin(angle);
            morphray::MeshPose& pose = poses_[id - 1];
            pose.transform = {{{{c, -s, 0, 5 * s}, {s, c, 0, 0.1 * id - 3}, {0, 0, 1, c}}}};
            moved.push_back(pose);
        }
        scene_->update(moved);
    }

    std::vector<morphray::Vec3> points_;
    std::vector<morphray::Vec3> cloth_;
    std::vector<std::uint32_t> indices_;
    /// Of geom_ids 1 to kCount.
    std::vector<morphray::MeshPose> poses_;
    std::optional<morphray::Scene> scene_;
    std::uint64_t steps_ = 0;
};

int soak(std::uint64_t frames, const morphray::Device& device) {
    Bodies bodies(device);
    std::vector<std::unique_ptr<FollowedScene>> followed;
    for (const char* scene : kScenes) {
        for (const char* policy : kPolicies)
            followed.push_back(std::make_unique<FollowedScene>(scene, policy, device));
    }
    int code = 0;
    std::optional<Resources> early;
    std::uint64_t done = 0;
    const Stopwatch watch;
    fmt::print("{:>9}  {:>7}  {:>13}  {:>7}  {:>3}  {:>7}  {:>10}  {:>10}\n", "frames", "seconds",
               "allocated KiB", "RSS KiB", "fds", "threads", "trees/100", "cost ratio");
    for (int part = 0; part < kParts; ++part) {
        for (const std::unique_ptr<FollowedScene>& scene : followed) {
            done += scene->follow_rounds(frames / kParts / followed.size());
            if (const std::string problem = scene->problem(); !problem.empty()) {
                fmt::print("error: {}: {}\n", scene->name(), problem);
                code = 1;
            }
        }
        bodies.follow(frames / kParts);
        if (!bodies.is_as_new()) {
            fmt::print("error: bodies have other hits than a new scene\n");
            code = 1;
        }
        double trees = 0;
        double ratio = 0;
        // The scenes under auto come first.
        for (std::size_t i = 0; i < followed.size(); i += std::size(kPolicies)) {
            trees = std::max(trees, followed[i]->trees_a_frame());
            ratio = std::max(ratio, followed[i]->cost_ratio());
        }
        const Resources now;
        fmt::print("{:>9}  {:>7.0f}  {:>13}  {:>7}  {:>3}  {:>7}  {:>10.1f}  {:>10.2f}\n", done,
                   watch.ms() / 1000, now.allocated_kib, now.resident_kib, now.descriptors,
                   now.threads, 100 * trees, ratio);
        std::fflush(stdout);
        if (!early) early = now;
        if (now.allocated_kib > early->allocated_kib + kMostGrowthKib ||
            now.resident_kib > early->resident_kib + kMostResidentGrowthKib ||
            now.descriptors != early->descriptors || now.threads > early->threads) {
            fmt::print("error: memory, descriptors or threads grow\n");
            code = 1;
        }
    }
    return code;
}

int run(int argc, char** argv) {
    std::uint64_t frames = 1'000'000;
    std::string_view backend = "cpu";
    for (int i = 1; i + 1 < argc; i += 2) {
        const std::string_view option = argv[i];
        const std::string_view value = argv[i + 1];
        if (option == "--backend") {
            backend = value;
        } else if (option != "--frames" ||
                   std::from_chars(value.begin(), value.end(), frames).ec != std::errc()) {
            fmt::print(stderr, "soak [--frames N] [--backend cpu|vulkan]\n");
            return 2;
        }
    }
    if (backend == "vulkan") return soak(frames, morphray::Device::vulkan());
    return soak(frames, morphray::Device::cpu({.threads = 1}));
}

}  // namespace
}  // namespace mray

int main(int argc, char** argv) {
    try {
        return mray::run(argc, argv);
    } catch (const std::exception& error) {
        fmt::print(stderr, "soak: {}\n", error.what());
        return 70;
    }
}
