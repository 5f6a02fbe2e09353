// The report of a cross-check as text, as JUnit and as a page.
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <string_view>

#include "app/report/crosscheck/check_report.h"
#include "app/report/crosscheck/page.h"
#include "common/report/table.h"
#include "common/text/text.h"

namespace mray::app {
namespace {

// The text has the pixels of so many comparisons of a scene.
constexpr std::size_t kShownDetails = 8;

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

std::string scene_text(const Json& scene) {
    std::string differences;
    std::size_t shown = 0;
    for (const char* list : kResults) {
        for (const Json& result : scene[list]) {
            if (result["equal"]) continue;
            differences += fmt::format("\n{}: {}\n", result["title"].get<std::string>(),
                                       result["message"].get<std::string>());
            if (result.contains("details") && ++shown <= kShownDetails)
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
                       markup_text(environment["version"]),
                       fmt::join(environment["simd"].get<std::vector<std::string>>(), ", "),
                       markup_text(scene["device"]), markup_text(environment["command"]), cases);
}

}  // namespace

std::string run_text(const Json& report) {
    std::string text;
    for (const Json& scene : report["scenes"]) {
        if (scene["rows"].empty() && scene["queries"].empty()) continue;
        if (report["scenes"].size() > 1) text += escape(scene["spec"].get<std::string>()) + "\n\n";
        text += scene_text(scene) + '\n';
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
    std::string json = json_text(report, -1);
    // No "<" may end the element or begin a comment.
    for (std::size_t at = 0; (at = json.find('<', at)) != std::string::npos;)
        json.replace(at, 1, "\\u003c");
    constexpr std::string_view kPlace = "{{report}}";
    std::string page = kPage;
    return page.replace(page.find(kPlace), kPlace.size(), json);
}

}  // namespace mray::app
