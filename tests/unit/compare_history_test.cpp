#include "compare/history.h"

#include <gtest/gtest.h>

#include <limits>

#include "base/file.h"

#include "testing/image.h"

namespace polymorph {
namespace {

/// Runs of one metric with these means; the last takes `share` of its limit.
std::vector<HistoryRow> runs(const std::vector<double>& means, double share = 0.5) {
  std::vector<HistoryRow> rows;
  for (const double mean : means) rows.push_back({"c0ffee", "flip_mean", mean, mean, 0.5});
  rows.back().share = share;
  return rows;
}

TEST(History, FourRisesInARowAreAnAlarm) {
  EXPECT_EQ(rising_metrics(runs({1, 2, 3, 4, 5})), std::vector<std::string>{"flip_mean"});
  EXPECT_EQ(rising_metrics(runs({9, 1, 2, 3, 4, 5})), std::vector<std::string>{"flip_mean"});
  EXPECT_TRUE(rising_metrics(runs({1, 2, 3, 4})).empty()) << "three rises";
  EXPECT_TRUE(rising_metrics(runs({1, 2, 2, 3, 4})).empty()) << "a run that stayed";
  EXPECT_TRUE(rising_metrics(runs({1, 2, 3, 4, 3})).empty()) << "the last run fell";
  EXPECT_TRUE(rising_metrics({}).empty());
}

TEST(History, ARunThatFailedIsNoAlarmBesides) {
  EXPECT_TRUE(rising_metrics(runs({1, 2, 3, 4, 5}, 1.01)).empty());
  EXPECT_TRUE(
      rising_metrics(runs({1, 2, 3, 4, 5}, std::numeric_limits<double>::infinity())).empty());
}

TEST(History, MetricsRiseEachForItself) {
  std::vector<HistoryRow> rows;
  for (int run = 0; run < 5; ++run) {
    rows.push_back({"c", "fail_percent", 5.0 - run, 5, 0.1});
    rows.push_back({"c", "flip_p99", 1.0 + run, 5, std::nullopt});
  }
  EXPECT_EQ(rising_metrics(rows), std::vector<std::string>{"flip_p99"});
}

TEST(History, ReadsWhatItWrites) {
  const TemporaryFolder folder;
  const auto file = folder.path() / "history.csv";
  EXPECT_TRUE(read_history(file)->empty()) << "no file yet";
  const std::vector<HistoryRow> rows = {
      {"a1", "flip_mean", 0.25, 0.5, 0.125},
      {"b2", "fail_percent", 0, 3, std::nullopt},
      {"b2", "flip_p99", 1, 1, std::numeric_limits<double>::infinity()}};
  ASSERT_TRUE(write_file(file, history_text(rows)));
  const auto back = read_history(file);
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_EQ(history_text(*back), history_text(rows));
  EXPECT_EQ((*back)[2].share, rows[2].share);
  EXPECT_FALSE((*back)[1].share);
}

TEST(History, NamesTheLineThatIsWrong) {
  const TemporaryFolder folder;
  const auto file = folder.path() / "history.csv";
  for (const char* line : {"a,flip_mean,-1,2,3", "a,flip_mean,x,2,3", "a,flip_mean,1,2", "nan"}) {
    ASSERT_TRUE(write_file(file, std::string("commit,metric,mean,worst,share\n") + line + "\n"));
    const auto rows = read_history(file);
    ASSERT_FALSE(rows) << line;
    EXPECT_EQ(rows.error().code, ErrorCode::kInput);
    EXPECT_NE(rows.error().message.find("history.csv:2:"), std::string::npos);
  }
}

}  // namespace
}  // namespace polymorph
