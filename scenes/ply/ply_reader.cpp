#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <iterator>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/base/errors.h"
#include "common/base/input_file.h"
#include "common/text/number_text.h"
#include "common/text/text_parts.h"
#include "scenes/mesh/mesh_file.h"
#include "scenes/mesh/mesh_rules.h"
#include "scenes/ply/ply_header.h"

namespace mray {
namespace {

constexpr PlyAxes kNormalAxes = {"nx", "ny", "nz"};
constexpr PlyAxes kColours[] = {
    {"red", "green", "blue"}, {"r", "g", "b"}, {"diffuse_red", "diffuse_green", "diffuse_blue"}};

/// The values after the header: rows of text, blank ones left out, or bytes in either order.
class PlyValues {
public:
    PlyValues(std::string_view text, const PlyHeader& header, const std::string& name)
        : rest_(text.substr(header.size)),
          name_(name),
          is_text_(header.encoding == PlyEncoding::kText),
          is_swapped_(header.encoding == PlyEncoding::kBigEndian),
          file_size_(text.size()),
          next_line_(header.line_count + 1) {
        static_assert(std::endian::native == std::endian::little);
    }

    bool is_text() const { return is_text_; }
    std::string place() const { return fmt::format("{}{}", place_prefix(), line_or_byte()); }
    std::string place_prefix() const { return name_ + (is_text_ ? ":" : ": byte "); }
    std::uint64_t line_or_byte() const { return is_text_ ? line_ : file_size_ - left_at_begin_; }
    [[noreturn]] void fail(const std::string& what) const {
        throw Error(ErrorKind::kBadInput, "{}: {}", place(), what);
    }

    void begin(const PlyElement& element, std::uint64_t item) {
        element_ = &element;
        item_ = item;
        left_at_begin_ = rest_.size();
        if (!is_text_) return;
        skip_blank_lines();
        line_ = next_line_;
        if (rest_.empty()) fail_end();
        const auto* const end =
            std::find_if(rest_.begin(), rest_.end(), [](char c) { return c == '\n' || c == '\r'; });
        row_ = rest_.substr(0, static_cast<std::size_t>(end - rest_.begin()));
        rest_.remove_prefix(row_.size());
    }
    void end() const {
        if (std::all_of(row_.begin(), row_.end(), is_blank)) return;
        fail(fmt::format("more values than {} has; is the header right?", quote(element_->name)));
    }
    std::size_t left() const { return rest_.size(); }
    void skip_blank_lines() {
        std::size_t i = 0;
        for (; is_text_ && i < rest_.size(); ++i) {
            if (rest_[i] == '\n' || (rest_[i] == '\r' && !rest_.substr(i + 1).starts_with('\n')))
                ++next_line_;
            else if (rest_[i] != ' ' && rest_[i] != '\t' && rest_[i] != '\r')
                break;
        }
        rest_.remove_prefix(i);
    }

    double number(const PlyType& type) {
        if (!is_text_) return take_value(type);
        const std::string_view word = next_word();
        const auto number = parse_coordinate(word);
        if (!number) fail(not_a_number(word));
        return *number;
    }
    std::int64_t integer(const PlyType& type) {
        if (!is_text_) return static_cast<std::int64_t>(take_value(type));
        const std::string_view word = next_word();
        const auto number = parse_integer(word);
        if (!number) fail(fmt::format("{} is not a whole number; a list needs one", quote(word)));
        return *number;
    }
    void skip(const PlyType& type) {
        if (is_text_)
            next_word();
        else
            take(type.size);
    }

private:
    static bool is_blank(char c) { return c == ' ' || c == '\t'; }

    [[noreturn]] void fail_end() const {
        fail(fmt::format("ends within {} {} of {}; is the file complete?", quote(element_->name),
                         item_, element_->count));
    }

