#include "clips/obj/obj_reader.h"

#include <fmt/format.h>

#include <array>
#include <bit>
#include <cassert>
#include <set>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>

#include "clips/obj/mtl_reader.h"
#include "clips/obj/obj_checker.h"
#include "clips/obj/obj_textures.h"
#include "clips/obj/tiny_obj.h"
#include "common/base/errors.h"
#include "common/base/hash.h"
#include "common/base/input_file.h"
#include "common/text/message_text.h"
#include "common/text/text_parts.h"

namespace mray {
namespace {

namespace fs = std::filesystem;

// Builds the mesh from the statements that tinyobjloader finds in checked text.
class MeshBuilder : public ObjEvents {
public:
    MeshBuilder(const fs::path& path, const MeshFileOptions& options, const CheckedObj& checked,
                FileMesh& mesh)
        : path_(path),
          options_(options),
          checked_(checked),
          vertex_total_(checked.positions.size()),
          name_(shown(path)),
          mesh_(mesh),
          textures_(name_, checked, mesh) {
        mesh.faces.corners.reserve(checked.corner_count);
        mesh.faces.corner_counts.reserve(checked.face_count);
        mesh.albedo.reserve(checked.face_count);
    }

    void vertex() override { ++vertex_count_; }

    void face(std::span<const int> indices) override {
        const std::size_t first = mesh_.faces.corners.size();
        const std::size_t first_checked =
            std::exchange(next_checked_, next_checked_ + indices.size());
        for (const int index : indices) {
            const std::int64_t vertex =
                index > 0 ? std::int64_t{index} - 1
                          : static_cast<std::int64_t>(vertex_count_) + std::int64_t{index};
            if (vertex < 0 || vertex >= static_cast<std::int64_t>(vertex_total_)) {
                // A lenient check accepts indices that are too large.
                out_of_range_.add([&] {
                    return Warning{shown(path_), fmt::format("face with vertex {} of {}; left out",
                                                             index, vertex_total_)};
                });
                mesh_.faces.corners.resize(first);
                return;
            }
            mesh_.faces.corners.push_back(static_cast<std::uint32_t>(vertex));
        }
        if (options_.normals) {
            number_corners(
                first, std::span(checked_.corner_normals).subspan(first_checked, indices.size()));
        }
        mesh_.faces.corner_counts.push_back(static_cast<std::uint32_t>(indices.size()));
        mesh_.albedo.push_back(
            options_.textures
                ? textures_.add_face(
                      std::span(checked_.corner_texcoords).subspan(first_checked, indices.size()))
                : albedo_);
    }

    void use_material(std::string_view text) override {
        if (!options_.materials) return;
        const std::string name(trimmed(text, " \t"));
        const auto material = materials_.find(name);
        const Material used = material == materials_.end() ? Material{} : material->second;
        albedo_ = used.albedo;
        if (options_.textures) textures_.use(used);
        if (material == materials_.end() && unknown_names_.size() < kMaxNamesTold &&
            unknown_names_.insert(name).second) {
            unknown_.add([&] {
                return Warning{shown(path_),
                               fmt::format("material {} is in no library; faces that use it are "
                                           "grey",
                                           in_quotes(name))};
            });
        }
    }

    void material_library(const std::string& text) override {
        const std::string name(trimmed(text, " \t"));
        if (!options_.materials || name.empty()) return;
        fs::path file;
        std::string bytes;
        try {
            file = side_file(path_, name);
            if (!libraries_.insert(file.native()).second) return;
            bytes = read_input_file(file, kMaxMtlBytes);
        } catch (const Error& error) {
            if (error.kind() != ErrorKind::kBadInput) throw;
            unread_.add([&] {
                return Warning{shown(path_), fmt::format("{}; its materials are grey",
                                                         as_warning(error, shown(path_)).text)};
            });
            return;
        }
        read_mtl_text(bytes, file, shown(file), options_.lenient, options_.warn, materials_);
    }

    std::size_t vertex_count() const { return vertex_count_; }

    /// Once all statements have been read.
    void finish() {
        unread_.tell(options_.warn);
        unknown_.tell(options_.warn);
        out_of_range_.tell(options_.warn);
        textures_.finish(options_.warn);
        if (!has_normals_) mesh_.smooth = {};
    }

private:
    static constexpr std::size_t kMaxNamesTold = 1000;

    /// Gives the corners from `first` on, which have these normals, their numbers in mesh_.smooth.
    void number_corners(std::size_t first, std::span<const std::uint32_t> normals) {
        for (std::size_t i = 0; i < normals.size(); ++i) {
            const auto next = static_cast<std::uint32_t>(mesh_.smooth.size());
            std::uint32_t number = next;
            if (normals[i] != kNoAttribute) {
                has_normals_ = true;
                const auto& n = checked_.normals[normals[i]];
                const auto bits = [](float x) { return std::bit_cast<std::uint32_t>(x); };
                const Corner corner{mesh_.faces.corners[first + i], bits(n[0]), bits(n[1]),
                                    bits(n[2])};
                number = numbers_.try_emplace(corner, next).first->second;
            }
            mesh_.smooth.push_back(number);
        }
    }

    /// A position and the bits of a normal.
    struct Corner {
        std::uint32_t vertex;
        std::uint32_t x, y, z;
        bool operator==(const Corner&) const = default;
    };
    struct CornerHash {
        std::size_t operator()(const Corner& corner) const {
            return static_cast<std::size_t>(hash_of(corner));
        }
    };

    const fs::path& path_;
    const MeshFileOptions& options_;
    const CheckedObj& checked_;
    const std::size_t vertex_total_;
    const std::string name_;
    FileMesh& mesh_;
    ObjTextures textures_;
    std::size_t vertex_count_ = 0;
    std::unordered_map<Corner, std::uint32_t, CornerHash> numbers_;
    bool has_normals_ = false;
    /// Corners of the check that have passed.
    std::size_t next_checked_ = 0;
    Albedo albedo_ = kDefaultAlbedo;
    MaterialMap materials_;
    std::set<std::string> libraries_;
    std::set<std::string> unknown_names_;
    WarningCount unread_;
    WarningCount unknown_;
    WarningCount out_of_range_;
};

}  // namespace

FileMesh read_obj(const fs::path& path, const MeshFileOptions& options) {
    const std::string name = shown(path);
    HeldWarnings warnings;
    MeshFileOptions held = options;
    held.warn = warnings.keeper();

    std::string text = read_input_file(path);
    FileMesh mesh;
    CheckedObj checked = check_obj(text, name,
                                   {.lenient = held.lenient,
                                    .normals = held.normals,
                                    .texcoords = held.textures,
                                    .warn = held.warn});
    MeshBuilder builder(path, held, checked, mesh);
    parse_obj_text(text, builder);
    assert(builder.vertex_count() == checked.positions.size());
    assert(held.lenient || mesh.faces.corners.size() == checked.corner_count);
    builder.finish();
    mesh.positions = std::move(checked.positions);
    require_faces(mesh, name, "an OBJ file", held);

    warnings.tell(options.warn);
    return mesh;
}

}  // namespace mray
