#include "model/repair/diagnose.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "base/disjoint_sets.h"
#include "base/exact_math.h"
#include "mesh/edges.h"
#include "mesh/inside.h"
#include "mesh/normals.h"
#include "mesh/sample_surface.h"
#include "mesh/solid_angle.h"
#include "model/clustered_model.h"

namespace polymorph {
namespace {

constexpr std::size_t kMaxInwardShells = 64;

/// Number of round balls of a wall that one ellipsoid replaces if it is as flat as the fit permits.
/// Measured: 512 ellipsoids show nine tenths of a cup that would take 54 000 balls.
constexpr double kBallsPerEllipsoid = 100;

/// Sheets (faces with outside on both sides) are reported if their fraction of the area is within
/// these bounds. A model above the maximum is open as a whole, which another line reports.
constexpr double kMinSheetFraction = 0.01, kMaxSheetFraction = 0.5;

/// Rounds to two significant digits, but not finer than 0.1.
double round_to_two_digits(double value) {
  double unit = 0.1;
  // The limit of 300 steps ends the loop for an infinite value.
  for (int i = 0; i < 300 && value >= 100 * unit; ++i) unit *= 10;
  return std::round(value / unit) * unit;
}

struct Shell {
  bool open = false;
  bool manifold = true;  ///< every edge has two faces that traverse it in opposite directions
  double volume = 0;     ///< signed; meaningful if `manifold`
  std::size_t first_triangle = 0;
};

struct Topology {
  std::vector<Shell> shells;
  std::vector<std::uint32_t> shell_index;  ///< per triangle
};

/// Counts all edges in `edges`, and the boundary, non-manifold and flipped ones in `d`.
void count_edges(const std::vector<EdgeUse>& uses, const Model& model, Diagnosis& d,
                 std::size_t& edges) {
  for_each_edge(uses, [&](std::size_t first, std::size_t last) {
    ++edges;
    if (last - first == 1) {
      if (d.boundary_edges++ == 0) {
        d.first_open_edge = {uses[first].low, uses[first].high};
        d.first_open_edge_points = {model.points[uses[first].low], model.points[uses[first].high]};
      }
    } else if (last - first > 2) {
      ++d.non_manifold_edges;
    } else if (uses[first].forward == uses[first + 1].forward) {
      ++d.flipped_edges;
    }
  });
}

/// Computes the Euler characteristic with points counted once per fan of faces around them, so that
/// shells that touch at a point do not change the genus. Counts points with several fans in `d`.
long long compute_fan_euler(const std::vector<EdgeUse>& uses, const Model& model, std::size_t edges,
                            Diagnosis& d) {
  const std::vector<std::uint32_t> fans = count_fans(model.points.size(), model.triangles, uses);
  d.touching_points += static_cast<std::size_t>(
      std::count_if(fans.begin(), fans.end(), [](std::uint32_t n) { return n > 1; }));
  const std::size_t count = std::accumulate(fans.begin(), fans.end(), std::size_t{0});
  return static_cast<long long>(count) - static_cast<long long>(edges) +
         static_cast<long long>(model.triangles.size());
}

Topology find_shells(const std::vector<EdgeUse>& uses, const Model& model) {
  DisjointSets sets(model.triangles.size());
  for_each_edge(uses, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first + 1; i < last; ++i)
      sets.join(uses[first].corner / 3, uses[i].corner / 3);
  });
  Topology topology;
  topology.shell_index.assign(model.triangles.size(), kNoIndex);
  for (std::uint32_t t = 0; t < model.triangles.size(); ++t) {
    const std::uint32_t root = sets.find(t);
    if (root == t) {
      topology.shell_index[t] = static_cast<std::uint32_t>(topology.shells.size());
      topology.shells.emplace_back().first_triangle = t;
    } else {
      topology.shell_index[t] = topology.shell_index[root];
    }
  }
  for_each_edge(uses, [&](std::size_t first, std::size_t last) {
    Shell& shell = topology.shells[topology.shell_index[uses[first].corner / 3]];
    if (last - first == 1) shell.open = true;
    if (last - first != 2 || uses[first].forward == uses[first + 1].forward) shell.manifold = false;
  });
  return topology;
}

/// Computes Shell::volume. Points are taken relative to `center`, for precision.
void sum_shell_volumes(const Model& model, Vec3d center, Topology& topology) {
  for (std::size_t t = 0; t < model.triangles.size(); ++t) {
    const auto& v = model.triangles[t].v;
    const Vec3d a = Vec3d(model.points[v[0]]) - center, b = Vec3d(model.points[v[1]]) - center,
                c = Vec3d(model.points[v[2]]) - center;
    topology.shells[topology.shell_index[t]].volume += dot(a, cross(b, c)) / 6;
  }
}

