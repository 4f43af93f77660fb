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
/// "radius": ..}, ...]}. "center", "a" and "w" are members of Ball (kernels/types.h); "radius" is
/// the radius of the surface that the ball has alone. A ball that is not round also has its "shape"
/// [xx, yy, zz, xy, xz, yz].
std::string encode_balls(const std::vector<Ball>& balls, FieldKind kind);

/// Encodes balls as a table with the columns x,y,z,a,w,radius,xx,yy,zz,xy,xz,yz.
std::string encode_balls_csv(const std::vector<Ball>& balls, FieldKind kind);

/// Content of a file in the format of encode_balls(). "field" (default: gaussian), "a" (default: 1)
/// and "shape" (default: round) are optional; "radius" is ignored.
struct BallFile {
  FieldKind kind = FieldKind::kGaussian;
  std::vector<Ball> balls;
};
/// Reads a file of balls. Errors (kInput): another format; a number that is not finite; an "a" that
/// is not above 0.
Result<BallFile> read_balls(const std::filesystem::path& path);
/// Decodes the text of a file of balls. `name`: name of the file in messages. Errors: as
/// read_balls().
Result<BallFile> decode_balls(std::string_view text, const std::string& name);

}  // namespace polymorph
