#include "tests/fuzz/case.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <sstream>
#include <utility>

#include "app/base/options.h"
#include "common/base/errors.h"
#include "common/bvh/builder/bvh_builder.h"
#include "common/text/text.h"

namespace mray::fuzz {
namespace {

void require_sound(const FuzzCase& fuzz_case) {
    const auto refuse = [](const char* what) { throw Error(ErrorKind::kBadInput, what); };
    if (fuzz_case.poses.empty()) refuse("a case needs a pose");
    const std::size_t vertices = fuzz_case.poses.front().size();
    for (const auto& pose : fuzz_case.poses)
        if (pose.size() != vertices) refuse("all poses need the same number of vertices");
    for (const uvec3& t : fuzz_case.triangles)
        if (std::max({t.x, t.y, t.z}) >= vertices)
            refuse("a triangle names a vertex beyond the last");
    const double last = static_cast<double>(fuzz_case.poses.size() - 1);
    if (fuzz_case.build_at >= fuzz_case.poses.size() || !(fuzz_case.frame >= 0) ||
        fuzz_case.frame > last)
        refuse("a frame is beyond the last pose");
}

/// A colour that differs between triangles, so that one fetched for a wrong triangle shows.
Albedo albedo_of(std::size_t triangle) {
    return static_cast<Albedo>((triangle * 0x9E3779B97F4A7C15u) >> 40) | 0x404040u;
}

Topology topology_of(const FuzzCase& fuzz_case) {
    Topology topology;
    topology.triangles = fuzz_case.triangles;
    for (std::size_t i = 0; i < topology.triangles.size(); ++i)
        topology.albedo.push_back(albedo_of(i));
    topology.vertex_count = static_cast<std::uint32_t>(fuzz_case.poses.front().size());
    return topology;
}

WorldBounds bounds_of(const FuzzCase& fuzz_case) {
    const std::vector<IndexRange> used =
        used_vertices(fuzz_case.triangles, fuzz_case.poses.front().size());
    PoseExtent all;
    for (const std::vector<vec3>& pose : fuzz_case.poses) all.extend(PoseExtent(pose, used));
    return all.bounds(all.limit());
}

SceneSpace space_of(const FuzzCase& fuzz_case, const std::vector<vec3>& world) {
    const PoseExtent pose(world, used_vertices(fuzz_case.triangles, world.size()));
    return space_of_pose(bounds_of(fuzz_case), pose);
}

template <class Vector>
std::string triple(const Vector& v) {
    return fmt::format("{} {} {}", hex_text(v[0]), hex_text(v[1]), hex_text(v[2]));
}

std::string view_text(const ViewSpec& view) {
    std::string text = fmt::format("size {} {}\nrays {}\n", view.width, view.height,
                                   app::name_of_rays(static_cast<morphray::Rays>(view.rays)));
    text += fmt::format("ao {} {}\nfov {}\nup {}\n", view.ao_count, hex_text(view.ao_distance),
                        hex_text(view.fov), triple(view.up));
    if (view.eye) text += fmt::format("eye {}\n", triple(*view.eye));
    if (view.target) text += fmt::format("target {}\n", triple(*view.target));
    if (view.light) text += fmt::format("light {}\n", triple(*view.light));
    return text;
}

/// The words of a line of a case.
class Words {
public:
    explicit Words(std::string line) : line_(std::move(line)), words_(line_) {}

