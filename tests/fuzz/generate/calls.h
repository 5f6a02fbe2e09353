// Sequences of calls of the public interface.
#pragma once

#include <cstdint>

#include "tests/fuzz/case/fuzz_case.h"

namespace mray::fuzz {

/// Scenes of several meshes that are attached and detached, move and are updated, copied to other
/// devices and destroyed, with questions in between: a pure function of seed.
FuzzCase make_calls(std::uint64_t seed);

}  // namespace mray::fuzz
