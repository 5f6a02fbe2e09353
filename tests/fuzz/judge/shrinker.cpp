#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <utility>

#include "common/base/output_file.h"
#include "tests/fuzz/judge/judge.h"

namespace mray::fuzz {
namespace {

class Shrinker {
public:
    Shrinker(const FuzzCase& failing, const Finding& finding, Referee& referee)
        : best_(failing), finding_(finding), referee_(referee), what_(describe(finding)) {}

    void shrink() {
        FuzzCase smaller = best_;
        smaller.view.width = smaller.view.height = 0;
        if (best_.has_image()) take(std::move(smaller));
        lose(&FuzzCase::triangles);
        lose(&FuzzCase::rays);
        lose(&FuzzCase::points);
    }
    const FuzzCase& best() const { return best_; }
    /// How the smallest case fails.
    const std::string& what() const { return what_; }

private:
    /// Takes the case if it fails in the way of the finding.
    bool take(FuzzCase smaller) {
        if (trials_ == 0) return false;
        --trials_;
        Tally ignored;
        for (const Finding& found :
             check_case(referee_, smaller, std::span(finding_.variant, 1), ignored)) {
            if (found.answer.asked != finding_.answer.asked) continue;
            what_ = describe(found);
            best_ = std::move(smaller);
            return true;
        }
        return false;
    }

    /// Loses all things of a kind, then halves, then ever smaller parts.
    template <class Thing>
    void lose(std::vector<Thing> FuzzCase::*things) {
        for (std::size_t part = (best_.*things).size(); part > 0; part /= 2) {
            for (std::size_t first = 0; first < (best_.*things).size();) {
                FuzzCase smaller = best_;
                const std::size_t n = std::min(part, (best_.*things).size() - first);
                const auto from = (smaller.*things).begin() + static_cast<std::ptrdiff_t>(first);
                (smaller.*things).erase(from, from + static_cast<std::ptrdiff_t>(n));
                if (!take(std::move(smaller))) first += n;
            }
        }
    }

    FuzzCase best_;
    const Finding& finding_;
    Referee& referee_;
    std::string what_;
    std::size_t trials_ = 3000;
};

}  // namespace

void report_failure(const FailureName& name, const FuzzCase& fuzz_case, const Finding& finding,
                    Referee& referee) {
    Shrinker shrinker(fuzz_case, finding, referee);
    shrinker.shrink();
    const std::filesystem::path path = name.out / name.name / "case.txt";
    make_output_folder(path.parent_path());
    write_file(path, to_text(shrinker.best(), "failed: " + shrinker.what()));
    fmt::print("FAILED {}\n{}\n./fuzz replay {} --backend {}\n\n", name.name, shrinker.what(),
               path.string(), name.backend);
    std::fflush(stdout);
}

}  // namespace mray::fuzz
