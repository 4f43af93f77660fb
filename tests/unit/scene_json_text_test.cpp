#include "scene/json_text.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

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

TEST(JsonText, ValuesAreSetByTheirPath) {
  auto document = parse_json("file", R"({"image": {"width": 1}, "list": [{"a": 1}]})");
  ASSERT_TRUE(document);
  EXPECT_TRUE(set_json_value(*document, "image.width", "640"));
  EXPECT_TRUE(set_json_value(*document, "look.kind", "metal"));  // no JSON: a string
  EXPECT_TRUE(set_json_value(*document, "list.0.a", "[1, 2]"));
  const JsonValue& root = document->root;
  EXPECT_EQ(root.find("image")->find("width")->integer, 640);
  EXPECT_EQ(root.find("look")->find("kind")->string, "metal");
  EXPECT_EQ(root.find("list")->items[0].find("a")->items.size(), 2u);
  const auto bad = set_json_value(*document, "list.7.a", "1");
  ASSERT_FALSE(bad);
  EXPECT_EQ(bad.error().code, ErrorCode::kUsage);
}

TEST(JsonText, WhatIsWrittenIsPrintable) {
  const nlohmann::ordered_json json{{"path", "a\x1b[31m\xff"}};
  const std::string text = dump_json(json);
  EXPECT_EQ(text.find('\x1b'), std::string::npos);
  EXPECT_EQ(text.find('\xff'), std::string::npos);
  EXPECT_EQ(text.back(), '\n');
  EXPECT_TRUE(nlohmann::json::parse(text).contains("path"));
}

}  // namespace
}  // namespace polymorph
