#include "app/report/answers/point_answers.h"

#include <fmt/format.h>

#include <cmath>
#include <iterator>

#include "app/base/choices.h"
#include "app/report/json_parts.h"

namespace mray::app {
namespace {

using morphray::ClosestPoint;

const char* name_of(morphray::Feature feature) {
    if (feature == morphray::Feature::vertex) return "vertex";
    return feature == morphray::Feature::edge ? "edge" : "face";
}

/// A number of JSON, which has none that is not finite.
std::string json_number(float x) { return std::isfinite(x) ? fmt::format("{:.9g}", x) : "null"; }

std::string json_point(const morphray::Vec3& p) {
    return fmt::format("[{}, {}, {}]", json_number(p.x), json_number(p.y), json_number(p.z));
}

std::string text_of(const ClosestPoint& c) {
    if (!c) return "- - - inf - - - -";
    return fmt::format("{:.9g} {:.9g} {:.9g} {:.9g} {} {:.9g} {:.9g} {}", c.point.x, c.point.y,
                       c.point.z, c.distance, c.prim_id, c.u, c.v, name_of(c.feature));
}

std::string json_of(const ClosestPoint& c) {
    if (!c) return "null";
    return fmt::format(
        "{{\"point\": {}, \"distance\": {}, \"prim_id\": {}, \"u\": {:.9g}, \"v\": {:.9g}, "
        "\"feature\": \"{}\"}}",
        json_point(c.point), json_number(c.distance), c.prim_id, c.u, c.v, name_of(c.feature));
}

}  // namespace

void PointAnswers::add(std::span<const morphray::Vec3> points, const AnswerBatch& answers) {
    for (std::size_t i = 0; i < points.size(); ++i) {
        if (form_ == AnswerForm::kText) add_text(answers, i);
        if (form_ == AnswerForm::kJson) add_json(points[i], answers, i);
        ++point_count_;
    }
}

void PointAnswers::add_text(const AnswerBatch& answers, std::size_t i) {
    const auto out = std::back_inserter(text_);
    for (const Question question : questions_) {
        if (question != questions_.front()) text_ += ' ';
        if (question == Question::kInside) fmt::format_to(out, "{}", answers.inside[i]);
        if (question == Question::kWinding) fmt::format_to(out, "{}", answers.windings[i]);
        if (question == Question::kDistance) fmt::format_to(out, "{:.9g}", answers.distances[i]);
        if (question == Question::kClosest) text_ += text_of(answers.closest[i]);
    }
    text_ += '\n';
}

void PointAnswers::add_json(const morphray::Vec3& point, const AnswerBatch& answers,
                            std::size_t i) {
    text_ += point_count_ == 0 ? "\n    {\"point\": " : ",\n    {\"point\": ";
    text_ += json_point(point);
    for (const Question question : questions_) {
        text_ += fmt::format(", \"{}\": ", name_in<Question>(kQuestions, question));
        if (question == Question::kInside) text_ += answers.inside[i] != 0 ? "true" : "false";
        if (question == Question::kWinding) text_ += fmt::format("{}", answers.windings[i]);
        if (question == Question::kDistance) text_ += json_number(answers.distances[i]);
        if (question == Question::kClosest) text_ += json_of(answers.closest[i]);
    }
    text_ += '}';
}

std::string PointAnswers::file(const ReportHead& head, double frame,
                               morphray::FillRule rule) const {
    if (form_ == AnswerForm::kText) return text_;
    Json json = head_of(head);
    json["frame"] = frame;
    json["rule"] = name_in<morphray::FillRule>(kFillRules, rule);
    return json_with_rows(json, "points", text_);
}

}  // namespace mray::app
