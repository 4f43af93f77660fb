#include "kernels/mc_tables.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>
#include <utility>
#include <vector>

namespace polymorph {
namespace {

using Segment = std::pair<int, int>;

/// Directed edges of a case's triangles that no other triangle of the case runs backwards.
std::vector<Segment> border_segments(int key) {
  const McTable& table = mc_table();
  std::multiset<Segment> directed;
  for (int t = 0; t < table.count[key]; ++t) {
    for (int k = 0; k < 3; ++k) {
      directed.insert({table.edges[key][3 * t + k], table.edges[key][3 * t + (k + 1) % 3]});
    }
  }
  std::vector<Segment> border;
  for (const Segment& s : directed) {
    EXPECT_EQ(directed.count(s), 1u) << "key " << key;
    if (directed.count({s.second, s.first}) == 0) border.push_back(s);
  }
  return border;
}

bool in_face(const Segment& s, int face) {
  return mc::on_face(s.first, face) && mc::on_face(s.second, face);
}

TEST(McTables, every_key_is_reached_from_the_15_base_cases_and_can_be_cut) {
  bool ok = false;
  mc::build_table(ok);
  EXPECT_TRUE(ok);
}

TEST(McTables, weights_are_those_of_figure_5_6) {
  EXPECT_EQ(corner_weight(0), 128);
  EXPECT_EQ(corner_weight(7), 1);
  const bool first_four[8] = {true, true, true, true, false, false, false, false};
  EXPECT_EQ(voxel_key(first_four), 240);  // the example of Fig. 5.12
}

TEST(McTables, uses_exactly_the_crossed_edges) {
  for (int key = 0; key < 256; ++key) {
    std::set<int> used, crossed;
    for (int i = 0; i < 3 * mc_table().count[key]; ++i) used.insert(mc_table().edges[key][i]);
    for (int e = 0; e < 12; ++e) {
      if (key_has(key, edge_low_corner(e)) != key_has(key, edge_high_corner(e))) crossed.insert(e);
    }
    EXPECT_EQ(used, crossed) << "key " << key;
    EXPECT_LE(mc_table().count[key], kMaxCaseTriangles);
  }
}

TEST(McTables, polygons_are_closed_but_for_segments_on_faces) {
  for (int key = 0; key < 256; ++key) {
    std::map<int, int> balance;
    for (const Segment& s : border_segments(key)) {
      int faces = 0;
      for (int f = 0; f < 6; ++f) faces += in_face(s, f) ? 1 : 0;
      EXPECT_EQ(faces, 1) << "key " << key << " segment " << s.first << "-" << s.second;
      ++balance[s.first];
      --balance[s.second];
    }
    for (const auto& [edge, sum] : balance) EXPECT_EQ(sum, 0) << "key " << key << " edge " << edge;
  }
}

TEST(McTables, no_diagonal_lies_in_a_face) {
  for (int key = 0; key < 256; ++key) {
    const std::vector<Segment> border = border_segments(key);
    for (int t = 0; t < mc_table().count[key]; ++t) {
      for (int k = 0; k < 3; ++k) {
        const Segment s = {mc_table().edges[key][3 * t + k],
                           mc_table().edges[key][3 * t + (k + 1) % 3]};
        const bool on_border = std::find(border.begin(), border.end(), s) != border.end();
        EXPECT_EQ(on_border, mc::share_face(s.first, s.second)) << "key " << key;
      }
    }
  }
}

/// Walks all pairs of neighbours along an axis: the upper cell's corners on the shared face are the
/// lower cell's; the other eight corners are free.
TEST(McTables, neighbours_draw_the_same_segments_in_opposite_directions) {
  int pairs = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const int bit = 1 << axis;
    const int upper_face = 2 * axis + 1, lower_face = 2 * axis;
    for (int a = 0; a < 256; ++a) {
      std::set<Segment> drawn;
      for (const Segment& s : border_segments(a)) {
        if (in_face(s, upper_face)) drawn.insert(s);
      }
      for (int b = 0; b < 256; ++b) {
        bool fits = true;
        for (int c = 0; c < 8; ++c)
          fits = fits && ((c & bit) || key_has(a, c | bit) == key_has(b, c));
        if (!fits) continue;
        ++pairs;
        std::set<Segment> answered;
        for (const Segment& s : border_segments(b)) {
          if (!in_face(s, lower_face)) continue;
          const auto shifted = [bit](int e) {
            return mc::edge_between(edge_low_corner(e) | bit, edge_high_corner(e) | bit);
          };
          answered.insert({shifted(s.second), shifted(s.first)});
        }
        ASSERT_EQ(drawn, answered) << "axis " << axis << " keys " << a << " " << b;
      }
    }
  }
  EXPECT_EQ(pairs, 3 * 256 * 16);
}

TEST(McTables, rotating_the_corners_rotates_the_segments) {
  for (int r = 0; r < 24; ++r) {
    const std::array<int, 8> to = mc::rotation(r);
    for (int key = 0; key < 256; ++key) {
      std::set<Segment> rotated, expected;
      const auto turned = [&to](int e) {
        return mc::edge_between(to[edge_low_corner(e)], to[edge_high_corner(e)]);
      };
      for (const Segment& s : border_segments(key))
        rotated.insert({turned(s.first), turned(s.second)});
      for (const Segment& s : border_segments(mc::rotated_key(key, to))) expected.insert(s);
      ASSERT_EQ(rotated, expected) << "rotation " << r << " key " << key;
    }
  }
}

TEST(McTables, rotations_are_24_different_proper_ones) {
  std::set<std::array<int, 8>> all;
  for (int r = 0; r < 24; ++r) {
    const std::array<int, 8> to = mc::rotation(r);
    all.insert(to);
    // Corner 0 sees its neighbours x, y, z turn the same way round after a proper rotation.
    int image[3][3];
    for (int axis = 0; axis < 3; ++axis) {
      for (int k = 0; k < 3; ++k) image[axis][k] = (to[1 << axis] >> k & 1) - (to[0] >> k & 1);
    }
    const auto& m = image;
    const int determinant = m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) -
                            m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
                            m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
    EXPECT_EQ(determinant, 1);
  }
  EXPECT_EQ(all.size(), 24u);
}

TEST(McTables, complement_reverses_the_segments_unless_a_face_is_ambiguous) {
  int ambiguous = 0;
  for (int key = 0; key < 256; ++key) {
    std::set<Segment> reversed, expected;
    for (const Segment& s : border_segments(key)) reversed.insert({s.second, s.first});
    for (const Segment& s : border_segments(255 - key)) expected.insert(s);
    if (mc::has_ambiguous_face(key)) {
      ++ambiguous;
      EXPECT_NE(reversed, expected) << "key " << key;
    } else {
      EXPECT_EQ(reversed, expected) << "key " << key;
    }
  }
  EXPECT_EQ(ambiguous % 2, 0);
  EXPECT_GT(ambiguous, 0);
}

TEST(McTables, a_lone_inside_corner_faces_outward) {
  // Corner 0: edges 0 (x), 4 (y), 8 (z) in the order that turns around (1, 1, 1).
  const int key = corner_weight(0);
  ASSERT_EQ(mc_table().count[key], 1);
  std::array<int, 3> edges = {mc_table().edges[key][0], mc_table().edges[key][1],
                              mc_table().edges[key][2]};
  std::rotate(edges.begin(), std::min_element(edges.begin(), edges.end()), edges.end());
  EXPECT_EQ(edges, (std::array<int, 3>{0, 4, 8}));
}

}  // namespace
}  // namespace polymorph
