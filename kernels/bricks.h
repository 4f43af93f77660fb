// Field sampling and counting of one brick of the grid (marching cubes, first pass): the field at
// the 8^3 points of a brick, the edges that the surface crosses, and the number of triangles of its
// cells.
//
// A row is seven cells of a brick along x, from point (0, y, z) on, with the 21 edges whose lower
// corner is one of the row's first seven points. So every cell and every edge belongs to exactly
// one row. Vertices and triangles are numbered by brick, within a brick by row, and within a row
// along x.
#pragma once

#include <cstdint>
#include <cstring>
#include <type_traits>

#include "field.h"
#include "host_device.h"
#include "mc_tables.h"
#include "tree.h"
#include "types.h"
#include "view.h"

namespace polymorph {

constexpr int kBrickValues = kBrickPoints * kBrickPoints * kBrickPoints;
constexpr int kLines = kBrickPoints * kBrickPoints;  ///< lines of points along x, per brick
constexpr int kRows = kBrickCells * kBrickCells;     ///< rows of cells, per brick
constexpr int kRowEdges = 3 * kBrickCells;           ///< edge `axis` of point x is bit 3 x + axis
constexpr int kMaxVertices = kRows * kRowEdges;      ///< per brick

/// True if two threads of a team share each point of a Field or each box of its bounds. A CPU's
/// thread is a team of its own.
template <class Team, class FieldOrBounds>
constexpr bool kHalves = FieldOrBounds::kHasHalves && (Team::kGroup > 1);

/// Packs the crossed edges of a row (low 21 bits) and the number of the brick's vertices before it.
PM_HD constexpr std::uint32_t packed_row(std::uint32_t edges, std::uint32_t before) {
  return edges | before << kRowEdges;
}
PM_HD constexpr std::uint32_t row_edges(std::uint32_t row) { return row & ((1u << kRowEdges) - 1); }
PM_HD constexpr std::uint32_t vertices_before(std::uint32_t row) { return row >> kRowEdges; }

/// Returns the line of points with the lowest y and z of row r.
PM_HD constexpr int line_of_row(int r) {
  return r % kBrickCells + kBrickPoints * (r / kBrickCells);
}

/// Moves bit x of a to bit 3 x, for x < 8.
PM_HD inline std::uint32_t spread_by_three(std::uint32_t a) {
#if defined(__BMI2__) && !defined(__CUDACC__)
  return _pdep_u32(a, 0x00249249u);
#endif
  a = (a | a << 8) & 0x0000f00fu;
  a = (a | a << 4) & 0x000c30c3u;
  return (a | a << 2) & 0x00249249u;
}

/// Returns the crossed edges of a row from the inside flags (bit x) of three lines of points: the
/// row's first, the next one along y and the next one along z.
PM_HD inline std::uint32_t crossed_edges(std::uint32_t line, std::uint32_t next_y,
                                         std::uint32_t next_z) {
  constexpr std::uint32_t kCells = (1u << kBrickCells) - 1;
  return spread_by_three((line ^ line >> 1) & kCells) |
         spread_by_three((line ^ next_y) & kCells) << 1 |
         spread_by_three((line ^ next_z) & kCells) << 2;
}

/// Inside flags around the cells of an item: one row or, with kPlane, all rows of the same z. A
/// thread that has a brick to itself handles a plane as one word, with the cell at (x, y) in bit
/// x + 8 y.
template <bool kPlane>
struct CellFlags {
  using Word = std::conditional_t<kPlane, std::uint64_t, std::uint32_t>;
  static constexpr int kItems = kPlane ? kBrickCells : kRows;  ///< per brick
  /// A bit for each cell of the item: 7 x 7 with kPlane, else 7.
  static constexpr Word kCells = static_cast<Word>(kPlane ? 0x007f7f7f7f7f7f7full : 0x7full);
  Word line[4] = {};  ///< inside bits at (y, z), (y + 1, z), (y, z + 1), (y + 1, z + 1)

