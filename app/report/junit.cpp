#include "app/report/junit.h"

#include <fmt/format.h>

#include "common/text/number_text.h"
#include "common/text/xml_text.h"

namespace mray::app {
namespace {

std::string test_case(const std::string& group, const std::string& name, double seconds,
                      const std::string& failure) {
    const std::string head = fmt::format("  <testcase classname=\"{}\" name=\"{}\" time=\"{:.6f}\"",
                                         xml_ascii(group), xml_ascii(name), seconds);
    if (failure.empty()) return head + "/>\n";
    return fmt::format("{}>\n    <failure message=\"{}\"/>\n  </testcase>\n", head,
                       xml_ascii(failure));
}

}  // namespace

std::string to_junit(const CheckReport& report) {
    std::string cases;
    std::size_t failures = 0;
    double seconds = 0;
    for (const CheckRow& row : report.rows) {
        const std::string failure = row.equal() ? "" : describe(row.difference);
        failures += row.equal() ? 0 : 1;
        seconds += row.trace_ms / 1e3;
        cases += test_case(report.head.scene + "." + row.variant(),
                           fmt::format("frame {} {} equals {}", row.frame, row.rays, row.reference),
                           row.trace_ms / 1e3, failure);
    }
    for (const TreeRow& row : report.trees) {
        const std::string failure =
            row.equal() ? ""
                        : fmt::format("refitted on cpu: {}, on vulkan: {}", hash_text(row.cpu_hash),
                                      hash_text(row.vulkan_hash));
        failures += row.equal() ? 0 : 1;
        cases += test_case(report.head.scene + ".tree",
                           fmt::format("frame {} refits alike", row.frame), 0, failure);
    }
    return fmt::format(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuite name=\"morphray crosscheck\" "
        "tests=\"{}\" failures=\"{}\" time=\"{:.6f}\">\n{}</testsuite>\n",
        report.rows.size() + report.trees.size(), failures, seconds, cases);
}

}  // namespace mray::app
