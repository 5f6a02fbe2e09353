// Command lines that do again what the viewer shows.
#pragma once

#include <string>

#include "app/base/options.h"
#include "app/view/image_request.h"

namespace mray::app {

/// The options of render for a request's image, on whatever backend. `given` are those of view.
/// They also say how to come to the tree, for colours that show it.
Options render_options(const Options& given, const ImageRequest& request, const TreeOrigin& tree);

/// `morphray render ...`, which renders the image of the first backend, bit by bit; but for edits
/// of the mesh, and for trees that were restructured where colours show the tree.
std::string copy_command(const Options& given, const ImageRequest& request, const TreeOrigin& tree);

/// `morphray probe ...` of a pixel.
std::string probe_command(const Options& given, const ImageRequest& request, Pixel pixel);

/// Whether copy_command() gives the request's bits.
bool is_reproducible(const ImageRequest& request, const TreeOrigin& tree);

}  // namespace mray::app