  PM_HD CellFlags(const std::uint8_t* inside, int item) {
    const int at = first_line(item);
    if constexpr (kPlane) {
      std::memcpy(line, inside + at, sizeof(Word));
      std::memcpy(line + 2, inside + at + kBrickPoints, sizeof(Word));
      line[1] = line[0] >> kBrickPoints, line[3] = line[2] >> kBrickPoints;
    } else {
      line[0] = inside[at], line[1] = inside[at + 1];
      line[2] = inside[at + kBrickPoints], line[3] = inside[at + kBrickPoints + 1];
    }
  }
  /// Returns the line of points with the lowest y and z of the item.
  PM_HD static int first_line(int item) { return kPlane ? kBrickPoints * item : line_of_row(item); }
  /// Returns a bit for each cell that has corners inside and outside.
  PM_HD Word mixed_cells() const {
    const Word any = line[0] | line[1] | line[2] | line[3];
    const Word all = line[0] & line[1] & line[2] & line[3];
    return (any | any >> 1) & ~(all & all >> 1) & kCells;
  }
  /// Returns the inside flags of a cell's corners, corner i in bit i.
  PM_HD int corners(int cell) const {
    return static_cast<int>((line[0] >> cell & 3u) | (line[1] >> cell & 3u) << 2 |
                            (line[2] >> cell & 3u) << 4 | (line[3] >> cell & 3u) << 6);
  }
  /// Returns the number of triangles in the item's cells.
  PM_HD std::uint32_t triangles(const BrickTable& table) const {
    std::uint32_t count = 0;
    for (Word cells = mixed_cells(); cells != 0; cells &= cells - 1) {
      count += table.count[corners(countr_zero(cells))];
    }
    return count;
  }
};
/// CellFlags by planes for a team of one thread, by rows for others.
template <class Team>
using TeamCells = CellFlags<Team::kGroup == 1>;

/// u (falloff.h) and separable_factor() of one ball along each axis, at the eight coordinates of a
/// brick's points.
struct AxisTables {
  alignas(64) float u[3][kBrickPoints], factor[3][kBrickPoints];
  float base, limit;  ///< RoundBall::base and limit

  /// Fills as many entries of an axis as V has lanes, from index `at` on. `first`: the brick's
  /// first grid point.
  template <class V>
  PM_HD void fill(const RoundBall& ball, const Grid& grid, Int3 first, int axis, int at) {
    const int first_index = axis == 0 ? first.x : axis == 1 ? first.y : first.z;
    const float origin = axis == 0 ? grid.origin.x : axis == 1 ? grid.origin.y : grid.origin.z;
    const float center = axis == 0 ? ball.x : axis == 1 ? ball.y : ball.z;
    const V p = origin + grid.cell * (Lanes<V>::iota() + static_cast<float>(first_index + at));
    const V u_at = ball.scale * (p - center);
    Lanes<V>::store(u[axis] + at, u_at);
    Lanes<V>::store(
        factor[axis] + at,
        separable_factor(axis == 0 ? fma(u_at, u_at, broadcast<V>(ball.base)) : u_at * u_at));
    if (axis == 0 && at == 0) base = ball.base, limit = ball.limit;
  }
};
/// AxisTables of one ball with the terms in y and z combined, one lane per line of points.
struct LineTables {
  float u[kBrickPoints], factor[kBrickPoints];  ///< along x
  float limit;
  /// q without its term in x, and the product of the factors along y and z.
  alignas(64) float q[kLines], product[kLines];
};
constexpr int kBallsPerBatch = 32;  ///< balls whose tables exist at the same time
/// Maximum number of coarse points around a brick: 6^3 with the least
/// ExtractSettings::sample_stride above 1, which is 2, rounded up to whole packs.
constexpr int kMaxCoarse = 224;
/// Vertices and triangles of the square across a crossed edge (cubes.h).
constexpr int kFaceVertices = 4, kFaceTriangles = 2;

/// The common base of passes that sample bricks: derives inside flags, crossed edges and counts
/// from the values at a brick's points.
struct CountBricks {
  struct Scratch {
    alignas(64) float values[kBrickValues];
    std::uint8_t inside[kLines];
    std::uint32_t vertices[kRows + 1], triangles[kRows + 1], edges[kRows];
  };
  Grid grid;
  float iso = 1;
  float outside = 0;       ///< the value of points beyond the grid
  bool faces = false;      ///< counts the squares of EmitCubes instead of marching cubes
  std::int64_t begin = 0;  ///< the brick of item 0
  View<const BrickTable> table;
  View<const Node> bricks;
  View<float> values;         ///< kBrickValues per item
  View<std::uint8_t> inside;  ///< per line: bit x is point x
  View<std::uint32_t> rows;   ///< packed_row() of each row
  View<Counts> counts;        ///< per brick: vertices, triangles

