#include "clips/keyframes/given_bounds.h"

#include <fmt/format.h>

#include "common/base/errors.h"

namespace mray {

void require_within_given(const WorldBounds& bounds, const WorldBounds& given,
                          const std::string& file, double frame) {
    if (bounds.empty()) return;
    for (int axis = 0; axis < 3; ++axis) {
        if (bounds.lower[axis] >= given.lower[axis] && bounds.upper[axis] <= given.upper[axis])
            continue;
        throw Error(ErrorKind::kBadInput,
                    fmt::format("{}: frame {} reaches from {:.9g} to {:.9g} in {}, beyond the "
                                "bounds that were given, {:.9g} to {:.9g}; give larger ones",
                                file, frame, bounds.lower[axis], bounds.upper[axis], "xyz"[axis],
                                given.lower[axis], given.upper[axis]));
    }
}

}  // namespace mray
