// Judges how a reader ended.
#pragma once

#include <exception>
#include <string>
#include <string_view>

#include "common/base/errors.h"

namespace mray::fuzz {

/// Returns what is wrong with a message: several lines, control characters, a text out of all
/// proportion, or one without `name` (which may be empty). Empty if nothing is.
std::string message_failure(std::string_view message, std::string_view name);

/// Returns what is wrong with an error about the file `name`.
std::string error_failure(const Error& error, std::string_view name);

/// Keeps what is wrong with the first bad warning.
class WarningJudge {
public:
    /// Must not outlive the judge.
    WarnFunction function() {
        return [this](const Warning& warning) {
            if (failure_.empty()) failure_ = message_failure(warning.line(), {});
        };
    }
    const std::string& failure() const { return failure_; }

private:
    std::string failure_;
};

/// Calls `work`, which returns what is wrong, and judges what it throws. `is_refused` is whether it
/// threw an Error.
template <class Work>
std::string failure_of(std::string_view name, Work work, bool* is_refused = nullptr) {
    try {
        return work();
    } catch (const Error& error) {
        if (is_refused != nullptr) *is_refused = true;
        return error_failure(error, name);
    } catch (const std::exception& error) {
        return std::string("exception: ") + error.what();
    }
}

}  // namespace mray::fuzz
