#include "image/deflate_runs.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <random>
#include <utility>
#include <vector>

namespace polymorph {
namespace {

using Bytes = std::vector<std::uint8_t>;

/// What zlib makes of the stream; it checks the sum.
Bytes inflate_all(const std::string& packed, std::size_t size) {
  Bytes bytes(size + 1);
  uLongf written = bytes.size();
  EXPECT_EQ(uncompress(bytes.data(), &written, reinterpret_cast<const Bytef*>(packed.data()),
                       packed.size()),
            Z_OK);
  bytes.resize(written);
  return bytes;
}

void expect_restored(const Bytes& bytes) {
  EXPECT_EQ(inflate_all(deflate_runs(bytes), bytes.size()), bytes) << bytes.size() << " bytes";
}

TEST(DeflateRuns, RestoresRunsOfEveryLength) {
  expect_restored({});
  for (std::size_t length = 1; length <= 600; ++length) {
    Bytes bytes{7};
    bytes.insert(bytes.end(), length, 9);
    bytes.push_back(7);
    expect_restored(bytes);
    expect_restored(Bytes(length, 0));
  }
}

TEST(DeflateRuns, RestoresNoiseWithRunsAcrossItsBlocks) {
  std::mt19937 random(1);
  Bytes bytes;
  while (bytes.size() < 700000) {
    const auto value = static_cast<std::uint8_t>(random());
    bytes.insert(bytes.end(), random() % 8 == 0 ? random() % 700 : 1, value);
  }
  expect_restored(bytes);
  Bytes zeros((std::size_t{1} << 19) + 3);
  EXPECT_LT(deflate_runs(zeros).size(), zeros.size() / 500);
  expect_restored(zeros);
}

TEST(DeflateRuns, LimitsTheCodesOfRareBytes) {
  // Counts as Fibonacci's numbers would need codes of 23 bits.
  Bytes bytes;
  std::size_t count = 1, next = 1;
  for (std::uint8_t symbol = 0; symbol < 24; ++symbol) {
    for (std::size_t i = 0; i < count; ++i) {
      bytes.push_back(symbol);
      bytes.push_back(200);  // no runs
    }
    next += std::exchange(count, next);
  }
  expect_restored(bytes);
}

TEST(DeflateRuns, PacksNoiseAsSmallAsZlibsRunsDo) {
  std::mt19937 random(2);
  std::binomial_distribution<int> noise(24, 0.5);
  Bytes bytes(300000);
  for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(noise(random) - 12);
  z_stream stream = {};
  ASSERT_EQ(deflateInit2(&stream, 1, Z_DEFLATED, 15, 8, Z_RLE), Z_OK);
  Bytes packed(bytes.size());
  stream.next_in = bytes.data();
  stream.avail_in = static_cast<uInt>(bytes.size());
  stream.next_out = packed.data();
  stream.avail_out = static_cast<uInt>(packed.size());
  ASSERT_EQ(deflate(&stream, Z_FINISH), Z_STREAM_END);
  EXPECT_LT(static_cast<double>(deflate_runs(bytes).size()),
            1.01 * static_cast<double>(stream.total_out));
  deflateEnd(&stream);
}

}  // namespace
}  // namespace polymorph
