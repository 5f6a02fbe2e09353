#include "scenes/ply/ply_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <iterator>

#include "common/base/input_file.h"
#include "common/text/text.h"

namespace mray {
namespace {

enum class PlyEncoding { kText, kLittleEndian, kBigEndian };

/// A type of numbers, all of which are exact in a double.
struct PlyType {
    /// The name that the format's author gives, and one that many programs write.
    std::array<std::string_view, 2> names;
    std::size_t size;
    bool is_integer;
    /// Reads a number in the byte order of this machine.
    double (*value)(const char* bytes);
};

struct PlyProperty {
    std::string name;
    const PlyType* type;
    /// A list has a type for the number of its entries; a scalar has null.
    const PlyType* count_type = nullptr;
    /// Whether it lists the corners of a face.
    bool has_corners = false;
};

/// The names of three scalars that make a vector.
using PlyAxes = std::array<std::string_view, 3>;
constexpr PlyAxes kPlyPosition = {"x", "y", "z"};

struct PlyElement {
    std::string name;
    std::uint64_t count = 0;
    std::vector<PlyProperty> properties = {};
    std::uint64_t line = 0;  // of the header

    bool has(const PlyAxes& axes) const {
        return std::ranges::all_of(axes, [&](std::string_view axis) {
            return std::ranges::any_of(properties, [&](const PlyProperty& property) {
                return property.name == axis && property.count_type == nullptr;
            });
        });
    }
    bool has_faces() const { return std::ranges::any_of(properties, &PlyProperty::has_corners); }
};

struct PlyHeader {
    std::optional<PlyEncoding> encoding = {};
    std::vector<PlyElement> elements;
    bool has_textures = false;
    /// What follows the header, and the number of its last line.
    std::string_view rest;
    std::uint64_t line = 0;
};

constexpr std::string_view kBlanks = " \t\r";

template <class Number>
constexpr PlyType type_named(std::string_view name, std::string_view other) {
    constexpr auto kValue = [](const char* bytes) {
        Number number;
        std::memcpy(&number, bytes, sizeof(Number));
        return static_cast<double>(number);
    };
    return {{name, other}, sizeof(Number), std::is_integral_v<Number>, kValue};
}

constexpr PlyType kPlyTypes[] = {
    type_named<std::int8_t>("char", "int8"),    type_named<std::uint8_t>("uchar", "uint8"),
    type_named<std::int16_t>("short", "int16"), type_named<std::uint16_t>("ushort", "uint16"),
    type_named<std::int32_t>("int", "int32"),   type_named<std::uint32_t>("uint", "uint32"),
    type_named<float>("float", "float32"),      type_named<double>("double", "float64"),
};

/// Removes a line, which \n, \r\n or \r ends; returns it without blanks around it.
std::string_view take_line(std::string_view& text) {
    const auto* const end =
        std::find_if(text.begin(), text.end(), [](char c) { return c == '\n' || c == '\r'; });
    const std::string_view line = text.substr(0, static_cast<std::size_t>(end - text.begin()));
    text.remove_prefix(line.size());
    if (!text.empty()) text.remove_prefix(text.starts_with("\r\n") ? 2 : 1);
    return trimmed(line, kBlanks);
}

/// The words of a line; at most one more than any statement has.
std::vector<std::string_view> words_of(std::string_view line) {
    constexpr std::size_t kMostWords = 6;
    std::vector<std::string_view> words;
    while (!line.empty() && words.size() < kMostWords) words.push_back(take_word(line));
    return words;
}

/// Vertices have positions, faces have corners. Throws Error(kBadInput) with file and line.
class HeaderParser {
public:
    HeaderParser(std::string_view text, const std::string& name) : name_(name) {
        header_.rest = text;
    }

