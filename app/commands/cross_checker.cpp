#include "app/commands/cross_checker.h"

#include "app/backends.h"
#include "common/simd/simd_target.h"
#include "cpu/cpu_backend.h"

namespace mray::app {
namespace {

constexpr double kAffordableTests = 2e9;

/// The given instruction set, or all that this machine has.
std::vector<std::string> simd_to_check(const std::string& asked) {
    if (asked == cpu::kSimdOff) return {};
    if (!asked.empty()) return {find_simd_target(asked).name};
    std::vector<std::string> names;
    for (const SimdTarget& target : supported_simd_targets()) {
        names.emplace_back(target.name);
    }
    return names;
}

}  // namespace

bool brute_is_affordable(std::uint64_t triangles, const ViewSpec& view, std::uint32_t rays) {
    const double pixels = static_cast<double>(view.width) * view.height;
    const double rays_per_pixel = 1.0 + rays_per_hit(rays, view.ao_count);
    return static_cast<double>(triangles) * pixels * rays_per_pixel <= kAffordableTests;
}

CrossChecker::CrossChecker(const Options& options, SceneFrames& scene, double first_frame,
                           bool with_vulkan, const Messages& messages)
    : options_(options),
      scene_(scene),
      params_(make_image_params(options.view, scene.clip().bounds(), scene.space())),
      simd_(simd_to_check(options.backend.simd)) {
    const Topology& topology = scene.clip().topology();
    BackendOptions plain = options.backend;
    plain.simd = cpu::kSimdOff;
    const auto make = [&](BackendChoice choice) { return make_backend(choice, plain, messages); };
    // The device first, because without one the build would be in vain.
    if (with_vulkan) {
        vulkan_.refits = make(BackendChoice::kVulkan);
        vulkan_.given = make(BackendChoice::kVulkan);
    }
    cpu_.refits = make(BackendChoice::kCpu);
    cpu_.given = make(BackendChoice::kCpu);
    brute_ = make(BackendChoice::kBrute);
    const double build_at = options.tree.build_at.value_or(first_frame);
    const std::span<const vec3> positions = scene.positions(build_at);
    const Bvh built = build_bvh(topology, positions,
                                {.split = options.tree.split, .threads = options.backend.threads});
    for (Pair* pair : {&cpu_, &vulkan_}) {
        if (pair->refits == nullptr) continue;
        pair->refits->set_scene(topology, positions, built);
        pair->given->set_scene(topology, positions, built);
        pair->tree = built;
    }
    brute_->set_scene(topology, positions, built);
}

bool CrossChecker::checks_cpu() const { return options_.backend.choice != BackendChoice::kVulkan; }

std::string CrossChecker::device() const {
    return vulkan_.refits == nullptr ? std::string() : vulkan_.refits->description();
}

bool CrossChecker::uses_brute(std::uint32_t rays) const {
    if (options_.reference != Reference::kAuto) return options_.reference == Reference::kBrute;
    return brute_is_affordable(scene_.clip().topology().triangles.size(), options_.view, rays);
}

std::size_t CrossChecker::variant_count(std::uint32_t rays) const {
    if (!checks_cpu()) return 3;
    const std::size_t all = (vulkan_.refits == nullptr ? 2 : 6) + 2 * simd_.size();
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
        // The CPU without SIMD over the rebuilt tree is the reference itself.
        if (row.reference == row.backend && row.simd.empty() && row.update == "rebuild") continue;
        variant.backend->trace_image(params_for(expected.rays), actual);
        row.trace_ms = variant.backend->times().trace_ms;
        compare(expected.frame, actual, row);
        on_row(row, expected.frame, actual);
    }
}

void CrossChecker::check_pair(Pair& pair, const Pair& other, std::span<const vec3> positions,
                              const Bvh& rebuilt, double frame, const OnRow& on_row) {
    compare_variant({pair.refits.get(), "", "refit", pair.refits->name().c_str()}, frame, on_row);
    if (other.refits != nullptr) {
        pair.given->set_frame(positions, other.tree);
        compare_variant({pair.given.get(), "", "refit", other.refits->name().c_str()}, frame,
                        on_row);
    }
    pair.given->set_frame(positions, rebuilt);
    compare_variant({pair.given.get(), "", "rebuild", ""}, frame, on_row);
}

void CrossChecker::check_simd(const std::string& simd, std::span<const vec3> positions,
                              const Bvh& rebuilt, double frame, const OnRow& on_row) {
    const auto backend = cpu::make_cpu_backend({.threads = options_.backend.threads, .simd = simd});
    backend->set_scene(scene_.clip().topology(), positions, cpu_.tree);
    compare_variant({backend.get(), simd, "refit", "cpu"}, frame, on_row);
    backend->set_frame(positions, rebuilt);
    compare_variant({backend.get(), simd, "rebuild", ""}, frame, on_row);
}

TreeRow CrossChecker::check(double frame, const std::vector<std::uint32_t>& rays,
                            const OnRow& on_row) {
    const std::span<const vec3> positions = scene_.positions(frame);
    refit(cpu_, positions);
    const Bvh rebuilt =
        build_bvh(scene_.clip().topology(), positions,
                  {.split = options_.tree.split, .threads = options_.backend.threads});
    trace_reference(positions, rebuilt, rays);
    TreeRow trees;
    trees.frame = frame;
    trees.cpu_hash = trees.vulkan_hash = bvh_hash(cpu_.tree);
    if (vulkan_.refits != nullptr) {
        refit(vulkan_, positions);
        trees.vulkan_hash = bvh_hash(vulkan_.tree);
        check_pair(vulkan_, cpu_, positions, rebuilt, frame, on_row);
    }
    if (!checks_cpu()) return trees;
    check_pair(cpu_, vulkan_, positions, rebuilt, frame, on_row);
    for (const std::string& simd : simd_) check_simd(simd, positions, rebuilt, frame, on_row);
    return trees;
}

}  // namespace mray::app
