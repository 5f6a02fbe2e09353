// soak_builds [--count N]: builds trees over and over on a busy machine, N by each way in which a
// scene builds them (100,000), on 1, 2 and 8 threads, and checks that the second half of them
// leaves resident memory as the first half did, within 1 MiB. Prints a row for each; exit code 1 if
// a check fails.
#include <fmt/format.h>

#include <atomic>
#include <charconv>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <functional>
#include <numeric>
#include <stdexcept>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "morphray/morphray.hpp"

namespace {

using morphray::Device;
using morphray::MeshView;
using morphray::Scene;
using morphray::Step;

constexpr std::int64_t kMostGrowthKib = 1024;
constexpr int kThreads[] = {1, 2, 8};
// Scenes, attached and detached meshes: each costs several times a build.
constexpr std::uint64_t kScenesPart = 10;

std::int64_t resident_kib() {
    std::ifstream in("/proc/self/status");
    for (std::string line; std::getline(in, line);) {
        if (line.starts_with("VmRSS:")) return std::stoll(line.substr(std::strlen("VmRSS:")));
    }
    throw std::runtime_error("/proc/self/status has no VmRSS");
}

/// Threads that do nothing, twice as many as there are cores, so that others wait for a core.
class Load {
public:
    Load() {
        for (unsigned i = 0; i < 2 * std::thread::hardware_concurrency(); ++i) {
            threads_.emplace_back([this] {
                while (!stops_.load(std::memory_order_relaxed)) {
                }
            });
        }
    }
    ~Load() {
        stops_ = true;
        for (std::thread& thread : threads_) thread.join();
    }
    Load(const Load&) = delete;

private:
    std::atomic<bool> stops_ = false;
    std::vector<std::thread> threads_;
};

/// A sheet with enough triangles for the builder to share work among threads.
class Sheet {
public:
    Sheet() {
        for (std::uint32_t y = 0; y < kSide; ++y) {
            for (std::uint32_t x = 0; x < kSide; ++x)
                points_.push_back({static_cast<float>(x), static_cast<float>(y), 0});
        }
        for (std::uint32_t y = 0; y + 1 < kSide; ++y) {
            for (std::uint32_t x = 0; x + 1 < kSide; ++x) {
                const std::uint32_t i = y * kSide + x;
                triangles_.insert(triangles_.end(), {i, i + 1, i + kSide});
                triangles_.insert(triangles_.end(), {i + 1, i + kSide + 1, i + kSide});
            }
        }
    }
    MeshView view() const { return {morphray::packed(points_), triangles_}; }
    /// Moves one vertex.
    void touch(std::uint64_t i) { points_[0].z = static_cast<float>(i % 1000); }

private:
    static constexpr std::uint32_t kSide = 40;
    std::vector<morphray::Vec3> points_;
    std::vector<std::uint32_t> triangles_;
};

/// Triangles that fly apart and return, so that a tree over them degrades.
class Swarm {
public:
    Swarm() : points_(3 * kCount), triangles_(points_.size()) {
        std::iota(triangles_.begin(), triangles_.end(), 0u);
        fly(0);
    }
    MeshView view() const { return {morphray::packed(points_), triangles_}; }
    void fly(std::uint64_t i) {
        const auto time = static_cast<float>(i % 20);
        for (std::uint32_t k = 0; k < kCount; ++k) {
            const auto x = static_cast<float>(k % 50);
            const auto y = static_cast<float>(k / 50);
            const morphray::Vec3 p = {x + time * static_cast<float>(k * 7 % 11),
                                      y - time * static_cast<float>(k * 5 % 13),
                                      time * static_cast<float>(k * 3 % 7)};
            points_[3 * k] = p;
            points_[3 * k + 1] = {p.x + 1, p.y, p.z};
            points_[3 * k + 2] = {p.x, p.y + 1, p.z};
        }
    }

private:
    static constexpr std::uint32_t kCount = 2500;
    std::vector<morphray::Vec3> points_;
    std::vector<std::uint32_t> triangles_;
};

/// One way to build trees. make(i) builds at least one in each call, or in many of them.
struct Way {
    const char* name;
    std::uint64_t count;
    std::function<Step(std::uint64_t)> make;
};

bool is_build(Step step) {
    return step == Step::build || step == Step::rebuild || step == Step::swap ||
           step == Step::restructure;
}

/// Returns whether memory stays within the limit.
bool follow(const Way& way, int threads) {
    std::uint64_t builds = 0;
    std::int64_t half_kib = 0;
    for (std::uint64_t i = 0; i < way.count; ++i) {
        if (i == way.count / 2) half_kib = resident_kib();
        builds += is_build(way.make(i)) ? 1 : 0;
    }
    const std::int64_t end_kib = resident_kib();
    fmt::print("{:<18}  {:>7}  {:>7}  {:>7}  {:>8}  {:>8}\n", way.name, threads, way.count, builds,
               half_kib, end_kib);
    std::fflush(stdout);
    if (builds == 0) fmt::print("error: no tree was built\n");
    const bool grows = end_kib > half_kib + kMostGrowthKib;
    if (grows) fmt::print("error: memory grows\n");
    return builds > 0 && !grows;
}

/// Returns whether all ways stay within the limit.
bool soak(std::uint64_t count, int threads) {
    const Device device = Device::cpu({.threads = threads});
    Sheet sheet;
    Scene rebuilt = Scene::build(sheet.view(), device, {.update = morphray::Rebuild{}});
    Swarm swarm;
    Scene automatic =
        Scene::build(swarm.view(), device, {.update = morphray::Auto{.deterministic = true}});
    Scene changed = Scene::build(sheet.view(), device);
    std::vector<morphray::Ray> rays(1000);
    for (std::size_t i = 0; i < rays.size(); ++i)
        rays[i] = {{static_cast<float>(i % 40), static_cast<float>(i / 40), -100}, 0, {0, 0, 1}};
    std::vector<morphray::Hit> hits(rays.size());
    const Way ways[] = {
        {"rebuild", count,
         [&](std::uint64_t i) {
             sheet.touch(i);
             return rebuilt.update().step;
         }},
        {"auto", count / kScenesPart,
         [&](std::uint64_t i) {
             swarm.fly(i);
             const Step step = automatic.update().step;
             automatic.intersect(std::span<const morphray::Ray>(rays), hits);
             return step;
         }},
        {"scene", count / kScenesPart,
         [&](std::uint64_t) {
             const Scene scene = Scene::build(sheet.view(), Device::cpu({.threads = threads}));
             return scene.last_update().step;
         }},
        {"attach and detach", count,
         [&](std::uint64_t) {
             const std::uint32_t geom_id = changed.attach(sheet.view());
             changed.update();
             changed.detach(geom_id);
             return changed.update().step;
         }},
    };
    bool stays = true;
    for (const Way& way : ways) stays = follow(way, threads) && stays;
    return stays;
}

}  // namespace

int main(int argc, char** argv) {
    std::uint64_t count = 100'000;
    const std::string_view option = argc == 3 ? argv[1] : "";
    const std::string_view value = argc == 3 ? argv[2] : "";
    if (argc != 1 && (option != "--count" ||
                      std::from_chars(value.begin(), value.end(), count).ec != std::errc())) {
        fmt::print(stderr, "soak_builds [--count N]\n");
        return 2;
    }
    const Load load;
    fmt::print("{:<18}  {:>7}  {:>7}  {:>7}  {:>8}  {:>8}\n", "builds by", "threads", "count",
               "builds", "half KiB", "end KiB");
    bool stays = true;
    for (const int threads : kThreads) stays = soak(count, threads) && stays;
    return stays ? 0 : 1;
}