    PlyHeader run() {
        ++header_.line;
        if (take_line(header_.rest) != "ply")
            fail(R"(not a PLY file; the first line must be "ply")");
        for (;;) {
            ++header_.line;
            if (header_.rest.empty()) fail("no end_header; is the file complete?");
            const std::string_view line = take_line(header_.rest);
            const std::vector<std::string_view> words = words_of(line);
            // As MeshLab writes it.
            header_.has_textures |= line.starts_with("comment TextureFile ");
            if (words.empty() || words[0] == "comment" || words[0] == "obj_info") continue;
            if (words[0] == "end_header") break;
            if (words[0] == "format")
                read_format(words);
            else if (words[0] == "element")
                read_element(words);
            else if (words[0] == "property")
                read_property(words);
            else
                fail("unknown statement " + quote(line) + " in the header; is the file damaged?");
        }
        if (!header_.encoding) fail("no format before this line; is the file complete?");
        for (const PlyElement& element : header_.elements) require_meaning(element);
        return std::move(header_);
    }

private:
    [[noreturn]] void fail(const std::string& what) const { fail_at(header_.line, what); }
    [[noreturn]] void fail_at(std::uint64_t line, const std::string& what) const {
        throw Error(ErrorKind::kBadInput, "{}:{}: {}", name_, line, what);
    }

    void read_format(const std::vector<std::string_view>& words) {
        constexpr std::array<std::string_view, 3> kNames = {"ascii", "binary_little_endian",
                                                            "binary_big_endian"};
        const auto* const found =
            words.size() == 3 ? std::ranges::find(kNames, words[1]) : kNames.end();
        if (found == kNames.end() || words[2] != "1.0") {
            fail(
                "format that is not known; write ascii, binary_little_endian or "
                "binary_big_endian, and 1.0");
        }
        header_.encoding = static_cast<PlyEncoding>(found - kNames.begin());
    }

    void read_element(const std::vector<std::string_view>& words) {
        const auto count = words.size() == 3 ? parse_unsigned(words[2]) : std::nullopt;
        if (!count) fail("element without a name and a number of items; write the file again");
        if (words[1] == "vertex" &&
            std::ranges::count(header_.elements, words[1], &PlyElement::name) > 0)
            fail("second element vertex; write the file again");
        header_.elements.push_back({std::string(words[1]), *count, {}, header_.line});
    }

    void read_property(const std::vector<std::string_view>& words) {
        if (header_.elements.empty()) fail("property without an element; write the file again");
        const bool is_list = words.size() == 5 && words[1] == "list";
        const PlyType* const type = words.size() < 3 ? nullptr : type_of(words[words.size() - 2]);
        const PlyType* const count_type = is_list ? type_of(words[2]) : nullptr;
        const bool is_counted = count_type != nullptr && count_type->is_integer;
        if (type == nullptr || (is_list ? !is_counted : words.size() != 3)) {
            fail(
                "property that is not known; write property TYPE NAME, or property list INTEGER "
                "TYPE NAME, with types char, uchar, short, ushort, int, uint, float or double");
        }
        PlyProperty property{std::string(words.back()), type, count_type};
        PlyElement& element = header_.elements.back();
        property.has_corners =
            element.name == "face" && is_list && type->is_integer &&
            (property.name == "vertex_indices" || property.name == "vertex_index");
        element.properties.push_back(std::move(property));
    }

    static const PlyType* type_of(std::string_view name) {
        for (const PlyType& type : kPlyTypes)
            if (std::ranges::count(type.names, name) > 0) return &type;
        return nullptr;
    }

    void require_meaning(const PlyElement& element) const {
        if (element.name == "vertex" && !element.has(kPlyPosition))
            fail_at(element.line, "vertices without x, y or z; write the file again");
        if (element.name == "face" && element.count > 0 && !element.has_faces()) {
            fail_at(element.line,
                    "faces without vertex_indices or vertex_index, a list of integers; write the "
                    "file again with corners");
        }
    }

