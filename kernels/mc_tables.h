// Marching cubes case table: the 256 cases, generated from the report's 15 base cases (5.1.4, Fig.
// 5.7) by rotation and complement, with one rule for ambiguous faces.
//
// Corner i of a cell is at (i & 1, i >> 1 & 1, i >> 2 & 1) and weighs 128 >> i in the voxel key:
// V1..V8 of Fig. 5.6 weigh 128..1. A corner counts when it is inside (field > iso). Edge e runs
// along axis e / 4 from its lower corner; edges 0-3 along x, 4-7 along y, 8-11 along z.
//
// The rule: on a face whose inside corners are two opposite ones, these are kept apart (the outside
// is joined). The rule depends on that face's four corners alone, so the two cells at a face draw
// the same segments there, in opposite directions. Lorensen and Cline's complement (1987) breaks
// this: there the complement of a case with an ambiguous face leaves holes at its neighbours, so
// here such a complement has loops of its own.
//
// Triangles never use a diagonal between two edges of one face. Hence an edge of the mesh that lies
// in a face of a cell is one of the rule's segments and has exactly two triangles; and three
// vertices of a triangle are never on one face, so they are never collinear (a line that is not in
// a face meets a cube's surface at most twice): no triangle has zero area as long as vertices keep
// away from the corners.
#pragma once

#include <array>
#include <cstdint>

#include "host_device.h"

