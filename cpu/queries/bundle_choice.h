// Whether the points of a call are asked about together or one after the other.
#pragma once

#include <algorithm>
#include <cstddef>

namespace mray::cpu {

/// Whether bundles pay, by what they and single points have taken so far.
class BundleChoice {
public:
    /// Whether the next points are to be tried as a bundle.
    bool tries() {
        if (wait_ == 0) return true;
        --wait_;
        return false;
    }
    /// A bundle takes as long as its points would one after the other if it visits about as many
    /// leaves as kPointsOfLeaf points do.
    std::size_t most_leaves() const {
        return static_cast<std::size_t>(kPointsOfLeaf * leaves_of_point_);
    }
    void succeeded() { next_wait_ = kFirstWait; }
    void gave_up() {
        wait_ = next_wait_;
        next_wait_ = std::min(2 * next_wait_, kLastWait);
    }
    /// After `points` without a bundle that visited so many leaves.
    void add(std::size_t points, std::size_t leaves) {
        const float now = static_cast<float>(leaves) / static_cast<float>(points);
        leaves_of_point_ += 0.5f * (now - leaves_of_point_);
    }

private:
    static constexpr float kPointsOfLeaf = 7;
    static constexpr std::size_t kFirstWait = 3;
    static constexpr std::size_t kLastWait = 48;

    float leaves_of_point_ = 4;
    std::size_t wait_ = 0;
    std::size_t next_wait_ = kFirstWait;
};

}  // namespace mray::cpu