    const std::string& name_;
    PlyHeader header_;
};

constexpr PlyAxes kNormalAxes = {"nx", "ny", "nz"};
constexpr PlyAxes kColours[] = {
    {"red", "green", "blue"}, {"r", "g", "b"}, {"diffuse_red", "diffuse_green", "diffuse_blue"}};

/// The values after the header: text with a line for each item, or bytes in either order.
class PlyValues {
public:
    PlyValues(std::string_view text, const PlyHeader& header, const std::string& name)
        : rest_(header.rest),
          name_(name),
          is_text_(header.encoding == PlyEncoding::kText),
          is_swapped_(header.encoding == PlyEncoding::kBigEndian),
          file_size_(text.size()),
          line_(header.line) {
        static_assert(std::endian::native == std::endian::little);
    }

    std::string place() const { return fmt::format("{}{}", place_prefix(), line_or_byte()); }
    std::string place_prefix() const { return name_ + (is_text_ ? ":" : ": byte "); }
    std::uint64_t line_or_byte() const { return is_text_ ? line_ : file_size_ - left_at_begin_; }
    template <class... Values>
    [[noreturn]] void fail(fmt::format_string<Values...> what, Values&&... values) const {
        throw Error(ErrorKind::kBadInput, "{}: {}", place(),
                    fmt::format(what, std::forward<Values>(values)...));
    }

    void begin(const PlyElement& element, std::uint64_t item) {
        element_ = &element;
        item_ = item;
        left_at_begin_ = rest_.size();
        if (is_text_) next_row();
    }
    void end() const {
        if (!row_.empty()) fail_row();
    }
    /// The bytes after the last item.
    std::size_t left() const { return is_text_ ? trimmed(rest_, " \t\r\n").size() : rest_.size(); }

    double number(const PlyType& type) {
        if (!is_text_) return take_value(type);
        const std::string_view word = next_word();
        const auto number = parse_coordinate(word);
        if (!number) fail("{}", not_a_number(word));
        return *number;
    }
    std::int64_t integer(const PlyType& type) {
        if (!is_text_) return static_cast<std::int64_t>(take_value(type));
        const std::string_view word = next_word();
        const auto number = parse_integer(word);
        if (!number) fail("{} is not a whole number; a list needs one", quote(word));
        return *number;
    }
    void skip(const PlyType& type) {
        if (is_text_)
            next_word();
        else
            take(type.size);
    }

private:
    /// Goes to the next line that is not blank.
    void next_row() {
        for (row_ = {}; row_.empty();) {
            ++line_;
            if (rest_.empty()) fail_end();
            row_ = take_line(rest_);
        }
    }

    [[noreturn]] void fail_row() const {
        fail("more or fewer values than {} has; is the header right, and the file complete?",
             quote(element_->name));
    }
    [[noreturn]] void fail_end() const {
        fail("ends within {} {} of {}; is the file complete?", quote(element_->name), item_,
             element_->count);
    }

    std::string_view next_word() {
        if (row_.empty()) fail_row();
        return take_word(row_);
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
    std::uint64_t line_;
    std::string_view row_;  // without the values that were read
};

class PlyReader {
public:
    PlyReader(std::string_view text, const PlyHeader& header, const std::string& name,
              const MeshFileOptions& options)
        : header_(header),
          name_(name),
          options_(options),
          values_(text, header, name),
          rules_(options.lenient, [this] { return values_.place(); }) {}

