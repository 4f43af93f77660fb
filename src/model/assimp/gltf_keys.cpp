#include "model/assimp/gltf_keys.h"

#include <fmt/format.h>

#include <algorithm>
#include <assimp/IOStream.hpp>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <optional>
#include <string_view>
#include <utility>

#include "base/exact_math.h"
#include "base/json.h"
#include "base/packed_text.h"

namespace {

using polymorph::JsonValue;

std::string read_bytes(Assimp::IOSystem& system, const std::string& path) {
  Assimp::IOStream* const stream = system.Open(path.c_str(), "rb");
  if (!stream) return {};
  std::string bytes(stream->FileSize(), '\0');
  bytes.resize(stream->Read(bytes.data(), 1, bytes.size()));
  system.Close(stream);
  return bytes;
}

/// The two chunks of a .glb file; of a .gltf file, `json` is the whole file.
struct Chunks {
  std::string json, bytes;
};

Chunks split_chunks(std::string file) {
  constexpr std::size_t kFileHeader = 12, kChunkHeader = 8;  // bytes
  if (file.size() < kFileHeader || file.compare(0, 4, "glTF") != 0) return {std::move(file), {}};
  Chunks chunks;
  for (std::size_t offset = kFileHeader; offset + kChunkHeader <= file.size();) {
    std::uint32_t length = 0;
    std::memcpy(&length, file.data() + offset, sizeof length);
    const std::string_view kind(file.data() + offset + 4, 4);
    offset += kChunkHeader;
    const std::size_t size = std::min<std::size_t>(length, file.size() - offset);
    if (kind == "JSON") chunks.json = file.substr(offset, size);
    if (kind == std::string_view("BIN\0", 4)) chunks.bytes = file.substr(offset, size);
    offset += size;
  }
  return chunks;
}

std::optional<std::size_t> read_index(const JsonValue& value) {
  if (!value.integral || value.integer < 0) return std::nullopt;
  return static_cast<std::size_t>(value.integer);
}

std::vector<std::size_t> read_indices(const JsonValue& list) {
  std::vector<std::size_t> indices;
  for (const JsonValue& item : list.items)
    if (const auto index = read_index(item)) indices.push_back(*index);
  return indices;
}

/// Returns the list's item at an index; JSON null if there is none.
const JsonValue& find_item(const JsonValue& list, const JsonValue& index) {
  static const JsonValue none;
  const auto item = read_index(index);
  return item && *item < list.items.size() ? list.items[*item] : none;
}

/// Reader of accessors: typed views of a file's buffers.
class Accessors {
 public:
  Accessors(Assimp::IOSystem& system, std::string path, const JsonValue& root, std::string bytes)
      : system_(system), path_(std::move(path)), root_(root) {
    // Buffer 0 is the .glb file's binary chunk, unless it names a file of its own.
    buffers_[0] = std::move(bytes);
    const JsonValue& first = find_item(root.get("buffers"), JsonValue(0));
    if (first.contains("uri")) buffers_.clear();
  }

  /// Reads all numbers of an accessor, `width` per element; nothing if they cannot be read.
  std::optional<std::vector<double>> numbers(const JsonValue& index, std::size_t width);

 private:
  /// Reads a buffer on first use; empty if it cannot be read.
  const std::string& buffer(std::size_t index);

