#include "library/pose_reader.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include <cmath>
#include <cstddef>
#include <cstring>
#include <functional>

namespace morphray::detail {
namespace {

using mray::vec3;
using mray::WorldBounds;
using Range = tbb::blocked_range<std::size_t>;

// Vertices a task.
constexpr std::size_t kGrain = 8192;

/// Vertex i, which may lie at any address.
vec3 load(const Positions& positions, std::size_t i) {
    vec3 p;
    std::memcpy(&p, static_cast<const std::byte*>(positions.data) + i * positions.stride,
                sizeof(p));
    return p;
}

/// Whether a position lies outside the range of scene space. One that is not finite does not.
bool is_outside(vec3 world, vec3 scene) {
    if (!std::isfinite(world.x) || !std::isfinite(world.y) || !std::isfinite(world.z)) return false;
    return !(std::abs(scene.x) <= mray::kSceneExtent && std::abs(scene.y) <= mray::kSceneExtent &&
             std::abs(scene.z) <= mray::kSceneExtent);
}

void extend(WorldBounds& bounds, const WorldBounds& other) {
    if (!other.empty()) bounds.extend(other.lower, other.upper);
}

WorldBounds bounds_of(const Positions& positions, std::size_t first, std::size_t end) {
    // Small runs of positions on the stack: the strided ones are no span of vec3.
    constexpr std::size_t kRun = 256;
    vec3 run[kRun];
    WorldBounds bounds;
    while (first < end) {
        const std::size_t count = std::min(kRun, end - first);
        for (std::size_t i = 0; i < count; ++i) run[i] = load(positions, first + i);
        extend(bounds, mray::bounds_of(std::span<const vec3>(run, count)));
        first += count;
    }
    return bounds;
}

WorldBounds bounds_of_all(const MeshList& meshes, mray::ThreadArena& arena) {
    WorldBounds all;
    for (const MeshPlace& mesh : meshes.places()) {
        if (!mesh.used) continue;
        extend(all, arena.execute([&] {
            return tbb::parallel_reduce(
                Range(0, mesh.positions.count, kGrain), WorldBounds{},
                [&](const Range& range, WorldBounds bounds) {
                    extend(bounds, bounds_of(mesh.positions, range.begin(), range.end()));
                    return bounds;
                },
                [](WorldBounds a, const WorldBounds& b) {
                    extend(a, b);
                    return a;
                });
        }));
    }
    return all;
}

WorldBounds to_bounds(const std::optional<Box>& box) {
    WorldBounds bounds;
    if (!box) return bounds;
    bounds.extend(box->lower.data(), box->upper.data());
    return bounds;
}

}  // namespace

PoseReader::PoseReader(const std::optional<Box>& bounds)
    : bounds_(to_bounds(bounds)), space_(bounds_) {}

/// Writes the pieces in this space. Returns whether one of their positions is outside its range.
bool PoseReader::convert(std::span<const Piece> pieces, const mray::SceneSpace& space,
                         mray::ThreadArena& arena) {
    bool any_outside = false;
    for (const Piece& piece : pieces) {
        vec3* const out = positions_.data() + piece.mesh->first_vertex;
        const Positions& in = piece.mesh->positions;
        const auto convert_range = [&](const Range& range, bool outside) {
            for (std::size_t i = range.begin(); i < range.end(); ++i) {
                const vec3 world = load(in, i);
                out[i] = space.to_scene(world);
                outside |= is_outside(world, out[i]);
            }
            return outside;
        };
        const Range all(piece.first, piece.first + piece.count, kGrain);
        if (piece.count <= kGrain) {
            any_outside |= convert_range(all, false);
        } else {
            any_outside |= arena.execute([&] {
                return tbb::parallel_reduce(all, false, convert_range, std::logical_or<>());
            });
        }
    }
    return any_outside;
}

void PoseReader::read_all(const MeshList& meshes, mray::ThreadArena& arena) {
    positions_.resize(meshes.topology().vertex_count);
    std::vector<Piece> pieces;
    for (const MeshPlace& mesh : meshes.places()) {
        if (mesh.used) pieces.push_back({&mesh, 0, mesh.positions.count});
    }
    if (bounds_.empty()) bounds_ = bounds_of_all(meshes, arena);
    space_ = mray::SceneSpace(bounds_);
    is_extended_ = convert(pieces, space_, arena);
    if (!is_extended_) return;
    WorldBounds extended = bounds_;
    extend(extended, bounds_of_all(meshes, arena));
    space_ = mray::SceneSpace(extended);
    convert(pieces, space_, arena);
}

std::vector<mray::IndexRange> PoseReader::read_pieces(const MeshList& meshes,
                                                      std::span<const Piece> pieces,
                                                      mray::ThreadArena& arena) {
    if (is_extended_ || bounds_.empty() || convert(pieces, space_, arena)) {
        read_all(meshes, arena);
        return {{0, meshes.topology().vertex_count}};
    }
    std::vector<mray::IndexRange> ranges;
    for (const Piece& piece : pieces) {
        const auto begin = static_cast<std::uint32_t>(piece.mesh->first_vertex + piece.first);
        const auto end = static_cast<std::uint32_t>(begin + piece.count);
        if (begin < end) ranges.push_back({begin, end});
    }
    return ranges;
}

std::vector<mray::IndexRange> PoseReader::read_deforming(const MeshList& meshes,
                                                         mray::ThreadArena& arena) {
    std::vector<Piece> pieces;
    for (const MeshPlace& mesh : meshes.places()) {
        if (mesh.used && mesh.deforms) pieces.push_back({&mesh, 0, mesh.positions.count});
    }
    return read_pieces(meshes, pieces, arena);
}

std::vector<mray::IndexRange> PoseReader::read(const MeshList& meshes, const MeshPlace& mesh,
                                               std::size_t first, std::size_t count,
                                               mray::ThreadArena& arena) {
    const Piece piece{&mesh, first, count};
    return read_pieces(meshes, {&piece, 1}, arena);
}

}  // namespace morphray::detail
