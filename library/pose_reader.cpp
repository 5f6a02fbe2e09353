#include "library/pose_reader.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>

#include "cpu/scene_space/scene_positions.h"

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

void extend(WorldBounds& bounds, const WorldBounds& other) {
    if (!other.empty()) bounds.extend(other.lower, other.upper);
}

/// Calls `use(first, run)` for runs of positions first, first + 1, ..., in place if they are
/// packed.
template <class Use>
void for_each_run(const Positions& positions, std::size_t first, std::size_t end, Use use) {
    const auto* bytes = static_cast<const std::byte*>(positions.data);
    if (positions.stride == sizeof(vec3) &&
        reinterpret_cast<std::uintptr_t>(bytes) % alignof(vec3) == 0) {
        const auto* packed = reinterpret_cast<const vec3*>(bytes);
        if (first < end) use(first, std::span(packed + first, end - first));
        return;
    }
    constexpr std::size_t kRun = 256;
    vec3 run[kRun];
    for (; first < end; first += kRun) {
        const std::size_t count = std::min(kRun, end - first);
        for (std::size_t i = 0; i < count; ++i) run[i] = load(positions, first + i);
        use(first, std::span<const vec3>(run, count));
    }
}

WorldBounds bounds_of(const Positions& positions, std::size_t first, std::size_t end) {
    WorldBounds bounds;
    for_each_run(positions, first, end, [&](std::size_t, std::span<const vec3> run) {
        extend(bounds, mray::bounds_of(run));
    });
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

PoseReader::PoseReader(const std::optional<Box>& bounds, const mray::SimdTarget& target)
    : bounds_(to_bounds(bounds)), space_(bounds_), target_(target) {}

/// Writes the pieces in this space. Returns whether one of their positions is outside its range.
bool PoseReader::convert(std::span<const Piece> pieces, const mray::SceneSpace& space,
                         mray::ThreadArena& arena) {
    const mray::cpu::ScenePositionMaker maker(space, target_);
    bool any_outside = false;
    for (const Piece& piece : pieces) {
        vec3* const out = positions_.data() + piece.mesh->first_vertex;
        const Positions& in = piece.mesh->positions;
        const auto convert_range = [&](const Range& range, bool outside) {
            for_each_run(in, range.begin(), range.end(),
                         [&](std::size_t first, std::span<const vec3> run) {
                             outside |= maker.make(run, {out + first, run.size()});
                         });
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
