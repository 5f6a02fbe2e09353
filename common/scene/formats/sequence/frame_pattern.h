// Names of numbered files, as in frame_%04d.obj.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace morphray {

/// A path with one %d or %0Nd (N from 1 to 9) in its file name; %% is a percent sign. Parsed here
/// and never given to printf.
class FramePattern {
public:
    /// Throws Error(kBadArgument) for any other use of '%', none, more than one, or one in a
    /// folder.
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

}  // namespace morphray
