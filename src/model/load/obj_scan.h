// Strict OBJ scanner in front of tinyobjloader, which accepts almost anything in silence: bad
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
  std::uint32_t label = 0;     ///< index into ObjScan::labels
  std::int32_t material = -1;  ///< index into ObjScan::materials, -1 = none named
};

/// A name and the line that gave it first.
struct NamedLine {
  std::string name;
  std::uint32_t line = 0;
};

/// What the scan found, in file order.
struct ObjScan {
  /// v, vt, vn and f lines only, numbers in shortest form, indices absolute and in range: what
  /// tinyobjloader is given. Face k of it is faces[k].
  std::string text;
  std::vector<ObjFace> faces;
  std::vector<std::string>
      labels;  ///< group names (object names where there is no group) that have faces
  std::vector<NamedLine> materials;   ///< usemtl names that have faces, as written
  std::vector<NamedLine> libraries;   ///< mtllib lines: the whole rest of the line
  std::vector<std::string> warnings;  ///< "FILE:LINE: ..."
  std::uint32_t points = 0;           ///< v lines
};

/// Scans a whole OBJ. Errors: kInput, up to 20 at once. `file` is the name used in messages.
Result<ObjScan> scan_obj(std::string_view bytes, const std::string& file);

}  // namespace polymorph
