#include "common/report/shell_text.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace mray {
namespace {

TEST(ShellText, SurvivesAShell) {
    EXPECT_EQ(shell_quoted("builtin:cloth:100"), "builtin:cloth:100");
    EXPECT_EQ(shell_quoted(""), "''");
    EXPECT_EQ(shell_quoted("a b"), "'a b'");
    EXPECT_EQ(shell_quoted("it's $HOME"), "'it'\\''s $HOME'");
    const std::vector<std::string> arguments = {"morphray", "a b"};
    EXPECT_EQ(shell_line(arguments), "morphray 'a b'");
}

TEST(ShellText, LinesForPeopleHaveNoByteThatIsNotUtf8) {
    const std::vector<std::string> arguments = {
        "caf\xe9"
        "1",
        "\xc3\xa9", "it's\n\\ \xff"};
    EXPECT_EQ(shell_line(arguments), "$'caf\\xE91' '\xc3\xa9' $'it\\'s\\x0A\\\\ \\xFF'");
}

}  // namespace
}  // namespace mray
