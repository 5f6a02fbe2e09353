// Stacks: many views of one size, of whose hits only some channels are kept.
#include <algorithm>
#include <bit>
#include <cmath>

#include "common/image/depth.h"
#include "common/interop/camera.h"
#include "library/src/engine.h"
#include "library/src/scene_impl.h"

namespace morphray {
namespace {

using namespace detail;

/// Makes the channels of a stack. Threads may share it.
class StackChannels {
public:
    StackChannels(const SceneImpl& scene, const mray::ViewBatch& views, const ImageStack& stack)
        : scene_(scene), views_(views), stack_(stack) {}

    std::uint32_t hit_words() const {
        return (has_depths_ ? mray::kHitT : 0u) | (has_triangles_ ? mray::kHitPrim : 0u) |
               (stack_.uv.empty() ? 0u : mray::kHitU | mray::kHitV);
    }

    void fill(const mray::TracedTile& tile) const {
        const auto [width, height] = std::pair(views_.params.width, views_.params.height);
        const std::size_t columns = tile.x1 - tile.x0;
        for (std::uint32_t y = tile.y0; y < tile.y1; ++y) {
            const std::size_t from = (y - tile.y0) * tile.stride;
            const std::size_t to = (tile.view * height + y) * width + tile.x0;
            if (views_.with_pixels) std::copy_n(tile.pixels + from, columns, &stack_.shaded[to]);
            if (has_depths_) fill_depths(tile, y, from, to);
            if (has_triangles_) fill_triangles(tile, from, to);
            if (stack_.uv.empty()) continue;
            const HitColumn<float> u(tile, mray::kHitU, from), v(tile, mray::kHitV, from);
            for (std::size_t i = 0; i < columns; ++i) stack_.uv[to + i] = {u[i], v[i]};
        }
    }

private:
    /// A word of the hits of a tile, from pixel `first` on.
    template <class T>
    class HitColumn {
    public:
        HitColumn(const mray::TracedTile& tile, mray::HitWords word, std::size_t first)
            : step_(sizeof(T) * static_cast<std::size_t>(std::popcount(tile.hit_words))),
              words_(static_cast<const std::byte*>(tile.hits) + first * step_ +
                     sizeof(T) *
                         static_cast<std::size_t>(std::popcount(tile.hit_words & (word - 1u)))) {}
        const T& operator[](std::size_t i) const {
            return *reinterpret_cast<const T*>(words_ + i * step_);
        }

    private:
        std::size_t step_;
        const std::byte* words_;
    };

    void fill_depths(const mray::TracedTile& tile, std::uint32_t y, std::size_t from,
                     std::size_t to) const {
        // A copy: stores of floats could change what it refers to.
        const mray::Camera camera = views_.cameras[tile.view];
        const mray::SceneSpace space = scene_.pose().space();
        const HitColumn<float> ts(tile, mray::kHitT, from);
        const HitColumn<std::uint32_t> prims(tile, mray::kHitPrim, from);
        const bool has_prims = (tile.hit_words & mray::kHitPrim) != 0;
        for (std::uint32_t x = tile.x0; x < tile.x1; ++x, ++to) {
            const std::size_t i = x - tile.x0;
            float depth = std::numeric_limits<float>::infinity();
            if (has_prims ? prims[i] != mray::kNoPrim : ts[i] < depth)
                depth = mray::world_depth(camera, space, ts[i], x, y);
            if (!stack_.depth.empty()) stack_.depth[to] = depth;
            if (!stack_.distance.empty()) {
                const mray::dvec3 dir(mray::camera_direction(camera, x, y));
                stack_.distance[to] = static_cast<float>(depth * std::sqrt(glm::dot(dir, dir)));
            }
        }
    }

