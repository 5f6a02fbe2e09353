#include "lab/methods/rules.h"

#include <cmath>
#include <glm/geometric.hpp>

#include "common/bvh/builder/binary_tree.h"
#include "cpu/image/tile_tracer.h"

namespace mray::lab {
namespace {

using glm::cross;
using glm::dot;

// A rule has a record of each triangle, which is made before; it sets t, u, v and returns whether
// the ray hits at a t above 0.

template <class Real>
struct MoellerTrumbore {
    using Record = PeerTriangle;
    using Vector = glm::vec<3, Real>;

    explicit MoellerTrumbore(const Ray& ray) : org(ray.org), dir(ray.dir) {}

    bool intersect(const Record& triangle, float& t, float& u, float& v) const {
        const Vector a(triangle.a);
        const Vector e1 = Vector(triangle.b) - a;
        const Vector e2 = Vector(triangle.c) - a;
        const Vector p = cross(dir, e2);
        const Real determinant = dot(e1, p);
        if (!(determinant != 0)) return false;
        const Real inverse = 1 / determinant;
        const Vector s = org - a;
        const Real exact_u = dot(s, p) * inverse;
        if (!(exact_u >= 0 && exact_u <= 1)) return false;
        const Vector q = cross(s, e1);
        const Real exact_v = dot(dir, q) * inverse;
        if (!(exact_v >= 0 && exact_u + exact_v <= 1)) return false;
        t = static_cast<float>(dot(e2, q) * inverse);
        u = static_cast<float>(exact_u);
        v = static_cast<float>(exact_v);
        return t > 0;
    }

    Vector org, dir;
};

/// A record maps the triangle to the unit triangle of the plane z = 0, by three rows of an affine
/// matrix; one column of each is fixed by the normal's largest component.
struct BaldwinWeber {
    struct Record {
        explicit Record(const PeerTriangle& triangle);
        float row[3][4] = {};
    };

    explicit BaldwinWeber(const Ray& from) : ray(from) {}

    bool intersect(const Record& record, float& t, float& u, float& v) const {
        const auto along = [](const float(&row)[4], vec3 p) {
            return row[0] * p.x + row[1] * p.y + row[2] * p.z;
        };
        const auto& row = record.row;
        t = -(along(row[2], ray.org) + row[2][3]) / along(row[2], ray.dir);
        if (!(t > 0)) return false;
        const vec3 at = ray.org + t * ray.dir;
        u = along(row[0], at) + row[0][3];
        v = along(row[1], at) + row[1][3];
        return u >= 0 && v >= 0 && u + v <= 1;
    }

    const Ray& ray;
};

BaldwinWeber::Record::Record(const PeerTriangle& triangle) {
    const auto& [a, b, c, prim_id] = triangle;
    const vec3 e1 = b - a;
    const vec3 e2 = c - a;
    const vec3 n = cross(e1, e2);
    int z = 0;
    for (int axis = 1; axis < 3; ++axis)
        if (std::fabs(n[axis]) > std::fabs(n[z])) z = axis;
    const int x = (z + 1) % 3;
    const int y = (z + 2) % 3;
    // No area: nothing is hit, as all distances are 0 or NaN.
    if (!(n[z] != 0)) return;
    const float inverse = 1 / n[z];
    row[0][x] = e2[y] * inverse;
    row[0][y] = -e2[x] * inverse;
    row[0][3] = cross(c, a)[z] * inverse;
    row[1][x] = -e1[y] * inverse;
    row[1][y] = e1[x] * inverse;
    row[1][3] = -cross(b, a)[z] * inverse;
    row[2][x] = n[x] * inverse;
    row[2][y] = n[y] * inverse;
    row[2][z] = 1;
    row[2][3] = -dot(a, n) * inverse;
}

/// Falls back to double precision if an edge function is 0, as the paper does.
class WoopWatertight {
public:
    using Record = PeerTriangle;

    explicit WoopWatertight(const Ray& ray) : org_(ray.org) {
        const vec3 d = ray.dir;
        const vec3 size(std::abs(d.x), std::abs(d.y), std::abs(d.z));
        kz_ = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
        kx_ = (kz_ + 1) % 3;
        ky_ = (kx_ + 1) % 3;
        if (d[kz_] < 0) std::swap(kx_, ky_);
        sx_ = d[kx_] / d[kz_];
        sy_ = d[ky_] / d[kz_];
        sz_ = 1 / d[kz_];
    }

