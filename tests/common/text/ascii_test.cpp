#include "common/text/ascii.h"

#include <gtest/gtest.h>

#include <string>

namespace mray {
namespace {

TEST(LowerCase, ChangesTheLettersOfAsciiAndNoOtherByte) {
    const std::string upper = "ABCDEFGHIJKLMNOPQRSTUVWXYZ", lower = "abcdefghijklmnopqrstuvwxyz";
    for (int byte = 0; byte < 256; ++byte) {
        const char c = static_cast<char>(byte);
        const std::size_t letter = upper.find(c);
        EXPECT_EQ(lower_case(c), letter == std::string::npos ? c : lower[letter]) << byte;
    }
    EXPECT_EQ(lower_case(std::string("\xC3\x84 Mesh.OBJ")), "\xC3\x84 mesh.obj");
    EXPECT_EQ(lower_case(std::string()), "");
}

}  // namespace
}  // namespace mray
