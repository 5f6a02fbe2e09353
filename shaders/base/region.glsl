// The pixels of lanes. A workgroup is a tile of 8x8 pixels. Each power of two of lanes covers a
// block that is as square as possible, for every width of a subgroup.
#include "shaders/kernel_interface.h"
#include "shaders/base/lavapipe.h"

layout(local_size_x = kGroupSize) in;

layout(push_constant) uniform Arguments { RegionArguments args; };

uvec2 tile_pixel() {
    uint lane = gl_LocalInvocationID.x;
    uint x = (lane & 3u) | ((lane >> 1u) & 4u);
    uint y = ((lane >> 2u) & 1u) | ((lane >> 3u) & 6u);
    return uvec2(x, y);
}

uvec2 region_pixel() {
    uint tile = spread_group(gl_WorkGroupID.x, args.tile_count);
    return uvec2(tile % args.tile_columns, tile / args.tile_columns) * kTileSize + tile_pixel();
}

bool within_region(uvec2 pixel) { return pixel.x < args.width && pixel.y < args.height; }

uint answer_index(uvec2 pixel) { return pixel.y * args.width + pixel.x; }
