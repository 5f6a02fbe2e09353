// The results of `trace` and `query`.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "app/base/options.h"
#include "app/report/report_head.h"
#include "morphray/geometry.hpp"
#include "morphray/queries.hpp"

namespace mray::app {

/// Gathers the hits of rays as text or JSON.
class RayHits {
public:
    /// `has_all`: rays have any number of hits, which text and JSON count; otherwise at most one.
    RayHits(AnswerForm form, bool has_all) : form_(form), has_all_(has_all) {}

    /// Adds the next ray. Its hits' t are those of a ray whose direction was divided by
    /// 2^exponent; `left_out` hits more are not among them.
    void add(std::span<const morphray::Hit> hits, int exponent, std::uint64_t left_out = 0);

    std::uint64_t ray_count() const { return ray_count_; }
    /// The hits that are left out, and the rays that lack some.
    std::uint64_t left_out() const { return left_out_; }
    std::uint64_t cut_rays() const { return cut_rays_; }

    /// Returns the whole file. The head, the frame and the crossing are for JSON.
    std::string file(const ReportHead& head, double frame, morphray::Crossing crossing) const;

private:
    AnswerForm form_;
    bool has_all_;
    /// Lines or rows.
    std::string text_;
    std::uint64_t ray_count_ = 0;
    std::uint64_t left_out_ = 0;
    std::uint64_t cut_rays_ = 0;
};

/// The answers for some points. Those that are not asked for are empty.
struct AnswerBatch {
    std::vector<std::uint8_t> inside;
    std::vector<std::int32_t> windings;
    std::vector<float> distances;
    std::vector<morphray::ClosestPoint> closest;
};

/// Gathers the answers for points as text or JSON.
class PointAnswers {
public:
    PointAnswers(AnswerForm form, std::span<const Question> questions)
        : form_(form), questions_(questions.begin(), questions.end()) {}

    void add(std::span<const morphray::Vec3> points, const AnswerBatch& answers);

    std::uint64_t point_count() const { return point_count_; }

    /// Returns the whole file. The head, the frame and the rule are for JSON.
    std::string file(const ReportHead& head, double frame, morphray::FillRule rule) const;

private:
    void add_text(const AnswerBatch& answers, std::size_t i);
    void add_json(const morphray::Vec3& point, const AnswerBatch& answers, std::size_t i);

    AnswerForm form_;
    std::vector<Question> questions_;
    /// Lines or rows.
    std::string text_;
    std::uint64_t point_count_ = 0;
};

}  // namespace mray::app