  /// Returns the grid point with a brick's lowest coordinates; -1 is on the rim (tree.h).
  PM_HD static Int3 first_point(const Node& brick) {
    return {brick.at.x * kBrickCells - 1, brick.at.y * kBrickCells - 1,
            brick.at.z * kBrickCells - 1};
  }

  /// Counts vertices and triangles from `scratch.values`, and stores what later passes need.
  template <class Team>
  PM_HD void count(const Team& team, Scratch& scratch, std::int64_t item, Int3 first) const {
    flag_inside(team, scratch, first);
    count_flagged(team, scratch, item);
  }
  /// Sets all points that are not on the grid to `outside`, and finds the inside flags of all.
  template <class Team>
  PM_HD void flag_inside(const Team& team, Scratch& scratch, Int3 first) const {
    fill_beyond_grid(team, first, scratch.values);
    team.each(kLines, [&](int line) {
      scratch.inside[line] =
          static_cast<std::uint8_t>(inside_bits<typename Lanes<typename Team::V>::Half>(
              scratch.values + kBrickPoints * line));
    });
    team.sync();
  }
  /// Does what count() does from the flags on.
  template <class Team>
  PM_HD void count_flagged(const Team& team, Scratch& scratch, std::int64_t item) const {
    using V = typename Team::V;
    const std::int64_t b = begin + item;
    team.each(kRows, [&](int r) {
      const std::uint8_t* line = scratch.inside + line_of_row(r);
      scratch.edges[r] = crossed_edges(line[0], line[1], line[kBrickPoints]);
      scratch.vertices[r] = static_cast<std::uint32_t>(popcount(scratch.edges[r]));
    });
    using Cells = TeamCells<Team>;
    team.each(Cells::kItems,
              [&](int i) { scratch.triangles[i] = Cells(scratch.inside, i).triangles(table[0]); });
    team.sync();
    const std::uint32_t vertex_count = team.scan(scratch.vertices, kRows);
    const std::uint32_t triangle_count = team.scan(scratch.triangles, Cells::kItems);
    team.each(1, [&](int) {
      counts[b] = faces ? Counts{kFaceVertices * vertex_count, kFaceTriangles * vertex_count}
                        : Counts{vertex_count, triangle_count};
    });
    if (vertex_count == 0 && triangle_count == 0) return;
    team.each(kRows, [&](int r) {
      rows[b * kRows + r] = packed_row(scratch.edges[r], scratch.vertices[r]);
    });
    team.each(kLines, [&](int line) { inside[b * kLines + line] = scratch.inside[line]; });
    team.each(kBrickValues / Lanes<V>::kCount, [&](int i) {
      const int at = i * Lanes<V>::kCount;
      Lanes<V>::store(values.data + item * kBrickValues + at, Lanes<V>::load(scratch.values + at));
    });
  }

