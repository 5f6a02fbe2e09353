// The CPU behind the seam.
#pragma once

#include <memory>
#include <string>

#include "common/backend.h"
#include "common/simd/simd_target.h"

namespace mray::cpu {

struct CpuConfig {
    /// 0: all that there are.
    int threads = 0;
    /// The instruction set, by the name of a SimdTarget; "" is the best one of this machine,
    /// kSimdOff the readable reference, single rays in portable C++.
    std::string simd = {};
};

/// The fastest CPU tracer for the instruction set. Its name is "cpu". Throws Error: kBadArgument
/// for an unknown instruction set, kUnavailable for one that this machine lacks.
std::unique_ptr<Backend> make_cpu_backend(const CpuConfig& config = {});

/// The reference: single rays in portable C++, without config.simd. Its name is "cpu".
std::unique_ptr<Backend> make_scalar_backend(const CpuConfig& config = {});

/// Every ray against every triangle: no tree to be wrong about. Its name is "brute"; its refit and
/// read_tree work on a tree all the same, so that it can stand in for the others.
std::unique_ptr<Backend> make_brute_backend(const CpuConfig& config = {});

/// A device's backend (gpu/vulkan_backend.h) that does all that Backend promises: what the device
/// cannot answer, the host does in the calling thread, with its tree and these instructions.
std::unique_ptr<Backend> with_host_answers(std::unique_ptr<Backend> device,
                                           const SimdTarget& target);

}  // namespace mray::cpu
