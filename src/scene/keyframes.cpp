#include "scene/keyframes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "scene/describe.h"

namespace polymorph {
namespace {

double time_in_unit(const KeyframeTrack& track, const FilmTime& time) {
  switch (track.unit) {
    case KeyUnit::kShare:
      return time.share;
    case KeyUnit::kFrame:
      return time.frame;
    case KeyUnit::kLeg:
      return time.leg;
  }
  return 0;
}

double component(Vec3 v, int c) { return static_cast<double>(c == 0 ? v.x : c == 1 ? v.y : v.z); }

/// Slope of the line from key i to key i + 1 in component c.
double secant(const KeyframeTrack& track, std::size_t i, int c) {
  const Keyframe &a = track.keys[i], &b = track.keys[i + 1];
  return (component(b.value, c) - component(a.value, c)) / (b.at - a.at);
}

/// Slope of kSmooth's curve at key i: the weighted harmonic mean of the slopes of the lines before
/// and after it. 0 if these have different signs, and at the first and the last key (value_at()).
double slope(const KeyframeTrack& track, std::size_t i, int c) {
  if (i == 0 || i + 1 == track.keys.size()) return 0;
  const double slope_before = secant(track, i - 1, c), slope_after = secant(track, i, c);
  if (slope_before * slope_after <= 0) return 0;
  // Lengths h0, h1 of the intervals before and after the key, and weights of their slopes.
  const double h0 = track.keys[i].at - track.keys[i - 1].at;
  const double h1 = track.keys[i + 1].at - track.keys[i].at;
  const double w0 = 2 * h1 + h0, w1 = h1 + 2 * h0;
  return (w0 + w1) / (w0 / slope_before + w1 / slope_after);
}

/// Interpolates component c between keys i and i + 1 at t in [0, 1].
double interpolate(const KeyframeTrack& track, std::size_t i, int c, double t) {
  const Keyframe &a = track.keys[i], &b = track.keys[i + 1];
  const double from = component(a.value, c), to = component(b.value, c);
  if (track.easing == KeyEasing::kSmooth) {
    const double h = b.at - a.at, r = 1 - t;  // cubic Hermite interpolation
    return from * (1 + 2 * t) * r * r + to * t * t * (3 - 2 * t) +
           h * slope(track, i, c) * t * r * r - h * slope(track, i + 1, c) * t * t * r;
  }
  double u = t;
  if (track.easing == KeyEasing::kSmoothstep) u = t * t * (3 - 2 * t);
  if (track.easing == KeyEasing::kQuintic) u = t * t * t * (t * (6 * t - 15) + 10);
  if (track.easing == KeyEasing::kHold) u = 0;
  return from + u * (to - from);
}

/// Visitor of describe() that evaluates every keyframed setting at one time. Functions with empty
/// bodies are for settings that cannot have keyframes.
class KeyframeApplier {
 public:
  KeyframeApplier(const std::vector<KeyframeTrack>& tracks, const FilmTime& time,
                  std::string pointer)
      : tracks_(tracks), time_(time), pointer_(std::move(pointer)) {}