  /// Returns whether all points of the brick whose lowest point is `first` are on the grid.
  PM_HD bool is_on_grid(Int3 first) const {
    const Int3 n = grid.points;
    return first.x >= 0 && first.y >= 0 && first.z >= 0 && first.x + kBrickCells < n.x &&
           first.y + kBrickCells < n.y && first.z + kBrickCells < n.z;
  }
  /// Returns the points of a line that are not on the grid, point x in bit x.
  PM_HD std::uint32_t beyond_grid(Int3 first, int line) const {
    const Int3 n = grid.points;
    const int y = first.y + line % kBrickPoints, z = first.z + line / kBrickPoints;
    if (y < 0 || z < 0 || y >= n.y || z >= n.z) return 0xffu;
    std::uint32_t bits = 0;
    for (int x = 0; x < kBrickPoints; ++x)
      bits |= (first.x + x < 0 || first.x + x >= n.x ? 1u : 0u) << x;
    return bits;
  }
  /// Sets all points that are not on the grid to `outside`.
  template <class Team>
  PM_HD void fill_beyond_grid(const Team& team, Int3 first, float* brick_values) const {
    if (is_on_grid(first)) return;
    team.each(kLines, [&](int line) {
      for (std::uint32_t bits = beyond_grid(first, line); bits != 0; bits &= bits - 1)
        brick_values[kBrickPoints * line + countr_zero(bits)] = outside;
    });
    team.sync();
  }

  /// Returns the inside flags of a line of points, point x in bit x.
  template <class V>
  PM_HD std::uint32_t inside_bits(const float* line) const {
    std::uint32_t bits = 0;
    for (int x = 0; x < kBrickPoints; x += Lanes<V>::kCount) {
      bits |= Lanes<V>::bits(Lanes<V>::load(line + x) > iso) << x;
    }
    return bits;
  }
};

/// Samples the field of balls at each brick's points, and counts (CountBricks). One team per brick.
///
/// With infinite support, values are computed from the brick's list and polynomial. A value so near
/// to iso that the exact sum may lie on its other side is replaced by the exact sum.
template <class F>
struct SampleBricks : CountBricks {
  static constexpr int kThreads = 128;
  static constexpr int kPacksPerItem = 4;  ///< packs of points that share one loop over the balls
  struct Scratch : CountBricks::Scratch {
    union {
      alignas(64) AxisTables tables[F::kSeparable ? kBallsPerBatch : 1];
      float coarse[kMaxCoarse];
    };
    /// Number of uncertain points per line, then their prefix sums.
    std::uint32_t uncertain[F::kCompactSupport ? 1 : kLines + 1];
    std::uint16_t uncertain_points[F::kCompactSupport ? 1 : kBrickValues];
  };
  int sample_stride = 1;
  View<const std::uint32_t> entries;
  View<const typename F::Ball> balls;
  View<const FarField> far;  ///< per brick, where support is infinite
  BallList all_balls;

  template <class Team>
  PM_HD void operator()(const Team& team, Scratch& scratch, std::int64_t item) const {
    const std::int64_t b = this->begin + item;
    const Node brick = bricks[b];
    const Int3 first = first_point(brick);
    if (sample_stride > 1) {
      interpolate_all(team, scratch, brick, first);
    } else {
      sample_all(team, scratch, b, first);
      if constexpr (!F::kCompactSupport)
        resample_uncertain_points(team, scratch, error_bound(far[b]), first);
    }
    count(team, scratch, item, first);
  }

