// Reading of OpenEXR files.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace mray::app {

/// Whether the name ends in .exr, in any case.
bool is_exr_name(const std::filesystem::path& path);

enum class ExrType { kHalf, kFloat, kUint };

/// "half", "float" or "uint".
const char* name_of(ExrType type);

/// The number that the bits of a channel stand for: exact for each type.
double value_of(ExrType type, std::uint32_t bits);

struct ExrChannel {
    /// With its layer, as in "depth.Z".
    std::string name;
    ExrType type = ExrType::kHalf;
};

/// A file with one image in scan lines, of which rows are read one after the other. Each call
/// throws Error with the file's name: kBadInput for a file that cannot be read, is no OpenEXR file,
/// is damaged or cut off, has several parts, deep pixels, tiles, channels that lack pixels or more
/// than 64 channels; kLimit for more than 65536 pixels a side or 2^28 in all, or if the memory
/// would not suffice. Nothing of an image's size is allocated.
class ExrReader {
public:
    explicit ExrReader(const std::filesystem::path& path);
    ~ExrReader();
    ExrReader(const ExrReader&) = delete;
    ExrReader& operator=(const ExrReader&) = delete;

    std::uint32_t width() const;
    std::uint32_t height() const;
    /// The text attribute of this name, or an empty text.
    std::string attribute(const std::string& name) const;
    /// Sorted by name; at least one.
    const std::vector<ExrChannel>& channels() const;

    /// Reads `count` >= 1 rows from `row` on, which the image has (asserted): for each channel
    /// `count` * width() values row by row, each as its bits (16 of a half).
    std::vector<std::vector<std::uint32_t>> read_rows(std::uint32_t row, std::uint32_t count);

private:
    struct File;
    std::filesystem::path path_;
    std::unique_ptr<File> file_;
};

}  // namespace mray::app
