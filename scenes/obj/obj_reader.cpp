#include "scenes/mesh/mesh_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <istream>
#include <optional>
#include <streambuf>
#include <string>
#include <string_view>
#include <utility>

#define TINYOBJLOADER_IMPLEMENTATION
#include <tiny_obj_loader.h>

#include "common/base/errors.h"
#include "common/base/input_file.h"
#include "common/text/number_text.h"
#include "common/text/text_parts.h"
#include "scenes/mesh/mesh_rules.h"
#include "scenes/mesh/smooth_numbers.h"
#include "scenes/obj/obj_lines.h"
#include "scenes/obj/obj_materials.h"

namespace mray {
namespace {

namespace fs = std::filesystem;

constexpr std::uint32_t kNone = 0xFFFFFFFFu;

/// The place in an array of an index from 1, or relative to its end if negative; kNone if there is
/// no such element yet.
std::uint32_t place_of(int index, std::size_t size) {
    const auto count = static_cast<std::int64_t>(size);
    const std::int64_t at = index > 0 ? std::int64_t{index} - 1 : count + index;
    return index != 0 && at >= 0 && at < count ? static_cast<std::uint32_t>(at) : kNone;
}

/// Parses vertices and passes faces and materials to tinyobjloader, a statement at a time, so that
/// what it returns belongs to the current line.
class ObjReader : private std::streambuf, private tinyobj::MaterialReader {
public:
    ObjReader(const fs::path& path, std::string_view text, const MeshFileOptions& options)
        : name_(escape(path)),
          lines_(text, name_),
          options_(options),
          rules_(options.lenient),
          place_([this] { return lines_.place(); }),
          materials_(path, options, mesh_) {}

    FileMesh read() {
        std::istream stream(this);
        // Errors of underflow() pass through.
        stream.exceptions(std::ios::badbit);
        tinyobj::callback_t callbacks;
        callbacks.index_cb = [](void* reader, tinyobj::index_t* corners, int count) {
            static_cast<ObjReader*>(reader)->add_face(
                std::span(corners, static_cast<std::size_t>(count)));
        };
        callbacks.usemtl_cb = [](void* data, const char* material, int) {
            ObjReader& reader = *static_cast<ObjReader*>(data);
            reader.material_ = reader.materials_.use(material);
        };
        tinyobj::LoadObjWithCallback(stream, callbacks, this, this);
        build_mesh();
        return std::move(mesh_);
    }

private:
    struct Corner {
        std::uint32_t vertex;
        std::uint32_t texcoord;
        std::uint32_t normal;
    };
    struct Face {
        std::uint32_t corner_count;
        std::uint32_t material;
    };

    /// The next statement for tinyobjloader.
    int_type underflow() override {
        for (passed_.clear(); passed_.empty();) {
            if (lines_.at_end()) return traits_type::eof();
            read_statement();
        }
        passed_ += '\n';
        setg(passed_.data(), passed_.data(), passed_.data() + passed_.size());
        return traits_type::to_int_type(passed_.front());
    }

    void read_statement() {
        const std::string_view statement = lines_.next();
        std::string_view rest = statement;
        const std::string_view keyword = next_word(rest);
        if (keyword == "f") return pass_face(rest);
        if (statement.size() > kMaxObjLineBytes) {
            lines_.fail(fmt::format("line of {} bytes; at most {} are read, is this an OBJ file?",
                                    statement.size(), kMaxObjLineBytes));
        }
        if (keyword == "v") {
            read_vertex(rest);
        } else if (keyword == "vn" && options_.normals) {
            read_normal(rest);
        } else if (keyword == "vt" && options_.textures) {
            read_texcoord(rest);
        } else if (keyword == "usemtl" || keyword == "mtllib") {
            if (!std::all_of(rest.begin(), rest.end(), is_blank)) passed_ = statement;
        }
    }

    void read_vertex(std::string_view words) {
        vec3 position(0.0f);
        int count = 0;
        for (auto word = next_word(words); !word.empty(); word = next_word(words)) {
            const std::optional<float> number = parse_float(word);
            if (!number) lines_.fail(not_a_number(word));
            // Further numbers are a weight and a colour.
            if (++count > 3) continue;
            position[count - 1] = *number;
            if (!MeshRules::is_good(*number)) rules_.take_bad_coordinate(*number, word, place_);
        }
        if (count < 3) {
            lines_.fail(fmt::format(
                "vertex of {} numbers where 3 are needed; is the file complete?", count));
        }
        mesh_.positions.push_back(position);
    }

    void read_normal(std::string_view words) {
        for (std::uint32_t& bits : normals_.emplace_back()) {
            const float value = parse_float(next_word(words)).value_or(0.0f);
            // NaN equals nothing.
            bits = SmoothNumbers::bits(std::isnan(value) ? 0.0f : value);
        }
    }

    void read_texcoord(std::string_view words) {
        Texcoord& texcoord = texcoords_.emplace_back();
        for (float* const component : {&texcoord.u, &texcoord.v}) {
            const std::string_view word = next_word(words);
            if (word.empty()) return;
            const std::optional<float> number = parse_float(word);
            if (number && std::isfinite(*number)) {
                *component = *number;
                continue;
            }
            odd_texcoords_.add([&] {
                return Warning{lines_.place(),
                               fmt::format("texture coordinate {} is not a finite number; "
                                           "taken as 0",
                                           quote(word))};
            });
        }
    }

