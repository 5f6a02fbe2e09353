// The CPU behind the seam.
#pragma once

#include <memory>
#include <string>

#include "common/backend.h"
#include "cpu/scene_space/stored_rays.h"

namespace mray::cpu {

struct CpuConfig {
    /// 0: all that there are.
    int threads = 0;
    /// The instruction set, by the name of a SimdTarget; "" is the best one of this machine, "off"
    /// the readable reference, single rays in portable C++.
    std::string simd = {};
};

inline constexpr const char* kSimdOff = "off";

/// Whether make_cpu_backend takes it; throws Error as find_simd_target does if not.
void check_simd(const std::string& simd);

/// A backend whose scene threads may query at the same time, unless a call changes it.
class CpuBackend : public Backend {
public:
    /// As trace_rays(), in the calling thread, and without times().
    virtual void intersect(std::span<const Ray> rays, std::span<Hit> hits) const = 0;
    /// Finds the closest hits of a tile of rays that start at one point and lie nearly on a grid,
    /// as PacketTracer::intersect_stored(): returns false, and sets nothing, if they do not.
    virtual bool intersect_stored(const StoredRayTile& rays, Hit* hits) const = 0;
    /// Sets occluded[i] to 1 if rays[i] hits anything, else to 0. Otherwise as intersect().
    virtual void occluded(std::span<const Ray> rays, std::span<std::uint8_t> occluded) const = 0;
};

/// The fastest CPU tracer for the instruction set. name() is "cpu". Throws Error: kBadArgument for
/// an unknown instruction set, kUnavailable for one that this machine lacks.
std::unique_ptr<CpuBackend> make_cpu_backend(const CpuConfig& config = {});

/// The scalar tracer, which every other tracer is compared with: single rays in portable C++.
/// config.simd is ignored. name() is "cpu".
std::unique_ptr<CpuBackend> make_scalar_backend(const CpuConfig& config = {});

/// Every ray against every triangle: no tree to be wrong about. name() is "brute"; its refit and
/// read_tree work on a tree all the same, so that it can stand in for the others.
std::unique_ptr<CpuBackend> make_brute_backend(const CpuConfig& config = {});

}  // namespace mray::cpu
