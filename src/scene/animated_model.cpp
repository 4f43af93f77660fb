#include "scene/animated_model.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
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

/// The JSON of a glTF file; of a .glb its first chunk, without what follows, which may be large.
/// Empty where it has none.
std::string gltf_json(const std::filesystem::path& file) {
  if (lower_case(file.extension().string()) == ".gltf") {
    const auto text = read_file(file, kMaxBytes);
    return text ? *text : std::string();
  }
  constexpr std::size_t kHeader = 12, kChunk = 8;
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(file, error);
  if (error || size < kHeader + kChunk || !std::filesystem::is_regular_file(file, error)) return {};
  std::ifstream in(file, std::ios::binary);
  char head[kHeader + kChunk] = {};
  if (!in.read(head, sizeof head) || std::memcmp(head, "glTF", 4) != 0) return {};
  std::uint32_t length = 0;
  std::memcpy(&length, head + kHeader, sizeof length);
  std::string json(static_cast<std::size_t>(std::min<std::uintmax_t>(length, size - sizeof head)),
                   '\0');
  in.read(json.data(), static_cast<std::streamsize>(json.size()));
  json.resize(static_cast<std::size_t>(in.gcount()));
  return json;
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
