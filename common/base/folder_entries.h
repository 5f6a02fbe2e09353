#pragma once

#include <dirent.h>

#include <cerrno>
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>

namespace mray {

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
