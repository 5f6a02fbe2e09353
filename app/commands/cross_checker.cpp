#include "app/commands/cross_checker.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <iterator>
#include <limits>
#include <random>
#include <type_traits>

#include "app/animation/devices.h"
#include "app/base/messages.h"
#include "common/bvh/box.h"
#include "common/scene/scene_space.h"
#include "common/simd/simd_target.h"

namespace mray::app {
namespace {

using glm::dvec3;

constexpr std::uint32_t kAllHits = std::numeric_limits<std::uint32_t>::max();

/// Places around a mesh. The standard library's distributions differ between libraries.
class Places {
public:
    Places(const Topology& topology, std::span<const vec3> positions)
        : triangles_(topology.triangles), positions_(positions) {
        for (const vec3& p : positions)
            if (is_finite_vertex(p)) box_.extend(p);
        if (box_.empty()) box_.extend({0, 0, 0});
    }

    /// In the box of the mesh, made larger by half on each side.
    vec3 in_room() {
        const dvec3 lower(box_.lower);
        const double x = unit();
        const double y = unit();
        const dvec3 part(x, y, unit());
        return space_.to_scene(vec3(lower + (dvec3(box_.upper) - lower) * (2.0 * part - 0.5)));
    }

    /// A vertex, a point of an edge, a point of a triangle, or a place in the room.
    vec3 any() {
        const auto kind = random_() % 4;
        if (kind == 3 || triangles_.empty()) return in_room();
        const uvec3 t = triangles_[random_() % triangles_.size()];
        const vec3 a = positions_[t.x];
        const vec3 b = positions_[t.y];
        const vec3 c = positions_[t.z];
        if (!is_finite_vertex(a) || !is_finite_vertex(b) || !is_finite_vertex(c)) return in_room();
        const double u = kind == 0 ? 0 : unit();
        const double v = kind == 2 ? unit() * (1 - u) : 0;
        const dvec3 from(a);
        return space_.to_scene(vec3(from + u * (dvec3(b) - from) + v * (dvec3(c) - from)));
    }

    Ray ray() {
        const dvec3 from(in_room());
        const dvec3 to(any());
        constexpr double kInfinity = std::numeric_limits<double>::infinity();
        return mray::to_scene(space_, {from, to - from, 0, kInfinity}).ray;
    }

private:
    /// In [0, 1).
    double unit() { return static_cast<double>(random_()) * 0x1p-32; }

    std::span<const uvec3> triangles_;
    std::span<const vec3> positions_;
    Box box_;
    /// The identity.
    SceneSpace space_{WorldBounds{}};
    std::mt19937 random_{1};
};

template <class T>
bool same_bits(const T& a, const T& b) {
    static_assert(std::is_trivially_copyable_v<T>);
    return std::memcmp(&a, &b, sizeof(T)) == 0;
}

void mark_hits(const HitLists& expected, const HitLists& actual, std::vector<bool>& differs) {
    auto e = expected.hits.begin();
    auto a = actual.hits.begin();
    for (std::size_t i = 0; i < differs.size(); ++i) {
        const auto e_end = e + expected.listed[i];
        const auto a_end = a + actual.listed[i];
        if (expected.total[i] != actual.total[i] || !std::equal(e, e_end, a, a_end, same_bits<Hit>))
            differs[i] = true;
        e = e_end;
        a = a_end;
    }
}

std::size_t count_true(const std::vector<bool>& values) {
    return static_cast<std::size_t>(std::ranges::count(values, true));
}

}  // namespace

CheckBatch pseudo_random_batch(const Topology& topology, std::span<const vec3> positions,
                               std::uint32_t count) {
    Places places(topology, positions);
    CheckBatch batch;
    for (std::uint32_t i = 0; i < count; ++i) {
        batch.rays.push_back(places.ray());
        batch.points.push_back(places.any());
    }
    return batch;
}

Answers answers_of(Backend& backend, const CheckBatch& batch) {
    Answers answers;
    backend.query(ListQuery{batch.rays, Crossing::kEach, kAllHits, answers.hits[0]});
    backend.query(ListQuery{batch.rays, Crossing::kOwner, kAllHits, answers.hits[1]});
    answers.windings.resize(batch.points.size());
    backend.query(WindingQuery{batch.points, answers.windings, answers.uncertain});
    std::ranges::sort(answers.uncertain);
    answers.closest.resize(batch.points.size());
    backend.query(ClosestQuery{batch.points, kAnyDistance2, answers.closest});
    return answers;
}

QueryDifference compare_answers(const Answers& expected, const Answers& actual) {
    std::vector<bool> hits(expected.hits[0].total.size());
    for (std::size_t i = 0; i < expected.hits.size(); ++i)
        mark_hits(expected.hits[i], actual.hits[i], hits);
    std::vector<bool> windings(expected.windings.size());
    std::vector<UncertainCrossing> only_one;
    std::ranges::set_symmetric_difference(expected.uncertain, actual.uncertain,
                                          std::back_inserter(only_one));
    for (const UncertainCrossing& crossing : only_one) windings[crossing.point] = true;
    QueryDifference difference;
    for (std::size_t i = 0; i < windings.size(); ++i) {
        if (expected.windings[i] != actual.windings[i]) windings[i] = true;
        if (!same_bits(expected.closest[i], actual.closest[i])) ++difference.closest;
    }
    difference.all_hits = count_true(hits);
    difference.winding = count_true(windings);
    return difference;
}

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
