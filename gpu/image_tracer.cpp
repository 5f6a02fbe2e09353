#include "gpu/image_tracer.h"

#include <algorithm>
#include <vector>

#include "common/base/stopwatch.h"
#include "gpu/packet_arguments.h"

namespace mray::gpu {
namespace {

void set_tiles(RegionArguments& region, std::uint32_t width, std::uint32_t height) {
    region.tile_columns = (region.width + width - 1) / width;
    region.tile_count = region.tile_columns * ((region.height + height - 1) / height);
}

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

/// Divides an image into regions of whole tiles, as wide as possible, row by row of regions.
class Regions {
public:
    explicit Regions(const ImageParams& params) : params_(params) {}

    bool has_next() const { return params_.width > 0 && y_ < params_.height; }

    /// Takes the next region, of at most `tiles` tiles; more only where the row has begun with
    /// regions that have more.
    RegionArguments next(std::uint32_t tiles) {
        const std::uint32_t columns = (params_.width + kTileSize - 1) / kTileSize;
        if (x_ == 0) rows_ = tiles / std::min(tiles, columns);
        RegionArguments region = {};
        region.params = params_;
        region.x = x_;
        region.y = y_;
        region.width = std::min(std::max(tiles / rows_, 1u) * kTileSize, params_.width - x_);
        region.height = std::min(rows_ * kTileSize, params_.height - y_);
        set_tiles(region, kTileSize, kTileSize);
        x_ += region.width;
        if (x_ == params_.width) {
            x_ = 0;
            y_ += region.height;
        }
        return region;
    }

private:
    const ImageParams& params_;
    std::uint32_t x_ = 0;
    std::uint32_t y_ = 0;
    /// Rows of tiles of this row of regions.
    std::uint32_t rows_ = 1;
};

/// Copies the rows of a region from a buffer with one T a pixel to the image.
template <class T, class Allocator>
void copy_rows(Transfer& transfer, const Buffer& from, const RegionArguments& region,
               std::uint32_t image_width, std::vector<T, Allocator>& to) {
    const std::size_t count = std::size_t{region.width} * region.height;
    std::vector<T> copy;
    const T* rows = reinterpret_cast<const T*>(from.mapped().data());
    if (from.mapped().empty()) {
        copy.resize(count);
        transfer.download(from, std::as_writable_bytes(std::span(copy)));
        rows = copy.data();
    }
    for (std::uint32_t y = 0; y < region.height; ++y) {
        std::copy_n(rows + std::size_t{y} * region.width, region.width,
                    to.data() + std::size_t{region.y + y} * image_width + region.x);
    }
}

}  // namespace

void ImageTracer::trace(const ImageParams& params, Frame& frame, BackendTimes& times,
                        const Watch& watch) {
    with_pixels_ = frame.with_pixels;
    prepare(params, watch);
    const std::size_t pixel_count = std::size_t{params.width} * params.height;
    frame.width = params.width;
    frame.height = params.height;
    resize_watched(frame.hits, pixel_count, watch);
    frame.occlusion.clear();
    resize_watched(frame.occlusion, pixel_count, watch);
    resize_watched(frame.pixels, with_pixels_ ? pixel_count : 0, watch);
    times.trace_ms = times.secondary_ms = times.shade_ms = 0;
    std::size_t done = 0;
    for (Regions regions(params); regions.has_next();) {
        watch.throw_if_cancelled();
        const std::uint32_t most = passes_.size().tiles;
        const RegionArguments region =
            regions.next(watch.can_cancel() ? tiles_pace_.next(most) : most);
        const Stopwatch clock;
        trace_region(region, times, watch);
        tiles_pace_.took(region.tile_count, clock.ms());
        copy_region(region, frame);
        done += std::size_t{region.width} * region.height;
        watch.set_done(done, pixel_count);
    }
    times.trace_ms += times.secondary_ms + times.shade_ms;
    times.rays = count_rays(params, frame);
}

/// Prepares the kernels that every image of this kind needs, the fastest to compile first.
void ImageTracer::prepare(const ImageParams& params, const Watch& watch) {
    const bool in_packets = uses_packets(params);
    std::vector<Kernel*> needed;
    if (with_pixels_) needed.push_back(&kernels_.shade);
    needed.push_back(in_packets ? &kernels_.camera_packet : &kernels_.primary);
    if (is_one_submission(params)) {
        if (params.rays == kRaysShadow) needed.push_back(&light_kernel(params));
    } else if (rays_per_hit(params.rays, params.ao_count) != 0) {
        needed.push_back(&kernels_.compact);
        needed.push_back(in_packets ? &kernels_.occlusion_packet : &kernels_.occlusion);
    }
    kernels_.prepare(needed, watch);
}

bool ImageTracer::uses_packets(const ImageParams& params) const {
    return kernels_.packet_lanes != 0 && has_packet_frame(params);
}

/// Whether the host need not look at results between camera rays and shading.
bool ImageTracer::is_one_submission(const ImageParams& params) const {
    return uses_packets(params) && params.rays != kRaysAo;
}

void ImageTracer::trace_region(const RegionArguments& region, BackendTimes& times,
                               const Watch& watch) {
    const bool is_one = is_one_submission(region.params);
    const bool is_lit = is_one && region.params.rays == kRaysShadow;
    const bool is_shaded = is_one && with_pixels_;
    const RayPass camera = camera_pass(region);
    const Record record = [&](VkCommandBuffer commands) {
        passes_.record(commands, camera, 0);
        if (is_lit) {
            separate(commands);
            passes_.record(commands, light_pass(region), 1);
        }
        if (is_shaded) {
            separate(commands);
            shading(region)(commands);
        }
    };
    const std::vector<double> stages = context_.submit_stages("trace an image", record);
    times.trace_ms += stages.front();
    if (is_lit) times.secondary_ms += stages[1];
    if (is_shaded) times.shade_ms += stages.back();
    // A pass that left rays without an answer is completed, and all after it is done again.
    const bool is_traced = !passes_.is_incomplete(camera, 0);
    if (!is_traced) times.trace_ms += passes_.complete(camera, 0, kernels_, scene_);
    bool is_done = is_traced && is_one;
    if (is_lit) {
        const RayPass light = light_pass(region);
        if (!is_traced) {
            times.secondary_ms += passes_.run(light, kernels_, scene_);
        } else if (passes_.is_incomplete(light, 1)) {
            times.secondary_ms += passes_.complete(light, 1, kernels_, scene_);
            is_done = false;
        }
    } else if (rays_per_hit(region.params.rays, region.params.ao_count) != 0) {
        times.secondary_ms += trace_visible(region, watch);
    }
    if (!is_done && with_pixels_) times.shade_ms += context_.submit("shade", shading(region));
}

RayPass ImageTracer::camera_pass(const RegionArguments& region) const {
    RegionArguments rays = region;
    const bool in_packets = uses_packets(region.params);
    rays.unfinished_only = in_packets ? 1 : 0;
    const Record dispatch_rays = [this, rays](VkCommandBuffer commands) {
        kernels_.primary.dispatch(commands, rays, rays.tile_count);
    };
    const char* const what = "trace camera rays";
    if (!in_packets) return {what, false, dispatch_rays, {}};
    const PacketArguments packets = packet_arguments(region, kernels_.packet_lanes);
    const Record dispatch_packets = [this, packets](VkCommandBuffer commands) {
        kernels_.camera_packet.dispatch(commands, packets, packet_groups(packets.tile_count));
    };
    return {what, false, dispatch_packets, dispatch_rays, &kernels_.primary};
}

/// Tall packets are fewer, but each of their triangles concerns fewer of their rays. They are
/// slower from a triangle a pixel on, and faster up to half a triangle a pixel
/// (docs/lab/vulkan_tracer.md).
Kernel& ImageTracer::light_kernel(const ImageParams& params) const {
    const std::uint64_t pixels = std::uint64_t{params.width} * params.height;
    const bool is_tall =
        kernels_.packet_lanes >= 8 && std::uint64_t{2} * scene_.triangle_count() <= pixels;
    return is_tall ? kernels_.tall_light_packet : kernels_.light_packet;
}

RayPass ImageTracer::light_pass(const RegionArguments& region) const {
    RegionArguments packets = region;
    const Kernel& kernel = light_kernel(region.params);
    const bool is_tall = &kernel == &kernels_.tall_light_packet;
    set_tiles(packets, kPacketWidth, is_tall ? kTallLightPacketHeight : kLightPacketHeight);
    const Record dispatch = [this, packets, &kernel](VkCommandBuffer commands) {
        vkCmdFillBuffer(commands, passes_.occlusion().get(), 0, VK_WHOLE_SIZE, 0);
        // Writer: the fill; writer after it: the kernel.
        barrier(commands, VK_PIPELINE_STAGE_TRANSFER_BIT, VK_ACCESS_TRANSFER_WRITE_BIT,
                VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT, VK_ACCESS_SHADER_WRITE_BIT);
        kernel.dispatch(commands, packets, packet_groups(packets.tile_count));
    };
    return {"trace shadow rays", true, dispatch, {}};
}

Record ImageTracer::shading(const RegionArguments& region) const {
    RegionArguments tiles = region;
    set_shaded_tiles(tiles);
    return [this, tiles](VkCommandBuffer commands) {
        kernels_.shade.dispatch(commands, tiles, tiles.tile_count);
    };
}

/// Ends a stage, whose writes the next stage reads.
void ImageTracer::separate(VkCommandBuffer commands) {
    context_.stamp(commands);
    constexpr VkPipelineStageFlags kWork =
        VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT | VK_PIPELINE_STAGE_TRANSFER_BIT;
    // Writer: the pass before (hits, counters); reader: the next kernel. Reader: the copy of the
    // counters; writer: the fill that resets them.
    barrier(commands, kWork, VK_ACCESS_SHADER_WRITE_BIT, kWork,
            VK_ACCESS_SHADER_READ_BIT | VK_ACCESS_SHADER_WRITE_BIT | VK_ACCESS_TRANSFER_WRITE_BIT);
}

std::uint32_t ImageTracer::packet_groups(std::uint32_t packets) const {
    const std::uint32_t run = packet_run(context_.physical());
    return groups_of((packets + run - 1) / run * kernels_.packet_lanes);
}

/// Traces secondary rays over the compacted list of visible pixels. Returns milliseconds.
double ImageTracer::trace_visible(const RegionArguments& region, const Watch& watch) {
    OcclusionArguments arguments = {};
    arguments.params = region.params;
    arguments.x = region.x;
    arguments.y = region.y;
    arguments.width = region.width;
    std::uint32_t visible_count = 0;
    double device_ms = passes_.compact(
        [&](VkCommandBuffer commands) {
            kernels_.compact.dispatch(commands, region, region.tile_count);
        },
        visible_count);
    const std::uint32_t ray_count =
        visible_count * rays_per_hit(region.params.rays, region.params.ao_count);
    // Shadow rays get here only without packets.
    const bool in_packets = uses_packets(region.params);
    std::uint32_t most = passes_.size().rays();
    if (watch.can_cancel()) most = rays_pace_.next(most);
    for (std::uint32_t first = 0; first < ray_count; first = arguments.ray_end) {
        watch.throw_if_cancelled();
        arguments.ray_first = first;
        arguments.ray_end = std::min(first + most, ray_count);
        const std::uint32_t count = arguments.ray_end - first;
        const Stopwatch clock;
        const Record dispatch = [&](VkCommandBuffer commands) {
            if (in_packets) {
                const std::uint32_t packets = (count + kPacketRays - 1) / kPacketRays;
                kernels_.occlusion_packet.dispatch(commands, arguments, packet_groups(packets));
            } else {
                kernels_.occlusion.dispatch(commands, arguments, groups_of(count));
            }
        };
        device_ms += passes_.run({"trace secondary rays", true, dispatch, {}}, kernels_, scene_);
        rays_pace_.took(count, clock.ms());
    }
    return device_ms;
}

void ImageTracer::copy_region(const RegionArguments& region, Frame& frame) {
    copy_rows(transfer_, passes_.hits(), region, frame.width, frame.hits);
    if (with_pixels_) copy_rows(transfer_, passes_.pixels(), region, frame.width, frame.pixels);
    if (rays_per_hit(region.params.rays, region.params.ao_count) != 0) {
        copy_rows(transfer_, passes_.occlusion(), region, frame.width, frame.occlusion);
    }
}

}  // namespace mray::gpu
