// Rays and hits as callers lay them out. Each layout loads rays and stores what a query changes of
// them: `hit`, and tfar.
#pragma once

#include <cstddef>
#include <cstdint>

#include "library/embree/rtcore.h"

namespace mray::embree {

/// Lane i of a packet of N: member after member, each of N lanes.
struct PacketLane {
    float* ray;
    std::size_t n;

    RTCRay load() const {
        RTCRay lane;
        lane.org_x = get<float>(0);
        lane.org_y = get<float>(1);
        lane.org_z = get<float>(2);
        lane.tnear = get<float>(3);
        lane.dir_x = get<float>(4);
        lane.dir_y = get<float>(5);
        lane.dir_z = get<float>(6);
        lane.time = get<float>(7);
        lane.tfar = get<float>(8);
        lane.mask = get<unsigned int>(9);
        lane.id = get<unsigned int>(10);
        lane.flags = get<unsigned int>(11);
        return lane;
    }
    void store_tfar(float tfar) const { ray[8 * n] = tfar; }
    void store_hit(const RTCHit& hit) const {
        set(12, hit.Ng_x);
        set(13, hit.Ng_y);
        set(14, hit.Ng_z);
        set(15, hit.u);
        set(16, hit.v);
        set(17, hit.primID);
        set(18, hit.geomID);
        set(19, hit.instID[0]);
#if MORPHRAY_EMBREE == 4
        set(20, hit.instPrimID[0]);
#endif
    }

    template <class T>
    T get(std::size_t member) const {
        T value;
        __builtin_memcpy(&value, ray + member * n, sizeof value);
        return value;
    }
    template <class T>
    void set(std::size_t member, T value) const {
        __builtin_memcpy(ray + member * n, &value, sizeof value);
    }
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
