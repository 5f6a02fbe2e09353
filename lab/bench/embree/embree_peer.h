// Embree as a peer: devices, scenes that are built or refitted, and ways to trace and ask them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <deque>
#include <span>
#include <string>
#include <vector>

#include "common/image/frame.h"
#include "common/interop/camera.h"
#include "common/scene/mesh.h"
#include "cpu/image/pixel_shader.h"
#include "lab/bench/bench_scene.h"
#include "lab/bench/query_work.h"
#include "lab/bench/trace_work.h"
#include "lab/embree.h"

namespace mray::bench {

/// All that exist at a time have the same number of threads.
class EmbreeDevice {
public:
    /// `isa` is the widest that Embree may use: "avx2", "avx512", or "" for all that it finds.
    EmbreeDevice(int threads, const std::string& isa);

    /// The instruction set, or "all".
    const std::string& isa() const { return isa_; }

    RTCDevice handle() const { return handle_.get(); }
    /// Throws Error(kInternal) with `action` if a call has failed since the last check.
    void check(const char* action) const;

private:
    embree::Owned<RTCDevice> handle_;
    std::string isa_;
};

/// One for each instruction set worth a try: what is fastest differs by the machine and the work.
std::vector<EmbreeDevice> embree_devices(int threads);

/// The triangles in memory that Embree's scenes share. The topology outlives it.
class EmbreeMesh {
public:
    EmbreeMesh(const Topology& topology, std::span<const vec3> positions);

    /// Scenes over this mesh see the positions after their next update().
    void set_positions(std::span<const vec3> positions);

    const Topology& topology() const { return *topology_; }
    const vec3* vertices() const { return vertices_.data(); }

private:
    const Topology* topology_;
    std::vector<vec3> vertices_;
};

/// Built once constructed. The device and the mesh outlive it.
class EmbreeScene {
public:
    /// LOW is the Morton build, MEDIUM binned SAH, HIGH with spatial splits, REFIT for update().
    EmbreeScene(const EmbreeDevice& device, const EmbreeMesh& mesh, RTCBuildQuality quality,
                bool robust = false);

    void update();

    RTCScene handle() const { return scene_.get(); }

private:
    const EmbreeDevice* device_;
    embree::Owned<RTCGeometry> geometry_;
    embree::Owned<RTCScene> scene_;
};

/// A scene by every instruction set, over a MEDIUM and a HIGH tree, fast and robust: eight builds.
class EmbreeScenes {
public:
    EmbreeScenes(std::span<const EmbreeDevice> devices, const BenchScene& scene);

    struct Variant {
        EmbreeScene scene;
        bool robust;
        /// "MEDIUM, avx2"
        std::string name;
    };
    const std::deque<Variant>& variants() const { return variants_; }

private:
    EmbreeMesh mesh_;
    std::deque<Variant> variants_;
};

/// Ways to trace a work over each scene; both outlive the peers. Primary and shadow rays count as
/// coherent, diffuse rays and ambient occlusion as incoherent. Records are made within the time, in
/// the cache, from what our tracers read too.
std::vector<Tracer> embree_peers(const EmbreeScenes& scenes, const TraceWork& work);

/// The closest hits of a work by single rays, in the calling thread's arena.
AlignedVector<Hit> embree_hits(const EmbreeScene& scene, const TraceWork& work);

/// The camera rays of a block of 4 x 4 pixels, row by row.
inline void make_camera_rays(const Camera& camera, std::uint32_t x0, std::uint32_t y0,
                             RTCRay16& record) {
    for (std::uint32_t i = 0; i < kPacketSize; ++i) {
        const vec3 dir =
            canonical_direction(camera_direction(camera, x0 + i % kBlockSize, y0 + i / kBlockSize));
        record.dir_x[i] = dir.x;
        record.dir_y[i] = dir.y;
        record.dir_z[i] = dir.z;
        record.tnear[i] = 0;
        record.tfar[i] = kInfiniteT;
    }
}

/// Copies directions and ends; the origin is that of the record.
inline void copy_shadow_rays(const cpu::SharedOriginRays& rays, RTCRay16& record) {
    std::memcpy(record.dir_x, rays.dir[0], sizeof(rays.dir[0]));
    std::memcpy(record.dir_y, rays.dir[1], sizeof(rays.dir[1]));
    std::memcpy(record.dir_z, rays.dir[2], sizeof(rays.dir[2]));
    std::memcpy(record.tfar, rays.tfar, sizeof(rays.tfar));
    std::memset(record.tnear, 0, sizeof(record.tnear));
}

/// Traces camera and shadow rays by Intersect16 and Occluded16, as coherent ones, 4 x 4 pixels at a
/// time; `shader` shades each square of pixels while it is in the cache, in the thread's arena. The
/// image's sides are multiples of 32.
void trace_frame(const EmbreeScene& scene, const ImageParams& params, const cpu::ShadedMesh& mesh,
                 const cpu::PixelShader& shader, Frame& frame);

/// Over a MEDIUM tree: with spatial splits, filters see a triangle several times. Device and mesh
/// outlive it. Calls belong in an arena of the device's number of threads.
class EmbreeQueries {
public:
    /// `most_rays` is the most that count() is called with.
    EmbreeQueries(const EmbreeDevice& device, const EmbreeMesh& mesh, bool robust,
                  std::size_t most_rays);

    /// "robust, MEDIUM, avx512"
    const std::string& name() const { return name_; }
    /// The same for all that differ in the device alone.
    const char* group() const { return group_; }

    /// By rtcPointQuery, whose callback uses Ericson's method and narrows the query.
    void find_closest(std::span<const vec3> points, std::span<NearestPoint> nearest) const;
    /// By Intersect1, whose filter counts and rejects all hits. `coherent`: the flag of this name.
    void count(std::span<const Ray> rays, bool coherent);
    std::span<const std::uint64_t> counts() const { return counts_; }

private:
    std::string name_;
    const char* group_;
    const EmbreeMesh* mesh_;
    EmbreeScene scene_;
    std::vector<std::uint64_t> counts_;
};

}  // namespace mray::bench
