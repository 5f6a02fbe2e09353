// Joins warnings of one kind into one.
#pragma once

#include <cstdint>

#include "common/base/errors.h"

namespace mray {

/// Keeps the first warning of a kind and counts the rest, however many a file has.
class WarningCount {
public:
    /// `make` returns the Warning; it is called for the first one only.
    template <class Make>
    void add(const Make& make) {
        if (count_++ == 0) first_ = make();
    }
    /// Gives the first warning with the number of the others, if there is one.
    void tell(const WarnFunction& warn) const {
        if (count_ == 0 || !warn) return;
        Warning warning = first_;
        warning.more = count_ - 1;
        warn(warning);
    }

private:
    Warning first_;
    std::uint64_t count_ = 0;
};

}  // namespace mray
