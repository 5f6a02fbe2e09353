// A flag by which the caller of long work ends it, and a number that shows how far it is.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>

#include "common/base/errors.h"

namespace mray {

/// The message of the error by which watched work ends early.
inline constexpr const char* kWorkCancelled = "the work was cancelled";

/// Work reads it between tasks of some milliseconds, in any of its threads, and ends soon after
/// *cancel is true, which must outlive it; null: it does not end early.
class Watch {
public:
    Watch() = default;
    explicit Watch(const std::atomic<bool>* cancel, std::atomic<double>* progress = nullptr)
        : cancel_(cancel), progress_(progress) {}

    bool can_cancel() const { return cancel_ != nullptr; }
    bool is_cancelled() const {
        return cancel_ != nullptr && cancel_->load(std::memory_order_relaxed);
    }
    void throw_if_cancelled() const {
        if (is_cancelled()) throw Error(ErrorKind::kCancelled, kWorkCancelled);
    }
    /// This share of the work is done.
    void advance(double share) const {
        if (progress_ != nullptr) *progress_ += share;
    }

private:
    const std::atomic<bool>* cancel_ = nullptr;
    std::atomic<double>* progress_ = nullptr;
};

/// Resizes an array as its member does, and asks the watch while gigabytes are cleared.
template <class Array>
void resize_watched(Array& array, std::size_t size, const Watch& watch) {
    constexpr std::size_t kAtOnce = std::size_t{1} << 22;
    if (size > array.size()) array.reserve(size);
    while (array.size() < size) {
        watch.throw_if_cancelled();
        array.resize(array.size() + std::min(kAtOnce, size - array.size()));
    }
    array.resize(size);
}

}  // namespace mray
