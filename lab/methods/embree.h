// Embree 3 or 4, whichever the build found (MORPHRAY_EMBREE): devices, scenes that are built or
// refitted, and ways to trace and query them.
#pragma once

#if MORPHRAY_EMBREE == 3
#include <embree3/rtcore.h>
#else
#include <embree4/rtcore.h>
#endif

#include <cstddef>
#include <type_traits>

#include "common/scene/mesh.h"
#include "lab/methods/closest_point.h"
#include "lab/methods/tracers.h"

namespace mray::lab {

inline constexpr bool kEmbreeHasStreams = MORPHRAY_EMBREE == 3;

struct EmbreeRelease {
    void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
    void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
    void operator()(RTCGeometry geometry) const { rtcReleaseGeometry(geometry); }
};
template <class Handle>
using EmbreeOwned = std::unique_ptr<std::remove_pointer_t<Handle>, EmbreeRelease>;

/// All that exist at a time have the same number of threads.
struct EmbreeDevice {
    /// `widest_isa` may be "avx2" or "avx512"; "" for all instruction sets that Embree finds. 0
    /// threads: as many as the machine has.
    EmbreeDevice(int threads, const std::string& widest_isa);

    EmbreeOwned<RTCDevice> handle;
    /// The instruction set, or "all".
    std::string isa;
};

/// One for each instruction set worth a try: what is fastest differs by the machine and the rays.
std::vector<EmbreeDevice> embree_devices(int threads);

/// Triangles and the tree over them. The device and the topology outlive it.
struct EmbreeScene {
    /// LOW is the Morton build, MEDIUM binned SAH, HIGH with spatial splits.
    EmbreeScene(const EmbreeDevice& on, const Topology& mesh, std::span<const vec3> positions,
                RTCBuildQuality quality, bool robust = false);

    /// "robust MEDIUM avx512"; "fast" without the flag.
    std::string name() const;
    /// The tree is around these positions after the next commit().
    void set_positions(std::span<const vec3> positions);
    /// Builds the tree, or refits it if there is one and the quality is REFIT.
    void commit();

    const EmbreeDevice& device;
    const Topology& topology;
    RTCBuildQuality quality;
    bool robust;
    /// Embree loads 16 bytes at each, so that there is one more.
    std::vector<vec3> vertices;
    EmbreeOwned<RTCGeometry> geometry;
    EmbreeOwned<RTCScene> handle;
};

/// A scene by every instruction set, over a MEDIUM and a HIGH tree, fast and robust: eight builds.
std::vector<EmbreeScene> embree_variants(std::span<const EmbreeDevice> devices,
                                         const Topology& topology, std::span<const vec3> positions);

/// Ways to trace rays over each scene; both outlive the peers, which have their answers in common.
/// Rays in packets count as coherent, diffuse rays and ambient occlusion as incoherent.
std::vector<Tracer> embree_peers(std::span<const EmbreeScene> scenes, const RaySet& set);

/// By Intersect16 and Occluded16 of coherent rays, for images. The scene outlives it.
std::shared_ptr<const cpu::ImageTracer> embree_tiles(const EmbreeScene& scene);

/// Over a MEDIUM tree: with spatial splits, filters see a triangle several times. Device and
/// topology outlive it. Calls belong in an arena of the device's number of threads.
struct EmbreeQueries {
    /// At most so many points or rays a call.
    EmbreeQueries(const EmbreeDevice& device, const Topology& topology,
                  std::span<const vec3> positions, bool robust, std::size_t most);

    /// Sets `nearest` by rtcPointQuery, whose callback uses Ericson's method and narrows the query.
    void find_closest(std::span<const vec3> points);
    /// Sets `counts` by Intersect1, whose filter counts and rejects all hits. `coherent`: the flag
    /// of this name.
    void count(std::span<const Ray> rays, bool coherent);

    EmbreeScene scene;
    std::vector<NearestPoint> nearest;
    std::vector<std::uint64_t> counts;
};

}  // namespace mray::lab
