#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/base/errors.h"
#include "common/base/input_file.h"
#include "common/text/text_parts.h"
#include "scenes/mesh/mesh_file.h"
#include "scenes/mesh/mesh_rules.h"
#include "scenes/mesh/smooth_numbers.h"
#include "scenes/ply/ply_values.h"

namespace mray {
namespace {

constexpr PlyAxes kNormal = {"nx", "ny", "nz"};
constexpr PlyAxes kColour = {"red", "green", "blue"};

class PlyReader {
public:
    PlyReader(std::string_view text, const PlyHeader& header, const std::string& name,
              const MeshFileOptions& options)
        : header_(header),
          name_(name),
          options_(options),
          values_(text, header, name),
          rules_(options.lenient),
          place_([this] { return values_.place(); }) {}

    FileMesh read() {
        for (const PlyElement& element : header_.elements)
            if (element.name == "vertex") make_columns(element);
        for (const PlyElement& element : header_.elements) read_element(element);
        values_.skip_blank_lines();
        if (values_.left() > 0)
            warn({name_, fmt::format("{} bytes after the last item; ignored", values_.left())});
        rules_.tell(options_.warn);
        if (!normals_.empty()) number_corners();
        return std::move(mesh_);
    }

private:
    /// Where the values of a scalar go: nowhere if `to` is null.
    struct Column {
        std::vector<vec3>* to = nullptr;
        int axis = 0;
        bool is_byte_colour = false;
    };

    void warn(const Warning& warning) const {
        if (options_.warn) options_.warn(warning);
    }

    void make_columns(const PlyElement& vertices) {
        columns_.resize(vertices.properties.size());
        add_columns(vertices, kPlyPosition, mesh_.positions);
        if (!options_.positions_only && vertices.has(kNormal))
            add_columns(vertices, kNormal, normals_);
        if (!options_.positions_only && vertices.has(kColour))
            add_columns(vertices, kColour, mesh_.vertex_colours);
    }
    void add_columns(const PlyElement& vertices, const PlyAxes& axes, std::vector<vec3>& to) {
        to.resize(static_cast<std::size_t>(vertices.count));
        for (std::size_t i = 0; i < columns_.size(); ++i) {
            const PlyProperty& property = vertices.properties[i];
            const auto* const axis = std::ranges::find(axes, property.name);
            if (axis == axes.end() || property.count_type) continue;
            columns_[i] = {&to, static_cast<int>(axis - axes.begin()),
                           &axes == &kColour && is_integer(property.type)};
        }
    }

    void read_element(const PlyElement& element) {
        if (element.properties.empty()) return;
        const bool is_vertex = element.name == "vertex";
        const bool is_read = is_vertex || element.has_faces();
        const bool has_triangles = is_list_of_triangles(element);
        if (has_triangles) {
            const std::size_t most = values_.left() / PlyValues::kTriangleBytes;
            mesh_.faces.corners.reserve(3 * most);
            mesh_.faces.corner_counts.reserve(most);
        }
        for (std::uint64_t item = 0; item < element.count; ++item) {
            if (has_triangles) item += add_triangles(element.count - item);
            if (item == element.count) return;
            values_.begin(element, item);
            if (values_.is_text() && !is_read) continue;
            for (std::size_t i = 0; i < element.properties.size(); ++i) {
                const PlyProperty& property = element.properties[i];
                if (property.count_type)
                    read_list(property);
                else if (is_vertex && columns_[i].to != nullptr)
                    component(columns_[i], item) =
                        linear(columns_[i], values_.number(property.type));
                else
                    values_.skip(property.type);
            }
            values_.end();
            if (is_vertex) check_vertex(static_cast<std::size_t>(item));
        }
    }

