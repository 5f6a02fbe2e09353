#include "app/report/answers/ray_hits.h"

#include <fmt/format.h>

#include <cmath>
#include <iterator>

#include "app/base/choices.h"
#include "app/report/json_parts.h"

namespace mray::app {
namespace {

/// The t of the ray as it was given, which may be beyond floats.
double given_t(const morphray::Hit& hit, int exponent) {
    return std::ldexp(static_cast<double>(hit.t), -exponent);
}

}  // namespace

void RayHits::add(std::span<const morphray::Hit> hits, int exponent, std::uint64_t left_out) {
    const auto out = std::back_inserter(text_);
    const bool is_json = form_ == AnswerForm::kJson;
    if (form_ == AnswerForm::kText) {
        if (has_all_) fmt::format_to(out, "R {} {}\n", hits.size(), left_out);
        if (!has_all_ && hits.empty()) text_ += "M\n";
    }
    if (is_json) {
        text_ += ray_count_ == 0 ? "\n    {" : ",\n    {";
        if (has_all_) fmt::format_to(out, "\"left_out\": {}, ", left_out);
        text_ += "\"hits\": [";
    }
    for (const morphray::Hit& hit : hits) {
        const double t = given_t(hit, exponent);
        if (form_ == AnswerForm::kText) {
            fmt::format_to(out, "H {:.9g} {} {:.9g} {:.9g}\n", t, hit.prim_id, hit.u, hit.v);
        } else {
            fmt::format_to(out,
                           "{}{{\"t\": {:.9g}, \"prim_id\": {}, \"u\": {:.9g}, \"v\": {:.9g}}}",
                           &hit == hits.data() ? "" : ", ", t, hit.prim_id, hit.u, hit.v);
        }
    }
    if (is_json) text_ += "]}";
    ++ray_count_;
    left_out_ += left_out;
    cut_rays_ += left_out > 0;
}

std::string RayHits::file(const ReportHead& head, double frame, morphray::Crossing crossing) const {
    if (form_ == AnswerForm::kText) return text_;
    Json json = head_of(head);
    json["frame"] = frame;
    if (has_all_) json["crossing"] = name_in<morphray::Crossing>(kCrossings, crossing);
    return json_with_rows(json, "rays", text_);
}

}  // namespace mray::app
