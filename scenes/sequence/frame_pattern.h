// Patterns of numbered file names, such as frame_%04d.obj.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace mray {

/// A path with one %d or %0Nd (N from 1 to 9) in its file name; %% is a percent sign. The text
/// never reaches printf.
class FramePattern {
public:
    /// Throws Error(kBadArgument) without a frame number, with several, with one in a folder's
    /// name, and for any other use of '%'.
    explicit FramePattern(const std::string& pattern);

    /// The folder part with its slash; empty when there is none.
    const std::string& folder() const { return folder_; }
    /// The file name of a frame, without the folder.
    std::string file_name(std::uint64_t number) const;
    /// The number n for which file_name(n) is `name`, of at most 9 digits.
    std::optional<std::uint64_t> number_of(std::string_view name) const;

private:
    std::string folder_;
    std::string prefix_;
    std::string suffix_;
    std::size_t width_ = 0;
};

}  // namespace mray
