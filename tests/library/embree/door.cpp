#include "tests/library/embree/door.h"

#include <cmath>

namespace mray::door_test {

RTCScene instance_of(const Door& door, RTCScene child, RTCFormat format,
                     const std::vector<float>& floats) {
    RTCGeometry instance = rtcNewGeometry(door.device, RTC_GEOMETRY_TYPE_INSTANCE);
    rtcSetGeometryInstancedScene(instance, child);
    rtcSetGeometryTransform(instance, 0, format, floats.data());
    return door.committed({door.triangle(-50), instance});
}

Waves::Waves(unsigned int n, float phase) {
    for (unsigned int y = 0; y <= n; ++y) {
        for (unsigned int x = 0; x <= n; ++x) {
            const float u = static_cast<float>(x) / static_cast<float>(n);
            const float v = static_cast<float>(y) / static_cast<float>(n);
            vertices.push_back({u, v, 0.1f * std::sin(9 * u + 7 * v + phase)});
        }
    }
    for (unsigned int y = 0; y < n; ++y) {
        for (unsigned int x = 0; x < n; ++x) {
            const unsigned int a = y * (n + 1) + x;
            const unsigned int c = a + n + 1;
            indices.push_back({a, a + 1, c});
            indices.push_back({a + 1, c + 1, c});
        }
    }
}

}  // namespace mray::door_test
