#include "library/src/device_impl.h"

#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <random>
#include <sstream>

#include "common/base/output_file.h"
#include "common/bvh/builder/bvh_builder.h"
#include "common/interop/arithmetic.h"
#include "common/scene/pose.h"
#include "common/version.h"
#include "library/src/scene/errors.h"
#include "morphray/version.hpp"
#ifdef MORPHRAY_HAS_VULKAN
#include "gpu/vulkan_backend.h"
#endif

namespace morphray {
namespace detail {

#ifndef MORPHRAY_HAS_VULKAN
[[noreturn]] static void throw_no_vulkan() {
    throw Error(ErrorCode::unavailable, "Vulkan: this library is built without it");
}
#endif

DeviceImpl::DeviceImpl(Kind kind, const CpuOptions& cpu, const VulkanOptions& vulkan)
    : kind_(kind),
      cpu_(cpu),
      vulkan_(vulkan),
      arena_(cpu.threads),
      simd_target_(mray::find_simd_target(cpu.simd == mray::kSimdOff ? "scalar" : cpu.simd)) {
#ifdef MORPHRAY_HAS_VULKAN
    if (kind_ == Kind::vulkan) {
        const std::optional<DeviceCheck> kept = kept_device_check(vulkan_.device);
        const DeviceCheck check = kept ? *kept : check_vulkan_device(vulkan_.device);
        if (!check.passed) throw Error(check.code, check.problem);
    }
#endif
    const std::unique_ptr<mray::Backend> backend = make_backend();
    name_ = backend->info().name;
    description_ = backend->info().description;
}

std::unique_ptr<mray::Backend> DeviceImpl::make_backend() {
    const mray::cpu::CpuConfig config{.threads = cpu_.threads, .simd = cpu_.simd};
    if (kind_ == Kind::cpu) return mray::cpu::make_cpu_backend(config);
    if (kind_ == Kind::brute) return mray::cpu::make_brute_backend(config);
#ifdef MORPHRAY_HAS_VULKAN
    std::unique_lock lock(mutex_);
    if (shared_ == nullptr || mray::gpu::is_lost(*shared_))
        shared_ = mray::gpu::open_device({.device = vulkan_.device, .validate = vulkan_.validate});
    const std::shared_ptr<mray::gpu::SharedDevice> shared = shared_;
    lock.unlock();
    return mray::gpu::make_backend_on(shared);
#else
    throw_no_vulkan();
#endif
}

Device DeviceImpl::make(Kind kind, const CpuOptions& cpu, const VulkanOptions& vulkan) {
    return with_public_errors([&] {
        if (cpu.threads < 0) throw_bad_argument("threads: must not be negative");
        return Device(std::make_shared<DeviceImpl>(kind, cpu, vulkan));
    });
}

// ---- The self-test of a Vulkan device

namespace {

using mray::vec3;

constexpr float kUnit = 0x1p16f;

/// Triangles of all shapes, which hide each other. Returns their positions.
std::vector<vec3> make_scene(mray::Topology& topology) {
    constexpr std::uint32_t kTriangles = 1500;
    std::vector<vec3> positions;
    std::mt19937 random(1);
    const auto in = [&](float size) {
        return size * (static_cast<float>(random() % 20001) * 1e-4f - 1);
    };
    for (std::uint32_t i = 0; i < kTriangles; ++i) {
        const vec3 centre(in(3), in(2), in(3));
        const float size = i % 3 == 0 ? 1e-3f : 0.3f;
        for (int k = 0; k < 3; ++k) {
            const vec3 corner = centre + vec3(in(size), in(size), in(size));
            positions.push_back(mray::snap_point(corner * kUnit));
        }
        topology.triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
        topology.albedo.push_back(0xFF404040u + i * 0x010305u);
    }
    topology.vertex_count = 3 * kTriangles;
    return positions;
}

mray::ImageParams make_view(std::uint32_t rays) {
    mray::ImageParams params = {};
    params.width = 96;
    params.height = 64;
    params.camera.org = vec3(0, 3, 6) * kUnit;
    params.camera.corner = vec3(-0.75f, 0.1f, -1);
    params.camera.du = vec3(1.0f / 64, 0, 0);
    params.camera.dv = vec3(0, -1.0f / 64, 0);
    params.light = vec3(-6, 8, 5) * kUnit;
    params.ao_tfar = 1.5f * kUnit;
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

/// Rays to vertices, edges and insides of triangles from vertices and between them, because
/// rounding matters most where something touches.
std::vector<mray::Ray> make_rays(std::span<const vec3> positions) {
    constexpr std::size_t kRays = 2000;
    std::mt19937 random(2);
    const auto pick = [&] { return positions[random() % positions.size()]; };
    std::vector<mray::Ray> rays;
    for (std::size_t i = 0; i < kRays; ++i) {
        const vec3 org = i % 2 == 0 ? pick() : mray::snap_point((pick() + pick()) * 0.5f);
        const vec3* const corner = &positions[random() % (positions.size() / 3) * 3];
        const vec3 targets[] = {corner[0], (corner[0] + corner[1]) * 0.5f,
                                (corner[0] + corner[1] + corner[2]) * 0.3f};
        rays.push_back({org, 0, mray::canonical_direction(targets[i % 3] - org), mray::kInfiniteT});
    }
    return rays;
}

/// The answers to rays, and about the points where they start, as bytes.
std::string answers_of(mray::Backend& backend, std::span<const mray::Ray> rays) {
    std::vector<vec3> points;
    for (const mray::Ray& ray : rays) points.push_back(ray.org);
    std::string bytes;
    const auto add = [&](const auto& answers) {
        bytes.append(reinterpret_cast<const char*>(answers.data()),
                     answers.size() * sizeof(answers[0]));
    };
    std::vector<mray::Hit> hits(rays.size());
    backend.trace({rays, hits});
    add(hits);
    const std::vector<mray::HitCursor> start(rays.size());
    backend.query(mray::NextQuery{rays, start, mray::Crossing::kOwner, hits});
    add(hits);
    std::vector<mray::FloatWinding> windings(rays.size());
    std::vector<mray::UncertainCrossing> uncertain;
    backend.query(mray::WindingQuery{points, windings, uncertain});
    add(windings);
    std::ranges::sort(uncertain);
    add(uncertain);
    std::vector<mray::ClosestTriangle> closest(rays.size());
    backend.query(mray::ClosestQuery{points, mray::kAnyDistance2, closest});
    add(closest);
    return bytes;
}

/// Refits both to the last move of their pose, and compares the trees.
bool refits_equal(mray::Backend& tested, mray::Backend& reference,
                  mray::RefitExtent extent = mray::RefitExtent::kMoved) {
    mray::Bvh found, expected;
    tested.refit(extent);
    reference.refit(extent);
    tested.read_tree(found);
    reference.read_tree(expected);
    return same(found.nodes, expected.nodes) && same(found.leaves, expected.leaves);
}

/// Moves the scene of both by a matrix, which a device applies itself, and compares the trees.
bool moves_bodies_alike(mray::Backend& tested, mray::Backend& reference, mray::Pose& pose) {
    const std::span<const vec3> positions = pose.positions();
    const std::vector<vec3> rest(positions.begin(), positions.end());
    // Within the bounds of a space whose middle is not 0.
    constexpr float k = 0x1p-22f;
    const mray::Body body{.rest = rest,
                          .rest_version = 1,
                          .transform = {{0.8f * k, -0.6f * k, 0.1f * k, 6.4f},
                                        {0.6f * k, 0.8f * k, -0.1f * k, 6.7f},
                                        {0.03f * k, 0.2f * k, 0.9f * k, 6.5f}},
                          .space = mray::SceneSpace({.lower = {6, 6, 6}, .upper = {7, 7, 7}})};
    std::vector<vec3> moved;
    for (const vec3& p : rest)
        moved.push_back(body.space.to_scene(mray::transform_point(body.transform, p)));
    pose.move_to(moved);
    pose.add_body(body);
    const bool is_equal = refits_equal(tested, reference);
    pose.forget_bodies();
    return is_equal;
}

/// True if both backends make the same boxes of triangles that are this point.
bool refits_alike(mray::Backend& tested, mray::Backend& reference, const vec3& point) {
    mray::Topology topology;
    topology.triangles = {{0, 1, 2}};
    topology.albedo = {0};
    topology.vertex_count = 3;
    const mray::Pose pose(std::vector<vec3>(3, point));
    const mray::Bvh bvh = mray::build_bvh(topology, pose.positions());
    for (mray::Backend* const backend : {&tested, &reference})
        backend->set_scene(topology, pose, bvh);
    return refits_equal(tested, reference, mray::RefitExtent::kAll);
}

}  // namespace

std::string find_difference(mray::Backend& tested, mray::Backend& reference) {
    mray::Topology topology;
    std::vector<vec3> positions = make_scene(topology);
    mray::Pose pose(positions);
    const mray::Bvh bvh = mray::build_bvh(topology, positions);
    for (mray::Backend* const backend : {&tested, &reference})
        backend->set_scene(topology, pose, bvh);
    for (int move = 0; move < 2; ++move) {
        const std::string difference = image_difference(tested, reference);
        if (!difference.empty()) return difference;
        for (vec3& p : positions) p = mray::snap_point(p + 0.2f * vec3(p.y, p.z, -p.x));
        pose.move_to(positions);
        if (!refits_equal(tested, reference)) return "refit";
    }
    const std::string difference = image_difference(tested, reference);
    if (!difference.empty()) return difference;
    if (!moves_bodies_alike(tested, reference, pose)) return "bodies";
    const std::vector<mray::Ray> rays = make_rays(pose.positions());
    if (answers_of(tested, rays) != answers_of(reference, rays)) return "answers to queries";
    return refits_alike(tested, reference, vec3(0.0f, -0.0f, 0.0f)) ? "" : "signs of zeros";
}

bool flushes_denormals(mray::Backend& tested, mray::Backend& reference) {
    return !refits_alike(tested, reference, vec3(0x1p-140f));
}

#ifdef MORPHRAY_HAS_VULKAN
namespace {

/// Rays of the test take more steps than that.
constexpr std::uint32_t kShortBudget = 200;

/// A result belongs to a device, its driver, and a version of this library.
std::string key_of(const mray::gpu::DeviceInfo& info) {
    return info.uuid + '\n' + info.driver + '\n' + std::string(mray::kVersionDetail) + '\n';
}

/// Empty if the user has no folder.
std::filesystem::path file_of(const mray::gpu::DeviceInfo& info) {
    const std::filesystem::path file = "morphray/device-" + info.uuid;
    if (const char* const cache = std::getenv("XDG_CACHE_HOME"); cache != nullptr && *cache != 0)
        return cache / file;
    if (const char* const home = std::getenv("HOME"); home != nullptr && *home != 0)
        return std::filesystem::path(home) / ".cache" / file;
    return {};
}

std::optional<DeviceCheck> kept_check(const mray::gpu::DeviceInfo& info) {
    const std::string key = key_of(info);
    std::ifstream file(file_of(info), std::ios::binary);
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    if (!text.starts_with(key)) return std::nullopt;
    std::istringstream rest(text.substr(key.size()));
    std::string word, problem;
    std::getline(rest, word);
    std::getline(rest, problem);
    if (word == "passed") return DeviceCheck{.passed = true, .note = problem};
    if (problem.empty() || (word != "wrong" && word != "lost")) return std::nullopt;
    return DeviceCheck{false, problem,
                       word == "wrong" ? ErrorCode::unavailable : ErrorCode::device_lost};
}

void keep_check(const mray::gpu::DeviceInfo& info, const DeviceCheck& check) {
    const char* const word = check.passed                           ? "passed"
                             : check.code == ErrorCode::device_lost ? "lost"
                                                                    : "wrong";
    const std::filesystem::path file = file_of(info);
    if (file.empty()) return;
    try {
        std::filesystem::create_directories(file.parent_path());
        mray::write_file(file, key_of(info) + word + '\n' + check.problem + check.note + '\n');
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
        using enum mray::gpu::BufferKind;
        const auto reference = mray::cpu::make_scalar_backend();
        std::unique_ptr<mray::Backend> tested;
        // The second one suspends rays, and has buffers as large scenes may need them.
        for (const mray::gpu::Tuning& tuning : std::initializer_list<mray::gpu::Tuning>{
                 {},
                 {.step_budget = kShortBudget,
                 .buffer_kind = info.prefers_texels ? kStorage : kTexels}}) {
            tested = mray::gpu::make_vulkan_backend({.device = std::to_string(info.index)}, tuning);
            const std::string difference = find_difference(*tested, *reference);
            if (!difference.empty())
                return failure(info, ErrorCode::unavailable,
                               difference + " differ from the CPU's bits");
        }
        const bool flushes = flushes_denormals(*tested, *reference);
        return {.passed = true, .note = flushes ? "denormals become 0, which changes no bit" : ""};
    } catch (const mray::Error& error) {
        if (error.kind() == mray::ErrorKind::kDeviceLost)
            return failure(info, ErrorCode::device_lost, error.what());
        // A traversal that does not end, for one. A lack of memory says nothing about the device.
        if (error.kind() != mray::ErrorKind::kInternal) throw;
        return failure(info, ErrorCode::unavailable, error.what());
    }
}

}  // namespace
#endif

}  // namespace detail

using namespace detail;

const char* version() noexcept { return mray::kVersion.data(); }

Device::Device(std::shared_ptr<DeviceImpl> impl) : impl_(std::move(impl)) {}

Device Device::cpu(const CpuOptions& options) {
    return DeviceImpl::make(DeviceImpl::Kind::cpu, options, {});
}
Device Device::vulkan(const VulkanOptions& options) {
    return DeviceImpl::make(DeviceImpl::Kind::vulkan, {}, options);
}
Device Device::brute_force(const CpuOptions& options) {
    return DeviceImpl::make(DeviceImpl::Kind::brute, options, {});
}

const std::string& Device::name() const { return impl_->name(); }
std::string Device::description() const { return impl_->description(); }

std::vector<std::string> simd_targets() {
    return with_public_errors([] {
        std::vector<std::string> names;
        for (const mray::SimdTarget& target : mray::supported_simd_targets())
            names.emplace_back(target.name);
        return names;
    });
}

#ifdef MORPHRAY_HAS_VULKAN
std::vector<VulkanDeviceInfo> vulkan_devices() {
    return with_public_errors([] {
        std::vector<VulkanDeviceInfo> infos;
        for (const mray::gpu::DeviceInfo& info : mray::gpu::list_devices()) {
            infos.push_back({info.index, info.name, info.type, info.driver, info.uuid,
                             info.api_major, info.api_minor, info.memory_bytes, info.subgroup_size,
                             info.unusable, info.promises_floats});
        }
        return infos;
    });
}

DeviceCheck check_vulkan_device(const std::string& device) {
    return with_public_errors([&] {
        const mray::gpu::DeviceInfo info = mray::gpu::find_device(device);
        const DeviceCheck check = run_check(info);
        keep_check(info, check);
        return check;
    });
}

std::optional<DeviceCheck> kept_device_check(const std::string& device) {
    return with_public_errors([&] { return kept_check(mray::gpu::find_device(device)); });
}

DeviceCheck keep_lost_device(const std::string& device, const std::string& what) {
    return with_public_errors([&] {
        const mray::gpu::DeviceInfo info = mray::gpu::find_device(device);
        const DeviceCheck check = failure(info, ErrorCode::device_lost, what);
        keep_check(info, check);
        return check;
    });
}
#else
std::vector<VulkanDeviceInfo> vulkan_devices() { throw_no_vulkan(); }
DeviceCheck check_vulkan_device(const std::string&) { throw_no_vulkan(); }
std::optional<DeviceCheck> kept_device_check(const std::string&) { throw_no_vulkan(); }
DeviceCheck keep_lost_device(const std::string&, const std::string&) { throw_no_vulkan(); }
#endif

}  // namespace morphray
