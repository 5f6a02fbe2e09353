#include "tests/fuzz/shrink/shrinker.h"

#include <algorithm>
#include <array>
#include <utility>

#include "tests/fuzz/shrink/shrink_parts.h"

namespace mray::fuzz {
namespace {

class Shrinker {
public:
    Shrinker(const FuzzCase& failing, const Fails& fails, std::size_t trials)
        : best_(failing), fails_(fails), trials_(trials) {}

    FuzzCase shrink() {
        if (!take(best_)) return best_;
        keep_one_comparison();
        for (bool again = true; again && trials_ > 0;) {
            again = false;
            again |= shrink_poses();
            again |= shrink_mesh();
            again |= shrink_things(&FuzzCase::rays, place_.ray);
            again |= shrink_things(&FuzzCase::points, place_.point);
            again |= best_.has_image() && shrink_image();
        }
        simplify_numbers();
        return best_;
    }

private:
    /// Takes the case if it fails.
    bool take(FuzzCase smaller) {
        if (trials_ == 0) return false;
        --trials_;
        const std::optional<FailurePlace> place = fails_(smaller);
        if (!place) return false;
        place_ = *place;
        best_ = std::move(smaller);
        return true;
    }

    void keep_one_comparison() {
        const bool has_single = !best_.rays.empty() || !best_.points.empty();
        FuzzCase alone = best_;
        alone.rays.clear();
        alone.points.clear();
        alone.asks_questions = false;
        if (best_.has_image() && has_single && take(std::move(alone))) return;
        alone = best_;
        alone.view.width = alone.view.height = 0;
        if (has_single && best_.has_image()) take(std::move(alone));
        if (best_.rays.empty() || best_.points.empty()) return;
        alone = best_;
        alone.points.clear();
        if (take(std::move(alone))) return;
        alone = best_;
        alone.rays.clear();
        take(std::move(alone));
    }

    bool shrink_poses() {
        bool shrunk = false;
        for (const FuzzCase& fewer : with_fewer_poses(best_)) {
            if (!take(fewer)) continue;
            shrunk = true;
            break;
        }
        return shrunk;
    }

    /// Removes parts of `count` things, halves first, then ever smaller ones. `without(case, first,
    /// n)` is the case without things [first, first + n).
    template <class Count, class Without>
    bool remove_parts(Count count, Without without) {
        bool shrunk = false;
        for (std::size_t part = (count(best_) + 1) / 2; part > 0; part /= 2) {
            for (std::size_t first = 0; first < count(best_) && trials_ > 0;) {
                const std::size_t n = std::min(part, count(best_) - first);
                if (take(without(best_, first, n))) {
                    shrunk = true;
                } else {
                    first += n;
                }
            }
        }
        return shrunk;
    }

    bool shrink_mesh() {
        bool shrunk = remove_parts(
            [](const FuzzCase& c) { return c.triangles.size(); },
            [](FuzzCase c, std::size_t first, std::size_t n) {
                const auto from = c.triangles.begin() + static_cast<std::ptrdiff_t>(first);
                c.triangles.erase(from, from + static_cast<std::ptrdiff_t>(n));
                return c;
            });
        const std::size_t idle = idle_vertices(best_).size();
        if (idle > 0 && take(without_idle_vertices(best_, 0, idle))) return true;
        shrunk |= remove_parts([](const FuzzCase& c) { return idle_vertices(c).size(); },
                               without_idle_vertices);
        return shrunk;
    }

    /// Removes rays or points, first all but the one at `place`.
    template <class Thing>
    bool shrink_things(std::vector<Thing> FuzzCase::*things, std::size_t place) {
        const std::vector<Thing>& all = best_.*things;
        if (all.size() < 2) return false;
        FuzzCase alone = best_;
        (alone.*things) = {all[std::min(place, all.size() - 1)]};
        if (take(std::move(alone))) return true;
        return remove_parts([=](const FuzzCase& c) { return (c.*things).size(); },
                            [=](FuzzCase c, std::size_t first, std::size_t n) {
                                const auto from =
                                    (c.*things).begin() + static_cast<std::ptrdiff_t>(first);
                                (c.*things).erase(from, from + static_cast<std::ptrdiff_t>(n));
                                return c;
                            });
    }

    bool shrink_image() {
        bool shrunk = false;
        for (const ViewSpec& simpler : with_simpler_rays(best_.view)) {
            FuzzCase smaller = best_;
            smaller.view = simpler;
            if (!take(std::move(smaller))) continue;
            shrunk = true;
            break;
        }
        for (bool again = true; again;) {
            again = false;
            for (const ViewSpec& part : with_fewer_pixels(best_.view, place_.x, place_.y)) {
                FuzzCase smaller = best_;
                smaller.view = part;
                if (!take(std::move(smaller))) continue;
                again = shrunk = true;
                break;
            }
        }
        return shrunk;
    }

    void simplify_numbers() {
        const std::size_t numbers = number_count(best_);
        // The coarsest rounding that still fails.
        constexpr std::array kBits = {0, 1, 4, 8, 16, 24};
        for (std::size_t i = 0; i < numbers; ++i) {
            for (const int bits : kBits) {
                FuzzCase simpler = best_;
                if (!round_number(simpler, i, bits)) break;
                if (take(std::move(simpler))) break;
            }
        }
    }

    FuzzCase best_;
    FailurePlace place_;
    const Fails& fails_;
    std::size_t trials_;
};

}  // namespace

FuzzCase shrink(const FuzzCase& failing, const Fails& fails, std::size_t trials) {
    return Shrinker(failing, fails, trials).shrink();
}

}  // namespace mray::fuzz
