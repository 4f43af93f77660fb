// Strict OBJ scanner. Other readers accept almost anything: bad numbers become 0, indices wrap or
// stay out of range, a count of 256 corners becomes 0, directories are empty models.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace polymorph {

/// Indices of a corner's position, texture coordinates and normal, from 0; -1: not given.
struct ObjCorner {
  std::int32_t v = -1, vt = -1, vn = -1;
};

struct ObjFace {
  std::uint32_t corners = 0;      ///< number of corners
  std::uint32_t line = 0;         ///< line of its f statement, from 1
  std::uint32_t label = 0;        ///< index into ObjScan::labels
  std::int32_t material = -1;     ///< index into ObjScan::materials, -1 = none
  std::int32_t color = kNoColor;  ///< 0xRRGGBB in sRGB: mean colour of its points, in steps of 4
  static constexpr std::int32_t kNoColor = -1;
};

/// A name and the line of its first use.
struct NamedLine {
  std::string name;
  std::uint32_t line = 0;
};

/// Contents of an OBJ file, in file order.
struct ObjScan {
  std::vector<float> positions, uvs, normals;  ///< 3, 2 and 3 per v, vt and vn line
  std::vector<ObjFace> faces;
  std::vector<ObjCorner> corners;  ///< corners of all faces, face by face; their indices are valid
  /// Names of groups (or of objects, where there is no group) that have faces.
  std::vector<std::string> labels;
  std::vector<NamedLine> materials;   ///< usemtl names that have faces, as written
  std::vector<NamedLine> libraries;   ///< mtllib lines without the keyword
  std::vector<std::string> warnings;  ///< "FILE:LINE: ..."

  std::uint32_t point_count() const { return static_cast<std::uint32_t>(positions.size() / 3); }
};

/// Maximum number of corners of a face.
inline constexpr std::uint32_t kMaxFaceCorners = 4096;

/// Value of the colour components of a point without colour.
inline constexpr float kUnknownColor = -1;

/// Gives faces the mean colour of their points, in steps of 4/255, as other formats' readers do.
/// `colors`: 3 components in [0, 1] per point, kUnknownColor for points without colour; may be
/// empty.
void color_faces(ObjScan& scan, std::span<const float> colors);

/// Scans a whole OBJ. Errors: kInput, up to 20 at once. `file` is the name used in messages.
Result<ObjScan> scan_obj(std::string_view bytes, const std::string& file);

}  // namespace polymorph
