#include <fmt/format.h>

#include <algorithm>
#include <array>
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

constexpr PlyAxes kNormalAxes = {"nx", "ny", "nz"};
constexpr PlyAxes kColours = {"red", "green", "blue"};

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
        if (values_.left() > 0 && options_.warn) {
            options_.warn(
                {name_, fmt::format("{} bytes after the last item; ignored", values_.left())});
        }
        rules_.tell(options_.warn);
        set_positions(mesh_, positions_, options_);
        if (has_normals_) number_corners();
        return std::move(mesh_);
    }

private:
    enum Part : std::uint8_t { kPosition, kNormal, kColour, kNoPart };
    /// What a scalar of a vertex is.
    struct Column {
        Part part = kNoPart;
        int axis = 0;
        bool is_byte_colour = false;
    };

    void make_columns(const PlyElement& vertices) {
        vertex_count_ = static_cast<std::size_t>(vertices.count);
        positions_.reserve(vertex_count_);
        columns_.resize(vertices.properties.size());
        add_columns(vertices, kPlyPosition, kPosition);
        if (options_.positions_only) return;
        has_normals_ = vertices.has(kNormalAxes);
        has_colours_ = vertices.has(kColours);
        if (has_normals_) add_columns(vertices, kNormalAxes, kNormal);
        if (has_colours_) add_columns(vertices, kColours, kColour);
    }
    void add_columns(const PlyElement& vertices, const PlyAxes& axes, Part part) {
        for (std::size_t i = 0; i < columns_.size(); ++i) {
            const PlyProperty& property = vertices.properties[i];
            const auto* const axis = std::ranges::find(axes, property.name);
            if (axis == axes.end() || property.count_type) continue;
            columns_[i] = {part, static_cast<int>(axis - axes.begin()),
                           part == kColour && is_integer(property.type)};
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
                else if (is_vertex && columns_[i].part != kNoPart)
                    read_number(columns_[i], property.type);
                else
                    values_.skip(property.type);
            }
            values_.end();
            if (is_vertex) add_vertex();
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
        const std::size_t count = values_.take_triangles(most, vertex_count_, faces.corners);
        rules_.count_triangles(count, place_);
        faces.corner_counts.insert(faces.corner_counts.end(), count, 3);
        return count;
    }

    void read_number(const Column& column, PlyScalar type) {
        double& number = vertex_[column.part][column.axis];
        number = values_.number(type);
        if (!column.is_byte_colour) return;
        if (!(number >= 0 && number <= 255))
            values_.fail(fmt::format("colour {} is not from 0 to 255; repair it", number));
        // As those of images, whose squares are linear.
        const float channel = static_cast<float>(number) / 255.0f;
        number = static_cast<double>(channel * channel);
    }

    void add_vertex() {
        for (int axis = 0; axis < 3; ++axis) {
            const double value = vertex_[kPosition][axis];
            if (!MeshRules::is_good(value))
                rules_.take_bad_coordinate(value, fmt::format("{}", value), place_);
            if (has_colours_ && !(std::abs(vertex_[kColour][axis]) <= kMaxCoordinate))
                values_.fail("colour of a vertex is not finite or beyond 1e30; repair it");
        }
        positions_.push_back(vertex_[kPosition]);
        if (has_normals_) normals_.push_back(FileOrigin().to_world(vertex_[kNormal]));
        if (has_colours_) mesh_.vertex_colours.emplace_back(vertex_[kColour]);
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
        for (const std::int64_t corner : corners_) {
            if (corner >= 0 && static_cast<std::size_t>(corner) < vertex_count_) continue;
            return rules_.leave_out(
                fmt::format("vertex {} of {}; indices start at 0 and end below the number of "
                            "vertices",
                            corner, vertex_count_),
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
    std::size_t vertex_count_ = 0;
    bool has_normals_ = false;
    bool has_colours_ = false;
    /// Position, normal and colour of the current vertex.
    std::array<glm::dvec3, 3> vertex_ = {};
    std::vector<glm::dvec3> positions_;
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
