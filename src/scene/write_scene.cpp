// Visitors of describe() that write the JSON Schema, and a scene with all defaults spelled out.

#include "base/json.h"
#include "base/text.h"
#include "scene/describe.h"
#include "scene/load_scene.h"
#include "scene/mesh_numbers.h"

namespace polymorph {
namespace {

/// Returns the double whose shortest text is that of a float: 0.12, not 0.11999999731779099.
double shorten(float value) { return parse_number(fmt::format("{}", value)).value_or(value); }
JsonValue shorten(Vec3 v) { return JsonValue::array({shorten(v.x), shorten(v.y), shorten(v.z)}); }

/// Visitor that writes the JSON Schema of a struct into `properties`.
class SchemaWriter {
 public:
  explicit SchemaWriter(bool keyed = false) : keyed_(keyed) {}
  JsonValue properties = JsonValue::object();

  template <class T>
  void integer(const char* key, T& value, Range<long long> range, const char* doc) {
    add(key, doc,
        {{"type", "integer"}, {"minimum", range.low}, {"maximum", range.high}, {"default", value}});
  }
  void number(const char* key, float& value, Range<double> range, const char* doc,
              Keyframes keyframes = Keyframes::kAsObject) {
    add_keyed(key, doc, number_schema(range), shorten(value), keyframes);
  }
  void number(const char* key, std::optional<float>&, Range<double> range, const char* doc,
              Keyframes keyframes = Keyframes::kAsObject) {
    add_keyed(key, doc, number_schema(range), /*initial=*/{}, keyframes);
  }
  void boolean(const char* key, bool& value, const char* doc) {
    add(key, doc, {{"type", "boolean"}, {"default", value}});
  }
  void boolean(const char* key, std::optional<bool>&, const char* doc) {
    add(key, doc, {{"type", "boolean"}});
  }
  template <class E>
  void choice(const char* key, E& value, std::initializer_list<std::pair<const char*, E>> choices,
              const char* doc) {
    JsonValue names = JsonValue::array();
    JsonValue initial;
    for (const auto& [name, meaning] : choices) {
      names.push_back(name);
      if (meaning == value) initial = name;
    }
    add(key, doc, {{"enum", names}, {"default", initial}});
  }
  void text(const char* key, std::string& value, const char* doc) {
    JsonValue json{{"type", "string"}};
    if (!value.empty()) json["default"] = value;
    if (std::string_view(key) == "shape") json["enum"] = kShapeNames;
    add(key, doc, json);
  }
  void path(const char* key, std::filesystem::path&, const char* doc) {
    add(key, doc, {{"type", "string"}});
  }
  void model_path(const char* key, std::filesystem::path&, const char* doc) {
    add(key, doc, {{"type", "string"}});
  }
  void vector(const char* key, Vec3& value, const char* doc) {
    // The range of FieldReader::vector(), here and below.
    add_keyed(key, doc, vector_schema({-1e6, 1e6}), shorten(value));
  }
  void vector(const char* key, std::optional<Vec3>&, const char* doc) {
    add_keyed(key, doc, vector_schema({-1e6, 1e6}));
  }
  void scale(const char* key, Vec3&, const char* doc) {
    add(key, doc,
        {{"oneOf", JsonValue::array({JsonValue{{"type", "number"}}, vector_schema({-1e6, 1e6})})},
         {"default", 1}});
  }
  void color(const char* key, Vec3& value, const char* doc) {
    add_keyed(key, doc, {{"oneOf", color_schemas()}}, shorten(value));
  }
  void color(const char* key, std::optional<Vec3>&, const char* doc) {
    add_keyed(key, doc, {{"oneOf", color_schemas()}});
  }
  void integers(const char* key, std::vector<int>&, Range<long long> range, const char* doc) {
    add(key, doc,
        {{"type", "array"},
         {"items", {{"type", "integer"}, {"minimum", range.low}, {"maximum", range.high}}}});
  }
  void numbers(const char* key, std::vector<float>& values,
               std::initializer_list<Range<double>> ranges, const char* doc) {
    JsonValue items = JsonValue::array(), initial = JsonValue::array();
    for (const Range<double> range : ranges) items.push_back(number_schema(range));
    for (const float value : values) initial.push_back(shorten(value));
    add(key, doc,
        {{"type", "array"},
         {"prefixItems", items},
         {"minItems", ranges.size()},
         {"maxItems", ranges.size()},
         {"default", initial}});
  }
  void text_map(const char* key, std::map<std::string, std::string>&, const char* doc) {
    add(key, doc, {{"type", "object"}, {"additionalProperties", {{"type", "string"}}}});
  }
  void landmarks(const char* key, LandmarkSettings&, const char* doc) {
    const JsonValue vertex{{"type", "string"}, {"pattern", "^v[1-9][0-9]*$"}};
    const JsonValue point{{"oneOf", JsonValue::array({vector_schema({-1e9, 1e9}), vertex})}};
    const JsonValue object{
        {"type", "object"}, {"additionalProperties", point}, {"maxProperties", kMaxLandmarks}};
    add(key, doc, {{"type", "object"}, {"additionalProperties", object}});
  }
  template <class T>
  void object(const char* key, T& value, const char* doc) {
    add(key, doc, make_schema(value, keyed_));
  }
  template <class T>
  void keyed_object(const char* key, T& value, const char* doc) {
    add(key, doc, make_schema(value, /*keyed=*/true));
  }
  template <class T>
  void objects(const char* key, std::vector<T>&, const char* doc) {
    T value;
    add(key, doc, {{"type", "array"}, {"items", make_schema(value, keyed_)}});
  }
  // Former keys, and the defaults that actors inherit, concern only FieldReader.
  void retired(const char*, const char*) {}
  void before_actors(Scene&) {}
  /// Adds the list of actors, and the keys of a single actor's chain, which may replace it.
  void actors(const char* key, std::vector<ActorSettings>& values, const char* doc) {
    ActorSettings actor;
    describe_chain(*this, actor);
    objects(key, values, doc);
    properties[key]["minItems"] = 1;
  }

