#include "common/version.h"

#include "morphray/version.hpp"

namespace morphray {

const char* version() noexcept { return mray::kVersion.data(); }

}  // namespace morphray
