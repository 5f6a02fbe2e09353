// What texts contain.
#pragma once

#include <gtest/gtest.h>

#include <string>

namespace mray::test {

/// Whether a text contains a part; the message of a failure has both.
inline testing::AssertionResult has(const std::string& text, const std::string& part) {
    const bool is_found = text.find(part) != std::string::npos;
    return testing::AssertionResult(is_found) << '\'' << part << "' in:\n" << text;
}

}  // namespace mray::test
