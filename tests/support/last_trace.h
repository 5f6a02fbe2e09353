// The cost of a trace, as a tree updater takes it.
#pragma once

#include "common/backend.h"
#include "common/update/tree_updater.h"

namespace mray::test {

/// The cost of a backend's last trace.
inline TraceCost last_trace(Backend& backend) {
    const BackendTimes& times = backend.finish();
    return {times.trace_ms, times.rays};
}

}  // namespace mray::test