    FileMesh read() {
        for (const PlyElement& element : header_.elements) {
            if (element.name != "vertex") continue;
            vertex_count_ = element.count;
            // The file may be cut, and each has three bytes at least.
            positions_.reserve(std::min<std::uint64_t>(vertex_count_, values_.left() / 3));
            has_normals_ = !options_.positions_only && element.has(kNormalAxes);
            has_colours_ = colours_of(element) != nullptr;
        }
        for (const PlyElement& element : header_.elements) read_element(element);
        if (values_.left() > 0 && options_.warn) {
            options_.warn(
                {name_, fmt::format("{} bytes after the last item; ignored", values_.left())});
        }
        rules_.tell(options_.warn);
        set_positions(mesh_, positions_, options_);
        mesh_.place_prefix = values_.place_prefix();
        if (has_normals_) number_corners();
        return std::move(mesh_);
    }

private:
    /// Where a scalar of a vertex or face goes, if it is read.
    struct Column {
        double* number = nullptr;
        /// The value of full colour: 1 for linear colours, more for images; 0: no colour.
        double full = 0;
    };

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
        columns_.assign(element.properties.size(), {});
        if (is_vertex) add_columns(element, kPlyPosition, position_);
        if (is_vertex && has_normals_) add_columns(element, kNormalAxes, normal_);
        const PlyAxes* const colours =
            is_vertex || (is_read && !has_colours_) ? colours_of(element) : nullptr;
        if (colours != nullptr) add_columns(element, *colours, colour_, true);
        if (colours != nullptr && !is_vertex) set_faces_albedo(kClay);
        for (std::uint64_t item = 0; item < element.count; ++item) {
            values_.begin(element, item);
            for (std::size_t i = 0; i < element.properties.size(); ++i) {
                const PlyProperty& property = element.properties[i];
                if (property.count_type != nullptr)
                    read_list(property);
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

    /// Of faces without an albedo.
    void set_faces_albedo(Albedo albedo) {
        mesh_.albedo.resize(mesh_.faces.corner_counts.size(), albedo);
    }

    void read_number(const Column& column, const PlyType& type) {
        double& number = *column.number;
        number = values_.number(type);
        if (column.full == 0) return;
        number = rules_.channel_of(number, column.full);
        if (column.full > 1) number = linear_of(number);
    }

    void add_vertex() {
        for (int axis = 0; axis < 3; ++axis) {
            const double value = position_[axis];
            if (!MeshRules::is_good(value))
                rules_.take_bad_coordinate(value, fmt::format("{}", value));
        }
        positions_.push_back(position_);
        if (has_normals_) normals_.push_back(Origin().to_world(normal_));
        if (has_colours_) mesh_.vertex_colours.emplace_back(colour_);
    }

    void read_list(const PlyProperty& property) {
        const std::int64_t count = values_.integer(*property.count_type);
        if (count < 0) values_.fail("list of {} entries; is the header right?", count);
        corners_.clear();
        for (std::int64_t i = 0; i < count; ++i) {
            if (property.has_corners)
                corners_.push_back(values_.integer(*property.type));
            else
                values_.skip(*property.type);
        }
        if (property.has_corners) add_face();
    }
    void add_face() {
        if (!rules_.keeps_face(corners_.size())) return;
        for (const std::int64_t corner : corners_) {
            if (corner >= 0 && static_cast<std::uint64_t>(corner) < vertex_count_) continue;
            return rules_.leave_out(
                fmt::format("vertex {} of {}; indices start at 0 and end below the number of "
                            "vertices",
                            corner, vertex_count_));
        }
        rules_.count_triangles(corners_.size() - 2);
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
    FileMesh mesh_;
    std::uint64_t vertex_count_ = 0;
    bool has_normals_ = false;
    bool has_colours_ = false;
    glm::dvec3 position_ = {};
    glm::dvec3 normal_ = {};
    glm::dvec3 colour_ = {};
    std::vector<glm::dvec3> positions_;
    std::vector<vec3> normals_;
    /// One for each property of the element that is read.
    std::vector<Column> columns_;
    std::vector<std::int64_t> corners_;
};

}  // namespace

FileMesh read_ply(const std::filesystem::path& path, const MeshFileOptions& options) {
    const std::string name = escape(path);
    const std::string text = read_input_file(path);
    const PlyHeader header = HeaderParser(text, name).run();
    if (header.has_textures && options.warn && !options.positions_only)
        options.warn({name, "textures of PLY files are not read; faces have their colours alone"});
    FileMesh mesh = PlyReader(text, header, name, options).read();
    require_faces(mesh, name, "a mesh with faces");
    return mesh;
}

}  // namespace mray
