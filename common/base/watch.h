// How the caller of long work watches it: asks it to end, and sees how far it is.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>

#include "common/base/errors.h"

namespace mray {

/// The message of the error by which watched work ends early.
inline constexpr const char* kWorkCancelled = "the work was cancelled";

/// Work asks it between tasks of some milliseconds, in any of its threads. What the pointers name
/// must outlive the work; either may be null.
class Watch {
public:
    Watch() = default;
    /// The work is to end soon after *cancel is true. *done becomes the part of it that is done,
    /// from 0 to 1.
    explicit Watch(const std::atomic<bool>* cancel, std::atomic<float>* done = nullptr)
        : cancel_(cancel), done_(done) {}

    /// Whether the work may be asked to end.
    bool can_cancel() const { return cancel_ != nullptr; }
    bool is_cancelled() const {
        return cancel_ != nullptr && cancel_->load(std::memory_order_relaxed);
    }
    void throw_if_cancelled() const {
        if (is_cancelled()) throw Error(ErrorKind::kCancelled, kWorkCancelled);
    }

    /// Says that `done` of `total` tasks are done.
    template <class Count>
    void set_done(Count done, Count total) const {
        if (done_ == nullptr || total == 0) return;
        const float part = static_cast<float>(done) / static_cast<float>(total);
        done_->store(begin_ + part * (end_ - begin_), std::memory_order_relaxed);
    }

    /// The watch of a step of this work, which is [begin, end] of it.
    Watch step(float begin, float end) const {
        Watch part = *this;
        part.begin_ = begin_ + begin * (end_ - begin_);
        part.end_ = begin_ + end * (end_ - begin_);
        return part;
    }

private:
    const std::atomic<bool>* cancel_ = nullptr;
    std::atomic<float>* done_ = nullptr;
    float begin_ = 0;
    float end_ = 1;
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
