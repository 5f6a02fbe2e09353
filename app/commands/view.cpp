// morphray view, if it is built in.
#include "app/commands/commands.h"
#include "app/view/viewer.h"
#include "common/base/output_file.h"

namespace mray::app {

ExitCode run_view([[maybe_unused]] const Options& options,
                  [[maybe_unused]] const Messages& messages) {
#ifdef MORPHRAY_HAS_VIEW
    if (!options.screenshot.empty()) check_writable(options.screenshot);
    show_scene(options, messages);
    return ExitCode::kOk;
#else
    throw Error(ErrorKind::kUnavailable,
                "view: not built in, because GLFW, Dear ImGui or OpenGL was not found; install "
                "libglfw3-dev, libimgui-dev and libgl-dev and build again");
#endif
}

}  // namespace mray::app
