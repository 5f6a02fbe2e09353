#include "tests/fuzz/shrinker.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <utility>

#include "common/base/errors.h"
#include "common/base/output_file.h"

namespace mray::fuzz {
namespace {

/// The case without vertices that no triangle uses.
FuzzCase without_idle_vertices(const FuzzCase& fuzz_case) {
    std::vector<bool> is_used(fuzz_case.poses.front().size());
    for (const uvec3& t : fuzz_case.triangles) is_used[t.x] = is_used[t.y] = is_used[t.z] = true;
    FuzzCase result = fuzz_case;
    for (auto& pose : result.poses) pose.clear();
    std::vector<std::uint32_t> places(is_used.size());
    for (std::size_t i = 0; i < is_used.size(); ++i) {
        if (!is_used[i]) continue;
        places[i] = static_cast<std::uint32_t>(result.poses.front().size());
        for (std::size_t pose = 0; pose < result.poses.size(); ++pose)
            result.poses[pose].push_back(fuzz_case.poses[pose][i]);
    }
    for (uvec3& t : result.triangles) t = uvec3(places[t.x], places[t.y], places[t.z]);
    return result;
}

class Shrinker {
public:
    Shrinker(const FuzzCase& failing, const Fails& fails, std::size_t trials)
        : best_(failing), fails_(fails), trials_(trials) {}

    FuzzCase shrink() {
        lose_image();
        for (bool again = true; again && trials_ > 0;) {
            again = lose_poses();
            again |= lose(&FuzzCase::triangles);
            again |= lose_idle_vertices();
            again |= lose(&FuzzCase::rays);
            again |= lose(&FuzzCase::points);
            again |= best_.has_image() && lose_pixels();
        }
        return best_;
    }

private:
    /// Takes the case if it fails.
    bool take(FuzzCase smaller) {
        if (trials_ == 0) return false;
        --trials_;
        if (!fails_(smaller)) return false;
        best_ = std::move(smaller);
        return true;
    }

    /// Loses all things of a kind, then halves, then ever smaller parts.
    template <class Thing>
    bool lose(std::vector<Thing> FuzzCase::*things) {
        bool is_smaller = false;
        for (std::size_t part = (best_.*things).size(); part > 0; part /= 2) {
            for (std::size_t first = 0; first < (best_.*things).size() && trials_ > 0;) {
                FuzzCase smaller = best_;
                const std::size_t n = std::min(part, (best_.*things).size() - first);
                const auto from = (smaller.*things).begin() + static_cast<std::ptrdiff_t>(first);
                (smaller.*things).erase(from, from + static_cast<std::ptrdiff_t>(n));
                if (take(std::move(smaller))) {
                    is_smaller = true;
                } else {
                    first += n;
                }
            }
        }
        return is_smaller;
    }

    void lose_image() {
        FuzzCase smaller = best_;
        smaller.view.width = smaller.view.height = 0;
        if (best_.has_image()) take(std::move(smaller));
    }

    bool lose_poses() {
        if (best_.poses.size() == 1) return false;
        FuzzCase smaller = best_;
        smaller.poses = {world_positions(best_, best_.frame)};
        smaller.frame = 0;
        smaller.build_at = 0;
        return take(std::move(smaller));
    }

    bool lose_idle_vertices() {
        FuzzCase smaller = without_idle_vertices(best_);
        return smaller.poses.front().size() < best_.poses.front().size() &&
               take(std::move(smaller));
    }

    /// Secondary rays and half of the columns or rows, for as many degrees.
    bool lose_pixels() {
        bool is_smaller = false;
        const auto change = [&](auto member, std::uint32_t value) {
            FuzzCase smaller = best_;
            smaller.view.*member = value;
            if (best_.view.*member != value) is_smaller |= take(std::move(smaller));
        };
        change(&ViewSpec::rays, kRaysPrimary);
        change(&ViewSpec::ao_count, 1);
        change(&ViewSpec::width, (best_.view.width + 1) / 2);
        change(&ViewSpec::height, (best_.view.height + 1) / 2);
        return is_smaller;
    }

    FuzzCase best_;
    const Fails& fails_;
    std::size_t trials_;
};

/// Whether an image differs in occlusion and colours alone.
bool is_secondary(const FrameDifference& d) { return d.total() == d.occlusion + d.colour; }

/// Whether two failures are of one kind, which must not change while a case shrinks: otherwise a
/// failure of secondary rays could turn into one of camera rays that the case has, too.
bool are_alike(const Finding& a, const Finding& b) {
    return a.answer.asked == b.answer.asked &&
           (!a.is_image() || is_secondary(a.image) == is_secondary(b.image));
}

}  // namespace

FuzzCase shrink(const FuzzCase& failing, const Fails& fails, std::size_t trials) {
    return Shrinker(failing, fails, trials).shrink();
}

void report_failure(const FailureName& name, const FuzzCase& fuzz_case, const Finding& finding,
                    Referee& referee) {
    // Says how a case fails, if it does in the way of the finding; otherwise empty.
    const auto failure = [&](const FuzzCase& smaller) -> std::string {
        Tally ignored;
        try {
            for (const Finding& found :
                 check_case(referee, smaller, std::span(finding.variant, 1), ignored))
                if (are_alike(found, finding)) return describe(found);
        } catch (const Error& error) {
            // A step of the shrinker may give a case that cannot be traced.
            if (error.kind() != ErrorKind::kBadInput) throw;
        }
        return {};
    };
    const FuzzCase small =
        shrink(fuzz_case, [&](const FuzzCase& smaller) { return !failure(smaller).empty(); });
    std::string what = failure(small);
    if (what.empty()) what = describe(finding) + " (but not each time)";
    const std::filesystem::path path = name.out / name.name / "case.txt";
    make_output_folder(path.parent_path());
    write_file(path, to_text(small, "failed: " + what));
    fmt::print("FAILED {}\n{}\n./fuzz replay {} --backend {}\n\n", name.name, what, path.string(),
               name.backend);
    std::fflush(stdout);
}

}  // namespace mray::fuzz
