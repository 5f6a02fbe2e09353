// The tracers and trees that must all give one image.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "common/backend.h"

namespace mray::fuzz {

/// How a variant's tree is made for the pose that is traced.
enum class TreeKind {
    kRefitted,  // built at another pose, refitted by the variant
    kRebuilt,   // built at the pose
    kAuto,      // updated by the policy "auto" over the poses between
};
/// "refitted", "rebuilt" or "auto".
const char* name_of(TreeKind tree);

/// A backend with a kind of tree. Several may share a backend and take turns.
struct Variant {
    Backend* backend = nullptr;
    /// "cpu avx2, 1 thread" or "vulkan".
    std::string tracer;
    TreeKind tree = TreeKind::kRebuilt;

    std::string name() const;
};

/// The variants of a process. They are made once, because each backend owns threads or a device.
struct Variants {
    std::vector<std::unique_ptr<Backend>> backends;
    /// Cases alternate between the groups.
    std::vector<std::vector<Variant>> groups;
};

/// Every instruction set of this machine and the scalar tracer (`off`), on 1 and on 2 threads, over
/// each kind of tree.
Variants cpu_variants();

/// The Vulkan device with the default tuning, and with narrow
/// packets. Throws Error(kUnavailable) without a device. The environment sets the width of its
/// vectors.
Variants vulkan_variants();

}  // namespace mray::fuzz
