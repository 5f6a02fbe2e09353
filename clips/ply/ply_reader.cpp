#include "clips/ply/ply_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <span>
#include <string>
#include <string_view>

#include "clips/mesh/mesh_rules.h"
#include "clips/ply/ply_binary.h"
#include "clips/ply/ply_header.h"
#include "clips/ply/ply_mesh.h"
#include "clips/ply/ply_text.h"
#include "common/base/errors.h"
#include "common/base/input_file.h"
#include "common/text/message_text.h"

namespace mray {
namespace {

std::string read_text(const InputFile& file, std::uint64_t begin, std::uint64_t end) {
    std::string text(static_cast<std::size_t>(end - begin), '\0');
    file.read(begin, std::as_writable_bytes(std::span(text)));
    return text;
}

/// The bytes that an item takes at least. A value in text takes a digit and a blank or line end.
std::uint64_t least_bytes(const PlyElement& element, PlyEncoding encoding) {
    return encoding == PlyEncoding::kText ? 2 * std::uint64_t{element.properties.size()}
                                          : element.least_bytes();
}

/// Refuses numbers of items that do not fit into the file.
void require_size(const PlyHeader& header, std::uint64_t file_size, const std::string& name) {
    // The last line of a text may lack its end.
    std::uint64_t left = file_size - header.size + (header.encoding == PlyEncoding::kText ? 1 : 0);
    for (const PlyElement& element : header.elements) {
        const std::uint64_t bytes = least_bytes(element, header.encoding);
        if (bytes != 0 && element.count > left / bytes) {
            throw Error(
                ErrorKind::kBadInput,
                fmt::format("{}:{}: {} items of {}, which {} bytes cannot hold; is the "
                            "file complete?",
                            name, element.line, element.count, in_quotes(element.name), left));
        }
        left -= element.count * bytes;
    }
}

void require_file_size(const InputFile& file, const std::string& name) {
    if (file.size() <= kMaxInputBytes) return;
    throw Error(ErrorKind::kLimit,
                fmt::format("{}: {} bytes are more than the {} that are read; split the scene",
                            name, file.size(), kMaxInputBytes));
}

}  // namespace

FileMesh read_ply(const std::filesystem::path& path, const MeshFileOptions& options) {
    const std::string name = shown(path);
    HeldWarnings warnings;
    MeshFileOptions held = options;
    held.warn = warnings.keeper();

    const InputFile file(path);
    require_file_size(file, name);
    PlyHeader header =
        parse_ply_header(read_text(file, 0, std::min(file.size(), kMaxPlyHeaderBytes)), name);
    require_size(header, file.size(), name);
    PlyMesh builder(header, name, held);
    builder.make_vertices();
    std::uint64_t left = 0;
    if (header.encoding == PlyEncoding::kText) {
        const std::string text = read_text(file, header.size, file.size());
        left = read_ply_text(text, header, name, builder).size();
    } else {
        left = file.size() - read_ply_binary(file, header, name, builder);
    }
    if (left > 0) held.warn({name, fmt::format("{} bytes after the last item; ignored", left)});
    FileMesh mesh = builder.finish();
    require_faces(mesh, name, "a mesh with faces", held);
    warnings.tell(options.warn);
    return mesh;
}

}  // namespace mray
