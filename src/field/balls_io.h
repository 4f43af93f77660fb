// Balls as files: JSON and tables.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "kernels/types.h"

namespace polymorph {

/// {"field": "gaussian", "balls": [{"center": [x, y, z], "a": .., "w": .., "radius": ..}, ...]}.
std::string encode_balls(const std::vector<Ball>& balls, FieldKind kind);

/// The same as a table: x,y,z,a,w,radius and the six numbers of the shape.
std::string encode_balls_csv(const std::vector<Ball>& balls, FieldKind kind);

/// What encode_balls() writes. "field" may be missing (gaussian), and so may "a" (1) and "radius";
/// a ball may have a "shape" [xx, yy, zz, xy, xz, yz]. Errors (kInput): not such a file, or a
/// ball that is not finite or has no size.
struct BallFile {
  FieldKind kind = FieldKind::kGaussian;
  std::vector<Ball> balls;
};
Result<BallFile> read_balls(const std::filesystem::path& path);
/// The same for what is in no file; `name` is for messages.
Result<BallFile> decode_balls(std::string_view text, const std::string& name);

}  // namespace polymorph