  /// Samples the field at every `sample_stride`-th grid point around the brick, and interpolates it
  /// trilinearly at the brick's points.
  template <class Team>
  PM_HD void interpolate_all(const Team& team, Scratch& scratch, const Node& brick,
                             Int3 first) const {
    using V = typename Team::V;
    constexpr int kLanes = Lanes<V>::kCount;
    const Int3 low = {coarse(first.x), coarse(first.y), coarse(first.z)};
    const Int3 n = {coarse(first.x + kBrickCells) + 2 - low.x,
                    coarse(first.y + kBrickCells) + 2 - low.y,
                    coarse(first.z + kBrickCells) + 2 - low.z};
    const int size = n.x * n.y * n.z;
    team.each((size + kLanes - 1) / kLanes, [&](int item) {
      alignas(64) float x[kLanes], y[kLanes], z[kLanes];
      for (int l = 0; l < kLanes; ++l) {
        const int i = item * kLanes + l;
        const Vec3 p = grid_point(
            grid, {sample_stride * (low.x + i % n.x), sample_stride * (low.y + i / n.x % n.y),
                   sample_stride * (low.z + i / n.x / n.y)});
        x[l] = p.x, y[l] = p.y, z[l] = p.z;
      }
      const Points<V> at = {Lanes<V>::load(x), Lanes<V>::load(y), Lanes<V>::load(z)};
      Lanes<V>::store(scratch.coarse + item * kLanes,
                      grid_field_at<F>(at, balls.data, coarse_list(brick)));
    });
    team.sync();
    team.each(kBrickValues, [&](int i) {
      const int gx = first.x + i % kBrickPoints, gy = first.y + i / kBrickPoints % kBrickPoints,
                gz = first.z + i / kLines;
      const int cx = coarse(gx), cy = coarse(gy), cz = coarse(gz);
      const float inv_stride = 1.0f / static_cast<float>(sample_stride);
      const float tx = inv_stride * static_cast<float>(gx - sample_stride * cx),
                  ty = inv_stride * static_cast<float>(gy - sample_stride * cy),
                  tz = inv_stride * static_cast<float>(gz - sample_stride * cz);
      const float* c = scratch.coarse + (cx - low.x) + n.x * ((cy - low.y) + n.y * (cz - low.z));
      const int dy = n.x, dz = n.x * n.y;
      const float at_low_z = lerp(lerp(c[0], c[1], tx), lerp(c[dy], c[dy + 1], tx), ty);
      const float at_high_z =
          lerp(lerp(c[dz], c[dz + 1], tx), lerp(c[dz + dy], c[dz + dy + 1], tx), ty);
      scratch.values[i] = lerp(at_low_z, at_high_z, tz);
    });
    team.sync();
  }
  /// Returns the balls for the coarse points. With infinite support these are all balls: bricks
  /// share the points, and without an error bound for interpolated values no polynomial can be
  /// trusted.
  PM_HD BallList coarse_list(const Node& brick) const {
    if constexpr (!F::kCompactSupport) return all_balls;
    return {entries.data + brick.begin, brick.count};
  }
  /// Returns the index of the coarse point at or below grid point g; coarse points are
  /// `sample_stride` apart. Adding 4 strides makes the division round down for g = -1, too.
  PM_HD int coarse(int g) const { return (g + sample_stride * 4) / sample_stride - 4; }

  /// Samples the field at all points of the brick.
  template <class Team>
  PM_HD void sample_all(const Team& team, Scratch& scratch, std::int64_t b, Int3 first) const {
    using V = typename Team::V;
    const Node brick = bricks[b];
    constexpr int kItems = kBrickValues / kPacksPerItem / Lanes<V>::kCount;
    // A separable field adds the products of a batch of balls to all points before the next batch.
    if constexpr (F::kSeparable && Lanes<V>::kCount > kBrickPoints) {
      sample_columns<V>(scratch, brick, first);
    } else if constexpr (F::kSeparable) {
      team.each(kItems, [&](int item) {
        for (int r = 0; r < kPacksPerItem; ++r) {
          Lanes<V>::store(scratch.values + point_offset<V>(item, r), broadcast<V>(0.0f));
        }
      });
      team.sync();
      for (std::uint32_t j = 0; j < brick.count; j += kBallsPerBatch) {
        const auto remaining = static_cast<int>(brick.count - j);
        const int n = remaining < kBallsPerBatch ? remaining : kBallsPerBatch;
        const std::uint32_t* list = entries.data + brick.begin + j;
        constexpr int kPacks = kBrickPoints / Lanes<V>::kCount;
        team.each(3 * kPacks * n, [&](int i) {
          const int ball_index = i / (3 * kPacks), axis = i / kPacks % 3, at = i % kPacks;
          scratch.tables[ball_index].template fill<V>(balls[list[ball_index]], grid, first, axis,
                                                      at * Lanes<V>::kCount);
        });
        team.sync();
        team.each(kItems, [&](int item) { add_products<V>(scratch, n, item); });
        team.sync();
      }
    } else {
      const BrickField<F> field(grid, /*margin=*/0, brick, balls.data, entries.data,
                                F::kCompactSupport ? nullptr : &far[b]);
      team.each(kItems, [&](int item) { sample<V>(field, first, item, scratch.values); });
      team.sync();
    }
  }

