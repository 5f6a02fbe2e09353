#include "library/src/scene/pose_reader.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <iterator>
#include <utility>

#include "cpu/scene_space/to_scene.h"
#include "library/src/scene/errors.h"

namespace morphray::detail {
namespace {

using mray::vec3;
using mray::WorldBounds;
using mray::cpu::MadePositions;
using Range = tbb::blocked_range<std::size_t>;

constexpr std::size_t kGrain = 8192;

/// Vertex i, which may lie at any address.
glm::dvec3 load(const Positions& positions, std::size_t i) {
    const auto* const from = static_cast<const std::byte*>(positions.data) + i * positions.stride;
    if (positions.has_doubles) {
        glm::dvec3 p;
        std::memcpy(&p, from, sizeof(p));
        return p;
    }
    vec3 p;
    std::memcpy(&p, from, sizeof(p));
    return p;
}

std::vector<glm::dvec3> doubles_of(const Positions& positions) {
    std::vector<glm::dvec3> doubles;
    if (!positions.has_doubles || positions.data == nullptr) return doubles;
    for (std::size_t i = 0; i < positions.count; ++i) doubles.push_back(load(positions, i));
    return doubles;
}

/// Calls `use(first, run)` for runs of positions first, first + 1, ..., in place if they are
/// packed floats of world space.
template <class Use>
void for_each_run(const Positions& positions, const mray::Origin& origin, std::size_t first,
                  std::size_t end, Use use) {
    const auto* bytes = static_cast<const std::byte*>(positions.data);
    if (positions.stride == sizeof(vec3) && !positions.has_doubles && origin == mray::Origin() &&
        reinterpret_cast<std::uintptr_t>(bytes) % alignof(vec3) == 0) {
        const auto* packed = reinterpret_cast<const vec3*>(bytes);
        if (first < end) use(first, std::span(packed + first, end - first));
        return;
    }
    constexpr std::size_t kRun = 256;
    vec3 run[kRun];
    for (; first < end; first += kRun) {
        const std::size_t count = std::min(kRun, end - first);
        for (std::size_t i = 0; i < count; ++i)
            run[i] = origin.to_world(load(positions, first + i));
        use(first, std::span<const vec3>(run, count));
    }
}

/// Calls `work(first, count)` for parts of [begin, end) in threads; joins results by extend().
template <class Work>
auto for_each_part(std::size_t begin, std::size_t end, mray::ThreadArena& arena, Work work) {
    using Sum = decltype(work(begin, end));
    if (end - begin <= kGrain) return work(begin, end - begin);
    return arena.execute([&] {
        return tbb::parallel_reduce(
            Range(begin, end, kGrain), Sum{},
            [&](const Range& range, Sum sum) {
                sum.extend(work(range.begin(), range.size()));
                return sum;
            },
            [](Sum a, const Sum& b) {
                a.extend(b);
                return a;
            });
    });
}

WorldBounds bounds_of_all(std::span<const vec3> points, mray::ThreadArena& arena) {
    return for_each_part(0, points.size(), arena, [&](std::size_t first, std::size_t count) {
        return mray::bounds_of(points.subspan(first, count));
    });
}

WorldBounds to_bounds(const std::optional<Box>& box, const mray::Origin& origin) {
    if (!box) return {};
    const auto& [lower, upper] = *box;
    return {glm::dvec3(lower[0], lower[1], lower[2]) - origin.at,
            glm::dvec3(upper[0], upper[1], upper[2]) - origin.at};
}

}  // namespace

PoseReader::PoseReader(const std::optional<Box>& bounds, const Point& origin,
                       const mray::SimdTarget& target)
    : origin_{{origin[0], origin[1], origin[2]}},
      bounds_(to_bounds(bounds, origin_)),
      space_(bounds_),
      target_(target) {}

/// Reads a piece into this space. Returns whether one of its positions has changed.
bool PoseReader::read_piece(const Piece& piece, mray::ThreadArena& arena) {
    const MeshPlace& mesh = *piece.mesh;
    const std::span<vec3> scene =
        std::span(positions_).subspan(mesh.first_vertex, mesh.vertex_count());
    const MadePositions made = for_each_part(
        piece.first, piece.first + piece.count, arena, [&](std::size_t first, std::size_t count) {
            MadePositions sum;
            for_each_run(mesh.positions, origin_, first, first + count,
                         [&](std::size_t at, std::span<const vec3> run) {
                             sum.extend(mray::cpu::make_positions(space_, target_, run,
                                                                  scene.subspan(at, run.size())));
                         });
            return sum;
        });
    is_extended_ |= made.any_outside;
    auto kept = kept_.find(mesh.first_vertex);
    if (kept == kept_.end()) {
        if (made.all_invertible) return made.any_changed;
        kept = kept_.emplace(mesh.first_vertex, scene.size()).first;
        for (std::size_t i = 0; i < scene.size(); ++i) kept->second[i] = space_.to_world(scene[i]);
    }
    for_each_run(mesh.positions, origin_, piece.first, piece.first + piece.count,
                 [&](std::size_t at, std::span<const vec3> run) {
                     std::copy(run.begin(), run.end(), &kept->second[at]);
                 });
    return made.any_changed;
}

std::vector<vec3> PoseReader::world_positions(const MeshList& meshes) const {
    std::vector<vec3> world(positions_.size());
    for (const MeshPlace& mesh : meshes.places()) {
        if (!mesh.used) continue;
        const std::size_t begin = mesh.first_vertex;
        if (const auto kept = kept_.find(mesh.first_vertex); kept != kept_.end()) {
            std::copy(kept->second.begin(), kept->second.end(), &world[begin]);
            continue;
        }
        for (std::size_t i = begin; i < begin + mesh.vertex_count(); ++i)
            world[i] = space_.to_world(positions_[i]);
    }
    return world;
}

/// Makes the space that of `bounds`, with all positions in it. Returns whether one is outside.
bool PoseReader::convert_all(const MeshList& meshes, std::span<const vec3> world,
                             const WorldBounds& bounds, mray::ThreadArena& arena) {
    space_ = mray::SceneSpace(bounds);
    kept_.clear();
    bool any_outside = false;
    for (const MeshPlace& mesh : meshes.places()) {
        if (!mesh.used) continue;
        const auto in = world.subspan(mesh.first_vertex, mesh.vertex_count());
        const auto out = std::span(positions_).subspan(mesh.first_vertex, mesh.vertex_count());
        const MadePositions made =
            for_each_part(0, in.size(), arena, [&](std::size_t first, std::size_t count) {
                return mray::cpu::make_positions(space_, target_, in.subspan(first, count),
                                                 out.subspan(first, count));
            });
        any_outside |= made.any_outside;
        if (!made.all_invertible)
            kept_.emplace(mesh.first_vertex, std::vector<vec3>(in.begin(), in.end()));
    }
    return any_outside;
}

/// Finds the space of the positions, and brings them into it.
void PoseReader::find_space(const MeshList& meshes, mray::ThreadArena& arena) {
    const std::vector<vec3> world = world_positions(meshes);
    if (bounds_.empty()) bounds_ = bounds_of_all(world, arena);
    is_extended_ = convert_all(meshes, world, bounds_, arena);
    if (!is_extended_) return;
    WorldBounds extended = bounds_;
    extended.extend(bounds_of_all(world, arena));
    convert_all(meshes, world, extended, arena);
}

/// Brings the positions of meshes that were there before to their places.
void PoseReader::move_kept_meshes(const MeshList& meshes) {
    std::vector<KeptRun> runs;
    auto kept_before = std::exchange(kept_, {});
    for (const MeshPlace& mesh : meshes.places()) {
        if (!mesh.used || !mesh.vertex_before || mesh.vertex_count() == 0) continue;
        runs.push_back({*mesh.vertex_before, mesh.first_vertex, mesh.vertex_count()});
        if (const auto kept = kept_before.find(*mesh.vertex_before); kept != kept_before.end())
            kept_.emplace(mesh.first_vertex, std::move(kept->second));
    }
    move_kept(positions_, runs, meshes.topology().vertex_count);
}

std::vector<mray::IndexRange> PoseReader::read_list(const MeshList& meshes,
                                                    mray::ThreadArena& arena) {
    move_kept_meshes(meshes);
    std::vector<Piece> kept;
    for (const MeshPlace& mesh : meshes.places()) {
        if (!mesh.used) continue;
        const Piece all{&mesh, 0, mesh.vertex_count()};
        if (!mesh.vertex_before) {
            read_piece(all, arena);
        } else if (mesh.deforms) {
            kept.push_back(all);
        }
    }
    return read_pieces(meshes, kept, arena);
}

std::vector<mray::IndexRange> PoseReader::read_pieces(const MeshList& meshes,
                                                      std::span<const Piece> pieces,
                                                      mray::ThreadArena& arena) {
    std::vector<mray::IndexRange> changed;
    for (const Piece& piece : pieces) {
        const auto begin = static_cast<std::uint32_t>(piece.mesh->first_vertex + piece.first);
        const auto end = static_cast<std::uint32_t>(begin + piece.count);
        if (read_piece(piece, arena)) changed.push_back({begin, end});
    }
    if (!is_extended_ && !bounds_.empty()) return changed;
    find_space(meshes, arena);
    return {{0, meshes.topology().vertex_count}};
}

mray::vec3 PoseReader::world_position(std::uint32_t vertex) const {
    const auto after = kept_.upper_bound(vertex);
    if (after != kept_.begin()) {
        const auto& [first, positions] = *std::prev(after);
        if (vertex - first < positions.size()) return positions[vertex - first];
    }
    return space_.to_world(positions_[vertex]);
}

}  // namespace morphray::detail

namespace morphray {

Point find_origin(const Positions& positions) {
    return detail::with_public_errors([&] {
        const glm::dvec3 at = mray::origin_of(detail::doubles_of(positions)).at;
        return Point{at.x, at.y, at.z};
    });
}

double rounding_error(const Positions& positions, const Point& origin) {
    return detail::with_public_errors([&] {
        const mray::Origin from{{origin[0], origin[1], origin[2]}};
        return from.rounding_of(detail::doubles_of(positions));
    });
}

}  // namespace morphray