  /// Writes the schema of a struct, with the alternatives that its JSON may have: the value of
  /// the key that T::kShort names alone, the path or shape of an object, and a chain or a blend of
  /// an actor.
  template <class T>
  static JsonValue make_schema(T& value, bool keyed = false) {
    SchemaWriter inner(keyed);
    describe(inner, value);
    JsonValue object{
        {"type", "object"}, {"additionalProperties", false}, {"properties", inner.properties}};
    if constexpr (requires { T::kShort; }) {
      const JsonValue& kind = inner.properties.get(T::kShort);
      return {{"oneOf", JsonValue::array({JsonValue{{"enum", kind.get("enum")}}, object})},
              {"default", kind.get("default")}};
    }
    if constexpr (std::is_same_v<T, ObjectSettings>)
      return {{"oneOf", JsonValue::array({JsonValue{{"type", "string"}}, object})}};
    if constexpr (std::is_same_v<T, ActorSettings>)
      object["oneOf"] = JsonValue::array({JsonValue{{"required", JsonValue::array({"source"})}},
                                          JsonValue{{"required", JsonValue::array({"blend"})}}});
    return object;
  }

  /// Schema of a setting's keyframes, with values of any type.
  static JsonValue keyframes_schema() {
    SchemaWriter track, time;
    KeyframeTrack settings;
    KeyframeTime key_time;
    describe(track, settings);
    describe(time, key_time);
    JsonValue units = JsonValue::array();
    for (const JsonMember& unit : time.properties.members)
      units.push_back({{"required", JsonValue::array({unit.key})}});
    time.properties["value"] = true;  // the schema `true` accepts any value
    const JsonValue key{{"type", "object"},
                        {"additionalProperties", false},
                        {"properties", time.properties},
                        {"required", JsonValue::array({"value"})},
                        {"oneOf", units}};
    JsonValue properties{{"keys", {{"type", "array"}, {"items", key}, {"minItems", 1}}}};
    properties.update(track.properties);
    return {{"description", "a setting that changes over the film"},
            {"type", "object"},
            {"additionalProperties", false},
            {"properties", properties},
            {"required", JsonValue::array({"keys"})}};
  }

