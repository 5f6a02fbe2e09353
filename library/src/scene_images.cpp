// The members of SceneImpl that make images, and that describe the tree.
#include <algorithm>
#include <limits>
#include <utility>

#include "common/bvh/box.h"
#include "common/bvh/bvh_stats.h"
#include "library/src/image/image_conversion.h"
#include "library/src/scene_impl.h"

namespace morphray::detail {
namespace {

// The most samples of an image whose memory is kept for the next image: 340 MB with those of the
// sky.
constexpr std::size_t kMostSpareSamples = std::size_t{1} << 23;

/// Lets a backend's images be watched while it lives.
class Watched {
public:
    Watched(mray::Backend& backend, const mray::Watch& watch) : backend_(backend) {
        backend_.watch_images(watch);
    }
    ~Watched() { backend_.watch_images({}); }
    Watched(const Watched&) = delete;
    Watched& operator=(const Watched&) = delete;

private:
    mray::Backend& backend_;
};

/// At 0 the box around everything, at 1 those of the root's children, and so on, without empty
/// ones. Leaves above the depth are left out; there is nothing below the tree.
std::vector<mray::Box> boxes_at_depth(const mray::Bvh& tree, std::uint32_t depth) {
    if (depth > tree.depth()) return {};
    const mray::Box root = mray::node_box(tree.nodes.front());
    std::vector<mray::Box> boxes;
    if (depth == 0 && !root.empty()) boxes.push_back(root);
    if (depth == 0) return boxes;
    // The slots of a level hold the boxes of the next one.
    for (std::uint32_t i = tree.level_begin[depth - 1]; i < tree.level_begin[depth]; ++i) {
        for (std::uint32_t slot = 0; slot < mray::kWidth; ++slot) {
            const mray::Box box = mray::slot_box(tree.nodes[i], slot);
            if (!box.empty()) boxes.push_back(box);
        }
    }
    return boxes;
}

}  // namespace

void SceneImpl::render(const View& view, Image& image) const {
    require_usable();
    TracedImage traced;
    const mray::Watch watch(view.cancel, view.done);
    {
        const std::scoped_lock lock(mutex_);
        const Watched watched(*tracer_, watch);
        if (ImageShader::is_needed_for(view)) {
            shader_.render(view, meshes_, pose_, *tracer_, arena(), spare_, image);
        } else {
            render_plain(view, spare_, image);
        }
        std::swap(traced, spare_);
    }
    fill_hits(view.hits, traced, pose_.space(), meshes_, arena(), watch, image);
    image.width = view.width;
    image.height = view.height;
    image.samples = view.samples;
    cost_.add(image.trace_ms, image.ray_count);
    if (traced.samples.hits.size() > kMostSpareSamples) return;
    const std::scoped_lock lock(mutex_);
    spare_ = std::move(traced);
}

void SceneImpl::render_plain(const View& view, TracedImage& traced, Image& image) const {
    traced.params = mray::make_image_params(to_spec(view), pose_.bounds(), pose_.space());
    traced.has_sky = false;
    traced.samples.with_pixels = true;
    traced.samples.with_hits = view.hits;
    tracer_->trace_image(traced.params, traced.samples);
    image.ray_count = tracer_->finish().rays;
    image.trace_ms = tracer_->finish().trace_ms;
    image.shade_ms = 0;
    image.pixels.swap(traced.samples.pixels);
    image.lit_pixels.clear();
}

TreeStatistics SceneImpl::tree_statistics() const {
    require_usable();
    const std::scoped_lock lock(mutex_);
    const mray::Bvh& tree = updater_->tree();
    const mray::BvhStats stats = mray::bvh_stats(tree);
    return {stats.sah_cost, stats.node_count, stats.leaf_count,
            stats.depth,    stats.bytes,      mray::bvh_hash(tree)};
}

std::vector<Box> SceneImpl::tree_boxes(std::uint32_t depth) const {
    require_usable();
    const std::scoped_lock lock(mutex_);
    const mray::Bvh& tree = updater_->tree();
    std::vector<Box> boxes;
    for (const mray::Box& box : boxes_at_depth(tree, depth)) {
        const mray::vec3 lower = pose_.space().to_world(box.lower);
        const mray::vec3 upper = pose_.space().to_world(box.upper);
        boxes.push_back({{lower.x, lower.y, lower.z}, {upper.x, upper.y, upper.z}});
    }
    return boxes;
}

Box SceneImpl::bounds() const {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    Box box{{kInfinity, kInfinity, kInfinity}, {-kInfinity, -kInfinity, -kInfinity}};
    const std::span<const mray::vec3> positions = pose_.positions();
    for (std::uint32_t vertex = 0; vertex < positions.size(); ++vertex) {
        if (positions[vertex].x == mray::kInvalidCoordinate) continue;
        const mray::vec3 p = pose_.world_position(vertex);
        for (int axis = 0; axis < 3; ++axis) {
            const auto k = static_cast<std::size_t>(axis);
            box.lower[k] = std::min(box.lower[k], static_cast<double>(p[axis]));
            box.upper[k] = std::max(box.upper[k], static_cast<double>(p[axis]));
        }
    }
    return box;
}

}  // namespace morphray::detail
