#include "accuracy/suspect/reproducer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <iterator>
#include <map>
#include <numeric>
#include <set>

#include "common/bvh/builder/bvh_builder.h"

namespace mray::accuracy {
namespace {

using Prims = std::vector<std::uint32_t>;

/// Whether triangles without the neighbours of an edge would show the same fault without being
/// wrong.
bool is_of_crossings(Fault fault) {
    return fault == Fault::kLostCrossing || fault == Fault::kDoubleCrossing;
}

/// The mesh of some triangles, with the vertices that they use.
Reproducer part_of(const PosedMesh& mesh, const Prims& prims, const Ray& ray) {
    Reproducer part;
    part.ray = ray;
    part.prim_ids = prims;
    std::map<std::uint32_t, std::uint32_t> renamed;
    for (const std::uint32_t prim : prims) {
        uvec3 triangle = mesh.topology.triangles[prim];
        for (int corner = 0; corner < 3; ++corner) {
            const auto [place, is_new] =
                renamed.try_emplace(triangle[corner], static_cast<std::uint32_t>(renamed.size()));
            if (is_new) part.positions.push_back(mesh.positions[triangle[corner]]);
            triangle[corner] = place->second;
        }
        part.topology.triangles.push_back(triangle);
        part.topology.albedo.push_back(kDefaultAlbedo);
    }
    part.topology.vertex_count = static_cast<std::uint32_t>(part.positions.size());
    return part;
}

class Shrinker {
public:
    Shrinker(DriverRays& suspect, Backend& ours, const PosedMesh& mesh, const Ray& ray,
             const Finding& finding, const std::function<void()>& check, std::size_t most_tries)
        : suspect_(suspect),
          ours_(ours),
          mesh_(mesh),
          ray_(ray),
          finding_(finding),
          check_(check),
          tries_left_(most_tries) {
        const std::size_t triangles = mesh.topology.triangles.size();
        for (const std::uint32_t prim :
             {finding.answered.prim_id, finding.ruled.prim_id, finding.truth.prim_id})
            if (prim < triangles) concerned_.insert(prim);
        if (finding.fault == Fault::kHole && finding.truth.hit())
            keep_neighbours({finding.truth.prim_id});
        if (!is_of_crossings(finding.fault)) return;
        for (const Prims* const prims : {&finding.answered_prims, &finding.ruled_prims})
            for (const std::uint32_t prim : *prims)
                if (prim < triangles) kept_.insert(prim);
        if (finding.fault != Fault::kLostCrossing) return;
        std::set<std::uint32_t> missing;
        std::ranges::set_difference(finding.ruled_prims, finding.answered_prims,
                                    std::inserter(missing, missing.end()));
        keep_neighbours(missing);
    }

    std::optional<Reproducer> shrink() {
        Prims prims = neighbours(concerned_);
        if (!tries(prims)) {
            prims.resize(mesh_.topology.triangles.size());
            std::iota(prims.begin(), prims.end(), 0u);
            if (!tries(prims)) return std::nullopt;
        }
        for (std::size_t chunk = (prims.size() + 1) / 2; chunk > 0; chunk /= 2) {
            for (std::size_t first = 0; first < prims.size() && tries_left_ > 0;) {
                if (!leaves_out(prims, first, chunk)) first += chunk;
            }
        }
        return best_;
    }

private:
    /// Keeps the triangles near the ray that might have been hit instead of these.
    void keep_neighbours(const std::set<std::uint32_t>& prims) {
        for (const std::uint32_t prim : neighbours(prims)) {
            const uvec3 t = mesh_.topology.triangles[prim];
            const ExactTriangle triangle(ray_, mesh_.positions[t.x], mesh_.positions[t.y],
                                         mesh_.positions[t.z]);
            if (triangle.edge_distance() * triangle.size() <= precision_of(ray_))
                kept_.insert(prim);
        }
    }

    /// The triangles that share a vertex with these, and those that are kept.
    Prims neighbours(const std::set<std::uint32_t>& of) const {
        std::set<std::uint32_t> vertices;
        for (const std::uint32_t prim : of) {
            const uvec3 t = mesh_.topology.triangles[prim];
            vertices.insert({t.x, t.y, t.z});
        }
        Prims prims;
        for (std::uint32_t prim = 0; prim < mesh_.topology.triangles.size(); ++prim) {
            const uvec3 t = mesh_.topology.triangles[prim];
            if (vertices.contains(t.x) || vertices.contains(t.y) || vertices.contains(t.z) ||
                kept_.contains(prim))
                prims.push_back(prim);
        }
        return prims;
    }

