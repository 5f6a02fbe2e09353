// Embree's own headers, and where versions 3 and 4 differ, one set of names. MORPHRAY_EMBREE is the
// version that is built.
#pragma once

#define RTC_EXPORT_API
#if MORPHRAY_EMBREE == 3
#include <embree3/rtcore.h>
#else
#include <embree4/rtcore.h>
#endif

#include <cstddef>
#include <cstring>

namespace mray::embree {

#if MORPHRAY_EMBREE == 3
using Context = RTCIntersectContext;
inline constexpr unsigned int kDefaultMask = 0xFFFFFFFFu;
#else
using Context = RTCRayQueryContext;
inline constexpr unsigned int kDefaultMask = 1;
#endif

/// The members of a hit, of 4 bytes each. Behind them version 4 has bytes that are the caller's.
inline constexpr std::size_t kHitMembers = MORPHRAY_EMBREE == 3 ? 8 : 9;
inline void copy_hit(RTCHit& to, const RTCHit& from) { std::memcpy(&to, &from, 4 * kHitMembers); }

inline constexpr unsigned int kInvalid = RTC_INVALID_GEOMETRY_ID;

/// The arguments of a query beside its rays.
struct QueryOptions {
    /// May be null.
    Context* context = nullptr;
    /// The filter of context or arguments; null: none.
    RTCFilterFunctionN filter = nullptr;
    /// Whether it is called for geometries that have not asked for it.
    bool filters_all = false;
};

#if MORPHRAY_EMBREE == 3
inline QueryOptions options_of(Context* context) {
    return {context, context == nullptr ? nullptr : context->filter, true};
}
#else
template <class Arguments>
QueryOptions options_of(const Arguments* arguments) {
    if (arguments == nullptr) return {};
    return {arguments->context, arguments->filter,
            (arguments->flags & RTC_RAY_QUERY_FLAG_INVOKE_ARGUMENT_FILTER) != 0};
}
#endif

}  // namespace mray::embree