    std::string word() {
        std::string text;
        if (words_ >> text) return text;
        fail();
    }
    [[noreturn]] void fail() const {
        throw Error(ErrorKind::kBadInput, fmt::format("not a line of a case: {}", line_));
    }
    double number() {
        const std::string text = word();
        char* end = nullptr;
        const double x = std::strtod(text.c_str(), &end);
        if (*end != '\0') fail();
        return x;
    }
    std::uint32_t count() {
        std::uint32_t value = 0;
        if (!(words_ >> value)) fail();
        return value;
    }
    Point point() { return Point{number(), number(), number()}; }
    vec3 vertex() { return vec3(to_dvec3(point())); }

private:
    std::string line_;
    std::istringstream words_;
};

void read_line(Words& line, FuzzCase& out) {
    ViewSpec& view = out.view;
    const std::string key = line.word();
    if (key == "size") {
        view.width = line.count();
        view.height = line.count();
    } else if (key == "rays") {
        const std::string name = line.word();
        for (const std::uint32_t kind : {kRaysPrimary, kRaysShadow, kRaysAo})
            if (name == app::name_of_rays(static_cast<morphray::Rays>(kind))) view.rays = kind;
    } else if (key == "ao") {
        view.ao_count = line.count();
        view.ao_distance = line.number();
    } else if (key == "fov") {
        view.fov = line.number();
    } else if (key == "up") {
        view.up = line.point();
    } else if (key == "eye") {
        view.eye = line.point();
    } else if (key == "target") {
        view.target = line.point();
    } else if (key == "light") {
        view.light = line.point();
    } else if (key == "frame") {
        out.frame = line.number();
    } else if (key == "build-at") {
        out.build_at = line.count();
    } else if (key == "pose") {
        out.poses.emplace_back();
    } else if (key == "v" && !out.poses.empty()) {
        out.poses.back().push_back(line.vertex());
    } else if (key == "t") {
        out.triangles.push_back(uvec3{line.count(), line.count(), line.count()});
    } else if (key == "ray") {
        const glm::dvec3 org = to_dvec3(line.point());
        const glm::dvec3 dir = to_dvec3(line.point());
        out.rays.push_back(WorldRay{org, dir, line.number(), line.number()});
    } else if (key == "questions") {
        out.asks_questions = true;
    } else if (key == "point") {
        out.points.push_back(line.vertex());
    } else {
        line.fail();
    }
}

}  // namespace

FuzzScene::FuzzScene(const FuzzCase& fuzz_case) : space(WorldBounds{}) {
    require_sound(fuzz_case);
    topology = topology_of(fuzz_case);
    bounds = bounds_of(fuzz_case);
    const auto go_to = [&](double frame) {
        std::vector<vec3>& at = journey.emplace_back(world_positions(fuzz_case, frame));
        space = space_of(fuzz_case, at);
        space.to_scene(at, at);
    };
    const auto built_at = static_cast<double>(fuzz_case.build_at);
    const double end = fuzz_case.frame;
    const double step = end >= built_at ? 1 : -1;
    for (double frame = built_at; (end - frame) * step > 0; frame += step) go_to(frame);
    go_to(end);
    pose = Pose(positions());
    built = build_bvh(topology, journey.front(), {.threads = 1});
    rebuilt = journey.size() == 1 ? built : build_bvh(topology, positions(), {.threads = 1});
}

std::vector<vec3> world_positions(const FuzzCase& fuzz_case, double frame) {
    const auto before = static_cast<std::size_t>(frame);
    const auto f = static_cast<float>(frame - std::floor(frame));
    std::vector<vec3> positions = fuzz_case.poses[before];
    for (std::size_t i = 0; f > 0 && i < positions.size(); ++i)
        positions[i] += (fuzz_case.poses[before + 1][i] - positions[i]) * f;
    return positions;
}

std::vector<vec3> seen_positions(const FuzzCase& fuzz_case, double frame) {
    std::vector<vec3> positions = world_positions(fuzz_case, frame);
    const SceneSpace space = space_of(fuzz_case, positions);
    for (vec3& p : positions)
        if (!space.keeps(p)) p = vec3(std::numeric_limits<float>::quiet_NaN());
    return positions;
}

std::string to_text(const FuzzCase& fuzz_case, const std::string& remarks) {
    std::string text;
    std::istringstream lines(remarks);
    for (std::string line; std::getline(lines, line);) text += fmt::format("# {}\n", line);
    if (fuzz_case.has_image()) text += view_text(fuzz_case.view);
    text += fmt::format("build-at {}\nframe {}\n", fuzz_case.build_at, hex_text(fuzz_case.frame));
    for (const uvec3& t : fuzz_case.triangles) text += fmt::format("t {} {} {}\n", t.x, t.y, t.z);
    for (const auto& pose : fuzz_case.poses) {
        text += "pose\n";
        for (const vec3& v : pose) text += fmt::format("v {}\n", triple(v));
    }
    for (const WorldRay& ray : fuzz_case.rays)
        text += fmt::format("ray {} {} {} {}\n", triple(ray.org), triple(ray.dir),
                            hex_text(ray.tnear), hex_text(ray.tfar));
    if (fuzz_case.asks_questions) text += "questions\n";
    for (const vec3& p : fuzz_case.points) text += fmt::format("point {}\n", triple(p));
    return text;
}

FuzzCase read_case_file(const std::filesystem::path& path) {
    FuzzCase out;
    out.view.width = out.view.height = 0;
    std::ifstream file(path);
    if (!file) throw Error(ErrorKind::kBadInput, path.string() + " cannot be read");
    for (std::string line; std::getline(file, line);) {
        Words words(line);
        if (!line.empty() && line[0] != '#') read_line(words, out);
    }
    return out;
}

}  // namespace mray::fuzz