  /// Samples all points by one thread whose packs hold two lines or more. Each lane is a line, so
  /// that terms in y and z are computed once per ball, and a point takes two multiply-adds and a
  /// comparison.
  template <class V>
  PM_HD void sample_columns(Scratch& scratch, const Node& brick, Int3 first) const {
    alignas(64) float columns[kBrickValues] = {};  // [x][line]
    LineTables tables[kBallsPerBatch];
    for (std::uint32_t j = 0; j < brick.count; j += kBallsPerBatch) {
      const auto remaining = static_cast<int>(brick.count - j);
      const int n = remaining < kBallsPerBatch ? remaining : kBallsPerBatch;
      for (int i = 0; i < n; ++i) {
        const std::int64_t at = brick.begin + j + i;
        fill_lines<V>(balls[entries[at]], first, tables[i]);
      }
      for (int line = 0; line < kLines; line += Lanes<V>::kCount) {
        add_columns<V>(tables, n, line, columns + line);
      }
    }
    transpose_columns(columns, scratch.values);
  }
  /// Fills the tables of one ball.
  template <class V>
  PM_HD void fill_lines(const RoundBall& ball, Int3 first, LineTables& out) const {
    using Half = typename Lanes<V>::Half;
    AxisTables t;
    for (int axis = 0; axis < 3; ++axis) t.template fill<Half>(ball, grid, first, axis, /*at=*/0);
    Lanes<Half>::store(out.u, Lanes<Half>::load(t.u[0]));
    Lanes<Half>::store(out.factor, Lanes<Half>::load(t.factor[0]));
    out.limit = t.limit;
    const Half uy = Lanes<Half>::load(t.u[1]), factor_y = Lanes<Half>::load(t.factor[1]);
    const V uy_pair = join(uy, uy), factor_y_pair = join(factor_y, factor_y);
    for (int z = 0; z < kBrickPoints; z += 2) {
      const auto join_z = [&](const float* values_z) {
        return join(broadcast<Half>(values_z[z]), broadcast<Half>(values_z[z + 1]));
      };
      const V uz = join_z(t.u[2]);
      const V q0 = fma(uz, uz, broadcast<V>(t.base));
      Lanes<V>::store(out.q + kBrickPoints * z, fma(uy_pair, uy_pair, q0));
      Lanes<V>::store(out.product + kBrickPoints * z, factor_y_pair * join_z(t.factor[2]));
    }
  }
  /// Adds the products of n balls at the points of as many lines as V has lanes.
  template <class V>
  PM_HD static void add_columns(const LineTables* tables, int n, int line, float* to) {
    V sum[kBrickPoints];
    for (int x = 0; x < kBrickPoints; ++x) sum[x] = Lanes<V>::load(to + kLines * x);
    for (int j = 0; j < n; ++j) {
      const LineTables& t = tables[j];
      const V line_q = Lanes<V>::load(t.q + line), product = Lanes<V>::load(t.product + line);
      for (int x = 0; x < kBrickPoints; ++x) {
        const V u = broadcast<V>(t.u[x]);
        sum[x] =
            fma_where(fma(u, u, line_q) <= t.limit, broadcast<V>(t.factor[x]), product, sum[x]);
      }
    }
    for (int x = 0; x < kBrickPoints; ++x) Lanes<V>::store(to + kLines * x, sum[x]);
  }

