#include "app/commands/profile/yardstick.h"

#include <tbb/parallel_for.h>

#include <atomic>
#include <cstdint>
#include <cstring>

#include "common/base/stopwatch.h"

namespace mray::app {
namespace {

constexpr std::size_t kPieces = 64;
/// Larger in all than the caches that a core has to itself.
constexpr std::size_t kPieceBytes = std::size_t{1} << 17;
constexpr int kMultiplications = 16'000;

/// A chain in which each multiplication waits for the one before it. The generator is that of
/// D. Knuth. The Art of Computer Programming, volume 2. 1997.
std::uint64_t multiply(std::uint64_t x) {
    for (int i = 0; i < kMultiplications; ++i) x = x * 6364136223846793005u + 1442695040888963407u;
    return x;
}

}  // namespace

Yardstick::Yardstick(int threads)
    : arena_(threads), source_(kPieces * kPieceBytes, 1), target_(kPieces * kPieceBytes, 2) {}

double Yardstick::run_ms() {
    std::atomic<unsigned> sum = 0;
    const Stopwatch watch;
    arena_.execute([&] {
        tbb::parallel_for(std::size_t{0}, kPieces, [&](std::size_t piece) {
            char* const target = &target_[piece * kPieceBytes];
            std::memcpy(target, &source_[piece * kPieceBytes], kPieceBytes);
            sum += static_cast<unsigned>(multiply(piece) >> 32) +
                   static_cast<unsigned char>(target[piece]);
        });
    });
    const double ms = watch.ms();
    sum_ = sum;
    return ms;
}

}  // namespace mray::app
