#include "image/check_tiff.h"

#include <array>
#include <cstdint>
#include <optional>

namespace polymorph {
namespace {

// TIFF 6.0, section 2, and the BigTIFF design (libtiff): the same directory with wider counts and
// offsets.
constexpr std::uint64_t kStripOffsets = 273, kStripByteCounts = 279, kTileOffsets = 324,
                        kTileByteCounts = 325;
constexpr std::array<std::uint64_t, 19> kTypeSizes{0, 1, 1, 2, 4, 8, 1, 1, 2, 4,
                                                   8, 4, 8, 4, 0, 0, 8, 8, 8};

struct Entry {
  std::uint64_t tag = 0, item_size = 0, count = 0, at = 0;  ///< `at`: where its values lie
};

class Reader {
 public:
  explicit Reader(std::string_view bytes)
      : bytes_(bytes), little_(bytes[0] == 'I'), big_(bytes[little_ ? 2 : 3] == 43) {}

  /// No directory or entry of it lies outside the file, and neither does the picture.
  bool whole() const {
    const std::uint64_t directory = big_ ? number(8, 8) : number(4, 4);
    const std::uint64_t head = big_ ? 8 : 2, size = big_ ? 20 : 12;
    if (!has(directory, head)) return false;
    const std::uint64_t count = number(directory, head);
    if (count > bytes_.size() / size || !has(directory + head, count * size)) return false;
    std::optional<Entry> offsets, lengths;
    for (std::uint64_t i = 0; i < count; ++i) {
      const Entry entry = read_entry(directory + head + i * size);
      if (entry.count > bytes_.size() || !has(entry.at, entry.count * entry.item_size))
        return false;
      if (entry.tag == kStripOffsets || entry.tag == kTileOffsets) offsets = entry;
      if (entry.tag == kStripByteCounts || entry.tag == kTileByteCounts) lengths = entry;
    }
    return !offsets || !lengths || has_parts(*offsets, *lengths);
  }

 private:
  bool has(std::uint64_t at, std::uint64_t size) const {
    return at <= bytes_.size() && size <= bytes_.size() - at;
  }
  /// 0 beyond the end.
  std::uint64_t number(std::uint64_t at, std::uint64_t size) const {
    if (!has(at, size)) return 0;
    std::uint64_t value = 0;
    for (std::uint64_t i = 0; i < size; ++i)
      value = value << 8 | static_cast<unsigned char>(bytes_[at + (little_ ? size - 1 - i : i)]);
    return value;
  }
  Entry read_entry(std::uint64_t at) const {
    const std::uint64_t type = number(at + 2, 2), room = big_ ? 8 : 4;
    Entry entry{number(at, 2), type < kTypeSizes.size() ? kTypeSizes[type] : 0,
                number(at + 4, room), at + 4 + room};
    if (entry.count > room || entry.count * entry.item_size > room)
      entry.at = number(entry.at, room);
    return entry;
  }
  bool has_parts(const Entry& offsets, const Entry& lengths) const {
    for (std::uint64_t i = 0; i < offsets.count && i < lengths.count; ++i)
      if (!has(number(offsets.at + i * offsets.item_size, offsets.item_size),
               number(lengths.at + i * lengths.item_size, lengths.item_size)))
        return false;
    return true;
  }

  std::string_view bytes_;
  bool little_, big_;
};

}  // namespace

Status check_tiff(std::string_view bytes) {
  if (Reader(bytes).whole()) return Ok{};
  return make_error(ErrorCode::kInput, "the TIFF is truncated");
}

}  // namespace polymorph
