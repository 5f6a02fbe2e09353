#include "report/table.h"

#include <gtest/gtest.h>

namespace mray {
namespace {

TEST(Table, AlignsNumbersRightAndTextLeft) {
    Table table({"n", "name"});
    table.add({"1", "a"});
    table.add({"100", "bcd"});
    EXPECT_EQ(table.text(), "  n  name\n  1  a\n100  bcd\n");
}

TEST(Table, QuotesCellsOfCsv) {
    Table table({"a", "b"});
    table.add({"1,2", "say \"x\""});
    EXPECT_EQ(table.csv(), "a,b\n\"1,2\",\"say \"\"x\"\"\"\n");
}

}  // namespace
}  // namespace mray
