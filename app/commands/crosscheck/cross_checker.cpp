#include "app/commands/crosscheck/cross_checker.h"

#include <fmt/format.h>

#include "app/backends/backends.h"
#include "app/clip/frames.h"
#include "app/terminal/progress.h"
#include "common/simd/simd_target.h"
#include "cpu/cpu_backend.h"

namespace mray::app {
namespace {

constexpr double kAffordableTests = 2e9;

}  // namespace

std::vector<std::string> simd_to_check(const std::string& asked) {
    if (asked == kSimdOff) return {};
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

CheckedBackends make_checked_backends(const BackendOptions& options,
                                      const std::vector<morphray::VulkanDeviceInfo>& devices,
                                      const Messages& messages) {
    BackendOptions plain = options;
    plain.simd = std::string(kSimdOff);
    const auto make = [&](BackendChoice choice) { return make_backend(choice, plain, messages); };
    CheckedBackends backends;
    for (const morphray::VulkanDeviceInfo& device : devices) {
        plain.device = fmt::format("{}", device.index);
        BackendPair& pair = backends.vulkan.emplace_back();
        pair.refits = make(BackendChoice::kVulkan);
        pair.given = make(BackendChoice::kVulkan);
        if (devices.size() == 1) continue;
        pair.device = plain.device;
        pair.device_name = device.name;
    }
    backends.cpu.refits = make(BackendChoice::kCpu);
    backends.cpu.given = make(BackendChoice::kCpu);
    backends.brute = make(BackendChoice::kBrute);
    return backends;
}

CrossChecker::CrossChecker(const CrosscheckOptions& options, SceneFrames& scene, double first_frame,
                           CheckedBackends& backends)
    : options_(options),
      scene_(scene),
      simd_(simd_to_check(options.backend.simd)),
      backends_(backends) {
    const Topology& topology = scene.clip().topology();
    const std::span<const vec3> positions = scene.positions(first_frame);
    const Bvh built = build_bvh(topology, positions, build_config(options.split, options.backend));
    const auto set_scene = [&](BackendPair& pair) {
        pair.refits->set_scene(topology, positions, built);
        pair.given->set_scene(topology, positions, built);
        pair.tree = built;
    };
    set_scene(backends_.cpu);
    for (BackendPair& pair : backends_.vulkan) set_scene(pair);
    backends_.brute->set_scene(topology, positions, built);
}

bool CrossChecker::checks_cpu() const { return options_.backend.choice != BackendChoice::kVulkan; }

std::string CrossChecker::device() const {
    std::string text;
    for (const BackendPair& pair : backends_.vulkan)
        text += (text.empty() ? "" : "; ") + pair.refits->info().description;
    return text;
}

bool CrossChecker::uses_brute(std::uint32_t rays) const {
    if (options_.reference != Reference::kAuto) return options_.reference == Reference::kBrute;
    return brute_is_affordable(scene_.clip().topology().triangles.size(), options_.view, rays);
}

std::size_t CrossChecker::variant_count(std::uint32_t rays) const {
    if (!checks_cpu()) return 3 * backends_.vulkan.size();
    const std::size_t all = 2 + 4 * backends_.vulkan.size() + 2 * simd_.size();
    return uses_brute(rays) ? all : all - 1;
}

ImageParams CrossChecker::params_for(std::uint32_t rays) const {
    ImageParams params = image_params(options_.view, scene_);
    params.rays = rays;
    return params;
}

void CrossChecker::refit(BackendPair& pair, std::span<const vec3> positions) {
    pair.refits->refit(positions);
    pair.refits->read_tree(pair.tree);
}

void CrossChecker::trace_reference(std::span<const vec3> positions, const Bvh& rebuilt,
                                   const std::vector<std::uint32_t>& rays) {
    backends_.brute->set_frame(positions, rebuilt);
    backends_.cpu.given->set_frame(positions, rebuilt);
    expected_.resize(rays.size());
    for (std::size_t i = 0; i < rays.size(); ++i) {
        Backend& reference = uses_brute(rays[i]) ? *backends_.brute : *backends_.cpu.given;
        expected_[i].rays = rays[i];
        expected_[i].reference = uses_brute(rays[i]) ? "brute" : "cpu";
        on_image_(fmt::format("reference {}, {}", expected_[i].reference, name_of_rays(rays[i])),
                  false);
        reference.trace_image(params_for(rays[i]), expected_[i].frame);
    }
}

bool CrossChecker::queries_use_brute() const {
    if (options_.reference != Reference::kAuto) return options_.reference == Reference::kBrute;
    // Two kinds of hit lists, windings and closest triangles.
    constexpr double kTests = 4;
    const auto triangles = static_cast<double>(scene_.clip().topology().triangles.size());
    return kTests * options_.query_count * triangles <= kAffordableTests;
}

void CrossChecker::ask_reference(std::span<const vec3> positions, double frame) {
    query_rows_.clear();
    if (options_.query_count == 0) return;
    questions_ = pseudo_random_questions(scene_.clip().topology(), positions, options_.query_count);
    Backend& reference = queries_use_brute() ? *backends_.brute : *backends_.cpu.given;
    expected_answers_ = answers_of(reference, questions_);
    query_row_ = {frame, "", queries_use_brute() ? "brute" : "cpu", options_.query_count};
}

void CrossChecker::compare_queries(const Variant& variant, const std::string& name) {
    query_row_.variant = name;
    query_row_.difference =
        compare_answers(expected_answers_, answers_of(*variant.backend, questions_));
    query_rows_.push_back(query_row_);
}

void CrossChecker::compare_variant(const Variant& variant, double frame, const OnRow& on_row) {
    CheckRow row;
    row.frame = frame;
    row.backend = variant.backend->info().name;
    row.simd = variant.simd;
    row.update = variant.update;
    row.refit_on = variant.refit_on;
    if (variant.device != nullptr) {
        row.device = variant.device->device;
        row.device_name = variant.device->device_name;
    }
    // The CPU without SIMD over the rebuilt tree is the reference itself.
    const auto is_reference = [&row](const std::string& reference) {
        return reference == row.backend && row.simd.empty() && row.update == "rebuild";
    };
    Frame actual;
    for (const Expected& expected : expected_) {
        row.rays = name_of_rays(expected.rays);
        row.reference = expected.reference;
        if (is_reference(row.reference)) continue;
        on_image_(fmt::format("{}, {}", row.variant(), row.rays), true);
        variant.backend->trace_image(params_for(expected.rays), actual);
        row.trace_ms = variant.backend->finish().trace_ms;
        compare(expected.frame, actual, row);
        on_row(row);
    }
    if (options_.query_count > 0 && !is_reference(query_row_.reference))
        compare_queries(variant, row.variant());
}

void CrossChecker::check_vulkan(BackendPair& pair, std::span<const vec3> positions,
                                const Bvh& rebuilt, double frame, const OnRow& on_row) {
    compare_variant({pair.refits.get(), "", "refit", "vulkan", &pair}, frame, on_row);
    pair.given->set_frame(positions, backends_.cpu.tree);
    compare_variant({pair.given.get(), "", "refit", "cpu", &pair}, frame, on_row);
    pair.given->set_frame(positions, rebuilt);
    compare_variant({pair.given.get(), "", "rebuild", "", &pair}, frame, on_row);
}

void CrossChecker::check_cpu(std::span<const vec3> positions, const Bvh& rebuilt, double frame,
                             const OnRow& on_row) {
    compare_variant({backends_.cpu.refits.get(), "", "refit", "cpu"}, frame, on_row);
    for (const BackendPair& pair : backends_.vulkan) {
        backends_.cpu.given->set_frame(positions, pair.tree);
        compare_variant({backends_.cpu.given.get(), "", "refit", "vulkan", &pair}, frame, on_row);
    }
    backends_.cpu.given->set_frame(positions, rebuilt);
    compare_variant({backends_.cpu.given.get(), "", "rebuild", ""}, frame, on_row);
    for (const std::string& simd : simd_) check_simd(simd, positions, rebuilt, frame, on_row);
}

void CrossChecker::check_simd(const std::string& simd, std::span<const vec3> positions,
                              const Bvh& rebuilt, double frame, const OnRow& on_row) {
    const auto backend = cpu::make_cpu_backend({.threads = options_.backend.threads, .simd = simd});
    backend->watch_images(command_watch());
    backend->set_scene(scene_.clip().topology(), positions, backends_.cpu.tree);
    compare_variant({backend.get(), simd, "refit", "cpu"}, frame, on_row);
    backend->set_frame(positions, rebuilt);
    compare_variant({backend.get(), simd, "rebuild", ""}, frame, on_row);
}

CheckedFrame CrossChecker::check(double frame, const std::vector<std::uint32_t>& rays,
                                 const OnImage& on_image, const OnRow& on_row) {
    on_image_ = on_image;
    const std::span<const vec3> positions = scene_.positions(frame);
    on_image_("tree", false);
    refit(backends_.cpu, positions);
    const Bvh rebuilt = build_bvh(scene_.clip().topology(), positions,
                                  build_config(options_.split, options_.backend));
    trace_reference(positions, rebuilt, rays);
    ask_reference(positions, frame);
    CheckedFrame checked;
    for (BackendPair& pair : backends_.vulkan) {
        refit(pair, positions);
        checked.trees.push_back(
            {frame, bvh_hash(backends_.cpu.tree), bvh_hash(pair.tree), pair.device});
        check_vulkan(pair, positions, rebuilt, frame, on_row);
    }
    if (checks_cpu()) check_cpu(positions, rebuilt, frame, on_row);
    checked.queries = query_rows_;
    return checked;
}

}  // namespace mray::app
