#include "app/commands/crosscheck/cross_checker.h"

#include <fmt/format.h>

#include "app/backends/backends.h"
#include "app/terminal/failure.h"
#include "common/simd/simd_target.h"

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

bool brute_is_affordable(std::uint64_t triangles, const morphray::View& view, morphray::Rays rays) {
    const double pixels = static_cast<double>(view.width) * view.height;
    const double rays_per_pixel =
        1.0 + rays_per_hit(static_cast<std::uint32_t>(rays), view.ao_count);
    return static_cast<double>(triangles) * pixels * rays_per_pixel <= kAffordableTests;
}

CheckedDevices open_checked_devices(const BackendOptions& options, const Messages& messages) {
    const auto open = [&](BackendChoice choice, const std::string& simd) {
        BackendOptions one = options;
        one.choice = choice;
        one.simd = simd;
        return open_device(one, messages);
    };
    const std::string off(kSimdOff);
    std::optional<morphray::Device> vulkan;
    if (options.choice != BackendChoice::kCpu) vulkan = open(BackendChoice::kVulkan, off);
    CheckedDevices devices = {
        vulkan, open(BackendChoice::kCpu, off), open(BackendChoice::kBrute, off), {}};
    if (options.choice != BackendChoice::kVulkan)
        for (const std::string& simd : simd_to_check(options.simd))
            devices.simd.emplace_back(simd, open(BackendChoice::kCpu, simd));
    return devices;
}

CrossChecker::CrossChecker(const CrosscheckOptions& options, const Animation& animation,
                           const CheckedDevices& devices, Json& report, const Messages& messages)
    : options_(options),
      topology_(animation.topology()),
      devices_(devices),
      report_(report),
      view_(world_view(options.view, animation)),
      rays_({morphray::Rays::primary, morphray::Rays::shadow, morphray::Rays::ao}),
      scene_(devices.cpu, {.view = {}, .tree = {.update = {PolicyKind::kRefit}}}, animation,
             report["frames"].front(), messages),
      cpu_given_(engine::copy_on(devices.cpu, scene_.scene())),
      brute_(engine::copy_on(devices.brute, scene_.scene())) {
    if (options.rays) rays_ = {*options.rays};
    if (!devices.vulkan) return;
    vulkan_refits_ = engine::copy_on(*devices.vulkan, scene_.scene());
    vulkan_given_ = engine::copy_on(*devices.vulkan, scene_.scene());
    report["device"] = devices.vulkan->description();
}

bool CrossChecker::checks_cpu() const { return options_.backend.choice != BackendChoice::kVulkan; }

bool CrossChecker::uses_brute(morphray::Rays rays) const {
    if (options_.reference != Reference::kAuto) return options_.reference == Reference::kBrute;
    return brute_is_affordable(topology_.triangles.size(), options_.view, rays);
}

ImageParams CrossChecker::params_for(morphray::Rays rays) const {
    morphray::View view = view_;
    view.rays = rays;
    return engine::image_params(scene_.scene(), view);
}

void CrossChecker::trace_reference() {
    brute_->set_frame(positions(), rebuilt_);
    cpu_given_->set_frame(positions(), rebuilt_);
    expected_.resize(rays_.size());
    for (std::size_t i = 0; i < rays_.size(); ++i) {
        const bool is_brute = uses_brute(rays_[i]);
        expected_[i].rays = rays_[i];
        expected_[i].reference = is_brute ? "brute" : "cpu";
        progress_->begin(fmt::format("frame {}, reference {}, {}", frame_, expected_[i].reference,
                                     name_of_rays(rays_[i])));
        (is_brute ? brute_ : cpu_given_)->trace_image(params_for(rays_[i]), expected_[i].frame);
    }
}

bool CrossChecker::queries_use_brute() const {
    if (options_.reference != Reference::kAuto) return options_.reference == Reference::kBrute;
    // Two kinds of hit lists, windings and closest triangles.
    constexpr double kTests = 4;
    const auto triangles = static_cast<double>(topology_.triangles.size());
    return kTests * options_.query_count * triangles <= kAffordableTests;
}

void CrossChecker::query_reference() {
    if (options_.query_count == 0) return;
    batch_ = pseudo_random_batch(topology_, positions(), options_.query_count);
    expected_answers_ = answers_of(queries_use_brute() ? *brute_ : *cpu_given_, batch_);
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

void CrossChecker::check_vulkan() {
    vulkan_refits_->refit(positions());
    vulkan_refits_->read_tree(vulkan_tree_);
    add_trees(report_, frame_, bvh_hash(cpu_tree_), bvh_hash(vulkan_tree_));
    compare(*vulkan_refits_, "", "vulkan");
    vulkan_given_->set_frame(positions(), cpu_tree_);
    compare(*vulkan_given_, "", "cpu");
    vulkan_given_->set_frame(positions(), rebuilt_);
    compare(*vulkan_given_, "", "");
}

void CrossChecker::check_cpu() {
    compare(engine::backend(scene_.scene()), "", "cpu");
    if (devices_.vulkan) {
        cpu_given_->set_frame(positions(), vulkan_tree_);
        compare(*cpu_given_, "", "vulkan");
    }
    cpu_given_->set_frame(positions(), rebuilt_);
    compare(*cpu_given_, "", "");
    for (const auto& [simd, device] : devices_.simd) {
        const std::unique_ptr<Backend> backend = engine::copy_on(device, scene_.scene());
        compare(*backend, simd, "cpu");
        backend->set_frame(positions(), rebuilt_);
        compare(*backend, simd, "");
    }
}

void CrossChecker::check(double frame, Progress& progress) {
    frame_ = frame;
    progress_ = &progress;
    progress.begin(fmt::format("frame {}, tree", frame));
    scene_.advance(frame);
    engine::backend(scene_.scene()).read_tree(cpu_tree_);
    rebuilt_ = build_bvh(topology_, positions(), build_config(options_.backend));
    trace_reference();
    query_reference();
    if (devices_.vulkan) check_vulkan();
    if (checks_cpu()) check_cpu();
}

}  // namespace mray::app
