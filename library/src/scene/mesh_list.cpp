#include "library/src/scene/mesh_list.h"

#include <cmath>

#include "common/base/aligned_vector.h"
#include "common/interop/shading.h"
#include "common/scene/scene_space.h"
#include "common/scene/vertex_normals.h"
#include "library/src/scene/errors.h"

namespace morphray::detail {
namespace {

constexpr std::uint64_t kMostVertices = 0xFFFFFFF0u;

bool is_smooth_by_vertex(const MeshView& mesh) {
    return !mesh.appearance.smooth.empty() &&
           mesh.appearance.smooth.data() == mesh.triangles.data();
}

void check_textures(const MeshView& mesh) {
    const Appearance& look = mesh.appearance;
    constexpr std::size_t kMostTextures = 65536;
    if (look.textures.empty()) {
        if (!look.texture_ids.empty() || !look.texcoords.empty())
            throw_bad_argument("texcoords, texture_ids: given without textures");
        return;
    }
    if (look.textures.size() > kMostTextures)
        throw_error(ErrorCode::limit, "textures: {}, but at most {} are possible",
                    look.textures.size(), kMostTextures);
    for (std::size_t i = 0; i < look.textures.size(); ++i) {
        const TextureView& texture = look.textures[i];
        if (std::max(texture.width, texture.height) > kMaxTextureSide)
            throw_error(ErrorCode::limit,
                        "texture {}: {}x{} texels; at most {} a side are possible", i,
                        texture.width, texture.height, kMaxTextureSide);
        if (texture.texels.empty() ||
            texture.texels.size() != std::size_t{texture.width} * texture.height)
            throw_bad_argument("texture {}: {} texels for a size of {}x{}", i,
                               texture.texels.size(), texture.width, texture.height);
        if (texture.wrap != Wrap::repeat && texture.wrap != Wrap::clamp)
            throw_bad_argument("texture {}: wrap is neither repeat nor clamp", i);
        if (!(texture.alpha_cutoff >= 0 && texture.alpha_cutoff <= 1))
            throw_bad_argument("texture {}: an alpha_cutoff of {}; must be from 0 to 1", i,
                               texture.alpha_cutoff);
    }
    if (look.texcoords.size() != 2 * mesh.triangles.size())
        throw_bad_argument("texcoords: {} floats for {} corners of triangles",
                           look.texcoords.size(), mesh.triangles.size());
    const std::size_t count = mesh.triangles.size() / 3;
    if (!look.texture_ids.empty() && look.texture_ids.size() != count)
        throw_bad_argument("texture_ids: {} for {} triangles", look.texture_ids.size(), count);
    for (const std::uint32_t id : look.texture_ids) {
        if (id < look.textures.size() || id == kNoTexture) continue;
        throw_bad_argument("texture_ids: {}, but there are {} textures", id, look.textures.size());
    }
}

void check(const Positions& positions) {
    if (positions.count > 0 && positions.data == nullptr)
        throw_bad_argument("positions: no data, but a count above 0");
    const std::size_t size = positions.has_doubles ? 3 * sizeof(double) : sizeof(Vec3);
    if (positions.count > 1 && positions.stride < size)
        throw_bad_argument("positions: a stride of {} bytes; three {} take {}", positions.stride,
                           positions.has_doubles ? "doubles" : "floats", size);
    if (positions.count > kMostVertices)
        throw_error(ErrorCode::limit, "positions: {} are too many", positions.count);
}

void check(const MeshView& mesh) {
    check(mesh.positions);
    if (mesh.triangles.size() % 3 != 0)
        throw_error(ErrorCode::bad_input, "triangles: {} indices, which is not a multiple of 3",
                    mesh.triangles.size());
    const Appearance& look = mesh.appearance;
    const std::size_t count = mesh.triangles.size() / 3;
    if (count > mray::kMaxTriangles)
        throw_error(ErrorCode::limit, "triangles: {}, but at most 2^28 are possible", count);
    if (!look.albedo.empty() && look.albedo.size() != count)
        throw_bad_argument("albedo: {} colours for {} triangles", look.albedo.size(), count);
    if (!look.smooth.empty() && look.smooth.size() != mesh.triangles.size())
        throw_bad_argument("smooth: {} numbers for {} corners of triangles", look.smooth.size(),
                           mesh.triangles.size());
    // The greatest index is found in vectors, an index too great one by one.
    std::uint32_t greatest = 0;
    for (const std::uint32_t index : mesh.triangles) greatest = std::max(greatest, index);
    for (std::size_t i = 0; i < mesh.triangles.size() && greatest >= mesh.positions.count; ++i) {
        if (mesh.triangles[i] < mesh.positions.count) continue;
        throw_error(ErrorCode::bad_input, "triangle {} has vertex {}, but there are {} positions",
                    i / 3, mesh.triangles[i], mesh.positions.count);
    }
    check_textures(mesh);
    if (is_smooth_by_vertex(mesh)) return;
    for (const std::uint32_t number : look.smooth) {
        if (number < look.smooth.size()) continue;
        throw_bad_argument("smooth: {} is not below the number of corners, {}", number,
                           look.smooth.size());
    }
}

std::vector<mray::uvec3> threes_of(std::span<const std::uint32_t> numbers) {
    const auto* const first = reinterpret_cast<const mray::uvec3*>(numbers.data());
    std::vector<mray::uvec3> threes;
    threes.reserve(numbers.size() / 3);
    mray::ask_for_huge_pages(threes.data(), numbers.size_bytes());
    threes.assign(first, first + numbers.size() / 3);
    return threes;
}

std::vector<mray::Texcoords> texcoords_of(std::span<const float> numbers) {
    const auto finite = [](float x) { return std::isfinite(x) ? x : 0.0f; };
    std::vector<mray::Texcoords> texcoords(numbers.size() / 6);
    static_assert(sizeof(mray::Texcoords) == 6 * sizeof(float));
    std::ranges::transform(numbers, reinterpret_cast<float*>(texcoords.data()), finite);
    return texcoords;
}

/// The triangles of all meshes together. Throws Error(limit).
std::size_t count_triangles(std::span<const MeshSlot> slots) {
    std::uint64_t vertex_count = 0;
    std::uint64_t prim_count = 0;
    for (const MeshSlot& slot : slots) {
        vertex_count += slot.positions.count;
        prim_count += slot.prim_count;
    }
    if (vertex_count > kMostVertices)
        throw Error(ErrorCode::limit, "the meshes have too many positions together");
    if (prim_count > mray::kMaxTriangles)
        throw Error(ErrorCode::limit, "the meshes have more than 2^28 triangles together");
    return prim_count;
}

}  // namespace

std::uint32_t MeshList::attach(const MeshView& mesh) {
    check(mesh);
    const Appearance& look = mesh.appearance;
    while (first_free_ < will_be_used_.size() && will_be_used_[first_free_]) ++first_free_;
    Change change;
    change.slot = {.used = true, .positions = mesh.positions, .deforms = mesh.deforms};
    const std::size_t count = mesh.triangles.size() / 3;
    change.slot.prim_count = static_cast<std::uint32_t>(count);
    change.slot.is_smooth = !look.smooth.empty();
    if (change.slot.is_smooth && !is_smooth_by_vertex(mesh)) {
        change.slot.smooth =
            std::make_shared<const std::vector<mray::uvec3>>(threes_of(look.smooth));
    }
    change.triangles = threes_of(mesh.triangles);
    change.slot.used_vertices = std::make_shared<const std::vector<mray::IndexRange>>(
        mray::used_vertices(change.triangles, mesh.positions.count));
    change.albedo.assign(look.albedo.begin(), look.albedo.end());
    change.albedo.resize(count, mray::kDefaultAlbedo);
    constexpr mray::Albedo kColour = 0x00FFFFFF;
    for (mray::Albedo& albedo : change.albedo)
        albedo = (albedo & kColour) | (look.shadow_catcher ? mray::kShadowCatcherBit : 0);
    if (!look.textures.empty()) {
        for (const TextureView& texture : look.textures) {
            change.slot.textures.push_back(std::make_shared<const mray::cpu::Texture>(
                texture.texels, texture.width, texture.height, texture.wrap == Wrap::clamp,
                texture.alpha_cutoff));
        }
        change.texcoords = texcoords_of(look.texcoords);
        change.texture_ids.assign(look.texture_ids.begin(), look.texture_ids.end());
        change.texture_ids.resize(count, 0);
        for (std::size_t i = 0; i < count; ++i) {
            if (change.texture_ids[i] == mray::kNoTexture) continue;
            if (look.albedo.empty()) change.albedo[i] |= kColour;
            change.albedo[i] |= mray::kTexturedBit;
        }
    }
    if (first_free_ == will_be_used_.size()) will_be_used_.push_back(false);
    changes_.insert_or_assign(first_free_, std::move(change));
    will_be_used_[first_free_] = true;
    return first_free_;
}

void MeshList::detach(std::uint32_t geom_id) {
    if (geom_id >= will_be_used_.size() || !will_be_used_[geom_id])
        throw_bad_argument("the scene has no mesh with geom_id {}", geom_id);
    changes_.insert_or_assign(geom_id, Change());
    will_be_used_[geom_id] = false;
    first_free_ = std::min(first_free_, geom_id);
}

void MeshList::set_positions(std::uint32_t geom_id, const Positions& positions) {
    MeshSlot& mesh = slots_[geom_id];
    if (positions.count != mesh.positions.count)
        throw_bad_argument("{} positions for a mesh that has {}", positions.count,
                           mesh.positions.count);
    check(positions);
    mesh.positions = positions;
}

void MeshList::set_transform(std::uint32_t geom_id, const mray::Transform& transform) {
    MeshSlot& mesh = slots_[geom_id];
    const bool is_first = !mesh.transform;
    mesh.transform = transform;
    if (is_first) read_rest(geom_id, 0, mesh.positions.count);
}

void MeshList::read_rest(std::uint32_t geom_id, std::size_t first, std::size_t count) {
    MeshSlot& mesh = slots_[geom_id];
    if (!mesh.transform) return;
    mesh.rest.resize(mesh.positions.count);
    mesh.for_each_used(first, first + count, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i)
            mesh.rest[i] = mray::Origin().to_world(load(mesh.positions, i));
    });
    const auto is_normal = [](float x) { return x == 0 || std::isnormal(x); };
    mesh.rest_is_normal = std::ranges::all_of(mesh.rest, [&](const mray::vec3& p) {
        return is_normal(p.x) && is_normal(p.y) && is_normal(p.z);
    });
    mesh.rest_version = ++last_rest_version_;
}

