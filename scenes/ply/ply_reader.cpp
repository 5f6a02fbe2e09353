#include "scenes/mesh/mesh_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/errors.h"
#include "common/base/input_file.h"
#include "common/text/text_parts.h"
#include "scenes/mesh/mesh_rules.h"
#include "scenes/mesh/smooth_numbers.h"
#include "scenes/ply/ply_header.h"
#include "scenes/ply/ply_source.h"

namespace mray {
namespace {

/// Whether channels have types whose meaning is known.
bool are_channels(const PlyElement& vertices) {
    return std::all_of(vertices.properties.begin(), vertices.properties.end(),
                       [](const PlyProperty& property) {
                           return property.role != PlyRole::kColour ||
                                  property.type == PlyScalar::kUint8 || !is_integer(property.type);
                       });
}

void drop(PlyElement& element, PlyRole role) {
    for (PlyProperty& property : element.properties)
        if (property.role == role) property.role = PlyRole::kNone;
}

/// Collects the mesh of a file while its elements are read.
class PlyMesh {
public:
    using Place = MeshRules::Place;

    /// Takes the roles of properties that are not read away from `header`: those that the options
    /// do not want, and colours and normals that are not complete. Keeps a reference to the
    /// options.
    PlyMesh(PlyHeader& header, const std::string& name, const MeshFileOptions& options)
        : options_(options), rules_(options.lenient) {
        for (PlyElement& element : header.elements) {
            if (element.name != "vertex") continue;
            bool has_colours = options.materials && element.has_all(PlyRole::kColour);
            if (has_colours && !are_channels(element)) {
                has_colours = false;
                if (options.warn)
                    options.warn(
                        {fmt::format("{}:{}", name, element.line),
                         "colours of this type are not read, only uchar, float and double; "
                         "taken as grey"});
            }
            const bool has_normals = options.normals && element.has_all(PlyRole::kNormal);
            if (!has_colours) drop(element, PlyRole::kColour);
            if (!has_normals) drop(element, PlyRole::kNormal);
            const auto count = static_cast<std::size_t>(element.count);
            mesh_.positions.resize(count);
            if (has_colours) mesh_.vertex_colours.resize(count);
            if (has_normals) normals_.resize(count);
        }
    }

    std::size_t vertex_count() const { return mesh_.positions.size(); }
    /// The components of each vertex that a role has to do with.
    std::vector<vec3>& components(PlyRole role) {
        if (role == PlyRole::kColour) return mesh_.vertex_colours;
        return role == PlyRole::kNormal ? normals_ : mesh_.positions;
    }
    /// Checks a vertex that has been read.
    void check_vertex(std::size_t vertex, const Place& place) {
        for (int axis = 0; axis < 3; ++axis) {
            const float value = mesh_.positions[vertex][axis];
            if (!MeshRules::is_good(value))
                rules_.take_bad_coordinate(value, fmt::format("{}", value), place);
            if (mesh_.vertex_colours.empty()) continue;
            float& channel = mesh_.vertex_colours[vertex][axis];
            if (std::isfinite(channel)) continue;
            constexpr const char* kWhat = "colour of a vertex is not finite";
            if (!options_.lenient) {
                throw Error(ErrorKind::kBadInput, fmt::format("{}: {}; repair it", place(), kWhat),
                            Hint::kLenient);
            }
            odd_channels_.add([&] {
                return Warning{place(), fmt::format("{}; taken as 0", kWhat)};
            });
            channel = 0;
        }
    }

    /// Adds a face if the rules keep it.
    void add_face(std::span<const std::int64_t> corners, const Place& place) {
        if (!rules_.keeps_face(corners.size(), false, place)) return;
        for (const std::int64_t corner : corners) {
            if (corner >= 0 && static_cast<std::size_t>(corner) < vertex_count()) continue;
            return rules_.leave_out(
                fmt::format("vertex {} of {}; indices start at 0 and end below the number of "
                            "vertices",
                            corner, vertex_count()),
                place);
        }
        rules_.count_triangles(corners.size() - 2, place);
        mesh_.faces.corners.insert(mesh_.faces.corners.end(), corners.begin(), corners.end());
        mesh_.faces.corner_counts.push_back(static_cast<std::uint32_t>(corners.size()));
    }
    /// Adds the triangles that come next, at most `most`; returns their number.
    template <class Source>
    std::size_t add_triangles(Source& source, std::uint64_t most, const Place& place) {
        Polygons& faces = mesh_.faces;
        const std::size_t count = source.take_triangles(most, vertex_count(), faces.corners);
        rules_.count_triangles(count, place);
        faces.corner_counts.insert(faces.corner_counts.end(), count, 3);
        return count;
    }
    void reserve_triangles(std::size_t count) {
        mesh_.faces.corners.reserve(3 * count);
        mesh_.faces.corner_counts.reserve(count);
    }

    /// The mesh, once all has been read. Gives the warnings.
    FileMesh finish() {
        rules_.tell(options_.warn);
        odd_channels_.tell(options_.warn);
        SmoothNumbers numbers;
        std::vector<std::uint32_t> vertex_numbers(normals_.size(), SmoothNumbers::kNone);
        for (std::uint32_t i = 0; !normals_.empty() && i < mesh_.faces.corners.size(); ++i) {
            const std::uint32_t vertex = mesh_.faces.corners[i];
            mesh_.smooth.push_back(numbers.number_of(vertex_numbers[vertex],
                                                     mesh_.positions[vertex], normals_[vertex], i));
        }
        return std::move(mesh_);
    }

private:
    const MeshFileOptions& options_;
    std::vector<vec3> normals_;
    FileMesh mesh_;
    MeshRules rules_;
    WarningCount odd_channels_;
};

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
            if (is_vertex && read_columns(element)) return;
        }
        for (std::uint64_t item = 0; item < element.count; ++item) {
            if constexpr (!Source::kHasRows) {
                if (has_triangles)
                    item += mesh_.add_triangles(source_, element.count - item, place_);
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
    const std::string text = read_input_file(path);
    PlyHeader header = parse_ply_header(text, name);
    PlyMesh builder(header, name, options);
    const std::string_view rest = std::string_view(text).substr(header.size);
    const std::size_t left = header.encoding == PlyEncoding::kText
                                 ? read_body(header, PlyText(rest, header, name), builder)
                             : header.encoding == PlyEncoding::kLittleEndian
                                 ? read_body(header, PlyBinary<false>(rest, header, name), builder)
                                 : read_body(header, PlyBinary<true>(rest, header, name), builder);
    if (left > 0 && options.warn)
        options.warn({name, fmt::format("{} bytes after the last item; ignored", left)});
    FileMesh mesh = builder.finish();
    require_faces(mesh, name, "a mesh with faces");
    return mesh;
}

}  // namespace mray
