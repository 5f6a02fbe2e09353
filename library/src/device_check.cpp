#include "library/src/device_check.h"

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <mutex>
#include <random>
#include <sstream>
#include <vector>

#include "common/base/output_file.h"
#include "common/bvh/builder/bvh_builder.h"
#include "common/interop/arithmetic.h"
#include "common/version.h"
#include "cpu/cpu_backend.h"
#include "library/src/scene/errors.h"
#ifdef MORPHRAY_HAS_VULKAN
#include "gpu/vulkan_backend.h"
#endif

namespace morphray::detail {
namespace {

using mray::vec3;

constexpr float kUnit = 0x1p16f;

struct TestScene {
    mray::Topology topology;
    std::vector<vec3> positions;
};

/// A torus, which hides parts of itself, and triangles of all shapes around it.
TestScene make_scene() {
    constexpr std::uint32_t kRings = 32;
    constexpr std::uint32_t kSides = 16;
    constexpr std::uint32_t kLoose = 400;
    constexpr float kTurn = 6.2831853f;
    TestScene scene;
    const auto add = [&](vec3 p) { scene.positions.push_back(mray::snap_point(p * kUnit)); };
    for (std::uint32_t ring = 0; ring < kRings; ++ring) {
        for (std::uint32_t side = 0; side < kSides; ++side) {
            const float a = kTurn * static_cast<float>(ring) / kRings;
            const float b = kTurn * static_cast<float>(side) / kSides;
            const float r = 2 + 0.8f * std::cos(b);
            add({r * std::cos(a), 0.8f * std::sin(b), r * std::sin(a)});
            const std::uint32_t next_ring = (ring + 1) % kRings * kSides;
            const std::uint32_t next_side = (side + 1) % kSides;
            const std::uint32_t at = ring * kSides;
            scene.topology.triangles.emplace_back(at + side, next_ring + side, at + next_side);
            scene.topology.triangles.emplace_back(at + next_side, next_ring + side,
                                                  next_ring + next_side);
        }
    }
    std::mt19937 random(1);
    const auto in = [&](float size) {
        return size * (static_cast<float>(random() % 20001) * 1e-4f - 1);
    };
    for (std::uint32_t i = 0; i < kLoose; ++i) {
        const auto first = static_cast<std::uint32_t>(scene.positions.size());
        const vec3 centre(in(3), in(3), in(3));
        const float size = i % 3 == 0 ? 1e-3f : 0.3f;
        for (int k = 0; k < 3; ++k) add(centre + vec3(in(size), in(size), in(size)));
        scene.topology.triangles.emplace_back(first, first + 1, first + 2);
    }
    scene.topology.vertex_count = static_cast<std::uint32_t>(scene.positions.size());
    for (std::size_t i = 0; i < scene.topology.triangles.size(); ++i)
        scene.topology.albedo.push_back(0xFF404040u + static_cast<std::uint32_t>(i) * 0x010305u);
    return scene;
}

mray::ImageParams make_view(std::uint32_t rays) {
    constexpr float kWidth = 96;
    constexpr float kHeight = 64;
    mray::ImageParams params = {};
    params.camera.org = vec3(0, 3, 6) * kUnit;
    params.camera.corner = vec3(-0.5f * kWidth / kHeight, 0.1f, -1);
    params.camera.du = vec3(1 / kHeight, 0, 0);
    params.camera.dv = vec3(0, -1 / kHeight, 0);
    params.light = vec3(-6, 8, 5) * kUnit;
    params.ao_tfar = 1.5f * kUnit;
    params.width = static_cast<std::uint32_t>(kWidth);
    params.height = static_cast<std::uint32_t>(kHeight);
    params.rays = rays;
    params.ao_count = 4;
    return params;
}

template <class Values>
bool same(const Values& a, const Values& b) {
    return a.size() == b.size() &&
           std::memcmp(a.data(), b.data(), a.size() * sizeof(*a.data())) == 0;
}

std::string image_difference(mray::Backend& tested, mray::Backend& reference) {
    for (const std::uint32_t rays : {mray::kRaysShadow, mray::kRaysAo}) {
        mray::Frame found, expected;
        tested.trace_image(make_view(rays), found);
        reference.trace_image(make_view(rays), expected);
        if (!same(found.hits, expected.hits)) return "closest hits";
        if (!same(found.occlusion, expected.occlusion)) return "any hits";
        if (!same(found.pixels, expected.pixels)) return "shading";
    }
    return "";
}

}  // namespace

std::string find_difference(mray::Backend& tested, mray::Backend& reference) {
    TestScene scene = make_scene();
    const mray::Bvh bvh = mray::build_bvh(scene.topology, scene.positions);
    for (mray::Backend* const backend : {&tested, &reference})
        backend->set_scene(scene.topology, scene.positions, bvh);
    for (int pose = 0; pose < 2; ++pose) {
        const std::string difference = image_difference(tested, reference);
        if (!difference.empty()) return difference;
        for (vec3& p : scene.positions) p = mray::snap_point(p + 0.2f * vec3(p.y, p.z, -p.x));
        mray::Bvh found, expected;
        for (mray::Backend* const backend : {&tested, &reference}) backend->refit(scene.positions);
        tested.read_tree(found);
        reference.read_tree(expected);
        if (!same(found.nodes, expected.nodes) || !same(found.leaves, expected.leaves))
            return "refit";
    }
    return image_difference(tested, reference);
}

#ifdef MORPHRAY_HAS_VULKAN
namespace {

/// Longer than any machine takes for a dispatch of the test, compiling included.
constexpr std::uint64_t kTimeLimitMs = 20'000;

/// Results of this process, for users without a folder for files.
struct Results {
    std::mutex mutex;
    std::map<std::string, DeviceCheck> checks;
};

Results& results() {
    static Results all;
    return all;
}

/// A result belongs to a device, its driver, and a version of this library.
std::string key_of(const mray::gpu::DeviceInfo& info) {
    return info.uuid + '\n' + info.driver + '\n' + std::string(mray::kVersionDetail) + '\n';
}

/// Empty if the user has no folder.
std::filesystem::path file_of(const mray::gpu::DeviceInfo& info) {
    std::filesystem::path folder;
    if (const char* const cache = std::getenv("XDG_CACHE_HOME"); cache != nullptr && *cache != 0) {
        folder = cache;
    } else if (const char* const home = std::getenv("HOME"); home != nullptr && *home != 0) {
        folder = std::filesystem::path(home) / ".cache";
    } else {
        return {};
    }
    return folder / "morphray" / ("device-" + info.uuid);
}

/// What a file says, if it is of this key.
std::optional<DeviceCheck> read_check(const std::filesystem::path& path, const std::string& key) {
    std::ifstream file(path, std::ios::binary);
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    if (!text.starts_with(key)) return std::nullopt;
    std::istringstream rest(text.substr(key.size()));
    std::string word, problem;
    std::getline(rest, word);
    std::getline(rest, problem);
    if (word == "passed") return DeviceCheck{.passed = true};
    if (problem.empty() || (word != "wrong" && word != "lost")) return std::nullopt;
    return DeviceCheck{false, problem,
                       word == "wrong" ? ErrorCode::unavailable : ErrorCode::device_lost};
}

std::optional<DeviceCheck> kept_check(const mray::gpu::DeviceInfo& info) {
    const std::string key = key_of(info);
    if (const auto check = read_check(file_of(info), key)) return check;
    Results& all = results();
    const std::scoped_lock lock(all.mutex);
    const auto place = all.checks.find(key);
    return place != all.checks.end() ? std::optional(place->second) : std::nullopt;
}

void keep_check(const mray::gpu::DeviceInfo& info, const DeviceCheck& check) {
    const std::string key = key_of(info);
    {
        Results& all = results();
        const std::scoped_lock lock(all.mutex);
        all.checks[key] = check;
    }
    const char* const word = check.passed                           ? "passed"
                             : check.code == ErrorCode::device_lost ? "lost"
                                                                    : "wrong";
    const std::filesystem::path file = file_of(info);
    if (file.empty()) return;
    try {
        std::filesystem::create_directories(file.parent_path());
        mray::write_file(file, key + word + '\n' + check.problem + '\n');
    } catch (const std::exception&) {
        // Without the file the next process tests again.
    }
}

DeviceCheck failure(const mray::gpu::DeviceInfo& info, ErrorCode code, const std::string& what) {
    return {false,
            "Vulkan: " + info.name + " (" + info.driver + ") failed its self-test: " + what +
                "; update the driver and run `morphray devices --check`, or use the CPU backend",
            code};
}

DeviceCheck run_check(const mray::gpu::DeviceInfo& info) {
    try {
        const auto reference = mray::cpu::make_scalar_backend();
        const auto tested = mray::gpu::make_vulkan_backend(
            mray::gpu::open_device({.device = std::to_string(info.index)}), kTimeLimitMs);
        const std::string difference = find_difference(*tested, *reference);
        if (difference.empty()) return {.passed = true};
        return failure(info, ErrorCode::unavailable, difference + " differ from the CPU's bits");
    } catch (const mray::Error& error) {
        if (error.kind() == mray::ErrorKind::kDeviceLost)
            return failure(info, ErrorCode::device_lost, error.what());
        // A traversal that does not end, for one. A lack of memory says nothing about the device.
        if (error.kind() != mray::ErrorKind::kInternal) throw;
        return failure(info, ErrorCode::unavailable, error.what());
    }
}

}  // namespace

void require_sound_device(const VulkanOptions& options) {
    const mray::gpu::DeviceInfo info = mray::gpu::find_device(options.device);
    std::optional<DeviceCheck> check = kept_check(info);
    if (!check) {
        check = run_check(info);
        keep_check(info, *check);
    }
    if (!check->passed) throw Error(check->code, check->problem);
}
#endif

}  // namespace morphray::detail

namespace morphray {

#ifdef MORPHRAY_HAS_VULKAN
DeviceCheck check_vulkan_device(const std::string& device) {
    return detail::with_public_errors([&] {
        const mray::gpu::DeviceInfo info = mray::gpu::find_device(device);
        const DeviceCheck check = detail::run_check(info);
        detail::keep_check(info, check);
        return check;
    });
}

std::optional<DeviceCheck> kept_device_check(const std::string& device) {
    return detail::with_public_errors(
        [&] { return detail::kept_check(mray::gpu::find_device(device)); });
}

#else
DeviceCheck check_vulkan_device(const std::string&) {
    throw Error(ErrorCode::unavailable, "Vulkan: this library is built without it");
}
std::optional<DeviceCheck> kept_device_check(const std::string&) {
    throw Error(ErrorCode::unavailable, "Vulkan: this library is built without it");
}
#endif

}  // namespace morphray
