#include "scene/animated_model.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>
#include <system_error>

#include "base/file.h"
#include "base/json.h"
#include "base/text.h"

namespace polymorph {
namespace {

constexpr char kPlace = '@';  // before a pose's number
constexpr std::size_t kMaxBytes = std::size_t{1} << 32;

bool is_gltf(const std::filesystem::path& file) {
  const std::string suffix = lower_case(file.extension().string());
  return suffix == ".glb" || suffix == ".gltf";
}

/// The JSON of a glTF file; of a .glb its first chunk. Empty where it has none.
std::string gltf_json(const std::filesystem::path& file) {
  const auto bytes = read_file(file, kMaxBytes);
  if (!bytes) return {};
  if (lower_case(file.extension().string()) == ".gltf") return *bytes;
  constexpr std::size_t kHeader = 12, kChunk = 8;
  if (bytes->size() < kHeader + kChunk || bytes->compare(0, 4, "glTF") != 0) return {};
  std::uint32_t length = 0;
  std::memcpy(&length, bytes->data() + kHeader, sizeof length);
  return bytes->substr(kHeader + kChunk, length);
}

/// The largest number of an accessor's bounds, which is the last time of a sampler's keys.
double last_time(const JsonValue& accessors, const JsonValue& sampler) {
  const JsonValue* input = sampler.find("input");
  if (!input || input->kind != JsonValue::Kind::kNumber) return 0;
  const auto index = static_cast<std::size_t>(std::max(input->number, 0.0));
  if (index >= accessors.items.size()) return 0;
  const JsonValue* bounds = accessors.items[index].find("max");
  const bool known =
      bounds && !bounds->items.empty() && bounds->items[0].kind == JsonValue::Kind::kNumber;
  return known ? bounds->items[0].number : 0;
}

}  // namespace

std::optional<AnimatedPose> find_pose(const std::filesystem::path& path) {
  if (!is_gltf(path)) return std::nullopt;
  const std::string stem = path.stem().string();
  const std::size_t place = stem.rfind(kPlace);
  if (place == std::string::npos || place == 0) return std::nullopt;
  const auto number = parse_integer(stem.substr(place + 1));
  std::error_code error;
  if (!number || *number < 1 || *number > 1000000 || std::filesystem::exists(path, error))
    return std::nullopt;
  AnimatedPose pose;
  pose.file = path.parent_path() / (stem.substr(0, place) + path.extension().string());
  pose.number = static_cast<int>(*number);
  if (!std::filesystem::is_regular_file(pose.file, error)) return std::nullopt;
  return pose;
}

int pose_count(const std::filesystem::path& file) {
  if (!is_gltf(file)) return 0;
  const auto document = parse_json(file.string(), gltf_json(file));
  if (!document || document->root.kind != JsonValue::Kind::kObject) return 0;
  const JsonValue* animations = document->root.find("animations");
  const JsonValue* accessors = document->root.find("accessors");
  if (!animations || !accessors) return 0;
  double seconds = 0;
  for (const JsonValue& animation : animations->items)
    if (const JsonValue* samplers = animation.find("samplers"))
      for (const JsonValue& sampler : samplers->items)
        seconds = std::max(seconds, last_time(*accessors, sampler));
  if (!(seconds > 0)) return 0;
  constexpr double kMaxSeconds = 3600;
  return 1 + static_cast<int>(std::lround(std::min(seconds, kMaxSeconds) * kPosesPerSecond));
}

std::filesystem::path pose_pattern(const std::filesystem::path& file) {
  return file.parent_path() / (file.stem().string() + kPlace + "####" + file.extension().string());
}

}  // namespace polymorph
