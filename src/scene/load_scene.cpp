#include "scene/load_scene.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "base/exact_math.h"
#include "base/file.h"
#include "base/log.h"
#include "base/text.h"
#include "image/srgb.h"
#include "scene/contradictions.h"
#include "scene/describe.h"
#include "scene/json_text.h"

namespace polymorph {
namespace {

constexpr std::size_t kMaxFindings = 20;
constexpr std::size_t kMaxCollectedFindings = 200;  // each is looked up in the text
constexpr std::size_t kMaxItems = 1000;             // of one list

/// The visitor that reads: one object of the JSON tree into one struct.
class ReadFields {
 public:
  ReadFields(const JsonDocument& document, const JsonValue& object, std::string pointer,
             std::filesystem::path folder, std::vector<SceneFinding>& findings,
             std::vector<KeyframeTrack>& tracks, bool keyed = false)
      : document_(document),
        object_(object),
        pointer_(std::move(pointer)),
        folder_(std::move(folder)),
        findings_(findings),
        tracks_(tracks),
        keyed_(keyed) {}

  template <class T>
  void integer(const char* key, T& out, long long low, long long high, const char*) {
    const JsonValue* value = expect(key, JsonValue::Kind::kNumber);
    if (!value) return;
    if (!value->integral)
      report(*value, key,
             fmt::format("must be a whole number, {} to {} (is {:g})", low, high, value->number));
    else if (value->integer < low || value->integer > high)
      report(*value, key, fmt::format("must be {} to {} (is {})", low, high, value->integer));
    else
      out = static_cast<T>(value->integer);
  }
  void number(const char* key, float& out, double low, double high, const char* doc) {
    if (read_keyframes(key, out, [&](ReadFields& one, float& value) {
          one.number("value", value, low, high, doc);
        }))
      return;
    const JsonValue* value = expect(key, JsonValue::Kind::kNumber);
    if (!value) return;
    if (!(value->number >= low && value->number <= high))
      report(*value, key, fmt::format("must be {:g} to {:g} (is {:g})", low, high, value->number));
    else
      out = static_cast<float>(value->number);
  }
  void number(const char* key, std::optional<float>& out, double low, double high,
              const char* doc) {
    if (!object_.find(key)) return seen(key);
    float value = 0;
    number(key, value, low, high, doc);
    out = value;
  }
  void keyed_number(const char* key, float& out, double low, double high, const char* doc) {
    const bool keyed = std::exchange(keyed_, true);
    number(key, out, low, high, doc);
    keyed_ = keyed;
  }
  void constant_number(const char* key, float& out, double low, double high, const char* doc) {
    const bool keyed = std::exchange(keyed_, false);
    number(key, out, low, high, doc);
    keyed_ = keyed;
  }
  void boolean(const char* key, bool& out, const char*) {
    if (const JsonValue* value = expect(key, JsonValue::Kind::kBoolean)) out = value->boolean;
  }
  template <class E>
  void choice(const char* key, E& out, std::initializer_list<std::pair<const char*, E>> choices,
              const char*) {
    const JsonValue* value = expect(key, JsonValue::Kind::kString);
    if (!value) return;
    std::vector<std::string> names;
    for (const auto& [name, meaning] : choices) {
      if (value->string == name) {
        out = meaning;
        return;
      }
      names.emplace_back(name);
    }
    report(*value, key,
           fmt::format("must be {} (is \"{}\"){}", join_quoted(names), value->string,
                       did_you_mean(value->string, names)));
  }
  void text(const char* key, std::string& out, const char*) {
    if (const JsonValue* value = expect(key, JsonValue::Kind::kString)) out = value->string;
  }
  void path(const char* key, std::filesystem::path& out, const char*) {
    const JsonValue* value = expect(key, JsonValue::Kind::kString);
    if (!value) return;
    out = resolve(value->string);
    check_file(*value, key, out);
  }
  void model_path(const char* key, std::filesystem::path& out, const char* doc) {
    path(key, out, doc);
  }
  void vector(const char* key, Vec3& out, const char* doc) {
    if (read_keyframes(key, out,
                       [&](ReadFields& one, Vec3& value) { one.vector("value", value, doc); }))
      return;
    if (const JsonValue* value = expect(key, JsonValue::Kind::kArray))
      read_vector(*value, key, out, -1e6, 1e6);
  }
  void vector(const char* key, std::optional<Vec3>& out, const char* doc) {
    if (!object_.find(key)) return seen(key);
    Vec3 value;
    vector(key, value, doc);
    out = value;
  }
  void scale(const char* key, Vec3& out, const char*) {
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
      report(
          *value, key,
          fmt::format("must be a number or a list of 3 numbers (is {})", kind_name(value->kind)));
    }
  }
  void color(const char* key, Vec3& out, const char* doc) {
    if (read_keyframes(key, out,
                       [&](ReadFields& one, Vec3& value) { one.color("value", value, doc); }))
      return;
    const JsonValue* value = find(key);
    if (!value) return;
    if (value->kind == JsonValue::Kind::kArray) {
      read_vector(*value, key, out, 0, 1);
    } else if (value->kind == JsonValue::Kind::kString && read_hex(value->string, out)) {
    } else {
      report(*value, key, "must be \"#rrggbb\" (sRGB) or a list of 3 numbers from 0 to 1 (linear)");
    }
  }
  void color(const char* key, std::optional<Vec3>& out, const char* doc) {
    if (!object_.find(key)) return seen(key);
    Vec3 value;
    color(key, value, doc);
    out = value;
  }
  void integers(const char* key, std::vector<int>& out, long long low, long long high,
                const char*) {
    const JsonValue* value = expect(key, JsonValue::Kind::kArray);
    if (!value) return;
    out.clear();
    for (const JsonValue& item : value->items) {
      if (item.kind != JsonValue::Kind::kNumber || !item.integral || item.integer < low ||
          item.integer > high)
        report(item, key, fmt::format("must be a list of whole numbers, {} to {}", low, high));
      else
        out.push_back(static_cast<int>(item.integer));
    }
  }
  /// A list of exactly as many numbers as there are ranges.
  void numbers(const char* key, std::vector<float>& out,
               std::initializer_list<std::pair<double, double>> ranges, const char*) {
    const JsonValue* value = expect(key, JsonValue::Kind::kArray);
    if (!value) return;
    std::vector<float> read;
    for (const auto& [low, high] : ranges) {
      if (read.size() == value->items.size()) break;
      const JsonValue& item = value->items[read.size()];
      if (item.kind != JsonValue::Kind::kNumber || !(item.number >= low && item.number <= high))
        return report(item, key,
                      fmt::format("number {} must be {:g} to {:g}", read.size() + 1, low, high));
      read.push_back(static_cast<float>(item.number));
    }
    if (value->items.size() != ranges.size())
      return report(
          *value, key,
          fmt::format("must be a list of {} numbers (has {})", ranges.size(), value->items.size()));
    out = std::move(read);
  }
  void text_map(const char* key, std::map<std::string, std::string>& out, const char*) {
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
  template <class T>
  void object(const char* key, T& out, const char*) {
    const JsonValue* value = find(key);
    if (value) read_object(*value, pointer_ + "/" + key, out);
  }
  /// Its numbers, vectors and colours may have keyframes.
  template <class T>
  void keyed_object(const char* key, T& out, const char* doc) {
    const bool keyed = std::exchange(keyed_, true);
    object(key, out, doc);
    keyed_ = keyed;
  }
  template <class T>
  void objects(const char* key, std::vector<T>& out, const char*) {
    const JsonValue* value = expect(key, JsonValue::Kind::kArray);
    if (!value) return;
    out.clear();  // a list of one's own replaces a default
    if (value->items.size() > kMaxItems)
      report(*value, key,
             fmt::format("has {} entries - a list may have at most {}", value->items.size(),
                         kMaxItems));
    for (std::size_t i = 0; i < std::min(value->items.size(), kMaxItems); ++i) {
      if constexpr (std::is_same_v<T, ObjectSettings>)
        out.push_back(actor_prototype_.source);
      else if constexpr (std::is_same_v<T, ActorSettings>)
        out.push_back(actor_prototype_);
      else
        out.emplace_back();
      read_object(value->items[i], fmt::format("{}/{}/{}", pointer_, key, i), out.back());
    }
  }
  void before_actors(Scene& scene) {
    ObjectSettings object;
    object.spheres = scene.spheres;
    object.motion = scene.motion;
    actor_prototype_.source = actor_prototype_.target = object;
    actor_prototype_.plan = scene.plan;
  }
  /// A list, or the one actor's chain in its stead.
  void actors(const char* key, std::vector<ActorSettings>& out, const char* doc) {
    if (!find(key)) {
      out.assign(1, actor_prototype_);
      describe_chain(*this, out.front());
      return;
    }
    objects(key, out, doc);
    for (const char* alone : {"source", "intermediate", "target"})
      if (const JsonValue* value = find(alone))
        report(*value, alone, "contradicts \"actors\" - write it into one of them");
    if (!out.empty()) return;
    if (const JsonValue* list = expect(key, JsonValue::Kind::kArray))
      report(*list, key, "is empty - a scene has at least one actor");
    out.push_back(actor_prototype_);  // what else is wrong can still be said
  }

  /// `key` was called `old` before; that is still understood.
  void renamed(const char* old, const char* key) {
    const JsonValue* value = object_.find(old);
    if (!value) return;
    seen(old);
    if (object_.find(key)) {
      report(*value, old,
             fmt::format("is the old name of \"{}\", which is given too - keep one", key));
    } else {
      log_warning("scene: {}/{} is an old name - write \"{}\"", printable(pointer_), old, key);
      old_names_[key] = old;
    }
  }

  /// Reports keys that describe() did not ask for.
  void finish() {
    for (const JsonMember& member : object_.members) {
      if (std::find(known_.begin(), known_.end(), member.key) != known_.end()) continue;
      if (pointer_.empty() && member.key == "$schema") continue;
      std::string message = fmt::format("unknown key{}", did_you_mean(member.key, known_));
      if (message.back() != '?') message += fmt::format(" - known here: {}", join_quoted(known_));
      report_at(member.key_offset, pointer_ + "/" + member.key, message);
    }
  }
  void report(const JsonValue& value, const char* key, const std::string& message) {
    report_at(value.offset, pointer_ + "/" + key, message);
  }

 private:
  void seen(const char* key) { known_.emplace_back(key); }
  const JsonValue* find(const char* key) {
    seen(key);
    const auto old = old_names_.find(key);
    return object_.find(old == old_names_.end() ? key : old->second);
  }
  const JsonValue* expect(const char* key, JsonValue::Kind kind) {
    const JsonValue* value = find(key);
    if (!value || value->kind == kind) return value;
    report(*value, key, fmt::format("must be {} (is {})", kind_name(kind), kind_name(value->kind)));
    return nullptr;
  }
  template <class T>
  void read_object(const JsonValue& value, const std::string& pointer, T& out) {
    if constexpr (std::is_same_v<T, ObjectSettings>) {
      // "source": "teapot.obj" is short for {"model": "teapot.obj"}; "sphere" for {"shape":
      // "sphere"}.
      if (value.kind == JsonValue::Kind::kString) {
        if (std::find(kShapeNames.begin(), kShapeNames.end(), value.string) != kShapeNames.end()) {
          out.shape = value.string;
        } else {
          out.model = resolve(value.string);
          // "spere" is more likely a slip of a shape's name than a file without an extension.
          std::error_code missing;
          if (nearest_word(value.string, kShapeNames) &&
              !std::filesystem::exists(out.model, missing))
            report_at(value.offset, pointer,
                      fmt::format("neither a file nor a shape: \"{}\"{}", value.string,
                                  did_you_mean(value.string, kShapeNames)));
          else
            check_file_at(value.offset, pointer, out.model);
        }
        return;
      }
    }
    if (value.kind != JsonValue::Kind::kObject) {
      report_at(value.offset, pointer,
                fmt::format("must be an object (is {})", kind_name(value.kind)));
      return;
    }
    ReadFields inner(document_, value, pointer, folder_, findings_, tracks_, keyed_);
    inner.actor_prototype_ = actor_prototype_;
    describe(inner, out);
    if constexpr (std::is_same_v<T, ObjectSettings>) inner.check_object(out, value);
    inner.finish();
  }
  /// Where the setting has keyframes in place of a value: reads them into a track, `out` becomes
  /// the first key's. `read(fields, value)` reads "value" of a key's fields.
  template <class T, class F>
  bool read_keyframes(const char* key, T& out, const F& read) {
    const JsonValue* object = object_.find(key);
    if (!object || object->kind != JsonValue::Kind::kObject) return false;
    if (!keyed_ && !object->find("keys")) return false;
    seen(key);
    if (!keyed_) {
      report(*object, key,
             "cannot change over the film - only settings of camera, lights, ground "
             "and look, and image.exposure, take keys");
      return true;
    }
    KeyframeTrack track;
    track.pointer = pointer_ + "/" + key;
    ReadFields fields(document_, *object, track.pointer, folder_, findings_, tracks_);
    describe(fields, track);
    const JsonValue* list = fields.expect("keys", JsonValue::Kind::kArray);
    fields.finish();
    if (!object->find("keys") || (list && list->items.empty()))
      report(*object, key,
             "needs \"keys\", a list of {\"t\", \"frame\" or \"leg\": ..., \"value\": ...}");
    if (!list) return true;
    if (list->items.size() > kMaxItems)
      fields.report(*list, "keys",
                    fmt::format("has {} entries - a list may have at most {}", list->items.size(),
                                kMaxItems));
    for (std::size_t i = 0; i < std::min(list->items.size(), kMaxItems); ++i) {
      T value = out;
      if (fields.read_key(list->items[i], fmt::format("{}/keys/{}", track.pointer, i), track,
                          [&](ReadFields& one) { read(one, value); }))
        track.keys.back().value = as_vector(value);
      if (i == 0) out = value;
    }
    if (!track.keys.empty()) tracks_.push_back(std::move(track));
    return true;
  }
  static Vec3 as_vector(float value) { return {value, 0, 0}; }
  static Vec3 as_vector(Vec3 value) { return value; }
  /// One key: when it is goes into the track; `read` reads its value.
  template <class F>
  bool read_key(const JsonValue& item, const std::string& pointer, KeyframeTrack& track,
                const F& read) {
    if (item.kind != JsonValue::Kind::kObject) {
      report_at(item.offset, pointer,
                fmt::format("must be an object (is {})", kind_name(item.kind)));
      return false;
    }
    ReadFields one(document_, item, pointer, folder_, findings_, tracks_);
    KeyMoment moment;
    describe(one, moment);
    read(one);
    one.finish();
    if (!item.find("value")) report_at(item.offset, pointer, "needs a \"value\"");
    const int given = moment.share.has_value() + moment.frame.has_value() + moment.leg.has_value();
    if (given != 1) {
      report_at(item.offset, pointer, "needs one of \"t\", \"frame\" and \"leg\"");
      return false;
    }
    const KeyUnit unit = moment.share   ? KeyUnit::kShare
                         : moment.frame ? KeyUnit::kFrame
                                        : KeyUnit::kLeg;
    const auto at = static_cast<double>(moment.share   ? *moment.share
                                        : moment.frame ? *moment.frame
                                                       : *moment.leg);
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
  void check_object(const ObjectSettings& object, const JsonValue& value) {
    if (object.model.empty() == object.shape.empty())
      report_at(value.offset, pointer_,
                "needs either \"model\" (an OBJ file) or \"shape\", not both or neither");
    if (!object.shape.empty() &&
        std::find(kShapeNames.begin(), kShapeNames.end(), object.shape) == kShapeNames.end())
      report(*object_.find("shape"), "shape",
             fmt::format("must be {} (is \"{}\"){}", join_quoted(kShapeNames), object.shape,
                         did_you_mean(object.shape, kShapeNames)));
  }
  bool read_vector(const JsonValue& value, const char* key, Vec3& out, double low, double high) {
    const bool right =
        value.items.size() == 3 &&
        std::all_of(value.items.begin(), value.items.end(), [&](const JsonValue& item) {
          return item.kind == JsonValue::Kind::kNumber && item.number >= low && item.number <= high;
        });
    if (!right) {
      report(value, key, fmt::format("must be a list of 3 numbers, {:g} to {:g} each", low, high));
      return false;
    }
    out = {static_cast<float>(value.items[0].number), static_cast<float>(value.items[1].number),
           static_cast<float>(value.items[2].number)};
    return true;
  }
  static bool read_hex(const std::string& text, Vec3& out) {
    if (text.size() != 7 || text[0] != '#') return false;
    float channel[3];
    for (std::size_t i = 0; i < 3; ++i) {
      int byte = 0;
      for (std::size_t k = 1; k <= 2; ++k) {
        const char c = text[2 * i + k];
        const std::size_t digit = std::string_view("0123456789abcdefABCDEF").find(c);
        if (digit == std::string_view::npos) return false;
        byte = byte * 16 + static_cast<int>(digit > 15 ? digit - 6 : digit);
      }
      channel[i] = srgb_to_linear(static_cast<float>(byte) / 255.0f);
    }
    out = {channel[0], channel[1], channel[2]};
    return true;
  }
  std::filesystem::path resolve(const std::string& file) const {
    return (folder_ / file).lexically_normal();
  }
  void check_file(const JsonValue& value, const char* key, const std::filesystem::path& file) {
    check_file_at(value.offset, pointer_ + "/" + key, file);
  }
  void check_file_at(std::size_t offset, const std::string& pointer,
                     const std::filesystem::path& file) {
    std::error_code error;
    if (std::filesystem::is_directory(file, error))
      report_at(offset, pointer,
                fmt::format("{} is a directory - name a file in it", file.string()));
    else if (!std::filesystem::exists(file, error))
      report_at(
          offset, pointer,
          fmt::format("no such file: {} (paths are relative to the scene file)", file.string()));
  }
  void report_at(std::size_t offset, const std::string& pointer, const std::string& message) {
    if (findings_.size() >= kMaxCollectedFindings) return;
    const TextPosition at = document_.position(offset);
    findings_.push_back({at.line, at.column, pointer, message});
  }

  const JsonDocument& document_;
  const JsonValue& object_;
  std::string pointer_;
  std::filesystem::path folder_;
  std::vector<SceneFinding>& findings_;
  std::vector<KeyframeTrack>& tracks_;
  bool keyed_;  ///< numbers, vectors and colours here may have keyframes
  std::vector<std::string> known_;
  std::map<std::string, std::string> old_names_;  ///< by the new ones, of keys in this object
  ActorSettings actor_prototype_;                 ///< its source is every object's
};

void name_objects(Scene& scene) {
  const auto name = [](ObjectSettings& object) {
    if (object.name.empty())
      object.name = object.model.empty() ? object.shape : object.model.stem().string();
    object.name = printable(object.name);
  };
  std::set<std::string> names;
  for (ActorSettings& actor : scene.actors) {
    name(actor.source);
    for (ObjectSettings& object : actor.intermediate) name(object);
    name(actor.target);
    if (actor.name.empty()) actor.name = actor.source.name;
    actor.name = printable(actor.name);  // it stands in the headers of meshes and images
    const std::string same = actor.name;
    for (int n = 2; !names.insert(actor.name).second; ++n)
      actor.name = fmt::format("{} {}", same, n);
  }
}

/// So that no output of this run is put over them, even before they are read.
void remember_inputs(const Scene& scene) {
  remember_input(scene.path);
  for (const ActorSettings& actor : scene.actors)
    for (const ObjectSettings* object : chain_objects(actor)) remember_input(object->model);
  remember_input(scene.lights.environment);
}

}  // namespace

std::string to_string(const SceneFinding& finding, const std::string& file) {
  // What has no place in the file came from the command line.
  if (finding.line == 0)
    return fmt::format("{}: --set {}: {}", file, finding.pointer, finding.message);
  return fmt::format("{}:{}:{}: {}: {}", file, finding.line, finding.column, finding.pointer,
                     finding.message);
}

Result<SceneReading> read_scene(const std::filesystem::path& path,
                                std::span<const Override> overrides) {
  constexpr const char* kModels[] = {".obj", ".glb", ".gltf", ".ply", ".stl",
                                     ".fbx", ".dae", ".off",  ".3ds"};
  const std::string name = path.string();
  std::string suffix = path.extension().string();
  for (char& c : suffix) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c;
  if (std::find(std::begin(kModels), std::end(kModels), suffix) != std::end(kModels))
    return make_error(ErrorCode::kInput,
                      "{0}: is a model, not a scene - a scene names two of them: polymorph init "
                      "{0} OTHER; to see this one alone: polymorph render {0} --turntable",
                      name);
  PM_TRY(std::string text, read_file(path, 64u << 20));
  return read_scene_text(path, std::move(text), overrides);
}

Result<SceneReading> read_scene_text(const std::filesystem::path& path, std::string text,
                                     std::span<const Override> overrides) {
  if (text.find_first_not_of(" \t\r\n") == std::string::npos)
    return make_error(ErrorCode::kInput,
                      "{}: is empty - a scene needs at least {{\"source\": ..., \"target\": ...}}",
                      path.string());
  PM_TRY(JsonDocument document, parse_json(path.string(), std::move(text)));
  for (const auto& [key, value] : overrides) PM_TRY_STATUS(set_json_value(document, key, value));
  if (document.root.kind != JsonValue::Kind::kObject)
    return make_error(ErrorCode::kInput, "{}:1:1: a scene must be an object {{...}} (is {})",
                      path.string(), kind_name(document.root.kind));

  SceneReading reading;
  reading.scene.path = path;
  std::filesystem::path folder = std::filesystem::absolute(path).parent_path();
  ReadFields fields(document, document.root, "", folder, reading.findings, reading.scene.tracks);
  describe(fields, reading.scene);
  fields.finish();
  find_contradictions(document, reading.scene, reading.findings);
  name_objects(reading.scene);
  remember_inputs(reading.scene);
  std::stable_sort(reading.findings.begin(), reading.findings.end(),
                   [](const SceneFinding& a, const SceneFinding& b) {
                     return std::pair(a.line, a.column) < std::pair(b.line, b.column);
                   });
  return reading;
}

namespace {

/// The scene, or what is wrong with it as one error.
Result<Scene> scene_without_findings(SceneReading reading, const std::filesystem::path& path) {
  if (reading.findings.empty()) return std::move(reading.scene);
  std::string message;
  for (std::size_t i = 0; i < std::min(reading.findings.size(), kMaxFindings); ++i)
    message += fmt::format("{}{}", i ? "\n" : "", to_string(reading.findings[i], path.string()));
  if (reading.findings.size() > kMaxFindings)
    message += fmt::format("\n... and {} more", reading.findings.size() - kMaxFindings);
  const bool only_overrides =
      std::all_of(reading.findings.begin(), reading.findings.end(),
                  [](const SceneFinding& finding) { return finding.line == 0; });
  return Error{only_overrides ? ErrorCode::kUsage : ErrorCode::kInput, message};
}

}  // namespace

Result<Scene> load_scene(const std::filesystem::path& path, std::span<const Override> overrides) {
  PM_TRY(SceneReading reading, read_scene(path, overrides));
  return scene_without_findings(std::move(reading), path);
}

Result<Scene> turntable_of_model(const std::filesystem::path& model,
                                 std::span<const Override> overrides) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(model, error))
    return make_error(ErrorCode::kInput, "{}: no such file", model.string());
  // The morph from the model to itself is never seen: its balls need not be good.
  const std::string object = std::filesystem::absolute(model).string();
  const nlohmann::ordered_json json{
      {"source", {{"model", object}}},        {"target", {{"model", object}}},
      {"frames", {{"turntable", 72}}},        {"spheres", {{"balls", 16}, {"fit", "none"}}},
      {"motion", {{"interpolate", "balls"}}}, {"boundary", {{"method", "cut"}}}};
  PM_TRY(SceneReading reading, read_scene_text(model, json.dump(), overrides));
  return scene_without_findings(std::move(reading), model);
}

std::vector<const ObjectSettings*> chain_objects(const ActorSettings& actor) {
  std::vector<const ObjectSettings*> objects{&actor.source};
  for (const ObjectSettings& object : actor.intermediate) objects.push_back(&object);
  objects.push_back(&actor.target);
  return objects;
}

}  // namespace polymorph
