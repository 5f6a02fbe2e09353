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
#include "cpu/cpu_backend.h"
#include "cpu/packet/camera/camera_packet.h"
#include "cpu/scene_space/scene_rays.h"
#include "library/device_impl.h"
#include "library/image/image_conversion.h"
#include "library/image/image_shader.h"
#include "library/mesh_list.h"
#include "library/pose_reader.h"
#include "library/query_cost.h"
#include "library/world_ray.h"
#include "morphray/scene.hpp"

namespace morphray::detail {

/// Members are called as those of Scene, which say what they do, but throw mray::Error as well.
class SceneImpl {
public:
    SceneImpl(std::span<const MeshView> meshes, const Device& device, const SceneOptions& options);
    /// Scene::on().
    SceneImpl(const SceneImpl& other, const Device& device);
    SceneImpl& operator=(const SceneImpl&) = delete;

    Update update();
    Update update(std::uint32_t geom_id, std::size_t first, std::size_t count);
    std::uint32_t attach(const MeshView& mesh);
    void detach(std::uint32_t geom_id);
    Update last_update() const;

    void intersect(std::span<const Ray> rays, std::span<Hit> hits) const;
    Hit intersect(const Ray& ray) const;
    void occluded(std::span<const Ray> rays, std::span<std::uint8_t> occluded) const;
    bool occluded(const Ray& ray) const;
    void render(const View& view, Image& image) const;

    TreeStatistics tree_statistics() const;
    std::vector<Box> tree_boxes(std::uint32_t depth) const;
    const Device& device() const { return device_; }
    const mray::Topology& topology() const { return meshes_.topology(); }
    Box bounds() const;

private:
    class Change;

    void start(const mray::Bvh* tree, const MeshList* before);
    std::unique_ptr<mray::UpdatePolicy> make_policy() const;
    void follow(std::span<const mray::IndexRange> changed, double read_ms);
    void require_usable() const;
    void make_scene_rays(std::span<const Ray> rays, mray::cpu::SceneRays& out) const;
    Hit to_world(const mray::Hit& hit, int t_exponent) const;
    void set_space();
    /// An image of one sample a pixel in the colours of the backend; mutex_ is locked.
    void render_plain(const View& view, TracedImage& traced, Image& image) const;
    mray::ThreadArena& arena() const { return DeviceImpl::of(device_).arena(); }
    double intersect_on_device(std::span<const Ray> rays, std::span<Hit> hits) const;
    void intersect_run(std::span<const Ray> rays, std::span<Hit> hits) const;
    template <class Answer, class AnswerOf>
    bool trace_tile(std::span<const Ray> rays, std::span<Answer> answers, std::size_t row,
                    std::size_t width, std::size_t height, AnswerOf answer_of) const;
    template <class Answer, class AnswerOf, class Run>
    void trace_all(std::span<const Ray> rays, std::span<Answer> answers, AnswerOf answer_of,
                   Run run) const;
    double trace_on_device(std::span<const mray::Ray> rays, std::span<mray::Hit> hits) const;

    Device device_;
    SceneOptions options_;
    MeshList meshes_;
    PoseReader pose_;
    std::optional<RayConverter> converter_;
    std::optional<mray::cpu::SceneRayMaker> ray_maker_;
    DeviceBackend tracer_;
    DeviceBackend refitter_;
    /// tracer_, if it is a backend that threads may query at the same time.
    mray::cpu::CpuBackend* cpu_ = nullptr;
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
