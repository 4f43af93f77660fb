// What is written beside the colour. Adding an AOV is adding a row here (and a field to FirstHit,
// where it needs one).
#pragma once

#include <span>

#include "kernels/types.h"

namespace polymorph {

/// What the ray through the pixel's centre met first; as it stands: nothing. Values are those of
/// one surface, never averages over an edge.
struct FirstHit {
  float depth = 1e10f;  ///< distance along the view axis
  Vec3 normal;          ///< shading normal, world space
  float id = 0;
};

struct Aov {
  const char* channel;
  float (*value)(const FirstHit&);
};

inline constexpr Aov kAovs[] = {
    {"Z", [](const FirstHit& hit) { return hit.depth; }},
    {"N.X", [](const FirstHit& hit) { return hit.normal.x; }},
    {"N.Y", [](const FirstHit& hit) { return hit.normal.y; }},
    {"N.Z", [](const FirstHit& hit) { return hit.normal.z; }},
    {"id", [](const FirstHit& hit) { return hit.id; }},
};

}  // namespace polymorph
