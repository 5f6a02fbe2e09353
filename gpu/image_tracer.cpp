#include "gpu/image_tracer.h"

#include <bit>
#include <vector>

#include "common/frame_times.h"

namespace mray::gpu {
namespace {

/// Sets the tiles for shading: the smallest number of tiles, and of those the widest.
void set_shaded_tiles(RegionArguments& region) {
    std::uint32_t best = kMostShadedTileBits;
    std::uint32_t least = ~0u;
    for (std::uint32_t bits = kMostShadedTileBits; bits >= kLeastShadedTileBits; --bits) {
        set_tiles(region, 1u << bits, kShadedTilePixels >> bits);
        if (region.tile_count < least) {
            least = region.tile_count;
            best = bits;
        }
    }
    set_tiles(region, 1u << best, kShadedTilePixels >> best);
    region.tile_bits = best;
}

std::uint32_t rays_of_hit(const RegionArguments& region) {
    return rays_per_hit(region.params.rays, region.params.ao_count);
}

OcclusionArguments secondary(const RegionArguments& region, std::uint32_t first,
                             std::uint32_t end) {
    return {region.params, region.x, region.y, region.width, first, end};
}

}  // namespace

void ImageTracer::prepare_kernels(const Watch& watch) {
    std::vector<Kernel*> needed;
    if (with_pixels_) needed.push_back(&kernels_.shade);
    if (packed_words_ != 0) needed.push_back(&kernels_.pack_hits);
    needed.push_back(&kernels_.primary);
    needed.push_back(&kernels_.decide);
    if (samples_ != 0) {
        needed.push_back(&kernels_.compact);
        needed.push_back(&kernels_.occlusion);
    }
    kernels_.prepare(needed, watch);
}

void ImageTracer::trace(const ImageParams& params, Frame& frame, BackendTimes& times,
                        const Watch& watch) {
    with_pixels_ = frame.with_pixels;
    with_hits_ = frame.with_hits;
    packed_words_ = 0;
    samples_ = rays_per_hit(params.rays, params.ao_count);
    prepare_kernels(watch);
    const std::size_t pixel_count = std::size_t{params.width} * params.height;
    frame.width = params.width;
    frame.height = params.height;
    resize_watched(frame.hits, with_hits_ ? pixel_count : 0, watch);
    resize_watched(frame.occlusion, with_hits_ ? pixel_count : 0, watch);
    if (samples_ == 0) std::fill(frame.occlusion.begin(), frame.occlusion.end(), 0u);
    resize_watched(frame.pixels, with_pixels_ ? pixel_count : 0, watch);
    times.rays = pixel_count;
    times.trace_ms = times.secondary_ms = times.shade_ms = 0;
    for (Regions regions(params); regions.has_next();) {
        watch.throw_if_cancelled();
        const RegionArguments region = regions.next(tiles_pace_.next(passes_.size().tiles, watch));
        const Stopwatch clock;
        trace_region(region, times, watch);
        tiles_pace_.took(region.tile_count, clock.ms());
        copy_region(region, frame);
        watch.advance(double{1} * region.width * region.height / static_cast<double>(pixel_count));
    }
    times.trace_ms += times.secondary_ms + times.shade_ms;
}

void ImageTracer::trace_views(const ViewBatch& views, BackendTimes& times, const Watch& watch) {
    with_pixels_ = views.with_pixels;
    const RayBuffers& b = *passes_.buffers();
    const std::uint32_t words = b.hits.buffer.mapped().empty() ? views.hit_words : kWholeHit;
    packed_words_ = words != kWholeHit ? words : 0;
    with_hits_ = words == kWholeHit;
    samples_ = 0;
    prepare_kernels(watch);
    const std::size_t pixel_count = std::size_t{views.params.width} * views.params.height;
    times.rays = pixel_count * views.cameras.size();
    times.trace_ms = times.secondary_ms = times.shade_ms = 0;
    const auto* const hits = seen_by_host<std::uint32_t>(b.hits.buffer, b.hits_copy);
    const auto* const pixels = seen_by_host<std::uint32_t>(b.pixels, b.pixels_copy);
    std::uint32_t most_tiles = tiles_pace_.next(passes_.size().tiles, watch);
    std::vector<RegionArguments> regions;
    std::vector<TracedTile> traced;
    std::uint32_t tiles = 0;
    std::uint32_t first = 0;
    const auto submit = [&] {
        watch.throw_if_cancelled();
        const Stopwatch clock;
        times.trace_ms += trace_regions(regions, first);
        tiles_pace_.took(tiles, clock.ms());
        most_tiles = tiles_pace_.next(passes_.size().tiles, watch);
        views.take(traced);
        watch.advance(double{1} * first / static_cast<double>(times.rays));
        regions.clear();
        traced.clear();
        tiles = first = 0;
    };
    for (std::size_t view = 0; view < views.cameras.size(); ++view) {
        ImageParams params = views.params;
        params.camera = views.cameras[view];
        for (Regions rest(params); rest.has_next();) {
            RegionArguments region = rest.next(most_tiles);
            if (tiles + region.tile_count > most_tiles) submit();
            tiles += region.tile_count;
            region.first = first;
            regions.push_back(region);
            // Bands of 64 rows, which take() converts in parallel.
            const std::uint32_t end = region.y + region.height;
            for (std::uint32_t y = region.y; y < end; y += 64) {
                const std::uint32_t y1 = std::min(y + 64, end);
                const std::size_t first_word = std::size_t{first} * std::popcount(words);
                traced.push_back({view, region.x, y, region.x + region.width, y1, hits + first_word,
                                  pixels + first, region.width, words});
                first += region.width * (y1 - y);
            }
        }
    }
    if (tiles != 0) submit();
}

/// Traces regions with `count` pixels together. Returns milliseconds.
double ImageTracer::trace_regions(std::span<const RegionArguments> regions, std::uint32_t count) {
    const auto shade_and_copy = [&](VkCommandBuffer commands) {
        for (const RegionArguments& region : regions)
            if (with_pixels_) shade(commands, region);
        if (packed_words_ != 0)
            kernels_.pack_hits.dispatch(commands, PackArguments{count, packed_words_},
                                        groups_of(count));
        passes_.copy_results(commands,
                             {.hits = with_hits_ ? count : 0, .pixels = with_pixels_ ? count : 0});
    };
    const double device_ms = context_.submit("trace views", [&](VkCommandBuffer commands) {
        passes_.begin(commands);
        for (const RegionArguments& region : regions)
            kernels_.primary.dispatch(commands, region, region.tile_count);
        passes_.decide(commands, false, count);
        // Writer: camera rays; readers: shading and packing.
        barrier(commands);
        shade_and_copy(commands);
        passes_.end(commands);
    });
    const std::uint32_t suspended = passes_.header().suspended_count;
    if (suspended == 0) return device_ms;
    const double resume_ms = passes_.resume(false, suspended);
    return device_ms + resume_ms + context_.submit("shade views", shade_and_copy);
}

void ImageTracer::trace_region(const RegionArguments& region, BackendTimes& times,
                               const Watch& watch) {
    const std::uint32_t batch = rays_pace_.next(passes_.size().rays(), watch);
    // The host submits rays beyond a batch, and shades after them.
    const std::uint64_t most_rays = std::uint64_t{region.width} * region.height * samples_;
    const bool is_shaded = with_pixels_ && most_rays <= batch;
    const std::vector<double> stages =
        context_.submit_stages("trace an image", [&](VkCommandBuffer commands) {
            passes_.begin(commands);
            kernels_.primary.dispatch(commands, region, region.tile_count);
            passes_.decide(commands, false, region.width * region.height);
            if (samples_ != 0) {
                separate(commands);
                record_secondary(commands, region, batch);
            }
            if (is_shaded) {
                separate(commands);
                shade(commands, region);
            }
            copy_results(commands, region);
            passes_.end(commands);
        });
    times.trace_ms += stages.front();
    if (samples_ != 0) times.secondary_ms += stages[1];
    if (is_shaded) times.shade_ms += stages.back();

    // A stage with suspended rays is completed, and all later stages are done again.
    const WorkHeader header = passes_.header();
    bool is_current = is_shaded || !with_pixels_;
    if (header.suspended_count != 0 && header.visible_count == 0) {
        is_current = false;
        times.trace_ms += passes_.resume(false, header.suspended_count);
        if (samples_ != 0) trace_secondary(region, times, watch);
    } else if (samples_ != 0) {
        is_current = finish_secondary(region, batch, header, times, watch) && is_current;
    }
    if (is_current) return;
    times.shade_ms += context_.submit("shade", [&](VkCommandBuffer commands) {
        if (with_pixels_) shade(commands, region);
        copy_results(commands, region);
    });
}

void ImageTracer::trace_secondary(const RegionArguments& region, BackendTimes& times,
                                  const Watch& watch) {
    const std::uint32_t batch = rays_pace_.next(passes_.size().rays(), watch);
    times.secondary_ms += context_.submit("trace secondary rays", [&](VkCommandBuffer commands) {
        passes_.begin(commands);
        record_secondary(commands, region, batch);
        passes_.end(commands);
    });
    finish_secondary(region, batch, passes_.header(), times, watch);
}

/// Traces what a submission of secondary rays, which has this header, left. Returns whether that
/// was nothing.
bool ImageTracer::finish_secondary(const RegionArguments& region, std::uint32_t batch,
                                   const WorkHeader& header, BackendTimes& times,
                                   const Watch& watch) {
    const std::uint32_t ray_count = header.visible_count * rays_of_hit(region);
    times.rays += ray_count;
    times.secondary_ms += passes_.resume(true, header.suspended_count);
    if (ray_count > batch) times.secondary_ms += trace_rest(region, batch, ray_count, watch);
    return header.suspended_count == 0 && ray_count <= batch;
}

/// Records the list of visible pixels and at most `batch` secondary rays.
void ImageTracer::record_secondary(VkCommandBuffer commands, const RegionArguments& region,
                                   std::uint32_t batch) {
    kernels_.compact.dispatch(commands, region, region.tile_count);
    // Writer: the list and its length; reader: the secondary rays.
    barrier(commands);
    const std::uint64_t most_rays =
        std::uint64_t{region.width} * region.height * rays_of_hit(region);
    // The host does not know the length of the list; groups beyond its end end at once.
    const auto count = static_cast<std::uint32_t>(std::min<std::uint64_t>(most_rays, batch));
    kernels_.occlusion.dispatch(commands, secondary(region, 0, count), groups_of(count));
    passes_.decide(commands, true, count);
}

/// Traces the secondary rays [first, ray_count). Returns milliseconds.
double ImageTracer::trace_rest(const RegionArguments& region, std::uint32_t first,
                               std::uint32_t ray_count, const Watch& watch) {
    double device_ms = 0;
    while (first < ray_count) {
        watch.throw_if_cancelled();
        const std::uint32_t count =
            std::min(rays_pace_.next(passes_.size().rays(), watch), ray_count - first);
        const Stopwatch clock;
        device_ms +=
            passes_.run("trace secondary rays", true, count, [&](VkCommandBuffer commands) {
                kernels_.occlusion.dispatch(commands, secondary(region, first, first + count),
                                            groups_of(count));
            });
        rays_pace_.took(count, clock.ms());
        first += count;
    }
    return device_ms;
}

void ImageTracer::shade(VkCommandBuffer commands, const RegionArguments& region) const {
    RegionArguments tiles = region;
    set_shaded_tiles(tiles);
    kernels_.shade.dispatch(commands, tiles, tiles.tile_count);
}

/// Ends a stage, whose writes the next stage reads.
void ImageTracer::separate(VkCommandBuffer commands) {
    context_.stamp(commands);
    // Writer: the stage before (hits, counters, occlusion); reader: the next kernel.
    barrier(commands);
}

void ImageTracer::copy_results(VkCommandBuffer commands, const RegionArguments& region) const {
    const std::uint32_t count = region.width * region.height;
    passes_.copy_results(commands, {.hits = with_hits_ ? count : 0,
                                    .occlusion = with_hits_ && samples_ != 0 ? count : 0,
                                    .pixels = with_pixels_ ? count : 0});
}

void ImageTracer::copy_region(const RegionArguments& region, Frame& frame) const {
    const RayBuffers& b = *passes_.buffers();
    const CopiedRows rows = {region.x, region.y, region.width, region.height, 0, region.width};
    const std::uint32_t width = frame.width;
    if (with_pixels_) copy_rows(b.pixels, b.pixels_copy, rows, width, frame.pixels.data());
    if (with_hits_) copy_rows(b.hits.buffer, b.hits_copy, rows, width, frame.hits.data());
    if (with_hits_ && samples_ != 0)
        copy_rows(b.occlusion.buffer, b.occlusion_copy, rows, width, frame.occlusion.data());
}

}  // namespace mray::gpu