    std::string_view next_word() {
        const auto* const begin = std::find_if_not(row_.begin(), row_.end(), is_blank);
        const auto* const end = std::find_if(begin, row_.end(), is_blank);
        if (begin == end) {
            fail(fmt::format("fewer values than {} has; is the file complete?",
                             quote(element_->name)));
        }
        row_.remove_prefix(static_cast<std::size_t>(end - row_.begin()));
        return {begin, static_cast<std::size_t>(end - begin)};
    }

    const char* take(std::size_t size) {
        if (rest_.size() < size) fail_end();
        const char* const from = rest_.data();
        rest_.remove_prefix(size);
        return from;
    }

    double take_value(const PlyType& type) {
        std::array<char, sizeof(double)> bytes;
        std::copy_n(take(type.size), type.size, bytes.begin());
        if (is_swapped_) std::reverse(bytes.begin(), bytes.begin() + type.size);
        return type.value(bytes.data());
    }

    std::string_view rest_;
    const std::string& name_;
    const bool is_text_;
    const bool is_swapped_;
    const std::uint64_t file_size_;
    const PlyElement* element_ = nullptr;
    std::uint64_t item_ = 0;
    std::uint64_t left_at_begin_ = 0;
    std::uint64_t next_line_;
    std::uint64_t line_ = 0;
    /// What is left of the row of the current item.
    std::string_view row_;
};

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
            if (element.name == "vertex") find_columns(element);
        for (const PlyElement& element : header_.elements) read_element(element);
        values_.skip_blank_lines();
        if (values_.left() > 0 && options_.warn) {
            options_.warn(
                {name_, fmt::format("{} bytes after the last item; ignored", values_.left())});
        }
        rules_.tell(options_.warn);
        clamped_.tell(options_.warn);
        set_positions(mesh_, positions_, options_);
        mesh_.place_prefix = values_.place_prefix();
        if (has_normals_) number_corners();
        return std::move(mesh_);
    }

private:
    /// Where a scalar of a vertex or face goes, if it is read.
    struct Column {
        double* number = nullptr;
        /// The number of a full colour: 1 of a linear one, above of one as in images; 0: no colour.
        double full = 0;
    };

    void find_columns(const PlyElement& vertices) {
        vertex_count_ = static_cast<std::size_t>(vertices.count);
        positions_.reserve(vertex_count_);
        has_normals_ = !options_.positions_only && vertices.has(kNormalAxes);
        has_colours_ = colours_of(vertices) != nullptr;
    }
    /// The names that an element gives its colours; null if they are not read.
    const PlyAxes* colours_of(const PlyElement& element) const {
        const auto* const found =
            std::ranges::find_if(kColours, [&](const PlyAxes& axes) { return element.has(axes); });
        return options_.positions_only || found == std::end(kColours) ? nullptr : found;
    }
    void add_columns(const PlyElement& element, const PlyAxes& axes, glm::dvec3& vector,
                     bool are_colours = false) {
        for (std::size_t i = 0; i < columns_.size(); ++i) {
            const PlyProperty& property = element.properties[i];
            const auto* const axis = std::ranges::find(axes, property.name);
            if (axis == axes.end() || property.count_type != nullptr) continue;
            columns_[i].number = &vector[static_cast<int>(axis - axes.begin())];
            if (!are_colours) continue;
            const bool is_wide = property.type->names[0] == "ushort";
            columns_[i].full = !property.type->is_integer ? 1 : is_wide ? 65535 : 255;
        }
    }