    /// Passes on what tinyobjloader, which checks nothing, reads correctly.
    void pass_face(std::string_view words) {
        passed_ = 'f';
        std::uint64_t corners = 0;
        for (auto word = next_word(words); !word.empty(); word = next_word(words)) {
            if (!is_corner(word)) {
                passed_.clear();
                return rules_.leave_out(
                    fmt::format("{} is not a corner; write v, v/vt, v//vn or v/vt/vn with indices "
                                "of at most 9 digits",
                                quote(word)),
                    place_);
            }
            // It would take the next word for the number after a slash.
            while (word.ends_with('/')) word.remove_suffix(1);
            passed_ += ' ';
            passed_ += word;
            ++corners;
        }
        // A file without a final line end may have been cut.
        if (!rules_.keeps_face(corners, lines_.may_be_cut(), place_)) passed_.clear();
    }

    void add_face(std::span<const tinyobj::index_t> corners) {
        const std::size_t first = corners_.size();
        const std::size_t vertex_count = mesh_.positions.size();
        for (const tinyobj::index_t& corner : corners) {
            const int index = corner.vertex_index;
            std::uint32_t vertex = place_of(index, vertex_count);
            // A vertex may follow its faces.
            if (index > 0) vertex = static_cast<std::uint32_t>(index - 1);
            if (vertex == kNone) {
                corners_.resize(first);
                return rules_.leave_out(
                    index == 0 ? "vertex 0; indices start at 1"
                               : fmt::format("vertex {} relative to {} so far; is the file "
                                             "complete?",
                                             index, vertex_count),
                    place_);
            }
            if (index > largest_index_) {
                largest_index_ = index;
                largest_index_line_ = lines_.line();
            }
            corners_.push_back({vertex, place_of(corner.texcoord_index, texcoords_.size()),
                                place_of(corner.normal_index, normals_.size())});
        }
        rules_.count_face(corners.size(), place_);
        faces_.push_back({static_cast<std::uint32_t>(corners.size()), material_});
    }

    bool operator()(const std::string& name, std::vector<tinyobj::material_t>*,
                    std::map<std::string, int>*, std::string*, std::string*) override {
        materials_.read_library(name);
        // After a success it would read no more libraries of the line.
        return false;
    }

    /// Makes the mesh of the faces, once all vertices are known.
    void build_mesh() {
        const std::size_t vertex_count = mesh_.positions.size();
        if (!options_.lenient && static_cast<std::size_t>(largest_index_) > vertex_count) {
            throw Error(
                ErrorKind::kBadInput,
                fmt::format("{}: vertex {} of {}; indices start at 1 and end at the number "
                            "of vertices",
                            lines_.place(largest_index_line_), largest_index_, vertex_count));
        }
        mesh_.faces.corners.reserve(corners_.size());
        mesh_.faces.corner_counts.reserve(faces_.size());
        mesh_.albedo.reserve(faces_.size());
        std::span<const Corner> rest = corners_;
        for (const Face& face : faces_) {
            const std::span<const Corner> corners = rest.first(face.corner_count);
            rest = rest.subspan(face.corner_count);
            const auto is_missing = [&](const Corner& c) { return c.vertex >= vertex_count; };
            if (std::any_of(corners.begin(), corners.end(), is_missing)) {
                undefined_.add([&] {
                    return Warning{name_, "face with vertices that are not there; left out"};
                });
                continue;
            }
            build_face(corners, face.material);
        }
        if (!has_normals_) mesh_.smooth = {};
        rules_.tell(options_.warn);
        undefined_.tell(options_.warn);
        odd_texcoords_.tell(options_.warn);
        materials_.finish();
    }

    void build_face(std::span<const Corner> corners, std::uint32_t material) {
        texcoords_of_face_.clear();
        for (const Corner& corner : corners) {
            mesh_.faces.corners.push_back(corner.vertex);
            if (options_.normals) mesh_.smooth.push_back(smooth_number(corner));
            texcoords_of_face_.push_back(corner.texcoord == kNone ? nullptr
                                                                  : &texcoords_[corner.texcoord]);
        }
        mesh_.faces.corner_counts.push_back(static_cast<std::uint32_t>(corners.size()));
        materials_.add_face(material, texcoords_of_face_);
    }

    /// The number of the first corner with this vertex and normal.
    std::uint32_t smooth_number(const Corner& corner) {
        const auto next = static_cast<std::uint32_t>(mesh_.smooth.size());
        if (corner.normal == kNone) return next;
        has_normals_ = true;
        const auto& [x, y, z] = normals_[corner.normal];
        return numbers_.number_of({corner.vertex, 0, 0, x, y, z}, next);
    }

    const std::string name_;
    ObjLines lines_;
    const MeshFileOptions& options_;
    MeshRules rules_;
    const MeshRules::Place place_;
    FileMesh mesh_;
    ObjMaterials materials_;
    /// The statement that tinyobjloader reads.
    std::string passed_;
    std::uint32_t material_ = 0;
    std::vector<std::array<std::uint32_t, 3>> normals_;
    std::vector<Texcoord> texcoords_;
    std::vector<Corner> corners_;
    std::vector<Face> faces_;
    std::vector<const Texcoord*> texcoords_of_face_;
    int largest_index_ = 0;
    std::uint64_t largest_index_line_ = 0;
    SmoothNumbers numbers_;
    bool has_normals_ = false;
    WarningCount odd_texcoords_;
    WarningCount undefined_;
};

}  // namespace

FileMesh read_obj(const fs::path& path, const MeshFileOptions& options) {
    const std::string text = read_input_file(path);
    FileMesh mesh = ObjReader(path, text, options).read();
    require_faces(mesh, escape(path), "an OBJ file");
    return mesh;
}

}  // namespace mray