    bool leaves_out(Prims& prims, std::size_t first, std::size_t count) {
        Prims fewer;
        for (std::size_t i = 0; i < prims.size(); ++i) {
            const bool is_out = i >= first && i < first + count && !kept_.contains(prims[i]);
            if (!is_out) fewer.push_back(prims[i]);
        }
        if (fewer.size() == prims.size() || fewer.empty() || !tries(fewer)) return false;
        prims = std::move(fewer);
        return true;
    }

    /// Whether the fault is still there; keeps the reproducer if so.
    bool tries(const Prims& prims) {
        if (prims.empty() || tries_left_ == 0) return false;
        --tries_left_;
        check_();
        Reproducer part = part_of(mesh_, prims, ray_);
        const Bvh bvh = build_bvh(part.topology, part.positions);
        suspect_.set_scene(part.topology, part.positions);
        ours_.set_scene(part.topology, part.positions, bvh);
        const PosedMesh posed{part.topology, part.positions, bvh, mesh_.closed};
        const Judged judged =
            judge_suspect(suspect_, ours_, posed, std::span(&part.ray, 1), std::size_t{1});
        if (judged.findings.empty() || judged.findings.front().fault != finding_.fault)
            return false;
        part.finding = judged.findings.front();
        best_ = std::move(part);
        return true;
    }

    DriverRays& suspect_;
    Backend& ours_;
    const PosedMesh& mesh_;
    const Ray& ray_;
    const Finding& finding_;
    const std::function<void()>& check_;
    std::size_t tries_left_;
    std::set<std::uint32_t> concerned_;
    std::set<std::uint32_t> kept_;
    std::optional<Reproducer> best_;
};

std::string literal(float x) {
    // fmt writes 0 as a denormal.
    char text[32];
    std::snprintf(text, sizeof text, "%af", static_cast<double>(x));
    return text;
}
std::string literal(vec3 p) {
    return fmt::format("{{{}, {}, {}}}", literal(p.x), literal(p.y), literal(p.z));
}
std::string decimal(vec3 p) { return fmt::format("{} {} {}", p.x, p.y, p.z); }

std::string answer_text(const Hit& hit) {
    if (hit.prim_id == kNoPrim) return "a miss";
    return fmt::format("triangle {}, t {}, u {}, v {}", hit.prim_id, hit.t, hit.u, hit.v);
}

}  // namespace

std::optional<Reproducer> shrink(DriverRays& suspect, Backend& ours, const PosedMesh& mesh,
                                 const Ray& ray, const Finding& finding,
                                 const std::function<void()>& check, std::size_t most_tries) {
    return Shrinker(suspect, ours, mesh, ray, finding, check, most_tries).shrink();
}

std::string describe(const Finding& finding) {
    const std::string exact =
        finding.truth.hit()
            ? fmt::format("triangle {}, t {:.9g}", finding.truth.prim_id, finding.truth.t)
            : std::string("a miss");
    const bool is_of_lists = finding.fault >= Fault::kLostCrossing;
    if (!is_of_lists) {
        return fmt::format("exactly: {}; driver: {}; our rule: {}", exact,
                           answer_text(finding.answered), answer_text(finding.ruled));
    }
    return fmt::format("all hits of the driver: [{}]; of our rule, each edge with one owner: [{}]",
                       fmt::join(finding.answered_prims, ", "),
                       fmt::join(finding.ruled_prims, ", "));
}

std::string text_of(const Reproducer& reproducer, const std::string& origin,
                    const std::string& driver) {
    const Finding& finding = reproducer.finding;
    std::string text =
        fmt::format("// {}: {}.\n// Driver: {}\n// Found: {}\n// {}\n", name_of(finding.fault),
                    meaning_of(finding.fault), driver, origin, describe(finding));
    text += fmt::format("static const float vertices[{}][3] = {{\n", reproducer.positions.size());
    for (const vec3& p : reproducer.positions)
        text += fmt::format("    {},  // {}\n", literal(p), decimal(p));
    text += fmt::format("}};\nstatic const uint32_t triangles[{}][3] = {{\n",
                        reproducer.topology.triangles.size());
    for (std::size_t i = 0; i < reproducer.topology.triangles.size(); ++i) {
        const uvec3 t = reproducer.topology.triangles[i];
        text += fmt::format("    {{{}, {}, {}}},  // {} of the mesh\n", t.x, t.y, t.z,
                            reproducer.prim_ids[i]);
    }
    const Ray& ray = reproducer.ray;
    text += fmt::format(
        "}};\nstatic const float origin[3] = {};  // {}\nstatic const float direction[3] = {};  // "
        "{}\nstatic const float t_min = {}, t_max = {};\n",
        literal(ray.org), decimal(ray.org), literal(ray.dir), decimal(ray.dir), literal(ray.tnear),
        literal(ray.tfar));
    return text;
}

}  // namespace mray::accuracy
