#include "spheres/convex_hull.h"

#include "spheres/qhull.h"

namespace polymorph {

double hull_volume(std::span<const Vec3> points) {
  if (points.size() < 4) return 0;
  std::vector<Vec3d> double_points;
  double_points.reserve(points.size());
  for (const Vec3 p : points) double_points.emplace_back(p);
  // Qt: only triangles; Pp: no warnings about narrow hulls; FA: the volume.
  Qhull hull(double_points, "qhull Qt Pp FA");
  return hull.failed ? 0 : hull.state.totvol;
}

}  // namespace polymorph
