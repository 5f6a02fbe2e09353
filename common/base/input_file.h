// Reading of input files. All inputs are read through here.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

namespace mray {

inline constexpr std::uint64_t kMaxInputBytes = std::uint64_t{4} << 30;

/// The content of a regular file. Throws as InputFile, and Error(kLimit) above max_bytes.
std::string read_input_file(const std::filesystem::path& path,
                            std::uint64_t max_bytes = kMaxInputBytes);

/// A regular file that is read in parts. Threads may share one.
class InputFile {
public:
    /// Never waits for a pipe or device. Throws Error(kBadInput) unless it can read a regular file.
    explicit InputFile(const std::filesystem::path& path);
    ~InputFile();
    InputFile(const InputFile&) = delete;
    InputFile& operator=(const InputFile&) = delete;

    const std::filesystem::path& path() const { return path_; }
    std::uint64_t size() const { return size_; }
    /// Fills `out` with the bytes from `offset` on. Throws Error(kBadInput) if they cannot be read.
    void read(std::uint64_t offset, std::span<std::byte> out) const;

private:
    std::filesystem::path path_;
    std::uint64_t size_ = 0;
    int fd_;
};

/// Returns the path of a file that a scene file names, with links resolved. Throws Error(kBadInput)
/// for an absolute name, where ".." or a link leads out of the scene file's folder, and if there is
/// no such file.
std::filesystem::path side_file(const std::filesystem::path& scene_file, const std::string& name);

}  // namespace mray
