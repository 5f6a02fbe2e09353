#include "app/commands/commands.h"

#include "common/base/errors.h"

namespace mray::app {

ExitCode run_command(const Options& options, const Messages& messages) {
    switch (options.command) {
        case Command::kRender:
            return run_render(options, messages);
        case Command::kView:
            return run_view(options, messages);
        case Command::kCrosscheck:
            return run_crosscheck(options, messages);
        case Command::kDiff:
            return run_diff(options, messages);
        case Command::kProbe:
            return run_probe(options, messages);
        case Command::kProfile:
            return run_profile(options, messages);
        case Command::kTrace:
            return run_trace(options, messages);
        case Command::kQuery:
            return run_query(options, messages);
        case Command::kChart:
            return run_chart(options, messages);
        case Command::kInfo:
            return run_info(options, messages);
        case Command::kDevices:
            return run_devices(options, messages);
    }
    throw Error(ErrorKind::kInternal, "no such command");
}

}  // namespace mray::app
