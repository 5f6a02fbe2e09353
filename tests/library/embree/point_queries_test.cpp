// Point queries.
#include <gtest/gtest.h>

#include "tests/library/embree/embree_api.h"

namespace mray {
namespace {

using namespace embree_test;

bool lower_radius(RTCPointQueryFunctionArguments* arguments) {
    ++*static_cast<int*>(arguments->userPtr);
    if (arguments->query->radius <= 2) return false;
    arguments->query->radius = 2;
    return true;
}
bool count_only(RTCPointQueryFunctionArguments* arguments) {
    ++*static_cast<int*>(arguments->userPtr);
    return false;
}

TEST(EmbreePointQueries, VisitPrimitivesWithinTheRadius) {
    const TestDevice device;
    const Waves waves(16);
    RTCScene scene = device.committed(
        {device.triangles(waves.vertices, waves.indices),
         device.quads({{9, 0, 0}, {10, 0, 0}, {10, 1, 0}, {9, 1, 0}}, {{{0, 1, 2, 3}}})});
    const auto count = [&](Point at, float radius, RTCPointQueryFunction function) {
        RTCPointQuery query = {at[0], at[1], at[2], 0, radius};
        RTCPointQueryContext context;
        rtcInitPointQueryContext(&context);
        int visited = 0;
        rtcPointQuery(scene, &query, &context, function, &visited);
        return visited;
    };
    EXPECT_EQ(count({0, 0, 0}, kInfinity, count_only), 2 * 16 * 16 + 1);
    EXPECT_EQ(count({9.5f, 0.5f, 3}, 3, count_only), 1);
    EXPECT_EQ(count({9.5f, 0.5f, 3}, 2.9f, count_only), 0);
    // The nearest primitives come first, and once the radius is small no others.
    EXPECT_LE(count({9.5f, 0.5f, 1}, kInfinity, lower_radius), 4);
    EXPECT_EQ(count({kInfinity, 0, 0}, 1, count_only), 0);
    EXPECT_EQ(device.error(), RTC_ERROR_NONE);
    rtcReleaseScene(scene);
}

bool changes_once(RTCPointQueryFunctionArguments* arguments) {
    auto& context = *static_cast<RTCPointQueryContext*>(arguments->userPtr);
    EXPECT_EQ(arguments->context, &context);
    EXPECT_EQ(context.instStackSize, 1u);
    EXPECT_EQ(context.instID[0], 1u);
    // (11, 20, 30) is at (0.5, 0, 0) of the child, whose axes have changed places.
    EXPECT_EQ(context.world2inst[0][1], 0.5f);
    EXPECT_EQ(context.world2inst[0][4], 0.5f);
    EXPECT_EQ(context.world2inst[0][10], 0.5f);
    EXPECT_EQ(context.world2inst[0][12], -10.0f);
    EXPECT_EQ(context.world2inst[0][13], -5.0f);
    EXPECT_EQ(context.inst2world[0][12], 10.0f);
    EXPECT_EQ(arguments->similarityScale, 0.5f);
    const bool is_first = arguments->query->radius > 100;
    arguments->query->radius = 100;
    return is_first;
}

TEST(EmbreePointQueries, KnowTheInstance) {
    const TestDevice device;
    RTCScene child = device.committed({device.triangle(), device.triangle(-1)});
    RTCScene scene = instance_of(device, child, RTC_FORMAT_FLOAT3X4_ROW_MAJOR,
                                 {0, 2, 0, 10, 2, 0, 0, 20, 0, 0, 2, 30});
    rtcDetachGeometry(scene, 0);
    rtcCommitScene(scene);
    RTCPointQuery query = {11, 20, 30, 0, 200};
    RTCPointQueryContext context;
    rtcInitPointQueryContext(&context);
    EXPECT_TRUE(rtcPointQuery(scene, &query, &context, changes_once, &context));
    EXPECT_EQ(context.instStackSize, 0u);
    EXPECT_EQ(context.instID[0], kInvalid);
    EXPECT_FALSE(rtcPointQuery(scene, &query, &context, changes_once, &context));
    for (RTCScene each : {scene, child}) rtcReleaseScene(each);
}

/// The rows of a 3x4 matrix and its inverse on the stack of a query, as those of an instance that
/// the caller has come down through.
void push_instance(RTCPointQueryContext& context, const std::array<float, 12>& to_world,
                   const std::array<float, 12>& to_instance) {
    for (int row = 0; row < 4; ++row) {
        for (int column = 0; column < 4; ++column) {
            const float last = column == 3 ? 1.0f : 0.0f;
            const auto from = static_cast<std::size_t>(4 * row + column);
            context.inst2world[0][4 * column + row] = row < 3 ? to_world[from] : last;
            context.world2inst[0][4 * column + row] = row < 3 ? to_instance[from] : last;
        }
    }
    context.instID[0] = 7;
    context.instStackSize = 1;
}

/// The calls of a query, as functions see them.
struct Calls {
    std::vector<unsigned int> prims;
    float similarity = -1;
    Point corner_in_world = {};
    unsigned int inst_id = kInvalid;
};
bool note_call(RTCPointQueryFunctionArguments* arguments) {
    auto& calls = *static_cast<Calls*>(arguments->userPtr);
    calls.prims.push_back(arguments->primID);
    calls.similarity = arguments->similarityScale;
    calls.inst_id = arguments->context->instID[0];
    // The origin of the mesh.
    const float* const matrix = arguments->context->inst2world[0];
    calls.corner_in_world = {matrix[12], matrix[13], matrix[14]};
    EXPECT_EQ(arguments->context->instStackSize, 1u);
    return false;
}

TEST(EmbreePointQueries, StartAtTheTopOfTheCallersInstances) {
    const TestDevice device;
    RTCScene child = device.committed({device.triangle()});
    RTCScene nested = instance_of(device, child, RTC_FORMAT_FLOAT3X4_ROW_MAJOR,
                                  {1, 0, 0, 0, 0, 1, 0, 3, 0, 0, 1, 0});
    RTCPointQueryContext context;
    const auto ask = [&](RTCScene scene, Point at, float radius) {
        RTCPointQuery query = {at[0], at[1], at[2], 0, radius};
        Calls calls;
        rtcPointQuery(scene, &query, &context, note_call, &calls);
        EXPECT_EQ(context.instID[0], 7u);
        return calls;
    };
    rtcInitPointQueryContext(&context);
    // Twice as large and moved by 10 in x.
    push_instance(context, {2, 0, 0, 10, 0, 2, 0, 0, 0, 0, 2, 0},
                  {0.5f, 0, 0, -5, 0, 0.5f, 0, 0, 0, 0, 0.5f, 0});
    EXPECT_TRUE(ask(child, {0, 0, 0}, 1).prims.empty());
    EXPECT_TRUE(ask(child, {10.2f, 0.2f, 1.5f}, 1.4f).prims.empty());
    const Calls near = ask(child, {10.2f, 0.2f, 1.5f}, 1.6f);
    EXPECT_EQ(near.prims.size(), 1u);
    EXPECT_EQ(near.similarity, 0.5f);
    EXPECT_EQ(near.inst_id, 7u);
    EXPECT_EQ(near.corner_in_world, (Point{10, 0, 0}));
    // An instance of the scene is below the caller's.
    EXPECT_TRUE(ask(nested, {10.2f, 0.2f, 0}, 1).prims.empty());
    const Calls below = ask(nested, {10.2f, 6.2f, 0}, 1);
    EXPECT_EQ(below.prims.size(), 1u);
    EXPECT_EQ(below.similarity, 0.5f);
    EXPECT_EQ(below.inst_id, 1u);
    EXPECT_EQ(below.corner_in_world, (Point{10, 6, 0}));
    // Flattened to a tenth of its height.
    push_instance(context, {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0.1f, 0},
                  {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 10, 0});
    const Calls flat = ask(child, {0.2f, 0.2f, 0.5f}, 0.6f);
    EXPECT_EQ(flat.prims.size(), 1u);
    EXPECT_EQ(flat.similarity, 0);
    EXPECT_TRUE(ask(child, {0.2f, 0.2f, 3}, 0.6f).prims.empty());
    EXPECT_EQ(device.error(), RTC_ERROR_NONE);
    for (RTCScene each : {nested, child}) rtcReleaseScene(each);
}

}  // namespace
}  // namespace mray
