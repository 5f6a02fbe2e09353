// Letters of ASCII, whatever the locale is.
#pragma once

#include <string>

namespace mray {

/// The letter of lower case of A to Z; any other byte as it is.
constexpr char lower_case(char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
}

inline std::string lower_case(std::string text) {
    for (char& c : text) c = lower_case(c);
    return text;
}

}  // namespace mray
