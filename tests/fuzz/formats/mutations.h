// Damages files.
#pragma once

#include <string>

#include "tests/fuzz/generate/dice.h"

namespace mray::fuzz {

/// The bytes with one to four changes: cut, bits and bytes changed, numbers of 1 to 8 bytes set to
/// 0, 1, their limits or what lies beside those, decimal numbers replaced by such ones, parts
/// removed, doubled or moved, a very long line.
std::string mutated(std::string bytes, Dice& dice);

}  // namespace mray::fuzz
