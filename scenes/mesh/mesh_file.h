// A mesh as a file has it, and the rules for vertices and faces that all formats share.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <optional>
#include <unordered_map>

#include "common/base/errors.h"
#include "common/base/hash.h"
#include "common/scene/mesh.h"
#include "common/scene/scene_space.h"
#include "scenes/polygons/triangulate.h"

namespace mray {

struct MeshFileOptions {
    /// Accept bad coordinates and leave out faces that cannot be read, with a warning each.
    bool lenient = false;
    /// Leave out colours, material libraries, normals and textures.
    bool positions_only = false;
    /// The animation's; nothing: found by origin_of().
    std::optional<Origin> origin = {};
    WarnFunction warn = {};
};

/// The albedo of triangles without material: clay, which no part of the background looks like.
inline constexpr Albedo kClay = 0x0033548A;

/// The faces of the file that have three corners or more, in their order.
struct FileMesh {
    Origin origin;
    /// True if that origin was given, and is too far away.
    bool is_coarse = false;
    /// Each vertex of the file, in world space (Origin::to_world()).
    std::vector<vec3> positions;
    Polygons faces;
    /// For each face of more than three corners its line, or in binary data its byte.
    std::vector<std::uint64_t> polygon_places;
    /// What stands before them in messages: "mesh.obj:" or "mesh.ply: byte ".
    std::string place_prefix;
    /// One for each face, or for the first of them; kClay for all others.
    std::vector<Albedo> albedo;
    /// Linear colours, or empty. Triangles that `albedo` leaves kClay have the mean of their three.
    std::vector<vec3> vertex_colours;
    /// A number for each corner; equal ones have equal positions and normals. Empty without
    /// normals.
    std::vector<std::uint32_t> smooth;
    /// The textures that faces use. If there are none, the arrays below are empty, too.
    std::vector<TextureFile> textures;
    /// For each face an index of `textures`, or kNoTexture.
    std::vector<std::uint32_t> face_textures;
    /// For each corner of `faces`; 0 where a face has no texture.
    std::vector<Texcoord> texcoords;
};

/// Sets the origin and the positions of a mesh from the coordinates of its file.
void set_positions(FileMesh& mesh, std::span<const glm::dvec3> file,
                   const MeshFileOptions& options);

/// `name` is the file and `kind` its format in the message: "an OBJ file".
void require_faces(const FileMesh& mesh, const std::string& name, std::string_view kind);

/// Keeps the first warning of a kind and counts the rest, however many a file has.
class WarningCount {
public:
    /// Formats the first warning only. `place` is a text, or a function that returns it.
    template <class Place, class... Values>
    void add(const Place& place, fmt::format_string<Values...> text, Values&&... values) {
        if (count_++ > 0) return;
        first_.text = fmt::format(text, std::forward<Values>(values)...);
        if constexpr (std::is_invocable_v<const Place&>)
            first_.place = place();
        else
            first_.place = place;
    }
    /// Calls work(), whose Error(kBadInput) about `file` becomes a warning that ends with `effect`.
    template <class Work>
    void catch_fault(const std::string& file, const char* effect, const Work& work) {
        try {
            work();
        } catch (const Error& error) {
            if (error.kind() != ErrorKind::kBadInput) throw;
            const Warning fault = as_warning(error, file);
            add(fault.place, "{}{}", fault.text, effect);
        }
    }
    void tell(const WarnFunction& warn) const {
        if (count_ > 0 && warn) warn({first_.place, first_.text, first_.hint, count_ - 1});
    }

private:
    Warning first_;
    std::uint64_t count_ = 0;
};

/// Removes the first word and the blanks before it; empty if there is none.
inline std::string_view take_word(std::string_view& rest) {
    const auto is_blank = [](char c) { return c == ' ' || c == '\t'; };
    const auto* const begin = std::find_if_not(rest.begin(), rest.end(), is_blank);
    const auto* const end = std::find_if(begin, rest.end(), is_blank);
    rest = {end, static_cast<std::size_t>(rest.end() - end)};
    return {begin, static_cast<std::size_t>(end - begin)};
}

/// Returns where a reader is, such as "mesh.obj:12".
using PlaceText = std::function<std::string()>;

/// Divides a channel of a colour by `full`. Clamps others than 0 to `full`, with a warning.
double channel_of(double value, double full, WarningCount& clamped, const PlaceText& place);

/// Coordinates beyond this are refused like infinite ones; diverging simulations write them.
inline constexpr float kMaxCoordinate = 1e30f;

/// Checks vertices and faces while a file is read, and counts what a lenient reading accepts.
class MeshRules {
public:
    MeshRules(bool lenient, PlaceText place) : lenient_(lenient), place_(std::move(place)) {}