namespace polymorph {

constexpr int kMaxCaseTriangles = 5;

/// Triangles of each key as triples of edges, counter-clockwise seen from outside.
struct McTable {
  std::uint8_t edges[256][16] = {};
  std::uint8_t count[256] = {};  ///< triangles
};

PM_HD constexpr int corner_weight(int corner) { return 128 >> corner; }

/// The key of a cell from its inside flags, corner 0 first (Algorithm 5.2).
PM_HD constexpr int voxel_key(const bool (&inside)[8]) {
  int key = 0;
  for (int i = 0; i < 8; ++i) key += inside[i] ? corner_weight(i) : 0;
  return key;
}
PM_HD constexpr bool key_has(int key, int corner) { return (key & corner_weight(corner)) != 0; }

PM_HD constexpr int edge_axis(int edge) { return edge / 4; }
/// The corner of `edge` with the lower coordinate; the other one is this + (1 << axis).
PM_HD constexpr int edge_low_corner(int edge) {
  const int axis = edge / 4, j = edge % 4;
  return axis == 0 ? 2 * j : axis == 1 ? (j & 1) + 4 * (j >> 1) : j;
}
PM_HD constexpr int edge_high_corner(int edge) {
  return edge_low_corner(edge) + (1 << edge_axis(edge));
}

namespace mc {

/// Corners of each face, counter-clockwise seen from outside the cell: -x +x -y +y -z +z.
constexpr int kFaces[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                              {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};

/// Inside corners of the 15 base cases; 255 ends a list.
constexpr int kBaseCaseCount = 15;
constexpr int kBaseCases[kBaseCaseCount][5] = {{255},
                                               {0, 255},
                                               {0, 1, 255},
                                               {0, 3, 255},
                                               {0, 7, 255},
                                               {0, 1, 2, 255},
                                               {0, 1, 7, 255},
                                               {0, 3, 5, 255},
                                               {0, 1, 2, 3, 255},
                                               {0, 1, 2, 4, 255},
                                               {0, 1, 6, 7, 255},
                                               {0, 1, 3, 7, 255},
                                               {0, 1, 2, 7, 255},
                                               {0, 3, 5, 6, 255},
                                               {0, 2, 3, 7, 255}};

inline int edge_between(int a, int b) {
  const int low = a < b ? a : b, high = a < b ? b : a;
  for (int e = 0; e < 12; ++e) {
    if (edge_low_corner(e) == low && edge_high_corner(e) == high) return e;
  }
  return -1;
}

inline bool on_face(int edge, int face) {
  int ends = 0;
  for (int corner : kFaces[face]) {
    ends += corner == edge_low_corner(edge) || corner == edge_high_corner(edge) ? 1 : 0;
  }
  return ends == 2;
}

inline bool share_face(int edge_a, int edge_b) {
  for (int f = 0; f < 6; ++f) {
    if (on_face(edge_a, f) && on_face(edge_b, f)) return true;
  }
  return false;
}

/// Applies the rule: returns next[a] = b for each segment a -> b that the surface of `key` draws on
/// the cell's faces, and -1 where no segment starts. On each face, one segment separates each run
/// of inside corners from the other corners.
inline std::array<int, 12> face_segments(int key) {
  std::array<int, 12> next;
  next.fill(-1);
  for (const auto& face : kFaces) {
    for (int k = 0; k < 4; ++k) {
      if (key_has(key, face[k]) || !key_has(key, face[(k + 1) % 4])) continue;
      int last = (k + 1) % 4;  // last corner of the run of inside corners that begins here
      while (key_has(key, face[(last + 1) % 4])) last = (last + 1) % 4;
      next[edge_between(face[k], face[(k + 1) % 4])] =
          edge_between(face[last], face[(last + 1) % 4]);
    }
  }
  return next;
}

struct Triangles {
  int count = 0;  ///< number of edges, 3 per triangle
  int edges[16] = {};
};

/// Squared length of the diagonal between the middles of two edges, times 4.
inline int diagonal_length2(int a, int b) {
  int sum = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const auto twice_middle = [axis](int e) {
      return (edge_low_corner(e) >> axis & 1) + (edge_high_corner(e) >> axis & 1);
    };
    sum += (twice_middle(a) - twice_middle(b)) * (twice_middle(a) - twice_middle(b));
  }
  return sum;
}

/// Cuts a loop into triangles without a diagonal in a face, so that the sum of the diagonals'
/// squared lengths is smallest. Returns false if there is no such cut; a test shows that all 256
/// cases have one.
inline bool triangulate(const int* loop, int n, Triangles& out) {
  constexpr int kForbidden = 1000000;  // more than the cost of any permitted cut
  // Dynamic programming: cost[i][j] is the smallest cost of the polygon loop[i], ..., loop[j], and
  // middle[i][j] is the third corner of its triangle on the side from i to j.
  int cost[12][12] = {}, middle[12][12] = {};
  for (int width = 2; width < n; ++width) {
    for (int i = 0; i + width < n; ++i) {
      const int j = i + width;
      cost[i][j] = kForbidden;
      for (int k = i + 1; k < j; ++k) {
        const int sum = cost[i][k] + cost[k][j];
        if (sum < cost[i][j]) cost[i][j] = sum, middle[i][j] = k;
      }
      if (width == n - 1) continue;  // closes the loop: a segment, not a diagonal
      cost[i][j] += share_face(loop[i], loop[j]) ? kForbidden : diagonal_length2(loop[i], loop[j]);
    }
  }
  // Collects the triangles of the best cut; the stack holds the polygons that are still to be cut.
  int stack[24][2] = {{0, n - 1}};
  for (int size = 1; size > 0;) {
    --size;
    const int i = stack[size][0], j = stack[size][1];
    if (j - i < 2) continue;
    const int k = middle[i][j];
    for (int v : {i, k, j}) out.edges[out.count++] = loop[v];
    stack[size][0] = i, stack[size++][1] = k;
    stack[size][0] = k, stack[size++][1] = j;
  }
  return cost[0][n - 1] < kForbidden;
}

/// Returns the triangles of one key, made from its loops. Sets `ok` to false if triangulate()
/// fails.
inline Triangles case_triangles(int key, bool& ok) {
  std::array<int, 12> next = face_segments(key);
  Triangles out;
  for (int start = 0; start < 12; ++start) {
    int loop[12];
    int n = 0;
    for (int e = start; next[e] >= 0;) {
      loop[n++] = e;
      const int following = next[e];
      next[e] = -1;
      e = following;
    }
    if (n > 0) ok = triangulate(loop, n, out) && ok;
  }
  return out;
}

/// Returns the image of each corner under rotation r of 24: axes are permuted and flipped, with
/// determinant +1.
inline std::array<int, 8> rotation(int r) {
  constexpr int kAxes[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}};
  const int* axes = kAxes[r / 4];
  const int odd = r / 12;        // the last three permutations are reflections and need an odd flip
  const int free_flips = r % 4;  // two free flips; the third makes the determinant +1
  const int flips[3] = {free_flips & 1, free_flips >> 1,
                        ((free_flips & 1) ^ (free_flips >> 1) ^ odd) & 1};
  std::array<int, 8> to{};
  for (int c = 0; c < 8; ++c) {
    for (int axis = 0; axis < 3; ++axis) to[c] |= ((c >> axes[axis] & 1) ^ flips[axis]) << axis;
  }
  return to;
}

inline int rotated_key(int key, const std::array<int, 8>& to) {
  int out = 0;
  for (int c = 0; c < 8; ++c) out |= key_has(key, c) ? corner_weight(to[c]) : 0;
  return out;
}

inline bool has_ambiguous_face(int key) {
  for (const auto& face : kFaces) {
    const bool a = key_has(key, face[0]), b = key_has(key, face[1]);
    if (a != b && a == key_has(key, face[2]) && b == key_has(key, face[3])) return true;
  }
  return false;
}

inline Triangles reversed(const Triangles& t) {
  Triangles out = t;
  for (int i = 0; i + 2 < 16; i += 3)
    out.edges[i + 1] = t.edges[i + 2], out.edges[i + 2] = t.edges[i + 1];
  return out;
}

/// Sets the triangles of all rotations of a key that are not known yet, from those of the key.
inline void copy_to_rotations(int key, const Triangles& triangles, std::array<bool, 256>& known,
                              McTable& table) {
  for (int r = 0; r < 24; ++r) {
    const std::array<int, 8> to = rotation(r);
    const int target = rotated_key(key, to);
    if (known[target]) continue;
    known[target] = true;
    table.count[target] = static_cast<std::uint8_t>(triangles.count / 3);
    for (int i = 0; i < triangles.count; ++i) {
      const int e = triangles.edges[i];
      table.edges[target][i] =
          static_cast<std::uint8_t>(edge_between(to[edge_low_corner(e)], to[edge_high_corner(e)]));
    }
  }
}

inline int base_key(int base) {
  int key = 0;
  for (int i = 0; kBaseCases[base][i] != 255; ++i) key |= corner_weight(kBaseCases[base][i]);
  return key;
}

/// Returns the index of each key's base case, whose rotation or complement the key is.
inline std::array<std::uint8_t, 256> base_cases() {
  std::array<std::uint8_t, 256> bases{};
  // The loop goes backwards, so that each key gets the first base case that yields it, as in
  // build_table().
  for (int base = kBaseCaseCount - 1; base >= 0; --base) {
    for (int r = 0; r < 24; ++r) {
      const int key = rotated_key(base_key(base), rotation(r));
      bases[static_cast<std::size_t>(key)] = bases[static_cast<std::size_t>(255 - key)] =
          static_cast<std::uint8_t>(base);
    }
  }
  return bases;
}

/// Builds the table. `ok` becomes whether all 256 keys were reached and triangulated, which a test
/// checks; other code calls mc_table().
inline McTable build_table(bool& ok) {
  McTable table;
  std::array<bool, 256> known{};
  ok = true;
  for (int case_index = 0; case_index < kBaseCaseCount; ++case_index) {
    const int key = base_key(case_index);
    const Triangles base = case_triangles(key, ok);
    copy_to_rotations(key, base, known, table);
    copy_to_rotations(255 - key,
                      has_ambiguous_face(key) ? case_triangles(255 - key, ok) : reversed(base),
                      known, table);
  }
  for (bool k : known) ok = ok && k;
  return table;
}

}  // namespace mc

