#include "library/src/scene/pose_reader.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include "common/scene/camera_setup.h"
#include "library/src/scene/errors.h"

namespace morphray::detail {
namespace {

using mray::vec3;
using mray::WorldBounds;
using mray::cpu::MadePositions;
using Range = tbb::blocked_range<std::size_t>;

constexpr std::size_t kGrain = 8192;
constexpr std::size_t kReadRun = 256;

std::vector<glm::dvec3> doubles_of(const Positions& positions) {
    std::vector<glm::dvec3> doubles;
    if (!positions.has_doubles || positions.data == nullptr) return doubles;
    for (std::size_t i = 0; i < positions.count; ++i) doubles.push_back(load(positions, i));
    return doubles;
}

/// Calls `use(first, run)` for runs of up to kReadRun positions, in place if they are packed floats
/// of world space.
template <class Use>
void for_each_run(const MeshSlot& mesh, const mray::Origin& origin, std::size_t first,
                  std::size_t end, Use use) {
    const Positions& positions = mesh.positions;
    const auto* bytes = static_cast<const std::byte*>(positions.data);
    // By value, so that no store to `read` makes the compiler load the matrix again.
    const auto make = [&, transform = mesh.transform, rest = mesh.rest.data()](std::size_t i) {
        return transform ? mray::transform_point(*transform, rest[i])
                         : origin.to_world(load(positions, i));
    };
    const bool is_packed = !mesh.transform && positions.stride == sizeof(vec3) &&
                           !positions.has_doubles && origin == mray::Origin() &&
                           reinterpret_cast<std::uintptr_t>(bytes) % alignof(vec3) == 0;
    vec3 read[kReadRun];
    for (; first < end; first += kReadRun) {
        const std::size_t count = std::min(kReadRun, end - first);
        for (std::size_t i = 0; i < count && !is_packed; ++i) read[i] = make(first + i);
        const vec3* const run = is_packed ? reinterpret_cast<const vec3*>(bytes) + first : read;
        use(first, std::span(run, count));
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

/// Brings a run into a space, as vertices first, first + 1, ... of the pose.
MadePositions PoseReader::write(const mray::SceneSpace& space, std::size_t first,
                                std::span<const vec3> run) {
    // In the cache until the pose has compared it.
    vec3 scene[kReadRun];
    const MadePositions made =
        mray::cpu::make_positions(space, target_, run, std::span(scene, run.size()));
    pose_.write(first, std::span(scene, run.size()));
    return made;
}

void PoseReader::read_of_mesh(const MeshVertices& range, mray::ThreadArena& arena) {
    const MeshSlot& mesh = *range.mesh;
    const auto for_each_read = [&](std::size_t first, std::size_t end, auto use) {
        mesh.for_each_used(first, end, [&](std::size_t from, std::size_t to) {
            for_each_run(mesh, origin_, from, to, use);
        });
    };
    const MadePositions made = for_each_part(
        range.first, range.first + range.count, arena, [&](std::size_t first, std::size_t count) {
            MadePositions sum;
            for_each_read(first, first + count, [&](std::size_t at, std::span<const vec3> run) {
                sum.extend(write(space_, mesh.first_vertex + at, run));
            });
            return sum;
        });
    is_extended_ |= made.any_outside;
    const bool is_body = mesh.transform && mesh.rest_is_normal && !made.any_left_out &&
                         range.count == mesh.rest.size() &&
                         mray::moves_alike_on_devices(*mesh.transform, space_);
    if (is_body)
        pose_.add_body({mesh.first_vertex, mesh.rest, mesh.rest_version, *mesh.transform, space_});
    auto kept = kept_.find(mesh.first_vertex);
    if (kept == kept_.end()) {
        if (made.all_invertible) return;
        std::vector<vec3> world(mesh.vertex_count());
        for (std::size_t i = 0; i < world.size(); ++i)
            world[i] = space_.to_world(positions()[mesh.first_vertex + i]);
        kept = kept_.emplace(mesh.first_vertex, KeptPositions{std::move(world)}).first;
    }
    kept->second.any_left_out |= made.any_left_out;
    for_each_read(range.first, range.first + range.count,
                  [&](std::size_t at, std::span<const vec3> run) {
                      std::copy(run.begin(), run.end(), &kept->second.world[at]);
                  });
}

/// Calls use(first, run) for runs of vertices [begin, end) of a mesh as they were read.
template <class Use>
void PoseReader::for_each_world_run(const MeshSlot& mesh, std::size_t begin, std::size_t end,
                                    Use use) const {
    const auto kept = kept_.find(mesh.first_vertex);
    const bool is_kept = kept != kept_.end();
    vec3 inverted[kReadRun];
    for (std::size_t first = begin; first < end; first += kReadRun) {
        const std::size_t count = std::min(kReadRun, end - first);
        for (std::size_t i = 0; i < count && !is_kept; ++i)
            inverted[i] = space_.to_world(positions()[mesh.first_vertex + first + i]);
        const vec3* const run = is_kept ? &kept->second.world[first] : inverted;
        use(first, std::span(run, count));
    }
}

void PoseReader::move_to(const mray::SceneSpace& space, const MeshList& meshes,
                         mray::ThreadArena& arena) {
    std::map<std::uint32_t, KeptPositions> kept;
    for (const MeshSlot& mesh : meshes.slots()) {
        if (!mesh.used) continue;
        std::vector<vec3> world(mesh.vertex_count());
        const MadePositions made =
            for_each_part(0, world.size(), arena, [&](std::size_t first, std::size_t count) {
                MadePositions sum;
                mesh.for_each_used(first, first + count, [&](std::size_t from, std::size_t to) {
                    for_each_world_run(mesh, from, to, [&](std::size_t at, auto run) {
                        std::ranges::copy(run, &world[at]);
                        sum.extend(write(space, mesh.first_vertex + at, run));
                    });
                });
                return sum;
            });
        if (!made.all_invertible)
            kept.emplace(mesh.first_vertex, KeptPositions{std::move(world), made.any_left_out});
    }
    space_ = space;
    pose_.forget_bodies();
    kept_ = std::move(kept);
}

/// Brings all positions into the space of the pose.
void PoseReader::find_space(const MeshList& meshes, mray::ThreadArena& arena) {
    mray::PoseExtent pose;
    std::vector<WorldBounds> parts;
    for (const MeshSlot& mesh : meshes.slots()) {
        if (!mesh.used) continue;
        const auto extent_of = [&](std::size_t first, std::size_t count) {
            mray::PoseExtent extent;
            mesh.for_each_used(first, first + count, [&](std::size_t from, std::size_t to) {
                for_each_world_run(mesh, from, to, [&](std::size_t, auto run) { extent.add(run); });
            });
            return extent;
        };
        const mray::PoseExtent part = for_each_part(0, mesh.vertex_count(), arena, extent_of);
        pose.extend(part);
        parts.push_back(part.bounds(part.limit()));
    }
    if (bounds_.empty()) bounds_ = mray::bounds_of_parts(pose, std::move(parts));
    const mray::SceneSpace space = mray::space_of_pose(bounds_, pose);
    is_extended_ = space != mray::SceneSpace(bounds_);
    if (space != space_) move_to(space, meshes, arena);
}

void PoseReader::read_list(const MeshList& meshes, mray::ThreadArena& arena) {
    // The positions of meshes that were there before, and none of the others.
    std::vector<vec3> placed(meshes.topology().vertex_count, vec3(mray::kInvalidCoordinate));
    auto kept_before = std::exchange(kept_, {});
    for (const MeshSlot& mesh : meshes.slots()) {
        if (!mesh.used || !mesh.vertex_before || mesh.vertex_count() == 0) continue;
        std::ranges::copy(positions().subspan(*mesh.vertex_before, mesh.vertex_count()),
                          &placed[mesh.first_vertex]);
        if (const auto kept = kept_before.find(*mesh.vertex_before); kept != kept_before.end())
            kept_.emplace(mesh.first_vertex, std::move(kept->second));
    }
    pose_ = mray::Pose(std::move(placed));
    std::vector<MeshVertices> all;
    for (const MeshSlot& mesh : meshes.slots()) {
        if ((mesh.used && !mesh.vertex_before) || mesh.follows_positions())
            all.push_back({&mesh, 0, mesh.vertex_count()});
    }
    read(meshes, all, arena);
    for (const MeshSlot& mesh : meshes.slots()) {
        const auto found = kept_.find(mesh.first_vertex);
        if (mesh.used && found != kept_.end())
            found->second.too_small = count_too_small(mesh, meshes.topology());
    }
}

void PoseReader::read(const MeshList& meshes, std::span<const MeshVertices> vertices,
                      mray::ThreadArena& arena) {
    pose_.begin_move();
    for (const MeshVertices& range : vertices) read_of_mesh(range, arena);
    if (is_extended_ || bounds_.empty()) find_space(meshes, arena);
}

std::vector<LeftOut> PoseReader::left_out(const MeshList& meshes) const {
    std::vector<LeftOut> all;
    for (std::uint32_t id = 0; id < meshes.slots().size(); ++id) {
        const MeshSlot& mesh = meshes.slots()[id];
        const auto kept = kept_.find(mesh.first_vertex);
        if (!mesh.used || kept == kept_.end()) continue;
        LeftOut one{.geom_id = id, .too_small = kept->second.too_small};
        const std::size_t count = kept->second.any_left_out ? mesh.vertex_count() : 0;
        mesh.for_each_used(0, count, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) {
                const vec3& world = kept->second.world[i];
                if (space_.keeps(world)) continue;
                ++(mray::all_finite(world) ? one.too_far : one.not_finite);
            }
        });
        if (one.not_finite + one.too_far + one.too_small > 0) all.push_back(one);
    }
    return all;
}

/// Triangles of a mesh that is kept whose area is lost in the steps of scene space.
std::uint64_t PoseReader::count_too_small(const MeshSlot& mesh,
                                          const mray::Topology& topology) const {
    constexpr float kFewSteps = 0x1p-38f;
    const std::vector<vec3>& world = kept_.at(mesh.first_vertex).world;
    const auto is_too_small = [&](const mray::uvec3& t) {
        const vec3 a = positions()[t.x];
        const vec3 b = positions()[t.y];
        const vec3 c = positions()[t.z];
        const vec3 size = glm::max(glm::abs(b - a), glm::abs(c - a));
        if (std::max({size.x, size.y, size.z}) > kFewSteps) return false;
        if (a.x == mray::kInvalidCoordinate || mray::has_area(a, b, c)) return false;
        const glm::dvec3 p = world[t.x - mesh.first_vertex];
        return glm::cross(glm::dvec3(world[t.y - mesh.first_vertex]) - p,
                          glm::dvec3(world[t.z - mesh.first_vertex]) - p) != glm::dvec3(0.0);
    };
    const std::span triangles =
        std::span(topology.triangles).subspan(mesh.first_prim, mesh.prim_count);
    return static_cast<std::uint64_t>(std::ranges::count_if(triangles, is_too_small));
}

mray::vec3 PoseReader::world_position(std::uint32_t vertex) const {
    const auto after = kept_.upper_bound(vertex);
    if (after != kept_.begin()) {
        const auto& [first, positions] = *std::prev(after);
        if (vertex - first < positions.world.size()) return positions.world[vertex - first];
    }
    return space_.to_world(positions()[vertex]);
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
