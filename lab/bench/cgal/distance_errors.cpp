// morphray_distance_errors DIR [SCENE...]: how far distances to the closest point are from those of
// exact arithmetic, by CGAL's kernel of exact constructions: ours, Embree's point query with
// Ericson's method, CGAL's AABB_tree of doubles. Prints a row for each scene and kind of points;
// DIR/K.* have what another program needs to add its errors (lab/bench/distances).
#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Exact_predicates_exact_constructions_kernel.h>
#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <functional>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "common/base/errors.h"
#include "common/base/output_file.h"
#include "common/interop/hit_rule.h"
#include "lab/bench/bench_scene.h"
#include "lab/bench/cgal/cgal_tree.h"
#include "lab/bench/embree/embree_questions.h"
#include "lab/bench/questions/question_work.h"
#include "lab/bench/user_scene.h"

namespace mray::bench {
namespace {

constexpr std::size_t kPoints = 4000;
constexpr int kTriangles = 2000;

using Kernel = CGAL::Exact_predicates_exact_constructions_kernel;
using Triangles = std::vector<Kernel::Triangle_3>;
using Primitive = CGAL::AABB_triangle_primitive<Kernel, Triangles::const_iterator>;
using Tree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>>;

Kernel::Point_3 to_cgal(vec3 p) { return {p.x, p.y, p.z}; }

/// A soup of triangles as an OBJ file. The third corner is beside the first edge, `thin` of its
/// length away: between its ends (caps), or at one of them (needles).
std::string thin_triangles(bool are_caps) {
    std::mt19937 random(1);
    const auto unit = [&] { return static_cast<double>(random()) * 0x1p-31 - 1; };
    std::string text;
    for (int i = 0; i < kTriangles; ++i) {
        const double centre[3] = {unit(), unit(), unit()};
        const double edge[3] = {unit(), unit(), unit()};
        const double aside[3] = {unit(), unit(), unit()};
        const double thin = std::exp2(-20 * (unit() + 1) / 2);
        const double at = are_caps ? (unit() + 1) / 2 : 0;
        for (const auto& [along, across] : {std::pair(0.0, 0.0), {1.0, 0.0}, {at, thin}}) {
            text += "v";
            for (int k = 0; k < 3; ++k)
                text += fmt::format(" {:.9g}", centre[k] + along * edge[k] + across * aside[k]);
            text += "\n";
        }
        text += "f -3 -2 -1\n";
    }
    return text;
}

/// The exact distance of a point, and that of the farthest corner of the closest triangle.
struct Exact {
    double distance;
    double size;
};

std::vector<Exact> exact_distances(const BenchScene& scene, std::span<const vec3> points) {
    Triangles triangles;
    for (const uvec3& t : scene.topology().triangles) {
        const vec3 corners[3] = {scene.positions[t.x], scene.positions[t.y], scene.positions[t.z]};
        const Kernel::Triangle_3 triangle(to_cgal(corners[0]), to_cgal(corners[1]),
                                          to_cgal(corners[2]));
        if (!finite_vertices(corners[0], corners[1], corners[2])) continue;
        if (triangle.is_degenerate())
            throw Error(ErrorKind::kBadInput, scene.name + ": CGAL takes no triangle without area");
        triangles.push_back(triangle);
    }
    Tree tree(triangles.cbegin(), triangles.cend());
    tree.accelerate_distance_queries();
    std::vector<Exact> exact;
    for (const vec3& p : points) {
        const Kernel::Point_3 point = to_cgal(p);
        const auto [place, triangle] = tree.closest_point_and_primitive(point);
        double size = 0;
        for (int i = 0; i < 3; ++i) {
            const auto d2 = CGAL::squared_distance(point, triangle->vertex(i));
            size = std::max(size, std::sqrt(CGAL::to_double(d2)));
        }
        exact.push_back({std::sqrt(CGAL::to_double(CGAL::squared_distance(point, place))), size});
    }
    return exact;
}

/// "largest error by the size, in 2^-24; largest error by the distance"
std::string error_text(std::span<const Exact> exact, std::span<const float> distances) {
    double by_size = 0;
    double by_distance = 0;
    for (std::size_t i = 0; i < exact.size(); ++i) {
        const double error = std::abs(distances[i] - exact[i].distance);
        by_size = std::max(by_size, error / exact[i].size);
        if (error > 0) by_distance = std::max(by_distance, error / exact[i].distance);
    }
    return fmt::format("{:.3g}; {:.1g}", by_size * 0x1p+24, by_distance);
}

template <class Values>
void write(const std::filesystem::path& path, const Values& values) {
    const auto bytes = std::as_bytes(std::span(values));
    write_file(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

class Errors {
public:
    explicit Errors(std::filesystem::path folder) : folder_(std::move(folder)) {}

    void measure(const std::string& spec, const std::string& name) {
        const BenchScene scene = open_bench_scene(spec, ViewKind::kFill, {});
        const EmbreeMesh mesh(scene.topology(), scene.positions);
        const EmbreeQuestions embree(device_, mesh, true, 0);
        const std::unique_ptr<CgalTree> cgal = make_cgal_tree(scene);
        const std::vector<morphray::Vec3> vertices = to_user(scene.positions);
        const auto& triangles = scene.topology().triangles;
        const auto ours =
            morphray::Scene::build({.positions = morphray::packed(vertices),
                                    .triangles = {&triangles.data()->x, 3 * triangles.size()}},
                                   morphray::Device::cpu({.threads = 1}), {.bounds = kUserBounds});
        for (const bool near : {true, false}) {
            const std::vector<vec3> points =
                near ? points_near_surface(scene, kPoints) : points_in_box(scene, kPoints);
            const std::vector<Exact> exact = exact_distances(scene, points);
            std::vector<morphray::ClosestPoint> found(points.size());
            ours.closest_points(to_user(points), found);
            std::vector<float> distances;
            for (const auto& one : found) distances.push_back(one.distance);
            std::string row = fmt::format("{} | {} | {}", name, near ? "near" : "in its box",
                                          error_text(exact, distances));
            std::vector<NearestPoint> theirs(points.size());
            const auto add = [&] {
                for (std::size_t i = 0; i < points.size(); ++i) distances[i] = theirs[i].distance;
                row += " | " + error_text(exact, distances);
            };
            embree.find_closest(points, theirs);
            add();
            cgal->find_closest(points, theirs);
            add();
            std::printf("%s\n", row.c_str());
            std::fflush(stdout);
            const std::string k = std::to_string(rows_++);
            write(folder_ / (k + ".vertices"), scene.positions);
            write(folder_ / (k + ".triangles"), triangles);
            write(folder_ / (k + ".points"), points);
            write(folder_ / (k + ".exact"), exact);
        }
    }

private:
    std::filesystem::path folder_;
    EmbreeDevice device_{1, "", ""};
    int rows_ = 0;
};

}  // namespace
}  // namespace mray::bench

int main(int argc, char** argv) {
    using namespace mray::bench;
    if (argc < 2) return 2;
    try {
        const std::filesystem::path folder = argv[1];
        Errors errors(folder);
        for (const bool are_caps : {false, true}) {
            const std::string name = are_caps ? "caps" : "needles";
            mray::write_file(folder / (name + ".obj"), thin_triangles(are_caps));
            errors.measure((folder / (name + ".obj")).string(), name);
        }
        for (int i = 2; i < argc; ++i) errors.measure(argv[i], argv[i]);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "distance_errors: %s\n", error.what());
        return 1;
    }
    return 0;
}
