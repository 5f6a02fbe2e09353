// The tracers that must all draw one picture.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "common/backend.h"

namespace morphray::fuzz {

/// How an entrant's tree comes to the pose that is traced.
enum class TreeKind {
    kRefitted,  // built at another pose, refitted by the entrant
    kRebuilt,   // built at the pose
    kAuto,      // kept by the policy "auto" over the poses between
};
/// "refitted", "rebuilt" or "auto".
const char* name_of(TreeKind tree);

/// A backend with a kind of tree. Several may share a backend and take turns.
struct Entrant {
    Backend* backend = nullptr;
    /// "cpu avx2, 1 thread" or "vulkan".
    std::string tracer;
    TreeKind tree = TreeKind::kRebuilt;
    /// What the program takes besides --backend, "" where no program has this entrant.
    std::string arguments;

    std::string name() const;
};

/// All of a process, made once: each owns threads or a device.
struct Entrants {
    std::vector<std::unique_ptr<Backend>> backends;
    /// Cases take turns.
    std::vector<std::vector<Entrant>> lineups;
};

/// Every instruction set of this machine and none (`off`), on 1 and on 2 threads, over each kind
/// of tree.
Entrants cpu_entrants();

/// The Vulkan device, and that again with interpolation on the device and with narrow packets.
/// Throws Error(kUnavailable) without one. How wide its vectors are is for the environment.
Entrants vulkan_entrants();

}  // namespace morphray::fuzz
