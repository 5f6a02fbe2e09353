#include "scenes/procedural/procedural.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>
#include <vector>

#include "common/base/errors.h"
#include "common/text/text_parts.h"
#include "scenes/procedural/scenes.h"

namespace mray {
namespace {

struct Entry {
    ProceduralScene scene;
    DeformingMesh (*make)(std::uint64_t triangles);
};

constexpr std::array kEntries = {
    Entry{{"cloth", "a sheet that comes down waving over a ball", 60000}, make_cloth},
    Entry{{"twist", "a column of boxes twisted by up to 4 turns", 40000}, make_twist},
    Entry{{"herd", "animals walking on static hills", 80000}, make_herd},
    Entry{{"shuffle", "a torus whose triangles change places", 40000}, make_shuffle},
    Entry{{"soup", "separate small triangles in motion", 30000}, make_soup},
    Entry{{"spikes", "a closed ball with pulsing spikes", 60000}, make_spikes},
    Entry{{"orbits", "balls on crossing orbits", 40000}, make_orbits},
    Entry{{"teleport", "balls that jump elsewhere all at once", 40000}, make_teleport},
    Entry{{"hall", "a hall from inside: columns, beams, cables, waving banners", 80000}, make_hall},
};

constexpr auto kScenes = [] {
    std::array<ProceduralScene, kEntries.size()> scenes{};
    for (std::size_t i = 0; i < scenes.size(); ++i) scenes[i] = kEntries[i].scene;
    return scenes;
}();

std::string nearest_scene(std::string_view name) {
    std::vector<std::string> names;
    for (const ProceduralScene& scene : kScenes) names.emplace_back(scene.name);
    return nearest_name(name, names);
}

// The name, fit for a message of one line.
std::string quoted_name(std::string_view name) {
    constexpr std::size_t kLongest = 40;
    std::string text(name.substr(0, kLongest));
    for (char& c : text) {
        if (c < ' ' || c > '~') c = '?';
    }
    return name.size() > kLongest ? fmt::format("'{}...'", text) : fmt::format("'{}'", text);
}

}  // namespace

std::span<const ProceduralScene> procedural_scenes() { return kScenes; }

std::unique_ptr<Clip> make_procedural(const std::string& name, std::uint64_t triangles) {
    const auto entry = std::find_if(kEntries.begin(), kEntries.end(),
                                    [&](const Entry& e) { return name == e.scene.name; });
    if (entry == kEntries.end()) {
        throw Error(ErrorKind::kBadArgument,
                    fmt::format("there is no built-in scene {}; the nearest "
                                "name is '{}'",
                                quoted_name(name), nearest_scene(name)));
    }
    if (triangles > kMaxTriangles) {
        throw Error(ErrorKind::kLimit,
                    fmt::format("{} triangles are too many for the built-in scene '{}'; ask for {} "
                                "at most",
                                triangles, name, kMaxTriangles));
    }
    if (triangles == 0) triangles = entry->scene.default_triangles;
    return make_clip(name, entry->make(triangles));
}

}  // namespace mray
