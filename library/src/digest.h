// The digest of a device: a hash of its answers about a scene that is the same on every machine.
#pragma once

#include <cstdint>
#include <functional>

#include "morphray/device.hpp"

namespace morphray::detail {

/// Takes what answers were about, such as "closest hits", and a hash of all of them so far.
using DigestStep = std::function<void(const char* what, std::uint64_t hash)>;

/// Asks `questions` rays and points at each pose. Returns the hash of all answers. With `step` the
/// bytes of trees are hashed, too, in steps of their own. The last step is "denormals", which may
/// differ (docs/design/arithmetic.md, "No denormals"). Throws Error, and what `step` throws.
std::uint64_t compute_digest(const Device& device, std::uint32_t questions,
                             const DigestStep& step = {});

}  // namespace morphray::detail
