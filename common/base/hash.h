// XXH3, 64 bits, over arrays of plain data.
#pragma once

#include <xxhash.h>

#include <cstdint>
#include <new>
#include <span>
#include <type_traits>

namespace mray {

class Hasher {
public:
    Hasher() : state_(XXH3_createState()) {
        if (state_ == nullptr) throw std::bad_alloc();
        XXH3_64bits_reset(state_);
    }
    ~Hasher() { XXH3_freeState(state_); }
    Hasher(const Hasher&) = delete;
    Hasher& operator=(const Hasher&) = delete;

    /// Adds the bytes of an array whose elements have no padding.
    template <class Array>
    Hasher& add(const Array& values) {
        const std::span array(values);
        static_assert(std::is_trivially_copyable_v<typename decltype(array)::value_type>);
        XXH3_64bits_update(state_, array.data(), array.size_bytes());
        return *this;
    }

    std::uint64_t digest() const { return XXH3_64bits_digest(state_); }

private:
    XXH3_state_t* state_;
};

/// The digest of one small value without padding.
template <class T>
std::uint64_t hash_of(const T& value) {
    static_assert(std::has_unique_object_representations_v<T>);
    return XXH3_64bits(&value, sizeof value);
}

}  // namespace mray
