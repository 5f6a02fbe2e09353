// A case of the fuzzer: a deforming mesh, an image of it, single rays through it, questions about
// it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "common/bvh/bvh.h"
#include "common/scene/camera_setup.h"
#include "common/scene/mesh.h"
#include "common/scene/pose.h"
#include "common/scene/scene_space.h"

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

/// The mesh of a case with its trees, in scene space. Colours differ between triangles.
struct FuzzScene {
    /// Throws Error(kBadInput) for a case without poses or with indices beyond its vertices.
    explicit FuzzScene(const FuzzCase& fuzz_case);

    Topology topology;
    WorldBounds bounds;
    /// That of the frame that is traced.
    SceneSpace space;
    /// The poses from the one that the tree is built at to the frame.
    std::vector<std::vector<vec3>> journey;
    /// Its end.
    Pose pose;
    /// Built at both ends of the journey.
    Bvh built;
    Bvh rebuilt;

    const std::vector<vec3>& positions() const { return journey.back(); }
};

/// The vertices at a frame, in world space.
std::vector<vec3> world_positions(const FuzzCase& fuzz_case, double frame);
/// The same with NaN for vertices that are left out.
std::vector<vec3> seen_positions(const FuzzCase& fuzz_case, double frame);

/// The case as text that reads back as it is: floats are hexadecimal. Each line of `remarks`
/// precedes it as a comment.
std::string to_text(const FuzzCase& fuzz_case, const std::string& remarks = {});

/// Throws Error(kBadInput).
FuzzCase read_case_file(const std::filesystem::path& path);

// Makes cases from seeds: shapes on which tracers fail, their motions, and points, rays, cameras
// and lights at which they fail (generate.cpp).

/// A pure function of the seed. make_image_params() may refuse the view.
FuzzCase make_case(std::uint64_t seed);

/// A case of questions alone: a pure function of the seed. In one of four cases the rays, or the
/// points, come in groups, so many that they are asked about together.
FuzzCase make_questions(std::uint64_t seed);

/// The seed of a campaign's case.
std::uint64_t case_seed(std::uint64_t campaign_seed, std::uint64_t index);

}  // namespace mray::fuzz
