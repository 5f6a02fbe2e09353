#include "app/commands/crosscheck/cross_checker.h"

#include <fmt/format.h>

#include "app/backends.h"
#include "common/simd/simd_target.h"
#include "cpu/cpu_backend.h"

namespace mray::app {
namespace {

constexpr double kAffordableTests = 2e9;

}  // namespace

std::vector<std::string> simd_to_check(const std::string& asked) {
    if (asked == cpu::kSimdOff) return {};
    if (!asked.empty()) return {find_simd_target(asked).name};
    std::vector<std::string> names;
    for (const SimdTarget& target : supported_simd_targets()) {
        names.emplace_back(target.name);
    }
    return names;
}

bool brute_is_affordable(std::uint64_t triangles, const ViewSpec& view, std::uint32_t rays) {
    const double pixels = static_cast<double>(view.width) * view.height;
    const double rays_per_pixel = 1.0 + rays_per_hit(rays, view.ao_count);
    return static_cast<double>(triangles) * pixels * rays_per_pixel <= kAffordableTests;
}

CrossChecker::CrossChecker(const Options& options, SceneFrames& scene, double first_frame,
                           const std::vector<gpu::DeviceInfo>& devices, const Messages& messages)
    : options_(options),
      scene_(scene),
      params_(make_image_params(options.view, scene.clip().bounds(), scene.space())),
      simd_(simd_to_check(options.backend.simd)) {
    const Topology& topology = scene.clip().topology();
    BackendOptions plain = options.backend;
    plain.simd = cpu::kSimdOff;
    const auto make = [&](BackendChoice choice) { return make_backend(choice, plain, messages); };
    // The device first, because without one the build would be in vain.
    for (const gpu::DeviceInfo& device : devices) {
        plain.device = fmt::format("{}", device.index);
        Pair& pair = vulkan_.emplace_back();
        pair.refits = make(BackendChoice::kVulkan);
        pair.given = make(BackendChoice::kVulkan);
        if (devices.size() == 1) continue;
        pair.device = plain.device;
        pair.device_name = device.name;
    }
    cpu_.refits = make(BackendChoice::kCpu);
    cpu_.given = make(BackendChoice::kCpu);
    brute_ = make(BackendChoice::kBrute);
    const double build_at = options.tree.build_at.value_or(first_frame);
    const std::span<const vec3> positions = scene.positions(build_at);
    const Bvh built = build_bvh(topology, positions,
                                {.split = options.tree.split, .threads = options.backend.threads});
    const auto set_scene = [&](Pair& pair) {
        pair.refits->set_scene(topology, positions, built);
        pair.given->set_scene(topology, positions, built);
        pair.tree = built;
    };
    set_scene(cpu_);
    for (Pair& pair : vulkan_) set_scene(pair);
    brute_->set_scene(topology, positions, built);
}

bool CrossChecker::checks_cpu() const { return options_.backend.choice != BackendChoice::kVulkan; }

std::string CrossChecker::device() const {
    std::string text;
    for (const Pair& pair : vulkan_)
        text += (text.empty() ? "" : "; ") + pair.refits->description();
    return text;
}

bool CrossChecker::uses_brute(std::uint32_t rays) const {
    if (options_.reference != Reference::kAuto) return options_.reference == Reference::kBrute;
    return brute_is_affordable(scene_.clip().topology().triangles.size(), options_.view, rays);
}

std::size_t CrossChecker::variant_count(std::uint32_t rays) const {
    if (!checks_cpu()) return 3 * vulkan_.size();
    const std::size_t all = 2 + 4 * vulkan_.size() + 2 * simd_.size();
    return uses_brute(rays) ? all : all - 1;
}

ImageParams CrossChecker::params_for(std::uint32_t rays) const {
    ImageParams params = params_;
    params.rays = rays;
    return params;
}

void CrossChecker::refit(Pair& pair, std::span<const vec3> positions) {
    pair.refits->refit(positions);
    pair.refits->read_tree(pair.tree);
}

void CrossChecker::trace_reference(std::span<const vec3> positions, const Bvh& rebuilt,
                                   const std::vector<std::uint32_t>& rays) {
    brute_->set_frame(positions, rebuilt);
    cpu_.given->set_frame(positions, rebuilt);
    expected_.resize(rays.size());
    for (std::size_t i = 0; i < rays.size(); ++i) {
        Backend& reference = uses_brute(rays[i]) ? *brute_ : *cpu_.given;
        expected_[i].rays = rays[i];
        expected_[i].reference = uses_brute(rays[i]) ? "brute" : "cpu";
        reference.trace_image(params_for(rays[i]), expected_[i].frame);
    }
}

void CrossChecker::compare_variant(const Variant& variant, double frame, const OnRow& on_row) {
    Frame actual;
    for (const Expected& expected : expected_) {
        CheckRow row;
        row.frame = frame;
        row.backend = variant.backend->name();
        row.simd = variant.simd;
        row.update = variant.update;
        row.refit_on = variant.refit_on;
        row.rays = name_of_rays(expected.rays);
        row.reference = expected.reference;
        if (variant.device != nullptr) {
            row.device = variant.device->device;
            row.device_name = variant.device->device_name;
        }
        // The CPU without SIMD over the rebuilt tree is the reference itself.
        if (row.reference == row.backend && row.simd.empty() && row.update == "rebuild") continue;
        variant.backend->trace_image(params_for(expected.rays), actual);
        row.trace_ms = variant.backend->times().trace_ms;
        compare(expected.frame, actual, row);
        on_row(row, expected.frame, actual);
    }
}

void CrossChecker::check_vulkan(Pair& pair, std::span<const vec3> positions, const Bvh& rebuilt,
                                double frame, const OnRow& on_row) {
    compare_variant({pair.refits.get(), "", "refit", "vulkan", &pair}, frame, on_row);
    pair.given->set_frame(positions, cpu_.tree);
    compare_variant({pair.given.get(), "", "refit", "cpu", &pair}, frame, on_row);
    pair.given->set_frame(positions, rebuilt);
    compare_variant({pair.given.get(), "", "rebuild", "", &pair}, frame, on_row);
}

void CrossChecker::check_cpu(std::span<const vec3> positions, const Bvh& rebuilt, double frame,
                             const OnRow& on_row) {
    compare_variant({cpu_.refits.get(), "", "refit", "cpu"}, frame, on_row);
    for (const Pair& pair : vulkan_) {
        cpu_.given->set_frame(positions, pair.tree);
        compare_variant({cpu_.given.get(), "", "refit", "vulkan", &pair}, frame, on_row);
    }
    cpu_.given->set_frame(positions, rebuilt);
    compare_variant({cpu_.given.get(), "", "rebuild", ""}, frame, on_row);
    for (const std::string& simd : simd_) check_simd(simd, positions, rebuilt, frame, on_row);
}

void CrossChecker::check_simd(const std::string& simd, std::span<const vec3> positions,
                              const Bvh& rebuilt, double frame, const OnRow& on_row) {
    const auto backend = cpu::make_cpu_backend({.threads = options_.backend.threads, .simd = simd});
    backend->set_scene(scene_.clip().topology(), positions, cpu_.tree);
    compare_variant({backend.get(), simd, "refit", "cpu"}, frame, on_row);
    backend->set_frame(positions, rebuilt);
    compare_variant({backend.get(), simd, "rebuild", ""}, frame, on_row);
}

CheckedFrame CrossChecker::check(double frame, const std::vector<std::uint32_t>& rays,
                                 const OnRow& on_row) {
    const std::span<const vec3> positions = scene_.positions(frame);
    refit(cpu_, positions);
    const Bvh rebuilt =
        build_bvh(scene_.clip().topology(), positions,
                  {.split = options_.tree.split, .threads = options_.backend.threads});
    trace_reference(positions, rebuilt, rays);
    CheckedFrame checked;
    for (const Expected& expected : expected_) {
        checked.references.push_back({frame, name_of_rays(expected.rays), expected.reference,
                                      count_hits(expected.frame), hits_hash(expected.frame),
                                      image_hash(expected.frame)});
    }
    for (Pair& pair : vulkan_) {
        refit(pair, positions);
        checked.trees.push_back({frame, bvh_hash(cpu_.tree), bvh_hash(pair.tree), pair.device});
        check_vulkan(pair, positions, rebuilt, frame, on_row);
    }
    if (checks_cpu()) check_cpu(positions, rebuilt, frame, on_row);
    return checked;
}

}  // namespace mray::app
