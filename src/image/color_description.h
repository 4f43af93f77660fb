// Short texts that identify the colour profiles and primaries of images.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <string>

namespace polymorph {

/// Formats size and hash (FNV-1a) of an ICC profile: "3144 bytes, 1f0c52a9".
inline std::string describe_profile(const void* profile, std::size_t size) {
  const auto* bytes = static_cast<const unsigned char*>(profile);
  std::uint32_t hash = 2166136261u;  // FNV's offset basis; its prime follows
  for (std::size_t i = 0; i < size; ++i) hash = (hash ^ bytes[i]) * 16777619u;
  char text[48];
  std::snprintf(text, sizeof text, "%zu bytes, %08x", size, static_cast<unsigned>(hash));
  return text;
}

/// Formats the chromaticities x, y of red, green, blue and white; empty if they equal those of Rec.
/// 709 and sRGB within 0.001.
inline std::string describe_primaries(const float (&xy)[8]) {
  constexpr float kRec709[8] = {0.64f, 0.33f, 0.30f, 0.60f, 0.15f, 0.06f, 0.3127f, 0.3290f};
  bool is_rec709 = true;
  std::string text;
  for (int i = 0; i < 8; ++i) {
    is_rec709 = is_rec709 && std::fabs(xy[i] - kRec709[i]) <= 1e-3f;
    char number[24];
    std::snprintf(number, sizeof number, "%s%.4g", i > 0 ? " " : "", static_cast<double>(xy[i]));
    text += number;
  }
  return is_rec709 ? std::string() : text;
}

}  // namespace polymorph
