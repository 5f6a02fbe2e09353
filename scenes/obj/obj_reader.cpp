#include "scenes/mesh/mesh_file.h"
#include "scenes/mesh/mesh_rules.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "common/base/errors.h"
#include "common/base/input_file.h"
#include "common/text/number_text.h"
#include "common/text/text_parts.h"
#include "scenes/obj/obj_lines.h"
#include "scenes/obj/obj_materials.h"

namespace mray {
namespace {

namespace fs = std::filesystem;

constexpr std::uint32_t kNone = 0xFFFFFFFFu;

/// The place of an index from 1, or relative to the end if negative; kNone if there is none yet.
std::uint32_t place_of(int index, std::size_t size) {
    const auto count = static_cast<std::int64_t>(size);
    const std::int64_t at = index > 0 ? std::int64_t{index} - 1 : count + index;
    return index != 0 && at >= 0 && at < count ? static_cast<std::uint32_t>(at) : kNone;
}

/// The numbers of a corner's vertex, texture coordinates and normal as the file has them; 0: none.
using Corner = std::array<int, 3>;

/// Reads v, v/vt, v//vn or v/vt/vn, in which all numbers but v may be missing.
std::optional<Corner> parse_corner(std::string_view word) {
    Corner corner = {};
    for (int& index : corner) {
        const std::size_t slash = std::min(word.find('/'), word.size());
        std::string_view number = word.substr(0, slash);
        const bool is_negative = number.starts_with('-');
        if (is_negative || number.starts_with('+')) number.remove_prefix(1);
        const std::optional<std::uint64_t> digits = parse_unsigned(number);
        // Nine digits name more vertices than any file has, and fit an int.
        if (digits ? number.size() > 9 : slash > 0 || &index == corner.data()) return std::nullopt;
        index = static_cast<int>(digits.value_or(0)) * (is_negative ? -1 : 1);
        if (slash == word.size()) return corner;
        word.remove_prefix(slash + 1);
    }
    return std::nullopt;
}

/// Takes a number; 0 if it is not there or not finite.
float take_finite(std::string_view& words) {
    const float number = parse_float(next_word(words)).value_or(0.0f);
    return std::isfinite(number) ? number : 0;
}

class ObjReader {
public:
    ObjReader(const fs::path& path, std::string_view text, const MeshFileOptions& options)
        : name_(escape(path)),
          lines_(text, name_),
          options_(options),
          rules_(options.lenient),
          place_([this] { return lines_.place(); }),
          materials_(path, options, mesh_) {}

    FileMesh read() {
        while (!lines_.at_end()) read_statement();
        if (!mesh_.faces.corners.empty() && largest_vertex_ >= positions_.size()) {
            throw Error(ErrorKind::kBadInput, "{}:{}: {}", name_, largest_vertex_line_,
                        not_there(largest_vertex_));
        }
        set_positions(mesh_, positions_, options_);
        set_colours();
        mesh_.place_prefix = name_ + ':';
        if (!has_normals_) mesh_.smooth = {};
        rules_.tell(options_.warn);
        clamped_.tell(options_.warn);
        odd_colours_.tell(options_.warn);
        materials_.finish();
        return std::move(mesh_);
    }

private:
    void read_statement() {
        const std::string_view statement = lines_.next();
        std::string_view rest = statement;
        const std::string_view keyword = next_word(rest);
        if (keyword == "f") {
            read_face(rest);
        } else if (keyword == "v") {
            read_vertex(rest);
        } else if (keyword == "vn" && !options_.positions_only) {
            for (std::uint32_t& bits : normals_.emplace_back())
                bits = SmoothNumbers::bits(take_finite(rest));
        } else if (keyword == "vt" && !options_.positions_only) {
            const float u = take_finite(rest);
            texcoords_.push_back({u, take_finite(rest)});
        } else if (keyword == "usemtl") {
            materials_.use(rest);
        } else if (keyword == "mtllib") {
            materials_.read_libraries(rest);
        } else if (statement.starts_with("#MRGB ") && !options_.positions_only) {
            read_painted(trimmed(statement.substr(6), kBlanks));
        }
    }

    void read_vertex(std::string_view words) {
        // A position and a colour.
        std::array<double, 6> numbers = {};
        std::size_t count = 0;
        for (auto word = next_word(words); !word.empty(); word = next_word(words)) {
            const std::optional<double> number = parse_coordinate(word);
            if (!number) lines_.fail(not_a_number(word));
            if (count < numbers.size()) numbers[count] = *number;
            if (++count <= 3 && !MeshRules::is_good(*number))
                rules_.take_bad_coordinate(*number, word, place_);
        }
        if (count < 3) {
            lines_.fail(fmt::format(
                "vertex of {} numbers where 3 are needed; is the file complete?", count));
        }
        positions_.emplace_back(numbers[0], numbers[1], numbers[2]);
        // A fourth number is a weight.
        if (count <= 4 || options_.positions_only) return;
        if (count != numbers.size()) {
            return odd_colours_.add([&] {
                return Warning{place_(), fmt::format("vertex of {} numbers; all but 3 are left out "
                                                     "(a colour makes 6)",
                                                     count)};
            });
        }
        mesh_.vertex_colours.resize(positions_.size(), vec3(1));
        for (int i = 0; i < 3; ++i) {
            const double given = numbers[static_cast<std::size_t>(i) + 3];
            mesh_.vertex_colours.back()[i] =
                static_cast<float>(linear_of(channel_of(given, 1, clamped_, place_)));
        }
    }