/// Returns the table, which is built on first use.
inline const McTable& mc_table() {
  static const McTable table = [] {
    bool ok = true;
    return mc::build_table(ok);
  }();
  return table;
}

/// Number of edges that start on a line of eight points. The edge of point x along `axis` has the
/// slot 3 x + axis.
constexpr int kLineSlots = 24;

/// The table as the passes read it. Unlike the voxel key, its index has the inside flag of corner i
/// in bit i. An edge is given by its slot, relative to the first slot of the cell's lowest corner.
/// Lines of slots are in the order of the 8 x 8 lines of a brick, y fastest.
struct BrickTable {
  std::uint8_t slots[256][16] = {};
  /// The slots as numbers of 5 bits: 8 times the index of one of the cell's four lines, plus the
  /// slot within that line, which is below 6.
  std::uint8_t lanes[256][16] = {};
  std::uint8_t count[256] = {};  ///< triangles
};

inline const BrickTable& brick_table() {
  static const BrickTable table = [] {
    BrickTable out;
    for (int corners = 0; corners < 256; ++corners) {
      int key = 0;
      for (int c = 0; c < 8; ++c) key |= (corners >> c & 1) != 0 ? corner_weight(c) : 0;
      out.count[corners] = mc_table().count[key];
      for (int i = 0; i < 3 * out.count[corners]; ++i) {
        const int e = mc_table().edges[key][i], c = edge_low_corner(e);
        const int line = (c >> 1 & 1) + 8 * (c >> 2);
        const int slot = 3 * (c & 1) + edge_axis(e);
        out.slots[corners][i] = static_cast<std::uint8_t>(kLineSlots * line + slot);
        out.lanes[corners][i] = static_cast<std::uint8_t>(8 * (c >> 1) + slot);
      }
    }
    return out;
  }();
  return table;
}

}  // namespace polymorph
