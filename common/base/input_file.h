// Reading of input files. All inputs are read through here.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace mray {

inline constexpr std::uint64_t kMaxInputBytes = std::uint64_t{4} << 30;

/// Returns the content of a regular file. Never waits for a pipe or device. Throws Error, if
/// possible before it allocates: kBadInput (missing, unreadable, a folder, a pipe, a device, a loop
/// of links, changed in size while it was read), kLimit (more than max_bytes).
std::string read_input_file(const std::filesystem::path& path,
                            std::uint64_t max_bytes = kMaxInputBytes);

/// Returns the path of a file that a scene file names, such as a material library, with links
/// resolved. Throws Error(kBadInput) if the name is absolute, if ".." or a link leads out of the
/// folder of the scene file, or if the file does not exist.
std::filesystem::path side_file(const std::filesystem::path& scene_file, const std::string& name);

}  // namespace mray
