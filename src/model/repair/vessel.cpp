#include "model/repair/vessel.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>
#include <utility>
#include <vector>

#include "kernels/linear.h"
#include "mesh/edges.h"
#include "mesh/mesh_check.h"
#include "model/repair/solidify.h"

namespace polymorph {
namespace {

/// Closed loop of boundary edges: its points, in the order in which the triangles traverse them.
using Loop = std::vector<std::uint32_t>;

std::vector<Loop> find_boundary_loops(const Model& model) {
  const std::vector<EdgeUse> uses = sorted_edge_uses(model.triangles);
  std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
  for_each_edge(uses, [&](std::size_t first, std::size_t last) {
    if (last - first != 1) return;
    const EdgeUse& use = uses[first];
    edges.emplace_back(use.forward ? use.low : use.high, use.forward ? use.high : use.low);
  });
  // Where loops touch at a point, several boundary edges begin there. Loops through such a point
  // are dropped.
  std::unordered_map<std::uint32_t, std::uint32_t> next_point;
  std::unordered_map<std::uint32_t, int> edge_counts;  // edges that begin at each point
  for (const auto& [from, to] : edges) next_point[from] = to, ++edge_counts[from];
  std::vector<Loop> loops;
  for (const auto& [start, unused] : edges) {
    Loop loop;
    for (auto edge = next_point.find(start); edge != next_point.end();
         edge = next_point.find(loop.back())) {
      loop.push_back(edge->second);
      const bool is_simple = edge_counts[edge->first] == 1;
      next_point.erase(edge);
      if (!is_simple) break;
    }
    if (loop.size() >= 3 && loop.back() == start) loops.push_back(std::move(loop));
  }
  return loops;
}

/// Mean of the loop's points.
Vec3 find_center(const Model& model, const Loop& loop) {
  Vec3d sum;
  for (const std::uint32_t i : loop) sum = sum + Vec3d(model.points[i]);
  return to_float(sum * (1.0 / static_cast<double>(loop.size())));
}

/// Computes the length of the sum of a fan's area vectors: the area that the loop spans, without
/// folds, which cancel.
double spanned_area(const Model& model, const Loop& loop, Vec3 center) {
  Vec3d sum;
  for (std::size_t i = 0; i < loop.size(); ++i)
    sum = sum + cross(Vec3d(model.points[loop[i]] - center),
                      Vec3d(model.points[loop[(i + 1) % loop.size()]] - center));
  return 0.5 * length(sum);
}

/// Closes a loop by triangles to its centre. They run against the sides of the adjacent triangles.
void append_fan(Model& model, const Loop& loop, Vec3 center) {
  const auto middle = static_cast<std::uint32_t>(model.points.size());
  model.points.push_back(center);
  for (std::size_t i = 0; i < loop.size(); ++i)
    model.triangles.push_back({{loop[(i + 1) % loop.size()], loop[i], middle}});
}

/// Computes volume^(2/3) / area: 1/6 for a cube, 0.17 for a half sphere, about 0.05 for a plate.
double compute_compactness(const Mesh& faces) {
  const double volume = std::max(volume_of(faces), 0.0);
  return cube_root(volume * volume) / area_of(faces);
}
constexpr double kMinCompactness = 0.1;  ///< minimum of a filled vessel; a plate is below it

Mesh copy_faces(const Model& model) { return {model.points, {}, model.triangles}; }

/// Fills a vessel whose walls are single faces, as fill_vessel() describes.
std::optional<FilledVessel> fill_openings(const Model& model, const InsideTest& inside) {
  constexpr double kMinSpan = 0.05, kMinWinding = 0.2, kMaxWinding = 0.8;
  const double area = area_of(copy_faces(model));
  Model filled;
  for (const Loop& loop : find_boundary_loops(model)) {
    const Vec3 center = find_center(model, loop);
    if (spanned_area(model, loop, center) < kMinSpan * area) continue;
    const double winding = inside.winding_number(center);
    if (winding < kMinWinding || winding > kMaxWinding) continue;
    if (filled.triangles.empty()) filled.points = model.points, filled.triangles = model.triangles;
    append_fan(filled, loop, center);
  }
  if (filled.triangles.empty() || compute_compactness(copy_faces(filled)) < kMinCompactness)
    return std::nullopt;
  return FilledVessel{std::move(filled), /*is_sheet=*/true};
}

}  // namespace

std::optional<FilledVessel> fill_vessel(const Model& model, const InsideTest& inside) {
  // A sheet of area A (both sides) and thickness h has the volume A h / 2. If its compactness is
  // below this bound, it takes A / h^2 > 2500 balls of diameter h.
  constexpr double kMaxWallCompactness = 0.045, kMinGain = 2;
  const Mesh faces = copy_faces(model);
  const double volume = volume_of(faces);
  // The volume of an open model means nothing, so closedness is tested, too.
  if (compute_compactness(faces) > kMaxWallCompactness || !check_mesh(faces).is_closed())
    return fill_openings(model, inside);
  if (!(volume > 0)) return std::nullopt;
  Result<Model> solid = solidify(model);
  if (!solid) return std::nullopt;  // no space is enclosed
  const Mesh filled = copy_faces(*solid);
  if (volume_of(filled) < kMinGain * volume || compute_compactness(filled) < kMinCompactness)
    return std::nullopt;
  return FilledVessel{std::move(*solid), /*is_sheet=*/false};
}

}  // namespace polymorph