  /// Returns the index of the first point of pack r of an item, which has kPacksPerItem packs. A
  /// pack is a part of a line, or as many whole lines as fill V.
  template <class V>
  PM_HD static int point_offset(int item, int r) {
    constexpr int kPacks = (kBrickPoints * kLinesOfPack<V>) / Lanes<V>::kCount;
    return item % kPacks * Lanes<V>::kCount +
           kBrickPoints * kLinesOfPack<V> * (item / kPacks * kPacksPerItem + r);
  }
  /// Number of whole lines in a pack; 1 if a pack is a part of a line.
  template <class V>
  static constexpr int kLinesOfPack =
      Lanes<V>::kCount > kBrickPoints ? Lanes<V>::kCount / kBrickPoints : 1;

  /// Adds the products of n balls to the points of an item.
  template <class V>
  PM_HD static void add_products(Scratch& scratch, int n, int item) {
    const int start = point_offset<V>(item, 0);
    const int x = start % kBrickPoints, y = start / kBrickPoints % kBrickPoints, z = start / kLines;
    V sum[kPacksPerItem];
    for (int r = 0; r < kPacksPerItem; ++r) {
      sum[r] = Lanes<V>::load(scratch.values + start + kBrickPoints * r);
    }
    for (int j = 0; j < n; ++j) {
      const AxisTables& t = scratch.tables[j];
      const V ux = Lanes<V>::load(t.u[0] + x), factor_x = Lanes<V>::load(t.factor[0] + x);
      const float q0 = fma(t.u[2][z], t.u[2][z], t.base);
      for (int r = 0; r < kPacksPerItem; ++r) {
        const V q = fma(ux, ux, broadcast<V>(fma(t.u[1][y + r], t.u[1][y + r], q0)));
        sum[r] = fma(zero_unless(q <= t.limit, factor_x),
                     broadcast<V>(t.factor[1][y + r] * t.factor[2][z]), sum[r]);
      }
    }
    for (int r = 0; r < kPacksPerItem; ++r) {
      Lanes<V>::store(scratch.values + start + kBrickPoints * r, sum[r]);
    }
  }

  /// Samples the field at the kPacksPerItem packs of an item (point_offset()); all their points
  /// have the same z.
  template <class V>
  PM_HD void sample(const BrickField<F>& field, Int3 first, int item, float* to) const {
    constexpr int kLanes = Lanes<V>::kCount;
    // The points of a pack have one y only if they are on one line.
    using Y = std::conditional_t<(kLinesOfPack<V> > 1), V, float>;
    const int x = point_offset<V>(item, 0) % kBrickPoints,
              line = point_offset<V>(item, 0) / kBrickPoints;
    alignas(64) float xs[kLanes], line_offsets[kLanes];
    for (int l = 0; l < kLanes; ++l) {
      xs[l] = static_cast<float>(first.x + x + l % kBrickPoints);
      line_offsets[l] = static_cast<float>(l / kBrickPoints);
    }
    const V px = grid.origin.x + grid.cell * Lanes<V>::load(xs);
    Y py[kPacksPerItem];
    for (int r = 0; r < kPacksPerItem; ++r) {
      const int y = first.y + (line + kLinesOfPack<V> * r) % kBrickPoints;
      py[r] = grid.origin.y + grid.cell * (Lanes<Y>::load(line_offsets) + static_cast<float>(y));
    }
    const float pz = grid.origin.z + grid.cell * static_cast<float>(first.z + line / kBrickPoints);
    V sum[kPacksPerItem], q[kPacksPerItem];
    for (int r = 0; r < kPacksPerItem; ++r) sum[r] = broadcast<V>(0.0f);
    const std::uint32_t* list = field.list.indices;
    if constexpr (F::kCompactSupport) {
      for (std::uint32_t j = 0; j < field.list.count; ++j) {
        const typename F::Ball ball = field.balls[list[j]];
        ball.q_rows(px, py, pz, q);
        for (int r = 0; r < kPacksPerItem; ++r) sum[r] = sum[r] + F::value(ball, q[r]);
      }
    } else {
      for (std::uint32_t j = 0; j < field.list.count; j += kBatch) {
        RoundBall batch[kBatch];
        V batch_q[kBatch][kPacksPerItem];
        load_batch(field.balls, list + j, field.list.count - j, batch);
        for (int i = 0; i < kBatch; ++i) batch[i].q_rows(px, py, pz, batch_q[i]);
        for (int r = 0; r < kPacksPerItem; ++r) {
          const V max_q = broadcast<V>(kMaxDistance2);
          const V qs[kBatch] = {min(batch_q[0][r], max_q), min(batch_q[1][r], max_q),
                                min(batch_q[2][r], max_q), min(batch_q[3][r], max_q)};
          sum[r] = sum[r] + sum_of_batch(batch, qs);
        }
      }
      far_rows(field.far->value, field.box, px, py, pz, q);
      for (int r = 0; r < kPacksPerItem; ++r) sum[r] = sum[r] + q[r];
    }
    for (int r = 0; r < kPacksPerItem; ++r) Lanes<V>::store(to + point_offset<V>(item, r), sum[r]);
  }

