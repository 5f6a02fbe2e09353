#include "report/shell.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace mray {
namespace {

TEST(Shell, SurvivesAShell) {
    EXPECT_EQ(shell_quoted("builtin:cloth:100"), "builtin:cloth:100");
    EXPECT_EQ(shell_quoted(""), "''");
    EXPECT_EQ(shell_quoted("a b"), "'a b'");
    EXPECT_EQ(shell_quoted("it's $HOME"), "'it'\\''s $HOME'");
    const std::vector<std::string> arguments = {"morphray", "a b"};
    EXPECT_EQ(shell_line(arguments), "morphray 'a b'");
}

}  // namespace
}  // namespace mray
