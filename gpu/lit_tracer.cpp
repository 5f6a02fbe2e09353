#include "gpu/lit_tracer.h"

#include <bit>

#include "common/frame_times.h"
#include "common/interop/shading.h"

namespace mray::gpu {
namespace {

static_assert(kNoNormal == kFlatCorner);

// Neighbours of a region's samples that ambient occlusion is averaged over, on the far sides.
constexpr std::uint32_t kAoSquareAfter = kAoSquareSide - 1 - kAoSquareBefore;
constexpr std::uint32_t kNeighbours = kAoSquareSide - 1;
// Fewer tiles may have no room for the neighbours of a single one.
constexpr std::uint32_t kLeastTiles = 8;

/// Samples of a lit image have neighbours if there is ambient occlusion.
bool has_sky(const LitView& view) { return view.kind == LitKind::kLit && view.ao_count > 0; }

/// The tiles of a region that has room for its neighbours in buffers for `tiles`, whichever its
/// shape: one row of tiles, or rows as wide as the image.
std::uint32_t tiles_with_neighbours(std::uint32_t tiles) {
    return std::max(tiles, kLeastTiles) * kTileSize / (kTileSize + kNeighbours) - 1;
}

RegionArguments with_neighbours(RegionArguments region) {
    const auto widen = [](std::uint32_t& begin, std::uint32_t& size, std::uint32_t most) {
        const std::uint32_t end = std::min(begin + size + kAoSquareAfter, most);
        begin -= std::min(begin, kAoSquareBefore);
        size = end - begin;
    };
    widen(region.x, region.width, region.params.width);
    widen(region.y, region.height, region.params.height);
    set_tiles(region, kTileSize, kTileSize);
    return region;
}

/// What is shaded of samples that are traced for the pixels of `inner`.
LitArguments shaded_part(const LitView& view, bool with_linear, const RegionArguments& traced,
                         const RegionArguments& inner) {
    const ImageParams& params = view.params;
    const bool is_plain = view.kind == LitKind::kPlain;
    return {.org = params.camera.org,
            .kind = static_cast<std::uint32_t>(view.kind),
            .corner = params.camera.corner,
            .side_bits = static_cast<std::uint32_t>(std::countr_zero(view.side)),
            .du = params.camera.du,
            .rays = params.rays,
            .dv = params.camera.dv,
            .ao_count = is_plain ? params.ao_count : view.ao_count,
            .light = params.light,
            .near = view.near,
            .up = view.up,
            .per_depth = view.per_depth,
            .image_height = params.height,
            .flags = (view.normals != nullptr ? kLitSmooth : 0) | (with_linear ? kLitLinear : 0) |
                     (inner.x > traced.x ? kLitLeft : 0) | (inner.y > traced.y ? kLitAbove : 0),
            .x = traced.x,
            .y = traced.y,
            .width = traced.width,
            .height = traced.height,
            .columns = inner.width / view.side,
            .rows = inner.height / view.side};
}

std::uint32_t sample_count(const RegionArguments& region) { return region.width * region.height; }

}  // namespace

bool LitTracer::has_room() const { return passes_.size().tiles >= kLeastTiles; }

void LitTracer::prepare_kernels(const LitView& view, const Watch& watch) {
    std::vector<Kernel*> needed = {&kernels_.find_surfaces, &kernels_.lit, &kernels_.primary,
                                   &kernels_.decide};
    if (view.params.rays != kRaysPrimary)
        needed.insert(needed.end(), {&kernels_.compact, &kernels_.occlusion});
    if (view.kind == LitKind::kLit && view.normals != nullptr)
        needed.insert(needed.end(), {&kernels_.flat_shadows, &kernels_.resume});
    kernels_.prepare(needed, watch);
}

void LitTracer::trace(const LitView& view, Frame& samples, std::span<std::uint32_t> pixels,
                      std::span<LinearColour> linear, BackendTimes& times, const Watch& watch) {
    prepare_kernels(view, watch);
    const ImageParams& params = view.params;
    const std::size_t count = std::size_t{params.width} * params.height;
    samples.width = params.width;
    samples.height = params.height;
    samples.pixels.clear();
    resize_watched(samples.hits, samples.with_hits ? count : 0, watch);
    resize_watched(samples.occlusion, samples.with_hits ? count : 0, watch);
    // The neighbours of a region belong to others, too, whose rays these are.
    std::uint64_t ray_count = count;
    times.trace_ms = times.secondary_ms = times.shade_ms = 0;
    for (Regions regions(params); regions.has_next();) {
        watch.throw_if_cancelled();
        const std::uint32_t tiles = tiles_pace_.next(passes_.size().tiles, watch);
        const RegionArguments inner =
            regions.next(has_sky(view) ? tiles_with_neighbours(tiles) : tiles);
        Region region;
        region.traced = has_sky(view) ? with_neighbours(inner) : inner;
        region.shaded = shaded_part(view, !linear.empty(), region.traced, inner);
        const Stopwatch clock;
        ray_count += trace_region(view, region, times, watch);
        const std::uint64_t shown = shade(region, samples.with_hits, times);
        ray_count += shown * (rays_per_hit(params.rays, params.ao_count) +
                              (has_sky(view) ? view.ao_count : 0));
        tiles_pace_.took(region.traced.tile_count, clock.ms());
        copy_region(view, region, samples, pixels.data(), linear.data());
        watch.advance(double{1} * sample_count(inner) / static_cast<double>(count));
    }
    if (params.rays == kRaysPrimary) std::ranges::fill(samples.occlusion, 0u);
    if (has_sky(view))
        for (std::uint32_t& word : samples.occlusion)
            word = (word & ((1u << kShadowShift) - 1)) + (word >> kShadowShift);
    times.rays = ray_count;
    times.trace_ms += times.secondary_ms + times.shade_ms;
}

/// Returns the number of rays that samples in shadow are asked again with.
std::uint64_t LitTracer::trace_region(const LitView& view, const Region& region,
                                      BackendTimes& times, const Watch& watch) {
    RegionArguments traced = region.traced;
    times.trace_ms += passes_.run(
        "trace camera rays", false, sample_count(traced), [&](VkCommandBuffer commands) {
            kernels_.primary.dispatch(commands, traced, traced.tile_count);
        });
    if (traced.params.rays != kRaysPrimary) images_.trace_secondary(traced, times, watch);
    const bool is_smooth = view.kind == LitKind::kLit && view.normals != nullptr;
    const std::uint64_t asked_again = is_smooth ? light_smooth_surfaces(region, times) : 0;
    if (has_sky(view)) {
        traced.params.rays = kRaysAo;
        traced.params.ao_count = view.ao_count;
        traced.first = kShadowShift;
        images_.trace_secondary(traced, times, watch);
    }
    return asked_again;
}

/// Removes shadows that only the flatness of triangles makes, as light_smooth_surfaces() of
/// library/src/lit_image.cpp does. Returns the number of rays.
std::uint64_t LitTracer::light_smooth_surfaces(const Region& region, BackendTimes& times) {
    LitArguments arguments = region.shaded;
    std::uint64_t ray_count = 0;
    for (const std::uint32_t rays : {0u, kLitBetween}) {
        arguments.flags |= rays;
        times.secondary_ms += context_.submit("find shadows", [&](VkCommandBuffer commands) {
            passes_.begin(commands);
            kernels_.flat_shadows.dispatch(commands, arguments,
                                           groups_of(sample_count(region.traced)));
            passes_.end(commands);
        });
        const std::uint32_t count = passes_.header().suspended_count;
        times.secondary_ms += passes_.resume(true, count);
        ray_count += count;
    }
    return ray_count;
}

std::uint32_t LitTracer::shade(const Region& region, bool with_hits, BackendTimes& times) {
    const LitArguments& part = region.shaded;
    const std::uint32_t samples = sample_count(region.traced);
    const std::uint32_t pixels = part.columns * part.rows;
    times.shade_ms += context_.submit("shade", [&](VkCommandBuffer commands) {
        passes_.begin(commands);
        kernels_.find_surfaces.dispatch(commands, part, groups_of(samples));
        // Writer: the surfaces; reader: the shading.
        barrier(commands);
        kernels_.lit.dispatch(commands, part, groups_of(pixels));
        passes_.end(commands);
        const std::uint32_t returned = with_hits ? samples : 0;
        passes_.copy_results(commands, {.hits = returned,
                                        .occlusion = part.rays != kRaysPrimary ? returned : 0,
                                        .pixels = pixels,
                                        .linear = (part.flags & kLitLinear) != 0 ? pixels : 0});
    });
    return passes_.header().shown_count;
}

void LitTracer::copy_region(const LitView& view, const Region& region, Frame& samples,
                            std::uint32_t* pixels, LinearColour* linear) const {
    const RayBuffers& b = *passes_.buffers();
    const LitArguments& part = region.shaded;
    const std::uint32_t left = (part.flags & kLitLeft) != 0 ? kAoSquareBefore : 0;
    const std::uint32_t above = (part.flags & kLitAbove) != 0 ? kAoSquareBefore : 0;
    CopiedRows rows = {(part.x + left) / view.side,
                       (part.y + above) / view.side,
                       part.columns,
                       part.rows,
                       0,
                       part.columns};
    const std::uint32_t width = view.params.width / view.side;
    copy_rows(b.pixels, b.pixels_copy, rows, width, pixels);
    if ((part.flags & kLitLinear) != 0) copy_rows(b.linear, b.linear_copy, rows, width, linear);
    if (!samples.with_hits) return;
    for (std::uint32_t* const size : {&rows.x, &rows.y, &rows.width, &rows.height})
        *size *= view.side;
    rows.first = std::size_t{above} * part.width + left;
    rows.pitch = part.width;
    copy_rows(b.hits.buffer, b.hits_copy, rows, samples.width, samples.hits.data());
    if (part.rays != kRaysPrimary)
        copy_rows(b.occlusion.buffer, b.occlusion_copy, rows, samples.width,
                  samples.occlusion.data());
}

}  // namespace mray::gpu