 private:
  /// Adds a setting that is a value or, where allowed, keyframes. `value`: schema of a value;
  /// `initial`: the default; null: none.
  void add_keyed(const char* key, const char* doc, const JsonValue& value,
                 const JsonValue& initial = {}, Keyframes keyframes = Keyframes::kAsObject) {
    JsonValue json = value;
    if (keyframes == Keyframes::kAsObject ? keyed_ : keyframes == Keyframes::kAllowed) {
      const JsonValue items{{"items", {{"properties", {{"value", value}}}}}};
      const JsonValue keyed{{"$ref", "#/$defs/keyframes"}, {"properties", {{"keys", items}}}};
      json = {{"oneOf", JsonValue::array({value, keyed})}};
    }
    if (!initial.is_null()) json["default"] = initial;
    add(key, doc, json);
  }
  bool keyed_;  ///< numbers, vectors and colours may have keyframes
  void add(const char* key, const char* doc, const JsonValue& json) {
    JsonValue entry = JsonValue::object();
    if (*doc) entry["description"] = doc;
    entry.update(json);
    properties[key] = entry;
  }
  static JsonValue number_schema(Range<double> range) {
    return {{"type", "number"}, {"minimum", range.low}, {"maximum", range.high}};
  }
  static JsonValue vector_schema(Range<double> range) {
    return {{"type", "array"}, {"items", number_schema(range)}, {"minItems", 3}, {"maxItems", 3}};
  }
  static JsonValue color_schemas() {
    return JsonValue::array(
        {vector_schema({0, 1}), JsonValue{{"type", "string"}, {"pattern", "^#[0-9a-fA-F]{6}$"}}});
  }
};

/// Visitor that writes the settings of a struct into `json`. Paths are relative to `folder`;
/// `pointer` is the JSON pointer of the struct ("/camera"), which its keyframes in `tracks` begin
/// with.
class FieldWriter {
 public:
  FieldWriter(std::filesystem::path folder, const std::vector<KeyframeTrack>& tracks,
              std::string pointer)
      : folder_(std::move(folder)), tracks_(tracks), pointer_(std::move(pointer)) {}
  JsonValue json = JsonValue::object();

  template <class T>
  void integer(const char* key, T& value, Range<long long>, const char*) {
    json[key] = value;
  }
  void number(const char* key, float& value, Range<double>, const char*,
              Keyframes = Keyframes::kAsObject) {
    if (!write_keyframes(key, [](Vec3 v) { return JsonValue(shorten(v.x)); }))
      json[key] = shorten(value);
  }
  void number(const char* key, std::optional<float>& value, Range<double> range, const char* doc,
              Keyframes = Keyframes::kAsObject) {
    if (value) number(key, *value, range, doc);
  }
  void boolean(const char* key, bool& value, const char*) { json[key] = value; }
  void boolean(const char* key, std::optional<bool>& value, const char*) {
    if (value) json[key] = *value;
  }
  template <class E>
  void choice(const char* key, E& value, std::initializer_list<std::pair<const char*, E>> choices,
              const char*) {
    for (const auto& [name, meaning] : choices)
      if (meaning == value) json[key] = name;
  }
  void text(const char* key, std::string& value, const char*) {
    if (!value.empty()) json[key] = value;
  }
  void path(const char* key, std::filesystem::path& value, const char*) {
    if (!value.empty()) json[key] = value.lexically_proximate(folder_).string();
  }
  void model_path(const char* key, std::filesystem::path& value, const char* doc) {
    path(key, value, doc);
  }
  void vector(const char* key, Vec3& value, const char*) {
    if (!write_keyframes(key, [](Vec3 v) { return shorten(v); })) json[key] = shorten(value);
  }
  void vector(const char* key, std::optional<Vec3>& value, const char* doc) {
    if (value) vector(key, *value, doc);
  }
  void scale(const char* key, Vec3& value, const char*) { json[key] = shorten(value); }
  void color(const char* key, Vec3& value, const char* doc) { vector(key, value, doc); }
  void color(const char* key, std::optional<Vec3>& value, const char* doc) {
    vector(key, value, doc);
  }
  void integers(const char* key, std::vector<int>& value, Range<long long>, const char*) {
    if (!value.empty()) json[key] = value;
  }
  void numbers(const char* key, std::vector<float>& values, std::initializer_list<Range<double>>,
               const char*) {
    json[key] = JsonValue::array();
    for (const float value : values) json[key].push_back(shorten(value));
  }
  void text_map(const char* key, std::map<std::string, std::string>& values, const char*) {
    if (!values.empty()) json[key] = values;
  }
  void landmarks(const char* key, LandmarkSettings& values, const char*) {
    for (const auto& [object, points] : values) {
      JsonValue& written_points = json[key][object] = JsonValue::object();
      for (const auto& [name, at] : points)
        written_points[name] = at.point ? shorten(*at.point) : fmt::format("v{}", at.vertex);
    }
  }
  template <class T>
  void object(const char* key, T& value, const char*) {
    if constexpr (std::is_same_v<T, ObjectSettings>) {
      if (is_blend_) return;
      if (std::string_view(key) == "source") source_is_sequence_ = is_mesh_sequence(value);
      // A target without a name is not in the scene file: the sequence plays alone.
      if (std::string_view(key) == "target" && source_is_sequence_ && value.name.empty()) return;
    }
    json[key] = write_object(value, pointer_ + "/" + key);
  }
  template <class T>
  void keyed_object(const char* key, T& value, const char* doc) {
    object(key, value, doc);
  }
  template <class T>
  void objects(const char* key, std::vector<T>& values, const char*) {
    if constexpr (std::is_same_v<T, ObjectSettings>) {
      if ((std::string_view(key) == "blend") != is_blend_) return;
    }
    json[key] = JsonValue::array();
    for (std::size_t i = 0; i < values.size(); ++i)
      json[key].push_back(write_object(values[i], fmt::format("{}/{}/{}", pointer_, key, i)));
  }
  void retired(const char*, const char*) {}  // as in SchemaWriter
  void before_actors(Scene&) {}
  void actors(const char* key, std::vector<ActorSettings>& values, const char* doc) {
    objects(key, values, doc);
  }

