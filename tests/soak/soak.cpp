// soak [--frames N] [--backend cpu|vulkan]: follows small scenes that deform for N frames
// (1,000,000), under each update policy, round and round, and checks at the end of each tenth what
// must not change: memory, file descriptors and threads; the bits of the first frame's image; how
// many trees a round takes, and what they cost against new ones. Prints a row for each tenth; exit
// code 1 if a check fails.
#include <fmt/format.h>
#ifdef __GLIBC__
#include <malloc.h>
#endif

#include <charconv>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "common/base/errors.h"
#include "common/base/hash.h"
#include "common/bvh/bvh.h"
#include "common/frame_times.h"
#include "common/scene/camera_setup.h"
#include "cpu/cpu_backend.h"
#include "scenes/animation.h"
#include "tests/support/backend_results.h"
#include "tests/support/scene_frames.h"
#ifdef MORPHRAY_HAS_VULKAN
#include "gpu/vulkan_backend.h"
#endif

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

/// Keeps a tree at the current frame. `frames` must outlive it.
class FollowedAnimation {
public:
    /// Builds the tree at `first_frame`.
    FollowedAnimation(SceneFrames& frames, double first_frame, const PolicySpec& policy,
                      const UpdateConfig& config, int threads, std::unique_ptr<Backend> tracer)
        : frames_(frames),
          tracer_(std::move(tracer)),
          updater_(frames.animation().topology(), frames.positions(first_frame), *tracer_, policy,
                   {.threads = threads}, config),
          current_(first_frame) {}

    /// Does nothing if the first call is for the frame of the build.
    void advance(double frame) {
        if (std::exchange(is_fresh_, false) && frame == current_) return;
        updater_.update(frames_.positions(frame));
    }
    void trace(const ImageParams& params, Frame& frame) {
        tracer_->trace_image(params, frame);
        updater_.frame_done(test::last_trace(*tracer_));
    }

    const TreeUpdate& last_update() const { return updater_.last(); }
    const Bvh& tree() { return updater_.tree(); }

private:
    SceneFrames& frames_;
    std::unique_ptr<Backend> tracer_;
    TreeUpdater updater_;
    double current_;
    bool is_fresh_ = true;
};

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

std::unique_ptr<Backend> make_tracer(std::string_view backend) {
#ifdef MORPHRAY_HAS_VULKAN
    if (backend == "vulkan") return gpu::make_vulkan_backend();
#endif
    if (backend != "cpu") throw Error(ErrorKind::kBadArgument, "--backend: cpu or vulkan");
    return cpu::make_cpu_backend({.threads = 1});
}

/// One scene under one policy.
class Run {
public:
    Run(const char* scene, const char* policy, std::string_view backend)
        : name_(fmt::format("{}, {}", scene, policy)),
          is_auto_(policy == std::string_view("auto")),
          frames_(open_scene(scene)),
          first_(static_cast<int>(frames_.animation().first_frame())),
          period_(static_cast<int>(frames_.animation().last_frame()) - first_ + 1),
          animation_(frames_, first_, parse_policy(policy), {.deterministic = true}, 1,
                     make_tracer(backend)) {
        view_.width = view_.height = kSide;
        view_.rays = kRaysShadow;
        follow(1);
        first_hash_ = image_hash();
    }

    const std::string& name() const { return name_; }

    /// Traces frames, the last of them a first frame. Returns the number of them.
    std::uint64_t follow_rounds(std::uint64_t frames) {
        steps_.clear();
        const std::uint64_t rounds = std::max<std::uint64_t>(1, frames / period_);
        follow(rounds * period_);
        return rounds * period_;
    }

    /// Returns what is wrong; empty if nothing is.
    std::string problem(std::uint64_t frames) {
        if (image_hash() != first_hash_) return "the first frame has other bits";
        if (!is_auto_) return {};
        if (trees_a_frame(frames) > kMostTreesAFrame) return "trees flap";
        return cost_ratio() > kMostCostRatio ? "trees stay bad" : "";
    }

    double trees_a_frame(std::uint64_t frames) const {
        std::uint64_t trees = 0;
        for (const auto& [step, count] : steps_) {
            if (step != TreeStep::kKept && step != TreeStep::kRefitted) trees += count;
        }
        return static_cast<double>(trees) / static_cast<double>(frames);
    }

    /// The SAH cost of the tree over that of a new one.
    double cost_ratio() {
        const Bvh fresh = build_bvh(frames_.animation().topology(), frames_.positions(first_));
        return bvh_stats(animation_.tree()).sah_cost / bvh_stats(fresh).sah_cost;
    }

private:
    void follow(std::uint64_t frames) {
        for (std::uint64_t i = 0; i < frames; ++i) {
            animation_.advance(first_ + static_cast<int>(next_ % period_));
            animation_.trace(frames_.image_params(view_), frame_);
            ++steps_[animation_.last_update().step];
            next_ = (next_ + 1) % period_;
        }
    }

    std::uint64_t image_hash() const {
        return Hasher().add(std::span(frame_.pixels)).add(std::span(frame_.hits)).digest();
    }

    std::string name_;
    bool is_auto_;
    SceneFrames frames_;
    int first_;
    std::uint64_t period_;
    FollowedAnimation animation_;
    ViewSpec view_;
    Frame frame_;
    std::uint64_t next_ = 0;
    std::uint64_t first_hash_ = 0;
    std::map<TreeStep, std::uint64_t> steps_;
};

int soak(std::uint64_t frames, std::string_view backend) {
    constexpr std::uint64_t kRuns = std::size(kScenes) * std::size(kPolicies);
    std::vector<std::unique_ptr<Run>> runs;
    for (const char* scene : kScenes) {
        for (const char* policy : kPolicies)
            runs.push_back(std::make_unique<Run>(scene, policy, backend));
    }
    int code = 0;
    std::optional<Resources> early;
    std::uint64_t done = 0;
    const Stopwatch watch;
    fmt::print("{:>9}  {:>7}  {:>13}  {:>7}  {:>3}  {:>7}  {:>10}  {:>10}\n", "frames", "seconds",
               "allocated KiB", "RSS KiB", "fds", "threads", "trees/100", "cost ratio");
    for (int part = 0; part < kParts; ++part) {
        double trees = 0;
        double ratio = 0;
        for (const std::unique_ptr<Run>& run : runs) {
            const std::uint64_t count = run->follow_rounds(frames / kParts / kRuns);
            done += count;
            if (const std::string problem = run->problem(count); !problem.empty()) {
                fmt::print("error: {}: {}\n", run->name(), problem);
                code = 1;
            }
        }
        // The runs under auto come first of each scene.
        for (std::size_t i = 0; i < runs.size(); i += std::size(kPolicies)) {
            trees = std::max(trees, runs[i]->trees_a_frame(frames / kParts / kRuns));
            ratio = std::max(ratio, runs[i]->cost_ratio());
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
    return soak(frames, backend);
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
