#include "image/deflate_runs.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <utility>
#include <vector>

namespace polymorph {
namespace {

/// The alphabet of literals and lengths: 256 bytes, the end of the block, and 29 lengths.
constexpr int kEndOfBlock = 256, kSymbols = 286;
constexpr std::size_t kBlockSize = std::size_t{1} << 18;  // bytes
/// Maximum lengths in bits. Four literals of 12 bits fit into the 56 bits that BitWriter buffers; 7
/// is Deflate's limit for the codes of the code lengths.
constexpr int kMaxCodeBits = 12, kMaxCodeLengthBits = 7;
/// Lengths of runs in bytes: find_runs() compares words of 4 bytes; 258 is Deflate's limit.
constexpr std::size_t kMinRun = 4, kMaxRun = 258;

/// Computes the lengths of Huffman codes, at most `limit` bits; 0 for symbols that do not occur.
/// While the longest code exceeds `limit`, halves all counts (rounded up), which brings the lengths
/// closer together.
void find_code_lengths(std::span<const std::uint32_t> counts, int limit,
                       std::span<std::uint8_t> lengths) {
  std::vector<std::pair<std::uint32_t, int>> leaves;  // (count, symbol)
  for (std::size_t s = 0; s < counts.size(); ++s)
    if (counts[s] > 0) leaves.emplace_back(counts[s], static_cast<int>(s));
  std::fill(lengths.begin(), lengths.end(), std::uint8_t{0});
  if (leaves.size() == 1) {  // a tree needs two leaves
    lengths[static_cast<std::size_t>(leaves[0].second)] = 1;
    return;
  }
  std::sort(leaves.begin(), leaves.end());
  const std::size_t n = leaves.size();
  // Nodes of the Huffman tree: n leaves, then n - 1 inner nodes, the last of which is the root.
  std::vector<std::uint32_t> weights(2 * n - 1);
  std::vector<std::size_t> parents(2 * n - 1);
  std::vector<int> depths(2 * n - 1);
  for (;; std::for_each(leaves.begin(), leaves.end(),
                        [](auto& leaf) { leaf.first = (leaf.first + 1) / 2; })) {
    for (std::size_t i = 0; i < n; ++i) weights[i] = leaves[i].first;
    // Huffman's algorithm with two queues of rising weight: the leaves, and the inner nodes in the
    // order of their creation.
    std::size_t leaf = 0, inner = n;
    for (std::size_t node = n; node < 2 * n - 1; ++node) {
      weights[node] = 0;
      for (int child = 0; child < 2; ++child) {
        const bool leaf_is_lighter = leaf < n && (inner >= node || weights[leaf] <= weights[inner]);
        const std::size_t child_node = leaf_is_lighter ? leaf++ : inner++;
        parents[child_node] = node;
        weights[node] += weights[child_node];
      }
    }
    depths[2 * n - 2] = 0;
    for (std::size_t i = 2 * n - 2; i-- > 0;) depths[i] = depths[parents[i]] + 1;
    if (*std::max_element(depths.begin(), depths.begin() + static_cast<std::ptrdiff_t>(n)) <= limit)
      break;
  }
  for (std::size_t i = 0; i < n; ++i)
    lengths[static_cast<std::size_t>(leaves[i].second)] = static_cast<std::uint8_t>(depths[i]);
}

struct Code {
  std::uint32_t bits = 0;  ///< the code; its first bit in the stream is the lowest
  int length = 0;
};

/// Assigns the canonical codes of given lengths (RFC 1951, section 3.2.2).
void assign_codes(std::span<const std::uint8_t> lengths, std::span<Code> codes) {
  std::array<std::uint32_t, 17> count{}, next{};  // by length: number of codes, and the next code
  for (const std::uint8_t length : lengths) ++count[length];
  count[0] = 0;  // symbols that do not occur have no code
  for (std::size_t b = 1; b < 16; ++b) next[b + 1] = (next[b] + count[b]) << 1;
  for (std::size_t s = 0; s < lengths.size(); ++s) {
    std::uint32_t code = lengths[s] > 0 ? next[lengths[s]]++ : 0, reversed = 0;
    for (int b = 0; b < lengths[s]; ++b, code >>= 1) reversed = reversed << 1 | (code & 1);
    codes[s] = {reversed, lengths[s]};
  }
}

/// Writes bits to a buffer, which must be large enough.
class BitWriter {
 public:
  explicit BitWriter(char* out) : out_(out) {}
  /// Appends `length` bits, at most 56 in all between two calls of flush().
  void put(std::uint64_t bits, int length) {
    pending_ |= bits << pending_bits_;
    pending_bits_ += length;
  }
  void put(const Code& code) { put(code.bits, code.length); }
  /// Writes the whole bytes among the pending bits; at most 7 bits stay pending.
  void flush() {
    static_assert(std::endian::native == std::endian::little);
    std::memcpy(out_, &pending_, sizeof pending_);
    out_ += pending_bits_ >> 3;
    pending_ >>= pending_bits_ & ~7;
    pending_bits_ &= 7;
  }
  /// Pads the last byte with zeros and returns the end of the output.
  char* finish() {
    pending_bits_ = (pending_bits_ + 7) & ~7;
    flush();
    return out_;
  }

