// Diffuse colours of a material library.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <unordered_map>

#include "common/base/warning_count.h"
#include "common/scene/mesh.h"

namespace morphray {

using MaterialMap = std::unordered_map<std::string, Albedo>;

/// A library of a million materials is below this.
inline constexpr std::uint64_t kMaxMtlBytes = std::uint64_t{256} << 20;

/// Adds the materials of an MTL text to `materials` under their names without blanks around them;
/// of two of one name the first one stays. The albedo is Kd, taken as linear, clamped to [0, 1] and
/// rounded to 8 bits; kDefaultAlbedo where there is no Kd or one that is no RGB colour. `name` is
/// the file in messages. Throws Error(kBadInput) for NUL bytes and for a Kd that is not of finite
/// numbers; if lenient, warns and takes the default.
void read_mtl_text(std::string_view text, const std::string& name, bool lenient,
                   const WarnFunction& warn, MaterialMap& materials);

/// Of channels in [0, 1] (others are clamped), linear.
Albedo albedo_of(float r, float g, float b);

}  // namespace morphray
