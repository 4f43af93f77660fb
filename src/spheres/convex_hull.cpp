#include "spheres/convex_hull.h"

#include "spheres/qhull.h"

namespace polymorph {

double hull_volume(std::span<const Vec3> points) {
  if (points.size() < 4) return 0;
  std::vector<Vec3d> exact;
  exact.reserve(points.size());
  for (const Vec3 p : points) exact.emplace_back(p);
  // Qt: only triangles; Pp: nothing is said about narrow hulls; FA: the volume.
  Qhull hull(exact, "qhull Qt Pp FA");
  return hull.failed ? 0 : hull.state.totvol;
}

}  // namespace polymorph