  Assimp::IOSystem& system_;
  std::string path_;
  const JsonValue& root_;
  std::map<std::size_t, std::string> buffers_;
};

const std::string& Accessors::buffer(std::size_t index) {
  const auto [entry, is_new] = buffers_.try_emplace(index);
  if (!is_new) return entry->second;
  const std::string& uri = find_item(root_.get("buffers"), JsonValue(index)).get("uri").string;
  if (uri.starts_with("data:")) {
    const std::size_t comma = uri.find(',');
    if (comma != std::string::npos)
      if (auto bytes = polymorph::decode_base64(std::string_view(uri).substr(comma + 1)))
        entry->second = std::move(*bytes);
  } else if (!uri.empty()) {
    entry->second =
        read_bytes(system_, (std::filesystem::path(path_).parent_path() / uri).string());
  }
  return entry->second;
}

/// Reads a number times `scale`. Normalized integers (scale < 1) are at least -1, as the format
/// requires.
template <class T>
double read_number(const char* bytes, double scale) {
  T value;
  std::memcpy(&value, bytes, sizeof value);
  return std::max(static_cast<double>(value) * scale, scale < 1 ? -1.0 : -HUGE_VAL);
}

std::optional<std::vector<double>> Accessors::numbers(const JsonValue& index, std::size_t width) {
  struct Kind {
    std::int64_t code;  ///< componentType in the file
    std::size_t size;   ///< bytes
    double max_value;   ///< value that stands for 1 if the accessor is normalized
    double (*read)(const char*, double);
  };
  static constexpr Kind kKinds[] = {{5120, 1, 127, read_number<std::int8_t>},
                                    {5121, 1, 255, read_number<std::uint8_t>},
                                    {5122, 2, 32767, read_number<std::int16_t>},
                                    {5123, 2, 65535, read_number<std::uint16_t>},
                                    {5126, 4, 1, read_number<float>}};
  const JsonValue& accessor = find_item(root_.get("accessors"), index);
  const JsonValue& view = find_item(root_.get("bufferViews"), accessor.get("bufferView"));
  const auto count = read_index(accessor.get("count")),
             buffer_index = read_index(view.get("buffer"));
  const auto* const kind = std::find_if(
      std::begin(kKinds), std::end(kKinds),
      [code = accessor.get("componentType").integer](const Kind& k) { return k.code == code; });
  // Sparse accessors are not supported.
  if (!count || !buffer_index || kind == std::end(kKinds) || accessor.contains("sparse"))
    return std::nullopt;
  const std::string& bytes = buffer(*buffer_index);
  const std::size_t view_offset = read_index(view.get("byteOffset")).value_or(0),
                    offset_in_view = read_index(accessor.get("byteOffset")).value_or(0);
  if (view_offset > bytes.size() || offset_in_view > bytes.size() - view_offset)
    return std::nullopt;
  const std::size_t start = view_offset + offset_in_view;
  if (*count > (bytes.size() - start) / (width * kind->size)) return std::nullopt;
  const double scale = accessor.get("normalized").boolean ? 1 / kind->max_value : 1;
  std::vector<double> values(*count * width);
  for (std::size_t i = 0; i < values.size(); ++i) {
    values[i] = kind->read(bytes.data() + start + i * kind->size, scale);
    if (!std::isfinite(values[i])) return std::nullopt;
  }
  return values;
}

/// Reads the keys of a sampler; nothing if they violate the format.
std::optional<GltfKeys> read_keys(Accessors& accessors, const JsonValue& sampler,
                                  const std::string& property) {
  GltfKeys keys;
  const std::string& interpolation = sampler.get("interpolation").string;
  if (interpolation == "STEP") keys.interpolation = GltfKeys::Interpolation::kStep;
  if (interpolation == "CUBICSPLINE") keys.interpolation = GltfKeys::Interpolation::kCubicSpline;
  keys.is_rotation = property == "rotation";
  // An element of the weights' accessor is one number, and a key has one element per morph target.
  const std::size_t element_width = keys.is_rotation ? 4 : property == "weights" ? 1 : 3;
  auto seconds = accessors.numbers(sampler.get("input"), /*width=*/1);
  auto numbers = accessors.numbers(sampler.get("output"), element_width);
  if (!seconds || !numbers || seconds->empty() || !std::is_sorted(seconds->begin(), seconds->end()))
    return std::nullopt;
  const std::size_t value_count =
      seconds->size() * (keys.interpolation == GltfKeys::Interpolation::kCubicSpline ? 3 : 1);
  keys.width = numbers->size() / value_count;
  if (keys.width == 0 || keys.width * value_count != numbers->size() ||
      (property != "weights" && keys.width != element_width))
    return std::nullopt;
  keys.seconds = std::move(*seconds);
  keys.numbers = std::move(*numbers);
  return keys;
}

/// Replaces `numbers` by a list of the same length; ignores a list of another length.
void read_numbers(const JsonValue& list, std::vector<double>& numbers) {
  if (list.items.size() != numbers.size()) return;
  for (std::size_t i = 0; i < numbers.size(); ++i) numbers[i] = list.items[i].number;
}

GltfNode read_node(const JsonValue& root, const JsonValue& value) {
  GltfNode node;
  node.children = read_indices(value.get("children"));
  node.joints = read_indices(find_item(root.get("skins"), value.get("skin")).get("joints"));
  read_numbers(value.get("translation"), node.translation);
  read_numbers(value.get("rotation"), node.rotation);
  read_numbers(value.get("scale"), node.scale);
  for (const JsonValue& weight : value.get("weights").items) node.weights.push_back(weight.number);
  return node;
}

/// Interpolates two unit quaternions on the great circle between them (slerp), along the shorter
/// arc.
std::vector<double> slerp(const double* a, const double* b, double t) {
  double cosine = 0;
  for (int k = 0; k < 4; ++k) cosine += a[k] * b[k];
  const double sign = cosine < 0 ? -1 : 1;
  cosine *= sign;
  double first = 1 - t, second = t;
  constexpr double kNearlyEqual = 0.9999995;  // above it, sin(angle) is too near 0 to divide by
  if (cosine < kNearlyEqual) {
    const double angle = polymorph::exact::acos(cosine), sine = polymorph::exact::sin(angle);
    first = polymorph::exact::sin(first * angle) / sine;
    second = polymorph::exact::sin(second * angle) / sine;
  }
  std::vector<double> rotation(4);
  for (std::size_t k = 0; k < 4; ++k) rotation[k] = first * a[k] + sign * second * b[k];
  return rotation;
}

void normalize(std::vector<double>& quaternion) {
  double length2 = 0;
  for (const double v : quaternion) length2 += v * v;
  if (!(length2 > 0)) {
    quaternion = {0, 0, 0, 1};
    return;
  }
  for (double& v : quaternion) v /= std::sqrt(length2);
}

}  // namespace

