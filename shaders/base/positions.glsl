// The positions of vertices: texels of four words, or three words each in a storage buffer.
#include "shaders/base/buffers.glsl"
#include "shaders/kernel_interface.h"

#ifdef STORAGE_BUFFERS
READ1(Positions, positions, kBindPositions);
uvec3 position_bits(uint v) {
    return uvec3(positions[3u * v], positions[3u * v + 1u], positions[3u * v + 2u]);
}
#else
READ4(Positions, positions, kBindPositions);
uvec3 position_bits(uint v) { return AT4(positions, v).xyz; }
#endif
