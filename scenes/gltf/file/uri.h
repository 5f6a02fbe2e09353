// The names of files, and files in names, in a glTF file.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "scenes/json/json_at.h"

namespace mray::gltf {

/// The bytes of a "data:" URI in base 64; nothing for other URIs. Throws Error(kBadInput) for one
/// that is not in base 64.
std::optional<std::string> data_of_uri(const JsonAt& uri);

/// The file that a relative URI names (RFC 3986: %20 is a blank), which lies in the folder of the
/// glTF file at `scene_file`, links resolved. Throws Error(kBadInput) for a URI with a scheme such
/// as "file:" or "http:", and what side_file() throws.
std::filesystem::path file_of_uri(const JsonAt& uri, const std::filesystem::path& scene_file);

}  // namespace mray::gltf