  template <class T>
  void integer(const char*, T&, Range<long long>, const char*) {}
  void number(const char* key, float& value, Range<double> range, const char*,
              Keyframes = Keyframes::kAsObject) {
    if (const KeyframeTrack* track = find(key))
      value = std::clamp(value_at(*track, time_).x, static_cast<float>(range.low),
                         static_cast<float>(range.high));
  }
  void number(const char* key, std::optional<float>& value, Range<double> range, const char* doc,
              Keyframes = Keyframes::kAsObject) {
    if (find(key)) number(key, value.emplace(), range, doc);
  }
  void boolean(const char*, bool&, const char*) {}
  void boolean(const char*, std::optional<bool>&, const char*) {}
  template <class E>
  void choice(const char*, E&, std::initializer_list<std::pair<const char*, E>>, const char*) {}
  void text(const char*, std::string&, const char*) {}
  void text_map(const char*, std::map<std::string, std::string>&, const char*) {}
  void landmarks(const char*, LandmarkSettings&, const char*) {}
  void path(const char*, std::filesystem::path&, const char*) {}
  void model_path(const char*, std::filesystem::path&, const char*) {}
  void vector(const char* key, Vec3& value, const char*) {
    if (const KeyframeTrack* track = find(key)) value = value_at(*track, time_);
  }
  void vector(const char* key, std::optional<Vec3>& value, const char* doc) {
    if (find(key)) vector(key, value.emplace(), doc);
  }
  void scale(const char*, Vec3&, const char*) {}
  void color(const char* key, Vec3& value, const char* doc) { vector(key, value, doc); }
  void color(const char* key, std::optional<Vec3>& value, const char* doc) {
    vector(key, value, doc);
  }
  void integers(const char*, std::vector<int>&, Range<long long>, const char*) {}
  void numbers(const char*, std::vector<float>&, std::initializer_list<Range<double>>,
               const char*) {}
  template <class T>
  void object(const char* key, T& value, const char*) {
    KeyframeApplier inner(tracks_, time_, pointer_ + "/" + key);
    describe(inner, value);
  }
  template <class T>
  void keyed_object(const char* key, T& value, const char* doc) {
    object(key, value, doc);
  }
  template <class T>
  void objects(const char* key, std::vector<T>& values, const char*) {
    for (std::size_t i = 0; i < values.size(); ++i) {
      KeyframeApplier inner(tracks_, time_, fmt::format("{}/{}/{}", pointer_, key, i));
      describe(inner, values[i]);
    }
  }
  void retired(const char*, const char*) {}
  void before_actors(Scene&) {}
  void actors(const char* key, std::vector<ActorSettings>& values, const char* doc) {
    // Of an actor's settings, only weights of a blend have keyframes. Skip the actors if none has.
    const auto is_weight = [](const KeyframeTrack& track) {
      return track.pointer.starts_with("/actors/");
    };
    if (std::any_of(tracks_.begin(), tracks_.end(), is_weight)) objects(key, values, doc);
  }

 private:
  const KeyframeTrack* find(const char* key) const {
    const std::string pointer = pointer_ + "/" + key;
    for (const KeyframeTrack& track : tracks_)
      if (track.pointer == pointer) return &track;
    return nullptr;
  }

  const std::vector<KeyframeTrack>& tracks_;
  const FilmTime& time_;
  std::string pointer_;
};

/// Orbit angle of the camera in degrees, linear over the film. If `orbit` is a number of whole
/// turns, the angle is complete one frame after the last, so that the film loops without a repeated
/// frame.
float orbit_at(const Scene& scene, const FilmTime& time) {
  const auto orbit = static_cast<double>(scene.camera.orbit);
  return static_cast<float>(orbit *
                            (std::fmod(orbit, 360.0) == 0 ? time.loop_fraction : time.share));
}

}  // namespace

Vec3 value_at(const KeyframeTrack& track, const FilmTime& time) {
  const std::vector<Keyframe>& keys = track.keys;
  const double at = time_in_unit(track, time);
  if (at <= keys.front().at) return keys.front().value;
  if (at >= keys.back().at) return keys.back().value;
  const auto after = std::upper_bound(keys.begin(), keys.end(), at,
                                      [](double a, const Keyframe& key) { return a < key.at; });
  const auto i = static_cast<std::size_t>(after - keys.begin()) - 1;
  const double t = (at - keys[i].at) / (keys[i + 1].at - keys[i].at);
  return {static_cast<float>(interpolate(track, i, 0, t)),
          static_cast<float>(interpolate(track, i, 1, t)),
          static_cast<float>(interpolate(track, i, 2, t))};
}

Scene scene_at(const Scene& scene, const FilmTime& time) {
  Scene result = scene;
  result.tracks.clear();
  result.camera.orbit = orbit_at(scene, time);
  if (scene.tracks.empty()) return result;
  KeyframeApplier applier(scene.tracks, time, "");
  describe(applier, result);
  return result;
}

}  // namespace polymorph
