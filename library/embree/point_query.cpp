// rtcPointQuery: the primitives near a point, handed to the functions of the caller.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include <glm/geometric.hpp>

#include "library/embree/scene.h"

namespace mray::embree {

using Function = RTCPointQueryFunction;

struct PrimBox : Bounds {
    /// The mesh in Committed::parts, and its primitive.
    std::uint32_t part;
    std::uint32_t prim_id;
};

/// A binary tree over medians of the longest axis; a node [first, last) has the middle's number.
class BoxTree {
public:
    explicit BoxTree(std::vector<PrimBox> boxes);

    /// The nearer half of each node comes first. `radius` is read again after each call.
    template <class Visit>
    void visit_near(const glm::vec3& point, const float& radius, Visit visit) const {
        if (!boxes_.empty()) visit_range(0, boxes_.size(), point, radius, visit);
    }

private:
    static constexpr std::size_t kLeaf = 4;

    void build(std::size_t first, std::size_t last);
    template <class Visit>
    void visit_range(std::size_t first, std::size_t last, const glm::vec3& point,
                     const float& radius, Visit& visit) const {
        const auto is_near = [&](float distance2) { return distance2 <= radius * radius; };
        if (last - first <= kLeaf) {
            for (std::size_t i = first; i < last; ++i)
                if (is_near(boxes_[i].distance2(point))) visit(boxes_[i]);
            return;
        }
        const std::size_t middle = first + (last - first) / 2;
        const float left = distance2(first, middle, point);
        const float right = distance2(middle, last, point);
        if (left <= right) {
            if (is_near(left)) visit_range(first, middle, point, radius, visit);
            if (is_near(right)) visit_range(middle, last, point, radius, visit);
        } else {
            if (is_near(right)) visit_range(middle, last, point, radius, visit);
            if (is_near(left)) visit_range(first, middle, point, radius, visit);
        }
    }
    float distance2(std::size_t first, std::size_t last, const glm::vec3& point) const {
        return last - first <= kLeaf ? 0 : bounds_[first + (last - first) / 2].distance2(point);
    }

    std::vector<PrimBox> boxes_;
    /// By node.
    std::vector<Bounds> bounds_;
};

BoxTree::BoxTree(std::vector<PrimBox> boxes) : boxes_(std::move(boxes)), bounds_(boxes_.size()) {
    build(0, boxes_.size());
}

void BoxTree::build(std::size_t first, std::size_t last) {
    if (last - first <= kLeaf) return;
    Bounds around;
    for (std::size_t i = first; i < last; ++i) around.add(boxes_[i]);
    int longest = 0;
    for (int axis = 1; axis < 3; ++axis) {
        if (around.upper[axis] - around.lower[axis] > around.upper[longest] - around.lower[longest])
            longest = axis;
    }
    const std::size_t middle = first + (last - first) / 2;
    bounds_[middle] = around;
    const auto at = [&](std::size_t i) { return boxes_.begin() + static_cast<std::ptrdiff_t>(i); };
    std::nth_element(at(first), at(middle), at(last), [&](const PrimBox& a, const PrimBox& b) {
        return a.lower[longest] + a.upper[longest] < b.lower[longest] + b.upper[longest];
    });
    build(first, middle);
    build(middle, last);
}

namespace {

/// The primitives whose vertices are all in range.
std::vector<PrimBox> boxes_of(const std::vector<Part>& parts) {
    std::vector<PrimBox> boxes;
    for (std::size_t p = 0; p < parts.size(); ++p) {
        const Part& part = parts[p];
        const std::size_t step = part.is_quads ? 2 : 1;
        for (std::size_t triangle = 0; triangle < part.triangle_count(); triangle += step) {
            PrimBox box = {
                {}, static_cast<std::uint32_t>(p), static_cast<std::uint32_t>(triangle / step)};
            bool is_whole = true;
            for (std::size_t half = 0; half < step && is_whole; ++half) {
                std::array<std::uint32_t, 3> corners;
                is_whole = part.find_traced_corners(triangle + half, corners);
                for (std::size_t i = 0; i < 3 && is_whole; ++i) {
                    const std::uint32_t vertex = corners[i];
                    const morphray::Vec3 corner = part.placed_vertex(vertex);
                    is_whole = is_whole && is_in_range(corner);
                    box.add(corner);
                }
            }
            if (is_whole) boxes.push_back(box);
        }
    }
    return boxes;
}

/// The factor of lengths, if the transformation is a similarity; otherwise 0.
float similarity_of(const Transform& t) {
    const auto dot = [&](int i, int j) { return glm::dot(t.columns[i], t.columns[j]); };
    const double scale2 = dot(0, 0);
    const double most = 1e-5 * scale2;
    const bool is_similarity =
        std::abs(dot(1, 1) - scale2) <= most && std::abs(dot(2, 2) - scale2) <= most &&
        std::abs(dot(0, 1)) <= most && std::abs(dot(0, 2)) <= most && std::abs(dot(1, 2)) <= most;
    return is_similarity ? static_cast<float>(std::sqrt(scale2)) : 0.0f;
}

/// The context of an instance's mesh; that of the caller is as before afterwards.
class InstanceScope {
public:
    InstanceScope(const Part& part, RTCPointQueryContext& context)
        : context_(context), before_(context) {
        constexpr RTCFormat kFormat = RTC_FORMAT_FLOAT4X4_COLUMN_MAJOR;
        write_transform(part.to_object, kFormat, context.world2inst[0]);
        write_transform(part.to_world, kFormat, context.inst2world[0]);
        context.instID[0] = part.inst_id;
#if MORPHRAY_EMBREE == 4
        context.instPrimID[0] = 0;
#endif
        context.instStackSize = 1;
    }
    ~InstanceScope() { context_ = before_; }
    InstanceScope(const InstanceScope&) = delete;

private:
    RTCPointQueryContext& context_;
    const RTCPointQueryContext before_;
};

/// Returns whether a function changed the query. Functions may lower the radius.
bool visit_near(const Committed& committed, RTCPointQuery& query, RTCPointQueryContext& context,
                Function function, void* user) {
    bool has_changed = false;
    committed.boxes().visit_near(
        {query.x, query.y, query.z}, query.radius, [&](const PrimBox& box) {
            const Part& part = committed.parts[box.part];
            std::optional<InstanceScope> scope;
            if (part.is_instance()) scope.emplace(part, context);
            RTCPointQueryFunctionArguments arguments;
            arguments.query = &query;
            arguments.userPtr = user;
            arguments.primID = box.prim_id;
            arguments.geomID = part.geom_id;
            arguments.context = &context;
            arguments.similarityScale = part.is_instance() ? similarity_of(part.to_object) : 1.0f;
            for (const Function each : {function, part.mesh->point_query})
                if (each != nullptr) has_changed |= each(&arguments);
        });
    return has_changed;
}

}  // namespace

const BoxTree& Committed::boxes() const {
    const std::scoped_lock lock(boxes_mutex_);
    if (made_boxes_ == nullptr) made_boxes_ = std::make_shared<BoxTree>(boxes_of(parts));
    return *made_boxes_;
}

}  // namespace mray::embree

using namespace mray::embree;

bool rtcPointQuery(RTCScene scene, RTCPointQuery* query, RTCPointQueryContext* context,
                   RTCPointQueryFunction function, void* user) {
    return with<SceneObject>(__func__, scene, [&](SceneObject& s) {
        if (query == nullptr || context == nullptr) fail_argument("query or context is null");
        if (context->instStackSize > 0)
            fail_unsupported("point queries on a stack of instances are");
        return visit_near(s.committed(), *query, *context, function, user);
    });
}
