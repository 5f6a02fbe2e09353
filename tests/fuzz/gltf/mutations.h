// Small changes of glTF files.
#pragma once

#include <random>
#include <string>

namespace mray::fuzz {

/// The file after one to four changes: of bytes, of numbers in its text, or of its length. The
/// lengths in a binary file follow, mostly. A pure function of its arguments.
std::string mutated(std::string bytes, std::mt19937_64& random);

}  // namespace mray::fuzz
