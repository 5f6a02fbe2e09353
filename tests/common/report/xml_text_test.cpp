#include "common/report/xml_text.h"

#include <gtest/gtest.h>

namespace mray {
namespace {

TEST(XmlText, EscapesMarkup) {
    EXPECT_EQ(xml_escaped("a<b>&\"c\""), "a&lt;b&gt;&amp;&quot;c&quot;");
    EXPECT_EQ(xml_ascii("a<b>&\"c\""), "a&lt;b&gt;&amp;&quot;c&quot;");
}

TEST(XmlText, AsciiHasNothingThatXmlExcludes) {
    EXPECT_EQ(xml_ascii(std::string("\0\x1b\xff\n\x7f", 5)), "?????");
    EXPECT_EQ(xml_escaped("\xc3\xa9"), "\xc3\xa9");
    EXPECT_EQ(xml_escaped("\xe9<"), "\\xE9&lt;");
}

}  // namespace
}  // namespace mray
