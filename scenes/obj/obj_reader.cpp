#include "scenes/obj/obj_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#define TINYOBJLOADER_IMPLEMENTATION
#include <tiny_obj_loader.h>

#include "common/base/input_file.h"
#include "common/text/text.h"

namespace mray {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kBlanks = " \t\f";

/// Splits a text into statements and refuses what is no text. `name` is the file in messages.
class ObjLines {
public:
    ObjLines(std::string_view text, std::string name) : rest_(text), name_(std::move(name)) {
        if (rest_.starts_with("\xEF\xBB\xBF")) rest_.remove_prefix(3);
    }

    bool at_end() const { return rest_.empty(); }
    /// A line, or several of which all but the last end in a backslash. Valid until the next call.
    std::string_view next() {
        line_ = next_line_;
        std::string_view statement = take_line();
        statement.remove_prefix(std::min(statement.find_first_not_of(kBlanks), statement.size()));
        if (!statement.ends_with('\\') || statement.starts_with('#') || at_end()) return statement;
        joined_ = statement;
        while (joined_.ends_with('\\') && !at_end()) {
            joined_.back() = ' ';
            joined_ += take_line();
        }
        return joined_;
    }

    /// The line that the current statement begins in.
    std::uint64_t line() const { return line_; }
    /// Whether the current statement ends the file without a line end.
    bool may_be_cut() const { return !has_line_end_; }
    std::string place() const { return fmt::format("{}:{}", name_, line_); }
    template <class... Values>
    [[noreturn]] void fail(fmt::format_string<Values...> what, Values&&... values) const {
        throw Error(ErrorKind::kBadInput, "{}: {}", place(),
                    fmt::format(what, std::forward<Values>(values)...));
    }

private:
    std::string_view take_line() {
        ++next_line_;
        std::size_t length = 0;
        for (; length < rest_.size() && rest_[length] != '\n' && rest_[length] != '\r'; ++length) {
            const auto c = static_cast<unsigned char>(rest_[length]);
            if (c >= 32 || c == '\t' || c == '\f') continue;
            fail("control character 0x{:02X}; this is binary data or UTF-16, save it as UTF-8 text",
                 c);
        }
        const std::string_view line = rest_.substr(0, length);
        has_line_end_ = length < rest_.size();
        rest_.remove_prefix(length);
        if (has_line_end_) rest_.remove_prefix(rest_.starts_with("\r\n") ? 2 : 1);
        return line;
    }

    std::string_view rest_;
    const std::string name_;
    std::uint64_t line_ = 1;
    std::uint64_t next_line_ = 1;
    bool has_line_end_ = false;
    std::string joined_;
};

/// Removes and returns the next word; empty at the end of the statement or at a comment.
std::string_view next_word(std::string_view& rest) {
    std::string_view after = rest;
    const std::string_view word = take_word(after);
    if (word.starts_with('#')) return {};
    rest = after;
    return word;
}

constexpr Albedo kWhite = 0x00FFFFFF;

/// The name of a file as a statement has it: in quotes, with "\\ " for blanks, \\ for slashes.
std::string file_name_of(std::string_view text) {
    text = trimmed(text, kBlanks);
    if (text.size() > 1 && text.front() == '"' && text.back() == '"')
        text = text.substr(1, text.size() - 2);
    std::string name;
    for (std::size_t i = 0; i < text.size(); ++i) {
        if (text[i] != '\\')
            name += text[i];
        else if (!text.substr(i + 1).starts_with(' '))
            name += '/';
    }
    return name;
}

/// As side_file(); a file of another folder is searched beside the scene file by its last name.
fs::path find_side_file(const fs::path& scene_file, const std::string& name) {
    try {
        return side_file(scene_file, name);
    } catch (const Error&) {
        const std::string last = name.substr(name.rfind('/') + 1);
        std::error_code ignored;
        if (!fs::is_regular_file(scene_file.parent_path() / last, ignored)) throw;
        return side_file(scene_file, last);
    }
}

/// The colour of a statement Kd: three numbers from 0 to 1, or one that is grey.
std::optional<Albedo> colour_of(std::string_view words, WarningCount& clamped,
                                const PlaceText& place) {
    std::array<float, 3> channels = {};
    for (std::size_t i = 0; i < channels.size(); ++i) {
        const std::string_view word = next_word(words);
        if (i == 1 && word.empty()) return albedo_of(channels[0], channels[0], channels[0]);
        const std::optional<double> number = parse_double(word);
        if (!number) return std::nullopt;
        channels[i] = static_cast<float>(channel_of(*number, 1, clamped, place));
    }
    return albedo_of(channels[0], channels[1], channels[2]);
}

/// Reads a statement map_Kd. Options that it does not have stay as they are.
void read_map(std::string_view words, Material& material, WarningCount& unread,
              const PlaceText& place) {
    tinyobj::texture_option_t options = {};
    options.clamp = material.clamp;
    std::ranges::copy(material.scale, options.scale);
    std::ranges::copy(material.offset, options.origin_offset);
    std::string name;
    const bool has_name =
        tinyobj::ParseTextureNameAndOption(&name, &options, std::string(words).c_str());
    const auto is_finite = [](float number) { return std::isfinite(number); };
    if (!has_name || !std::ranges::all_of(options.scale, is_finite) ||
        !std::ranges::all_of(options.origin_offset, is_finite)) {
        return unread.add(place,
                          "map_Kd {} is not read; write -s and -o with three numbers, and "
                          "the name of a file",
                          quote(words));
    }
    material.map = file_name_of(name);
    material.clamp = options.clamp;
    std::copy_n(options.scale, 2, material.scale.begin());
    std::copy_n(options.origin_offset, 2, material.offset.begin());
}

/// Gives faces colours and textures. Texture files lie at the library's path or beside it.
class ObjMaterials {
public:
    /// `path` is the OBJ file. Keeps references to all three.
    ObjMaterials(const fs::path& path, const MeshFileOptions& options, FileMesh& mesh)
        : path_(path), options_(options), mesh_(mesh), name_(escape(path)) {}

