#include "model/load/text_lines.h"

#include <gtest/gtest.h>

#include <cmath>

namespace polymorph {
namespace {

std::vector<std::string> lines_of(std::string_view text) {
  std::vector<std::string> lines;
  for (LineReader reader(text); reader.next();)
    lines.push_back(fmt::format("{}:{}", reader.number(), reader.line()));
  return lines;
}

TEST(LineReader, EndsLinesAtLfCrlfAndLoneCr) {
  const std::vector<std::string> expected{"1:a", "2:b", "3:", "4:c", "5:d"};
  EXPECT_EQ(lines_of("a\nb\r\n\r\n c\t\rd"), expected);
}

TEST(LineReader, JoinsContinuedLinesAndCountsThem) {
  const std::vector<std::string> expected{"1:f 1 2  3", "3:g x"};
  EXPECT_EQ(lines_of("f 1 2 \\\n 3\ng x"), expected);
}

TEST(LineReader, ABackslashAtTheEndOfACommentJoinsNothing) {
  const std::vector<std::string> expected{"1:# C:\\dir\\", "2:v 1 2 3"};
  EXPECT_EQ(lines_of("# C:\\dir\\\nv 1 2 3"), expected);
}

TEST(LineReader, ABackslashAtTheEndOfTheFileIsFine) {
  EXPECT_EQ(lines_of("v 1 2 3 \\"), std::vector<std::string>{"1:v 1 2 3"});
}

TEST(ParseReal, AcceptsWhatOtherProgramsWrite) {
  EXPECT_EQ(parse_real("1").value, 1.0f);
  EXPECT_EQ(parse_real("+1.5").value, 1.5f);
  EXPECT_EQ(parse_real(".5").value, 0.5f);
  EXPECT_EQ(parse_real("-.5e1").value, -5.0f);
  EXPECT_EQ(parse_real("1.").value, 1.0f);
  EXPECT_EQ(parse_real("1E+003").value, 1000.0f);
  EXPECT_EQ(parse_real("0.1").value, 0.1f);
  for (const char* text :
       {"1e-046", "1e-999", "-1e-400", "0.0000000000000000000000000000000000000000000001"}) {
    EXPECT_EQ(parse_real(text).problem, nullptr) << text;
    EXPECT_EQ(parse_real(text).value, 0.0f) << text;
  }
  EXPECT_FALSE(std::signbit(parse_real("-0.0").value)) << "-0 and 0 must weld";
}

TEST(ParseReal, SaysWhatIsWrong) {
  const std::pair<const char*, const char*> cases[] = {
      {"nan", "finite"},       {"NaN", "finite"},        {"-nan(ind)", "finite"},
      {"inf", "finite"},       {"-Infinity", "finite"},  {"-1.#IND", "finite"},
      {"1.#QNAN", "finite"},   {"1e999", "too large"},   {"-1e999", "too large"},
      {"1e16", "too large"},   {"0,5", "decimal comma"}, {"1.234,5", "decimal comma"},
      {"a", "not a number"},   {"1x", "not a number"},   {"0x10", "not a number"},
      {"--1", "not a number"}, {"+-1", "not a number"},  {"", "missing"},
      {"1e", "not a number"},  {".", "not a number"},
  };
  for (const auto& [text, expected] : cases) {
    const ParsedReal real = parse_real(text);
    ASSERT_NE(real.problem, nullptr) << text;
    EXPECT_NE(std::string(real.problem).find(expected), std::string::npos)
        << text << ": " << real.problem;
  }
}

TEST(CheckedText, TellsBinaryAndUtf16AndOtherFormatsApart) {
  const auto message = [](std::string_view bytes) {
    const auto text = check_text(bytes, "x.obj");
    return text ? std::string() : text.error().message;
  };
  EXPECT_EQ(message("v 1 2 3\r\n\tf \xe9t\xe9\n"), "");
  EXPECT_NE(message(std::string_view("v 1\0 2", 6)).find("offset 3"), std::string::npos);
  EXPECT_NE(message(std::string_view("v\0 \0"
                                     "1\0 \0"
                                     "2\0\n\0",
                                     12))
                .find("UTF-16"),
            std::string::npos);
  EXPECT_NE(message(std::string_view("\xff\xfev\0", 4)).find("UTF-16"), std::string::npos);
  EXPECT_NE(message("ply\nformat ascii 1.0\n").find("PLY"), std::string::npos);
  EXPECT_NE(message("\x89PNG\r\n\x1a\n").find("PNG"), std::string::npos);
  EXPECT_EQ(*check_text("\xef\xbb\xbfv 1", "x.obj"), "v 1");
  EXPECT_EQ(*check_text("v 1\x1a", "x.obj"), "v 1");
}

TEST(ErrorList, SortsByLineAndStopsAtTheLimit) {
  ErrorList errors("f.obj");
  errors.add(7, "late");
  errors.add(2, "early");
  EXPECT_EQ(errors.error().message, "f.obj:2: early\nf.obj:7: late");
  for (std::uint32_t i = 0; i < 100; ++i) errors.add(100 + i, "more");
  EXPECT_TRUE(errors.full());
  EXPECT_NE(errors.error().message.find("stopped after 20 errors"), std::string::npos);
  EXPECT_EQ(errors.error().message.find("f.obj:150"), std::string::npos);
}

}  // namespace
}  // namespace polymorph
