// morphray chart in a build without the charts.
#include "app/commands/commands.h"
#include "common/base/errors.h"

namespace mray::app {

ExitCode run_chart(const ChartOptions&, const Messages&) {
    throw Error(
        ErrorKind::kUnavailable,
        "chart: not built in, because GMP was not found; install libgmp-dev and build again");
}

}  // namespace mray::app
