// Diffuse colours of a material library.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <unordered_map>

#include "common/base/warning_count.h"
#include "common/scene/mesh.h"

namespace mray {

using MaterialMap = std::unordered_map<std::string, Albedo>;

/// More than a library of a million materials takes.
inline constexpr std::uint64_t kMaxMtlBytes = std::uint64_t{256} << 20;

/// Adds the materials of an MTL text to `materials`, by their names without the blanks around them;
/// the first of several materials of one name stays. The albedo is Kd, taken as linear, clamped to
/// [0, 1] and rounded to 8 bits; kDefaultAlbedo without a Kd or with one that is no RGB colour.
/// `name` is the file in messages. Throws Error(kBadInput) for NUL bytes and for a Kd without three
/// finite numbers; if lenient, warns and takes the default for the latter.
void read_mtl_text(std::string_view text, const std::string& name, bool lenient,
                   const WarnFunction& warn, MaterialMap& materials);

/// The albedo of linear channels, clamped to [0, 1].
Albedo albedo_of(float r, float g, float b);

}  // namespace mray
