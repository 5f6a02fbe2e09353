// JSON files that the program writes and reads back. Where it can write what it has read, reading
// that must give the same text again.
#include <string>
#include <vector>

#include "app/commands/profile/baseline.h"
#include "app/report/profile_report.h"
#include "tests/fuzz/targets/case_file.h"
#include "tests/fuzz/targets/outcome.h"
#include "tests/fuzz/targets/targets.h"

namespace mray::fuzz {
namespace {

/// The run that a baseline is compared with (corpus/baseline/).
app::ProfileReport measured_run() {
    app::ProfileReport report;
    report.head = {.command = "profile",
                   .scene = "s",
                   .triangles = 12,
                   .vertices = 8,
                   .width = 32,
                   .height = 16};
    report.rays = "primary";
    report.repeat = 3;
    for (const double frame : {0.0, 1.0}) {
        app::ProfileRow row;
        row.frame = frame;
        row.backend = "cpu";
        for (const app::SampleKind& kind : app::kSampleKinds)
            row.samples.*kind.samples = {1, 2, 1.5};
        report.rows.push_back(row);
    }
    return report;
}

}  // namespace

std::string baseline_failure(std::string_view bytes) {
    static CaseFile file("baseline.json");
    static const app::ProfileReport run = measured_run();
    file.write(bytes);
    return failure_of(file.path(), [&]() -> std::string {
        const std::vector<std::string> backends = {"cpu"};
        const std::vector<double> frames = {0, 1};
        const app::ProfileReport baseline = app::read_baseline(file.path(), run, backends, frames);
        return app::compare_with_baseline(file.path(), baseline, run, 10).text.empty() ? "no text"
                                                                                       : "";
    });
}

}  // namespace mray::fuzz
