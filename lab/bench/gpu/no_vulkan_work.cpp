#include "common/base/errors.h"
#include "lab/bench/gpu/vulkan_work.h"

namespace mray::bench {

void bench_vulkan(const BenchScene&, int, const std::function<void(const Row&)>&) {
    throw Error(ErrorKind::kUnavailable, "Vulkan: not built in");
}

std::string count_table(const BenchScene&) { return ""; }

}  // namespace mray::bench
