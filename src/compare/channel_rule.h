// Comparison rules of image channels, by the channels' names. Tolerance (compare.h) says how each
// rule limits differences.
#pragma once

#include <cstdint>
#include <string>

namespace polymorph {

enum class ChannelRule : std::uint8_t {
  kColor,   ///< R, G, B, A
  kDepth,   ///< Z
  kNormal,  ///< N.X, N.Y, N.Z
  kId,      ///< identifiers: any difference counts
  kOther    ///< all other channels
};

/// Finds the rule of a channel. Ids are channels with a word "id" or "label" in their names in any
/// spelling ("objectId", "ID.X", "mat_ids"), Blender's "IndexOB" and "IndexMA", and Cryptomatte
/// ranks. A ranked layer ("crypto_object00", "ViewLayer.CryptoMaterial01") has ids in R and B, and
/// coverages in G and A.
ChannelRule channel_rule(const std::string& name);

/// Depths of at least this value mean that the ray hit nothing; the renderer writes 1e10.
constexpr float kNothingHit = 1e9f;

}  // namespace polymorph
