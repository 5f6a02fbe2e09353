// Calls of the public interface on devices, and the answers of a model.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "morphray/device.hpp"
#include "tests/fuzz/case/fuzz_case.h"
#include "tests/fuzz/judge/call_play.h"

namespace mray::fuzz {

/// Devices on which calls are played. Scenes are mostly built on the first one.
struct CallDevices {
    std::string name;
    std::vector<morphray::Device> devices;
};

/// Every instruction set of this machine and `off`, on 1 and on 2 threads, in two groups, between
/// which cases alternate; or the Vulkan device. In each, scenes move to other devices, too.
std::vector<std::vector<CallDevices>> cpu_call_devices();
/// Throws Error(kUnavailable) without a device.
std::vector<std::vector<CallDevices>> vulkan_call_devices();

/// The first call with another answer, and the number of all that differ.
struct CallDifference {
    std::size_t count = 0;
    std::size_t call = 0;
    /// "closest hits", "colours", ...
    std::string what;
    /// The first number that differs, and its values as bits.
    std::string text;
};

/// "call 3 (rays, scene 0): closest hits, number 5 of 60: ..."
std::string describe(const CallDifference& difference, const FuzzCase& fuzz_case);

/// Answers the calls of a case by brute force. It keeps copies of the positions, as the
/// documentation says that the calls leave them, and builds a scene of these for each question.
class CallModel {
public:
    explicit CallModel(const FuzzCase& fuzz_case);

    /// Plays the calls on these devices, and compares answers and kinds of errors bit by bit.
    std::optional<CallDifference> compare(const CallDevices& devices) const;
    /// The number of rays, points and pixels.
    std::size_t question_count() const;

private:
    const FuzzCase& fuzz_case_;
    std::vector<CallAnswer> answers_;
};

}  // namespace mray::fuzz
