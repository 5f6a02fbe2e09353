#include "app/report/crosscheck/junit.h"

#include <fmt/format.h>

#include <utility>

#include "common/text/number_text.h"
#include "common/version.h"
#include "tools/text/xml_text.h"

namespace mray::app {
namespace {

/// The test cases of a suite and their counts.
class Suite {
public:
    explicit Suite(std::string scene) : scene_(std::move(scene)) {}

    /// `failure` is empty for a case that passed.
    void add(const std::string& group, const std::string& name, double seconds,
             const std::string& failure) {
        if (!failure.empty()) ++failures_;
        add_case(group, name, seconds, failure.empty() ? "" : "failure", failure);
    }
    void add_error(const std::string& message) {
        ++errors_;
        add_case("run", "ends after its last frame", 0, "error", message);
    }

    std::string text(const std::string& properties) const {
        return fmt::format(
            "<testsuite name=\"morphray crosscheck\" tests=\"{}\" failures=\"{}\" errors=\"{}\" "
            "time=\"{:.6f}\">\n{}{}</testsuite>\n",
            tests_, failures_, errors_, seconds_, properties, cases_);
    }

private:
    void add_case(const std::string& group, const std::string& name, double seconds,
                  const std::string& element, const std::string& message) {
        ++tests_;
        seconds_ += seconds;
        const std::string head =
            fmt::format("  <testcase classname=\"{}\" name=\"{}\" time=\"{:.6f}\"",
                        xml_ascii(scene_ + "." + group), xml_ascii(name), seconds);
        cases_ += element.empty() ? head + "/>\n"
                                  : fmt::format("{}>\n    <{} message=\"{}\"/>\n  </testcase>\n",
                                                head, element, xml_ascii(message));
    }

    std::string scene_;
    std::string cases_;
    std::size_t tests_ = 0;
    std::size_t failures_ = 0;
    std::size_t errors_ = 0;
    double seconds_ = 0;
};

std::string property(const std::string& name, const std::string& value) {
    return fmt::format("    <property name=\"{}\" value=\"{}\"/>\n", name, xml_ascii(value));
}

std::string properties(const CheckEnvironment& environment, const CheckReport& report) {
    std::string text = "  <properties>\n";
    text += property("program_version", std::string(kVersionDetail));
    text +=
        property("instruction_sets", environment.simd.empty()
                                         ? std::string("off")
                                         : fmt::format("{}", fmt::join(environment.simd, ", ")));
    for (const morphray::VulkanDeviceInfo& device : environment.devices) {
        const std::string suffix =
            environment.devices.size() == 1 ? "" : fmt::format(".{}", device.index);
        text += property("device" + suffix, device.name);
        text += property("driver" + suffix, device.driver);
        text += property("api_version" + suffix,
                         fmt::format("Vulkan {}.{}", device.api_major, device.api_minor));
    }
    text += property("scene", report.spec);
    text += property("size", fmt::format("{}x{}", report.head.width, report.head.height));
    text += property("command", environment.command);
    return text + "  </properties>\n";
}

std::string suite_of(const CheckRun& run, const CheckReport& report, const std::string& error) {
    Suite suite(report.head.scene);
    for (const CheckRow& row : report.rows) {
        suite.add(row.variant(),
                  fmt::format("frame {} {} equals {}", row.frame, row.rays, row.reference),
                  row.trace_ms / 1e3, row.equal() ? "" : describe(row.difference));
    }
    for (const TreeRow& row : report.trees) {
        suite.add(row.device.empty() ? "tree" : "tree on " + row.device,
                  fmt::format("frame {} refits equal", row.frame), 0,
                  row.equal() ? ""
                              : fmt::format("refitted on cpu: {}, on vulkan: {}",
                                            hash_text(row.cpu_hash), hash_text(row.vulkan_hash)));
    }
    for (const QueryRow& row : report.queries) {
        suite.add(row.variant, fmt::format("frame {} queries equal {}", row.frame, row.reference),
                  0, describe(row.difference));
    }
    for (const ExpectedRow& row : report.expected) {
        suite.add("expected", fmt::format("frame {} {} is as expected", row.frame, row.rays), 0,
                  row.problem);
    }
    if (run.strict && !report.warnings.empty())
        suite.add("run", "gives no warning", 0,
                  fmt::format("{}", fmt::join(report.warnings, "; ")));
    if (!error.empty()) suite.add_error(error);
    return suite.text(properties(run.environment, report));
}

}  // namespace

std::string to_junit(const CheckRun& run) {
    std::string suites;
    for (const CheckReport& report : run.scenes) {
        // A scene that was not begun has no error of its own.
        const bool not_begun = report.error.empty() && !report.complete;
        suites += suite_of(run, report, not_begun ? run.error : report.error);
    }
    if (run.scenes.size() != 1) suites = "<testsuites>\n" + suites + "</testsuites>\n";
    return "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n" + suites;
}

}  // namespace mray::app
