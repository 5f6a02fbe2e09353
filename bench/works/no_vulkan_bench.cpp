#include "bench/works/works.h"
#include "common/base/errors.h"

namespace mray::bench {

void bench_vulkan(const Rig&, const BenchScene&, std::span<const TraceWork* const>) {
    throw Error(ErrorKind::kUnavailable, "--work vulkan: this build has no Vulkan backend");
}

}  // namespace mray::bench