    /// Adds the materials of the library that a line names. One that cannot be read is a warning.
    void read_library(std::string_view name) {
        if (options_.positions_only) return;
        try {
            const fs::path library =
                find_side_file(path_, file_name_of(name.substr(0, name.find(" #"))));
            if (libraries_.contains(library)) return;
            MaterialMap read = read_mtl_text(read_input_file(library), library, odd_colours_);
            materials_.merge(read);
            libraries_.insert(library);
        } catch (const Error& error) {
            unread_.add(name_, "{}; its materials are clay", as_warning(error, name_).text);
        }
    }
    /// Gives the next faces a material; the default, if the name is not known.
    void use(std::string_view name) {
        name = trimmed(name, kBlanks);
        if (options_.positions_only || name.empty()) return;
        current_ = &default_;
        const auto found = materials_.find(std::string(name));
        if (found == materials_.end()) {
            return unknown_.add(name_, "material {} is in no library; faces that use it are clay",
                                quote(name));
        }
        Material& material = found->second;
        if (!std::exchange(material.is_used, true) && !material.map.empty())
            material.texture = texture_of(material);
        current_ = &material;
    }
    /// Colours the next face of the mesh. Null stands for corners without texture coordinates.
    void add_face(std::span<const Texcoord* const> texcoords) {
        const Material& material = *current_;
        bool is_textured = material.texture != kNoTexture;
        if (is_textured && std::ranges::find(texcoords, nullptr) != texcoords.end()) {
            is_textured = false;
            without_texcoords_.add(
                name_,
                "face with a texture, but without texture coordinates; has its colour alone");
        }
        // Some exporters write black for materials whose colour is the texture.
        mesh_.albedo.push_back(is_textured && material.albedo.value_or(0) == 0
                                   ? kWhite
                                   : material.albedo.value_or(kClay));
        if (mesh_.textures.empty()) return;
        has_textured_faces_ |= is_textured;
        mesh_.face_textures.push_back(is_textured ? material.texture : kNoTexture);
        for (const Texcoord* const at : texcoords) {
            Texcoord& texcoord = mesh_.texcoords.emplace_back();
            if (!is_textured) continue;
            texcoord.u = at->u * material.scale[0] + material.offset[0];
            texcoord.v = at->v * material.scale[1] + material.offset[1];
        }
    }
    /// Gives the warnings, once all faces have been added.
    void finish() {
        for (const WarningCount* const warnings :
             {&unread_, &odd_colours_, &unknown_, &missing_, &without_texcoords_})
            warnings->tell(options_.warn);
        if (has_textured_faces_) return;
        mesh_.textures = {};
        mesh_.face_textures = {};
        mesh_.texcoords = {};
    }

private:
    /// The index of the material's texture, or kNoTexture with a warning if there is no such file.
    std::uint32_t texture_of(const Material& material) {
        TextureFile file{.clamp = material.clamp};
        const std::string library = escape(material.library);
        try {
            file.path = find_side_file(material.library, material.map).native();
        } catch (const Error& error) {
            missing_.add(library, "map_Kd: {}; its faces have no texture",
                         as_warning(error, library).text);
            return kNoTexture;
        }
        const auto same = std::ranges::find(mesh_.textures, file);
        const auto texture = static_cast<std::uint32_t>(same - mesh_.textures.begin());
        // Faces before the first texture have none.
        if (mesh_.textures.empty()) {
            mesh_.face_textures.resize(mesh_.faces.corner_counts.size(), kNoTexture);
            mesh_.texcoords.resize(mesh_.faces.corners.size());
        }
        if (same == mesh_.textures.end()) mesh_.textures.push_back(std::move(file));
        return texture;
    }

