// morphray view in a build without the viewer.
#include "app/commands/commands.h"
#include "common/base/errors.h"

namespace mray::app {

ExitCode run_view(const ViewOptions&, const Messages&) {
    throw Error(ErrorKind::kUnavailable,
                "view: not built in, because GLFW, Dear ImGui or OpenGL was not found; install "
                "libglfw3-dev, libimgui-dev and libgl-dev and build again");
}

}  // namespace mray::app
