#include "image/check_tiff.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>

#include "image/byte_order.h"

namespace polymorph {
namespace {

// Tags and types of TIFF 6.0, section 2. BigTIFF (libtiff's design) has the same directory with
// wider counts and offsets.
constexpr std::uint64_t kWidthTag = 256, kHeightTag = 257, kChannelsTag = 277, kTileWidthTag = 322,
                        kTileHeightTag = 323;
constexpr std::uint64_t kStripOffsetsTag = 273, kStripByteCountsTag = 279, kTileOffsetsTag = 324,
                        kTileByteCountsTag = 325;
/// Bytes per value, indexed by the type's code; 0 for codes without a type.
constexpr std::array<std::uint64_t, 19> kTypeSizes{0, 1, 1, 2, 4, 8, 1, 1, 2, 4,
                                                   8, 4, 8, 4, 0, 0, 8, 8, 8};

/// A directory entry: `count` values of `item_size` bytes at `offset` in the file.
struct TiffEntry {
  std::uint64_t tag = 0, item_size = 0, count = 0, offset = 0;
};

class TiffReader {
 public:
  /// `bytes` begins with a TIFF's magic: byte order "II" or "MM", then the version.
  explicit TiffReader(std::string_view bytes)
      : bytes_(bytes),
        is_little_endian_(bytes[0] == 'I'),
        is_big_tiff_(bytes[is_little_endian_ ? 2 : 3] == 43) {}  // version 42 is TIFF, 43 BigTIFF

  TiffSize size() const {
    TiffSize size;
    const std::uint64_t directory = first_directory(),
                        count = read_integer(directory, count_size());
    for (std::uint64_t i = 0; i < count && i < kMaxEntries; ++i) {
      const TiffEntry entry = read_entry(directory + count_size() + i * entry_size());
      const auto value = static_cast<double>(read_integer(entry.offset, entry.item_size));
      if (entry.tag == kWidthTag || entry.tag == kTileWidthTag)
        size.width = std::max(size.width, value);
      if (entry.tag == kHeightTag || entry.tag == kTileHeightTag)
        size.height = std::max(size.height, value);
      if (entry.tag == kChannelsTag) size.channels = std::max(size.channels, value);
    }
    return size;
  }

  /// Tests that the first directory, its entries and the picture lie within the file.
  bool is_complete() const {
    const std::uint64_t directory = first_directory(), count_bytes = count_size(),
                        size = entry_size();
    if (!is_within_file(directory, count_bytes)) return false;
    const std::uint64_t count = read_integer(directory, count_bytes);
    if (count > bytes_.size() / size || !is_within_file(directory + count_bytes, count * size))
      return false;
    std::optional<TiffEntry> offsets, byte_counts;  // of strips or tiles
    for (std::uint64_t i = 0; i < count; ++i) {
      const TiffEntry entry = read_entry(directory + count_bytes + i * size);
      // The first test keeps the product from overflowing.
      if (entry.count > bytes_.size() ||
          !is_within_file(entry.offset, entry.count * entry.item_size))
        return false;
      if (entry.tag == kStripOffsetsTag || entry.tag == kTileOffsetsTag) offsets = entry;
      if (entry.tag == kStripByteCountsTag || entry.tag == kTileByteCountsTag) byte_counts = entry;
    }
    // Without both tables there are no strips to check.
    return !offsets || !byte_counts || strips_are_within_file(*offsets, *byte_counts);
  }

 private:
  static constexpr std::uint64_t kMaxEntries = 65536;  // a damaged BigTIFF may claim 2^64

  std::uint64_t first_directory() const {
    return is_big_tiff_ ? read_integer(8, 8) : read_integer(4, 4);
  }
  /// Bytes of a directory's number of entries, and of an entry.
  std::uint64_t count_size() const { return is_big_tiff_ ? 8 : 2; }
  std::uint64_t entry_size() const { return is_big_tiff_ ? 20 : 12; }
  bool is_within_file(std::uint64_t offset, std::uint64_t size) const {
    return offset <= bytes_.size() && size <= bytes_.size() - offset;
  }
  /// Reads an unsigned integer of `size` bytes; 0 beyond the end of the file.
  std::uint64_t read_integer(std::uint64_t offset, std::uint64_t size) const {
    return is_little_endian_ ? read_little_endian(bytes_, offset, size)
                             : read_big_endian(bytes_, offset, size);
  }
  /// Reads an entry: tag and type of 2 bytes each, then count and value of `field_size` bytes each.
  TiffEntry read_entry(std::uint64_t offset) const {
    const std::uint64_t type = read_integer(offset + 2, 2), field_size = is_big_tiff_ ? 8 : 4;
    TiffEntry entry{read_integer(offset, 2), type < kTypeSizes.size() ? kTypeSizes[type] : 0,
                    read_integer(offset + 4, field_size), offset + 4 + field_size};
    // Values that fit into the field stand there; otherwise the field holds their offset.
    if (entry.count > field_size || entry.count * entry.item_size > field_size)
      entry.offset = read_integer(entry.offset, field_size);
    return entry;
  }
  bool strips_are_within_file(const TiffEntry& offsets, const TiffEntry& byte_counts) const {
    for (std::uint64_t i = 0; i < offsets.count && i < byte_counts.count; ++i)
      if (!is_within_file(
              read_integer(offsets.offset + i * offsets.item_size, offsets.item_size),
              read_integer(byte_counts.offset + i * byte_counts.item_size, byte_counts.item_size)))
        return false;
    return true;
  }

  std::string_view bytes_;
  bool is_little_endian_, is_big_tiff_;
};

}  // namespace

Status check_tiff(std::string_view bytes) {
  if (TiffReader(bytes).is_complete()) return Ok{};
  return make_error(ErrorCode::kInput, "the TIFF is truncated");
}

TiffSize tiff_size(std::string_view bytes) { return TiffReader(bytes).size(); }

}  // namespace polymorph
