#include "scene/contradictions.h"

#include <fmt/format.h>

#include <algorithm>
#include <initializer_list>
#include <numeric>
#include <string>
#include <utility>

#include "base/plural.h"
#include "base/text.h"
#include "scene/blends.h"
#include "scene/max_frames.h"
#include "scene/mesh_numbers.h"

namespace polymorph {
namespace {

/// Visits all parts of a scene and reports contradictions between them. JSON values give the
/// positions of the errors in the file; the settings are those of `scene`.
class ContradictionFinder {
 public:
  ContradictionFinder(const JsonDocument& document, const Scene& scene,
                      std::vector<SceneFinding>& findings)
      : document_(document), scene_(scene), findings_(findings) {}

  void run() {
    const JsonValue& root = document_.root;
    const JsonValue* list = root.find("actors");
    if (!list) {
      check_actor(scene_.actors.front(), "", root);
    } else {
      // A list that is too long has more items than actors (FieldReader::objects()).
      for (std::size_t i = 0; i < std::min(list->items.size(), scene_.actors.size()); ++i)
        check_actor(scene_.actors[i], fmt::format("/actors/{}", i), list->items[i]);
    }
    check_all_landmarks();
    if (!scene_.frames.per_leg.empty() && scene_.frames.count > 0)
      report("/frames/count", find_in(&root, {"frames", "count"}),
             "contradicts per_leg - give one of the two");
    if (length(scene_.camera.up) == 0)
      report("/camera/up", find_in(&root, {"camera", "up"}), "must not be the zero vector");
    for (const KeyframeTrack& track : scene_.tracks) check_track(track);
    check_image();
  }

 private:
  /// Objects of an actor. In a blend, all objects are neighbours of each other.
  struct Chain {
    std::vector<const ObjectSettings*> objects;
    bool is_blend = false;
  };

