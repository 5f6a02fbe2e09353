#include "tests/fuzz/generate/calls.h"

#include "tests/fuzz/generate/dice.h"

namespace mray::fuzz {
namespace {

std::uint32_t number_of(Dice& dice, CallKind kind) {
    constexpr std::array kRayCounts = {1, 5, 20, 64, 300};
    switch (kind) {
        case CallKind::kBuild:
            return dice.one_in(12) ? 0 : static_cast<std::uint32_t>(dice.from(1, 4));
        case CallKind::kOn:
            return dice.below(kCallScenes);
        case CallKind::kDetach:
        case CallKind::kMove:
        case CallKind::kPart:
            return dice.below(dice.one_in(6) ? 6 : 3);
        case CallKind::kRays:
            // From 8192 on the library sorts them.
            return dice.one_in(150) ? 8192 + dice.below(1000)
                                    : static_cast<std::uint32_t>(dice.pick(kRayCounts));
        case CallKind::kPoints:
            return static_cast<std::uint32_t>(dice.from(1, dice.one_in(4) ? 300 : 30));
        case CallKind::kImage:
            return static_cast<std::uint32_t>(dice.from(1, dice.one_in(4) ? 48 : 20));
        default:
            return 0;
    }
}

}  // namespace

FuzzCase make_calls(std::uint64_t seed) {
    using enum CallKind;
    constexpr std::array kChanges = {kBuild,  kDestroy, kOn,   kAttach, kAttach,
                                     kDetach, kDetach,  kMove, kMove,   kMove,
                                     kMove,   kMove,    kPart, kPart,   kUpdate};
    constexpr std::array kQuestions = {kRays, kRays, kPoints, kImage};
    Dice dice(seed);
    FuzzCase fuzz_case;
    fuzz_case.view.width = fuzz_case.view.height = 0;
    const std::uint32_t scenes = dice.one_in(2) ? 1 : kCallScenes;
    const auto add = [&](CallKind kind, std::uint32_t scene) {
        const std::uint32_t number = number_of(dice, kind);
        fuzz_case.calls.push_back({kind, scene, number, dice.bits()});
    };
    for (std::uint32_t scene = 0; scene < scenes; ++scene) add(kBuild, scene);
    for (int round = dice.from(1, 5); round > 0; --round) {
        const std::uint32_t scene = dice.below(scenes);
        for (int n = dice.from(0, 4); n > 0; --n) add(dice.pick(kChanges), scene);
        if (!dice.one_in(4)) add(kUpdate, scene);
        for (int n = dice.from(1, 2); n > 0; --n)
            add(dice.pick(kQuestions), dice.one_in(4) ? dice.below(scenes) : scene);
    }
    return fuzz_case;
}

}  // namespace mray::fuzz
