#include "scenes/mesh/mesh_file.h"

#include <fmt/format.h>

#include <bit>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/errors.h"
#include "common/base/input_file.h"
#include "common/text/text_parts.h"
#include "scenes/mesh/mesh_rules.h"
#include "scenes/ply/ply_header.h"
#include "scenes/ply/ply_mesh.h"
#include "scenes/ply/ply_source.h"

namespace mray {
namespace {

/// The bytes that an item takes at least. A value in text takes a digit and a blank or line end.
std::uint64_t least_bytes(const PlyElement& element, PlyEncoding encoding) {
    std::uint64_t bytes = 0;
    for (const PlyProperty& property : element.properties) {
        bytes += encoding == PlyEncoding::kText
                     ? 2
                     : size_of(property.count_type.value_or(property.type));
    }
    return bytes;
}

/// Refuses numbers of items that do not fit into the file.
void require_size(const PlyHeader& header, std::uint64_t file_size, const std::string& name) {
    // The last line of a text may lack its end.
    std::uint64_t left = file_size - header.size + (header.encoding == PlyEncoding::kText ? 1 : 0);
    for (const PlyElement& element : header.elements) {
        const std::uint64_t bytes = least_bytes(element, header.encoding);
        if (bytes != 0 && element.count > left / bytes) {
            throw Error(ErrorKind::kBadInput,
                        fmt::format("{}:{}: {} items of {}, which {} bytes cannot hold; is the "
                                    "file complete?",
                                    name, element.line, element.count, quote(element.name), left));
        }
        left -= element.count * bytes;
    }
}

/// Reads the elements from a PlyText or PlyBinary.
template <class Source>
class Body {
public:
    Body(Source& source, PlyMesh& mesh)
        : source_(source), mesh_(mesh), place_([&source] { return source.place(); }) {}

    void read(const PlyElement& element) {
        if (element.properties.empty()) return;
        const bool is_read = element.is_read();
        const bool is_vertex = is_read && element.name == "vertex";
        const bool has_triangles = is_list_of_triangles(element);
        if constexpr (!Source::kHasRows) {
            if (has_triangles) mesh_.reserve_triangles(source_.left() / Source::kTriangleBytes);
        }
        if constexpr (!Source::kHasRows) {
            if (is_vertex && read_columns(element)) return;
        }
        for (std::uint64_t item = 0; item < element.count; ++item) {
            if constexpr (!Source::kHasRows) {
                if (has_triangles) item += read_triangles(element.count - item);
                if (item == element.count) return;
            }
            source_.begin(element, item);
            if (!is_read && Source::kHasRows) continue;
            for (const PlyProperty& property : element.properties)
                read_property(property, static_cast<std::size_t>(item));
            source_.end();
            if (is_vertex) mesh_.check_vertex(static_cast<std::size_t>(item), place_);
        }
    }

private:
    /// Nearly all files have them, and such lists are read several times faster.
    static bool is_list_of_triangles(const PlyElement& element) {
        const PlyProperty& list = element.properties[0];
        return element.properties.size() == 1 && list.role == PlyRole::kFace &&
               size_of(*list.count_type) == 1 && size_of(list.type) == 4;
    }

    std::size_t read_triangles(std::uint64_t most) {
        const std::size_t count =
            source_.take_triangles(most, mesh_.vertex_count(), mesh_.corners());
        mesh_.count_triangles(count, place_);
        return count;
    }

    void read_property(const PlyProperty& property, std::size_t item) {
        if (property.count_type) {
            read_list(property);
        } else if (property.role == PlyRole::kNone) {
            source_.skip(property.type);
        } else {
            mesh_.components(property.role)[item][property.axis] =
                component(property, source_.number(property.type));
        }
    }

    float component(const PlyProperty& property, float value) const {
        if (property.role != PlyRole::kColour || property.type != PlyScalar::kUint8) return value;
        if (!(value >= 0 && value <= 255))
            fail(fmt::format("colour {} is not from 0 to 255; repair it", value));
        // As those of images, whose squares are linear.
        const float channel = value / 255.0f;
        return channel * channel;
    }

    /// Reads vertices without lists a property at a time, which is twice as fast. Returns false if
    /// there is a list or the file ends.
    bool read_columns(const PlyElement& element) {
        std::size_t stride = 0;
        for (const PlyProperty& property : element.properties) {
            if (property.count_type) return false;
            stride += size_of(property.type);
        }
        const auto count = static_cast<std::size_t>(element.count);
        if (source_.left() / stride < count) return false;
        std::size_t offset = 0;
        for (const PlyProperty& property : element.properties) {
            if (property.role != PlyRole::kNone) {
                std::vector<vec3>& out = mesh_.components(property.role);
                for (std::size_t i = 0; i < count; ++i) {
                    out[i][property.axis] = component(
                        property, source_.number_ahead(offset + i * stride, property.type));
                }
            }
            offset += size_of(property.type);
        }
        for (std::size_t i = 0; i < count; ++i) {
            source_.begin(element, i);
            mesh_.check_vertex(i, place_);
            source_.skip_bytes(stride);
        }
        return true;
    }

    void read_list(const PlyProperty& property) {
        const std::int64_t count = source_.integer(*property.count_type);
        if (count < 0) fail(fmt::format("list of {} entries; is the header right?", count));
        corners_.clear();
        for (std::int64_t i = 0; i < count; ++i) {
            if (property.role == PlyRole::kNone)
                source_.skip(property.type);
            else
                corners_.push_back(source_.integer(property.type));
        }
        if (property.role == PlyRole::kFace) mesh_.add_face(corners_, place_);
        if (property.role == PlyRole::kStrip) mesh_.add_strips(corners_, place_);
    }

    [[noreturn]] void fail(const std::string& what) const {
        throw Error(ErrorKind::kBadInput, fmt::format("{}: {}", place_(), what));
    }

    Source& source_;
    PlyMesh& mesh_;
    const PlyMesh::Place place_;
    std::vector<std::int64_t> corners_;
};

/// Returns how many bytes follow the last item.
template <class Source>
std::size_t read_body(const PlyHeader& header, Source source, PlyMesh& mesh) {
    Body<Source> body(source, mesh);
    for (const PlyElement& element : header.elements) body.read(element);
    if constexpr (Source::kHasRows) source.skip_blank_lines();
    return source.left();
}

}  // namespace

FileMesh read_ply(const std::filesystem::path& path, const MeshFileOptions& options) {
    static_assert(std::endian::native == std::endian::little);
    const std::string name = escape(path);
    HeldWarnings warnings;
    MeshFileOptions held = options;
    held.warn = warnings.keeper();

    const std::string text = read_input_file(path);
    PlyHeader header = parse_ply_header(text, name);
    require_size(header, text.size(), name);
    PlyMesh builder(header, name, held);
    const std::string_view rest = std::string_view(text).substr(header.size);
    const std::size_t left = header.encoding == PlyEncoding::kText
                                 ? read_body(header, PlyText(rest, header, name), builder)
                             : header.encoding == PlyEncoding::kLittleEndian
                                 ? read_body(header, PlyBinary<false>(rest, header, name), builder)
                                 : read_body(header, PlyBinary<true>(rest, header, name), builder);
    if (left > 0) held.warn({name, fmt::format("{} bytes after the last item; ignored", left)});
    FileMesh mesh = builder.finish();
    require_faces(mesh, name, "a mesh with faces", held);
    warnings.tell(options.warn);
    return mesh;
}

}  // namespace mray