/// Winding number of the other closed shells at the centroid of this shell's first triangle.
double winding_number_of_others(const Model& model, const Topology& topology, std::size_t shell) {
  const auto corner = [&](std::size_t t, std::size_t k) {
    return Vec3d(model.points[model.triangles[t].v[k]]);
  };
  const std::size_t first = topology.shells[shell].first_triangle;
  const Vec3d apex = (corner(first, 0) + corner(first, 1) + corner(first, 2)) * (1.0 / 3);
  double sum = 0;
  for (std::size_t t = 0; t < model.triangles.size(); ++t) {
    const std::uint32_t other = topology.shell_index[t];
    if (other == shell || !topology.shells[other].manifold) continue;
    const HalfAngle angle =
        half_solid_angle(corner(t, 0) - apex, corner(t, 1) - apex, corner(t, 2) - apex);
    sum += exact::atan2(angle.num, angle.den);
  }
  return sum / (2 * std::numbers::pi);  // half of the full solid angle, 4 pi
}

/// Counts the shells that face inward and are not inside another shell.
std::size_t count_inverted(const Model& model, const Topology& topology) {
  std::size_t inverted = 0, examined = 0;
  for (std::size_t s = 0; s < topology.shells.size() && examined < kMaxInwardShells; ++s) {
    const Shell& shell = topology.shells[s];
    if (!shell.manifold || shell.volume >= 0) continue;
    ++examined;
    if (winding_number_of_others(model, topology, s) < 0.5) ++inverted;
  }
  return inverted;
}

/// Estimates the fraction of the area that has outside on both sides.
double estimate_sheet_fraction(const Model& model) {
  constexpr std::size_t kSamples = 4000;
  const std::vector<SurfaceSample> samples = sample_surface(model, kSamples);
  const float step = 2e-4f * model.box().diagonal();  // distance of the tested points from a face
  std::vector<Vec3> positions;
  for (const SurfaceSample& s : samples) {
    positions.push_back(s.point + s.normal * step);
    positions.push_back(s.point - s.normal * step);
  }
  const std::vector<std::uint8_t> is_inside = InsideTest(model).inside(positions);
  std::size_t sheet_count = 0;
  for (std::size_t i = 0; i < samples.size(); ++i)
    sheet_count += !is_inside[2 * i] && !is_inside[2 * i + 1];
  return samples.empty() ? 0
                         : static_cast<double>(sheet_count) / static_cast<double>(samples.size());
}

}  // namespace

Diagnosis diagnose(const Model& model) {
  Diagnosis d;
  d.points = model.points.size();
  d.triangles = model.triangles.size();
  d.long_triangles = count_long_triangles(model);
  d.box = model.box();
  d.volume = volume_of(model);
  d.area = area_of(model);
  const std::vector<Vec3> normals = face_normals(model);
  d.degenerate_triangles =
      static_cast<std::size_t>(std::count(normals.begin(), normals.end(), Vec3{}));
  const std::vector<EdgeUse> uses = sorted_edge_uses(model.triangles);
  std::size_t edges = 0;
  count_edges(uses, model, d, edges);
  std::vector<std::uint8_t> is_used(model.points.size(), 0);
  for (const Triangle& t : model.triangles)
    for (const std::uint32_t v : t.v) is_used[v] = 1;
  d.euler = static_cast<long long>(std::count(is_used.begin(), is_used.end(), 1)) -
            static_cast<long long>(edges) + static_cast<long long>(d.triangles);
  const long long euler_by_fans = compute_fan_euler(uses, model, edges, d);
  Topology topology = find_shells(uses, model);
  d.shells = topology.shells.size();
  d.open_shells = static_cast<std::size_t>(std::count_if(
      topology.shells.begin(), topology.shells.end(), [](const Shell& s) { return s.open; }));
  d.closed =
      d.triangles > 0 && d.boundary_edges == 0 && d.non_manifold_edges == 0 && d.flipped_edges == 0;
  // euler = 2 shells - 2 genus
  if (d.closed)
    d.genus = static_cast<int>((2 * static_cast<long long>(d.shells) - euler_by_fans) / 2);
  if (d.triangles > 0) {
    sum_shell_volumes(model, Vec3d(d.box.center()), topology);
    d.inverted_shells = count_inverted(model, topology);
  }
  return d;
}

Diagnosis diagnose_fully(const Model& model) {
  Diagnosis d = diagnose(model);
  const std::optional<ClusteredModel> clustered = cluster_long_triangles(model);
  const Model& shape = clustered ? clustered->model : model;
  d.thickness = measure_thickness(shape, build_split_bvh(shape.points, shape.triangles));
  d.sheet_fraction = estimate_sheet_fraction(shape);
  d.crossings = count_self_intersections(model, build_triangle_bvh(model.points, model.triangles));
  return d;
}

