#include "app/report/crosscheck/crosscheck_html.h"

#include <algorithm>
#include <string_view>

#include "app/report/crosscheck/crosscheck_json.h"
#include "app/report/crosscheck/crosscheck_text.h"
#include "app/report/crosscheck/page.h"
#include "common/text/base64.h"

namespace mray::app {
namespace {

// A page describes at most so many rows.
constexpr std::size_t kDescribedRows = 100;

/// Describes the rows that differ, each with its image if there is one.
Json details_of(const Options& options, const CheckRun& run) {
    Json details = Json::array();
    Options one = options;
    std::size_t described = 0;
    for (std::size_t scene = 0; scene < run.scenes.size(); ++scene) {
        const CheckReport& report = run.scenes[scene];
        one.scene = report.spec;
        for (std::size_t row = 0; row < report.rows.size(); ++row) {
            if (report.rows[row].equal() || ++described > kDescribedRows) continue;
            details.push_back({{"scene", scene},
                               {"row", row},
                               {"text", describe_row(one, report.rows[row], report.build_at)}});
            const auto image = std::ranges::find(report.images, row, &RowImage::row);
            if (image != report.images.end())
                details.back()["image"] = "data:image/png;base64," + base64(image->png);
        }
    }
    return details;
}

}  // namespace

std::string to_html(const Options& options, const CheckRun& run) {
    Json report = crosscheck_json(run);
    report["details"] = details_of(options, run);
    std::string json = json_text(report, -1);
    // No "<" may end the element or begin a comment.
    for (std::size_t at = 0; (at = json.find('<', at)) != std::string::npos;)
        json.replace(at, 1, "\\u003c");
    constexpr std::string_view kPlace = "{{report}}";
    std::string page = kPage;
    return page.replace(page.find(kPlace), kPlace.size(), json);
}

}  // namespace mray::app
