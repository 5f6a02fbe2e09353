// Many warnings of one kind as one.
#pragma once

#include <fmt/format.h>

#include <cstdint>
#include <functional>
#include <string>

namespace morphray {

using WarnFunction = std::function<void(const std::string&)>;

/// Keeps the first message of a kind and counts the rest, so that a file of a million odd lines
/// does not print a million lines.
class WarningCount {
public:
    /// `make` returns the message; it is called for the first one only.
    template <class Make>
    void add(const Make& make) {
        if (count_++ == 0) message_ = make();
    }
    void tell(const WarnFunction& warn) const {
        if (count_ == 0 || !warn) return;
        warn(count_ == 1 ? message_ : fmt::format("{} (and {} more)", message_, count_ - 1));
    }

private:
    std::string message_;
    std::uint64_t count_ = 0;
};

}  // namespace morphray
