#include "library/src/scene/pose_reader.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include "common/scene/camera_setup.h"
#include "cpu/scene_space/to_scene.h"
#include "library/src/scene/errors.h"

namespace morphray::detail {
namespace {

using mray::vec3;
using mray::WorldBounds;
using mray::cpu::MadePositions;
using Range = tbb::blocked_range<std::size_t>;

constexpr std::size_t kGrain = 8192;
constexpr std::size_t kReadRun = 256;

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
    vec3 run[kReadRun];
    for (; first < end; first += kReadRun) {
        const std::size_t count = std::min(kReadRun, end - first);
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

/// Reads vertices into this space. Returns whether one of its positions has changed.
bool PoseReader::read_of_mesh(const MeshVertices& range, mray::ThreadArena& arena) {
    const MeshSlot& mesh = *range.mesh;
    const std::span<vec3> scene =
        std::span(positions_).subspan(mesh.first_vertex, mesh.vertex_count());
    const auto for_each_read = [&](std::size_t first, std::size_t end, auto use) {
        mesh.for_each_used(first, end, [&](std::size_t from, std::size_t to) {
            for_each_run(mesh.positions, origin_, from, to, use);
        });
    };
    const MadePositions made = for_each_part(
        range.first, range.first + range.count, arena, [&](std::size_t first, std::size_t count) {
            MadePositions sum;
            for_each_read(first, first + count, [&](std::size_t at, std::span<const vec3> run) {
                sum.extend(
                    mray::cpu::make_positions(space_, target_, run, scene.subspan(at, run.size())));
            });
            return sum;
        });
    is_extended_ |= made.any_outside;
    auto kept = kept_.find(mesh.first_vertex);
    if (kept == kept_.end()) {
        if (made.all_invertible) return made.any_changed;
        kept =
            kept_.emplace(mesh.first_vertex, KeptPositions{std::vector<vec3>(scene.size())}).first;
        for (std::size_t i = 0; i < scene.size(); ++i)
            kept->second.world[i] = space_.to_world(scene[i]);
    }
    kept->second.any_left_out |= made.any_left_out;
    for_each_read(range.first, range.first + range.count,
                  [&](std::size_t at, std::span<const vec3> run) {
                      std::copy(run.begin(), run.end(), &kept->second.world[at]);
                  });
    return made.any_changed;
}

/// Calls use(first, run) for runs of vertices [begin, end) of a mesh as they were read.
template <class Use>
void PoseReader::for_each_world_run(const MeshSlot& mesh, std::size_t begin, std::size_t end,
                                    Use use) const {
    if (const auto kept = kept_.find(mesh.first_vertex); kept != kept_.end()) {
        use(begin, std::span(kept->second.world).subspan(begin, end - begin));
        return;
    }
    vec3 run[kReadRun];
    for (std::size_t first = begin; first < end; first += kReadRun) {
        const std::size_t count = std::min(kReadRun, end - first);
        for (std::size_t i = 0; i < count; ++i)
            run[i] = space_.to_world(positions_[mesh.first_vertex + first + i]);
        use(first, std::span<const vec3>(run, count));
    }
}

mray::PoseExtent PoseReader::extent_of(const MeshList& meshes, mray::ThreadArena& arena) const {
    mray::PoseExtent all;
    for (const MeshSlot& mesh : meshes.slots()) {
        if (!mesh.used) continue;
        all.extend(
            for_each_part(0, mesh.vertex_count(), arena, [&](std::size_t first, std::size_t count) {
                mray::PoseExtent part;
                mesh.for_each_used(first, first + count, [&](std::size_t from, std::size_t to) {
                    for_each_world_run(mesh, from, to,
                                       [&](std::size_t, auto run) { part.add(run); });
                });
                return part;
            }));
    }
    return all;
}

void PoseReader::move_to(const mray::SceneSpace& space, const MeshList& meshes,
                         mray::ThreadArena& arena) {
    std::map<std::uint32_t, KeptPositions> kept;
    for (const MeshSlot& mesh : meshes.slots()) {
        if (!mesh.used) continue;
        std::vector<vec3> world(mesh.vertex_count());
        const auto scene = std::span(positions_).subspan(mesh.first_vertex, world.size());
        const MadePositions made =
            for_each_part(0, world.size(), arena, [&](std::size_t first, std::size_t count) {
                MadePositions sum;
                mesh.for_each_used(first, first + count, [&](std::size_t from, std::size_t to) {
                    for_each_world_run(mesh, from, to, [&](std::size_t at, auto run) {
                        std::ranges::copy(run, &world[at]);
                        sum.extend(mray::cpu::make_positions(space, target_, run,
                                                             scene.subspan(at, run.size())));
                    });
                });
                return sum;
            });
        if (!made.all_invertible)
            kept.emplace(mesh.first_vertex, KeptPositions{std::move(world), made.any_left_out});
    }
    space_ = space;
    kept_ = std::move(kept);
}

/// Brings all positions into the space of the pose. Returns whether it is another one.
bool PoseReader::find_space(const MeshList& meshes, mray::ThreadArena& arena) {
    const mray::PoseExtent pose = extent_of(meshes, arena);
    if (bounds_.empty()) bounds_ = pose.bounds(pose.limit());
    const mray::SceneSpace space = mray::space_of_pose(bounds_, pose);
    is_extended_ = space != mray::SceneSpace(bounds_);
    if (space == space_) return false;
    move_to(space, meshes, arena);
    return true;
}

/// Brings the positions of meshes that were there before to their places.
void PoseReader::move_kept_meshes(const MeshList& meshes) {
    std::vector<KeptRange> runs;
    auto kept_before = std::exchange(kept_, {});
    for (const MeshSlot& mesh : meshes.slots()) {
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
    std::vector<MeshVertices> kept;
    for (const MeshSlot& mesh : meshes.slots()) {
        if (!mesh.used) continue;
        const MeshVertices all{&mesh, 0, mesh.vertex_count()};
        if (!mesh.vertex_before) {
            std::ranges::fill(std::span(positions_).subspan(mesh.first_vertex, all.count),
                              vec3(mray::kInvalidCoordinate));
            read_of_mesh(all, arena);
        } else if (mesh.deforms) {
            kept.push_back(all);
        }
    }
    return read(meshes, kept, arena);
}

std::vector<mray::IndexRange> PoseReader::read(const MeshList& meshes,
                                               std::span<const MeshVertices> vertices,
                                               mray::ThreadArena& arena) {
    std::vector<mray::IndexRange> changed;
    for (const MeshVertices& range : vertices) {
        const auto begin = static_cast<std::uint32_t>(range.mesh->first_vertex + range.first);
        const auto end = static_cast<std::uint32_t>(begin + range.count);
        if (read_of_mesh(range, arena)) changed.push_back({begin, end});
    }
    if (!is_extended_ && !bounds_.empty()) return changed;
    if (!find_space(meshes, arena)) return changed;
    return {{0, meshes.topology().vertex_count}};
}

std::vector<LeftOut> PoseReader::left_out(const MeshList& meshes) const {
    std::vector<LeftOut> all;
    for (std::uint32_t id = 0; id < meshes.slots().size(); ++id) {
        const MeshSlot& mesh = meshes.slots()[id];
        const auto kept = kept_.find(mesh.first_vertex);
        if (!mesh.used || kept == kept_.end() || !kept->second.any_left_out) continue;
        LeftOut one{.geom_id = id};
        mesh.for_each_used(0, mesh.vertex_count(), [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) {
                const vec3& world = kept->second.world[i];
                if (space_.keeps(world)) continue;
                ++(mray::all_finite(world) ? one.too_far : one.not_finite);
            }
        });
        if (one.not_finite + one.too_far > 0) all.push_back(one);
    }
    return all;
}

mray::vec3 PoseReader::world_position(std::uint32_t vertex) const {
    const auto after = kept_.upper_bound(vertex);
    if (after != kept_.begin()) {
        const auto& [first, positions] = *std::prev(after);
        if (vertex - first < positions.world.size()) return positions.world[vertex - first];
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

bool rounds_coarsely(const Positions& positions, const Point& origin) {
    return detail::with_public_errors([&] {
        if (!positions.has_doubles || positions.count == 0) return false;
        const mray::Origin from{{origin[0], origin[1], origin[2]}};
        // With a size of s and a farthest coordinate of f, coarse means that 2^-24 f > 1e-6 s. A
        // few positions have at least f - s, so that nothing is coarse if theirs is below 8 sizes.
        constexpr std::size_t kSampled = 16;
        const std::size_t step = std::max<std::size_t>(positions.count / kSampled, 1);
        glm::dvec3 lower = detail::load(positions, 0);
        glm::dvec3 upper = lower;
        for (std::size_t i = 0; i < positions.count; i += step) {
            const glm::dvec3 p = detail::load(positions, i);
            lower = glm::min(lower, p);
            upper = glm::max(upper, p);
        }
        const glm::dvec3 sides = upper - lower;
        const glm::dvec3 far = glm::max(glm::abs(lower - from.at), glm::abs(upper - from.at));
        const double size = std::max({sides.x, sides.y, sides.z});
        if (std::max({far.x, far.y, far.z}) <= 8 * size) return false;
        return from.rounds_coarsely(detail::doubles_of(positions));
    });
}

}  // namespace morphray
