// The formats of files that this program reads and writes.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace mray::app {

struct FileFormat {
    /// The kind of file: "mesh", "image".
    std::string_view use;
    std::string_view name;
    /// With their dots, a blank between them; empty: any.
    std::string_view extensions;
    bool is_read = false;
    bool is_written = false;
    std::string_view content;
};

/// All formats of this build, those of meshes first; those that messages and help name come from
/// the same table of meshes (scenes/mesh/mesh_file.h).
std::vector<FileFormat> file_formats();

/// As `info --formats` prints them.
std::string text_of(const std::vector<FileFormat>& formats);

}  // namespace mray::app