Diagnosis transfer_diagnosis(Diagnosis d, const Model& similar) {
  const double area = area_of(similar), scale = d.area > 0 ? std::sqrt(area / d.area) : 1;
  d.box = similar.box();
  d.area = area;
  d.volume *= scale * scale * scale;
  if (d.boundary_edges > 0)
    for (std::size_t k = 0; k < 2; ++k)
      d.first_open_edge_points[k] = similar.points[d.first_open_edge[k]];
  if (d.thickness)
    for (double* length : {&d.thickness->low, &d.thickness->median, &d.thickness->high})
      *length *= scale;
  return d;
}

std::vector<std::string> describe_problems(const Diagnosis& d) {
  std::vector<std::string> lines;
  if (d.triangles == 0) return {"it has no faces - export the model with its faces"};
  const auto format_point = [](Vec3 p) {
    return fmt::format("({:.4g}, {:.4g}, {:.4g})", p.x, p.y, p.z);
  };
  if (d.closed && d.volume < 0)
    lines.push_back("it is inside out (its volume is negative) - turn all faces around");
  const Vec3 size = d.box.size();
  if (std::min({size.x, size.y, size.z}) <= 1e-6f * d.box.diagonal())
    lines.push_back(
        "it is flat and encloses nothing - give it thickness (extrude or solidify it "
        "in the modeller)");
  else if (d.boundary_edges > 0)
    lines.push_back(fmt::format(
        "it is open: {} {} only one face, in {} of {} shells, first from {} to {} - this is "
        "usually fine: what is inside is decided by the winding number; close the holes if a part "
        "is missing on the way",
        d.boundary_edges, d.boundary_edges == 1 ? "edge has" : "edges have", d.open_shells,
        d.shells, format_point(d.first_open_edge_points[0]),
        format_point(d.first_open_edge_points[1])));
  if (d.thickness && is_thin(*d.thickness))
    lines.push_back(fmt::format(
        "it is thin: half of its walls are thinner than {:.3g}, so about {:.0f} balls are needed "
        "to show them, or {:.0f} stretched ones - raise the number of balls, or thicken it in the "
        "modeller",
        d.thickness->median, round_to_two_digits(d.thickness->balls),
        round_to_two_digits(d.thickness->balls / kBallsPerEllipsoid)));
  if (d.sheet_fraction && *d.sheet_fraction > kMinSheetFraction &&
      *d.sheet_fraction < kMaxSheetFraction)
    lines.push_back(
        fmt::format("{:.2g} % of its area has no thickness: distances show it (motion.interpolate "
                    "\"distance\"), balls leave it out until the model itself is shown - give it "
                    "thickness in the modeller",
                    100 * *d.sheet_fraction));
  if (has_many_long_triangles(d.long_triangles))
    lines.push_back(fmt::format(
        "{} of its triangles are longer than a 64th of its size, so a simpler "
        "stand-in is taken for its shape - simplify it in the modeller, or drop its inner shells",
        d.long_triangles));
  if (d.flipped_edges > 0)
    lines.push_back(
        fmt::format("neighbouring faces disagree about outside at {} - make the normals consistent",
                    d.flipped_edges == 1 ? "an edge" : fmt::format("{} edges", d.flipped_edges)));
  if (d.inverted_shells > 0 && !(d.closed && d.volume < 0))
    lines.push_back(
        d.inverted_shells == 1
            ? fmt::format("1 of {} shells is inside out and counts as a hole - turn its faces "
                          "around",
                          d.shells)
            : fmt::format("{} of {} shells are inside out and count as holes - turn their faces "
                          "around",
                          d.inverted_shells, d.shells));
  if (d.non_manifold_edges > 0)
    lines.push_back(fmt::format("{} {} three or more faces - remove double faces and inner walls",
                                d.non_manifold_edges,
                                d.non_manifold_edges == 1 ? "edge has" : "edges have"));
  return lines;
}

std::vector<std::string> describe_oddities(const Diagnosis& d) {
  std::vector<std::string> lines;
  if (d.touching_points > 0)
    lines.push_back(fmt::format("{} parts that no edge joins",
                                d.touching_points == 1
                                    ? "a point joins"
                                    : fmt::format("{} points join", d.touching_points)));
  if (d.degenerate_triangles > 0)
    lines.push_back(
        fmt::format("{} no area", d.degenerate_triangles == 1
                                      ? "a triangle has"
                                      : fmt::format("{} triangles have", d.degenerate_triangles)));
  return lines;
}

std::string describe_crossings(const Diagnosis& d) {
  if (!d.crossings) return {};
  if (d.crossings->pairs == 0 && d.crossings->crowded)
    return "so many of its triangles lie upon each other, or meet at a point, that not all pairs "
           "were tried for crossings - remove double faces";
  if (d.crossings->pairs == 0) return {};
  return fmt::format(
      "{}{} pairs of its triangles cross, first {} and {} - the winding number takes crossing "
      "parts "
      "as one body, the parity rule takes their overlap as a hole",
      d.crossings->stopped ? "at least " : "", d.crossings->pairs, d.crossings->first[0],
      d.crossings->first[1]);
}

}  // namespace polymorph
