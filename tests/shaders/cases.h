// Random and extreme arguments for the shared functions, within the range of each function.
#pragma once

#include <cstdint>
#include <vector>

#include "tests/shaders/evaluate.h"

namespace mray::test {

std::vector<Inputs> cases(std::uint32_t function, std::size_t count);

const char* function_name(std::uint32_t function);

}  // namespace mray::test
