// Reading of input files. All inputs are read through here.
#pragma once

#include <dirent.h>

#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <ctime>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <system_error>

#include "common/base/file_descriptor.h"

namespace mray {

inline constexpr std::uint64_t kMaxInputBytes = std::uint64_t{4} << 30;

/// Returns the content of a regular file. Never waits for a pipe or device. Throws Error, if
/// possible before it allocates: kBadInput if the file is missing, unreadable, a folder, a pipe, a
/// device or a loop of links, or changed while it was read; kLimit for more than max_bytes.
std::string read_input_file(const std::filesystem::path& path,
                            std::uint64_t max_bytes = kMaxInputBytes);

/// A regular file that is read in parts. Threads may share one.
class InputFile {
public:
    /// Throws what read_input_file() throws for a file that cannot be opened.
    explicit InputFile(const std::filesystem::path& path);

    const std::filesystem::path& path() const { return path_; }
    std::uint64_t size() const { return size_; }
    /// Fills `out` with the bytes from `offset` on. Throws Error(kBadInput) if they cannot be read
    /// or are not there (any more), or if the file has changed since it was opened.
    void read(std::uint64_t offset, std::span<std::byte> out) const;

private:
    std::filesystem::path path_;
    std::uint64_t size_ = 0;
    std::timespec modified_ = {};
    FileDescriptor file_;
};

/// Returns the path of a file that a scene file names, such as a material library, with links
/// resolved. Throws Error(kBadInput) if the name is absolute, if ".." or a link leads out of the
/// folder of the scene file, or if the file does not exist.
std::filesystem::path side_file(const std::filesystem::path& scene_file, const std::string& name);

/// Calls `visit(const std::string& name)` for each entry of a folder except `.` and `..`, in the
/// order of the file system, and returns the error that ended it, if any.
/// std::filesystem::directory_iterator ends the process if memory runs out (libstdc++ 12 allocates
/// in a noexcept function); this function throws std::bad_alloc.
template <class Visit>
std::error_code for_each_entry(const std::filesystem::path& folder, const Visit& visit) {
    const auto error = [] { return std::error_code(errno, std::generic_category()); };
    const std::unique_ptr<DIR, int (*)(DIR*)> entries(::opendir(folder.c_str()), &::closedir);
    if (!entries) return error();
    errno = 0;
    while (const dirent* const entry = ::readdir(entries.get())) {
        const std::string name = entry->d_name;
        if (name != "." && name != "..") visit(name);
        errno = 0;
    }
    return errno == 0 ? std::error_code() : error();
}

}  // namespace mray
