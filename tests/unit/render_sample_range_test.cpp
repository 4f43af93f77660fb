#include "render/sample_range.h"

#include <gtest/gtest.h>

namespace polymorph {
namespace {

TEST(SampleRange, ReadsRangesOfBlocks) {
  const auto range = parse_sample_range("16-47/64");
  ASSERT_TRUE(range);
  EXPECT_EQ(range->first, 16);
  EXPECT_EQ(range->end, 48);
  EXPECT_EQ(range->total, 64);
  EXPECT_EQ(range->count(), 32);
  EXPECT_FALSE(range->is_whole());
  EXPECT_EQ(format_sample_range(*range), "16-47/64");
  EXPECT_TRUE(parse_sample_range("0-63/64")->is_whole());
  EXPECT_TRUE(parse_sample_range("32-39/40")) << "the last block may be short";
  EXPECT_TRUE(parse_sample_range("0-0/1"));
}

TEST(SampleRange, RefusesOthers) {
  for (const char* text :
       {"", "-", "/", "0-15", "15/64", "0/15-64", "0-15/", "-1-15/64", "0-15/64x", "15-0/64",
        "0-64/64", "0-15/0", "0-15/65537", "0-15/64/64", "0-1-5/64"}) {
    const auto range = parse_sample_range(text);
    ASSERT_FALSE(range) << text;
    EXPECT_EQ(range.error().code, ErrorCode::kUsage) << text;
  }
  const auto odd = parse_sample_range("10-20/64");
  ASSERT_FALSE(odd);
  EXPECT_NE(odd.error().message.find("write 0-31/64"), std::string::npos) << odd.error().message;
  EXPECT_FALSE(parse_sample_range("0-31/40") && parse_sample_range("0-35/40"));
}

/// A sum that shows in which order it was made.
struct Term {
  std::string text;
  void add(const Term& other) { text = "(" + text + "+" + other.text + ")"; }
};

std::string sum_blocks(const std::vector<int>& borders) {
  SampleSums<Term> merged;
  for (std::size_t i = 1; i < borders.size(); ++i) {
    SampleSums<Term> part;
    for (int block = borders[i - 1]; block < borders[i]; ++block) {
      part.block().text = std::to_string(block);
      part.end_block(block);
    }
    for (const auto& node : part.nodes()) merged.add(node);
  }
  return merged.total().text;
}

TEST(SampleSums, AreTheSameInWhateverParts) {
  EXPECT_EQ(sum_blocks({0, 1}), "0");
  EXPECT_EQ(sum_blocks({0, 4}), "((0+1)+(2+3))");
  EXPECT_EQ(sum_blocks({0, 5}), "(((0+1)+(2+3))+4)");
  for (int count = 1; count <= 9; ++count) {
    const std::string whole = sum_blocks({0, count});
    for (int cuts = 0; cuts < 1 << (count - 1); ++cuts) {
      std::vector<int> borders{0};
      for (int i = 1; i < count; ++i)
        if (cuts >> (i - 1) & 1) borders.push_back(i);
      borders.push_back(count);
      EXPECT_EQ(sum_blocks(borders), whole) << count << " blocks, cuts " << cuts;
    }
  }
}

TEST(SampleSums, ListsTheNodesOfARange) {
  const auto describe = [](const char* text) {
    std::string nodes;
    const SampleRange range = *parse_sample_range(text);
    for (const BlockSpan node : list_nodes(range))
      nodes += fmt::format("{}+{}:{} ", node.first, node.count, count_samples(node, range.total));
    return nodes;
  };
  EXPECT_EQ(describe("0-63/128"), "0+4:64 ");
  EXPECT_EQ(describe("16-63/64"), "1+1:16 2+2:32 ");
  EXPECT_EQ(describe("0-39/40"), "0+2:32 2+1:8 ");
  EXPECT_EQ(describe("32-39/40"), "2+1:8 ");
}

}  // namespace
}  // namespace polymorph
