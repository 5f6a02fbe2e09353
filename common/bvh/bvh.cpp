#include "common/bvh/bvh.h"

#include "common/base/hash.h"

namespace mray {

std::uint64_t bvh_hash(const Bvh& bvh) {
    return Hasher().add(std::span(bvh.nodes)).add(std::span(bvh.leaves)).digest();
}

}  // namespace mray
