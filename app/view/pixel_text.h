// A pixel's hits as text.
#pragma once

#include <string>

#include "app/view/engine.h"

namespace mray::app {

/// A line for each fact: the pixel, for each backend the triangle, t, u and v in hexadecimal and
/// decimal digits and the position, and with two backends whether they are equal.
std::string pixel_text(const PixelProbe& probe);

/// The same in few words, for a place beside the pixel: for each backend triangle and distance, and
/// whether they are equal.
std::string pixel_note(const PixelProbe& probe);

/// Whether a pixel's hit is one of the clip's mesh, and not of the ground.
inline bool is_on_mesh(const TracedScene::PixelHit& hit) { return hit.hit && hit.hit.geom_id == 0; }

}  // namespace mray::app
