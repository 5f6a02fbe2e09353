// Damages files.
#pragma once

#include <string>

#include "tests/fuzz/generate/dice.h"

namespace mray::fuzz {

/// The bytes with one to four changes: cut, bits and bytes changed, numbers of 1 to 8 bytes set to
/// 0, 1, their limits or what lies beside those, decimal numbers replaced by such ones, parts
/// removed, doubled, moved or swapped, a very long line. The lengths in a GLB file follow its text,
/// mostly.
std::string mutated(std::string bytes, Dice& dice);

}  // namespace mray::fuzz
