#include "options/amounts.h"

#include <gtest/gtest.h>

namespace polymorph {
namespace {

std::string bytes_of(std::string text) {
  const std::string problem = parse_size(text);
  return problem.empty() ? text : "bad";
}

TEST(Amounts, SizesAreInPowersOf1024) {
  EXPECT_EQ(bytes_of("0"), "0");
  EXPECT_EQ(bytes_of("4096"), "4096");
  EXPECT_EQ(bytes_of("4096b"), "4096");
  EXPECT_EQ(bytes_of("2k"), "2048");
  EXPECT_EQ(bytes_of("2KB"), "2048");
  EXPECT_EQ(bytes_of("2KiB"), "2048");
  EXPECT_EQ(bytes_of("1.5M"), "1572864");
  EXPECT_EQ(bytes_of("3G"), "3221225472");
  EXPECT_EQ(bytes_of("1T"), "1099511627776");
  EXPECT_EQ(bytes_of("0.5"), "1") << "a limit below one byte is still a limit";
}

TEST(Amounts, WhatIsNoSizeIsRefused) {
  for (const char* text : {"", "M", "-1", "1X", "1.2.3M", "nan", "inf", "1 M", "0x10", "1e30T"})
    EXPECT_EQ(bytes_of(text), "bad") << text;
}

TEST(Amounts, OtherUnitsHaveNoBytes) {
  const AmountUnits ages{{'s', 1}, {'d', 86400}};
  EXPECT_EQ(*parse_amount("--max-age", "90", ages, "30d"), 90);
  EXPECT_EQ(*parse_amount("--max-age", "2D", ages, "30d"), 172800);
  const auto bad = parse_amount("--max-age", "2db", ages, "30d");
  ASSERT_FALSE(bad);
  EXPECT_EQ(bad.error().code, ErrorCode::kUsage);
  EXPECT_NE(bad.error().message.find("--max-age 2db"), std::string::npos);
}

}  // namespace
}  // namespace polymorph