  /// Checks an actor by its kind: a blend, a mesh sequence that plays alone, or a chain. `pointer`,
  /// `value`: its JSON pointer and its JSON.
  void check_actor(const ActorSettings& actor, const std::string& pointer, const JsonValue& value) {
    if (value.find("blend")) return check_blend(actor, pointer, value);
    if (plays_sequence_alone(actor) && !value.find("target"))
      return check_play(actor, pointer, value);
    for (const char* key : {"source", "target"})
      if (!value.find(key))
        report(fmt::format("{}/{}", pointer, key), &value,
               "is missing - name a model file or a shape");
    check_per_leg(actor, pointer, value);
    if (scene_.frames.count > 0 && scene_.frames.per_leg.empty()) check_time(actor, pointer, value);
    for (const auto& [key, object] :
         {std::pair("source", &actor.source), std::pair("target", &actor.target)}) {
      if (object->retarget < 1)
        report(fmt::format("{}/{}/retarget", pointer, key), find_in(&value, {key, "retarget"}),
               "only an object on the way can be left before it is reached");
      check_no_weight(*object, fmt::format("{}/{}", pointer, key), find_in(&value, {key}));
    }
    const JsonValue* intermediate = value.find("intermediate");
    for (std::size_t i = 0; i < actor.intermediate.size(); ++i) {
      const std::string object_pointer = fmt::format("{}/intermediate/{}", pointer, i);
      check_no_weight(actor.intermediate[i], object_pointer, &intermediate->items[i]);
      if (actor.intermediate[i].retarget == 1) continue;
      if (actor.intermediate[i].hold > 0)
        report(object_pointer + "/hold", &intermediate->items[i],
               "an object that is left before it is reached cannot stand still");
      if (morphs_sequence(actor))
        report(object_pointer + "/retarget", &intermediate->items[i],
               "an actor with a mesh sequence in its morph reaches all its objects");
    }
  }
  void check_no_weight(const ObjectSettings& object, const std::string& pointer,
                       const JsonValue* value) {
    if (object.weight)
      report(pointer + "/weight", find_in(value, {"weight"}),
             "is for the objects of a \"blend\" - those of a chain follow each other");
  }
  void check_per_leg(const ActorSettings& actor, const std::string& pointer,
                     const JsonValue& value) {
    const std::size_t legs = actor.intermediate.size() + 1;
    const auto legs_text = plural(legs, "leg");
    const bool has_own = !actor.per_leg.empty();
    const std::vector<int>& per_leg = has_own ? actor.per_leg : scene_.frames.per_leg;
    const JsonValue* frames = find_in(&document_.root, {"frames"});
    if (!per_leg.empty() && per_leg.size() != legs)
      report(has_own ? pointer + "/per_leg" : "/frames/per_leg",
             has_own ? value.find("per_leg") : find_in(frames, {"per_leg"}),
             fmt::format("has {} entries for {} (objects - 1)", per_leg.size(), legs_text));
  }
  /// Checks an actor that mixes its objects.
  void check_blend(const ActorSettings& actor, const std::string& pointer, const JsonValue& value) {
    for (const char* key : {"source", "intermediate", "target"})
      if (const JsonValue* member = value.find(key))
        report(fmt::format("{}/{}", pointer, key), member,
               "contradicts \"blend\" - an actor mixes objects, or goes from one to the next");
    const JsonValue& list = *value.find("blend");
    if (list.kind != JsonValue::Kind::kArray) return;  // reported already
    if (actor.blend.size() < 2)
      report(pointer + "/blend", &list,
             fmt::format("has {} - a blend has two or more", plural(actor.blend.size(), "object")));
    if (actor.start != 1)
      report(pointer + "/start", value.find("start"),
             "is for morphs - the keyframes of a blend's weights say when it changes");
    check_per_leg(actor, pointer, value);
    if (scene_.frames.count > 0 && scene_.frames.per_leg.empty()) check_time(actor, pointer, value);
    for (std::size_t i = 0; i < actor.blend.size(); ++i)
      check_blend_object(actor, actor.blend[i], fmt::format("{}/blend/{}", pointer, i),
                         list.items[i]);
    const auto is_zero = [&](const ObjectSettings& object) {  // weight 0 and no keyframes
      const auto index = static_cast<std::size_t>(&object - actor.blend.data());
      const std::string track = fmt::format("{}/blend/{}/weight", pointer, index);
      return object.weight == 0.0f &&
             std::none_of(scene_.tracks.begin(), scene_.tracks.end(),
                          [&](const KeyframeTrack& other) { return other.pointer == track; });
    };
    if (!actor.blend.empty() && std::all_of(actor.blend.begin(), actor.blend.end(), is_zero))
      report(pointer + "/blend", &list, "all weights are 0 - one object has more at least");
  }
  void check_blend_object(const ActorSettings& actor, const ObjectSettings& object,
                          const std::string& pointer, const JsonValue& value) {
    if (!object.weight)
      report(pointer + "/weight", &value, "is missing - a number from 0, or keyframes");
    if (is_mesh_sequence(object))
      report(pointer + "/model", find_in(&value, {"model"}),
             "is a mesh sequence - the objects of a blend do not move: name one mesh");
    for (const auto& [key, is_given] :
         {std::pair("meta", object.meta), std::pair("hold", object.hold > 0),
          std::pair("retarget", object.retarget < 1)})
      if (is_given)
        report(fmt::format("{}/{}", pointer, key), find_in(&value, {key}),
               "is for an object on the way of a morph - a blend has its weights");
    if (!mixes_many(actor)) return;
    const char* problem =
        scene_.field.kind != FieldKind::kGaussian               ? "field.kind \"gaussian\""
        : scene_.surface.influence != 1                         ? "report.influence 1"
        : object.motion.interpolate != Interpolation::kDistance ? "motion.interpolate \"distance\""
        : object.motion.path == Path::kExplode ? "another motion.path than \"explode\""
        : object.shape == "drops"              ? "another shape than \"drops\""
                                               : nullptr;
    if (problem)
      report(pointer, &value,
             fmt::format("needs {} - three objects or more are mixed by their distances", problem));
  }
  /// Checks an actor that plays a mesh sequence.
  void check_play(const ActorSettings& actor, const std::string& pointer, const JsonValue& value) {
    if (!actor.per_leg.empty())
      report(pointer + "/per_leg", value.find("per_leg"),
             "is for morphs - \"range\" and \"fps\" say how long a mesh sequence plays");
    if (scene_.frames.count > 0) check_time(actor, pointer, value);
    const double meshes = mesh_count(actor.source);
    const double frames_per_mesh =
        static_cast<double>(scene_.frames.fps) /
        static_cast<double>(actor.source.fps.value_or(scene_.frames.fps));
    if (!(meshes * frames_per_mesh + actor.source.hold <= kMaxFrames))
      report(pointer + "/source/fps", find_in(&value, {"source", "fps"}),
             fmt::format("makes {:.0f} frames of {:.0f} meshes (must be {} at most)",
                         meshes * frames_per_mesh + actor.source.hold, meshes, kMaxFrames));
  }
  /// Checks the landmarks of the scene, which every actor may use, and each actor's own.
  void check_all_landmarks() {
    const JsonValue* shared = find_in(&document_.root, {"plan", "landmarks"});
    const JsonValue* list = document_.root.find("actors");
    std::vector<Chain> chains;
    for (std::size_t i = 0; i < scene_.actors.size(); ++i) {
      const ActorSettings& actor = scene_.actors[i];
      chains.push_back({chain_objects(actor), !actor.blend.empty()});
      const JsonValue* value = list && i < list->items.size() ? &list->items[i] : nullptr;
      if (const JsonValue* landmarks = find_in(value, {"plan", "landmarks"}))
        check_landmarks(*landmarks, fmt::format("/actors/{}/plan/landmarks", i), actor.plan,
                        {chains.back()}, shared);
    }
    if (shared) check_landmarks(*shared, "/plan/landmarks", scene_.plan, chains, nullptr);
  }
  /// Checks that each key of `landmarks` names an object of the chains that no other key names, and
  /// that a neighbour of the object has a landmark of each name, too. Objects and landmarks of
  /// `shared` (the scene's landmarks, may be null) count as existing.
  void check_landmarks(const JsonValue& landmarks, const std::string& pointer,
                       const PlanSettings& plan, const std::vector<Chain>& chains,
                       const JsonValue* shared) {
    for (std::size_t k = 0; k < landmarks.members.size(); ++k) {
      const JsonMember& member = landmarks.members[k];
      const std::string object_pointer = pointer + "/" + member.key;
      const JsonValue* known_points = shared ? shared->find(member.key) : nullptr;
      bool is_known = known_points != nullptr;
      std::vector<std::string> partner_names;  // landmarks of the object's neighbours
      for (const Chain& chain : chains)
        for (std::size_t i = 0; i < chain.objects.size(); ++i) {
          if (!is_named(*chain.objects[i], member.key)) continue;
          is_known = true;
          add_neighbours_landmarks(chain, i, plan, partner_names);
          for (std::size_t earlier_key = 0; earlier_key < k; ++earlier_key)
            if (is_named(*chain.objects[i], landmarks.members[earlier_key].key))
              return report_at(object_pointer, member.key_offset,
                               fmt::format("is the same object as \"{}\" - name it once",
                                           printable(landmarks.members[earlier_key].key)));
        }
      if (known_points)
        for (const JsonMember& point : known_points->members) partner_names.push_back(point.key);
      if (is_known)
        check_partners(member, object_pointer, plan, partner_names);
      else
        report_unknown_object(member, object_pointer, chains);
    }
  }
  /// Adds the names of the landmarks of the neighbours of object `i`.
  static void add_neighbours_landmarks(const Chain& chain, std::size_t i, const PlanSettings& plan,
                                       std::vector<std::string>& names) {
    for (std::size_t j = 0; j < chain.objects.size(); ++j) {
      const bool is_neighbour = j + 1 == i || i + 1 == j || (chain.is_blend && j != i);
      const ObjectLandmarks* other =
          is_neighbour ? find_landmarks(plan, *chain.objects[j]) : nullptr;
      if (!other) continue;
      for (const auto& [name, point] : *other) names.push_back(name);
    }
  }
  /// Checks that each landmark of an object is among `partner_names`.
  void check_partners(const JsonMember& object, const std::string& pointer,
                      const PlanSettings& plan, const std::vector<std::string>& partner_names) {
    const auto landmarks = plan.landmarks.find(object.key);
    if (landmarks == plan.landmarks.end()) return;  // reported already
    for (const JsonMember& point : object.value.members)
      if (landmarks->second.contains(point.key) &&
          std::find(partner_names.begin(), partner_names.end(), point.key) == partner_names.end())
        report_at(pointer + "/" + point.key, point.key_offset,
                  fmt::format("no neighbour of {} in the chain has a landmark \"{}\"{}",
                              printable(object.key), printable(point.key),
                              did_you_mean(point.key, partner_names)));
  }
  void report_unknown_object(const JsonMember& object, const std::string& pointer,
                             const std::vector<Chain>& chains) {
    std::vector<std::string> names;
    for (const Chain& chain : chains)
      for (const ObjectSettings* settings : chain.objects) {
        const std::string name = !settings->name.empty()   ? settings->name
                                 : settings->model.empty() ? settings->shape
                                                           : settings->model.filename().string();
        if (!name.empty() && std::find(names.begin(), names.end(), name) == names.end())
          names.push_back(name);
      }
    report_at(pointer, object.key_offset,
              fmt::format("no object is called that{} (known: {})", did_you_mean(object.key, names),
                          join_quoted(names)));
  }
  /// Checks that the actor's chain fits into the scene's frames.
  void check_time(const ActorSettings& actor, const std::string& pointer, const JsonValue& value) {
    const FrameSettings& frames = scene_.frames;
    const int moving_frames = frames.count - frames.hold_start - frames.hold_end;
    // A morph needs a first and a last frame.
    const int min_frames = plays_sequence_alone(actor) || !actor.blend.empty() ? 1 : 2;
    if (moving_frames < min_frames)
      return report("/frames/count", find_in(&document_.root, {"frames", "count"}),
                    fmt::format("leaves {} beside the holds ({} + {}) - {} needed",
                                plural(moving_frames, "frame"), frames.hold_start, frames.hold_end,
                                min_frames == 1 ? "at least one is" : "at least two are"));
    // Without per_leg of the actor, only the minimum number of frames is known.
    int needed_frames = std::accumulate(actor.per_leg.begin(), actor.per_leg.end(), 0);
    for (const ObjectSettings& object : actor.intermediate)
      needed_frames += actor.per_leg.empty() ? 0 : object.hold;
    needed_frames = std::max(needed_frames, min_frames);
    if (actor.start - 1 + needed_frames > moving_frames)
      report(
          pointer + "/start", value.find("start"),
          fmt::format("leaves {} of the scene's {} frames, and the actor needs {}",
                      std::max(moving_frames - actor.start + 1, 0), frames.count, needed_frames));
  }
  /// Checks a setting's keyframes against the whole scene.
  void check_track(const KeyframeTrack& track) {
    const JsonValue* value = find_value(track.pointer);
    for (std::size_t i = 0; i < track.keys.size(); ++i) {
      const JsonValue* keys = value ? value->find("keys") : nullptr;
      const JsonValue* key = keys && i < keys->items.size() ? &keys->items[i] : nullptr;
      const std::string pointer = fmt::format("{}/keys/{}", track.pointer, i);
      const std::size_t legs = scene_.actors.front().intermediate.size() + 1;
      if (track.unit == KeyUnit::kLeg && track.keys[i].at > static_cast<double>(legs + 1))
        report(pointer, key,
               fmt::format("is at leg {:g}, but the first actor's last leg, {}, ends at {}",
                           track.keys[i].at, legs, legs + 1));
      if (track.pointer == "/camera/up" && length(track.keys[i].value) == 0)
        report(pointer, key, "must not be the zero vector");
    }
  }
  void check_image() {
    const JsonValue* aovs = find_in(&document_.root, {"image", "aovs"});
    const std::string& chosen = scene_.image.aovs;
    if (aovs && chosen != "all" && chosen != "none")
      for (const std::string& name : split(chosen, ','))
        if (std::find(kAovNames.begin(), kAovNames.end(), name) == kAovNames.end())
          report("/image/aovs", aovs,
                 fmt::format("has no layer \"{}\"{} (known: {}; all; none)", name,
                             did_you_mean(name, kAovNames), join_quoted(kAovNames)));
    if (scene_.lights.lamps.size() > kMaxLamps)
      report("/lights/lamps", find_in(&document_.root, {"lights", "lamps"}),
             fmt::format("has {} lamps - at most {} are possible", scene_.lights.lamps.size(),
                         kMaxLamps));
    if (scene_.output.png_bits != 8 && scene_.output.png_bits != 16)
      report("/output/png_bits", find_in(&document_.root, {"output", "png_bits"}),
             fmt::format("must be 8 or 16 (is {})", scene_.output.png_bits));
  }
  /// Finds the value at a JSON pointer; null if there is none.
  const JsonValue* find_value(std::string_view pointer) const {
    const JsonValue* value = &document_.root;
    for (const std::string& key : split(pointer.substr(1), '/')) {  // without the leading '/'
      if (!value) return nullptr;
      if (value->kind != JsonValue::Kind::kArray) {
        value = value->find(key);
      } else {
        const auto index = static_cast<std::size_t>(parse_integer(key).value_or(0));
        value = index < value->items.size() ? &value->items[index] : nullptr;
      }
    }
    return value;
  }
  /// Finds the value below `value` (may be null) along a path of keys; null if there is none.
  static const JsonValue* find_in(const JsonValue* value, std::initializer_list<const char*> keys) {
    for (const char* key : keys) value = value ? value->find(key) : nullptr;
    return value;
  }
  /// Adds an error at `value`, which is null if it is not in the document.
  void report(const std::string& pointer, const JsonValue* value, const std::string& message) {
    report_at(pointer, value ? value->offset : JsonValue::kNowhere, message);
  }
  void report_at(const std::string& pointer, std::size_t offset, const std::string& message) {
    const TextPosition position = document_.position(offset);
    // Several actors may inherit the same error from the scene: report it once.
    for (const SceneFinding& earlier : findings_)
      if (earlier.pointer == pointer && earlier.message == message) return;
    findings_.push_back({position.line, position.column, pointer, message});
  }

  const JsonDocument& document_;
  const Scene& scene_;
  std::vector<SceneFinding>& findings_;
};

}  // namespace

void find_contradictions(const JsonDocument& document, const Scene& scene,
                         std::vector<SceneFinding>& findings) {
  ContradictionFinder(document, scene, findings).run();
}

}  // namespace polymorph
