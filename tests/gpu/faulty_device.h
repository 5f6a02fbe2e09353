// A backend whose Vulkan calls fail on demand.
#pragma once

#include <gtest/gtest.h>

#include <memory>

#include "common/base/errors.h"
#include "gpu/shared_device.h"
#include "tests/gpu/faulty_loader.h"

namespace mray::test {

/// There can be one at a time.
struct FaultyDevice {
    explicit FaultyDevice(bool staging = false) : force_staging(staging) {
        gpu::Tuning tuning;
        tuning.loader = loader.get();
        tuning.force_staging = force_staging;
        backend = gpu::make_vulkan_backend({}, tuning);
    }

    /// Whether copies go through a staging buffer even if the host sees the device's memory.
    bool force_staging;
    Faults faults;
    FaultyLoader loader{faults};
    std::unique_ptr<Backend> backend;
};

/// Lets the first call of an action fail, then the second, and so on until the action ends without
/// a failure. After each failure calls recover(), which sees no faults. Returns the number of
/// failures; the test fails if an action hides one.
template <class Action, class Recover>
std::size_t fail_in_turn(Faults& faults, const Action& action, const Recover& recover) {
    constexpr std::size_t kTooMany = 1000;
    for (std::size_t k = 0; k < kTooMany; ++k) {
        SCOPED_TRACE(k);
        faults.failed_name.clear();
        faults.fail_at = faults.call_count + k;
        bool has_thrown = false;
        try {
            action();
        } catch (const Error&) {
            has_thrown = true;
        }
        faults.fail_at = Faults::kNever;
        EXPECT_EQ(has_thrown, !faults.failed_name.empty()) << faults.failed_name;
        if (!has_thrown) return k;
        recover();
    }
    ADD_FAILURE() << "the action has more than " << kTooMany << " calls";
    return kTooMany;
}

}  // namespace mray::test
