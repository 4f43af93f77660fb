#include "scene/read_fields.h"

#include <fmt/format.h>

#include <cmath>

#include "base/log.h"
#include "base/odd_names.h"
#include "image/srgb.h"
#include "scene/max_frames.h"
#include "scene/memory_models.h"
#include "scene/mesh_numbers.h"

namespace polymorph {
namespace {

constexpr std::size_t kMaxCollectedFindings = 200;  // each costs a search for its line

/// Converts a value to the form that Keyframe holds.
Vec3 as_vector(float value) { return {value, 0, 0}; }
Vec3 as_vector(Vec3 value) { return value; }

}  // namespace

template <class F>
bool FieldReader::read_key(const JsonValue& item, const std::string& pointer, KeyframeTrack& track,
                           const F& read) {
  if (item.kind != JsonValue::Kind::kObject) {
    report_at(
        item.offset, pointer,
        fmt::format("must be {{\"frame\": 1, \"value\": ...}} (is {})", kind_name(item.kind)));
    return false;
  }
  FieldReader fields(document_, item, pointer);
  KeyframeTime time;
  describe(fields, time);
  read(fields);
  fields.finish();
  if (!item.find("value")) report_at(item.offset, pointer, "needs a \"value\"");
  const int time_keys = time.share.has_value() + time.frame.has_value() + time.leg.has_value();
  if (time_keys != 1) {
    report_at(item.offset, pointer, "needs one of \"t\", \"frame\" and \"leg\"");
    return false;
  }
  const KeyUnit unit = time.share ? KeyUnit::kShare : time.frame ? KeyUnit::kFrame : KeyUnit::kLeg;
  const auto at = static_cast<double>(time.share   ? *time.share
                                      : time.frame ? *time.frame
                                                   : *time.leg);
  if (!track.keys.empty() && unit != track.unit) {
    report_at(item.offset, pointer,
              "all keys of a setting say \"t\", or all \"frame\", or all "
              "\"leg\"");
    return false;
  }
  if (!track.keys.empty() && !(at > track.keys.back().at)) {
    report_at(item.offset, pointer,
              fmt::format("must come after the key before it (is at {:g}, after {:g})", at,
                          track.keys.back().at));
    return false;
  }
  track.unit = unit;
  track.keys.push_back({at, {}});
  return true;
}

bool FieldReader::takes_keyframes(Keyframes keyframes) const {
  return keyframes == Keyframes::kAsObject ? keyed_ : keyframes == Keyframes::kAllowed;
}

template <class T, class F>
bool FieldReader::read_keyframes(const char* key, T& out, const F& read, Keyframes keyframes) {
  const bool may_be_keyed = takes_keyframes(keyframes);
  const JsonValue* object = object_.find(key);
  if (!object || object->kind != JsonValue::Kind::kObject) return false;
  if (!may_be_keyed && !object->find("keys")) return false;  // the caller reports an object
  add_known(key);
  if (!may_be_keyed) {
    report(*object, key,
           "cannot change over the film - only settings of camera, lights, ground "
           "and look, image.exposure and weights of a blend take keys");
    return true;
  }
  // Read the easing, then the list of keys.
  KeyframeTrack track;
  track.pointer = pointer_ + "/" + key;
  FieldReader fields(document_, *object, track.pointer);
  describe(fields, track);
  const JsonValue* list = fields.expect("keys", JsonValue::Kind::kArray);
  fields.finish();
  if (!object->find("keys") || (list && list->items.empty()))
    report(*object, key,
           "needs \"keys\", a list of {\"t\", \"frame\" or \"leg\": ..., \"value\": ...}");
  if (!list) return true;
  if (list->items.size() > kMaxItems)
    fields.report(
        *list, "keys",
        fmt::format("has {} entries - a list may have at most {}", list->items.size(), kMaxItems));
  for (std::size_t i = 0; i < std::min(list->items.size(), kMaxItems); ++i) {
    T value = out;  // the default, if the key has no valid value
    if (fields.read_key(list->items[i], fmt::format("{}/keys/{}", track.pointer, i), track,
                        [&](FieldReader& key_fields) { read(key_fields, value); }))
      track.keys.back().value = as_vector(value);
    if (i == 0) out = value;
  }
  if (!track.keys.empty()) document_.tracks.push_back(std::move(track));
  return true;
}

void FieldReader::number(const char* key, float& out, Range<double> range, const char* doc,
                         Keyframes keyframes) {
  const auto read = [&](FieldReader& key_fields, float& value) {
    key_fields.number("value", value, range, doc);
  };
  if (read_keyframes(key, out, read, keyframes)) return;
  const JsonValue* value = find(key);
  if (!value) return;
  if (value->kind != JsonValue::Kind::kNumber)
    return report(*value, key,
                  fmt::format("must be a number{} (is {})",
                              takes_keyframes(keyframes)
                                  ? ", or {\"keys\": [{\"frame\": 1, \"value\": ...}, ...]}"
                                  : "",
                              kind_name(value->kind)));
  if (!(value->number >= range.low && value->number <= range.high))
    report(*value, key,
           fmt::format("must be {:g} to {:g} (is {:g})", range.low, range.high, value->number));
  else
    out = static_cast<float>(value->number);
}

void FieldReader::number(const char* key, std::optional<float>& out, Range<double> range,
                         const char* doc, Keyframes keyframes) {
  if (!object_.find(key)) return add_known(key);
  float value = 0;
  number(key, value, range, doc, keyframes);
  out = value;
}

void FieldReader::boolean(const char* key, bool& out, const char*) {
  if (const JsonValue* value = expect(key, JsonValue::Kind::kBoolean)) out = value->boolean;
}

void FieldReader::boolean(const char* key, std::optional<bool>& out, const char* doc) {
  if (!object_.find(key)) return add_known(key);
  bool value = false;
  boolean(key, value, doc);
  out = value;
}

void FieldReader::text(const char* key, std::string& out, const char*) {
  if (const JsonValue* value = expect(key, JsonValue::Kind::kString)) out = value->string;
}

void FieldReader::path(const char* key, std::filesystem::path& out, const char*) {
  const JsonValue* value = expect(key, JsonValue::Kind::kString);
  if (!value) return;
  out = resolve(value->string);
  check_file(*value, key, out);
}

void FieldReader::model_path(const char* key, std::filesystem::path& out, const char*) {
  const JsonValue* value = expect(key, JsonValue::Kind::kString);
  if (!value) return;
  out = resolve(value->string);
  if (!is_numbered(out)) check_file(*value, key, out);
}

void FieldReader::vector(const char* key, Vec3& out, const char* doc) {
  if (read_keyframes(key, out, [&](FieldReader& key_fields, Vec3& value) {
        key_fields.vector("value", value, doc);
      }))
    return;
  if (const JsonValue* value = expect(key, JsonValue::Kind::kArray))
    read_vector(*value, key, out, -1e6, 1e6);
}

void FieldReader::vector(const char* key, std::optional<Vec3>& out, const char* doc) {
  if (!object_.find(key)) return add_known(key);
  Vec3 value;
  vector(key, value, doc);
  out = value;
}

void FieldReader::scale(const char* key, Vec3& out, const char*) {
  const JsonValue* value = find(key);
  if (!value) return;
  if (value->kind == JsonValue::Kind::kArray) {
    if (read_vector(*value, key, out, -1e6, 1e6) && (out.x == 0 || out.y == 0 || out.z == 0))
      report(*value, key, "must not be 0 along any axis");
  } else if (value->kind == JsonValue::Kind::kNumber) {
    if (!(std::abs(value->number) >= 1e-6 && std::abs(value->number) <= 1e6))
      report(*value, key, fmt::format("must be 1e-6 to 1e6 (is {:g})", value->number));
    const auto s = static_cast<float>(value->number);
    out = {s, s, s};
  } else {
    report(*value, key,
           fmt::format("must be a number or a list of 3 numbers (is {})", kind_name(value->kind)));
  }
}

void FieldReader::color(const char* key, Vec3& out, const char* doc) {
  if (read_keyframes(key, out, [&](FieldReader& key_fields, Vec3& value) {
        key_fields.color("value", value, doc);
      }))
    return;
  const JsonValue* value = find(key);
  if (!value) return;
  if (value->kind == JsonValue::Kind::kArray) {
    read_vector(*value, key, out, 0, 1);
  } else if (value->kind == JsonValue::Kind::kString && read_hex(value->string, out)) {
    // read_hex() has set `out`.
  } else {
    report(*value, key, "must be \"#rrggbb\" (sRGB) or a list of 3 numbers from 0 to 1 (linear)");
  }
}

void FieldReader::color(const char* key, std::optional<Vec3>& out, const char* doc) {
  if (!object_.find(key)) return add_known(key);
  Vec3 value;
  color(key, value, doc);
  out = value;
}

void FieldReader::integers(const char* key, std::vector<int>& out, Range<long long> range,
                           const char*) {
  const JsonValue* value = expect(key, JsonValue::Kind::kArray);
  if (!value) return;
  out.clear();
  for (const JsonValue& item : value->items) {
    if (item.kind != JsonValue::Kind::kNumber || !item.integral || item.integer < range.low ||
        item.integer > range.high)
      report(item, key,
             fmt::format("must be a list of whole numbers, {} to {}", range.low, range.high));
    else
      out.push_back(static_cast<int>(item.integer));
  }
}

void FieldReader::numbers(const char* key, std::vector<float>& out,
                          std::initializer_list<Range<double>> ranges, const char*) {
  const JsonValue* value = expect(key, JsonValue::Kind::kArray);
  if (!value) return;
  std::vector<float> read_values;
  for (const auto& [low, high] : ranges) {
    if (read_values.size() == value->items.size()) break;
    const JsonValue& item = value->items[read_values.size()];
    if (item.kind != JsonValue::Kind::kNumber || !(item.number >= low && item.number <= high))
      return report(
          item, key,
          fmt::format("number {} must be {:g} to {:g}", read_values.size() + 1, low, high));
    read_values.push_back(static_cast<float>(item.number));
  }
  if (value->items.size() != ranges.size())
    return report(
        *value, key,
        fmt::format("must be a list of {} numbers (has {})", ranges.size(), value->items.size()));
  out = std::move(read_values);
}

void FieldReader::text_map(const char* key, std::map<std::string, std::string>& out, const char*) {
  const JsonValue* value = expect(key, JsonValue::Kind::kObject);
  if (!value) return;
  for (const JsonMember& member : value->members) {
    if (member.value.kind == JsonValue::Kind::kString)
      out[member.key] = member.value.string;
    else
      report_at(member.value.offset, pointer_ + "/" + key + "/" + member.key,
                fmt::format("must be a string (is {})", kind_name(member.value.kind)));
  }
}

void FieldReader::landmarks(const char* key, LandmarkSettings& out, const char*) {
  const JsonValue* value = find(key);
  if (value && value->kind == JsonValue::Kind::kArray)
    return report(*value, key,
                  "is no list any more - write {\"first.obj\": {\"nose\": [x, y, z]}, "
                  "\"second.obj\": {\"nose\": \"v12\"}}: points in each file's own coordinates, or "
                  "its vertices");
  value = expect(key, JsonValue::Kind::kObject);
  if (!value) return;
  out.clear();
  for (const JsonMember& member : value->members) {
    const std::string pointer = pointer_ + "/" + key + "/" + member.key;
    if (member.value.kind == JsonValue::Kind::kObject)
      read_landmarks(member.value, pointer, out[member.key]);
    else
      report_at(member.value.offset, pointer,
                fmt::format("must be an object, {{\"nose\": [x, y, z], ...}} (is {})",
                            kind_name(member.value.kind)));
  }
}

void FieldReader::read_landmarks(const JsonValue& value, const std::string& pointer,
                                 ObjectLandmarks& out) {
  constexpr double kMaxCoordinate = 1e9;
  if (value.members.size() > kMaxLandmarks)
    report_at(value.offset, pointer,
              fmt::format("has {} landmarks - an object may have at most {}", value.members.size(),
                          kMaxLandmarks));
  for (const JsonMember& member : value.members) {
    if (out.size() == kMaxLandmarks) break;
    const JsonValue& landmark = member.value;
    LandmarkPoint point;
    point.pointer = pointer + "/" + member.key;
    const TextPosition position = document_.json.position(landmark.offset);
    point.line = position.line, point.column = position.column;
    const bool is_point =
        landmark.items.size() == 3 &&
        std::all_of(landmark.items.begin(), landmark.items.end(), [&](const JsonValue& item) {
          return item.kind == JsonValue::Kind::kNumber && std::fabs(item.number) <= kMaxCoordinate;
        });
    const bool is_vertex = landmark.kind == JsonValue::Kind::kString &&
                           landmark.string.size() > 1 && landmark.string[0] == 'v';
    const auto number = is_vertex ? parse_integer(landmark.string.substr(1)) : std::nullopt;
    if (is_point) {
      point.point = {static_cast<float>(landmark.items[0].number),
                     static_cast<float>(landmark.items[1].number),
                     static_cast<float>(landmark.items[2].number)};
    } else if (number && *number >= 1) {
      point.vertex = *number;
    } else {
      report_at(landmark.offset, point.pointer,
                "must be a point [x, y, z] in the file's own coordinates, or a vertex of the file, "
                "\"v1\" being the first");
      continue;
    }
    out.emplace(member.key, std::move(point));
  }
}

void FieldReader::before_actors(Scene& scene) {
  ObjectSettings object;
  object.spheres = scene.spheres;
  object.motion = scene.motion;
  actor_prototype_.source = actor_prototype_.target = object;
  actor_prototype_.plan = scene.plan;
}

void FieldReader::actors(const char* key, std::vector<ActorSettings>& out, const char* doc) {
  if (!find(key)) {
    out.assign(1, actor_prototype_);
    describe_chain(*this, out.front());
    return;
  }
  objects(key, out, doc);
  for (const char* chain_key : {"blend", "source", "intermediate", "target"})
    if (const JsonValue* value = find(chain_key))
      report(*value, chain_key, "contradicts \"actors\" - write it into one of them");
  if (!out.empty()) return;
  if (const JsonValue* list = expect(key, JsonValue::Kind::kArray))
    report(*list, key, "is empty - a scene has at least one actor");
  out.push_back(actor_prototype_);  // the checks that follow need an actor
}

void FieldReader::retired(const char* key, const char* successor) {
  const JsonValue* value = object_.find(key);
  if (!value) return;
  retired_.emplace_back(key);
  report(*value, key,
         successor ? fmt::format("is a key no more - write {}", successor)
                   : std::string("is a key no more: it is a constant of the method now"));
}

void FieldReader::finish() {
  for (const JsonMember& member : object_.members) {
    if (std::find(known_.begin(), known_.end(), member.key) != known_.end()) continue;
    if (std::find(retired_.begin(), retired_.end(), member.key) != retired_.end()) continue;
    if (pointer_.empty() && member.key == "$schema") continue;
    std::string message = fmt::format("unknown key{}", did_you_mean(member.key, known_));
    if (message.back() != '?') message += fmt::format(" - known here: {}", join_quoted(known_));
    report_at(member.key_offset, pointer_ + "/" + member.key, message);
  }
}

void FieldReader::report(const JsonValue& value, const char* key, const std::string& message) {
  // In the short form the value has no key of its own in the file.
  report_at(value.offset, &value == word_ ? pointer_ : pointer_ + "/" + key, message);
}

const JsonValue* FieldReader::find(const char* key) {
  add_known(key);
  const JsonValue* value = object_.find(key);
  return !value && word_ && std::string_view(key) == short_key_ ? word_ : value;
}

const JsonValue* FieldReader::expect(const char* key, JsonValue::Kind kind) {
  const JsonValue* value = find(key);
  if (!value || value->kind == kind) return value;
  report(*value, key, fmt::format("must be {} (is {})", kind_name(kind), kind_name(value->kind)));
  return nullptr;
}

void FieldReader::read_name(const JsonValue& value, const std::string& pointer,
                            ObjectSettings& out) {
  if (is_shape_name(value.string)) {
    out.shape = value.string;
    return;
  }
  out.model = resolve(value.string);
  // "spere" is more likely a misspelt shape than a file without an extension.
  std::error_code error;
  if (nearest_word(value.string, kShapeNames) && !std::filesystem::exists(out.model, error))
    report_at(value.offset, pointer,
              fmt::format("neither a file nor a shape: \"{}\"{}", value.string,
                          did_you_mean(value.string, kShapeNames)));
  else if (!is_numbered(out.model))
    check_file_at(value.offset, pointer, out.model);
}

void FieldReader::check_object(const ObjectSettings& object, const JsonValue& value) {
  if (object.model.empty() == object.shape.empty())
    report_at(value.offset, pointer_,
              "needs either \"model\" (a file) or \"shape\", not both or neither");
  if (!object.shape.empty() && !is_shape_name(object.shape))
    report(*object_.find("shape"), "shape",
           fmt::format("must be {} (is \"{}\"){}", join_quoted(kShapeNames), object.shape,
                       did_you_mean(object.shape, kShapeNames)));
}

void FieldReader::find_meshes(const JsonValue& value, const std::string& pointer,
                              ObjectSettings& out) {
  const auto report_key = [&](const char* key, const std::string& message) {
    const JsonValue* member = value.find(key);
    report_at(member ? member->offset : value.offset, pointer + "/" + key, message);
  };
  if (!is_numbered(out.model)) {
    for (const char* key : {"range", "fps", "loop"})
      if (value.find(key))
        report_key(key, "is for a mesh sequence - give a \"model\" such as seq.####.ply");
    out.range.clear();
    return;
  }
  auto range = find_mesh_range(out.model);
  if (!range) return report_key("model", range.error().message);
  if (out.range.empty()) out.range = std::move(*range);
  if (!out.fps) out.fps = find_pose_rate(out.model);
  if (out.range.size() < 2 || out.range.size() > 3 || (out.range.size() == 3 && out.range[2] < 1))
    return report_key("range", "must be first and last number, and perhaps a step of 1 or more");
  if (const std::size_t count = mesh_numbers(out).size(); count > std::size_t{kMaxFrames})
    report_key("range", fmt::format("has {} meshes - at most {} are possible", count, kMaxFrames));
}

bool FieldReader::read_vector(const JsonValue& value, const char* key, Vec3& out, double low,
                              double high) {
  const bool is_valid =
      value.items.size() == 3 &&
      std::all_of(value.items.begin(), value.items.end(), [&](const JsonValue& item) {
        return item.kind == JsonValue::Kind::kNumber && item.number >= low && item.number <= high;
      });
  if (!is_valid) {
    report(value, key, fmt::format("must be a list of 3 numbers, {:g} to {:g} each", low, high));
    return false;
  }
  out = {static_cast<float>(value.items[0].number), static_cast<float>(value.items[1].number),
         static_cast<float>(value.items[2].number)};
  return true;
}

bool FieldReader::read_hex(const std::string& text, Vec3& out) {
  if (text.size() != 7 || text[0] != '#') return false;
  float channel[3];
  for (std::size_t i = 0; i < 3; ++i) {
    int byte = 0;
    for (std::size_t k = 1; k <= 2; ++k) {
      const char c = text[2 * i + k];
      const std::size_t digit = std::string_view("0123456789abcdefABCDEF").find(c);
      if (digit == std::string_view::npos) return false;
      byte = byte * 16 + static_cast<int>(digit > 15 ? digit - 6 : digit);  // 16 to 21 are A to F
    }
    channel[i] = srgb_to_linear(static_cast<float>(byte) / 255.0f);
  }
  out = {channel[0], channel[1], channel[2]};
  return true;
}

std::filesystem::path FieldReader::resolve(const std::string& file) const {
  remember_name(file);
  return (document_.folder / file).lexically_normal();
}

void FieldReader::check_file(const JsonValue& value, const char* key,
                             const std::filesystem::path& file) {
  check_file_at(value.offset, pointer_ + "/" + key, file);
}

void FieldReader::check_file_at(std::size_t offset, const std::string& pointer,
                                const std::filesystem::path& file) {
  if (find_memory_mesh(file)) return;
  std::error_code error;
  if (std::filesystem::is_directory(file, error))
    report_at(offset, pointer, fmt::format("{} is a directory - name a file in it", file.string()));
  else if (!std::filesystem::exists(file, error))
    report_at(
        offset, pointer,
        fmt::format("no such file: {} (paths are relative to the scene file)", file.string()));
}

void FieldReader::report_at(std::size_t offset, const std::string& pointer,
                            const std::string& message) {
  if (document_.findings.size() >= kMaxCollectedFindings) return;
  const TextPosition position = document_.json.position(offset);
  document_.findings.push_back({position.line, position.column, pointer, message});
}

}  // namespace polymorph
