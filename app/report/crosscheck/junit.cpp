#include <fmt/format.h>

#include "app/report/crosscheck/check_report.h"

namespace mray::app {
namespace {

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

/// The text with markup as entities, and '?' for all but printable ASCII: a reader rejects the
/// whole report for one bad byte.
std::string xml_ascii(std::string_view text) {
    std::string result;
    for (const char c : text) {
        if (c == '&') {
            result += "&amp;";
        } else if (c == '<') {
            result += "&lt;";
        } else if (c == '>') {
            result += "&gt;";
        } else if (c == '"') {
            result += "&quot;";
        } else {
            result += c < 0x20 || c >= 0x7F ? '?' : c;
        }
    }
    return result;
}

struct Suite {
    std::string scene, cases;
    std::size_t tests = 0, failures = 0;

    /// `message` is empty for a case that passed.
    void add(const std::string& group, const std::string& name, const std::string& message,
             double ms = 0, const char* element = "failure") {
        ++tests;
        cases += fmt::format("  <testcase classname=\"{}\" name=\"{}\" time=\"{:.6f}\">",
                             xml_ascii(scene + "." + group), xml_ascii(name), ms / 1e3);
        if (!message.empty()) {
            ++failures;
            cases += fmt::format("<{} message=\"{}\"/>", element, xml_ascii(message));
        }
        cases += "</testcase>\n";
    }
};

std::string suite_of(const Json& report, const Json& scene) {
    const Json& environment = report["environment"];
    Suite suite{scene["scene"], ""};
    for (const Json& row : scene["rows"])
        suite.add(row["variant"],
                  fmt::format("frame {} {} equals {}", plain_text(row["frame"]),
                              plain_text(row["rays"]), plain_text(row["reference"])),
                  row.value("message", ""), row["trace_ms"]);
    for (const Json& row : scene["trees"])
        suite.add("tree", fmt::format("frame {} refits equal", plain_text(row["frame"])),
                  row.value("message", ""));
    for (const Json& row : scene["queries"])
        suite.add(row["variant"],
                  fmt::format("frame {} queries equal {}", plain_text(row["frame"]),
                              plain_text(row["reference"])),
                  row.value("message", ""));
    const std::size_t failures = suite.failures;
    // A scene that was not begun has no error of its own.
    const bool has_own = scene["complete"] || scene["error"] != "";
    const std::string error = has_own ? scene["error"] : report["error"];
    if (!error.empty()) suite.add("run", "ends after its last frame", error, 0, "error");
    return fmt::format(kSuite, suite.tests, failures, suite.failures - failures,
                       xml_ascii(plain_text(environment["version"])),
                       fmt::join(environment["simd"].get<std::vector<std::string>>(), ", "),
                       xml_ascii(plain_text(scene["device"])),
                       xml_ascii(plain_text(environment["command"])), suite.cases);
}

}  // namespace

std::string to_junit(const Json& report) {
    std::string suites;
    for (const Json& scene : report["scenes"]) suites += suite_of(report, scene);
    if (report["scenes"].size() != 1) suites = "<testsuites>\n" + suites + "</testsuites>\n";
    return "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n" + suites;
}

}  // namespace mray::app
