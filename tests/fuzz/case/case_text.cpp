#include "tests/fuzz/case/case_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <sstream>
#include <system_error>
#include <type_traits>

#include "app/base/options.h"
#include "common/base/errors.h"
#include "common/text/number_text.h"

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
    std::string text =
        fmt::format("size {} {}\nrays {}\n", view.width, view.height, app::name_of_rays(view.rays));
    text += fmt::format("ao {} {}\nfov {}\nup {}\n", view.ao_count, number(view.ao_distance),
                        number(view.fov), triple(view.up));
    if (view.eye) text += fmt::format("eye {}\n", triple(*view.eye));
    if (view.target) text += fmt::format("target {}\n", triple(*view.target));
    if (view.light) text += fmt::format("light {}\n", triple(*view.light));
    return text;
}

/// Reads a case line by line; skips blank lines and comments.
class Reader {
public:
    Reader(std::string_view text, std::string name)
        : stream_(std::string(text)), name_(std::move(name)) {}

    FuzzCase read() {
        FuzzCase result;
        result.view.width = result.view.height = 0;
        std::string key;
        while (next_line(key)) read_key(key, result);
        return result;
    }

private:
    [[noreturn]] void fail(const std::string& what) const {
        throw Error(ErrorKind::kBadInput, fmt::format("{}:{}: {}", name_, line_number_, what));
    }

    bool next_line(std::string& key) {
        std::string line;
        while (std::getline(stream_, line)) {
            ++line_number_;
            line_ = std::istringstream(line);
            if (line_ >> key && key[0] != '#') return true;
        }
        return false;
    }

    std::string word() {
        std::string text;
        if (!(line_ >> text)) fail("the line ends too early");
        return text;
    }
    template <class Float>
    Float read_number() {
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
        char* end = nullptr;
        const auto value = std::strtoul(text.c_str(), &end, 10);
        if (*end != '\0' || value > 0xFFFFFFFFu) fail(fmt::format("'{}' is not a count", text));
        return static_cast<std::uint32_t>(value);
    }
    Point point() {
        return Point{read_number<double>(), read_number<double>(), read_number<double>()};
    }

    std::uint32_t ray_kind() {
        const std::string text = word();
        for (const std::uint32_t kind : {kRaysPrimary, kRaysShadow, kRaysAo})
            if (text == app::name_of_rays(kind)) return kind;
        fail(fmt::format("'{}' is neither primary nor shadow nor ao", text));
    }

    void read_key(const std::string& key, FuzzCase& out) {
        ViewSpec& view = out.view;
        if (key == "cause") {
            // Earlier versions told how a case was made.
        } else if (key == "size") {
            view.width = count();
            view.height = count();
        } else if (key == "rays") {
            view.rays = ray_kind();
        } else if (key == "ao") {
            view.ao_count = count();
            view.ao_distance = read_number<double>();
        } else if (key == "fov") {
            view.fov = read_number<double>();
        } else if (key == "up") {
            view.up = point();
        } else if (key == "eye") {
            view.eye = point();
        } else if (key == "target") {
            view.target = point();
        } else if (key == "light") {
            view.light = point();
        } else {
            read_mesh_key(key, out);
        }
    }

    void read_mesh_key(const std::string& key, FuzzCase& out) {
        if (key == "frame") {
            out.frame = read_number<double>();
        } else if (key == "build-at") {
            out.build_at = count();
        } else if (key == "pose") {
            out.poses.emplace_back();
        } else if (key == "v") {
            if (out.poses.empty()) fail("a vertex before the first pose");
            out.poses.back().push_back(
                vec3{read_number<float>(), read_number<float>(), read_number<float>()});
        } else if (key == "t") {
            out.triangles.push_back(uvec3{count(), count(), count()});
        } else if (key == "ray") {
            WorldRay ray = {};
            for (double& x : ray.org) x = read_number<double>();
            for (double& x : ray.dir) x = read_number<double>();
            ray.tnear = read_number<double>();
            ray.tfar = read_number<double>();
            out.rays.push_back(ray);
        } else if (key == "questions") {
            out.asks_questions = true;
        } else if (key == "point") {
            out.points.push_back(
                vec3{read_number<float>(), read_number<float>(), read_number<float>()});
        } else {
            fail(fmt::format("'{}' is not known", key));
        }
    }

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
    return Reader(text, name).read();
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
