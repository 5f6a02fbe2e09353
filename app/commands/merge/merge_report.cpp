#include <fmt/format.h>

#include <algorithm>
#include <span>

#include "app/commands/merge/merge_parts.h"
#include "app/report/json_parts.h"
#include "clips/frame_range.h"
#include "common/text/message_text.h"
#include "common/text/number_text.h"
#include "tools/text/table.h"

namespace mray::app {
namespace {

std::string place_of(std::uint32_t shard, const std::string& host) {
    std::string text;
    if (shard > 0) text = fmt::format("shard {}", shard);
    if (!host.empty()) text += fmt::format("{}on {}", text.empty() ? "" : " ", shown(host));
    return text;
}

/// A line for one finding, or for the same about several frames, which ascend.
std::string line_of(const Finding& finding, std::span<const double> frames) {
    std::string place = place_of(finding.shard, finding.host);
    if (!frames.empty())
        place = fmt::format("frame{} {}{}{}", frames.size() == 1 ? "" : "s",
                            frame_range_text(frames), place.empty() ? "" : " of ", place);
    std::string line = fmt::format("{}: {}: {}", place, name_of(finding.kind), shown(finding.text));
    if (frames.size() > 1) line += fmt::format(" ({} frames)", frames.size());
    return line + '\n';
}

/// Whether two findings are the same but for their frames.
bool is_same(const Finding& a, const Finding& b) {
    return a.frame && b.frame && a.kind == b.kind && a.shard == b.shard && a.host == b.host &&
           a.text == b.text;
}

/// The findings in their order, with a line for neighbours that are the same.
std::string lines_of(const std::vector<Finding>& findings) {
    std::string text;
    for (std::size_t i = 0; i < findings.size();) {
        const Finding& first = findings[i];
        std::vector<double> frames;
        if (first.frame) frames.push_back(*first.frame);
        for (++i; i < findings.size() && is_same(first, findings[i]); ++i)
            frames.push_back(*findings[i].frame);
        text += line_of(first, frames);
    }
    return text;
}

/// Who is faulty, as far as the images tell.
std::string line_of(const Suspect& suspect) {
    const std::string place = place_of(suspect.shard, suspect.host);
    const auto frames = [](std::uint32_t count) {
        return fmt::format("{} frame{}", count, count == 1 ? "" : "s");
    };
    if (suspect.outvoted > 0)
        return fmt::format("faulty: {}, alone with its images of {}\n", place,
                           frames(suspect.outvoted));
    return fmt::format("perhaps faulty: {}, which differs in {} from one other shard\n", place,
                       frames(suspect.undecided));
}

double total_ms(const Part& part) {
    double ms = 0;
    for (const auto* const images : {&part.images, &part.checks})
        for (const PartImage& image : *images) ms += image.total_ms;
    return ms;
}

std::string table_of(const std::vector<Part>& parts) {
    Table table({"shard", "host", "backend", "state", "frames", "checks", "s"});
    for (const Part& part : parts) {
        table.add({fmt::format("{}", part.shard.index), shown(part.host), shown(part.backend),
                   name_of(part.state), fmt::format("{}", part.images.size()),
                   fmt::format("{}", part.checks.size()),
                   fmt::format("{:.2f}", total_ms(part) / 1e3)});
    }
    return table.text();
}

std::string summary(const MergeReport& report) {
    const std::size_t frames = report.first().render.frames.size();
    if (!report.is_right())
        return fmt::format("{} of {} frames are there once and whole; {} finding{}\n",
                           report.frames.size(), frames, report.findings.size(),
                           report.findings.size() == 1 ? "" : "s");
    std::string text = fmt::format("all {} frames are there once and whole", frames);
    if (report.comparisons > 0)
        text += fmt::format(
            "; {} comparisons between shards are equal bit by bit, {} of them on "
            "one host",
            report.comparisons, report.same_host);
    return text + '\n';
}

Json of(const Finding& finding) {
    return {{"kind", name_of(finding.kind)},
            {"frame", finding.frame ? Json(*finding.frame) : Json(nullptr)},
            {"shard", finding.shard == 0 ? Json(nullptr) : Json(finding.shard)},
            {"host", finding.host},
            {"text", finding.text}};
}

Json of(const Part& part) {
    return {{"shard", part.shard.index},
            {"folder", part.folder.native()},
            {"host", part.host},
            {"backend", part.backend},
            {"device", part.device},
            {"state", name_of(part.state)},
            {"exit_code", part.exit_code ? Json(*part.exit_code) : Json(nullptr)},
            {"reason", part.reason},
            {"frames", part.images.size()},
            {"checks", part.checks.size()},
            {"total_ms", total_ms(part)}};
}

}  // namespace

std::string to_text(const MergeReport& report) {
    std::string text = table_of(report.parts);
    text += lines_of(report.findings);
    for (const Suspect& suspect : report.suspects) text += line_of(suspect);
    return text + summary(report);
}

std::string to_json(const MergeReport& report) {
    const PartRender& render = report.first().render;
    Json json = head_of(
        {"merge", render.scene, render.triangles, render.vertices, render.width, render.height});
    json["software"] = render.software;
    json["source"] = render.source;
    json["scene_hash"] = hash_text(render.scene_hash);
    json["right"] = report.is_right();
    json["parts"] = Json::array();
    for (const Part& part : report.parts) json["parts"].push_back(of(part));
    json["frames"] = Json::array();
    for (const MergedFrame& frame : report.frames)
        json["frames"].push_back({{"frame", frame.frame}, {"file", frame.file.native()}});
    json["comparisons"] = report.comparisons;
    json["same_host"] = report.same_host;
    json["findings"] = Json::array();
    for (const Finding& finding : report.findings) json["findings"].push_back(of(finding));
    json["suspects"] = Json::array();
    for (const Suspect& suspect : report.suspects)
        json["suspects"].push_back({{"shard", suspect.shard},
                                    {"host", suspect.host},
                                    {"outvoted", suspect.outvoted},
                                    {"undecided", suspect.undecided}});
    return json_text(json);
}

}  // namespace mray::app