void MeshList::make_changes() {
    slots_.resize(will_be_used_.size());
    for (MeshSlot& slot : slots_) slot.vertex_before = slot.first_vertex;
    for (auto& [id, change] : changes_) slots_[id] = std::move(change.slot);
    const std::size_t prim_count = count_triangles(slots_);
    const mray::Topology before = std::exchange(topology_, {});
    const std::vector texcoords_before = std::exchange(texcoords_, {});
    const std::vector texture_ids_before = std::exchange(texture_ids_, {});
    const bool has_textures =
        std::ranges::any_of(slots_, [](const MeshSlot& slot) { return !slot.textures.empty(); });
    textures_.clear();
    geometry_ids_.clear();
    first_prims_.clear();
    for (std::uint32_t id = 0; id < slots_.size(); ++id) {
        MeshSlot& slot = slots_[id];
        if (!slot.used) continue;
        const std::size_t end = topology_.triangles.size() + slot.prim_count;
        Change change;
        if (!slot.vertex_before) change = std::move(changes_.at(id));
        // Appends the mesh's part of an array, which it has from its attach() or before.
        const auto append = [&](auto& to, auto& own, const auto& all_before, const auto& none) {
            if (own.size() == prim_count) {
                to = std::move(own);
                return;
            }
            to.reserve(prim_count);
            const bool was_there = slot.vertex_before && !all_before.empty();
            const std::span<const std::decay_t<decltype(none)>> from =
                was_there ? std::span(all_before).subspan(slot.first_prim, slot.prim_count)
                          : std::span(own);
            to.insert(to.end(), from.begin(), from.end());
            to.resize(end, none);
        };
        append(topology_.triangles, change.triangles, before.triangles, mray::uvec3());
        append(topology_.albedo, change.albedo, before.albedo, mray::kDefaultAlbedo);
        if (has_textures) {
            append(texcoords_, change.texcoords, texcoords_before, mray::Texcoords());
            append(texture_ids_, change.texture_ids, texture_ids_before, mray::kNoTexture);
        }
        const auto own_part = [&](auto& all) { return std::span(all).last(slot.prim_count); };
        if (const std::uint32_t shift = topology_.vertex_count - slot.first_vertex; shift != 0)
            for (mray::uvec3& t : own_part(topology_.triangles)) t += shift;
        const auto first_texture = static_cast<std::uint32_t>(textures_.size());
        const std::uint32_t texture_shift = first_texture - slot.first_texture;
        if (!slot.textures.empty() && texture_shift != 0) {
            for (std::uint32_t& texture : own_part(texture_ids_))
                if (texture != mray::kNoTexture) texture += texture_shift;
        }
        slot.first_texture = first_texture;
        slot.first_vertex = topology_.vertex_count;
        slot.first_prim = static_cast<std::uint32_t>(end) - slot.prim_count;
        textures_.insert(textures_.end(), slot.textures.begin(), slot.textures.end());
        topology_.vertex_count += slot.vertex_count();
        if (slot.prim_count == 0) continue;
        geometry_ids_.push_back(id);
        first_prims_.push_back(slot.first_prim);
    }
    changes_.clear();
}

