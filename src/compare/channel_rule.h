// Comparison rules of image channels, told by their names.
#pragma once

#include <cstdint>
#include <string>

namespace polymorph {

enum class ChannelRule : std::uint8_t {
  kColor,   ///< R, G, B, A
  kDepth,   ///< Z
  kNormal,  ///< N.X, N.Y, N.Z
  kId,      ///< numbers that name something: any difference counts
  kOther
};

/// Ids are channels with a word "id" or "label" in their names, however they are spelled
/// ("objectId", "ID.X", "mat_ids"), Blender's "IndexOB" and "IndexMA", and Cryptomatte ranks. A
/// ranked layer, as in "crypto_object00" or "ViewLayer.CryptoMaterial01", has ids in R and B (in
/// any spelling); G and A are coverages.
ChannelRule channel_rule(const std::string& name);

/// Depths from here on are of rays that hit nothing: the renderer writes 1e10.
constexpr float kNothingHit = 1e9f;

}  // namespace polymorph
