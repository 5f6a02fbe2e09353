#include "scenes/mesh/mesh_file.h"
#include "scenes/mesh/mesh_rules.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <sstream>
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

/// Nine digits name more vertices than any file has, and fit an int.
bool is_index(std::string_view text) {
    if (text.starts_with('-') || text.starts_with('+')) text.remove_prefix(1);
    return !text.empty() && text.size() <= 9 &&
           std::all_of(text.begin(), text.end(), [](char c) { return c >= '0' && c <= '9'; });
}

/// Whether a word is v, v/vt, v//vn or v/vt/vn. Trailing numbers may be left out before a slash.
bool is_corner(std::string_view word) {
    for (int part = 0; part < 3; ++part) {
        const std::size_t slash = std::min(word.find('/'), word.size());
        const std::string_view number = word.substr(0, slash);
        if (!is_index(number) && !(number.empty() && part > 0)) return false;
        if (slash == word.size()) return true;
        word.remove_prefix(slash + 1);
    }
    return false;
}

float finite_or(float number, float otherwise) {
    return std::isfinite(number) ? number : otherwise;
}

/// Takes a number; 0 if it is not there or not finite.
float take_finite(std::string_view& words) {
    return finite_or(parse_float(next_word(words)).value_or(0.0f), 0);
}

/// Passes faces and materials to tinyobjloader a statement at a time, so that results have a line.
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
            static_cast<ObjReader*>(data)->materials_.use(material);
        };
        tinyobj::LoadObjWithCallback(stream, callbacks, this, this);
        if (!mesh_.faces.corners.empty() && largest_vertex_ >= positions_.size()) {
            throw Error(ErrorKind::kBadInput, "{}:{}: {}", name_, largest_vertex_line_,
                        not_there(largest_vertex_));
        }
        set_positions(mesh_, positions_, options_);
        if (!has_normals_) mesh_.smooth = {};
        rules_.tell(options_.warn);
        materials_.finish();
        return std::move(mesh_);
    }

private:
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
        if (keyword == "f") {
            pass_face(rest);
        } else if (keyword == "v") {
            read_vertex(rest);
        } else if (keyword == "vn" && !options_.positions_only) {
            for (std::uint32_t& bits : normals_.emplace_back())
                bits = SmoothNumbers::bits(take_finite(rest));
        } else if (keyword == "vt" && !options_.positions_only) {
            const float u = take_finite(rest);
            texcoords_.push_back({u, take_finite(rest)});
        } else if (keyword == "usemtl" || keyword == "mtllib") {
            if (!std::all_of(rest.begin(), rest.end(), is_blank)) passed_ = statement;
        }
    }

    void read_vertex(std::string_view words) {
        glm::dvec3 position(0.0);
        int count = 0;
        for (auto word = next_word(words); !word.empty(); word = next_word(words)) {
            const std::optional<double> number = parse_coordinate(word);
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
        positions_.push_back(position);
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
        vertices_of_face_.clear();
        for (const tinyobj::index_t& corner : corners) {
            const int index = corner.vertex_index;
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
        rules_.count_triangles(corners.size() - 2, place_);
        mesh_.faces.corners.insert(mesh_.faces.corners.end(), vertices_of_face_.begin(),
                                   vertices_of_face_.end());
        texcoords_of_face_.clear();
        for (std::size_t i = 0; i < corners.size(); ++i) {
            const std::uint32_t texcoord = place_of(corners[i].texcoord_index, texcoords_.size());
            texcoords_of_face_.push_back(texcoord == kNone ? nullptr : &texcoords_[texcoord]);
            if (!options_.positions_only)
                mesh_.smooth.push_back(
                    smooth_number(vertices_of_face_[i], corners[i].normal_index));
        }
        mesh_.faces.corner_counts.push_back(static_cast<std::uint32_t>(corners.size()));
        materials_.add_face(texcoords_of_face_);
    }

    bool operator()(const std::string& name, std::vector<tinyobj::material_t>*,
                    std::map<std::string, int>*, std::string*, std::string*) override {
        materials_.read_library(name);
        // After a success it would read no more libraries of the line.
        return false;
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
    std::string passed_;
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

void read_mtl_text(std::string_view text, const fs::path& library, MaterialMap& materials) {
    // Tells materials without Kd from black ones.
    constexpr float kNoColour = -1;
    std::string marked;
    for (ObjLines lines(text, escape(library)); !lines.at_end();) {
        const std::string_view statement = lines.next();
        marked.append(statement) += '\n';
        if (statement.starts_with("newmtl")) marked += "Kd -1\n";
    }
    std::istringstream stream(std::move(marked));
    std::map<std::string, int> indices;
    std::vector<tinyobj::material_t> read;
    std::string ignored;
    tinyobj::LoadMtl(&indices, &read, &stream, &ignored, &ignored);
    for (const tinyobj::material_t& one : read) {
        Material material{
            .map = one.diffuse_texname, .clamp = one.diffuse_texopt.clamp, .library = library};
        const auto& kd = one.diffuse;
        if (kd[0] != kNoColour)
            material.albedo =
                albedo_of(finite_or(kd[0], 0), finite_or(kd[1], 0), finite_or(kd[2], 0));
        for (std::size_t i = 0; i < 2; ++i) {
            material.scale[i] = finite_or(one.diffuse_texopt.scale[i], 1);
            material.offset[i] = finite_or(one.diffuse_texopt.origin_offset[i], 0);
        }
        if (material.map.size() > 1 && material.map.front() == '"' && material.map.back() == '"')
            material.map = material.map.substr(1, material.map.size() - 2);
        std::replace(material.map.begin(), material.map.end(), '\\', '/');
        materials.emplace(trimmed(one.name, kBlanks), std::move(material));
    }
}

FileMesh read_obj(const fs::path& path, const MeshFileOptions& options) {
    const std::string text = read_input_file(path);
    FileMesh mesh = ObjReader(path, text, options).read();
    require_faces(mesh, escape(path), "an OBJ file");
    return mesh;
}

}  // namespace mray
