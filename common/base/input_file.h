// The one way in which anything is read.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace morphray {

inline constexpr std::uint64_t kMaxInputBytes = std::uint64_t{4} << 30;

/// The whole of a regular file. Never waits on a pipe or device. Throws Error, before anything is
/// allocated where it can: kBadInput (missing, unreadable, a folder, a pipe, a device, a loop of
/// links, changed in size while it was read), kLimit (more than max_bytes).
std::string read_input_file(const std::filesystem::path& path,
                            std::uint64_t max_bytes = kMaxInputBytes);

/// Where a file that a scene names (a material library) really lies. Throws Error(kBadInput) when
/// the name is absolute, or leads by "..", or by a link, out of the folder that the scene file lies
/// in, or when nothing is there.
std::filesystem::path side_file(const std::filesystem::path& scene_file, const std::string& name);

}  // namespace morphray
