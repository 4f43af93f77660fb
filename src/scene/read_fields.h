// Scene reader: the visitor of describe() (scene/describe.h) that reads one object of the JSON tree
// into one struct, and collects errors.
#pragma once

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "base/json.h"
#include "base/text.h"
#include "scene/describe.h"
#include "scene/load_scene.h"

namespace polymorph {

/// A scene's JSON, and the results of reading it that are not settings.
struct SceneDocument {
  const JsonDocument& json;
  std::filesystem::path folder;         ///< paths in the scene are relative to it
  std::vector<SceneFinding>& findings;  ///< errors
  std::vector<KeyframeTrack>& tracks;
};

/// Visitor that reads `object`, whose JSON pointer is `pointer`. If `keyed`, numbers, vectors and
/// colours may have keyframes.
class FieldReader {
 public:
  FieldReader(const SceneDocument& document, const JsonValue& object, std::string pointer,
              bool keyed = false)
      : document_(document), object_(object), pointer_(std::move(pointer)), keyed_(keyed) {}

  template <class T>
  void integer(const char* key, T& out, Range<long long> range, const char*) {
    const JsonValue* value = expect(key, JsonValue::Kind::kNumber);
    if (!value) return;
    if (!value->integral)
      report(
          *value, key,
          fmt::format("must be a whole number, {} to {} (is {:g}{})", range.low, range.high,
                      value->number,
                      std::fabs(value->number) < 1e9 && std::trunc(value->number) == value->number
                          ? " with a decimal point"
                          : ""));
    else if (value->integer < range.low || value->integer > range.high)
      report(*value, key,
             fmt::format("must be {} to {} (is {})", range.low, range.high, value->integer));
    else
      out = static_cast<T>(value->integer);
  }
  void number(const char* key, float& out, Range<double> range, const char* doc,
              Keyframes keyframes = Keyframes::kAsObject);
  void number(const char* key, std::optional<float>& out, Range<double> range, const char* doc,
              Keyframes keyframes = Keyframes::kAsObject);
  void boolean(const char* key, bool& out, const char*);
  void boolean(const char* key, std::optional<bool>& out, const char* doc);
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
  void text(const char* key, std::string& out, const char*);
  void path(const char* key, std::filesystem::path& out, const char*);
  void model_path(const char* key, std::filesystem::path& out, const char* doc);
  void vector(const char* key, Vec3& out, const char* doc);
  void vector(const char* key, std::optional<Vec3>& out, const char* doc);
  void scale(const char* key, Vec3& out, const char*);
  void color(const char* key, Vec3& out, const char* doc);
  void color(const char* key, std::optional<Vec3>& out, const char* doc);
  void integers(const char* key, std::vector<int>& out, Range<long long> range, const char*);
  /// Reads a list with one number per range.
  void numbers(const char* key, std::vector<float>& out,
               std::initializer_list<Range<double>> ranges, const char*);
  void text_map(const char* key, std::map<std::string, std::string>& out, const char*);
  void landmarks(const char* key, LandmarkSettings& out, const char*);
  template <class T>
  void object(const char* key, T& out, const char*) {
    const JsonValue* value = find(key);
    if (value) read_object(*value, pointer_ + "/" + key, out);
  }
  /// Reads an object whose numbers, vectors and colours may have keyframes.
  template <class T>
  void keyed_object(const char* key, T& out, const char* doc) {
    const bool outer_keyed = std::exchange(keyed_, true);
    object(key, out, doc);
    keyed_ = outer_keyed;
  }
  template <class T>
  void objects(const char* key, std::vector<T>& out, const char*) {
    const JsonValue* value = expect(key, JsonValue::Kind::kArray);
    if (!value) return;
    out.clear();  // a given list replaces the default
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
  /// Makes the scene's settings the defaults of its actors and objects.
  void before_actors(Scene& scene);
  /// Reads the list of actors or, without one, the chain of a single actor.
  void actors(const char* key, std::vector<ActorSettings>& out, const char* doc);

  /// Reports a key of former versions and its successor (nullptr: none).
  void retired(const char* key, const char* successor);

  /// Reports unknown keys: those that describe() has not visited.
  void finish();
  /// Adds an error at `value`, the value of `key` or an item of it.
  void report(const JsonValue& value, const char* key, const std::string& message);

 private:
  static constexpr std::size_t kMaxItems = 1000;  ///< per list

  void add_known(const char* key) { known_.emplace_back(key); }
  /// Finds the string that replaces an object or, after an override (override.h), is at its key "";
  /// null if there is none.
  static const JsonValue* find_word(const JsonValue& value) {
    const JsonValue* word = value.kind == JsonValue::Kind::kObject ? value.find("") : &value;
    return word && word->kind == JsonValue::Kind::kString ? word : nullptr;
  }
  /// Finds the value of a key and marks the key as known; null if there is none.
  const JsonValue* find(const char* key);
  /// Finds a value as find() does. If it is of another kind, reports this and returns null.
  const JsonValue* expect(const char* key, JsonValue::Kind kind);
  /// Tests whether a value with this permission may have keyframes here.
  bool takes_keyframes(Keyframes keyframes) const;
  /// Reads a struct from its JSON object or, if it has one, from its short form: the path or shape
  /// of an object of the scene, or the value of T::kShort.
  template <class T>
  void read_object(const JsonValue& value, const std::string& pointer, T& out) {
    if constexpr (std::is_same_v<T, ObjectSettings>) {
      if (const JsonValue* word = find_word(value)) read_name(*word, pointer, out);
      if (value.kind == JsonValue::Kind::kString) return find_meshes(value, pointer, out);
    }
    constexpr bool kHasShort = requires { T::kShort; };
    if (value.kind != JsonValue::Kind::kObject &&
        !(kHasShort && value.kind == JsonValue::Kind::kString)) {
      report_at(value.offset, pointer,
                fmt::format("must be an object (is {})", kind_name(value.kind)));
      return;
    }
    FieldReader inner(document_, value, pointer, keyed_);
    inner.actor_prototype_ = actor_prototype_;
    // The key "" is read by find_word().
    if constexpr (kHasShort || std::is_same_v<T, ObjectSettings>) inner.retired_.emplace_back("");
    if constexpr (kHasShort) {
      inner.short_key_ = T::kShort;
      inner.word_ = find_word(value);
    }
    describe(inner, out);
    if constexpr (std::is_same_v<T, ObjectSettings>) {
      inner.check_object(out, value);
      inner.find_meshes(value, pointer, out);
    }
    inner.finish();
  }
  /// Reads a setting's keyframes into a new track, and the value of the first key into `out`.
  /// Returns false if the setting is not written as keyframes. `read(fields, value)` reads the
  /// "value" of one key.
  template <class T, class F>
  bool read_keyframes(const char* key, T& out, const F& read,
                      Keyframes keyframes = Keyframes::kAsObject);
  /// Reads one key: its time into a new key of the track, its value by `read(fields)`. Returns
  /// false if the time is invalid.
  template <class F>
  bool read_key(const JsonValue& item, const std::string& pointer, KeyframeTrack& track,
                const F& read);
  /// Reads the short form of an object: "teapot.obj" stands for {"model": "teapot.obj"} and
  /// "sphere" for {"shape": "sphere"}.
  void read_name(const JsonValue& value, const std::string& pointer, ObjectSettings& out);
  /// Checks that an object has either a model or a known shape.
  void check_object(const ObjectSettings& object, const JsonValue& value);
  /// Fills in the range and rate of a mesh sequence, unless they are given, and checks the range.
  /// Reports settings of sequences in other objects.
  void find_meshes(const JsonValue& value, const std::string& pointer, ObjectSettings& out);
  void read_landmarks(const JsonValue& value, const std::string& pointer, ObjectLandmarks& out);
  /// Reads a list of three numbers in [low, high]. Returns false after a report.
  bool read_vector(const JsonValue& value, const char* key, Vec3& out, double low, double high);
  /// Reads an sRGB colour "#rrggbb". Returns false if `text` is not such a colour.
  static bool read_hex(const std::string& text, Vec3& out);
  /// Returns the path of a file name in the scene, which may be relative to the scene's folder.
  std::filesystem::path resolve(const std::string& file) const;
  /// Reports a file that does not exist or is a folder.
  void check_file(const JsonValue& value, const char* key, const std::filesystem::path& file);
  void check_file_at(std::size_t offset, const std::string& pointer,
                     const std::filesystem::path& file);
  void report_at(std::size_t offset, const std::string& pointer, const std::string& message);

  const SceneDocument& document_;
  const JsonValue& object_;
  std::string pointer_;
  bool keyed_;                        ///< numbers, vectors and colours here may have keyframes
  std::vector<std::string> known_;    ///< keys that describe() has visited
  std::vector<std::string> retired_;  ///< keys that finish() accepts in addition to known_
  const char* short_key_ = nullptr;   ///< T::kShort, the key whose value may replace the object
  const JsonValue* word_ = nullptr;   ///< value of T::kShort in the short form; null if not used
  ActorSettings actor_prototype_;     ///< defaults of an actor, and in `source` of each object
};

}  // namespace polymorph
