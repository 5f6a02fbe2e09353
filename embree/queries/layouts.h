// Rays and hits as callers lay them out. Each layout loads rays and stores what a query changes of
// them: `hit`, and tfar.
#pragma once

#include <cstddef>
#include <cstdint>

#include "embree/rtcore.h"

namespace mray::embree {

/// Lane i of a packet of N: member after member, each of N lanes.
struct PacketLane {
    float* ray;
    std::size_t n;

    RTCRay load() const {
        RTCRay lane;
        auto* const to = reinterpret_cast<float*>(&lane);
        for (std::size_t member = 0; member < 12; ++member) to[member] = ray[member * n];
        return lane;
    }
    void store_tfar(float tfar) const { ray[8 * n] = tfar; }
    void store_hit(const RTCHit& hit) const {
        const auto* const from = reinterpret_cast<const float*>(&hit);
        // Members as bits: loads and stores of floats keep them.
        for (std::size_t member = 0; member < kHitMembers; ++member)
            copy_bits(ray + (12 + member) * n, from + member);
    }

    static void copy_bits(float* to, const float* from) { __builtin_memcpy(to, from, 4); }
};

/// A packet of N rays, with hits if it is asked for hits.
struct Packet {
    float* first;
    std::size_t n;

    PacketLane operator[](std::size_t i) const { return {first + i, n}; }
};

/// A ray, with a hit if it is asked for hits.
struct OneLane {
    RTCRay* ray;

    const RTCRay& load() const { return *ray; }
    void store_tfar(float tfar) const { ray->tfar = tfar; }
    void store_hit(const RTCHit& hit) const { copy_hit(this->hit(), hit); }
    RTCHit& hit() const { return reinterpret_cast<RTCRayHit*>(ray)->hit; }
};

/// Rays `stride` bytes apart.
struct Stream {
    char* first;
    std::size_t stride;

    OneLane operator[](std::size_t i) const {
        return {reinterpret_cast<RTCRay*>(first + i * stride)};
    }
};

/// Pointers to rays.
struct Pointers {
    void* const* rays;

    OneLane operator[](std::size_t i) const { return {static_cast<RTCRay*>(rays[i])}; }
};

/// M packets of N rays, `stride` bytes apart.
struct PacketStream {
    char* first;
    std::size_t n;
    std::size_t stride;

    PacketLane operator[](std::size_t i) const {
        return {reinterpret_cast<float*>(first + i / n * stride) + i % n, n};
    }
};

#if MORPHRAY_EMBREE == 3

/// Lane i of arrays, one for each member. time, mask, id and flags may be null.
struct ArrayLane {
    const RTCRayNp* rays;
    const RTCHitNp* hits;
    std::size_t i;

    RTCRay load() const {
        RTCRay ray;
        ray.org_x = rays->org_x[i];
        ray.org_y = rays->org_y[i];
        ray.org_z = rays->org_z[i];
        ray.tnear = rays->tnear != nullptr ? rays->tnear[i] : 0;
        ray.dir_x = rays->dir_x[i];
        ray.dir_y = rays->dir_y[i];
        ray.dir_z = rays->dir_z[i];
        ray.time = rays->time != nullptr ? rays->time[i] : 0;
        ray.tfar = rays->tfar[i];
        ray.mask = rays->mask != nullptr ? rays->mask[i] : kInvalid;
        ray.id = rays->id != nullptr ? rays->id[i] : kInvalid;
        ray.flags = rays->flags != nullptr ? rays->flags[i] : 0;
        return ray;
    }
    void store_tfar(float tfar) const { rays->tfar[i] = tfar; }
    void store_hit(const RTCHit& hit) const {
        const auto store = [this](auto* array, auto value) {
            if (array != nullptr) array[i] = value;
        };
        store(hits->Ng_x, hit.Ng_x);
        store(hits->Ng_y, hit.Ng_y);
        store(hits->Ng_z, hit.Ng_z);
        store(hits->u, hit.u);
        store(hits->v, hit.v);
        store(hits->primID, hit.primID);
        store(hits->geomID, hit.geomID);
        store(hits->instID[0], hit.instID[0]);
    }
};

struct Arrays {
    const RTCRayNp* rays;
    const RTCHitNp* hits;

    ArrayLane operator[](std::size_t i) const { return {rays, hits, i}; }
};

#endif

}  // namespace mray::embree
