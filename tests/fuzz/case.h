// A case of the fuzzer: a deforming mesh, an image of it, single rays through it, questions about
// it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "common/bvh/bvh.h"
#include "common/scene/camera_setup.h"
#include "common/scene/mesh.h"
#include "common/scene/scene_space.h"
#include "tests/support/scene_frames.h"

namespace mray::fuzz {

/// In world space, as a sequence of OBJ files and the program's options give it. Pose k is
/// frame k.
struct FuzzCase {
    std::vector<uvec3> triangles;
    /// At least one; all have the same number of vertices.
    std::vector<std::vector<vec3>> poses;
    /// The pose that the tree is built at before it is refitted to `frame`.
    std::size_t build_at = 0;
    double frame = 0;
    /// Without an image the width is 0.
    ViewSpec view;
    std::vector<WorldRay> rays;
    /// Whether all questions are asked: about the rays, in addition to their closest hits, and
    /// about the points.
    bool asks_questions = false;
    std::vector<vec3> points;

    bool has_image() const { return view.width > 0; }
};

/// The mesh of a case with its trees. Colours differ between triangles.
class FuzzScene {
public:
    /// Throws Error(kBadInput) for a case without poses or with indices beyond its vertices.
    explicit FuzzScene(const FuzzCase& fuzz_case);

    const Topology& topology() const { return frames_->animation().topology(); }
    const SceneSpace& space() const { return frames_->space(); }
    const WorldBounds& bounds() const { return bounds_; }
    /// In scene space.
    std::span<const vec3> built_positions() const { return built_positions_; }
    std::span<const vec3> positions() const { return positions_; }
    const Bvh& built() const { return built_; }
    /// Built at the frame that is traced.
    const Bvh& rebuilt() const { return rebuilt_; }
    /// The poses from the one that the tree is built at to the frame, in scene space.
    const std::vector<std::vector<vec3>>& journey() const { return journey_; }

private:
    std::unique_ptr<SceneFrames> frames_;
    double frame_ = 0;
    WorldBounds bounds_;
    std::vector<vec3> built_positions_;
    std::vector<vec3> positions_;
    std::vector<std::vector<vec3>> journey_;
    Bvh built_;
    Bvh rebuilt_;
};

/// The vertices at a frame, in world space.
std::vector<vec3> world_positions(const FuzzCase& fuzz_case, double frame);
/// The same with NaN for vertices that are left out.
std::vector<vec3> seen_positions(const FuzzCase& fuzz_case, double frame);

/// The case as text that reads back bit for bit: floats are hexadecimal, NaN is written as its
/// bits. Each line of `remarks` precedes it as a comment.
std::string to_text(const FuzzCase& fuzz_case, const std::string& remarks = {});

/// Reads the text of a case. Throws Error(kBadInput), `name:line: problem`.
FuzzCase read_case(std::string_view text, const std::string& name);
/// Reads a file. Throws as read_case, also if the file cannot be read.
FuzzCase read_case_file(const std::filesystem::path& path);

}  // namespace mray::fuzz
