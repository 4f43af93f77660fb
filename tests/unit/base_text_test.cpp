#include "base/text.h"

#include <gtest/gtest.h>

namespace polymorph {
namespace {

TEST(ParseNumber, TakesWholeFiniteNumbersOnly) {
  EXPECT_EQ(parse_number("1.5e2"), 150.0);
  EXPECT_EQ(parse_number("+.5"), 0.5);
  for (const char* bad : {"", "1,5", "nan", "inf", "1e999", "1 ", "x", "0x10", "+", "--1"})
    EXPECT_FALSE(parse_number(bad)) << bad;
}

TEST(ParseInteger, RefusesFractionsAndOverflow) {
  EXPECT_EQ(parse_integer("-12"), -12);
  for (const char* bad : {"", "1.0", "99999999999999999999", "1x"})
    EXPECT_FALSE(parse_integer(bad)) << bad;
}

TEST(NearestWord, FindsTyposButNotStrangers) {
  const std::vector<std::string> words{"render", "strip", "resolution"};
  EXPECT_EQ(nearest_word("rendr", words), "render");
  EXPECT_EQ(nearest_word("resolutoin", words), "resolution");
  EXPECT_EQ(nearest_word("stirp", words), "strip") << "two swapped letters are one slip";
  EXPECT_FALSE(nearest_word("banana", words));
  EXPECT_FALSE(nearest_word("x", words));
}

TEST(JoinQuoted, ReadsAsASentence) {
  EXPECT_EQ(join_quoted(std::vector<std::string>{"a"}), "\"a\"");
  EXPECT_EQ(join_quoted(std::vector<std::string>{"a", "b", "c"}), "\"a\", \"b\" or \"c\"");
}

TEST(Printable, ReplacesWhatIsNoTextToShow) {
  EXPECT_EQ(printable("Müller ✓ 😀"), "Müller ✓ 😀");
  EXPECT_EQ(printable("M\xfcller"), "M?ller");
  EXPECT_EQ(printable("\xc0\xaf"), "??");       // overlong
  EXPECT_EQ(printable("\xed\xa0\x80"), "???");  // surrogate
  EXPECT_EQ(printable("a\xe2\x9c"), "a??");     // cut short
  EXPECT_EQ(printable("\x1b[31mred\x7f"), "?[31mred?");
  EXPECT_EQ(printable("a\nb\tc\r"), "a?b?c?");
  EXPECT_EQ(printable("a\nb\tc\r", LineBreaks::kKeep), "a\nb\tc?");
  EXPECT_EQ(printable("\xc2\x9b"
                      "31m \xc2\xa0"),
            "?31m \xc2\xa0");  // C1, and a blank beside it
  EXPECT_EQ(printable("gpj.\xe2\x80\xae"
                      "exe \xe2\x81\xa6x \xe2\x80\xa8"),
            "gpj.?exe ?x ?");
  EXPECT_EQ(printable_json("\"\xc2\x9b✓\xe2\x80\xae\x7f\""), "\"\\u009b✓\\u202e\\u007f\"");
  EXPECT_EQ(escape_markup("<\x1b\n"), "&lt;?\n");
}

TEST(Format, BytesAndSeconds) {
  EXPECT_EQ(format_bytes(1234567), "1.2 MB");
  EXPECT_EQ(format_seconds(0.5), "0.50 s");
  EXPECT_EQ(format_seconds(75), "1 min 15 s");
  EXPECT_EQ(format_seconds(59.999), "60.00 s");
  EXPECT_EQ(format_seconds(7260), "2 h 01 min");
}

}  // namespace
}  // namespace polymorph
