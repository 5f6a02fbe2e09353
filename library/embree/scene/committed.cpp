#include "library/embree/scene/committed.h"

#include <array>
#include <atomic>
#include <set>

namespace mray::embree {
namespace {

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
    thread_local Answers answers;
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

}  // namespace mray::embree
