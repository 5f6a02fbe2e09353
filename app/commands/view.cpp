// morphray view: a window that shows a scene move.
#include "app/clip/render_command.h"
#include "app/commands/commands.h"
#include "app/view/window/viewer.h"
#include "common/base/output_file.h"

namespace mray::app {

ExitCode run_view(const Options& given, const Messages& messages) {
    Options options = with_render_defaults(given);
    // A still image goes on to be refined; a screenshot is what render writes.
    if (given.screenshot.empty()) options.shading.samples = given.shading.samples.value_or(64);
    if (!options.screenshot.empty()) check_writable(options.screenshot);
    Viewer viewer(options, messages);
    viewer.run();
    if (options.exit_after > 0) messages.print(viewer.summary());
    return ExitCode::kOk;
}

}  // namespace mray::app
