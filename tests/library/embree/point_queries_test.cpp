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
    // A caller's own stack of instances is refused.
    context.instStackSize = 1;
    EXPECT_FALSE(rtcPointQuery(scene, &query, &context, changes_once, &context));
    EXPECT_EQ(device.error(), RTC_ERROR_INVALID_OPERATION);
    for (RTCScene each : {scene, child}) rtcReleaseScene(each);
}

}  // namespace
}  // namespace mray
