// Strict OBJ scanner that runs before tinyobjloader, which silently accepts almost anything: bad
// numbers become 0, indices wrap or stay out of range, 256 corners become 0, directories are empty
// models.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace polymorph {

struct ObjFace {
  std::uint32_t corners = 0;
  std::uint32_t line = 0;
  std::uint32_t label = 0;        ///< index into ObjScan::labels
  std::int32_t material = -1;     ///< index into ObjScan::materials, -1 = none
  std::int32_t color = kNoColor;  ///< 0xRRGGBB in sRGB: mean of its points' colours, in steps of 4
  static constexpr std::int32_t kNoColor = -1;
};

/// A name and the line of its first use.
struct NamedLine {
  std::string name;
  std::uint32_t line = 0;
};

/// Contents of an OBJ file, in file order.
struct ObjScan {
  /// Input for tinyobjloader: v, vt, vn and f lines only, with numbers in shortest form and indices
  /// absolute and in range. Its face k is faces[k].
  std::string text;
  std::vector<ObjFace> faces;
  std::vector<std::string>
      labels;  ///< names of groups (or of objects, where there is no group) that have faces
  std::vector<NamedLine> materials;   ///< usemtl names that have faces, as written
  std::vector<NamedLine> libraries;   ///< mtllib lines without the keyword
  std::vector<std::string> warnings;  ///< "FILE:LINE: ..."
  std::uint32_t points = 0;           ///< number of v lines
};

/// Scans a whole OBJ. Errors: kInput, up to 20 at once. `file` is the name used in messages.
Result<ObjScan> scan_obj(std::string_view bytes, const std::string& file);

}  // namespace polymorph
