#include "common/scene/pose.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <atomic>
#include <cassert>
#include <cstring>
#include <numeric>

namespace mray {
namespace {

// Vertices a task: 192 KiB of positions.
constexpr std::size_t kVertexGrain = 1024 * kMotionBlock;

}  // namespace

std::vector<std::uint32_t> indices_of(const std::vector<std::uint8_t>& flags) {
    std::vector<std::uint32_t> indices;
    std::size_t i = 0;
    for (; i + 8 <= flags.size(); i += 8) {
        std::uint64_t eight;
        std::memcpy(&eight, &flags[i], sizeof eight);
        if (eight == 0) continue;
        for (std::size_t k = i; k < i + 8; ++k) {
            if (flags[k] != 0) indices.push_back(static_cast<std::uint32_t>(k));
        }
    }
    for (; i < flags.size(); ++i) {
        if (flags[i] != 0) indices.push_back(static_cast<std::uint32_t>(i));
    }
    return indices;
}

std::vector<std::uint32_t> Pose::moved_blocks() const { return indices_of(moved_); }

std::uint32_t Pose::moved_count() const {
    return std::accumulate(moved_.begin(), moved_.end(), std::uint32_t{0});
}

void Pose::write(std::size_t first, std::span<const vec3> positions) {
    vec3* const to = positions_.data() + first;
    const auto differs = [&](std::size_t begin, std::size_t end) {
        return std::memcmp(to + begin, positions.data() + begin, (end - begin) * sizeof(vec3)) != 0;
    };
    if (!differs(0, positions.size())) return;
    for (std::size_t begin = 0; begin < positions.size();) {
        const std::size_t block = (first + begin) / kMotionBlock;
        const std::size_t end = std::min((block + 1) * kMotionBlock - first, positions.size());
        // A block may be shared with the vertices of another thread.
        if (differs(begin, end)) std::atomic_ref(moved_[block]).store(1, std::memory_order_relaxed);
        begin = end;
    }
    std::memcpy(to, positions.data(), positions.size_bytes());
}

void Pose::add_body(const Body& body) {
    const auto begin = moved_.begin() + body.first_vertex / kMotionBlock;
    const auto end = moved_.begin() + (body.end_vertex() + kMotionBlock - 1) / kMotionBlock;
    if (!body.rest.empty() && std::find(begin, end, 1) != end) bodies_.push_back(body);
}

void Pose::move_to(std::span<const vec3> positions) {
    assert(positions.size() == positions_.size());
    begin_move();
    using Range = tbb::blocked_range<std::size_t>;
    tbb::parallel_for(Range(0, positions.size(), kVertexGrain), [&](const Range& range) {
        write(range.begin(), positions.subspan(range.begin(), range.size()));
    });
}

}  // namespace mray