std::vector<double> GltfKeys::value_at(double time) const {
  const bool is_cubic = interpolation == Interpolation::kCubicSpline;
  // `slot`: 0 in-tangent, 1 value, 2 out-tangent.
  const auto numbers_at = [&](std::size_t key, std::size_t slot) {
    return numbers.data() + width * (is_cubic ? 3 * key + slot : key);
  };
  const auto next = static_cast<std::size_t>(
      std::upper_bound(seconds.begin(), seconds.end(), time) - seconds.begin());
  const std::size_t key = next == 0 ? 0 : next - 1;
  const double* const first = numbers_at(key, 1);
  std::vector<double> value(first, first + width);
  const double interval = next == 0 || next == seconds.size() ? 0 : seconds[next] - seconds[key];
  if (interval > 0 && interpolation != Interpolation::kStep) {
    const double u = (time - seconds[key]) / interval;
    const double* const second = numbers_at(next, 1);
    if (is_cubic) {
      // Cubic Hermite spline.
      const double *const out_tangent = numbers_at(key, 2), *const in_tangent = numbers_at(next, 0);
      const double u2 = u * u, u3 = u2 * u;
      for (std::size_t i = 0; i < width; ++i)
        value[i] = (2 * u3 - 3 * u2 + 1) * first[i] +
                   interval * (u3 - 2 * u2 + u) * out_tangent[i] + (3 * u2 - 2 * u3) * second[i] +
                   interval * (u3 - u2) * in_tangent[i];
    } else if (is_rotation) {
      std::vector<double> a(first, first + width), b(second, second + width);
      normalize(a);
      normalize(b);
      value = slerp(a.data(), b.data(), u);
    } else {
      for (std::size_t i = 0; i < width; ++i) value[i] = first[i] + (second[i] - first[i]) * u;
    }
  }
  if (is_rotation) normalize(value);
  return value;
}

GltfFile read_gltf(Assimp::IOSystem& system, const std::string& path, bool is_posed) {
  GltfFile file;
  Chunks chunks = split_chunks(read_bytes(system, path));
  const auto document = polymorph::parse_json(path, std::move(chunks.json));
  if (!document) {
    if (is_posed) file.warnings.push_back("its animation cannot be read - it stands still");
    return file;
  }
  const JsonValue& root = document->root;
  // Extensions that Assimp 5.2 reads, or that do not change shapes.
  static constexpr std::string_view kKnown[] = {
      "KHR_draco_mesh_compression", "KHR_texture_transform", "KHR_materials_unlit",
      "KHR_materials_pbrSpecularGlossiness", "KHR_lights_punctual"};
  for (const JsonValue& extension : root.get("extensionsRequired").items)
    if (std::find(std::begin(kKnown), std::end(kKnown), extension.string) == std::end(kKnown))
      file.warnings.push_back(fmt::format(
          "it requires {}, which is not supported - what it describes is missing or wrong",
          extension.string));
  if (!is_posed) return file;
  const JsonValue& scene =
      find_item(root.get("scenes"), root.contains("scene") ? root.get("scene") : JsonValue(0));
  file.roots = read_indices(scene.get("nodes"));
  for (const JsonValue& node : root.get("nodes").items) file.nodes.push_back(read_node(root, node));
  Accessors accessors(system, path, root, std::move(chunks.bytes));
  for (const JsonValue& value : root.get("animations").items) {
    GltfAnimation& animation = file.animations.emplace_back();
    for (const JsonValue& channel : value.get("channels").items) {
      const JsonValue& target = channel.get("target");
      const std::string& property = target.get("path").string;
      const auto node = read_index(target.get("node"));
      if (!node || *node >= file.nodes.size()) continue;  // the format says: ignore the channel
      std::optional<GltfKeys> keys;
      if (property == "translation" || property == "rotation" || property == "scale" ||
          property == "weights")
        keys = read_keys(accessors, find_item(value.get("samplers"), channel.get("sampler")),
                         property);
      if (keys)
        animation[*node].emplace(property, std::move(*keys));
      else
        file.warnings.push_back(fmt::format(
            "keys of \"{}\" of node {} cannot be read - they are ignored", property, *node));
    }
  }
  return file;
}
