#include "app/chart/suspect_report.h"

#include <fmt/format.h>

#include <array>

#include "app/report/json_parts.h"
#include "common/text/base64.h"
#include "common/text/number_text.h"
#include "tools/text/table.h"
#include "tools/text/xml_text.h"

namespace mray::app {
namespace {

using accuracy::Fault;
using accuracy::HitErrors;
using accuracy::kFaultCount;

Fault fault_at(std::size_t i) { return static_cast<Fault>(i); }

std::array<std::uint64_t, kFaultCount> sums_of(const SuspectRun& run) {
    std::array<std::uint64_t, kFaultCount> sums{};
    for (const SuspectRow& row : run.rows)
        for (std::size_t i = 0; i < kFaultCount; ++i) sums[i] += row.counts.faults[i];
    return sums;
}

/// Per million of the hits, those whose t is off by more than 4 ulp.
double far_off_per_million(const HitErrors& errors) {
    std::uint64_t all = 0;
    std::uint64_t far = 0;
    for (std::size_t i = 0; i < errors.t_counts.size(); ++i) {
        all += errors.t_counts[i];
        if (i >= HitErrors::kUlps.size() || HitErrors::kUlps[i] > 4) far += errors.t_counts[i];
    }
    return all == 0 ? 0 : 1e6 * static_cast<double>(far) / static_cast<double>(all);
}

/// The rows, with a column for each kind of fault that occurs.
Table table_of(const SuspectRun& run) {
    const auto sums = sums_of(run);
    std::vector<std::string> header{"scene", "frame", "structure", "rays of", "rays", "wrong"};
    for (std::size_t i = 0; i < kFaultCount; ++i)
        if (sums[i] != 0) header.emplace_back(accuracy::name_of(fault_at(i)));
    header.insert(header.end(), {"t > 4 ulp /M", "ours", "hits"});
    Table table(header);
    for (const SuspectRow& row : run.rows) {
        std::vector<std::string> cells{
            row.scene, fmt::format("{}", row.frame),       row.structure,
            row.view,  fmt::format("{}", row.counts.rays), fmt::format("{}", row.counts.wrong())};
        for (std::size_t i = 0; i < kFaultCount; ++i)
            if (sums[i] != 0) cells.push_back(fmt::format("{}", row.counts.faults[i]));
        cells.push_back(fmt::format("{:.0f}", far_off_per_million(row.counts.driver)));
        cells.push_back(fmt::format("{:.0f}", far_off_per_million(row.counts.ours)));
        cells.push_back(hash_text(row.hits_hash));
        table.add(cells);
    }
    return table;
}

Json of(const HitErrors& errors) {
    Json json;
    json["t_ulps"] = HitErrors::kUlps;
    json["t_counts"] = errors.t_counts;
    json["worst_t_ulps"] = errors.worst_t_ulps;
    json["worst_t_ray"] = errors.worst_t_ray;
    json["worst_weight"] = errors.worst_weight;
    json["worst_weight_ray"] = errors.worst_weight_ray;
    return json;
}

Json of(const SuspectRow& row) {
    Json faults;
    for (std::size_t i = 0; i < kFaultCount; ++i)
        faults[accuracy::name_of(fault_at(i))] = row.counts.faults[i];
    Json json = {{"scene", row.scene},
                 {"triangles", row.triangles},
                 {"frame", row.frame},
                 {"structure", row.structure},
                 {"view", row.view},
                 {"rays", row.counts.rays},
                 {"wrong", row.counts.wrong()},
                 {"other_triangle", row.counts.other_triangle},
                 {"other_crossings", row.counts.other_crossings},
                 {"unlisted", row.counts.unlisted},
                 {"hits_hash", hash_text(row.hits_hash)},
                 {"build_ms", row.build_ms},
                 {"trace_ms", row.trace_ms}};
    json["faults"] = std::move(faults);
    json["errors"] = of(row.counts.driver);
    json["our_errors"] = of(row.counts.ours);
    return json;
}

Json of(const SuspectFinding& finding) {
    return {{"fault", accuracy::name_of(finding.fault)},
            {"place", finding.place},
            {"description", finding.description},
            {"probe", finding.probe},
            {"triangles", finding.triangles},
            {"reproducer", finding.reproducer}};
}

std::string html_colour(std::uint32_t rgba) {
    return fmt::format("#{:02x}{:02x}{:02x}", rgba & 0xFF, rgba >> 8 & 0xFF, rgba >> 16 & 0xFF);
}

constexpr const char* kHead = R"(<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>morphray crosscheck: a driver's rays</title>
<style>
body{font:15px/1.45 system-ui,sans-serif;max-width:1500px;margin:1.5em auto;padding:0 1em;color:#222}
pre{overflow:auto;font-size:12px;background:#f6f6f6;padding:.8em}
figure{display:inline-block;margin:0 1em 1em 0}img{image-rendering:pixelated;border:1px solid #ddd}
dt{font-weight:600}dd{margin:0 0 .3em 1.2em}i{display:inline-block;width:.8em;height:.8em}
</style></head><body>
<h1>A driver's rays</h1>
)";

}  // namespace

std::uint64_t SuspectRun::wrong() const {
    std::uint64_t sum = 0;
    for (const SuspectRow& row : rows) sum += row.counts.wrong();
    return sum;
}

std::uint32_t colour_of(accuracy::Fault fault) {
    // Based on: M. Okabe, K. Ito. Color Universal Design. 2008; and three more.
    constexpr std::array<std::uint32_t, kFaultCount> kColours = {
        0xFF0000FF, 0xFF0080FF, 0xFF005ED5, 0xFF009FE6, 0xFFA779CC, 0xFFB27200,
        0xFF42E4F0, 0xFFE9B456, 0xFF739E00, 0xFF800080, 0xFFFF00FF};
    return kColours[static_cast<std::size_t>(fault)];
}

std::string suspect_text(const SuspectRun& run) {
    std::string text = fmt::format("driver: {}\n{}", run.driver, table_of(run).text());
    for (const SuspectFinding& finding : run.findings) {
        text += fmt::format("{}: {}\n  {}\n", accuracy::name_of(finding.fault), finding.place,
                            finding.description);
        if (!finding.probe.empty()) text += fmt::format("  {}\n", finding.probe);
        if (!finding.reproducer.empty())
            text += fmt::format("  on {} triangle{}, as C in the reports and in --out\n",
                                finding.triangles, finding.triangles == 1 ? "" : "s");
    }
    const std::uint64_t wrong = run.wrong();
    return text +
           (wrong == 0 ? "no answer is wrong\n" : fmt::format("{} answers are wrong\n", wrong));
}

std::string suspect_json(const SuspectRun& run) {
    Json json = head_of("crosscheck");
    json["suspect"] = "ray-query";
    json["driver"] = run.driver;
    json["invocation"] = run.command;
    json["width"] = run.width;
    json["height"] = run.height;
    json["wrong"] = run.wrong();
    json["rows"] = Json::array();
    for (const SuspectRow& row : run.rows) json["rows"].push_back(of(row));
    json["findings"] = Json::array();
    for (const SuspectFinding& finding : run.findings) json["findings"].push_back(of(finding));
    return json_text(json);
}

std::string suspect_html(const SuspectRun& run) {
    std::string page = kHead;
    page += fmt::format("<p>{}<br><code>{}</code></p>\n<p>{} answers are wrong.</p>\n<dl>\n",
                        xml_escaped(run.driver), xml_escaped(run.command), run.wrong());
    const auto sums = sums_of(run);
    for (std::size_t i = 0; i < kFaultCount; ++i) {
        page += fmt::format("<dt><i style=\"background:{}\"></i> {}: {}</dt><dd>{}</dd>\n",
                            html_colour(colour_of(fault_at(i))), accuracy::name_of(fault_at(i)),
                            sums[i], accuracy::meaning_of(fault_at(i)));
    }
    page += fmt::format("</dl>\n<pre>{}</pre>\n", xml_escaped(table_of(run).text()));
    for (const SuspectPicture& picture : run.pictures) {
        page += fmt::format(
            "<figure><img alt=\"\" src=\"data:image/png;base64,{}\"><figcaption>{}</figcaption>"
            "</figure>\n",
            base64(picture.png), xml_escaped(picture.title));
    }
    for (const SuspectFinding& finding : run.findings) {
        page += fmt::format("<h2>{}: {}</h2>\n<p>{}</p>\n", accuracy::name_of(finding.fault),
                            xml_escaped(finding.place), xml_escaped(finding.description));
        if (!finding.probe.empty())
            page += fmt::format("<pre>{}</pre>\n", xml_escaped(finding.probe));
        if (!finding.reproducer.empty())
            page += fmt::format("<pre>{}</pre>\n", xml_escaped(finding.reproducer));
    }
    return page + "</body></html>\n";
}

}  // namespace mray::app
