// Checks that hold for an animation on any backend under any update policy.
#pragma once

#include "common/backend.h"
#include "tests/support/motions.h"

namespace mray::test {

/// Plays the motion under each policy and holds rays against brute force, bit by bit, and the tree
/// against its invariants.
void expect_hits_of_brute_force(const Motion& motion, Backend& tracer, Backend& brute);

/// The steps, reasons and trees of auto from counts.
std::vector<std::string> counted_decisions(const Motion& motion, Backend& tracer);

}  // namespace mray::test