 private:
  char* out_;
  std::uint64_t pending_ = 0;
  int pending_bits_ = 0;
};

/// A run's length as Deflate writes it: a symbol, followed by the extra bits.
struct LengthCode {
  int symbol = 0, extra_bits = 0;  ///< `extra_bits`: number of bits of `extra`
  std::uint32_t extra = 0;
};

/// Returns the codes of the lengths 3 to 258, indexed by length (RFC 1951, section 3.2.5).
const std::array<LengthCode, kMaxRun + 1>& length_codes() {
  static const auto codes = [] {
    std::array<LengthCode, kMaxRun + 1> table{};
    std::uint32_t length = 3;
    for (int symbol = 257; symbol < 285; ++symbol) {
      const int extra_bits = symbol < 265 ? 0 : (symbol - 261) / 4;
      for (std::uint32_t extra = 0; extra < (1u << extra_bits); ++extra)
        table[length++] = {symbol, extra_bits, extra};
    }
    table[kMaxRun] = {285, 0, 0};
    return table;
  }();
  return codes;
}

/// A sequence of bytes that all equal the byte before the sequence.
struct Run {
  std::size_t first, size;
};

/// Finds the runs of kMinRun to kMaxRun bytes in [first, end). The first run may repeat the last
/// byte of the previous block.
std::vector<Run> find_runs(std::span<const std::uint8_t> bytes, std::size_t first,
                           std::size_t end) {
  const auto load = [&](std::size_t i) {
    std::uint32_t word;
    std::memcpy(&word, &bytes[i], sizeof word);
    return word;
  };
  std::vector<Run> runs;
  for (std::size_t i = std::max<std::size_t>(first, 1); i + kMinRun <= end;) {
    // Byte k is 0 if bytes[i + k] equals the byte before it.
    const std::uint32_t differences = load(i) ^ load(i - 1);
    if (differences != 0) {
      // A run can begin only after the last of the four bytes that differs.
      i += 4 - static_cast<std::size_t>(std::countl_zero(differences)) / 8;
      continue;
    }
    std::size_t to = i + kMinRun;
    while (to < end && bytes[to] == bytes[i - 1]) ++to;
    for (; to - i >= kMinRun; i += runs.back().size) runs.push_back({i, std::min(to - i, kMaxRun)});
  }
  return runs;
}

/// Counts of each symbol, in four parts. Successive bytes are counted in different parts, so that
/// equal bytes do not wait for each other's increments.
struct Histogram {
  std::array<std::array<std::uint32_t, kSymbols>, 4> lanes{};
};

void count_literals(std::span<const std::uint8_t> bytes, Histogram& histogram) {
  std::size_t i = 0;
  for (; i + 4 <= bytes.size(); i += 4)
    for (std::size_t k = 0; k < 4; ++k) ++histogram.lanes[k][bytes[i + k]];
  for (; i < bytes.size(); ++i) ++histogram.lanes[0][bytes[i]];
}

/// Writes the code lengths of both alphabets (RFC 1951, section 3.2.7). The alphabet of distances
/// has one symbol, the distance 1, with a code of one bit.
void put_lengths(std::span<const std::uint8_t> lengths, BitWriter& writer) {
  // The order in which a block states the lengths of the codes of code lengths.
  constexpr int kOrder[] = {16, 17, 18, 0, 8, 7, 9, 6, 10, 5, 11, 4, 12, 3, 13, 2, 14, 1, 15};
  std::array<std::uint32_t, 19> counts{};
  std::array<std::uint8_t, 19> code_length_lengths{};
  std::array<Code, 19> codes{};
  for (const std::uint8_t length : lengths) ++counts[length];
  ++counts[1];  // the length of the distance's code
  find_code_lengths(counts, kMaxCodeLengthBits, code_length_lengths);
  assign_codes(code_length_lengths, codes);
  // Numbers of codes: for literals and lengths, for distances, for code lengths.
  writer.put(static_cast<std::uint64_t>(lengths.size() - 257), 5);
  writer.put(0, 5);  // one distance code
  writer.put(std::size(kOrder) - 4, 4);
  writer.flush();
  for (const int symbol : kOrder) {
    writer.put(code_length_lengths[static_cast<std::size_t>(symbol)], 3);
    writer.flush();
  }
  for (const std::uint8_t length : lengths) {
    writer.put(codes[length]);
    writer.flush();
  }
  writer.put(codes[1]);
  writer.flush();
}

/// Writes a block: finds its runs, counts its symbols, computes the codes, then writes the header,
/// the literals and the runs.
void put_block(std::span<const std::uint8_t> bytes, std::size_t first, std::size_t end,
               BitWriter& writer) {
  // Count the symbols: the lengths of the runs, the bytes between them, and the end of the block.
  const std::vector<Run> runs = find_runs(bytes, first, end);
  const auto& run_codes = length_codes();
  Histogram histogram;
  std::size_t at = first;
  for (const Run& run : runs) {
    count_literals(bytes.subspan(at, run.first - at), histogram);
    ++histogram.lanes[0][static_cast<std::size_t>(run_codes[run.size].symbol)];
    at = run.first + run.size;
  }
  count_literals(bytes.subspan(at, end - at), histogram);
  std::array<std::uint32_t, kSymbols>& counts = histogram.lanes[0];
  for (std::size_t k = 1; k < histogram.lanes.size(); ++k)
    for (std::size_t s = 0; s < counts.size(); ++s) counts[s] += histogram.lanes[k][s];
  counts[kEndOfBlock] = 1;
  // Compute the codes, and write the block's header.
  std::array<std::uint8_t, kSymbols> lengths{};
  std::array<Code, kSymbols> codes{};
  find_code_lengths(counts, kMaxCodeBits, lengths);
  assign_codes(lengths, codes);
  writer.put(end == bytes.size() ? 1 : 0, 1);  // 1: the last block
  writer.put(2, 2);                            // block type 2: dynamic Huffman codes
  put_lengths(lengths, writer);
  // Write the runs and the literals between them.
  const auto put_literals = [&](std::size_t from, std::size_t to) {
    for (; from + 4 <= to; from += 4) {
      for (std::size_t k = 0; k < 4; ++k) writer.put(codes[bytes[from + k]]);
      writer.flush();
    }
    for (; from < to; ++from) writer.put(codes[bytes[from]]);
    writer.flush();
  };
  at = first;
  for (const Run& run : runs) {
    put_literals(at, run.first);
    const LengthCode& code = run_codes[run.size];
    writer.put(codes[static_cast<std::size_t>(code.symbol)]);
    // The additional bit 0 is the code of the distance 1.
    writer.put(code.extra, code.extra_bits + 1);
    writer.flush();
    at = run.first + run.size;
  }
  put_literals(at, end);
  writer.put(codes[kEndOfBlock]);
  writer.flush();
}

}  // namespace

std::string deflate_runs(std::span<const std::uint8_t> bytes) {
  constexpr std::size_t kMaxBlockHeader = 512;  // bytes; the code lengths of a block take fewer
  const std::size_t blocks = std::max<std::size_t>(1, (bytes.size() + kBlockSize - 1) / kBlockSize);
  // Each byte takes at most kMaxCodeBits bits. 64 bytes are for the zlib header, the rounding of
  // size / 8, the checksum, and the 8 bytes that BitWriter writes at a time.
  std::string out;
  out.resize(bytes.size() / 8 * kMaxCodeBits + 64 + blocks * kMaxBlockHeader);
  out[0] = 0x78;  // zlib's header: Deflate with a window of 32 kB,
  out[1] = 0x01;  // the fastest level, no dictionary
  BitWriter writer(&out[2]);
  for (std::size_t b = 0; b < blocks; ++b)
    put_block(bytes, b * kBlockSize, std::min((b + 1) * kBlockSize, bytes.size()), writer);
  char* end = writer.finish();
  const auto checksum =
      static_cast<std::uint32_t>(adler32_z(adler32_z(0, nullptr, 0), bytes.data(), bytes.size()));
  for (int shift = 24; shift >= 0; shift -= 8) *end++ = static_cast<char>(checksum >> shift);
  out.resize(static_cast<std::size_t>(end - out.data()));
  return out;
}

}  // namespace polymorph
