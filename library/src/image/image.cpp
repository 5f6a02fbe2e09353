#include "morphray/image.hpp"

#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>

#include "common/base/output_file.h"
#include "common/image/depth.h"
#include "common/image/png.h"
#include "library/src/image/image_conversion.h"
#include "library/src/scene/errors.h"

namespace morphray {
namespace detail {
namespace {

std::uint32_t to_engine(Rays rays) {
    switch (rays) {
        case Rays::primary:
            return mray::kRaysPrimary;
        case Rays::shadow:
            return mray::kRaysShadow;
        case Rays::ao:
            return mray::kRaysAo;
    }
    throw_bad_argument("View::rays: not one of primary, shadow and ao");
}

}  // namespace

mray::ViewSpec to_spec(const View& view) {
    return {.eye = view.eye,
            .target = view.target,
            .up = view.up,
            .fov = view.fov,
            .light = view.light,
            .width = view.width,
            .height = view.height,
            .rays = to_engine(view.rays),
            .ao_count = view.ao_count,
            .ao_distance = view.ao_distance};
}

void fill_hits(bool with_hits, TracedImage& traced, const mray::SceneSpace& space,
               const MeshList& meshes, mray::ThreadArena& arena, const mray::Watch& watch,
               Image& image) {
    mray::Frame& frame = traced.samples;
    if (!with_hits) {
        image.hits.clear();
        image.occlusion.clear();
        image.hits_hash = 0;
        image.image_hash = mray::image_hash(image.pixels);
        return;
    }
    mray::resize_watched(image.hits, frame.hits.size(), watch);
    const auto convert_row = [&](std::uint32_t y) {
        watch.throw_if_cancelled();
        for (std::uint32_t x = 0; x < frame.width; ++x) {
            const std::size_t i = std::size_t{y} * frame.width + x;
            const mray::Hit& hit = frame.hits[i];
            image.hits[i] =
                hit.prim_id == mray::kNoPrim
                    ? Hit{}
                    : meshes.locate(mray::world_depth(traced.params.camera, space, hit.t, x, y),
                                    hit.u, hit.v, hit.prim_id);
        }
    };
    const auto add_sky = [&](std::uint32_t y) {
        const std::size_t end = std::size_t{y + 1} * frame.width;
        for (std::size_t i = end - frame.width; i < end; ++i)
            frame.occlusion[i] += traced.sky.occlusion[i];
    };
    arena.execute([&] {
        if (traced.has_sky) tbb::parallel_for(std::uint32_t{0}, frame.height, add_sky);
        tbb::parallel_invoke(
            [&] { tbb::parallel_for(std::uint32_t{0}, frame.height, convert_row); },
            [&] { image.hits_hash = mray::hits_hash(frame); },
            [&] { image.image_hash = mray::image_hash(image.pixels); });
    });
    image.occlusion.swap(frame.occlusion);
}

}  // namespace detail

void write_png(const std::string& file, const Image& image) {
    detail::with_public_errors([&] {
        if (image.pixels.size() != std::size_t{image.width} * image.height ||
            image.pixels.empty()) {
            detail::throw_bad_argument("write_png: the image's pixels do not fit its size");
        }
        mray::write_file(file, mray::encode_png({image.width, image.height, image.pixels}));
    });
}

}  // namespace morphray
