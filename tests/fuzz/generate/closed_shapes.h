// Balls, boxes, tori, stars, tetrahedra.
#pragma once

#include "tests/fuzz/generate/shapes.h"

namespace mray::fuzz {

/// A closed mesh of few triangles; every third is pressed flat, to a line, or to a point.
Shape closed_mesh(Dice& dice);

}  // namespace mray::fuzz
