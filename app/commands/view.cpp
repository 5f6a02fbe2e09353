// morphray view: a window that shows a scene move.
#include "app/commands/commands.h"
#include "app/view/viewer.h"
#include "common/base/output_file.h"

namespace mray::app {

ExitCode run_view(const ViewOptions& options, const Messages& messages) {
    if (!options.screenshot.empty()) check_writable(options.screenshot);
    Viewer viewer(options, messages);
    viewer.run();
    return ExitCode::kOk;
}

}  // namespace mray::app
