#include "gpu/image_tracer.h"

#include <algorithm>
#include <utility>

#include "gpu/camera_packets.h"

namespace morphray::gpu {
namespace {

std::uint32_t groups_of(std::uint32_t items) { return (items + kGroupSize - 1) / kGroupSize; }

void set_tiles(RegionArguments& region, std::uint32_t width, std::uint32_t height) {
    region.tile_columns = (region.width + width - 1) / width;
    region.tile_count = region.tile_columns * ((region.height + height - 1) / height);
}

/// Tiles for shading: as wide as they can be without becoming more.
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

/// Whole tiles: first as wide as the image or a row of them, then as high.
std::vector<RegionArguments> regions_of(const ImageParams& params, std::uint32_t tiles) {
    std::vector<RegionArguments> regions;
    const std::uint32_t columns = std::min(tiles, (params.width + kTileSize - 1) / kTileSize);
    if (columns == 0) return regions;
    const std::uint32_t width = columns * kTileSize;
    const std::uint32_t height = tiles / columns * kTileSize;
    for (std::uint32_t y = 0; y < params.height; y += height) {
        for (std::uint32_t x = 0; x < params.width; x += width) {
            RegionArguments& region = regions.emplace_back();
            region = {};
            region.params = params;
            region.x = x;
            region.y = y;
            region.width = std::min(width, params.width - x);
            region.height = std::min(height, params.height - y);
            set_tiles(region, kTileSize, kTileSize);
        }
    }
    return regions;
}

/// The rows of a region, from a buffer of one T a pixel to the image.
template <class T>
void copy_rows(Transfer& transfer, const Buffer& from, const RegionArguments& region,
               std::uint32_t image_width, std::vector<T>& to) {
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

void ImageTracer::begin(const ImageParams& params, Frame& frame) {
    const std::size_t pixel_count = std::size_t{params.width} * params.height;
    frame.width = params.width;
    frame.height = params.height;
    frame.hits.resize(pixel_count);
    frame.occlusion.assign(pixel_count, 0);
    frame.pixels.resize(pixel_count);
    regions_ = regions_of(params, passes_.size().tiles);
    if (!regions_.empty()) begin_region(regions_.front(), Deferred::kTaken);
    frame_ = &frame;
}

void ImageTracer::end(BackendTimes& times) {
    Frame& frame = *std::exchange(frame_, nullptr);
    times.trace_ms = times.secondary_ms = times.shade_ms = 0;
    times.rays = 0;
    for (std::size_t i = 0; i < regions_.size(); ++i) {
        if (i > 0) begin_region(regions_[i], Deferred::kLeft);
        end_region(regions_[i], times);
        copy_region(regions_[i], frame);
    }
    times.trace_ms += times.secondary_ms + times.shade_ms;
    if (!regions_.empty()) times.rays = count_rays(regions_.front().params, frame);
}

/// Whether shading follows camera rays with nothing between that the host has to look at.
bool ImageTracer::is_one_submission(const ImageParams& params) const {
    return kernels_.packet_lanes != 0 && params.rays != kRaysAo;
}

void ImageTracer::begin_region(const RegionArguments& region, Deferred deferred) {
    const bool is_shaded = is_one_submission(region.params);
    const bool is_shadowed = is_shaded && region.params.rays == kRaysShadow;
    const Record record = [&](VkCommandBuffer commands) {
        passes_.record(commands, camera_pass(region), 0);
        if (is_shadowed) {
            separate(commands);
            passes_.record(commands, shadow_pass(region), 1);
        }
        if (is_shaded) {
            separate(commands);
            shading(region)(commands);
        }
    };
    context_.begin("trace an image", record, deferred);
}

void ImageTracer::end_region(const RegionArguments& region, BackendTimes& times) {
    const std::vector<double> stages = context_.end();
    const bool is_shaded = is_one_submission(region.params);
    const bool is_shadowed = is_shaded && region.params.rays == kRaysShadow;
    const RayPass camera = camera_pass(region);
    times.trace_ms += stages.front();
    if (is_shadowed) times.secondary_ms += stages[1];
    if (is_shaded) times.shade_ms += stages.back();
    // What came after a pass that left rays without an answer is done again.
    const bool is_traced = !passes_.is_incomplete(camera, 0);
    if (!is_traced) times.trace_ms += passes_.complete(camera, 0, kernels_, scene_);
    bool is_done = is_traced && is_shaded;
    if (is_shadowed) {
        const RayPass shadow = shadow_pass(region);
        if (!is_traced) {
            times.secondary_ms += passes_.run(shadow, kernels_, scene_);
        } else if (passes_.is_incomplete(shadow, 1)) {
            times.secondary_ms += passes_.complete(shadow, 1, kernels_, scene_);
            is_done = false;
        }
    } else if (rays_per_hit(region.params.rays, region.params.ao_count) != 0) {
        times.secondary_ms += trace_listed(region);
    }
    if (!is_done) times.shade_ms += context_.submit("shade", shading(region));
}

RayPass ImageTracer::camera_pass(const RegionArguments& region) const {
    const auto rays_of = [this](const RegionArguments& arguments) -> Record {
        return [this, arguments](VkCommandBuffer commands) {
            kernels_.primary.dispatch(commands, arguments, arguments.tile_count);
        };
    };
    const char* const what = "trace camera rays";
    if (kernels_.packet_lanes == 0) return {what, false, rays_of(region), {}};
    RegionArguments rest = region;
    rest.unfinished_only = 1;
    const PacketArguments packets = packet_arguments(region, kernels_.packet_lanes);
    return {what, false,
            [this, packets](VkCommandBuffer commands) {
                kernels_.primary_packet.dispatch(commands, packets,
                                                 packet_groups(packets.tile_count));
            },
            rays_of(rest)};
}

RayPass ImageTracer::shadow_pass(const RegionArguments& region) const {
    RegionArguments packets = region;
    // High packets are fewer, but meet triangles that fewer of their rays have to do with; that is
    // dearer where there is a triangle or more for each pixel (measured; in between it is even).
    const std::uint64_t pixels = std::uint64_t{region.params.width} * region.params.height;
    const bool is_tall =
        kernels_.packet_lanes >= 8 && std::uint64_t{2} * scene_.triangle_count() <= pixels;
    const Pipeline& kernel = is_tall ? kernels_.tall_shadow_packet : kernels_.shadow_packet;
    set_tiles(packets, kPacketWidth, is_tall ? kTallShadowPacketHeight : kShadowPacketHeight);
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

/// Ends a stage whose kernels write what those of the next one read.
void ImageTracer::separate(VkCommandBuffer commands) {
    context_.stamp(commands);
    constexpr VkPipelineStageFlags kWork =
        VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT | VK_PIPELINE_STAGE_TRANSFER_BIT;
    // Writer: the pass before, hits and counters; reader: the next kernel. Reader: the copy of the
    // counters; writer: the fill that resets them.
    barrier(commands, kWork, VK_ACCESS_SHADER_WRITE_BIT, kWork,
            VK_ACCESS_SHADER_READ_BIT | VK_ACCESS_SHADER_WRITE_BIT | VK_ACCESS_TRANSFER_WRITE_BIT);
}

std::uint32_t ImageTracer::packet_groups(std::uint32_t packets) const {
    const std::uint32_t run = packet_run(context_.physical());
    return groups_of((packets + run - 1) / run * kernels_.packet_lanes);
}

/// Secondary rays one by one, over a list of the pixels that have some.
double ImageTracer::trace_listed(const RegionArguments& region) {
    OcclusionArguments arguments = {};
    arguments.params = region.params;
    arguments.x = region.x;
    arguments.y = region.y;
    arguments.width = region.width;
    std::uint32_t seen_count = 0;
    double device_ms = passes_.select(
        [&](VkCommandBuffer commands) {
            kernels_.select.dispatch(commands, region, region.tile_count);
        },
        seen_count);
    const std::uint32_t ray_count =
        seen_count * rays_per_hit(region.params.rays, region.params.ao_count);
    const bool in_packets = kernels_.packet_lanes != 0 && region.params.rays == kRaysAo;
    const std::uint32_t most = passes_.size().rays();
    for (std::uint32_t first = 0; first < ray_count; first += most) {
        arguments.ray_first = first;
        arguments.ray_end = std::min(first + most, ray_count);
        const std::uint32_t count = arguments.ray_end - first;
        const Record dispatch = [&](VkCommandBuffer commands) {
            if (in_packets) {
                const std::uint32_t packets = (count + kPacketRays - 1) / kPacketRays;
                kernels_.occlusion_packet.dispatch(commands, arguments, packet_groups(packets));
            } else {
                kernels_.occlusion.dispatch(commands, arguments, groups_of(count));
            }
        };
        device_ms += passes_.run({"trace secondary rays", true, dispatch, {}}, kernels_, scene_);
    }
    return device_ms;
}

void ImageTracer::copy_region(const RegionArguments& region, Frame& frame) {
    copy_rows(transfer_, passes_.hits(), region, frame.width, frame.hits);
    copy_rows(transfer_, passes_.pixels(), region, frame.width, frame.pixels);
    if (rays_per_hit(region.params.rays, region.params.ao_count) != 0) {
        copy_rows(transfer_, passes_.occlusion(), region, frame.width, frame.occlusion);
    }
}

}  // namespace morphray::gpu