  /// Bounds the difference between a value near iso and the computed sum over all balls: the
  /// polynomial's error and the rounding of both sums. In units of 2^-24, 0.5 per ball is for the
  /// additions of both sums, which have at most all_balls / 4 terms each, and 40 for all else.
  /// The absolute values of the terms add up to iso plus twice those of the negative terms.
  PM_HD float error_bound(const FarField& field) const {
    const float rounding = 0x1p-24f * (40.0f + 0.5f * static_cast<float>(all_balls.count));
    return 1.001f * fma(rounding, iso + 2 * (field.negative_weight_bound + field.magnitude),
                        field.error + field.rounding);
  }

  /// Replaces values that differ from iso by at most `max_error` by sums over all balls. It counts
  /// these points per line, lists them, and evaluates them in packs.
  template <class Team>
  PM_HD void resample_uncertain_points(const Team& team, Scratch& scratch, float max_error,
                                       Int3 first) const {
    using V = typename Team::V;
    constexpr int kLanes = Lanes<V>::kCount;
    const auto is_certain = [&](float value) {
      return value > iso + max_error || value < iso - max_error;
    };
    team.each(kLines, [&](int line) {
      std::uint32_t count = 0;
      for (int x = 0; x < kBrickPoints; ++x) {
        count += is_certain(scratch.values[kBrickPoints * line + x]) ? 0 : 1;
      }
      scratch.uncertain[line] = count;
    });
    team.sync();
    const auto count = static_cast<int>(team.scan(scratch.uncertain, kLines));
    if (count == 0) return;
    team.each(kLines, [&](int line) {
      std::uint32_t slot = scratch.uncertain[line];
      for (int i = kBrickPoints * line; i < kBrickPoints * (line + 1); ++i) {
        if (!is_certain(scratch.values[i]))
          scratch.uncertain_points[slot++] = static_cast<std::uint16_t>(i);
      }
    });
    team.sync();
    team.each((count + kLanes - 1) / kLanes, [&](int item) {
      alignas(64) float x[kLanes], y[kLanes], z[kLanes], value[kLanes];
      const auto point = [&](int l) {
        const int i = item * kLanes + l;  // lanes beyond the last point repeat it
        return static_cast<int>(scratch.uncertain_points[i < count ? i : count - 1]);
      };
      for (int l = 0; l < kLanes; ++l) {
        const int i = point(l);
        const Vec3 p =
            grid_point(grid, {first.x + i % kBrickPoints, first.y + i / kBrickPoints % kBrickPoints,
                              first.z + i / kLines});
        x[l] = p.x, y[l] = p.y, z[l] = p.z;
      }
      const Points<V> at = {Lanes<V>::load(x), Lanes<V>::load(y), Lanes<V>::load(z)};
      Lanes<V>::store(value, field_at<F>(at, balls.data, all_balls));
      for (int l = 0; l < kLanes; ++l) scratch.values[point(l)] = value[l];
    });
    team.sync();
  }
};

}  // namespace polymorph
