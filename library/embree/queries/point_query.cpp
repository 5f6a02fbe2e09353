// rtcPointQuery: the primitives near a point, handed to the functions of the caller.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "library/embree/device.h"
#include "library/embree/scene/box_tree.h"
#include "library/embree/scene/scene.h"

namespace mray::embree {
namespace {

using Function = RTCPointQueryFunction;

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
            for (std::size_t half = 0; half < step; ++half) {
                std::array<std::uint32_t, 3> corners;
                is_whole = is_whole && part.find_traced_corners(triangle + half, corners);
                if (!is_whole) break;
                for (const std::uint32_t vertex : corners) {
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

void write_matrix(const Transform& transform, float (&matrix)[16]) {
    write_transform(transform, RTC_FORMAT_FLOAT4X4_COLUMN_MAJOR, matrix);
}

/// The factor of lengths, if the transformation is a similarity; otherwise 0.
float similarity_of(const Transform& t) {
    const auto dot = [&](int i, int j) {
        return t.columns[i][0] * t.columns[j][0] + t.columns[i][1] * t.columns[j][1] +
               t.columns[i][2] * t.columns[j][2];
    };
    const double scale2 = dot(0, 0);
    const double most = 1e-5 * scale2;
    const bool is_similarity =
        std::abs(dot(1, 1) - scale2) <= most && std::abs(dot(2, 2) - scale2) <= most &&
        std::abs(dot(0, 1)) <= most && std::abs(dot(0, 2)) <= most && std::abs(dot(1, 2)) <= most;
    return is_similarity ? static_cast<float>(std::sqrt(scale2)) : 0.0f;
}

/// A length that no image of a vector of length 1 is longer than.
float most_stretch_of(const Transform& t) {
    double sum = 0;
    for (int column = 0; column < 3; ++column)
        for (const double x : t.columns[column]) sum += x * x;
    return static_cast<float>(std::sqrt(sum));
}

/// Where the scene of a query lies: at the top of the stack of instances that the caller has come
/// down through.
struct Place {
    bool is_instance;
    Transform to_scene = {};
    Transform to_world = {};

    explicit Place(const RTCPointQueryContext& context) : is_instance(context.instStackSize > 0) {
        if (!is_instance) return;
        const unsigned int top = context.instStackSize - 1;
        to_scene = read_transform(RTC_FORMAT_FLOAT4X4_COLUMN_MAJOR, context.world2inst[top]);
        to_world = read_transform(RTC_FORMAT_FLOAT4X4_COLUMN_MAJOR, context.inst2world[top]);
    }
};

/// The context of an instance's mesh; that of the caller is as before afterwards. The instance is
/// the top of its stack, in place of one that the caller has there.
class InstanceScope {
public:
    InstanceScope(const Part& part, const Place& place, RTCPointQueryContext& context)
        : context_(context), before_(context) {
        const unsigned int top = std::max(context.instStackSize, 1u) - 1;
        write_matrix(part.to_object * place.to_scene, context.world2inst[top]);
        write_matrix(place.to_world * part.to_world, context.inst2world[top]);
        context.instID[top] = part.inst_id;
#if MORPHRAY_EMBREE == 4
        context.instPrimID[top] = 0;
#endif
        context.instStackSize = top + 1;
    }
    ~InstanceScope() { context_ = before_; }
    InstanceScope(const InstanceScope&) = delete;

private:
    RTCPointQueryContext& context_;
    const RTCPointQueryContext before_;
};

/// Returns whether a function changed the query. The functions of the call and of the geometry may
/// lower the radius, which is one in the space of the world.
bool visit_near(const Committed& committed, RTCPointQuery& query, RTCPointQueryContext& context,
                Function function, void* user) {
    bool has_changed = false;
    const Place place(context);
    const morphray::Vec3 centre = place.to_scene.point({query.x, query.y, query.z});
    const float similarity = place.is_instance ? similarity_of(place.to_scene) : 1.0f;
    // Other images of a sphere lie within one.
    const float scale = similarity > 0 ? similarity : most_stretch_of(place.to_scene);
    float radius = query.radius * scale;
    committed.boxes().visit_near({centre.x, centre.y, centre.z}, radius, [&](const PrimBox& box) {
        const Part& part = committed.parts[box.part];
        std::optional<InstanceScope> scope;
        if (part.is_instance()) scope.emplace(part, place, context);
        RTCPointQueryFunctionArguments arguments;
        arguments.query = &query;
        arguments.userPtr = user;
        arguments.primID = box.prim_id;
        arguments.geomID = part.geom_id;
        arguments.context = &context;
        arguments.similarityScale =
            part.is_instance() ? similarity_of(part.to_object * place.to_scene) : similarity;
        for (const Function each : {function, part.mesh().point_query})
            if (each != nullptr) has_changed |= each(&arguments);
        radius = query.radius * scale;
    });
    return has_changed;
}

bool query_point(RTCScene scene, RTCPointQuery* query, RTCPointQueryContext* context,
                 Function function, void* user) {
    return with<SceneObject>("rtcPointQuery", scene, [&](SceneObject& s) {
        if (query == nullptr || context == nullptr) fail_argument("query or context is null");
        return visit_near(s.committed(), *query, *context, function, user);
    });
}

/// One query after the other.
template <std::size_t n, class Packet>
bool query_points(const int* valid, RTCScene scene, Packet* queries, RTCPointQueryContext* context,
                  Function function, void** users) {
    return with<SceneObject>("rtcPointQuery", scene, [&](SceneObject& s) {
        if (valid == nullptr || queries == nullptr || context == nullptr)
            fail_argument("valid, queries or context is null");
        bool has_changed = false;
        for (std::size_t i = 0; i < n; ++i) {
            if (valid[i] != -1) continue;
            RTCPointQuery query = {queries->x[i], queries->y[i], queries->z[i], queries->time[i],
                                   queries->radius[i]};
            void* const user = users == nullptr ? nullptr : users[i];
            has_changed |= visit_near(s.committed(), query, *context, function, user);
            queries->radius[i] = query.radius;
        }
        return has_changed;
    });
}

}  // namespace

const BoxTree& Committed::boxes() const {
    const std::scoped_lock lock(boxes_mutex_);
    if (made_boxes_ == nullptr) made_boxes_ = std::make_unique<BoxTree>(boxes_of(parts));
    return *made_boxes_;
}

}  // namespace mray::embree

using namespace mray::embree;

bool rtcPointQuery(RTCScene scene, struct RTCPointQuery* query,
                   struct RTCPointQueryContext* context, RTCPointQueryFunction function,
                   void* user) {
    return query_point(scene, query, context, function, user);
}

bool rtcPointQuery4(const int* valid, RTCScene scene, struct RTCPointQuery4* queries,
                    struct RTCPointQueryContext* context, RTCPointQueryFunction function,
                    void** users) {
    return query_points<4>(valid, scene, queries, context, function, users);
}

bool rtcPointQuery8(const int* valid, RTCScene scene, struct RTCPointQuery8* queries,
                    struct RTCPointQueryContext* context, RTCPointQueryFunction function,
                    void** users) {
    return query_points<8>(valid, scene, queries, context, function, users);
}

bool rtcPointQuery16(const int* valid, RTCScene scene, struct RTCPointQuery16* queries,
                     struct RTCPointQueryContext* context, RTCPointQueryFunction function,
                     void** users) {
    return query_points<16>(valid, scene, queries, context, function, users);
}
