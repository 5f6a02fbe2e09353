// morphray view: a window that shows a scene move.
#include "app/clip/render_command.h"
#include "app/commands/commands.h"
#include "app/view/viewer.h"
#include "common/base/output_file.h"

namespace mray::app {

ExitCode run_view(const Options& given, const Messages& messages) {
    Options options = with_render_defaults(given);
    if (options.screenshot.empty()) {
        // A still image goes on to be refined.
        options.shading.samples = given.shading.samples.value_or(16);
    } else {
        options.plays = false;
        check_writable(options.screenshot);
    }
    Viewer viewer(options, messages);
    viewer.run();
    return ExitCode::kOk;
}

}  // namespace mray::app
