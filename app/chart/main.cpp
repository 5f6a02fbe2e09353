// morphray-chart: what `morphray chart` starts (app/commands/start_chart.cpp), with all its
// arguments.
#include "app/chart/chart.h"
#include "app/process.h"
#include "common/base/errors.h"

namespace mray::app {
namespace {

ExitCode run_command(const Options& options, const Messages& messages) {
    if (options.command == Command::kChart) return draw_charts(options, messages);
    throw Error(ErrorKind::kBadArgument, "this program draws charts alone; start morphray");
}

}  // namespace
}  // namespace mray::app

int main(int argc, char** argv) { mray::app::run_process(argc, argv, mray::app::run_command); }
