#include "model/load/ply_velocities.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <optional>
#include <string>

#include "base/file.h"
#include "base/text.h"

namespace polymorph {
namespace {

enum class Encoding : std::uint8_t { kText, kLittle, kBig };

/// A property of the vertices: its size in bytes, and whether it is a floating-point number.
struct Property {
  std::size_t size = 0;
  bool is_float = false;
};

/// Layout of the vertices in a file, from its header.
struct VertexTable {
  Encoding encoding = Encoding::kText;
  long long count = 0;
  std::vector<Property> properties;
  std::array<std::size_t, 6> columns{};  ///< columns of x, y, z, vx, vy, vz
  std::string_view body;                 ///< all bytes after the header
};

/// Parses the type of a property; nothing if it is unknown or a list.
std::optional<Property> parse_property(std::string_view type) {
  if (type == "char" || type == "uchar" || type == "int8" || type == "uint8")
    return Property{1, false};
  if (type == "short" || type == "ushort" || type == "int16" || type == "uint16")
    return Property{2, false};
  if (type == "int" || type == "uint" || type == "int32" || type == "uint32")
    return Property{4, false};
  if (type == "float" || type == "float32") return Property{4, true};
  if (type == "double" || type == "float64") return Property{8, true};
  return std::nullopt;
}

/// Parses the header; nothing if there are no velocities, if the vertices are not the first element
/// or have a list, or if one of the six columns of a binary file is not floating-point.
std::optional<VertexTable> parse_header(std::string_view bytes) {
  constexpr std::string_view kEnd = "end_header";
  constexpr std::array<std::string_view, 6> kNames{"x", "y", "z", "vx", "vy", "vz"};
  const std::size_t end = bytes.find(kEnd);
  if (!bytes.starts_with("ply") || end == std::string_view::npos) return std::nullopt;
  const std::size_t body = bytes.find('\n', end);
  if (body == std::string_view::npos) return std::nullopt;
  VertexTable table;
  table.body = bytes.substr(body + 1);
  std::vector<std::string> names;
  int elements = 0;
  for (const std::string& line : split(bytes.substr(0, end), '\n')) {
    std::vector<std::string> words = split(line, ' ');
    if (!words.empty() && words.back().ends_with('\r')) words.back().pop_back();
    if (words.size() < 2) continue;
    if (words[0] == "format") {
      table.encoding = words[1] == "binary_little_endian" ? Encoding::kLittle
                       : words[1] == "binary_big_endian"  ? Encoding::kBig
                                                          : Encoding::kText;
    } else if (words[0] == "element" && words.size() == 3) {
      if (elements++ == 0 && words[1] != "vertex") return std::nullopt;
      if (elements == 1) table.count = parse_integer(words[2]).value_or(0);
    } else if (words[0] == "property" && elements == 1) {
      const std::optional<Property> property = parse_property(words[1]);
      if (!property || words.size() != 3) return std::nullopt;
      table.properties.push_back(*property);
      names.push_back(words[2]);
    }
  }
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    const auto column = std::find(names.begin(), names.end(), kNames[i]);
    if (column == names.end()) return std::nullopt;
    table.columns[i] = static_cast<std::size_t>(column - names.begin());
    if (table.encoding != Encoding::kText && !table.properties[table.columns[i]].is_float)
      return std::nullopt;
  }
  return table;
}

float read_binary_number(std::string_view bytes, Encoding encoding) {
  std::uint64_t bits = 0;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    const std::size_t byte = encoding == Encoding::kBig ? bytes.size() - 1 - i : i;
    bits |= static_cast<std::uint64_t>(static_cast<unsigned char>(bytes[i])) << (8 * byte);
  }
  return bytes.size() == 4 ? std::bit_cast<float>(static_cast<std::uint32_t>(bits))
                           : static_cast<float>(std::bit_cast<double>(bits));
}

PointVelocity make_point_velocity(const std::array<float, 6>& n) {
  return {{n[0], n[1], n[2]}, {n[3], n[4], n[5]}};
}

std::vector<PointVelocity> read_text(const VertexTable& table) {
  std::vector<PointVelocity> points;
  std::string_view body = table.body;
  const auto next_word = [&body]() {
    const std::size_t first = std::min(body.find_first_not_of(" \t\r\n"), body.size());
    body.remove_prefix(first);
    const std::string_view word = body.substr(0, body.find_first_of(" \t\r\n"));
    body.remove_prefix(word.size());
    return word;
  };
  std::vector<float> row(table.properties.size());
  for (long long v = 0; v < table.count; ++v) {
    for (float& number : row) {
      const auto value = parse_number(next_word());
      if (!value) return {};
      number = static_cast<float>(*value);
    }
    std::array<float, 6> values{};
    for (std::size_t i = 0; i < 6; ++i) values[i] = row[table.columns[i]];
    points.push_back(make_point_velocity(values));
  }
  return points;
}

std::vector<PointVelocity> read_binary(const VertexTable& table) {
  std::vector<std::size_t> offsets;
  std::size_t stride = 0;
  for (const Property& property : table.properties) {
    offsets.push_back(stride);
    stride += property.size;
  }
  if (table.count < 0 || table.body.size() / stride < static_cast<std::size_t>(table.count))
    return {};
  std::vector<PointVelocity> points;
  for (std::size_t v = 0; v < static_cast<std::size_t>(table.count); ++v) {
    std::array<float, 6> values{};
    for (std::size_t i = 0; i < 6; ++i) {
      const std::size_t column = table.columns[i];
      values[i] = read_binary_number(
          table.body.substr(v * stride + offsets[column], table.properties[column].size),
          table.encoding);
    }
    points.push_back(make_point_velocity(values));
  }
  return points;
}

}  // namespace

std::vector<PointVelocity> load_ply_velocities(const std::filesystem::path& path) {
  if (lower_case(path.extension().string()) != ".ply") return {};
  const auto bytes = read_file(path, 2ull << 30);  // the limit of LoadObjSettings::max_bytes
  if (!bytes) return {};
  const std::optional<VertexTable> table = parse_header(*bytes);
  if (!table) return {};
  return table->encoding == Encoding::kText ? read_text(*table) : read_binary(*table);
}

}  // namespace polymorph