    /// Reads what ZBrush writes for each vertex: a mask, red, green and blue, in hexadecimal.
    void read_painted(std::string_view digits) {
        for (std::uint32_t bits = 0; digits.size() >= 8; digits.remove_prefix(8)) {
            const char* const end = digits.data() + 8;
            if (std::from_chars(digits.data(), end, bits, 16).ptr != end) return;
            const auto channel = [&](int shift) {
                return static_cast<float>(linear_of(((bits >> shift) & 255) / 255.0));
            };
            painted_.emplace_back(channel(16), channel(8), channel(0));
        }
    }

    /// Vertices without a colour, in a file with some, are white.
    void set_colours() {
        if (!painted_.empty() && painted_.size() != positions_.size()) {
            odd_colours_.add([&] {
                return Warning{name_, fmt::format("#MRGB has {} colours for {} vertices",
                                                  painted_.size(), positions_.size())};
            });
        }
        if (mesh_.vertex_colours.empty()) mesh_.vertex_colours = std::move(painted_);
        if (!mesh_.vertex_colours.empty()) mesh_.vertex_colours.resize(positions_.size(), vec3(1));
    }

    void read_face(std::string_view words) {
        corners_.clear();
        for (auto word = next_word(words); !word.empty(); word = next_word(words)) {
            const std::optional<Corner> corner = parse_corner(word);
            if (!corner) {
                return rules_.leave_out(
                    fmt::format("{} is not a corner; write v, v/vt, v//vn or v/vt/vn with indices "
                                "of at most 9 digits",
                                quote(word)),
                    place_);
            }
            corners_.push_back(*corner);
        }
        // A file without a final line end may have been cut.
        if (rules_.keeps_face(corners_.size(), lines_.may_be_cut(), place_)) add_face();
    }

    void add_face() {
        vertices_of_face_.clear();
        for (const Corner& corner : corners_) {
            const int index = corner[0];
            std::uint32_t vertex = place_of(index, positions_.size());
            if (vertex == kNone && index <= 0) {
                return rules_.leave_out(
                    index == 0 ? "vertex 0; indices start at 1"
                               : fmt::format("vertex {} relative to {} so far; is the file "
                                             "complete?",
                                             index, positions_.size()),
                    place_);
            }
            if (vertex == kNone) {
                // It may follow its faces.
                vertex = static_cast<std::uint32_t>(index - 1);
                if (options_.lenient) return rules_.leave_out(not_there(vertex), place_);
            }
            if (vertex >= largest_vertex_) {
                largest_vertex_ = vertex;
                largest_vertex_line_ = lines_.line();
            }
            vertices_of_face_.push_back(vertex);
        }
        rules_.count_triangles(corners_.size() - 2, place_);
        mesh_.faces.corners.insert(mesh_.faces.corners.end(), vertices_of_face_.begin(),
                                   vertices_of_face_.end());
        texcoords_of_face_.clear();
        for (std::size_t i = 0; i < corners_.size(); ++i) {
            const std::uint32_t texcoord = place_of(corners_[i][1], texcoords_.size());
            texcoords_of_face_.push_back(texcoord == kNone ? nullptr : &texcoords_[texcoord]);
            if (!options_.positions_only)
                mesh_.smooth.push_back(smooth_number(vertices_of_face_[i], corners_[i][2]));
        }
        mesh_.faces.corner_counts.push_back(static_cast<std::uint32_t>(corners_.size()));
        if (corners_.size() > 3) mesh_.polygon_places.push_back(lines_.line());
        materials_.add_face(texcoords_of_face_);
    }

    std::string not_there(std::uint32_t vertex) const {
        return fmt::format("vertex {} of {}; indices start at 1 and end at the number of vertices",
                           vertex + 1, positions_.size());
    }

    /// The number of the first corner with this vertex and normal.
    std::uint32_t smooth_number(std::uint32_t vertex, int normal_index) {
        const auto next = static_cast<std::uint32_t>(mesh_.smooth.size());
        const std::uint32_t normal = place_of(normal_index, normals_.size());
        if (normal == kNone) return next;
        has_normals_ = true;
        const auto& [x, y, z] = normals_[normal];
        return numbers_.number_of({vertex, 0, 0, x, y, z}, next);
    }

    const std::string name_;
    ObjLines lines_;
    const MeshFileOptions& options_;
    MeshRules rules_;
    const MeshRules::Place place_;
    FileMesh mesh_;
    std::vector<glm::dvec3> positions_;
    ObjMaterials materials_;
    /// Those of the face that is read.
    std::vector<Corner> corners_;
    std::vector<vec3> painted_;
    WarningCount clamped_;
    WarningCount odd_colours_;
    std::vector<std::array<std::uint32_t, 3>> normals_;
    std::vector<Texcoord> texcoords_;
    std::vector<std::uint32_t> vertices_of_face_;
    std::vector<const Texcoord*> texcoords_of_face_;
    std::uint32_t largest_vertex_ = 0;
    std::uint64_t largest_vertex_line_ = 0;
    SmoothNumbers numbers_;
    bool has_normals_ = false;
};

}  // namespace

FileMesh read_obj(const fs::path& path, const MeshFileOptions& options) {
    const std::string text = read_input_file(path);
    FileMesh mesh = ObjReader(path, text, options).read();
    require_faces(mesh, escape(path), "an OBJ file");
    return mesh;
}

}  // namespace mray
