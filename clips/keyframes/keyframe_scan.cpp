#include "clips/keyframes/keyframe_scan.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <exception>
#include <utility>

#include "clips/keyframes/measure_positions.h"

namespace mray {
namespace {

// Keyframes that are read between checks for errors: enough to keep all cores busy, and few enough
// to refuse a clip soon that is wrong from its second keyframe on.
constexpr std::size_t kAtOnce = 64;

struct Found {
    KeyframeBounds bounds = {};
    bool is_damaged = false;
    bool is_odd = false;
    /// An error that refuses the whole clip.
    std::exception_ptr error = nullptr;
};

class Scan {
public:
    Scan(const KeyframeSource& source, std::uint32_t vertex_count, KeyframeCache& cache,
         const Watch& watch)
        : source_(source), vertex_count_(vertex_count), cache_(cache), watch_(watch) {}

    ClipFacts facts() {
        facts_.bounds.reserve(source_.count());
        for (std::size_t begin = 0; begin < source_.count(); begin += kAtOnce) {
            found_.assign(std::min(kAtOnce, source_.count() - begin), {});
            tbb::parallel_for(std::size_t{0}, found_.size(), [&](std::size_t i) {
                try {
                    watch_.throw_if_cancelled();
                    found_[i] = read(begin + i);
                    watch_.set_done(++read_, source_.count());
                } catch (...) {
                    found_[i].error = std::current_exception();
                }
            });
            for (std::size_t i = 0; i < found_.size(); ++i) add(begin + i, found_[i]);
        }
        return std::move(facts_);
    }

private:
    Found read(std::size_t keyframe) {
        if (const KeyframePositions kept = cache_.find(keyframe))
            return {.bounds = KeyframeBounds(bounds_of(*kept))};
        const bool keeps = cache_.keeps_all();
        std::vector<vec3> kept;
        std::vector<vec3>& positions = keeps ? kept : buffers_.local();
        positions.resize(vertex_count_);
        const KeyframeNotes notes = source_.read(keyframe, positions);
        if (notes.problem) return {.is_damaged = true};
        const KeyframeBounds bounds(measure_positions(positions).bounds);
        if (keeps) cache_.add(keyframe, std::make_shared<std::vector<vec3>>(std::move(kept)));
        return {.bounds = bounds, .is_odd = notes.warning.has_value()};
    }

    void add(std::size_t keyframe, const Found& found) {
        if (found.error) std::rethrow_exception(found.error);
        facts_.bounds.push_back(found.bounds);
        if (found.is_odd) facts_.odd.push_back(keyframe);
        if (found.is_damaged) facts_.damaged.push_back(keyframe);
    }

    const KeyframeSource& source_;
    std::uint32_t vertex_count_;
    KeyframeCache& cache_;
    const Watch& watch_;
    std::atomic<std::size_t> read_ = 0;
    tbb::enumerable_thread_specific<std::vector<vec3>> buffers_;
    std::vector<Found> found_;
    ClipFacts facts_;
};

}  // namespace

ClipFacts scan_keyframes(const KeyframeSource& source, std::uint32_t vertex_count,
                         KeyframeCache& cache, const Watch& watch) {
    return Scan(source, vertex_count, cache, watch).facts();
}

}  // namespace mray
