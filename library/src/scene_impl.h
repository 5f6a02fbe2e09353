// A scene behind the public interface.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "common/update/tree_updater.h"
#include "library/src/device_impl.h"
#include "library/src/image/image_conversion.h"
#include "library/src/image/image_shader.h"
#include "library/src/queries/queries.h"
#include "library/src/queries/query_cost.h"
#include "library/src/queries/ray_space.h"
#include "library/src/queries/scene_questions.h"
#include "library/src/scene/mesh_list.h"
#include "library/src/scene/pose_reader.h"
#include "morphray/scene.hpp"

namespace morphray::detail {

/// Members are called as those of Scene, which say what they do, but throw mray::Error as well.
class SceneImpl {
public:
    SceneImpl(std::span<const MeshView> meshes, const Device& device, const SceneOptions& options);
    /// Scene::on().
    SceneImpl(const SceneImpl& other, const Device& device, const std::atomic<bool>* cancel);
    SceneImpl& operator=(const SceneImpl&) = delete;

    /// Scene::update() or update_with_new_bounds().
    Update update(bool takes_bounds);
    Update update(std::uint32_t geom_id, std::size_t first, std::size_t count);
    std::uint32_t attach(const MeshView& mesh);
    void detach(std::uint32_t geom_id);
    Update last_update() const;

    void intersect(std::span<const Ray> rays, std::span<Hit> hits, Coherence coherence,
                   Threads threads, const std::atomic<bool>* cancel) const;
    Hit intersect(const Ray& ray) const;
    void occluded(std::span<const Ray> rays, std::span<std::uint8_t> occluded, Coherence coherence,
                  Threads threads, const std::atomic<bool>* cancel) const;
    bool occluded(const Ray& ray) const;
    /// The questions at the current pose.
    SceneQuestions questions() const {
        require_usable();
        return {*queries_, rays_, pose_, meshes_, arena()};
    }
    void render(const View& view, Image& image) const;

    TreeStatistics tree_statistics() const;
    std::vector<Box> tree_boxes(std::uint32_t depth) const;
    const Device& device() const { return device_; }
    const mray::Topology& topology() const { return meshes_.topology(); }
    Box bounds() const;

private:
    class Change;

    void start(const mray::Bvh* tree, const MeshList* before);
    void follow(std::span<const mray::IndexRange> changed, double read_ms);
    std::unique_ptr<const Queries> make_queries();
    void require_usable() const;
    /// An image of one sample a pixel in the colours of the backend; mutex_ is locked.
    void render_plain(const View& view, TracedImage& traced, Image& image) const;
    mray::ThreadArena& arena() const { return DeviceImpl::of(device_).arena(); }

    Device device_;
    SceneOptions options_;
    MeshList meshes_;
    PoseReader pose_;
    RaySpace rays_;
    std::unique_ptr<mray::Backend> tracer_;
    std::unique_ptr<mray::Backend> refitter_;
    /// Those of tracer_.
    std::unique_ptr<const Queries> queries_;
    std::unique_ptr<mray::TreeUpdater> updater_;
    double read_ms_ = 0;

    std::atomic<bool> is_changing_ = false;
    /// Why the scene is of no use any more.
    std::optional<Error> broken_;
    /// Guards tracer_, updater_, shader_ and spare_ in const members.
    mutable std::mutex mutex_;
    mutable ImageShader shader_;
    /// The memory of the image before.
    mutable TracedImage spare_;
    mutable QueryCost cost_;
};

}  // namespace morphray::detail
