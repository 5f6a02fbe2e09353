#include "tests/fuzz/judge/call_questions.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "tests/fuzz/generate/points.h"
#include "tests/fuzz/generate/views.h"

namespace mray::fuzz {
namespace {

using morphray::Coherence;
using morphray::Crossing;
using morphray::FillRule;
using morphray::Hit;
using morphray::Ray;
using morphray::Scene;
using morphray::Vec3;

// The rays of a batch that are asked one at a time, and about all their hits.
constexpr std::size_t kSingleRays = 4;
constexpr std::size_t kAllHitsRays = 96;
// The steps from hit to hit of a ray.
constexpr int kSteps = 6;

template <class Value>
void add(CallAnswer& answer, const char* what, const std::vector<Value>& values) {
    static_assert(std::is_trivially_copyable_v<Value>);
    CallPart part{what, {}};
    if constexpr (sizeof(Value) % sizeof(std::uint32_t) == 0) {
        part.bits.resize(values.size() * sizeof(Value) / sizeof(std::uint32_t));
        if (!values.empty()) std::memcpy(part.bits.data(), values.data(), part.bits.size() * 4);
    } else {
        part.bits.assign(values.begin(), values.end());
    }
    answer.push_back(std::move(part));
}

Vec3 to_vec(const dvec3& p) {
    const auto f = [](double x) { return static_cast<float>(std::clamp(x, -3e38, 3e38)); };
    return {f(p.x), f(p.y), f(p.z)};
}
Vec3 minus(const Vec3& a, const Vec3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }

Ray to_ray(const WorldRay& r) {
    return {to_vec({r.org[0], r.org[1], r.org[2]}), static_cast<float>(r.tnear),
            to_vec({r.dir[0], r.dir[1], r.dir[2]}), static_cast<float>(r.tfar)};
}

struct Batch {
    std::vector<Ray> rays;
    Coherence coherence;
};

/// Rays of an image, row by row.
Batch grid_rays(Dice& dice, const Surroundings& around, std::size_t count) {
    const dvec3 eye = special_place(dice, around);
    const dvec3 target = special_target(dice, around);
    const dvec3 x = dice.direction() * around.extent;
    const dvec3 y = dice.direction() * around.extent;
    const auto row = static_cast<std::size_t>(dice.from(8, 70));
    Batch batch{{}, Coherence::image(row)};
    for (std::size_t i = 0; i < count; ++i) {
        const double u = static_cast<double>(i % row) / static_cast<double>(row) - 0.5;
        const double v = static_cast<double>(i / row) / static_cast<double>(row) - 0.5;
        batch.rays.push_back({to_vec(eye), 0, to_vec(target - eye + x * u + y * v)});
    }
    return batch;
}

/// Special rays first, then unlike ones in any order.
Batch make_batch(Dice& dice, const Surroundings& around, std::size_t count) {
    constexpr std::size_t kSpecial = 64;
    if (count > 16 && dice.one_in(4)) return grid_rays(dice, around, count);
    Batch batch{{}, Coherence::sort()};
    std::vector<Ray>& rays = batch.rays;
    const std::size_t special = std::min(count, kSpecial);
    constexpr std::size_t kGroup = 8;
    for (const WorldRay& ray : dice.one_in(4) && special >= kGroup
                                   ? make_ray_groups(dice, around, special / kGroup, kGroup)
                                   : make_rays(dice, around, special))
        rays.push_back(to_ray(ray));
    while (rays.size() < count) {
        const dvec3 org = around.centre + dice.point(2 * around.extent);
        const Vec3 target = to_vec(special_target(dice, around));
        Ray ray{to_vec(org), 0, minus(target, to_vec(org))};
        if (dice.one_in(16)) ray.tfar = static_cast<float>(dice.real(0, 2));
        rays.push_back(ray);
    }
    if (rays.empty()) return batch;
    const auto any = [&]() -> Ray& {
        return rays[dice.below(static_cast<std::uint32_t>(rays.size()))];
    };
    if (dice.one_in(4)) any().dir = {0, 0, 0};
    if (dice.one_in(4)) any().org.y = std::numeric_limits<float>::quiet_NaN();
    if (dice.one_in(4)) any().tfar = -1;
    return batch;
}

void ask_for_all_hits(const Scene& scene, std::span<const Ray> rays, Crossing crossing,
                      std::uint32_t most, CallAnswer& answer) {
    const morphray::AllHits all =
        scene.intersect_all(rays, {.crossing = crossing, .max_hits = most});
    add(answer, "offsets of all hits", all.offsets);
    add(answer, "all hits", all.hits);
    add(answer, "hits that are left out", all.left_out);
    std::vector<std::uint64_t> counts(rays.size());
    scene.count(rays, counts, crossing);
    add(answer, "numbers of hits", counts);
}

void ask_for_next_hits(const Scene& scene, const Ray& ray, Crossing crossing, CallAnswer& answer) {
    std::vector<Hit> hits;
    Hit hit = scene.intersect(ray);
    for (int k = 0; k < kSteps && hit; ++k) {
        hits.push_back(hit);
        hit = scene.intersect(ray, hit, crossing);
    }
    hits.push_back(hit);
    add(answer, "next hits", hits);
}

/// Asks for what is cancelled before it begins.
void ask_in_vain(const Scene& scene, std::span<const Ray> rays, CallAnswer& answer) {
    const std::atomic<bool> cancel = true;
    std::vector<Hit> hits(rays.size(), Hit{.t = 1});
    std::vector<std::uint8_t> occluded(rays.size(), 2);
    std::vector<std::uint64_t> counts(rays.size(), 3);
    with_error_code(answer, [&] { scene.intersect(rays, std::span(hits), {}, &cancel); });
    with_error_code(answer, [&] { scene.occluded(rays, std::span(occluded), {}, &cancel); });
    with_error_code(answer, [&] { scene.intersect_all(rays, {.cancel = &cancel}); });
    with_error_code(answer, [&] { scene.count(rays, counts, Crossing::owner, {}, &cancel); });
    add(answer, "closest hits that were cancelled", hits);
    add(answer, "any hits that were cancelled", occluded);
    add(answer, "numbers of hits that were cancelled", counts);
}

void ask_in_vain(const Scene& scene, std::span<const Vec3> points, CallAnswer& answer) {
    const std::atomic<bool> cancel = true;
    std::vector<std::int32_t> windings(points.size(), 7);
    std::vector<std::uint8_t> inside(points.size(), 2);
    std::vector<float> distances(points.size(), 3);
    std::vector<morphray::ClosestPoint> closest(points.size());
    constexpr float kFar = std::numeric_limits<float>::infinity();
    with_error_code(answer, [&] { scene.winding(points, windings, &cancel); });
    with_error_code(answer, [&] { scene.contains(points, inside, FillRule::odd, &cancel); });
    with_error_code(answer, [&] { scene.closest_points(points, closest, kFar, &cancel); });
    with_error_code(
        answer, [&] { scene.signed_distance(points, distances, FillRule::odd, kFar, &cancel); });
    add(answer, "windings that were cancelled", windings);
    add(answer, "inside that was cancelled", inside);
    add(answer, "distances that were cancelled", distances);
}

void add(CallAnswer& answer, const morphray::Comparison& comparison) {
    std::vector<std::uint64_t> numbers = {comparison.compared, comparison.different};
    std::vector<Hit> hits;
    for (const morphray::HitDifference& difference : comparison.differences) {
        numbers.push_back(difference.index);
        hits.insert(hits.end(), {difference.first, difference.second});
    }
    add(answer, "comparisons", numbers);
    add(answer, "hits that differ", hits);
}

std::optional<morphray::Point> maybe(Dice& dice, const std::optional<Point>& point) {
    if (!point || dice.one_in(6)) return std::nullopt;
    return morphray::Point{(*point)[0], (*point)[1], (*point)[2]};
}

morphray::View view_of(Dice& dice, const Call& call, const Surroundings& around) {
    using morphray::Shading;
    constexpr std::array kShadings = {Shading::plain,  Shading::lit,   Shading::lit,
                                      Shading::normal, Shading::depth, Shading::prim};
    constexpr std::array kRayKinds = {morphray::Rays::primary, morphray::Rays::shadow,
                                      morphray::Rays::ao};
    const ViewSpec spec = make_view(dice, around, 1e4);
    morphray::View view;
    view.eye = maybe(dice, spec.eye);
    view.target = maybe(dice, spec.target);
    view.light = maybe(dice, spec.light);
    view.up = {spec.up[0], spec.up[1], spec.up[2]};
    view.fov = spec.fov;
    view.width = call.number;
    view.height = static_cast<std::uint32_t>(dice.from(1, 32));
    if (dice.one_in(40)) view.height = 0;
    view.rays = dice.pick(kRayKinds);
    view.shading = dice.pick(kShadings);
    if (dice.one_in(3)) view.samples = 4;
    if (dice.one_in(40)) view.samples = 2;
    view.ao_count = static_cast<std::uint32_t>(dice.from(0, 4));
    view.ao_distance = spec.ao_distance;
    view.flat = dice.one_in(4);
    view.lit_pixels = dice.one_in(2);
    view.hits = !dice.one_in(4);
    return view;
}

}  // namespace

void ask_about_rays(const Scene& scene, const Scene* other, const Call& call,
                    const Surroundings& around, CallAnswer& answer) {
    Dice dice(call.seed);
    const Batch batch = make_batch(dice, around, call.number);
    const std::vector<Ray>& rays = batch.rays;
    std::vector<Hit> hits(rays.size());
    std::vector<std::uint8_t> occluded(rays.size());
    scene.intersect(std::span(rays), hits, batch.coherence);
    add(answer, "closest hits", hits);
    scene.occluded(std::span(rays), occluded, batch.coherence);
    add(answer, "any hits", occluded);
    if (dice.one_in(4)) {
        // An answer that is left out is none of the call before.
        std::fill(hits.begin(), hits.end(), Hit{.t = -1});
        std::fill(occluded.begin(), occluded.end(), std::uint8_t{2});
        scene.intersect(std::span(rays), hits, morphray::Threads::calling, batch.coherence);
        add(answer, "closest hits of the calling thread", hits);
        scene.occluded(std::span(rays), occluded, morphray::Threads::calling, batch.coherence);
        add(answer, "any hits of the calling thread", occluded);
    }
    for (std::size_t i = 0; i < std::min(rays.size(), kSingleRays); ++i) {
        add(answer, "single hits", std::vector<Hit>{scene.intersect(rays[i])});
        add(answer, "single any hits", std::vector<std::uint8_t>{scene.occluded(rays[i])});
        for (const Crossing crossing : {Crossing::each, Crossing::owner})
            ask_for_next_hits(scene, rays[i], crossing, answer);
        std::vector<std::uint8_t> is_visible(dice.below(6));
        for (std::uint8_t& visible : is_visible) visible = static_cast<std::uint8_t>(dice.below(2));
        add(answer, "visible hits", std::vector<Hit>{scene.intersect_visible(rays[i], is_visible)});
    }
    const std::span some = std::span(rays).first(std::min(rays.size(), kAllHitsRays));
    const std::uint32_t most = dice.one_in(2) ? std::numeric_limits<std::uint32_t>::max()
                                              : static_cast<std::uint32_t>(dice.from(0, 4));
    for (const Crossing crossing : {Crossing::each, Crossing::owner})
        ask_for_all_hits(scene, some, crossing, most, answer);
    if (dice.one_in(8)) ask_in_vain(scene, rays, answer);
    if (other != nullptr && dice.one_in(2))
        add(answer, morphray::compare(scene, *other, some, dice.below(12)));
}

void ask_about_points(const Scene& scene, const Call& call, const Surroundings& around,
                      CallAnswer& answer) {
    Dice dice(call.seed);
    std::vector<Vec3> points;
    for (const vec3& p : make_points(dice, around, call.number)) points.push_back({p.x, p.y, p.z});
    std::vector<std::int32_t> windings(points.size());
    scene.winding(points, windings);
    add(answer, "windings", windings);
    std::vector<std::uint8_t> inside(points.size());
    std::vector<float> distances(points.size());
    const auto reach = static_cast<float>(dice.magnitude(1e-4, 10) * around.extent);
    for (const FillRule rule : {FillRule::nonzero, FillRule::odd}) {
        scene.contains(points, inside, rule);
        add(answer, "inside", inside);
        if (rule == FillRule::odd) {
            scene.signed_distance(points, distances, rule, reach);
        } else {
            scene.signed_distance(points, distances);
        }
        // The bits of a NaN are not promised.
        for (float& x : distances) x = std::isnan(x) ? -1e38f : x;
        add(answer, "distances", distances);
    }
    std::vector<morphray::ClosestPoint> closest(points.size());
    for (const float most : {std::numeric_limits<float>::infinity(), reach, 0.0f}) {
        scene.closest_points(points, closest, most);
        std::vector<std::uint32_t> bits;
        for (const morphray::ClosestPoint& c : closest) {
            for (const float x : {c.point.x, c.point.y, c.point.z, c.distance, c.u, c.v})
                bits.push_back(std::bit_cast<std::uint32_t>(x));
            bits.insert(bits.end(), {c.prim_id, c.geom_id, static_cast<std::uint32_t>(c.feature)});
        }
        add(answer, "closest points", bits);
    }
    if (dice.one_in(8)) ask_in_vain(scene, points, answer);
    if (dice.one_in(16)) scene.closest_points(points, closest, -1);
}

void ask_for_image(const Scene& scene, const Call& call, const Surroundings& around,
                   CallAnswer& answer) {
    Dice dice(call.seed);
    morphray::View view = view_of(dice, call, around);
    const morphray::Image image = scene.render(view);
    add(answer, "hits of pixels", image.hits);
    add(answer, "occluded rays of pixels", image.occlusion);
    add(answer, "colours", image.pixels);
    std::vector<std::uint32_t> lit;
    for (const morphray::LitPixel& pixel : image.lit_pixels) {
        for (const float x : pixel.colour) lit.push_back(std::bit_cast<std::uint32_t>(x));
        for (const float x : pixel.normal) lit.push_back(std::bit_cast<std::uint32_t>(x));
        lit.push_back(std::bit_cast<std::uint32_t>(pixel.open));
    }
    add(answer, "lit pixels", lit);
    add(answer, "hashes", std::vector<std::uint64_t>{image.hits_hash, image.image_hash});
    if (dice.one_in(4)) {
        view.fov *= 0.99;
        add(answer, morphray::compare(image, scene.render(view), dice.below(12)));
    }
    const std::atomic<bool> cancel = true;
    view.cancel = &cancel;
    if (dice.one_in(8)) with_error_code(answer, [&] { scene.render(view); });
}

}  // namespace mray::fuzz
