#include "common/image/frame.h"

#include "common/base/hash.h"

namespace morphray {

std::uint64_t hits_hash(const Frame& frame) {
    return Hasher().add(std::span(frame.hits)).add(std::span(frame.occlusion)).digest();
}

std::uint64_t image_hash(const Frame& frame) {
    return Hasher().add(std::span(frame.pixels)).digest();
}

}  // namespace morphray
