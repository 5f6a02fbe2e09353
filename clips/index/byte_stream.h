// Numbers and texts as bytes of a file, little-endian.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

namespace mray {

static_assert(std::endian::native == std::endian::little);

class ByteWriter {
public:
    template <class T>
    void add(T value) {
        static_assert(std::is_arithmetic_v<T>);
        append(&value, sizeof value);
    }
    /// Two bytes of length and at most 65535 bytes of text.
    void add_text(const std::string& text) {
        const std::size_t size = text.size() < 0xFFFF ? text.size() : 0xFFFF;
        add(static_cast<std::uint16_t>(size));
        append(text.data(), size);
    }
    std::vector<std::byte>& bytes() { return bytes_; }

private:
    void append(const void* data, std::size_t size) {
        const auto* const first = static_cast<const std::byte*>(data);
        bytes_.insert(bytes_.end(), first, first + size);
    }

    std::vector<std::byte> bytes_;
};

/// Reads what ByteWriter wrote. Beyond the end every number is 0 and every text empty, and
/// is_valid() is false.
class ByteReader {
public:
    explicit ByteReader(std::span<const std::byte> bytes) : bytes_(bytes) {}

    template <class T>
    T take() {
        static_assert(std::is_arithmetic_v<T>);
        T value = {};
        const std::span<const std::byte> bytes = take_bytes(sizeof value);
        if (!bytes.empty()) std::memcpy(&value, bytes.data(), sizeof value);
        return value;
    }
    std::string take_text() {
        const std::span<const std::byte> bytes = take_bytes(take<std::uint16_t>());
        return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
    }
    std::size_t left() const { return bytes_.size(); }
    bool is_valid() const { return is_valid_; }

private:
    std::span<const std::byte> take_bytes(std::size_t size) {
        if (size > bytes_.size()) {
            is_valid_ = false;
            bytes_ = {};
            return {};
        }
        const std::span<const std::byte> taken = bytes_.first(size);
        bytes_ = bytes_.subspan(size);
        return taken;
    }

    std::span<const std::byte> bytes_;
    bool is_valid_ = true;
};

}  // namespace mray