    void read_element(const PlyElement& element) {
        if (element.properties.empty()) return;
        const bool is_vertex = element.name == "vertex";
        const bool is_read = is_vertex || element.has_faces();
        const bool are_strips = element.name == "tristrips";
        columns_.assign(element.properties.size(), {});
        if (is_vertex) add_columns(element, kPlyPosition, position_);
        if (is_vertex && has_normals_) add_columns(element, kNormalAxes, normal_);
        const PlyAxes* const colours =
            is_vertex || (is_read && !has_colours_) ? colours_of(element) : nullptr;
        if (colours != nullptr) add_columns(element, *colours, colour_, true);
        if (colours != nullptr && !is_vertex) set_faces_albedo(kClay);
        for (std::uint64_t item = 0; item < element.count; ++item) {
            values_.begin(element, item);
            if (values_.is_text() && !is_read) continue;
            for (std::size_t i = 0; i < element.properties.size(); ++i) {
                const PlyProperty& property = element.properties[i];
                if (property.count_type != nullptr)
                    read_list(property, are_strips);
                else if (columns_[i].number != nullptr)
                    read_number(columns_[i], *property.type);
                else
                    values_.skip(*property.type);
            }
            values_.end();
            if (is_vertex) {
                add_vertex();
            } else if (colours != nullptr) {
                const vec3 colour(colour_);
                set_faces_albedo(albedo_of(colour.x, colour.y, colour.z));
            }
        }
    }

    /// Of those that have none yet.
    void set_faces_albedo(Albedo albedo) {
        mesh_.albedo.resize(mesh_.faces.corner_counts.size(), albedo);
    }

    void read_number(const Column& column, const PlyType& type) {
        double& number = *column.number;
        number = values_.number(type);
        if (column.full == 0) return;
        number = channel_of(number, column.full, clamped_, place_);
        if (column.full > 1) number = linear_of(number);
    }

    void add_vertex() {
        for (int axis = 0; axis < 3; ++axis) {
            const double value = position_[axis];
            if (!MeshRules::is_good(value))
                rules_.take_bad_coordinate(value, fmt::format("{}", value), place_);
        }
        positions_.push_back(position_);
        if (has_normals_) normals_.push_back(Origin().to_world(normal_));
        if (has_colours_) mesh_.vertex_colours.emplace_back(colour_);
    }

    void read_list(const PlyProperty& property, bool are_strips) {
        const std::int64_t count = values_.integer(*property.count_type);
        if (count < 0) values_.fail(fmt::format("list of {} entries; is the header right?", count));
        corners_.clear();
        for (std::int64_t i = 0; i < count; ++i) {
            if (property.has_corners)
                corners_.push_back(values_.integer(*property.type));
            else
                values_.skip(*property.type);
        }
        if (!property.has_corners) return;
        if (are_strips)
            add_strips();
        else
            add_face();
    }
    /// -1 ends a strip. Every second triangle is turned, so that a strip has one outside.
    void add_strips() {
        const std::vector<std::int64_t> strips = std::exchange(corners_, {});
        std::size_t first = 0;
        for (std::size_t i = 0; i <= strips.size(); ++i) {
            const std::size_t length = i - first;
            if (i == strips.size() || strips[i] == -1) {
                if (length > 0) rules_.keeps_face(length, false, place_);
                first = i + 1;
            } else if (length >= 2) {
                const std::size_t turn = length % 2;
                corners_ = {strips[i - 2 + turn], strips[i - 1 - turn], strips[i]};
                add_face();
            }
        }
    }
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
        if (corners_.size() > 3) mesh_.polygon_places.push_back(values_.line_or_byte());
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
    glm::dvec3 position_ = {};
    glm::dvec3 normal_ = {};
    glm::dvec3 colour_ = {};
    std::vector<glm::dvec3> positions_;
    std::vector<vec3> normals_;
    /// One for each property of the element that is read.
    std::vector<Column> columns_;
    WarningCount clamped_;
    std::vector<std::int64_t> corners_;
};

}  // namespace

FileMesh read_ply(const std::filesystem::path& path, const MeshFileOptions& options) {
    const std::string name = escape(path);
    const std::string text = read_input_file(path);
    const PlyHeader header = parse_ply_header(text, name);
    // As MeshLab writes it.
    const std::size_t texture = text.find("\ncomment TextureFile ");
    if (texture < header.size && options.warn && !options.positions_only)
        options.warn({name, "textures of PLY files are not read; faces have their colours alone"});
    FileMesh mesh = PlyReader(text, header, name, options).read();
    require_faces(mesh, name, "a mesh with faces");
    return mesh;
}

}  // namespace mray
