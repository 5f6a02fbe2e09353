// Embree as a peer: a device, and a scene that is built or refitted.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/scene/mesh.h"

struct RTCDeviceTy;
struct RTCSceneTy;
struct RTCGeometryTy;

namespace mray::bench {

/// All that exist at a time have the same number of threads: another number would change that of
/// the first.
class EmbreeDevice {
public:
    /// `isa` is the widest instruction set that Embree may use: "avx2", "avx512", or "" for all
    /// that it finds. `config` is for rtcNewDevice, added to both; may be empty.
    EmbreeDevice(int threads, const std::string& isa, const std::string& config);

    /// The instruction set, or "all".
    const std::string& isa() const { return isa_; }

    RTCDeviceTy* handle() const { return handle_.get(); }
    /// Throws Error(kInternal) with `action` if a call on this device has failed since the last
    /// check.
    void check(const char* action) const;

    /// "3.13.5"
    static std::string version();
    /// The ways to trace of other versions that this one is not measured by, for a person; "" if
    /// there are none.
    static std::string left_out();

private:
    struct Release {
        void operator()(RTCDeviceTy* device) const;
    };
    std::unique_ptr<RTCDeviceTy, Release> handle_;
    std::string isa_;
};

/// Devices of each instruction set that is worth a try on this machine, the widest first; one
/// device if `config` has an isa. What is fastest differs by the machine and by the work: 256 bits
/// may be as fast as 512.
std::vector<EmbreeDevice> embree_devices(int threads, const std::string& config);

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

/// How a tree is made: Embree's Morton build; binned SAH; SAH with spatial splits; and a tree that
/// update() refits. Embree refits only with scene quality LOW, the flag DYNAMIC and geometry
/// quality REFIT; otherwise it rebuilds silently.
enum class EmbreeTree { kLow, kMedium, kHigh, kRefitted };

/// Built once constructed. The device and the mesh outlive it.
class EmbreeScene {
public:
    /// `robust`: no ray slips through where triangles meet, by Embree's flag.
    EmbreeScene(const EmbreeDevice& device, const EmbreeMesh& mesh, EmbreeTree tree,
                bool robust = false);

    /// Follows the mesh's positions: refits, or builds again.
    void update();

    RTCSceneTy* handle() const { return scene_.get(); }

private:
    struct Release {
        void operator()(RTCSceneTy* scene) const;
        void operator()(RTCGeometryTy* geometry) const;
    };
    const EmbreeDevice* device_;
    std::unique_ptr<RTCGeometryTy, Release> geometry_;
    std::unique_ptr<RTCSceneTy, Release> scene_;
};

}  // namespace mray::bench
