// morphray-chart: what `morphray chart` and `morphray crosscheck --suspect` start
// (app/commands/start_chart.cpp), with all their arguments.
#include "app/chart/chart.h"
#include "app/chart/suspect.h"
#include "app/process.h"
#include "common/base/errors.h"

namespace mray::app {
namespace {

ExitCode run_command(const Options& options, const Messages& messages) {
    if (options.command == Command::kChart) return draw_charts(options, messages);
    if (options.command == Command::kCrosscheck && options.suspect)
        return judge_driver(options, messages);
    throw Error(ErrorKind::kBadArgument, "this program draws charts alone; start morphray");
}

}  // namespace
}  // namespace mray::app

int main(int argc, char** argv) { mray::app::run_process(argc, argv, mray::app::run_command); }
