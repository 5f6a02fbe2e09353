// Files of numpy, taken apart.
#pragma once

#include <gtest/gtest.h>

#include <cstring>
#include <string>

namespace mray::test {

/// The bytes of the array, whose header (version 1.0) is `header` and blanks up to a line end.
inline std::string npy_data(const std::string& file, const std::string& header) {
    const std::string magic("\x93NUMPY\x01\0", 8);
    EXPECT_TRUE(file.starts_with(magic)) << file.substr(0, 8);
    if (file.size() < 10) return {};
    const std::size_t length =
        static_cast<unsigned char>(file[8]) + 256 * static_cast<unsigned char>(file[9]);
    EXPECT_EQ((10 + length) % 64, 0u);
    std::string text = file.substr(10, length);
    EXPECT_TRUE(text.ends_with('\n'));
    text.erase(text.find_last_not_of(" \n") + 1);
    EXPECT_EQ(text, header);
    return file.substr(10 + length);
}

template <class T>
T value_at(const std::string& bytes, std::size_t at) {
    T value;
    std::memcpy(&value, bytes.data() + at, sizeof(T));
    return value;
}

}  // namespace mray::test
