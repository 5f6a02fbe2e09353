// Writing of output files, whole or not at all. All outputs are written through here.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string_view>

namespace mray {

/// Renames a complete temporary file to `path`, so that a kill leaves the old file or the new one,
/// and perhaps the temporary one. Writes to an existing device or pipe (such as /dev/stdout)
/// directly. Throws Error(kOutput) and leaves no temporary file.
void write_file(const std::filesystem::path& path, std::span<const std::byte> bytes);
void write_file(const std::filesystem::path& path, std::string_view text);

/// Checks before long work that `path` can be written. Throws Error(kOutput) if its folder is
/// missing or not writable, if it is a folder itself, or if its name is too long.
void check_writable(const std::filesystem::path& path);

/// Creates a folder and its parents. Throws Error(kOutput) if files cannot be written into it.
void make_output_folder(const std::filesystem::path& path);

}  // namespace mray
