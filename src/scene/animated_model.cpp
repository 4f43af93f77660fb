#include "scene/animated_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <set>
#include <system_error>
#include <utility>

#include "base/file.h"
#include "base/json.h"
#include "base/text.h"

namespace polymorph {
namespace {

constexpr char kSeparator = '@';  // precedes an animation's name and a pose's number
constexpr std::size_t kMaxBytes = std::size_t{1} << 32;  // of a .gltf file, with embedded buffers

bool is_gltf(const std::filesystem::path& file) {
  const std::string suffix = lower_case(file.extension().string());
  return suffix == ".glb" || suffix == ".gltf";
}

/// Reads the JSON of a glTF file; "" on an error. Reads only the first chunk of a .glb, because the
/// binary chunk may be large.
std::string read_gltf_json(const std::filesystem::path& file) {
  if (lower_case(file.extension().string()) == ".gltf") {
    const auto text = read_file(file, kMaxBytes);
    return text ? *text : std::string();
  }
  constexpr std::size_t kHeader = 12, kChunk = 8;  // bytes of the file's and a chunk's header
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(file, error);
  if (error || size < kHeader + kChunk || !std::filesystem::is_regular_file(file, error)) return {};
  std::ifstream in(file, std::ios::binary);
  char headers[kHeader + kChunk] = {};
  if (!in.read(headers, sizeof headers) || std::memcmp(headers, "glTF", 4) != 0) return {};
  std::uint32_t length = 0;  // bytes of the first chunk, which is JSON
  std::memcpy(&length, headers + kHeader, sizeof length);
  std::string json(
      static_cast<std::size_t>(std::min<std::uintmax_t>(length, size - sizeof headers)), '\0');
  in.read(json.data(), static_cast<std::streamsize>(json.size()));
  json.resize(static_cast<std::size_t>(in.gcount()));
  return json;
}

/// Splits "a@b.glb" at its last kSeparator into "a.glb" and "b"; nullopt if it has none.
std::optional<std::pair<std::filesystem::path, std::string>> split_at_separator(
    const std::filesystem::path& path) {
  const std::string stem = path.stem().string();
  const std::size_t at = stem.rfind(kSeparator);
  if (at == std::string::npos || at == 0) return std::nullopt;
  return std::pair(path.parent_path() / (stem.substr(0, at) + path.extension().string()),
                   stem.substr(at + 1));
}

bool is_file(const std::filesystem::path& path) {
  std::error_code error;
  return std::filesystem::is_regular_file(path, error);
}

/// Returns the name of an animation in paths. Characters that have a meaning in paths become '_'.
/// The name of an unnamed animation is its number, `index` + 1.
std::string path_name(const JsonValue& animation, std::size_t index) {
  std::string name = animation.get("name").string;
  for (char& c : name)
    if (static_cast<unsigned char>(c) < ' ' || std::strchr("/\\#%@", c)) c = '_';
  return name.empty() ? std::to_string(index + 1) : name;
}

/// Finds the item of a list at a JSON index; a null value if there is none.
const JsonValue& find_item(const JsonValue& list, const JsonValue& index) {
  static const JsonValue none;
  return index.integral && index.integer >= 0 && std::cmp_less(index.integer, list.items.size())
             ? list.items[static_cast<std::size_t>(index.integer)]
             : none;
}

/// Lists what an animation moves, as pairs (index of a node, kind): true stands for the node's
/// morph weights, false for its transform.
std::set<std::pair<std::int64_t, bool>> list_targets(const JsonValue& animation) {
  std::set<std::pair<std::int64_t, bool>> targets;
  for (const JsonValue& channel : animation.get("channels").items) {
    const JsonValue& target = channel.get("target");
    if (target.get("node").integral)
      targets.emplace(target.get("node").integer, target.get("path").string == "weights");
  }
  return targets;
}

/// Key times of an animation sampler in seconds.
struct KeyTimes {
  double first = 0, last = 0;
  std::int64_t count = 0;
};

/// Reads key times from the minimum and maximum that glTF requires in their accessor; nullopt if
/// one is missing.
std::optional<KeyTimes> read_key_times(const JsonValue& accessor) {
  const JsonValue &low = accessor.get("min"), &high = accessor.get("max");
  if (low.items.empty() || high.items.empty() || !low.items[0].is_number() ||
      !high.items[0].is_number() || !accessor.get("count").integral)
    return std::nullopt;
  return KeyTimes{low.items[0].number, high.items[0].number, accessor.get("count").integer};
}

/// Finds the film rate, in keys per second, of evenly spaced keys; 0 if the keys have no such rate
/// or are fewer than kMinKeys.
int find_film_rate(const KeyTimes& times) {
  constexpr int kMinKeys = 6, kMinRate = 24, kMaxRate = 120;  // keys; keys per second
  constexpr double kRounding = 0.05;  // keys per second; allows rates such as 23.976
  if (times.count < kMinKeys || !(times.last > times.first)) return 0;
  const double rate = static_cast<double>(times.count - 1) / (times.last - times.first);
  if (!(rate > kMinRate - 1 && rate < kMaxRate + 1)) return 0;  // also keeps lround() in range
  const auto nearest = static_cast<int>(std::lround(rate));
  return std::abs(rate - nearest) <= kRounding && nearest >= kMinRate && nearest <= kMaxRate
             ? nearest
             : 0;
}

}  // namespace

int Animation::pose_count() const {
  constexpr double kMaxSeconds = 3600;  // bounds the number of poses of a damaged file
  if (playing.empty() || !(end > start)) return 0;
  return 1 + static_cast<int>(std::lround(std::min(end - start, kMaxSeconds) * poses_per_second));
}

std::optional<AnimatedPose> parse_animation_path(const std::filesystem::path& path) {
  const auto model_and_name =
      is_gltf(path) && !is_file(path) ? split_at_separator(path) : std::nullopt;
  if (!model_and_name || model_and_name->second.empty() || !is_file(model_and_name->first))
    return std::nullopt;
  return AnimatedPose{model_and_name->first, model_and_name->second, /*number=*/1};
}

std::optional<AnimatedPose> parse_pose_path(const std::filesystem::path& path) {
  const auto model_and_number = is_gltf(path) ? split_at_separator(path) : std::nullopt;
  std::error_code error;
  if (!model_and_number || std::filesystem::exists(path, error)) return std::nullopt;
  const auto number = parse_integer(model_and_number->second);
  // The limit of a million is above every Animation::pose_count().
  if (!number || *number < 1 || *number > 1000000) return std::nullopt;
  AnimatedPose pose;
  if (is_file(model_and_number->first))
    pose.file = model_and_number->first;
  else if (const auto animation_pose = parse_animation_path(model_and_number->first))
    pose = *animation_pose;
  else
    return std::nullopt;
  pose.number = static_cast<int>(*number);
  return pose;
}

Animation read_animation(const std::filesystem::path& file, const std::string& name) {
  Animation animation;
  if (!is_gltf(file)) return animation;
  const auto document = parse_json(file.string(), read_gltf_json(file));
  if (!document) return animation;
  const std::vector<JsonValue>& animations = document->root.get("animations").items;
  std::size_t chosen = 0;
  for (std::size_t i = 0; i < animations.size(); ++i)
    animation.names.push_back(path_name(animations[i], i));
  if (!name.empty()) {
    const auto named_animation = std::find(animation.names.begin(), animation.names.end(), name);
    if (named_animation == animation.names.end()) return animation;
    chosen = static_cast<std::size_t>(named_animation - animation.names.begin());
  }
  std::set<std::pair<std::int64_t, bool>> moving;  // targets of the animations that play
  bool has_times = false;
  int rate = 0;
  for (std::size_t k = 0; k < animations.size(); ++k) {
    // Visit the chosen animation, then the others in order.
    const std::size_t i = k == 0 ? chosen : k <= chosen ? k - 1 : k;
    const auto targets = list_targets(animations[i]);
    // An animation plays if no earlier one moves any of its targets.
    if (targets.empty() || std::any_of(targets.begin(), targets.end(),
                                       [&](const auto& target) { return moving.contains(target); }))
      continue;
    animation.playing.push_back(i);
    moving.insert(targets.begin(), targets.end());
    if (!name.empty() && k > 0) continue;  // only the named animation sets duration and rate
    for (const JsonValue& channel : animations[i].get("channels").items) {
      const JsonValue& sampler = find_item(animations[i].get("samplers"), channel.get("sampler"));
      const auto times =
          read_key_times(find_item(document->root.get("accessors"), sampler.get("input")));
      if (!times) continue;
      animation.start = has_times ? std::min(animation.start, times->first) : times->first;
      animation.end = has_times ? std::max(animation.end, times->last) : times->last;
      has_times = true;
      rate = std::max(rate, find_film_rate(*times));
    }
  }
  if (rate > 0) animation.poses_per_second = rate;
  return animation;
}

int pose_count(const std::filesystem::path& model) {
  const auto pose = parse_animation_path(model);
  return read_animation(pose ? pose->file : model, pose ? pose->animation : std::string())
      .pose_count();
}

std::string describe_missing_poses(const AnimatedPose& pose) {
  const std::string file = pose.file.string();
  const std::vector<std::string> names = read_animation(pose.file).names;
  if (names.empty()) return file + ": it is not animated";
  if (pose.animation.empty()) return file + ": its animations move nothing";
  return fmt::format("{}: it has no animation \"{}\" that moves anything - name {}", file,
                     pose.animation, join_quoted(names));
}

std::string describe_other_animations(const AnimatedPose& pose) {
  const Animation animation = read_animation(pose.file, pose.animation);
  if (!pose.animation.empty() || animation.names.size() <= animation.playing.size()) return {};
  std::string playing, others, first_other;
  for (std::size_t i = 0; i < animation.names.size(); ++i) {
    const bool plays =
        std::find(animation.playing.begin(), animation.playing.end(), i) != animation.playing.end();
    std::string& list = plays ? playing : others;
    list += fmt::format("{}\"{}\"", list.empty() ? "" : ", ", animation.names[i]);
    if (!plays && first_other.empty()) first_other = animation.names[i];
  }
  const std::filesystem::path example_path =
      pose.file.stem().string() + kSeparator + first_other + pose.file.extension().string();
  return fmt::format("{}: plays {}, not {} - {}, or {} in a scene, plays that one",
                     pose.file.string(), playing, others, example_path.string(),
                     pose_pattern(example_path).string());
}

std::filesystem::path pose_pattern(const std::filesystem::path& model) {
  return model.parent_path() /
         (model.stem().string() + kSeparator + "####" + model.extension().string());
}

}  // namespace polymorph
