// The result of `query`.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "app/base/options.h"
#include "app/report/report_head.h"
#include "morphray/queries.hpp"

namespace mray::app {

/// The answers for some points. Those that are not asked for are empty.
struct AnswerBatch {
    std::vector<std::uint8_t> inside;
    std::vector<std::int32_t> windings;
    std::vector<float> distances;
    std::vector<morphray::ClosestPoint> closest;
};

/// Gathers the answers for points as text, JSON or records of numpy.
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
    /// Lines, rows or bytes.
    std::string text_;
    std::uint64_t point_count_ = 0;
};

}  // namespace mray::app
