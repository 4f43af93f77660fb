// Files of balls: JSON and CSV tables.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "kernels/types.h"

namespace polymorph {

/// Encodes balls as {"field": "gaussian", "balls": [{"center": [x, y, z], "a": .., "w": ..,
/// "radius": ..}, ...]}.
std::string encode_balls(const std::vector<Ball>& balls, FieldKind kind);

/// Encodes balls as a table: x,y,z,a,w,radius and the six numbers of the shape.
std::string encode_balls_csv(const std::vector<Ball>& balls, FieldKind kind);

/// Content of a file in the format of encode_balls(). "field" is optional (gaussian), and so are
/// "a" (1) and "radius"; a ball may have a "shape" [xx, yy, zz, xy, xz, yz].
struct BallFile {
  FieldKind kind = FieldKind::kGaussian;
  std::vector<Ball> balls;
};
/// Reads a file of balls. Errors (kInput): another format; a ball that is not finite or has no
/// size.
Result<BallFile> read_balls(const std::filesystem::path& path);
/// Decodes the text of such a file; `name` is used in messages.
Result<BallFile> decode_balls(std::string_view text, const std::string& name);

}  // namespace polymorph
