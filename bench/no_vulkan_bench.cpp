#include "bench/works.h"
#include "common/error.h"

namespace morphray::bench {

void bench_vulkan(const Rig&, const BenchScene&, std::span<const TraceWork* const>) {
    throw Error(ExitCode::kUnavailable, "--work vulkan: this build has no Vulkan backend");
}

}  // namespace morphray::bench
