// Update policies of the public interface, as those behind it.
#pragma once

#include "common/update/policy.h"
#include "morphray/scene.hpp"

namespace morphray::detail {

/// Throws Error(bad_argument) for a budget or a number of poses out of range.
mray::PolicySpec spec_of(const UpdatePolicy& policy);
/// The settings of an Auto; for others the defaults.
mray::UpdateConfig config_of(const UpdatePolicy& policy);

}  // namespace morphray::detail
