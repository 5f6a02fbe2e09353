#include "library/mesh_list.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/interop/lit.h"
#include "common/scene/vertex_normals.h"
#include "library/errors.h"

namespace morphray::detail {
namespace {

constexpr std::uint64_t kMostVertices = 0xFFFFFFF0u;
constexpr std::uint64_t kMostTriangles = std::uint64_t{1} << 28;

bool is_smooth_by_vertex(const MeshView& mesh) {
    return !mesh.smooth.empty() && mesh.smooth.data() == mesh.triangles.data();
}

void check(const MeshView& mesh) {
    const Positions& positions = mesh.positions;
    if (positions.count > 0 && positions.data == nullptr)
        throw_bad_argument("positions: no data, but a count above 0");
    if (positions.count > 1 && positions.stride < sizeof(Vec3)) {
        throw_bad_argument(
            fmt::format("positions: a stride of {} bytes; three floats take 12", positions.stride));
    }
    if (positions.count > kMostVertices)
        throw Error(ErrorCode::limit, fmt::format("positions: {} are too many", positions.count));
    if (mesh.triangles.size() % 3 != 0) {
        throw Error(ErrorCode::bad_input,
                    fmt::format("triangles: {} indices, which is not a multiple of 3",
                                mesh.triangles.size()));
    }
    const std::size_t count = mesh.triangles.size() / 3;
    if (count > kMostTriangles) {
        throw Error(ErrorCode::limit,
                    fmt::format("triangles: {}, but at most 2^28 are possible", count));
    }
    if (!mesh.albedo.empty() && mesh.albedo.size() != count) {
        throw_bad_argument(
            fmt::format("albedo: {} colours for {} triangles", mesh.albedo.size(), count));
    }
    if (!mesh.smooth.empty() && mesh.smooth.size() != mesh.triangles.size()) {
        throw_bad_argument(fmt::format("smooth: {} numbers for {} corners of triangles",
                                       mesh.smooth.size(), mesh.triangles.size()));
    }
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        if (mesh.triangles[i] < positions.count) continue;
        throw Error(ErrorCode::bad_input,
                    fmt::format("triangle {} has vertex {}, but there are {} positions", i / 3,
                                mesh.triangles[i], positions.count));
    }
    if (is_smooth_by_vertex(mesh)) return;
    for (const std::uint32_t number : mesh.smooth) {
        if (number < mesh.smooth.size()) continue;
        throw_bad_argument(fmt::format("smooth: {} is not below the number of corners, {}", number,
                                       mesh.smooth.size()));
    }
}

std::vector<mray::uvec3> threes_of(std::span<const std::uint32_t> numbers) {
    std::vector<mray::uvec3> threes(numbers.size() / 3);
    for (std::size_t i = 0; i < threes.size(); ++i)
        threes[i] = {numbers[3 * i], numbers[3 * i + 1], numbers[3 * i + 2]};
    return threes;
}

}  // namespace

bool MeshList::will_be_used(std::uint32_t geom_id) const {
    bool used = geom_id < places_.size() && places_[geom_id].used;
    for (const Change& change : changes_) {
        if (change.geom_id == geom_id) used = change.attaches;
    }
    return used;
}

std::uint32_t MeshList::attach(const MeshView& mesh) {
    check(mesh);
    Change change = {.attaches = true};
    while (will_be_used(change.geom_id)) ++change.geom_id;
    change.place = {.used = true, .positions = mesh.positions, .deforms = mesh.deforms};
    const std::size_t count = mesh.triangles.size() / 3;
    change.place.is_smooth = !mesh.smooth.empty();
    if (change.place.is_smooth && !is_smooth_by_vertex(mesh)) {
        change.place.smooth =
            std::make_shared<const std::vector<mray::uvec3>>(threes_of(mesh.smooth));
    }
    change.triangles = threes_of(mesh.triangles);
    change.albedo.assign(mesh.albedo.begin(), mesh.albedo.end());
    change.albedo.resize(count, mray::kDefaultAlbedo);
    constexpr mray::Albedo kColour = 0x00FFFFFF;
    for (mray::Albedo& albedo : change.albedo)
        albedo = (albedo & kColour) | (mesh.backdrop ? mray::kBackdropBit : 0);
    changes_.push_back(std::move(change));
    return changes_.back().geom_id;
}

