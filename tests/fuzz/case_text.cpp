#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <iterator>
#include <map>
#include <sstream>
#include <type_traits>

#include "app/base/options.h"
#include "common/base/errors.h"
#include "common/text/text.h"
#include "tests/fuzz/case.h"

namespace mray::fuzz {
namespace {

template <class Float>
using BitsOf = std::conditional_t<sizeof(Float) == 4, std::uint32_t, std::uint64_t>;

template <class Float>
std::string number(Float x) {
    if (std::isnan(x)) return fmt::format("bits:{:x}", std::bit_cast<BitsOf<Float>>(x));
    return hex_text(x);
}

template <class Vector>
std::string triple(const Vector& v) {
    return fmt::format("{} {} {}", number(v[0]), number(v[1]), number(v[2]));
}

std::string view_text(const ViewSpec& view) {
    std::string text = fmt::format("size {} {}\nrays {}\n", view.width, view.height,
                                   app::name_of_rays(static_cast<morphray::Rays>(view.rays)));
    text += fmt::format("ao {} {}\nfov {}\nup {}\n", view.ao_count, number(view.ao_distance),
                        number(view.fov), triple(view.up));
    if (view.eye) text += fmt::format("eye {}\n", triple(*view.eye));
    if (view.target) text += fmt::format("target {}\n", triple(*view.target));
    if (view.light) text += fmt::format("light {}\n", triple(*view.light));
    return text;
}

/// The lines of a case, without blank ones and comments.
class Lines {
public:
    Lines(std::string_view text, std::string name)
        : stream_(std::string(text)), name_(std::move(name)) {}

    bool next(std::string& key) {
        std::string line;
        while (std::getline(stream_, line)) {
            ++line_number_;
            line_ = std::istringstream(line);
            if (line_ >> key && key[0] != '#') return true;
        }
        return false;
    }

    [[noreturn]] void fail(const std::string& what) const {
        throw Error(ErrorKind::kBadInput, fmt::format("{}:{}: {}", name_, line_number_, what));
    }

    std::string word() {
        std::string text;
        if (!(line_ >> text)) fail("the line ends too early");
        return text;
    }
    template <class Float>
    Float number() {
        const std::string text = word();
        char* end = nullptr;
        if (text.starts_with("bits:")) {
            const auto bits = std::strtoull(text.c_str() + 5, &end, 16);
            if (*end == '\0') return std::bit_cast<Float>(static_cast<BitsOf<Float>>(bits));
        } else {
            const Float x = sizeof(Float) == 4
                                ? static_cast<Float>(std::strtof(text.c_str(), &end))
                                : static_cast<Float>(std::strtod(text.c_str(), &end));
            if (end != text.c_str() && *end == '\0') return x;
        }
        fail(fmt::format("'{}' is not a number", text));
    }
    std::uint32_t count() {
        const std::string text = word();
        const auto value = parse_unsigned(text);
        if (!value || *value > 0xFFFFFFFFu) fail(fmt::format("'{}' is not a count", text));
        return static_cast<std::uint32_t>(*value);
    }
    Point point() { return Point{number<double>(), number<double>(), number<double>()}; }
    vec3 vertex() { return vec3{number<float>(), number<float>(), number<float>()}; }

    std::uint32_t ray_kind() {
        const std::string text = word();
        for (const std::uint32_t kind : {kRaysPrimary, kRaysShadow, kRaysAo})
            if (text == app::name_of_rays(static_cast<morphray::Rays>(kind))) return kind;
        fail(fmt::format("'{}' is neither primary nor shadow nor ao", text));
    }

    WorldRay ray() {
        WorldRay ray = {};
        for (int axis = 0; axis < 3; ++axis) ray.org[axis] = number<double>();
        for (int axis = 0; axis < 3; ++axis) ray.dir[axis] = number<double>();
        ray.tnear = number<double>();
        ray.tfar = number<double>();
        return ray;
    }

private:
    std::istringstream stream_;
    std::istringstream line_;
    std::string name_;
    int line_number_ = 0;
};

}  // namespace

std::string to_text(const FuzzCase& fuzz_case, const std::string& remarks) {
    std::string text;
    std::istringstream lines(remarks);
    for (std::string line; std::getline(lines, line);) text += fmt::format("# {}\n", line);
    if (fuzz_case.has_image()) text += view_text(fuzz_case.view);
    text += fmt::format("build-at {}\nframe {}\n", fuzz_case.build_at, number(fuzz_case.frame));
    for (const uvec3& t : fuzz_case.triangles) text += fmt::format("t {} {} {}\n", t.x, t.y, t.z);
    for (const auto& pose : fuzz_case.poses) {
        text += "pose\n";
        for (const vec3& v : pose) text += fmt::format("v {}\n", triple(v));
    }
    for (const WorldRay& ray : fuzz_case.rays)
        text += fmt::format("ray {} {} {} {}\n", triple(ray.org), triple(ray.dir),
                            number(ray.tnear), number(ray.tfar));
    if (fuzz_case.asks_questions) text += "questions\n";
    for (const vec3& p : fuzz_case.points) text += fmt::format("point {}\n", triple(p));
    return text;
}

FuzzCase read_case(std::string_view text, const std::string& name) {
    FuzzCase out;
    ViewSpec& view = out.view;
    view.width = view.height = 0;
    Lines line(text, name);
    const std::map<std::string, std::function<void()>> readers = {
        {"size",
         [&] {
             view.width = line.count();
             view.height = line.count();
         }},
        {"rays", [&] { view.rays = line.ray_kind(); }},
        {"ao",
         [&] {
             view.ao_count = line.count();
             view.ao_distance = line.number<double>();
         }},
        {"fov", [&] { view.fov = line.number<double>(); }},
        {"up", [&] { view.up = line.point(); }},
        {"eye", [&] { view.eye = line.point(); }},
        {"target", [&] { view.target = line.point(); }},
        {"light", [&] { view.light = line.point(); }},
        {"frame", [&] { out.frame = line.number<double>(); }},
        {"build-at", [&] { out.build_at = line.count(); }},
        {"pose", [&] { out.poses.emplace_back(); }},
        {"v",
         [&] {
             if (out.poses.empty()) line.fail("a vertex before the first pose");
             out.poses.back().push_back(line.vertex());
         }},
        {"t",
         [&] {
             out.triangles.push_back(uvec3{line.count(), line.count(), line.count()});
         }},
        {"ray", [&] { out.rays.push_back(line.ray()); }},
        {"questions", [&] { out.asks_questions = true; }},
        {"point", [&] { out.points.push_back(line.vertex()); }}};
    for (std::string key; line.next(key);) {
        const auto reader = readers.find(key);
        if (reader == readers.end()) line.fail(fmt::format("'{}' is not known", key));
        reader->second();
    }
    return out;
}

FuzzCase read_case_file(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    const std::string text((std::istreambuf_iterator<char>(file)),
                           std::istreambuf_iterator<char>());
    if (!file || text.empty())
        throw Error(
            ErrorKind::kBadInput,
            fmt::format("{} cannot be read or is empty; give a case's text file", path.string()));
    return read_case(text, path.string());
}

}  // namespace mray::fuzz
