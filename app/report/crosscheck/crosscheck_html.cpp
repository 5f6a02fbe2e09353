#include "app/report/crosscheck/crosscheck_html.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "app/report/crosscheck/crosscheck_json.h"
#include "app/report/crosscheck/crosscheck_text.h"
#include "app/report/crosscheck/html_parts.h"
#include "common/text/message_text.h"
#include "common/version.h"
#include "tools/text/xml_text.h"

namespace mray::app {
namespace {

constexpr const char* kHead = R"(<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8">
<meta name="viewport" content="width=device-width,initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'unsafe-inline'">
)";

/// Numbers of comparisons of one kind.
struct Tally {
    std::size_t all = 0;
    std::size_t differing = 0;

    template <class Rows>
    void add(const Rows& rows) {
        all += rows.size();
        differing += static_cast<std::size_t>(
            std::ranges::count_if(rows, [](const auto& row) { return !row.equal(); }));
    }
};

struct Verdict {
    bool good = false;
    std::string word;
    std::string text;
};

Verdict verdict_of(const CheckRun& run) {
    Tally images, trees, queries, expected;
    for (const CheckReport& scene : run.scenes) {
        images.add(scene.rows);
        trees.add(scene.trees);
        queries.add(scene.queries);
        expected.add(scene.expected);
    }
    Verdict verdict;
    const auto add = [&verdict](const Tally& tally, const char* one, const char* several) {
        if (tally.all == 0) return;
        if (tally.differing > 0) {
            verdict.text += fmt::format("{} of {} {} differ{}. ", tally.differing, tally.all,
                                        several, tally.differing == 1 ? "s" : "");
        } else {
            verdict.text += tally.all == 1 ? fmt::format("The {} is equal bit by bit. ", one)
                                           : fmt::format("All {} {} are equal bit by bit. ",
                                                         tally.all, several);
        }
    };
    add(images, "image", "images");
    add(trees, "pair of refitted trees", "pairs of refitted trees");
    add(queries, "set of answers to queries", "sets of answers to queries");
    add(expected, "comparison with expected hashes", "comparisons with expected hashes");
    verdict.word = "Equal";
    if (!run.equal()) verdict.word = "Different";
    const bool warned = run.strict && run.warnings() > 0;
    if (warned) verdict.text += "There are warnings, which count as failures. ";
    if (warned && run.equal()) verdict.word = "Equal, with warnings";
    if (!run.complete()) {
        verdict.word += images.all == 0 ? "" : ", not finished";
        if (images.all == 0) verdict.word = "Not compared";
        verdict.text += "Not all was compared. " + run.error;
    }
    verdict.good = run.equal() && run.complete() && !warned;
    return verdict;
}

std::string item_html(const std::string& name, const std::string& value) {
    return fmt::format("<dt>{}</dt><dd>{}</dd>\n", xml_escaped(name), xml_escaped(value));
}

std::string environment_html(const CheckEnvironment& environment) {
    std::string html = "<h2 id=\"environment\">Environment</h2>\n<dl>\n";
    html += item_html("program", fmt::format("morphray {}", kVersionDetail));
    html +=
        fmt::format("<dt>command</dt><dd><code>{}</code></dd>\n", xml_escaped(environment.command));
    html +=
        item_html("instruction sets", environment.simd.empty()
                                          ? "none: the scalar reference"
                                          : fmt::format("{}", fmt::join(environment.simd, ", ")));
    if (environment.devices.empty()) html += item_html("device", "none: only the CPU is compared");
    for (const morphray::VulkanDeviceInfo& device : environment.devices)
        html += item_html(
            fmt::format("device {}", device.index),
            fmt::format("{} ({}), driver {}, Vulkan {}.{}, UUID {}", device.name, device.type,
                        device.driver, device.api_major, device.api_minor, device.uuid));
    return html + "</dl>\n";
}

std::string list_html(const std::string& title, const std::vector<std::string>& lines) {
    if (lines.empty()) return "";
    std::string html = fmt::format("<h3>{}</h3>\n<ul>\n", title);
    for (const std::string& line : lines)
        html += fmt::format("<li>{}</li>\n", xml_escaped(shown(line)));
    return html + "</ul>\n";
}

std::string scene_html(const ScenePart& scene, PageRoom& room) {
    const CheckReport& report = scene.report;
    std::string html = fmt::format("<h2 id=\"scene-{}\">{}</h2>\n", scene.index + 1,
                                   xml_escaped(shown(report.spec)));
    html += fmt::format("<p>{} triangles, {} vertices; {}x{} pixels; frames {}.</p>\n",
                        report.head.triangles, report.head.vertices, report.head.width,
                        report.head.height, fmt::join(report.frames, ", "));
    if (!report.complete)
        html += fmt::format("<p class=\"verdict bad\">Not finished{}</p>\n",
                            report.error.empty() ? "." : ": " + xml_escaped(report.error));
    // The matrix comes first, but has links to what follows.
    std::set<std::size_t> described;
    const std::string differences = differences_html(scene, room, described);
    html += matrix_html(scene, described) + differences;
    std::vector<std::string> problems;
    for (const ExpectedRow& row : report.expected) {
        if (!row.equal())
            problems.push_back(fmt::format("frame {}, {}: {}", row.frame, row.rays, row.problem));
    }
    html += list_html("Other hashes than expected", problems);
    std::vector<std::string> answers;
    for (const QueryRow& row : report.queries)
        if (!row.equal()) answers.push_back(query_text(row));
    html += list_html("Other answers to queries", answers);
    return html + list_html("Warnings", report.warnings);
}

/// JSON inside <script>: no "<" can end the element or begin a comment.
std::string script_json(const CheckRun& run) {
    std::string text;
    for (const char c : json_text(crosscheck_json(run), -1)) {
        if (c == '<') {
            text += "\\u003c";
        } else {
            text += c;
        }
    }
    return text;
}

}  // namespace

std::string to_html(const Options& options, const CheckRun& run) {
    const Verdict verdict = verdict_of(run);
    std::string html = kHead;
    html += fmt::format("<title>{}: morphray crosscheck</title>\n<style>{}</style></head>\n<body>",
                        verdict.word, kPageStyle);
    html += fmt::format(
        "<main>\n<h1>morphray crosscheck</h1>\n<p class=\"verdict {}\"><strong>{}</strong> "
        "{}</p>\n",
        verdict.good ? "good" : "bad", verdict.word, xml_escaped(verdict.text));
    PageRoom room;
    if (!run.equal())
        html += fmt::format(
            "<p class=\"note\">This page describes at most {} images that differ, "
            "and shows the first {}.</p>\n",
            room.rows, room.images);
    Options one = options;
    for (std::size_t i = 0; i < run.scenes.size(); ++i) {
        one.scene = run.scenes[i].spec;
        html += scene_html({one, run.scenes[i], i}, room);
    }
    html += environment_html(run.environment);
    html += "<p id=\"said\" class=\"note\" role=\"status\"></p>\n</main>\n";
    html += fmt::format("<script type=\"application/json\" id=\"report\">{}</script>\n",
                        script_json(run));
    return html + fmt::format("<script>{}</script>\n</body></html>\n", kPageScript);
}

}  // namespace mray::app
