// Two waves that run across a sheet.
#pragma once

#include "scenes/trig.h"

namespace mray {

/// The height at (x, z), both in [-1, 1].
inline double wave_height(double x, double z, double frame) {
    constexpr double kHeight = 0.12;
    return kHeight *
           (sin_turns(1.5 * x + 0.5 * z - frame / 12) + sin_turns(2.5 * z - x + frame / 24));
}

}  // namespace mray
