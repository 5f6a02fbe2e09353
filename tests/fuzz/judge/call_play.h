// Plays calls of the public interface.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "common/scene/world_bounds.h"
#include "morphray/morphray.hpp"
#include "tests/fuzz/case/call.h"
#include "tests/fuzz/generate/call_meshes.h"
#include "tests/fuzz/generate/places.h"

namespace mray::fuzz {

/// A part of the answers of a call, as bits: hits, colours, ... An error is a part, too.
struct CallPart {
    const char* what = "";
    std::vector<std::uint32_t> bits;
};
using CallAnswer = std::vector<CallPart>;

/// A scene as it is played.
class PlayedScene {
public:
    virtual ~PlayedScene() = default;
    virtual std::unique_ptr<PlayedScene> on(const morphray::Device& device) = 0;
    virtual std::uint32_t attach(const std::shared_ptr<CallMesh>& mesh) = 0;
    virtual void detach(std::uint32_t geom_id) = 0;
    virtual void update() = 0;
    virtual void update_with_new_bounds() = 0;
    virtual void update(std::uint32_t geom_id, std::size_t first, std::size_t count) = 0;
    /// To ask.
    virtual const morphray::Scene& scene() = 0;
};

using CallMeshes = std::span<const std::shared_ptr<CallMesh>>;

/// A scene of the library.
class LibraryScene final : public PlayedScene {
public:
    LibraryScene(CallMeshes meshes, const morphray::Device& device,
                 const morphray::SceneOptions& options);
    std::unique_ptr<PlayedScene> on(const morphray::Device& device) override;
    std::uint32_t attach(const std::shared_ptr<CallMesh>& mesh) override;
    void detach(std::uint32_t geom_id) override;
    void update() override;
    void update_with_new_bounds() override;
    void update(std::uint32_t geom_id, std::size_t first, std::size_t count) override;
    const morphray::Scene& scene() override { return scene_; }

private:
    explicit LibraryScene(morphray::Scene scene) : scene_(std::move(scene)) {}

    morphray::Scene scene_;
};

/// A scene as the documentation describes it: copies of the positions as they were last read, and
/// brute force over a scene that is built of them for each question.
class ModelScene final : public PlayedScene {
public:
    ModelScene(CallMeshes meshes, const morphray::Device& brute,
               const std::optional<morphray::Box>& bounds);
    std::unique_ptr<PlayedScene> on(const morphray::Device& device) override;
    std::uint32_t attach(const std::shared_ptr<CallMesh>& mesh) override;
    void detach(std::uint32_t geom_id) override;
    void update() override;
    void update_with_new_bounds() override;
    void update(std::uint32_t geom_id, std::size_t first, std::size_t count) override;
    const morphray::Scene& scene() override;

private:
    struct Mesh {
        std::shared_ptr<CallMesh> mesh;
        std::vector<vec3> positions;
    };

    ModelScene(const ModelScene& other);
    void positions_changed();

    morphray::Device brute_;
    std::optional<morphray::Box> bounds_;
    /// By geom_id; without a mesh where it is free.
    std::vector<Mesh> meshes_;
    /// Those from the next update on, if they are others. A mesh that is new has no positions yet.
    std::optional<std::vector<Mesh>> next_;
    std::optional<morphray::Scene> scene_;
};

/// Plays calls one after the other on devices, or by the model if there are none.
class CallPlay {
public:
    explicit CallPlay(std::span<const morphray::Device> devices);

    CallAnswer play(const Call& call);

private:
    struct Slot {
        std::unique_ptr<PlayedScene> scene;
        /// By geom_id, as attach() has returned them; the last mesh that had it.
        std::vector<std::shared_ptr<CallMesh>> meshes;
    };

    void change(const Call& call, CallAnswer& answer);
    void build(const Call& call, Slot& slot);
    void ask(const Call& call, Slot& slot, CallAnswer& answer);
    const morphray::Device& device(std::uint64_t seed) const;

    std::span<const morphray::Device> devices_;
    morphray::Device brute_;
    /// All arrays, which scenes may borrow.
    std::vector<std::shared_ptr<CallMesh>> meshes_;
    std::array<Slot, kCallScenes> slots_;
};

}  // namespace mray::fuzz