void MeshList::detach(std::uint32_t geom_id) {
    if (!will_be_used(geom_id))
        throw_bad_argument(fmt::format("the scene has no mesh with geom_id {}", geom_id));
    changes_.push_back({.geom_id = geom_id});
}

void MeshList::append(std::uint32_t geom_id, MeshPlace place,
                      std::span<const mray::uvec3> triangles, std::uint32_t old_first_vertex,
                      std::span<const mray::Albedo> albedo) {
    if (topology_.vertex_count + place.positions.count > kMostVertices)
        throw Error(ErrorCode::limit, "the meshes have too many positions together");
    if (topology_.triangles.size() + triangles.size() > kMostTriangles)
        throw Error(ErrorCode::limit, "the meshes have more than 2^28 triangles together");
    place.first_vertex = topology_.vertex_count;
    place.first_prim = static_cast<std::uint32_t>(topology_.triangles.size());
    place.prim_count = static_cast<std::uint32_t>(triangles.size());
    const std::uint32_t shift = place.first_vertex - old_first_vertex;
    for (const mray::uvec3& t : triangles)
        topology_.triangles.push_back({t.x + shift, t.y + shift, t.z + shift});
    topology_.albedo.insert(topology_.albedo.end(), albedo.begin(), albedo.end());
    topology_.vertex_count += place.vertex_count();
    places_[geom_id] = place;
    if (place.prim_count == 0) return;
    geometry_ids_.push_back(geom_id);
    first_prims_.push_back(place.first_prim);
}

MeshList MeshList::changed() const {
    std::uint32_t most = static_cast<std::uint32_t>(places_.size());
    for (const Change& change : changes_) most = std::max(most, change.geom_id + 1);
    MeshList list;
    list.places_.resize(most);
    for (std::uint32_t id = 0; id < most; ++id) {
        const auto last = std::find_if(changes_.rbegin(), changes_.rend(),
                                       [&](const Change& change) { return change.geom_id == id; });
        if (last != changes_.rend()) {
            if (last->attaches) list.append(id, last->place, last->triangles, 0, last->albedo);
        } else if (const MeshPlace* place = find(id)) {
            list.append(
                id, *place,
                std::span(topology_.triangles).subspan(place->first_prim, place->prim_count),
                place->first_vertex,
                std::span(topology_.albedo).subspan(place->first_prim, place->prim_count));
        }
    }
    return list;
}

bool MeshList::is_smooth() const {
    return std::any_of(places_.begin(), places_.end(),
                       [](const MeshPlace& mesh) { return mesh.used && mesh.is_smooth; });
}

/// Vertices come first, then the numbers of one mesh after the other.
std::vector<mray::uvec3> MeshList::normal_ids() const {
    std::vector<mray::uvec3> ids(topology_.triangles.size(), mray::uvec3(mray::kFlatCorner));
    std::uint32_t first = topology_.vertex_count;
    for (const MeshPlace& mesh : places_) {
        if (!mesh.used || !mesh.is_smooth) continue;
        std::uint32_t count = 0;
        for (std::uint32_t i = 0; i < mesh.prim_count; ++i) {
            const std::uint32_t prim = mesh.first_prim + i;
            if (mesh.smooth == nullptr) {
                ids[prim] = topology_.triangles[prim];
                continue;
            }
            const mray::uvec3 numbers = (*mesh.smooth)[i];
            ids[prim] = numbers + first;
            count = std::max({count, numbers.x + 1, numbers.y + 1, numbers.z + 1});
        }
        first += count;
    }
    return ids;
}

const MeshPlace* MeshList::find(std::uint32_t geom_id) const {
    return geom_id < places_.size() && places_[geom_id].used ? &places_[geom_id] : nullptr;
}

}  // namespace morphray::detail