    const fs::path& path_;
    const MeshFileOptions& options_;
    FileMesh& mesh_;
    const std::string name_;
    std::set<fs::path> libraries_;
    MaterialMap materials_;
    const Material default_;
    const Material* current_ = &default_;
    bool has_textured_faces_ = false;
    WarningCount unread_, odd_colours_, unknown_, missing_, without_texcoords_;
};

constexpr std::uint32_t kNone = 0xFFFFFFFFu;

/// The index from 0 of one from 1, or relative to the end if negative; kNone if not there yet.
std::uint32_t index_of(int index, std::size_t size) {
    const auto count = static_cast<std::int64_t>(size);
    const std::int64_t at = index > 0 ? std::int64_t{index} - 1 : count + index;
    return index != 0 && at >= 0 && at < count ? static_cast<std::uint32_t>(at) : kNone;
}

/// A corner's vertex, texture coordinates and normal as the file numbers them; 0: none.
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

/// Reads a number; 0 if it is not there or not finite.
float next_finite(std::string_view& words) {
    const float number = parse_float(next_word(words)).value_or(0.0f);
    return std::isfinite(number) ? number : 0;
}

class ObjReader {
public:
    ObjReader(const fs::path& path, std::string_view text, const MeshFileOptions& options)
        : name_(escape(path)),
          lines_(text, name_),
          options_(options),
          rules_(options.lenient, [this] { return lines_.place(); }),
          materials_(path, options, mesh_) {}

    FileMesh read() {
        while (!lines_.at_end()) read_statement();
        if (!mesh_.faces.corners.empty() && largest_vertex_ >= positions_.size()) {
            throw Error(ErrorKind::kBadInput, "{}:{}: {}", name_, largest_vertex_line_,
                        not_there(std::int64_t{largest_vertex_} + 1));
        }
        set_positions(mesh_, positions_, options_);
        // Vertices without a colour, in a file with some, are white.
        if (!mesh_.vertex_colours.empty()) mesh_.vertex_colours.resize(positions_.size(), vec3(1));
        mesh_.place_prefix = name_ + ':';
        if (!has_normals_) mesh_.smooth = {};
        rules_.tell(options_.warn);
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
                bits = SmoothNumbers::bits(next_finite(rest));
        } else if (keyword == "vt" && !options_.positions_only) {
            const float u = next_finite(rest);
            texcoords_.push_back({u, next_finite(rest)});
        } else if (keyword == "usemtl") {
            materials_.use(rest);
        } else if (keyword == "mtllib") {
            materials_.read_library(rest);
        } else if (statement.starts_with("#MRGB ")) {
            odd_colours_.add([this] { return lines_.place(); },
                             "colours of #MRGB are not read; write v x y z r g b");
        }
    }

    void read_vertex(std::string_view words) {
        // A position and a colour.
        std::array<double, 6> numbers = {};
        std::size_t count = 0;
        for (auto word = next_word(words); !word.empty(); word = next_word(words)) {
            const std::optional<double> number = parse_coordinate(word);
            if (!number) lines_.fail("{}", not_a_number(word));
            if (count < numbers.size()) numbers[count] = *number;
            if (++count <= 3 && !MeshRules::is_good(*number))
                rules_.take_bad_coordinate(*number, word);
        }
        if (count < 3)
            lines_.fail("vertex of {} numbers where 3 are needed; is the file complete?", count);
        positions_.emplace_back(numbers[0], numbers[1], numbers[2]);
        // A fourth number is a weight.
        if (count <= 4 || options_.positions_only) return;
        if (count != numbers.size()) {
            return odd_colours_.add(
                [this] { return lines_.place(); },
                "vertex of {} numbers; all but 3 are left out (a colour makes 6)", count);
        }
        mesh_.vertex_colours.resize(positions_.size(), vec3(1));
        for (int i = 0; i < 3; ++i) {
            const double given = numbers[static_cast<std::size_t>(i) + 3];
            mesh_.vertex_colours.back()[i] =
                static_cast<float>(linear_of(rules_.channel_of(given, 1)));
        }
    }