 private:
  template <class T>
  JsonValue write_object(T& value, const std::string& pointer) const {
    FieldWriter inner(folder_, tracks_, pointer);
    if constexpr (std::is_same_v<T, ActorSettings>) inner.is_blend_ = !value.blend.empty();
    describe(inner, value);
    return inner.json;
  }
  /// Writes the keyframes of a setting. Returns false if it has no track.
  template <class F>
  bool write_keyframes(const char* key, const F& format_value) {
    const std::string pointer = pointer_ + "/" + key;
    for (const KeyframeTrack& track : tracks_) {
      if (track.pointer != pointer) continue;
      KeyframeTrack settings = track;
      FieldWriter fields(folder_, tracks_, pointer);
      fields.json["keys"] = JsonValue::array();  // first, so that it precedes the easing
      for (const Keyframe& keyframe : track.keys) {
        const char* unit = track.unit == KeyUnit::kShare   ? "t"
                           : track.unit == KeyUnit::kFrame ? "frame"
                                                           : "leg";
        fields.json["keys"].push_back({{unit, shorten(static_cast<float>(keyframe.at))},
                                       {"value", format_value(keyframe.value)}});
      }
      describe(fields, settings);
      json[key] = fields.json;
      return true;
    }
    return false;
  }
  std::filesystem::path folder_;
  const std::vector<KeyframeTrack>& tracks_;
  std::string pointer_;
  bool is_blend_ = false;            ///< the actor has a blend instead of a chain
  bool source_is_sequence_ = false;  ///< the source is a mesh sequence, which needs no target
};

}  // namespace

std::string scene_schema() {
  Scene scene;
  SchemaWriter fields;
  describe(fields, scene);
  fields.properties["$schema"] = {{"type", "string"}};
  const JsonValue schema{
      {"$schema", "https://json-schema.org/draft/2020-12/schema"},
      {"title", "polymorph scene"},
      {"description",
       "A morph sequence: source, intermediate objects, target, and how to show them. "
       "Paths are relative to the scene file."},
      {"type", "object"},
      {"additionalProperties", false},
      {"oneOf", JsonValue::array({JsonValue{{"required", JsonValue::array({"source"})}},
                                  JsonValue{{"required", JsonValue::array({"blend"})}},
                                  JsonValue{{"required", JsonValue::array({"actors"})}}})},
      {"properties", fields.properties},
      {"$defs", {{"keyframes", SchemaWriter::keyframes_schema()}}}};
  return dump_json(schema);
}

std::string object_to_json(const ObjectSettings& object, const std::vector<KeyframeTrack>& tracks,
                           const std::string& pointer) {
  ObjectSettings copy = object;
  FieldWriter fields(/*folder=*/{}, tracks, pointer);
  describe(fields, copy);
  return dump_json(fields.json);
}

std::string scene_to_json(const Scene& scene, const std::filesystem::path& folder) {
  Scene copy = scene;  // the description takes settings by reference; this visitor only reads
  FieldWriter fields(folder, scene.tracks, "");
  describe(fields, copy);
  return dump_json(fields.json);
}

}  // namespace polymorph
