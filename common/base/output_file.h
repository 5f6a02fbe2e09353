// The one way in which anything is written: whole or not at all.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

namespace morphray {

/// Writes a temporary beside `path`, checks every write, fsyncs, and renames it over `path`. A kill
/// at any moment leaves the old file or the new one. Writes to an existing device or pipe (such as
/// /dev/stdout) directly. Throws Error(kOutput) and leaves no temporary.
void write_file(const std::filesystem::path& path, std::span<const std::byte> bytes);
void write_file(const std::filesystem::path& path, std::string_view text);

/// Whether `path` could be written, asked before long work: throws Error(kOutput) when its folder
/// is missing or not writable, it is a folder itself, or its name is too long.
void check_writable(const std::filesystem::path& path);

/// Likewise for a folder that outputs go into; creates it and its parents when missing.
void make_output_folder(const std::filesystem::path& path);

}  // namespace morphray