    void fill_triangles(const mray::TracedTile& tile, std::size_t from, std::size_t to) const {
        const HitColumn<std::uint32_t> prims(tile, mray::kHitPrim, from);
        // Neighbours are often of one mesh.
        std::uint32_t first = 0, count = 0, geom_id = kNoGeometry;
        for (std::size_t i = 0; i < tile.x1 - tile.x0; ++i, ++to) {
            const std::uint32_t prim = prims[i];
            const bool is_hit = prim != mray::kNoPrim;
            if (is_hit && prim - first >= count) {
                geom_id = scene_.meshes().locate(0, 0, 0, prim).geom_id;
                first = scene_.meshes().slots()[geom_id].first_prim;
                count = scene_.meshes().slots()[geom_id].prim_count;
            }
            if (!stack_.geom_id.empty()) stack_.geom_id[to] = is_hit ? geom_id : kNoGeometry;
            if (!stack_.prim_id.empty()) stack_.prim_id[to] = is_hit ? prim - first : kNoPrim;
            if (stack_.normal.empty()) continue;
            const mray::vec3 normal = is_hit ? flat_normal(scene_, prim) : mray::vec3(0, 0, 0);
            stack_.normal[to] = {normal.x, normal.y, normal.z};
        }
    }

    const SceneImpl& scene_;
    const mray::ViewBatch& views_;
    const ImageStack& stack_;
    bool has_depths_ = !stack_.depth.empty() || !stack_.distance.empty();
    bool has_triangles_ =
        !stack_.geom_id.empty() || !stack_.prim_id.empty() || !stack_.normal.empty();
};

/// Throws Error unless the views are of one size and kind, and each array has that size or none.
void check_stack(std::span<const View> views, const ImageStack& stack) {
    for (const View& view : views) {
        const View& first = views.front();
        if (view.width != first.width || view.height != first.height)
            throw_bad_argument("views of {} x {} and of {} x {} pixels; a stack has one size",
                               first.width, first.height, view.width, view.height);
        if (view.shading != Shading::plain || view.rays != Rays::primary || view.samples != 1)
            throw_bad_argument(
                "a stack is of views with Shading::plain, Rays::primary and one sample");
    }
    const std::size_t pixels =
        views.empty() ? 0 : views.size() * views.front().width * views.front().height;
    for (const std::size_t size :
         {stack.depth.size(), stack.distance.size(), stack.geom_id.size(), stack.prim_id.size(),
          stack.normal.size(), stack.uv.size(), stack.shaded.size()}) {
        if (size != 0 && size != pixels)
            throw_bad_argument("an array of ImageStack has {} elements for {} pixels", size,
                               pixels);
    }
}

void render_stack(SceneImpl& scene, std::span<const View> views, ImageStack& stack) {
    check_stack(views, stack);
    stack.ray_count = 0;
    stack.trace_ms = 0;
    std::vector<mray::Camera> cameras;
    mray::ViewBatch batch;
    for (const View& view : views) {
        batch.params = mray::make_image_params(engine::to_spec(view, scene.options().origin),
                                               scene.pose().bounds(), scene.pose().space());
        cameras.push_back(batch.params.camera);
    }
    batch.cameras = cameras;
    batch.with_pixels = !stack.shaded.empty();
    const StackChannels channels(scene, batch, stack);
    batch.hit_words = channels.hit_words();
    if (batch.hit_words == 0 && !batch.with_pixels) return;
    batch.take = [&](std::span<const mray::TracedTile> tiles) {
        for_each_index(tiles.size() == 1 ? nullptr : &scene.arena(), tiles.size(),
                       [&](std::size_t i) { channels.fill(tiles[i]); });
    };
    const std::scoped_lock lock(scene.mutex());
    scene.tracer().watch_images(mray::Watch(views.front().cancel, views.front().progress));
    scene.tracer().trace_views(batch);
    stack.ray_count = scene.tracer().finish().rays;
    stack.trace_ms = scene.tracer().finish().trace_ms;
    scene.cost.add_image(stack.trace_ms, stack.ray_count);
}

}  // namespace

void Scene::render(std::span<const View> views, ImageStack& stack) const {
    with_scene(impl_, [&](SceneImpl& scene) { render_stack(scene, views, stack); });
}

}  // namespace morphray
