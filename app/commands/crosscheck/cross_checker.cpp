#include "app/commands/crosscheck/cross_checker.h"

#include <fmt/format.h>

#include "app/animation/frames.h"
#include "app/backends/backends.h"
#include "app/terminal/failure.h"
#include "common/simd/simd_target.h"
#include "cpu/cpu_backend.h"

namespace mray::app {
namespace {

constexpr double kAffordableTests = 2e9;

}  // namespace

std::vector<std::string> simd_to_check(const std::string& simd) {
    if (simd == kSimdOff) return {};
    if (!simd.empty()) return {find_simd_target(simd).name};
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

CheckedBackends make_checked_backends(const BackendOptions& options, const Messages& messages) {
    BackendOptions plain = options;
    plain.simd = std::string(kSimdOff);
    const auto make = [&](BackendChoice choice) { return make_backend(choice, plain, messages); };
    CheckedBackends backends;
    if (options.choice != BackendChoice::kCpu)
        backends.vulkan = {make(BackendChoice::kVulkan), make(BackendChoice::kVulkan), {}};
    backends.cpu = {make(BackendChoice::kCpu), make(BackendChoice::kCpu), {}};
    backends.brute = make(BackendChoice::kBrute);
    return backends;
}

CrossChecker::CrossChecker(const CrosscheckOptions& options, SceneFrames& scene,
                           CheckedBackends& backends, Json& report)
    : options_(options),
      scene_(scene),
      backends_(backends),
      report_(report),
      rays_({kRaysPrimary, kRaysShadow, kRaysAo}),
      simd_(simd_to_check(options.backend.simd)) {
    if (options.rays) rays_ = {*options.rays};
    const Topology& topology = scene.animation().topology();
    const std::span<const vec3> positions = scene.positions(report["frames"].front());
    const Bvh built = build_bvh(topology, positions, build_config(options.backend));
    const auto set_scene = [&](BackendPair& pair) {
        pair.refits->set_scene(topology, positions, built);
        pair.given->set_scene(topology, positions, built);
        pair.tree = built;
    };
    set_scene(backends_.cpu);
    if (backends_.vulkan) {
        set_scene(*backends_.vulkan);
        report["device"] = backends_.vulkan->refits->info().description;
    }
    backends_.brute->set_scene(topology, positions, built);
}

bool CrossChecker::checks_cpu() const { return options_.backend.choice != BackendChoice::kVulkan; }

bool CrossChecker::uses_brute(std::uint32_t rays) const {
    if (options_.reference != Reference::kAuto) return options_.reference == Reference::kBrute;
    return brute_is_affordable(scene_.animation().topology().triangles.size(), options_.view, rays);
}

ImageParams CrossChecker::params_for(std::uint32_t rays) const {
    ImageParams params = scene_.image_params(options_.view);
    params.rays = rays;
    return params;
}

void CrossChecker::refit(BackendPair& pair, std::span<const vec3> positions) {
    pair.refits->refit(positions);
    pair.refits->read_tree(pair.tree);
}

void CrossChecker::trace_reference(std::span<const vec3> positions, const Bvh& rebuilt) {
    backends_.brute->set_frame(positions, rebuilt);
    backends_.cpu.given->set_frame(positions, rebuilt);
    expected_.resize(rays_.size());
    for (std::size_t i = 0; i < rays_.size(); ++i) {
        const bool is_brute = uses_brute(rays_[i]);
        Backend& reference = is_brute ? *backends_.brute : *backends_.cpu.given;
        expected_[i].rays = rays_[i];
        expected_[i].reference = is_brute ? "brute" : "cpu";
        progress_->begin(fmt::format("frame {}, reference {}, {}", frame_, expected_[i].reference,
                                     name_of_rays(rays_[i])));
        reference.trace_image(params_for(rays_[i]), expected_[i].frame);
    }
}

bool CrossChecker::queries_use_brute() const {
    if (options_.reference != Reference::kAuto) return options_.reference == Reference::kBrute;
    // Two kinds of hit lists, windings and closest triangles.
    constexpr double kTests = 4;
    const auto triangles = static_cast<double>(scene_.animation().topology().triangles.size());
    return kTests * options_.query_count * triangles <= kAffordableTests;
}

void CrossChecker::query_reference(std::span<const vec3> positions) {
    if (options_.query_count == 0) return;
    batch_ = pseudo_random_batch(scene_.animation().topology(), positions, options_.query_count);
    Backend& reference = queries_use_brute() ? *backends_.brute : *backends_.cpu.given;
    expected_answers_ = answers_of(reference, batch_);
}

void CrossChecker::compare(Backend& backend, const std::string& simd, const std::string& refit_on) {
    CheckedImage image;
    image.variant = {backend.info().name, simd, refit_on.empty() ? "rebuild" : "refit", refit_on};
    image.frame = frame_;
    // The CPU without SIMD over the rebuilt tree is the reference itself.
    const bool is_cpu_reference =
        image.variant.backend == "cpu" && simd.empty() && refit_on.empty();
    Frame actual;
    for (const Expected& expected : expected_) {
        image.rays = expected.rays;
        image.reference = expected.reference;
        if (is_cpu_reference && image.reference == "cpu") continue;
        progress_->begin(fmt::format("frame {}, {}, {}", frame_, image.variant.name(),
                                     name_of_rays(image.rays)));
        backend.trace_image(params_for(expected.rays), actual);
        image.trace_ms = backend.finish().trace_ms;
        add_images(report_, options_, image, expected.frame, actual);
        throw_if_interrupted();
    }
    if (options_.query_count == 0 || (is_cpu_reference && !queries_use_brute())) return;
    image.reference = queries_use_brute() ? "brute" : "cpu";
    add_answers(report_, options_, image,
                compare_answers(expected_answers_, answers_of(backend, batch_)));
}

void CrossChecker::check_vulkan(std::span<const vec3> positions, const Bvh& rebuilt) {
    BackendPair& pair = *backends_.vulkan;
    refit(pair, positions);
    add_trees(report_, frame_, bvh_hash(backends_.cpu.tree), bvh_hash(pair.tree));
    compare(*pair.refits, "", "vulkan");
    pair.given->set_frame(positions, backends_.cpu.tree);
    compare(*pair.given, "", "cpu");
    pair.given->set_frame(positions, rebuilt);
    compare(*pair.given, "", "");
}

void CrossChecker::check_cpu(std::span<const vec3> positions, const Bvh& rebuilt) {
    compare(*backends_.cpu.refits, "", "cpu");
    if (backends_.vulkan) {
        backends_.cpu.given->set_frame(positions, backends_.vulkan->tree);
        compare(*backends_.cpu.given, "", "vulkan");
    }
    backends_.cpu.given->set_frame(positions, rebuilt);
    compare(*backends_.cpu.given, "", "");
    for (const std::string& simd : simd_) check_simd(simd, positions, rebuilt);
}

void CrossChecker::check_simd(const std::string& simd, std::span<const vec3> positions,
                              const Bvh& rebuilt) {
    const auto backend = cpu::make_cpu_backend({.threads = options_.backend.threads, .simd = simd});
    backend->watch_images(Watch(&interrupt_flag()));
    backend->set_scene(scene_.animation().topology(), positions, backends_.cpu.tree);
    compare(*backend, simd, "cpu");
    backend->set_frame(positions, rebuilt);
    compare(*backend, simd, "");
}

void CrossChecker::check(double frame, Progress& progress) {
    frame_ = frame;
    progress_ = &progress;
    const std::span<const vec3> positions = scene_.positions(frame);
    progress.begin(fmt::format("frame {}, tree", frame));
    refit(backends_.cpu, positions);
    const Bvh rebuilt =
        build_bvh(scene_.animation().topology(), positions, build_config(options_.backend));
    trace_reference(positions, rebuilt);
    query_reference(positions);
    if (backends_.vulkan) check_vulkan(positions, rebuilt);
    if (checks_cpu()) check_cpu(positions, rebuilt);
}

}  // namespace mray::app
