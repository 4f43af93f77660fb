// Cubes with true points (analyze/true_points.h), for tests of measures that use such points.
#pragma once

#include <fmt/format.h>

#include <string>

namespace polymorph {

/// Returns the cube [0, size]^3 as OBJ text. `turned`: rotated by 90 degrees about y and shifted,
/// with the vertices in the same order.
inline std::string cube_obj(int size, bool turned = false) {
  std::string text;
  for (int i = 0; i < 8; ++i) {
    const int x = i & 1 ? size : 0, y = i & 2 ? size : 0, z = i & 4 ? size : 0;
    text += turned ? fmt::format("v {} {} {}\n", z + 5, y, 7 - x)
                   : fmt::format("v {} {} {}\n", x, y, z);
  }
  return text + "f 1 5 7 3\nf 2 4 8 6\nf 1 2 6 5\nf 3 7 8 4\nf 1 3 4 2\nf 5 6 8 7\n";
}

/// Returns true points on the sides of the cubes a.obj (size 1) and b.obj (size 2), each in its own
/// coordinates. `left`, `right`: names of b.obj's points at x = -0.1 and x = 2.
inline std::string truth_json(const std::string& left, const std::string& right) {
  return fmt::format(
      R"({{"models": {{
  "a": {{"model": "a.obj", "points": {{"left": [0, 0.5, 0.5], "right": [1, 0.5, 0.5],
                                     "top": [0.5, 1, 0.5], "foot": [0.5, 0, 0.5]}}}},
  "b": {{"model": "b.obj", "points": {{"{}": [-0.1, 1, 1], "{}": [2, 1, 1],
                                     "top": [1, 2, 1], "foot": [1, 0, 1], "tail": [0, 0, 0]}}}}}},
 "pairs": [["a", "b"]]}})",
      left, right);
}

}  // namespace polymorph
