// The CPU behind the seam.
#pragma once

#include <memory>

#include "common/backend.h"

namespace morphray::cpu {

struct CpuConfig {
    /// 0: all that there are.
    int threads = 0;
};

/// Single rays over the shared layout in portable C++: the readable reference. name() is "cpu".
std::unique_ptr<Backend> make_scalar_backend(const CpuConfig& config = {});

/// Every ray against every triangle: no tree to be wrong about. name() is "brute"; its refit and
/// read_bvh work on a tree all the same, so that it can stand in for the others.
std::unique_ptr<Backend> make_brute_backend(const CpuConfig& config = {});

}  // namespace morphray::cpu
