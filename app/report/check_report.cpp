#include "app/report/check_report.h"

#include <map>

#include "report/compare.h"
#include "report/shell.h"
#include "report/table.h"

namespace mray::app {
namespace {

constexpr std::size_t kDescribedRows = 100;

std::string describe_pixel(const Hit& hit, std::uint32_t occlusion, std::uint32_t pixel) {
    return fmt::format("{} occluded {} colour #{:02x}{:02x}{:02x}", describe(hit), occlusion,
                       pixel & 0xFF, (pixel >> 8) & 0xFF, (pixel >> 16) & 0xFF);
}

/// Traces one pixel as the variant did, or as its reference, with the tree built at `build_at`.
std::string probe_command(const Options& options, const CheckedImage& image,
                          const PixelDifference& pixel, const std::string& build_at,
                          bool reference) {
    std::vector<std::string> line = {"morphray", "probe", options.source.scene};
    const auto add = [&line](const char* name, const std::string& value) {
        line.insert(line.end(), {name, value});
    };
    add("--frame", fmt::format("{}", image.frame));
    add("--pixel", fmt::format("{},{}", pixel.x, pixel.y));
    add("--rays", name_of_rays(image.rays));
    std::ranges::copy(arguments_of(options, image.rays, false), std::back_inserter(line));
    const std::string& backend = reference ? image.reference : image.backend;
    add("--backend", backend);
    if (backend == "cpu") add("--simd", reference || image.simd.empty() ? "off" : image.simd);
    add("--update", reference ? "rebuild" : image.update());
    if (!reference && !image.refit_on.empty()) add("--build-at", build_at);
    const std::string& device = options.backend.device;
    const bool on_device = image.backend == "vulkan" || image.refit_on == "vulkan";
    if (!reference && on_device && !device.empty()) add("--device", device);
    return shell_line(line);
}

std::string details_of(const Options& options, const CheckedImage& image,
                       const FrameDifference& difference, const std::string& build_at) {
    constexpr std::size_t kPixelsOfImage = 3;
    std::string text;
    for (std::size_t i = 0; i < std::min(difference.first.size(), kPixelsOfImage); ++i) {
        const PixelDifference& p = difference.first[i];
        text += fmt::format("  pixel {},{}\n", p.x, p.y);
        text += fmt::format("    {:<8} {}\n", image.reference,
                            describe_pixel(p.expected, p.expected_occlusion, p.expected_pixel));
        text += fmt::format("    {:<8} {}\n", image.backend,
                            describe_pixel(p.actual, p.actual_occlusion, p.actual_pixel));
        for (const bool reference : {true, false})
            text += fmt::format("    {}\n", probe_command(options, image, p, build_at, reference));
    }
    return text;
}

/// Adds a result of `what` to the list, with a title.
void add_result(Json& scene, const char* list, const char* what, Json result,
                const std::string& message) {
    result["title"] = fmt::format("frame {}, {}, {}", result["frame"].get<double>(),
                                  result["variant"].get<std::string>(), what);
    if (!result["equal"]) {
        result["message"] = message;
        scene["equal"] = false;
    }
    scene[list].push_back(std::move(result));
}

}  // namespace

std::string CheckedImage::variant() const {
    const std::string tracer = backend + (simd.empty() ? "" : " " + simd);
    return tracer + (refit_on.empty() ? ", rebuild" : ", refit on " + refit_on);
}

Json empty_report(const Options& options) {
    std::vector<std::string> line = {"morphray"};
    line.insert(line.end(), options.arguments.begin(), options.arguments.end());
    Json report = {{"command", "crosscheck"},
                   {"verdict", ""},
                   {"equal", true},
                   {"complete", false},
                   {"error", ""}};
    report["scenes"] = Json::array();
    // Then a report about a run that cannot begin names its scenes, too.
    for (const std::string& spec : options.inputs) {
        Json& scene = report["scenes"].emplace_back();
        scene = {{"scene", spec},
                 {"triangles", 0},
                 {"vertices", 0},
                 {"width", options.view.width},
                 {"height", options.view.height},
                 {"spec", spec},
                 {"device", ""},
                 {"complete", false},
                 {"equal", true},
                 {"error", ""},
                 {"warnings", Json::array()},
                 {"frames", Json::array()}};
        for (const char* list : kResults) scene[list] = Json::array();
    }
    report["environment"] = {{"version", kVersionDetail},
                             {"command", shell_line(line)},
                             {"simd", Json::array()},
                             {"devices", Json::array()}};
    return report;
}

void add_images(Json& scene, const Options& options, const CheckedImage& image,
                const Frame& expected, const Frame& actual) {
    const FrameDifference difference = compare_frames(expected, actual);
    const std::uint64_t hits[] = {hits_hash(expected), hits_hash(actual)};
    const std::uint64_t pixels[] = {image_hash(expected), image_hash(actual)};
    Json row = {{"variant", image.variant()},
                {"backend", image.backend},
                {"simd", image.simd},
                {"update", image.update()},
                {"refit_on", image.refit_on},
                {"frame", image.frame},
                {"rays", name_of_rays(image.rays)},
                {"reference", image.reference},
                {"equal", difference.total() == 0 && hits[0] == hits[1] && pixels[0] == pixels[1]},
                {"hits", std::ranges::count_if(
                             expected.hits, [](const Hit& hit) { return hit.prim_id != kNoPrim; })},
                {"differences",
                 {{"total", difference.total()},
                  {"false_miss", difference.false_miss},
                  {"false_hit", difference.false_hit},
                  {"prim_id", difference.prim_id},
                  {"t", difference.t},
                  {"uv", difference.uv},
                  {"occlusion", difference.occlusion},
                  {"colour", difference.colour}}},
                {"expected_hits_hash", hash_text(hits[0])},
                {"hits_hash", hash_text(hits[1])},
                {"expected_image_hash", hash_text(pixels[0])},
                {"image_hash", hash_text(pixels[1])},
                {"trace_ms", image.trace_ms}};
    if (!row["equal"] && count_differing(scene["rows"]) < kDescribedRows)
        row["details"] = details_of(options, image, difference,
                                    fmt::format("{}", scene["frames"].front().get<double>()));
    add_result(scene, "rows", name_of_rays(image.rays), std::move(row), describe(difference));
}

void add_trees(Json& scene, double frame, std::uint64_t cpu_hash, std::uint64_t vulkan_hash) {
    const std::string hashes[] = {hash_text(cpu_hash), hash_text(vulkan_hash)};
    add_result(scene, "trees", "bytes",
               {{"variant", "trees of cpu and vulkan"},
                {"frame", frame},
                {"equal", cpu_hash == vulkan_hash},
                {"cpu_bvh_hash", hashes[0]},
                {"vulkan_bvh_hash", hashes[1]}},
               fmt::format("{} on cpu, {} on vulkan", hashes[0], hashes[1]));
}

void add_answers(Json& scene, const Options& options, const CheckedImage& image,
                 const std::vector<QueryDifference>& differences) {
    Json counts = Json::object();
    std::vector<std::string> texts;
    std::size_t total = 0;
    for (const auto& [name, what, count] : differences) {
        counts[name] = count;
        texts.push_back(fmt::format("{} in {}", count, what));
        total += count;
    }
    add_result(scene, "queries", "queries",
               {{"variant", image.variant()},
                {"frame", image.frame},
                {"reference", image.reference},
                {"count", options.query_count},
                {"equal", total == 0},
                {"differences", counts}},
               fmt::format("other answers: {}", fmt::join(texts, ", ")));
}

std::size_t count_differing(const Json& results) {
    return static_cast<std::size_t>(std::count_if(
        results.begin(), results.end(), [](const Json& result) { return !result["equal"]; }));
}

void conclude(Json& report, const std::string& unfinished) {
    const std::size_t scenes = report["scenes"].size();
    std::size_t all = 0;
    std::size_t differing = 0;
    std::string first;
    bool equal = true;
    for (Json& scene : report["scenes"]) {
        equal = equal && scene["equal"];
        if (scene["rows"].empty()) scene["equal"] = false;
        for (const char* list : kResults) {
            all += scene[list].size();
            differing += count_differing(scene[list]);
            for (const Json& result : scene[list])
                if (first.empty() && !result["equal"])
                    first = fmt::format("{}, {}", escape(scene["spec"].get<std::string>()),
                                        result["title"].get<std::string>());
        }
    }
    std::string verdict;
    if (differing > 0)
        verdict = fmt::format("different: {} of {}, first in {}", differing, all, first);
    if (!unfinished.empty())
        verdict += (verdict.empty() ? "" : "; ") + ("not finished: " + unfinished);
    if (verdict.empty())
        verdict =
            fmt::format("equal: {} comparisons of {} scene{}", all, scenes, scenes == 1 ? "" : "s");
    report["verdict"] = verdict;
    report["equal"] = equal && all > 0;
    report["complete"] = unfinished.empty();
}

namespace {

constexpr const char* kPage = R"(<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8">
<meta name="viewport" content="width=device-width,initial-scale=1">
<title>{0} - morphray crosscheck</title>
<style>
:root {{ color-scheme: light dark; font: 16px/1.5 system-ui, sans-serif }}
.equal {{ color: light-dark(#14592b, #8be9ab) }}
.different {{ color: light-dark(#941616, #ffb8b3) }}
pre {{ white-space: pre-wrap; overflow-wrap: anywhere }}
</style></head>
<body>
<h1>morphray crosscheck</h1>
<p class="{1}"><strong>{0}</strong></p>
{2}<h2>Environment</h2>
<pre>{3}</pre>
<script type="application/json" id="report">{4}</script>
</body></html>
)";

constexpr const char* kSuite =
    R"(<testsuite name="morphray crosscheck" tests="{}" failures="{}" errors="{}">
  <properties>
    <property name="program_version" value="{}"/>
    <property name="instruction_sets" value="{}"/>
    <property name="device" value="{}"/>
    <property name="command" value="{}"/>
  </properties>
{}</testsuite>
)";

/// A row for each variant, in the order in which they were first compared.
std::string table_text(const Json& scene) {
    struct Results {
        std::string variant;
        std::size_t all = 0;
        std::size_t differing = 0;
        double trace_ms = 0;
    };
    std::vector<Results> variants;
    for (const char* list : kResults) {
        for (const Json& result : scene[list]) {
            const std::string variant = result["variant"];
            auto results = std::ranges::find(variants, variant, &Results::variant);
            if (results == variants.end()) results = variants.insert(results, {variant});
            ++results->all;
            results->differing += result["equal"] ? 0 : 1;
            results->trace_ms += result.value("trace_ms", 0.0);
        }
    }
    Table table({"variant", "comparisons", "result", "trace ms"});
    for (const Results& results : variants)
        table.add({results.variant, fmt::format("{}", results.all),
                   results.differing == 0 ? "equal" : fmt::format("{} differ", results.differing),
                   fmt::format("{:.2f}", results.trace_ms)});
    return table.text();
}

/// With the pixels of at most so many comparisons.
std::string scene_text(const Json& scene, std::size_t most_details) {
    std::string differences;
    std::size_t shown = 0;
    for (const char* list : kResults) {
        for (const Json& result : scene[list]) {
            if (result["equal"]) continue;
            differences += fmt::format("\n{}: {}\n", result["title"].get<std::string>(),
                                       result["message"].get<std::string>());
            if (result.contains("details") && ++shown <= most_details)
                differences += result["details"];
        }
    }
    return table_text(scene) + differences;
}

/// `message` is empty for a case that passed; `details` follow it where servers show a whole text.
std::string case_of(const std::string& group, const std::string& name, const std::string& message,
                    const std::string& details, double ms, const char* element) {
    std::string text = fmt::format("  <testcase classname=\"{}\" name=\"{}\" time=\"{:.6f}\">",
                                   markup_text(group), markup_text(name), ms / 1e3);
    if (!message.empty())
        text += fmt::format("<{0} message=\"{1}\">{1}\n{2}</{0}>", element, markup_text(message),
                            markup_text(details));
    return text + "</testcase>\n";
}

std::string simd_text(const Json& environment) {
    return fmt::format("{}", fmt::join(environment["simd"].get<std::vector<std::string>>(), ", "));
}

std::string suite_of(const Json& report, const Json& scene, const std::string& name) {
    std::string cases;
    std::size_t tests = 0;
    std::size_t failures = 0;
    for (const char* list : kResults) {
        tests += scene[list].size();
        failures += count_differing(scene[list]);
        for (const Json& result : scene[list])
            cases += case_of(name + "." + result["variant"].get<std::string>(), result["title"],
                             result.value("message", ""), result.value("details", ""),
                             result.value("trace_ms", 0.0), "failure");
    }
    // A scene that was not begun has no error of its own.
    const bool has_own = scene["complete"] || scene["error"] != "";
    const std::string error = has_own ? scene["error"] : report["error"];
    const std::size_t errors = error.empty() ? 0 : 1;
    if (errors > 0)
        cases += case_of(name + ".run", "ends after its last frame", error, "", 0, "error");
    const Json& environment = report["environment"];
    return fmt::format(kSuite, tests + errors, failures, errors,
                       markup_text(environment["version"]), simd_text(environment),
                       markup_text(scene["device"]), markup_text(environment["command"]), cases);
}

}  // namespace

std::string run_text(const Json& report) {
    std::string text;
    for (const Json& scene : report["scenes"]) {
        if (scene["rows"].empty() && scene["queries"].empty()) continue;
        if (report["scenes"].size() > 1) text += escape(scene["spec"].get<std::string>()) + "\n\n";
        constexpr std::size_t kMostDetails = 8;
        text += scene_text(scene, kMostDetails) + '\n';
    }
    return text + report["verdict"].get<std::string>() + '\n';
}

std::string to_junit(const Json& report) {
    std::string suites;
    std::map<std::string, int> counts;
    for (const Json& scene : report["scenes"]) {
        // A class is that of one scene, though its name or file is given twice.
        std::string name = scene["spec"];
        if (const int count = ++counts[name]; count > 1) name += fmt::format(" ({})", count);
        suites += suite_of(report, scene, name);
    }
    return fmt::format(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites name=\"{}\">\n{}</testsuites>\n",
        markup_text(report["verdict"]), suites);
}

std::string to_html(const Json& report) {
    std::string scenes;
    for (const Json& scene : report["scenes"]) {
        scenes += fmt::format("<h2>{}</h2>\n", markup_text(scene["scene"]));
        std::string text = scene["error"];
        for (const Json& warning : scene["warnings"]) text += '\n' + warning.get<std::string>();
        if (!scene["frames"].empty())
            text += fmt::format("\n{} triangles, {} vertices; {}x{} pixels; frames {}\n\n{}",
                                scene["triangles"].dump(), scene["vertices"].dump(),
                                scene["width"].dump(), scene["height"].dump(),
                                fmt::join(scene["frames"].get<std::vector<double>>(), ", "),
                                scene_text(scene, kDescribedRows));
        scenes += fmt::format("<pre>{}</pre>\n", markup_text(text));
    }
    const Json& environment = report["environment"];
    std::string about = fmt::format(
        "{}\nmorphray {}; instruction sets: {}", environment["command"].get<std::string>(),
        environment["version"].get<std::string>(), simd_text(environment));
    for (const Json& device : environment["devices"])
        about += fmt::format("\ndevice {}: {}, driver {}, Vulkan {}", device["index"].dump(),
                             device["name"].get<std::string>(), device["driver"].get<std::string>(),
                             device["api"].get<std::string>());
    std::string json = json_text(report, -1);
    // No "<" may end the element or begin a comment.
    for (std::size_t at = 0; (at = json.find('<', at)) != std::string::npos;)
        json.replace(at, 1, "\\u003c");
    return fmt::format(kPage, markup_text(report["verdict"]),
                       report["equal"] ? "equal" : "different", scenes, markup_text(about), json);
}

}  // namespace mray::app
