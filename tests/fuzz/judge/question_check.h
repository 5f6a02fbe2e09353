// Questions about the rays and points of a case, with the answers of brute force.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/interop/ray.h"
#include "tests/fuzz/case/fuzz_case.h"
#include "tests/support/query_answers.h"

namespace mray::fuzz {

/// The kinds of comparisons.
enum class Asked {
    kImage,
    kClosestHits,
    kAnyHits,
    kHitCounts,
    kAllHits,
    kNextHits,
    kWindings,
    kClosestPoints,
};
/// "closest hits", "windings", ...
const char* name_of(Asked asked);
/// Whether it is asked about points; otherwise about rays.
bool is_about_points(Asked asked);

/// Rays or points with other answers, and the first of them, by its place in the case.
struct AnswerDifference {
    Asked asked = Asked::kImage;
    std::size_t count = 0;
    std::size_t index = 0;
    std::string expected;
    std::string actual;
};

/// Collects differences of answers: one for each kind.
class AnswerDifferences {
public:
    void add(Asked asked, std::size_t index, const std::string& expected,
             const std::string& actual);
    const std::vector<AnswerDifference>& all() const { return differences_; }

private:
    std::vector<AnswerDifference> differences_;
};

/// A hit in words, floats as bits, too.
std::string hit_text(const Hit& hit);

/// Lists of each crossing, lists that are cut, next hits after hits and after cursors next to them,
/// windings, and closest triangles within any distance, exactly a distance of one of the points,
/// and just less.
class CaseQuestions {
public:
    /// Leaves out rays and points that scene space does not take.
    CaseQuestions(const FuzzScene& scene, const FuzzCase& fuzz_case,
                  const test::Queries& reference);

    /// The number of rays and points.
    std::size_t size() const { return ray_indices_.size() + point_indices_.size(); }
    std::vector<AnswerDifference> compare(const test::Queries& queries) const;

private:
    struct Round {
        Crossing crossing;
        std::uint32_t most;
        test::Questions questions;
        test::Answers expected;
    };

    std::vector<std::size_t> ray_indices_;
    std::vector<std::size_t> point_indices_;
    std::vector<Round> rounds_;
};

}  // namespace mray::fuzz
