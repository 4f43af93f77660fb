#include "analyze/analysis_report.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace polymorph {
namespace {

Analysis small() {
  Analysis analysis;
  analysis.from = "a<b>";
  analysis.to = "c";
  for (int k = 0; k < 3; ++k) {
    FrameMeasures row;
    row.time = k / 2.0;
    row.surface.volume = 1 + k;
    row.surface.digest = "abc";
    analysis.frames.push_back(row);
  }
  analysis.metrics.push_back({"pop", "5 smoothness", 2.5, "<= 2", "pace"});
  analysis.metrics.push_back({"attributes", "1 attributes", std::nullopt, ">= 0.95", "labels"});
  return analysis;
}

TEST(Limits, AreParsedInEveryComparison) {
  for (const auto& [text, comparison] : {std::pair{"pop<=2", "<="},
                                         {"pop >= 2", ">="},
                                         {"pop<2", "<"},
                                         {"pop>2", ">"},
                                         {"pop==2", "="}}) {
    const auto limit = parse_limit(text);
    ASSERT_TRUE(limit) << limit.error().message;
    EXPECT_EQ(limit->metric, "pop");
    EXPECT_EQ(limit->comparison, comparison);
    EXPECT_EQ(limit->bound, 2);
  }
}

TEST(Limits, BadOnesSayWhatIsWrong) {
  for (const char* text : {"pop", "pop<=", "<=2", "pop<=two", ""})
    EXPECT_NE(parse_limit(text).error().message.find("as in \"pop<=2\""), std::string::npos)
        << text;
  EXPECT_NE(parse_limit("popp<=2").error().message.find("did you mean \"pop\""), std::string::npos);
}

TEST(Limits, OneThatDoesNotHoldOrCannotBeMeasuredIsBroken) {
  const auto broken = [](const char* text) {
    return broken_limits({small()}, {*parse_limit(text)}).size();
  };
  EXPECT_EQ(broken("pop<=2"), 1u);
  EXPECT_EQ(broken("pop<=2.5"), 0u);
  EXPECT_EQ(broken("pop>2"), 0u);
  EXPECT_EQ(broken("attributes>=0"), 1u);
}

TEST(Reports, TellTheSameNumbersInJsonCsvAndHtml) {
  const auto json = analysis_json({small()});
  const JsonValue& morph = json.get("morphs").items.at(0);
  EXPECT_EQ(morph.get("metrics").get("pop").get("value").number, 2.5);
  EXPECT_TRUE(morph.get("metrics").get("attributes").find("value")->is_null());
  EXPECT_EQ(morph.get("frames").items.at(2).get("volume").number, 3.0);
  const std::string csv = analysis_csv({small()});
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 4);
  const auto commas = [](const std::string& line) {
    return std::count(line.begin(), line.end(), ',');
  };
  EXPECT_EQ(commas(csv.substr(0, csv.find('\n'))),
            commas(csv.substr(csv.rfind('\n', csv.size() - 2) + 1)));
  const std::string html = analysis_html({small()}, "title & more");
  EXPECT_NE(html.find("a&lt;b&gt;"), std::string::npos);
  EXPECT_NE(html.find("title &amp; more"), std::string::npos);
  EXPECT_NE(html.find("prefers-color-scheme:dark"), std::string::npos);
  EXPECT_EQ(html.find("http"), std::string::npos);  // self-contained
}

}  // namespace
}  // namespace polymorph