    bool intersect(const Record& triangle, float& t, float& u, float& v) const {
        const vec3 a = triangle.a - org_;
        const vec3 b = triangle.b - org_;
        const vec3 c = triangle.c - org_;
        const float ax = a[kx_] - sx_ * a[kz_];
        const float ay = a[ky_] - sy_ * a[kz_];
        const float bx = b[kx_] - sx_ * b[kz_];
        const float by = b[ky_] - sy_ * b[kz_];
        const float cx = c[kx_] - sx_ * c[kz_];
        const float cy = c[ky_] - sy_ * c[kz_];
        float eu = cx * by - cy * bx;
        float ev = ax * cy - ay * cx;
        float ew = bx * ay - by * ax;
        if (eu == 0 || ev == 0 || ew == 0) {
            const auto exact = [](float p, float q, float r, float s) {
                return static_cast<float>(double{p} * q - double{r} * s);
            };
            eu = exact(cx, by, cy, bx);
            ev = exact(ax, cy, ay, cx);
            ew = exact(bx, ay, by, ax);
        }
        if ((eu < 0 || ev < 0 || ew < 0) && (eu > 0 || ev > 0 || ew > 0)) return false;
        const float determinant = eu + ev + ew;
        if (!(determinant != 0)) return false;
        const float scaled = dot(vec3(eu, ev, ew), vec3(sz_ * a[kz_], sz_ * b[kz_], sz_ * c[kz_]));
        const float inverse = 1 / determinant;
        t = scaled * inverse;
        u = ev * inverse;
        v = ew * inverse;
        return t > 0;
    }

private:
    vec3 org_;
    int kx_, ky_, kz_;
    float sx_, sy_, sz_;
};

/// The usual slab test, far ends enlarged by 2 ulp (T. Ize. Robust BVH ray traversal. JCGT 2013).
bool meets(const PeerNode& node, vec3 org, vec3 rdir, float& t_enter) {
    constexpr float kPad = 1.00000024f;
    t_enter = 0;
    float leave = std::numeric_limits<float>::infinity();
    for (int axis = 0; axis < 3; ++axis) {
        float t0 = (node.lower[axis] - org[axis]) * rdir[axis];
        float t1 = (node.upper[axis] - org[axis]) * rdir[axis];
        if (rdir[axis] < 0) std::swap(t0, t1);
        // A NaN (0 times infinity: the ray runs in the plane) has no effect.
        t_enter = t0 > t_enter ? t0 : t_enter;
        leave = t1 * kPad < leave ? t1 * kPad : leave;
    }
    return t_enter <= leave;
}

/// Single rays in a binary tree, the nearer child first, by a rule over records of its triangles.
template <class Rule>
class RuleTracer {
public:
    explicit RuleTracer(const PeerTree& tree)
        : tree_(&tree), records_(tree.triangles.begin(), tree.triangles.end()) {}

    /// The nearest hit, of equal ones that with the smaller prim_id.
    Hit intersect(const Ray& ray) const {
        Hit best = no_hit();
        float best_t = ray.tfar;
        traverse(ray, [&](const Hit& hit) {
            if (hit.t < best_t || (hit.t == best_t && hit.prim_id < best.prim_id)) best = hit;
            best_t = std::min(best_t, hit.t);
            return best_t;
        });
        return best;
    }

    bool occluded(const Ray& ray) const {
        bool found = false;
        traverse(ray, [&](const Hit&) {
            found = true;
            return -1.0f;
        });
        return found;
    }

private:
    struct Entry {
        float t_enter;
        std::uint32_t node;
    };

    /// visit(hit) returns the depth beyond which nothing is of interest any more.
    template <class Visit>
    void traverse(const Ray& ray, Visit visit) const {
        if (tree_->nodes.empty() || ray.dir == vec3(0, 0, 0)) return;
        const Rule rule(ray);
        const vec3 rdir(1 / ray.dir.x, 1 / ray.dir.y, 1 / ray.dir.z);
        float last = ray.tfar;
        std::array<Entry, kMaxBinaryHeight + 2> stack;
        std::size_t size = 0;
        stack[size++] = {0, 0};
        while (size != 0) {
            const Entry entry = stack[--size];
            if (entry.t_enter > last) continue;
            const PeerNode& node = tree_->nodes[entry.node];
            for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
                Hit hit;
                hit.prim_id = tree_->triangles[i].prim_id;
                if (rule.intersect(records_[i], hit.t, hit.u, hit.v) && hit.t >= ray.tnear &&
                    hit.t <= last)
                    last = visit(hit);
            }
            if (node.count != 0) continue;
            Entry near{0, node.first};
            Entry far{0, node.first + 1};
            const bool meets_near = meets(tree_->nodes[near.node], ray.org, rdir, near.t_enter);
            const bool meets_far = meets(tree_->nodes[far.node], ray.org, rdir, far.t_enter);
            if (meets_near && meets_far && far.t_enter < near.t_enter) std::swap(near, far);
            if (meets_far) stack[size++] = far;
            if (meets_near) stack[size++] = near;
        }
    }

    const PeerTree* tree_;
    std::vector<typename Rule::Record> records_;
};

template <class Rule>
Tracer tracer_by(const char* name, const PeerTree& tree, const RaySet& set) {
    using OneByOne = cpu::OneByOne<RuleTracer<Rule>>;
    return batch_tracer(name, RaysAtOnce::kOne,
                        std::make_shared<const OneByOne>(RuleTracer<Rule>(tree)), set);
}

}  // namespace

std::vector<Tracer> rule_tracers(const PeerTree& tree, const RaySet& set) {
    return {tracer_by<MoellerTrumbore<float>>("Moeller-Trumbore", tree, set),
            tracer_by<WoopWatertight>("Woop", tree, set),
            tracer_by<BaldwinWeber>("Baldwin-Weber", tree, set),
            tracer_by<MoellerTrumbore<double>>("double", tree, set)};
}

}  // namespace mray::lab