    void read_face(std::string_view words) {
        corners_.clear();
        for (auto word = next_word(words); !word.empty(); word = next_word(words)) {
            const std::optional<Corner> corner = parse_corner(word);
            if (!corner) {
                return rules_.leave_out(
                    fmt::format("{} is not a corner; write v, v/vt, v//vn or v/vt/vn with indices "
                                "of at most 9 digits",
                                quote(word)));
            }
            corners_.push_back(*corner);
        }
        // A file without a final line end may have been cut.
        if (rules_.keeps_face(corners_.size(), lines_.may_be_cut())) add_face();
    }

    void add_face() {
        vertices_of_face_.clear();
        for (const Corner& corner : corners_) {
            const int index = corner[0];
            std::uint32_t vertex = index_of(index, positions_.size());
            if (vertex == kNone) {
                // It may follow its faces.
                if (index <= 0 || options_.lenient) return rules_.leave_out(not_there(index));
                vertex = static_cast<std::uint32_t>(index - 1);
            }
            if (vertex >= largest_vertex_) {
                largest_vertex_ = vertex;
                largest_vertex_line_ = lines_.line();
            }
            vertices_of_face_.push_back(vertex);
        }
        rules_.count_triangles(corners_.size() - 2);
        mesh_.faces.corners.insert(mesh_.faces.corners.end(), vertices_of_face_.begin(),
                                   vertices_of_face_.end());
        texcoords_of_face_.clear();
        for (std::size_t i = 0; i < corners_.size(); ++i) {
            const std::uint32_t texcoord = index_of(corners_[i][1], texcoords_.size());
            texcoords_of_face_.push_back(texcoord == kNone ? nullptr : &texcoords_[texcoord]);
            if (!options_.positions_only)
                mesh_.smooth.push_back(smooth_number(vertices_of_face_[i], corners_[i][2]));
        }
        mesh_.faces.corner_counts.push_back(static_cast<std::uint32_t>(corners_.size()));
        if (corners_.size() > 3) mesh_.polygon_places.push_back(lines_.line());
        materials_.add_face(texcoords_of_face_);
    }

    std::string not_there(std::int64_t index) const {
        return fmt::format("vertex {} of {}; indices start at 1 and end at the number of vertices",
                           index, positions_.size());
    }

    /// The number of the first corner with this vertex and normal.
    std::uint32_t smooth_number(std::uint32_t vertex, int normal_index) {
        const auto next = static_cast<std::uint32_t>(mesh_.smooth.size());
        const std::uint32_t normal = index_of(normal_index, normals_.size());
        if (normal == kNone) return next;
        has_normals_ = true;
        const auto& [x, y, z] = normals_[normal];
        return numbers_.number_of({vertex, 0, 0, x, y, z}, next);
    }

    const std::string name_;
    ObjLines lines_;
    const MeshFileOptions& options_;
    MeshRules rules_;
    FileMesh mesh_;
    std::vector<glm::dvec3> positions_;
    ObjMaterials materials_;
    std::vector<Corner> corners_;  // of the face that is read
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

MaterialMap read_mtl_text(std::string_view text, const fs::path& library, WarningCount& unread) {
    MaterialMap materials;
    // What precedes the first material, or is of one whose name is known, is read for its warnings.
    Material ignored;
    Material* material = &ignored;
    ObjLines lines(text, escape(library));
    const PlaceText place = [&] { return lines.place(); };
    while (!lines.at_end()) {
        const std::string_view statement = lines.next();
        std::string_view rest = statement;
        const std::string_view keyword = next_word(rest);
        if (keyword == "newmtl") {
            const std::string name(trimmed(rest, kBlanks));
            const auto [entry, is_new] = materials.try_emplace(name, Material{.library = library});
            material = is_new ? &entry->second : &ignored;
        } else if (keyword == "Kd") {
            material->albedo = colour_of(rest, unread, place);
            if (!material->albedo)
                unread.add(place, "{} is not read; write one number or three", quote(statement));
        } else if (keyword == "map_Kd") {
            read_map(trimmed(rest, kBlanks), *material, unread, place);
        }
    }
    materials.erase("");
    return materials;
}

FileMesh read_obj(const fs::path& path, const MeshFileOptions& options) {
    const std::string text = read_input_file(path);
    FileMesh mesh = ObjReader(path, text, options).read();
    require_faces(mesh, escape(path), "an OBJ file");
    return mesh;
}

}  // namespace mray
