// The work "vulkan" alone, for machines without Embree: scenes, --repeat, --size, --csv and --json
// as lab/bench/run takes them.
#include <fmt/format.h>

#include <cstdio>
#include <string>
#include <vector>

#include "common/base/errors.h"
#include "common/base/output_file.h"
#include "common/report/shell_text.h"
#include "common/version.h"
#include "lab/bench/gpu/vulkan_work.h"
#include "lab/bench/machine.h"
#include "lab/bench/options.h"
#include "lab/bench/report.h"

namespace mray::bench {
namespace {

void run(const std::vector<std::string>& arguments) {
    const BenchOptions options = parse_options(arguments);
    if (options.help) {
        fmt::print("{}", usage());
        return;
    }
    const ReportHead head{machine_name() + ", " + device_line(), machine_isa(),        "none", "",
                          std::string(kVersionDetail),           shell_line(arguments)};
    fmt::print("{}\n", head.machine);
    std::vector<Row> rows;
    const auto report = [&](const Row& row) {
        rows.push_back(row);
        fmt::print("{}", table_line(row));
        std::fflush(stdout);
        if (!options.json.empty()) write_file(options.json, to_json(head, rows));
        if (!options.csv.empty()) write_file(options.csv, to_csv(head, rows));
    };
    for (const std::string& spec : options.scenes) {
        const BenchScene scene = open_bench_scene(spec, options.view_kind, options.view);
        fmt::print("{}", table_header());
        bench_vulkan(scene, options.repeat, report);
    }
}

}  // namespace
}  // namespace mray::bench

int main(int argc, char** argv) {
    try {
        mray::bench::run(std::vector<std::string>(argv + 1, argv + argc));
        return 0;
    } catch (const std::exception& error) {
        fmt::print(stderr, "morphray_gpu_bench: {}\n", error.what());
        return 1;
    }
}
