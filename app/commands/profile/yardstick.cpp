#include "app/commands/profile/yardstick.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cstdint>

#include "common/base/stopwatch.h"
#include "tools/measure/thread_clock.h"

namespace mray::app {
namespace {

constexpr std::size_t kPieces = 64;
/// Reading the clock of a thread takes a while, so it is read for one piece of these.
constexpr std::size_t kPiecesPerTimed = 8;
constexpr int kMultiplications = 16'000;

/// A chain in which each multiplication waits for the one before it. The generator is that of
/// D. Knuth. The Art of Computer Programming, volume 2. 1997.
std::uint64_t multiply(std::uint64_t x) {
    for (int i = 0; i < kMultiplications; ++i) x = x * 6364136223846793005u + 1442695040888963407u;
    return x;
}

}  // namespace

Yardstick::Yardstick(int threads) : arena_(threads) {}

double Yardstick::run_ms() {
    std::atomic<unsigned> sum = 0;
    std::atomic<double> timed_ms = 0;
    const Stopwatch watch;
    arena_.execute([&] {
        tbb::parallel_for(std::size_t{0}, kPieces, [&](std::size_t piece) {
            const bool is_timed = piece % kPiecesPerTimed == 0;
            const double begin = is_timed ? thread_ms() : 0;
            sum += static_cast<unsigned>(multiply(piece) >> 32);
            if (is_timed) timed_ms += thread_ms() - begin;
        });
    });
    const double ms = watch.ms();
    sum_ = sum;
    elapsed_ms_ += ms * arena_.threads();
    worked_ms_ += timed_ms * kPiecesPerTimed;
    return ms;
}

double Yardstick::waited() const {
    return elapsed_ms_ > 0 ? std::max(0.0, 1 - worked_ms_ / elapsed_ms_) : 0;
}

}  // namespace mray::app
