// Makes the poses of a clip from a shape, in world space.
#pragma once

#include "tests/fuzz/case/fuzz_case.h"
#include "tests/fuzz/generate/dice.h"
#include "tests/fuzz/generate/shapes.h"

namespace mray::fuzz {

/// Writes triangles, poses, the frame and the pose that the tree is built at: a shape that moves in
/// some way, at some scale and offset, or a small built-in scene.
void make_clip(Dice& dice, FuzzCase& fuzz_case);

}  // namespace mray::fuzz
