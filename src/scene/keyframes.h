// Keyframes: settings of camera, lights, ground, look and exposure, and weights of blends, that
// change over the film.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "kernels/types.h"

namespace polymorph {

struct Scene;

/// The unit in which a track's keys stand; all keys of one track share it.
enum class KeyUnit : std::uint8_t {
  kShare,  ///< "t": 0 is the film's first frame, 1 its last, holds included
  kFrame,  ///< "frame": the frame's number, from 1
  kLeg,    ///< "leg": 1 is the start of the first leg, 1.5 half way through it, 2 its end
};

/// Interpolation of a value from one key to the next.
enum class KeyEasing : std::uint8_t {
  kSmooth,      ///< one curve through all keys, at rest at both ends, that never overshoots
  kLinear,      ///< straight lines
  kSmoothstep,  ///< 3t^2 - 2t^3, at rest at every key
  kQuintic,     ///< 6t^5 - 15t^4 + 10t^3, at rest at every key
  kHold,        ///< stays until the next key
};

struct Keyframe {
  double at = 0;  ///< time in the track's unit
  Vec3 value;     ///< a number's is x
};

/// The keys of one setting. Before the first key and after the last one the value stays.
struct KeyframeTrack {
  std::string pointer;  ///< JSON pointer of the setting: "/camera/azimuth"
  KeyUnit unit = KeyUnit::kShare;
  KeyEasing easing = KeyEasing::kSmooth;
  std::vector<Keyframe> keys;  ///< keys, at least one; `at` ascending strictly
};

/// One moment of the film in every unit that keys may have; morph/timeline.h computes it.
struct FilmTime {
  double share = 0;
  double frame = 1;
  double leg = 1;
  double turn = 0;  ///< `share`, but 1 is the frame that would follow the last
};

/// The track's value. `smooth` is a monotone cubic per component (Fritsch and Carlson 1980, slopes
/// by the weighted harmonic mean, 0 at both ends), so that values stay between those of the keys.
Vec3 value_at(const KeyframeTrack& track, const FilmTime& time);

/// The scene with every keyed setting at its value of this moment, clamped to the setting's range;
/// `tracks` is empty then, and camera.orbit the angle of this moment.
Scene scene_at(const Scene& scene, const FilmTime& time);

}  // namespace polymorph