    /// Nearly all binary files have them, and such lists are read several times faster.
    bool is_list_of_triangles(const PlyElement& element) const {
        const PlyProperty& list = element.properties[0];
        return !values_.is_text() && element.has_faces() && element.properties.size() == 1 &&
               size_of(*list.count_type) == 1 && size_of(list.type) == 4;
    }
    std::size_t add_triangles(std::uint64_t most) {
        Polygons& faces = mesh_.faces;
        const std::size_t count =
            values_.take_triangles(most, mesh_.positions.size(), faces.corners);
        rules_.count_triangles(count, place_);
        faces.corner_counts.insert(faces.corner_counts.end(), count, 3);
        return count;
    }

    static float& component(const Column& column, std::uint64_t vertex) {
        return (*column.to)[static_cast<std::size_t>(vertex)][column.axis];
    }
    float linear(const Column& column, float value) const {
        if (!column.is_byte_colour) return value;
        if (!(value >= 0 && value <= 255))
            values_.fail(fmt::format("colour {} is not from 0 to 255; repair it", value));
        // As those of images, whose squares are linear.
        const float channel = value / 255.0f;
        return channel * channel;
    }

    void check_vertex(std::size_t vertex) {
        for (int axis = 0; axis < 3; ++axis) {
            const float value = mesh_.positions[vertex][axis];
            if (!MeshRules::is_good(value))
                rules_.take_bad_coordinate(value, fmt::format("{}", value), place_);
            if (!mesh_.vertex_colours.empty() && !std::isfinite(mesh_.vertex_colours[vertex][axis]))
                values_.fail("colour of a vertex is not finite; repair it");
        }
    }

    void read_list(const PlyProperty& property) {
        const std::int64_t count = values_.integer(*property.count_type);
        if (count < 0) values_.fail(fmt::format("list of {} entries; is the header right?", count));
        corners_.clear();
        for (std::int64_t i = 0; i < count; ++i) {
            if (property.has_corners)
                corners_.push_back(values_.integer(property.type));
            else
                values_.skip(property.type);
        }
        if (property.has_corners) add_face();
    }
    /// Adds a face of corners_ if the rules keep it.
    void add_face() {
        if (!rules_.keeps_face(corners_.size(), false, place_)) return;
        const std::size_t vertex_count = mesh_.positions.size();
        for (const std::int64_t corner : corners_) {
            if (corner >= 0 && static_cast<std::size_t>(corner) < vertex_count) continue;
            return rules_.leave_out(
                fmt::format("vertex {} of {}; indices start at 0 and end below the number of "
                            "vertices",
                            corner, vertex_count),
                place_);
        }
        rules_.count_triangles(corners_.size() - 2, place_);
        mesh_.faces.corners.insert(mesh_.faces.corners.end(), corners_.begin(), corners_.end());
        mesh_.faces.corner_counts.push_back(static_cast<std::uint32_t>(corners_.size()));
    }

    void number_corners() {
        SmoothNumbers numbers;
        std::vector<std::uint32_t> known(normals_.size(), SmoothNumbers::kNone);
        for (const std::uint32_t vertex : mesh_.faces.corners) {
            const auto corner = static_cast<std::uint32_t>(mesh_.smooth.size());
            mesh_.smooth.push_back(numbers.number_of(known[vertex], mesh_.positions[vertex],
                                                     normals_[vertex], corner));
        }
    }

    const PlyHeader& header_;
    const std::string& name_;
    const MeshFileOptions& options_;
    PlyValues values_;
    MeshRules rules_;
    const MeshRules::Place place_;
    FileMesh mesh_;
    std::vector<vec3> normals_;
    /// One for each property of the vertices.
    std::vector<Column> columns_;
    std::vector<std::int64_t> corners_;
};

}  // namespace

FileMesh read_ply(const std::filesystem::path& path, const MeshFileOptions& options) {
    const std::string name = escape(path);
    const std::string text = read_input_file(path);
    const PlyHeader header = parse_ply_header(text, name);
    FileMesh mesh = PlyReader(text, header, name, options).read();
    require_faces(mesh, name, "a mesh with faces");
    return mesh;
}

}  // namespace mray
