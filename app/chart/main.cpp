// morphray-chart: what `morphray chart` starts (app/commands/start_chart.cpp), with all its
// arguments.
#include "app/chart/chart.h"
#include "app/program.h"
#include "common/base/errors.h"

namespace mray::app {
namespace {

ExitCode run_command(const CommandOptions& options, const Messages& messages) {
    if (const auto* chart = std::get_if<ChartOptions>(&options))
        return draw_charts(*chart, messages);
    throw Error(ErrorKind::kBadArgument, "this program draws charts alone; start morphray");
}

}  // namespace
}  // namespace mray::app

int main(int argc, char** argv) { mray::app::run_process(argc, argv, mray::app::run_command); }
