#include "embree/scene/committed.h"

#include <algorithm>
#include <array>
#include <new>
#include <set>
#include <utility>

#include "embree/thread_owned.h"

namespace mray::embree {
namespace {

bool fits(const Committed& spare, const BuildWay& way, const std::vector<Part>& parts,
          const std::vector<std::vector<std::uint32_t>>& triangles) {
    return spare.way == way && spare.triangles == triangles &&
           std::equal(parts.begin(), parts.end(), spare.parts.begin(), spare.parts.end(),
                      [](const Part& part, const Part& old) {
                          return part.vertices.count == old.own_positions.size() &&
                                 part.used_vertices == old.used_vertices;
                      });
}

/// Answers of Committed::visible() in the thread: rays of a few kinds, each with a mask, come in
/// turn.
struct Answers {
    struct Answer {
        std::uint64_t settings_number = 0;
        unsigned int ray_mask = 0;
        std::vector<std::uint8_t> is_visible;
    };
    std::array<Answer, 8> all;
    std::size_t oldest = 0;
};

}  // namespace

void Committed::read_settings() {
    static std::atomic<std::uint64_t> last_number = 0;
    settings_number = ++last_number;
    uses_masks = false;
    filters_hits = false;
    filters_occlusion = false;
    for (Part& part : parts) {
        uses_masks |= part.read_masks();
        filters_hits |= part.mesh().intersect_filter != nullptr;
        filters_occlusion |= part.mesh().occluded_filter != nullptr;
    }
    std::set<unsigned int> different;
    if (uses_masks)
        for (const Part& part : parts) different.insert(part.masks.begin(), part.masks.end());
    masks.assign(different.begin(), different.end());
}

std::span<const std::uint8_t> Committed::visible(unsigned int ray_mask) const {
    Answers& answers = ThreadOwned<Answers>::get();
    for (const Answers::Answer& answer : answers.all) {
        if (answer.settings_number == settings_number && answer.ray_mask == ray_mask)
            return answer.is_visible;
    }
    Answers::Answer& made = answers.all[answers.oldest];
    answers.oldest = (answers.oldest + 1) % answers.all.size();
    made.settings_number = 0;
    made.is_visible.clear();
    for (const Part& part : parts) made.is_visible.push_back(part.sees(ray_mask) ? 1 : 0);
    made.settings_number = settings_number;
    made.ray_mask = ray_mask;
    return made.is_visible;
}

void SpareTrees::keep(std::unique_ptr<Committed> spare) noexcept {
    spare->forget_boxes();
    for (Part& part : spare->parts) {
        Part rest;
        rest.own_positions = std::move(part.own_positions);
        rest.used_vertices = part.used_vertices;
        part = std::move(rest);
    }
    const std::scoped_lock lock(mutex_);
    try {
        spares_.push_back(std::move(spare));
    } catch (const std::bad_alloc&) {
        // A later scene builds its tree.
    }
}

std::unique_ptr<Committed> SpareTrees::take(
    const BuildWay& way, const std::vector<Part>& parts,
    const std::vector<std::vector<std::uint32_t>>& triangles) {
    // Destroyed without the lock.
    std::unique_ptr<Committed> dropped;
    const std::scoped_lock lock(mutex_);
    const auto found = std::find_if(spares_.begin(), spares_.end(), [&](const auto& spare) {
        return fits(*spare, way, parts, triangles);
    });
    if (found != spares_.end()) {
        std::unique_ptr<Committed> spare = std::move(*found);
        spares_.erase(found);
        return spare;
    }
    if (!spares_.empty()) {
        dropped = std::move(spares_.front());
        spares_.pop_front();
    }
    return nullptr;
}

}  // namespace mray::embree
