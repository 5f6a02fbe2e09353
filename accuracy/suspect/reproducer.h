// Shrinks a finding to the fewest triangles, as a text for a test of a driver.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "accuracy/suspect/suspect.h"

namespace mray::accuracy {

/// One ray and the triangles on which a driver is still wrong in the same way.
struct Reproducer {
    Topology topology;
    std::vector<vec3> positions;
    Ray ray;
    /// The fault, answers and truth on these triangles.
    Finding finding;
    /// The triangles of the mesh, in the order of the topology above.
    std::vector<std::uint32_t> prim_ids;
};

/// Leaves out triangles as long as the fault stays, in at most `most_tries` tries. Faults of
/// crossings keep all triangles that the driver or the rule listed. They and holes also keep the
/// neighbours, near the ray, of a triangle that was missed: without its neighbour an edge is a
/// border, where a miss may be right. Afterwards both tracers hold other meshes. Returns nothing if
/// the fault does not occur again on the whole mesh. `check` is called before each try and may end
/// it by an exception.
std::optional<Reproducer> shrink(DriverRays& suspect, Backend& ours, const PosedMesh& mesh,
                                 const Ray& ray, const Finding& finding,
                                 const std::function<void()>& check, std::size_t most_tries = 300);

/// The reproducer as C: vertices, triangles and ray in hexadecimal floats, with comments on what is
/// right and what the driver answered. `origin` says where it was found, `driver` by whom.
std::string text_of(const Reproducer& reproducer, const std::string& origin,
                    const std::string& driver);

/// One line on what a driver answered and what is right.
std::string describe(const Finding& finding);

}  // namespace mray::accuracy
