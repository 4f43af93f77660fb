#include "image/check_tiff.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>

namespace polymorph {
namespace {

// TIFF 6.0, section 2, and the BigTIFF design (libtiff): the same directory with wider counts and
// offsets.
constexpr std::uint64_t kWidth = 256, kHeight = 257, kChannels = 277, kTileWidth = 322,
                        kTileHeight = 323;
constexpr std::uint64_t kStripOffsets = 273, kStripByteCounts = 279, kTileOffsets = 324,
                        kTileByteCounts = 325;
constexpr std::array<std::uint64_t, 19> kTypeSizes{0, 1, 1, 2, 4, 8, 1, 1, 2, 4,
                                                   8, 4, 8, 4, 0, 0, 8, 8, 8};

struct TiffEntry {
  std::uint64_t tag = 0, item_size = 0, count = 0,
                offset = 0;  ///< `offset`: position of its values
};

class TiffReader {
 public:
  explicit TiffReader(std::string_view bytes)
      : bytes_(bytes), little_(bytes[0] == 'I'), big_(bytes[little_ ? 2 : 3] == 43) {}

  TiffSize size() const {
    TiffSize size;
    const std::uint64_t directory = first_directory(), count = number(directory, head_size());
    for (std::uint64_t i = 0; i < count && i < kMaxEntries; ++i) {
      const TiffEntry entry = read_entry(directory + head_size() + i * entry_size());
      const auto value = static_cast<double>(number(entry.offset, entry.item_size));
      if (entry.tag == kWidth || entry.tag == kTileWidth) size.width = std::max(size.width, value);
      if (entry.tag == kHeight || entry.tag == kTileHeight)
        size.height = std::max(size.height, value);
      if (entry.tag == kChannels) size.channels = std::max(size.channels, value);
    }
    return size;
  }

  /// Tests that the first directory, its entries and the picture lie within the file.
  bool is_complete() const {
    const std::uint64_t directory = first_directory(), head = head_size(), size = entry_size();
    if (!is_within_file(directory, head)) return false;
    const std::uint64_t count = number(directory, head);
    if (count > bytes_.size() / size || !is_within_file(directory + head, count * size))
      return false;
    std::optional<TiffEntry> offsets, lengths;
    for (std::uint64_t i = 0; i < count; ++i) {
      const TiffEntry entry = read_entry(directory + head + i * size);
      if (entry.count > bytes_.size() ||
          !is_within_file(entry.offset, entry.count * entry.item_size))
        return false;
      if (entry.tag == kStripOffsets || entry.tag == kTileOffsets) offsets = entry;
      if (entry.tag == kStripByteCounts || entry.tag == kTileByteCounts) lengths = entry;
    }
    return !offsets || !lengths || has_strips(*offsets, *lengths);
  }

 private:
  static constexpr std::uint64_t kMaxEntries = 65536;

  std::uint64_t first_directory() const { return big_ ? number(8, 8) : number(4, 4); }
  std::uint64_t head_size() const { return big_ ? 8 : 2; }
  std::uint64_t entry_size() const { return big_ ? 20 : 12; }
  bool is_within_file(std::uint64_t offset, std::uint64_t size) const {
    return offset <= bytes_.size() && size <= bytes_.size() - offset;
  }
  /// Reads an integer; 0 beyond the end of the file.
  std::uint64_t number(std::uint64_t offset, std::uint64_t size) const {
    if (!is_within_file(offset, size)) return 0;
    std::uint64_t value = 0;
    for (std::uint64_t i = 0; i < size; ++i)
      value =
          value << 8 | static_cast<unsigned char>(bytes_[offset + (little_ ? size - 1 - i : i)]);
    return value;
  }
  TiffEntry read_entry(std::uint64_t offset) const {
    const std::uint64_t type = number(offset + 2, 2), field_size = big_ ? 8 : 4;
    TiffEntry entry{number(offset, 2), type < kTypeSizes.size() ? kTypeSizes[type] : 0,
                    number(offset + 4, field_size), offset + 4 + field_size};
    if (entry.count > field_size || entry.count * entry.item_size > field_size)
      entry.offset = number(entry.offset, field_size);
    return entry;
  }
  bool has_strips(const TiffEntry& offsets, const TiffEntry& lengths) const {
    for (std::uint64_t i = 0; i < offsets.count && i < lengths.count; ++i)
      if (!is_within_file(number(offsets.offset + i * offsets.item_size, offsets.item_size),
                          number(lengths.offset + i * lengths.item_size, lengths.item_size)))
        return false;
    return true;
  }

  std::string_view bytes_;
  bool little_, big_;
};

}  // namespace

Status check_tiff(std::string_view bytes) {
  if (TiffReader(bytes).is_complete()) return Ok{};
  return make_error(ErrorCode::kInput, "the TIFF is truncated");
}

TiffSize tiff_size(std::string_view bytes) { return TiffReader(bytes).size(); }

}  // namespace polymorph
