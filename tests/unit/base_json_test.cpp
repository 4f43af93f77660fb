#include "base/json.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <nlohmann/json.hpp>
#include <random>

namespace polymorph {
namespace {

std::string error_of(const std::string& text) {
  const auto document = parse_json("file", text);
  EXPECT_FALSE(document) << text;
  if (document) return "";
  EXPECT_EQ(document.error().code, ErrorCode::kInput);
  return document.error().message;
}

TEST(JsonText, ValuesKnowTheirPlaces) {
  const auto document =
      parse_json("file", "{\n  // a comment\n  \"a\": [1, 2.5, /* b */ \"x\"]\n}");
  ASSERT_TRUE(document) << document.error().message;
  const JsonValue* list = document->root.find("a");
  ASSERT_TRUE(list);
  ASSERT_EQ(list->items.size(), 3u);
  EXPECT_TRUE(list->items[0].integral);
  EXPECT_EQ(list->items[0].integer, 1);
  EXPECT_FALSE(list->items[1].integral);
  EXPECT_EQ(list->items[1].number, 2.5);
  EXPECT_EQ(list->items[2].string, "x");
  const TextPosition at = document->position(list->items[2].offset);
  EXPECT_EQ(at.line, 3);
  EXPECT_EQ(at.column, 25);
}

TEST(JsonText, ErrorsNameLineAndColumn) {
  EXPECT_EQ(error_of("{\n  \"a\": ,\n}").rfind("file:2:8: ", 0), 0u)
      << error_of("{\n  \"a\": ,\n}");
  EXPECT_NE(error_of("").find("file:1:1"), std::string::npos);
}

TEST(JsonText, NothingIsHiddenBehindANul) {
  EXPECT_EQ(error_of(std::string("{}\0{", 4)).rfind("file:1:3: a NUL", 0), 0u);
}

TEST(JsonText, DuplicateKeysNameBothLines) {
  const std::string message = error_of("{\n  \"a\": 1,\n  \"a\": 2\n}");
  EXPECT_EQ(message.rfind("file:3:", 0), 0u) << message;
  EXPECT_NE(message.find("line 2"), std::string::npos) << message;
}

TEST(JsonText, NestingIsBounded) {
  const auto nested = [](int depth) {
    return std::string(static_cast<std::size_t>(depth), '[') +
           std::string(static_cast<std::size_t>(depth), ']');
  };
  EXPECT_TRUE(parse_json("file", nested(60)));
  EXPECT_FALSE(parse_json("file", nested(100)));
  EXPECT_FALSE(parse_json("file", nested(100000)));
}

TEST(JsonText, NumbersHaveTheDigitsThatGoldenFilesHave) {
  const std::pair<JsonValue, const char*> cases[] = {
      {0, "0"},
      {-7, "-7"},
      {INT64_MIN, "-9223372036854775808"},
      {INT64_MAX, "9223372036854775807"},
      {UINT64_MAX, "18446744073709551615"},
      {0.0, "0.0"},
      {-0.0, "-0.0"},
      {1.0, "1.0"},
      {0.1, "0.1"},
      {0.1f, "0.10000000149011612"},
      {2.5f, "2.5"},
      {1.0 / 3, "0.3333333333333333"},
      {0.0001, "0.0001"},
      {0.00001, "1e-05"},
      {1e6, "1000000.0"},
      {123456789012345.0, "123456789012345.0"},
      {1e15, "1e+15"},
      {1e300, "1e+300"},
      {5e-324, "5e-324"},
      {1.7976931348623157e308, "1.7976931348623157e+308"},
      {HUGE_VAL, "null"},
      {std::nan(""), "null"},
  };
  for (const auto& [value, text] : cases) EXPECT_EQ(format_json(value), text);
}

TEST(JsonText, NumbersAreReadBackAsTheyWere) {
  std::mt19937_64 random(1);
  for (int i = 0; i < 20000; ++i) {
    const std::uint64_t bits = random();
    const double number = std::bit_cast<double>(bits);
    if (std::isfinite(number)) {
      const auto document = parse_json("", format_json(number));
      ASSERT_TRUE(document);
      EXPECT_EQ(std::bit_cast<std::uint64_t>(document->root.number), bits);
      EXPECT_EQ(format_json(document->root), nlohmann::json(number).dump());
    }
    const JsonValue whole = bits;
    const auto read = parse_json("", format_json(whole));
    ASSERT_TRUE(read);
    EXPECT_EQ(static_cast<std::uint64_t>(read->root.integer), bits);
    EXPECT_EQ(read->root.integral, bits <= INT64_MAX);
    EXPECT_EQ(read->root.exceeds_int64, bits > INT64_MAX);
  }
}

TEST(JsonText, WhatIsWrittenIsReadBack) {
  const JsonValue value{
      {"null", {}},
      {"yes", true},
      {"list", JsonValue::array({1, -2.5, "three", JsonValue::array()})},
      {"object", {{"text", "\"\\ \n\t\x01 \xc3\xa4"}, {"empty", JsonValue::object()}}},
      {"numbers", std::vector<float>{1, 0.5f}}};
  const std::string line =
      R"({"null":null,"yes":true,"list":[1,-2.5,"three",[]],"object":{"text":"\"\\ \n\t\u0001 \u00e4",)"
      R"("empty":{}},"numbers":[1.0,0.5]})";
  const auto read = parse_json("", line);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(format_json(read->root), format_json(value));
  EXPECT_EQ(format_json(value), nlohmann::ordered_json::parse(line).dump());
  EXPECT_EQ(dump_json(value), nlohmann::ordered_json::parse(line).dump(2) + "\n");
}

TEST(JsonValue, MembersKeepTheirOrder) {
  JsonValue value;
  value["b"] = 1;
  value["a"]["inner"].push_back("x");
  value.update({{"b", 2}, {"c", 3}});
  EXPECT_EQ(format_json(value), R"({"b":2,"a":{"inner":["x"]},"c":3})");
  EXPECT_TRUE(value.contains("c"));
  EXPECT_EQ(value.find("d"), nullptr);
  EXPECT_TRUE(value.get("d").get("e").is_null());
  EXPECT_EQ(value.size(), 3u);
}

TEST(JsonText, WhatIsWrittenIsPrintable) {
  const std::string text = dump_json({{"path", "a\x1b[31m\xff"}});
  EXPECT_EQ(text.find('\x1b'), std::string::npos);
  EXPECT_EQ(text.find('\xff'), std::string::npos);
  EXPECT_EQ(text.back(), '\n');
  EXPECT_TRUE(nlohmann::json::parse(text).contains("path"));
}

}  // namespace
}  // namespace polymorph
