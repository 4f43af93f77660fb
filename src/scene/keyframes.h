// Keyframes: settings of camera, lights, ground, look and exposure, and weights of blends, that
// change over the film.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "kernels/types.h"

namespace polymorph {

struct Scene;

/// Unit of the key times of a track.
enum class KeyUnit : std::uint8_t {
  kShare,  ///< "t": fraction of the film; 0 is its first frame, 1 its last, including holds
  kFrame,  ///< "frame": the frame's number, from 1
  kLeg,    ///< "leg": 1 is the start of the first leg, 1.5 half way through it, 2 its end
};

/// Interpolation of a value from one key to the next.
enum class KeyEasing : std::uint8_t {
  kSmooth,      ///< one curve through all keys, monotone between two, at rest at both ends
  kLinear,      ///< straight lines
  kSmoothstep,  ///< 3t^2 - 2t^3, at rest at every key
  kQuintic,     ///< 6t^5 - 15t^4 + 10t^3, at rest at every key
  kHold,        ///< constant until the next key
};

struct Keyframe {
  double at = 0;  ///< time in the track's unit
  Vec3 value;     ///< a scalar is in x
};

/// The keys of one setting. Before the first key and after the last one the value is constant.
struct KeyframeTrack {
  std::string pointer;  ///< JSON pointer of the setting: "/camera/azimuth"
  KeyUnit unit = KeyUnit::kShare;
  KeyEasing easing = KeyEasing::kSmooth;
  std::vector<Keyframe> keys;  ///< one or more, with strictly ascending `at`
};

/// A time of the film in all units of keys, computed by film_time() (morph/timeline.h).
struct FilmTime {
  double share = 0;          ///< KeyUnit::kShare
  double frame = 1;          ///< KeyUnit::kFrame
  double leg = 1;            ///< KeyUnit::kLeg
  double loop_fraction = 0;  ///< fraction of a loop; 1 is the frame that would follow the last
};

/// Evaluates a track. kSmooth is a monotone cubic per component (Fritsch and Carlson 1980, slopes
/// by the weighted harmonic mean, 0 at both ends): values stay between those of neighbouring keys.
Vec3 value_at(const KeyframeTrack& track, const FilmTime& time);

/// Returns the scene with all keyframed settings evaluated at a time, and numbers clamped to their
/// ranges. Its `tracks` is empty, and its camera.orbit is the angle at that time.
Scene scene_at(const Scene& scene, const FilmTime& time);

}  // namespace polymorph
