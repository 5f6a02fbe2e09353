// Embree's ways to answer questions about all triangles: point queries, and rays of which a filter
// counts the hits.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "lab/bench/embree/embree_scene.h"
#include "lab/bench/questions/question_work.h"

namespace mray::bench {

/// A MEDIUM tree: in one with spatial splits, filters see a triangle several times. The device and
/// the mesh outlive it. All calls belong in an arena of the device's number of threads.
class EmbreeQuestions {
public:
    /// `most_rays` is the most that count() is called with.
    EmbreeQuestions(const EmbreeDevice& device, const EmbreeMesh& mesh, bool robust,
                    std::size_t most_rays);

    /// "robust (MEDIUM, avx512)"
    const std::string& name() const { return name_; }
    /// The same for all that differ in the device alone.
    const char* group() const { return group_; }

    /// By rtcPointQuery, whose callback finds the closest point of a triangle by Ericson's method
    /// and narrows the query.
    void find_closest(std::span<const vec3> points, std::span<NearestPoint> nearest) const;
    /// By Intersect1, whose filter counts and rejects all hits. `coherent`: the flag of this name.
    void count(std::span<const Ray> rays, bool coherent);
    /// Those of the last count(), by ray.
    std::span<const std::uint64_t> counts() const { return counts_; }

private:
    std::string name_;
    const char* group_;
    const EmbreeMesh* mesh_;
    EmbreeScene scene_;
    std::vector<std::uint64_t> counts_;
};

}  // namespace mray::bench
