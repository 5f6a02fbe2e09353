// Questions through the public interface, for the floats of the caller.
#pragma once

#include <vector>

#include "tests/fuzz/judge/question_check.h"

namespace mray::fuzz {

/// The answers of a scene that has moved to the frame, over a tree of each kind of update. Windings
/// are those of exact integers for all triangles; distances have the sign of inside, and those
/// within a largest distance are all there; lists of hits, their numbers, and steps from hit to hit
/// agree. Everything has the bits of brute force. Points and rays that are not finite have the
/// answers that the interface promises.
std::vector<AnswerDifference> check_world(const FuzzCase& fuzz_case);

}  // namespace mray::fuzz
