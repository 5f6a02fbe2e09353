// How much memory the content of a glTF file may take beyond the file.
#pragma once

#include <cstdint>

namespace mray {

/// Bytes that may still be taken for JSON, nodes and accessors. At first 56 MiB, which with what
/// the allocator adds stay below 64.
class ContentBudget {
public:
    static constexpr std::uint64_t kLeastBytes = std::uint64_t{56} << 20;

    void add(std::uint64_t bytes) { left_ += bytes; }
    /// Returns false, and takes nothing, if there is less.
    bool take(std::uint64_t bytes) {
        if (bytes > left_) return false;
        left_ -= bytes;
        return true;
    }

private:
    std::uint64_t left_ = kLeastBytes;
};

}  // namespace mray
