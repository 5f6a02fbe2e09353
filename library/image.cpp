#include "morphray/image.hpp"

#include <utility>

#include "common/base/output_file.h"
#include "common/image/depth.h"
#include "common/image/png.h"
#include "library/errors.h"
#include "library/image_conversion.h"

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

Image to_image(mray::Frame frame, const mray::ImageParams& params, const mray::SceneSpace& space,
               const MeshList& meshes) {
    Image image;
    image.width = frame.width;
    image.height = frame.height;
    image.ray_count = mray::count_rays(params, frame);
    image.hits_hash = mray::hits_hash(frame);
    image.image_hash = mray::image_hash(frame);
    image.hits.resize(frame.hits.size());
    for (std::uint32_t y = 0; y < frame.height; ++y) {
        for (std::uint32_t x = 0; x < frame.width; ++x) {
            const std::size_t i = std::size_t{y} * frame.width + x;
            const mray::Hit& hit = frame.hits[i];
            if (hit.prim_id == mray::kNoPrim) continue;
            image.hits[i] = meshes.locate(mray::world_depth(params.camera, space, hit.t, x, y),
                                          hit.u, hit.v, hit.prim_id);
        }
    }
    image.pixels = std::move(frame.pixels);
    image.occlusion = std::move(frame.occlusion);
    return image;
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
