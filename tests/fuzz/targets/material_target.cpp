// Material libraries.
#include <cmath>
#include <cstdint>

#include "scenes/obj/mtl_reader.h"
#include "tests/fuzz/targets/outcome.h"
#include "tests/fuzz/targets/targets.h"

namespace mray::fuzz {
namespace {

constexpr const char* kName = "case.mtl";

std::string broken_material(const Material& material) {
    constexpr Albedo kLargest = 0x00FFFFFF;
    if (material.albedo > kLargest || material.textured_albedo > kLargest)
        return "an albedo of more than 24 bits";
    if (material.map == nullptr) return {};
    for (int axis = 0; axis < 2; ++axis)
        if (!std::isfinite(material.map->scale[axis]) || !std::isfinite(material.map->offset[axis]))
            return "texture coordinates that are not finite";
    return material.map->file.empty() ? "a texture without a name" : "";
}

std::string reading_failure(std::string_view bytes, bool is_lenient, bool* is_refused) {
    WarningJudge warnings;
    return failure_of(
        kName,
        [&] {
            MaterialMap materials;
            read_mtl_text(bytes, kName, kName, is_lenient, warnings.function(), materials);
            for (const auto& [name, material] : materials) {
                std::string failure = broken_material(material);
                if (!failure.empty()) return failure;
            }
            return warnings.failure();
        },
        is_refused);
}

}  // namespace

std::string mtl_failure(std::string_view bytes) {
    bool is_refused = false;
    std::string failure = reading_failure(bytes, false, &is_refused);
    if (!failure.empty() || !is_refused) return failure;
    return reading_failure(bytes, true, nullptr);
}

}  // namespace mray::fuzz