/// Vertices come first, then the numbers of one mesh after the other.
std::vector<mray::uvec3> MeshList::normal_ids() const {
    std::vector<mray::uvec3> ids(topology_.triangles.size(), mray::uvec3(mray::kFlatCorner));
    std::uint32_t first = topology_.vertex_count;
    for (const MeshSlot& mesh : slots_) {
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

const MeshSlot* MeshList::find(std::uint32_t geom_id) const {
    return geom_id < slots_.size() && slots_[geom_id].used ? &slots_[geom_id] : nullptr;
}

std::uint32_t MeshList::count_up_to(std::uint32_t geom_id, std::uint32_t prim_id) const {
    const auto after = std::upper_bound(geometry_ids_.begin(), geometry_ids_.end(), geom_id);
    if (after == geometry_ids_.begin()) return 0;
    const auto i = static_cast<std::size_t>(after - geometry_ids_.begin()) - 1;
    const std::size_t end =
        i + 1 < first_prims_.size() ? first_prims_[i + 1] : topology_.triangles.size();
    if (geometry_ids_[i] != geom_id) return static_cast<std::uint32_t>(end);
    const std::uint64_t last = std::uint64_t{first_prims_[i]} + prim_id + 1;
    return static_cast<std::uint32_t>(std::min<std::uint64_t>(last, end));
}

}  // namespace morphray::detail
