// The functions that libFuzzer calls: one target (tests/fuzz/targets/targets.h), named by
// MORPHRAY_TARGET.
#include <fmt/format.h>

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>

#include "tests/fuzz/targets/targets.h"

extern "C" [[gnu::visibility("default")]] int LLVMFuzzerTestOneInput(const std::uint8_t* data,
                                                                     std::size_t size) {
    const std::string failure =
        mray::fuzz::MORPHRAY_TARGET({reinterpret_cast<const char*>(data), size});
    if (failure.empty()) return 0;
    fmt::print(stderr, "{}\n", failure);
    std::abort();
}