    /// False for NaN, too.
    static bool is_good(float coordinate) { return std::abs(coordinate) <= kMaxCoordinate; }
    /// Lets what is rounded to the limit through, too.
    static bool is_good(double coordinate) {
        return std::abs(coordinate) <= double{kMaxCoordinate} * (1 + 0x1p-25);
    }
    static bool is_good(const vec3& p) { return is_good(p.x) && is_good(p.y) && is_good(p.z); }
    static bool are_good(std::span<const vec3> positions);
    /// Throws Error(kBadInput) about the first vertex of a frame that is not good. If lenient,
    /// returns a warning.
    static std::optional<Warning> check_frame(const std::string& file, double frame,
                                              std::span<const vec3> positions, bool lenient);
    /// Throws Error(kBadInput), or warns if lenient. `text` is the number in the file.
    void take_bad_coordinate(double value, std::string_view text);
    /// Leaves out faces of two corners, as which exporters write edges, with a warning. Unless
    /// lenient, throws Error(kBadInput) for fewer, and for two if `is_cut`: the file may end there.
    bool keeps_face(std::uint64_t corners, bool is_cut = false);
    /// Throws Error(kLimit) if there are more than kMaxTriangles.
    void count_triangles(std::uint64_t count);
    /// A face that cannot be read: throws Error(kBadInput), or counts a warning if lenient.
    void leave_out(const std::string& problem);
    double channel_of(double value, double full) {
        return mray::channel_of(value, full, clamped_, place_);
    }
    void tell(const WarnFunction& warn) const;

private:
    const bool lenient_;
    const PlaceText place_;
    std::uint64_t triangle_count_ = 0;
    WarningCount left_out_, bad_coordinates_, clamped_;
};

/// Numbers corners: those with equal positions and normals have the number of the first of them.
class SmoothNumbers {
public:
    static constexpr std::uint32_t kNone = 0xFFFFFFFFu;
    /// A position, or a vertex and zeros, and a normal.
    using Key = std::array<std::uint32_t, 6>;

    /// Adding 0 gives -0 the bits of 0.
    static std::uint32_t bits(float x) { return std::bit_cast<std::uint32_t>(x + 0.0f); }

    std::uint32_t number_of(const Key& key, std::uint32_t corner) {
        return firsts_.try_emplace(key, corner).first->second;
    }
    /// The corners of a vertex share `number`, which is kNone before the first of them.
    std::uint32_t number_of(std::uint32_t& number, const vec3& p, const vec3& normal,
                            std::uint32_t corner) {
        if (number == kNone) {
            number = number_of(
                {bits(p.x), bits(p.y), bits(p.z), bits(normal.x), bits(normal.y), bits(normal.z)},
                corner);
        }
        return number;
    }

private:
    struct KeyHash {
        std::size_t operator()(const Key& key) const {
            return static_cast<std::size_t>(hash_of(key));
        }
    };
    std::unordered_map<Key, std::uint32_t, KeyHash> firsts_;
};

/// The linear value of a channel of images, as its square.
inline double linear_of(double channel) {
    const auto c = static_cast<float>(channel);
    return static_cast<double>(c * c);
}

/// Returns the message for a text that is no number: what is wrong with it, and what to do.
std::string not_a_number(std::string_view text);

}  // namespace mray
