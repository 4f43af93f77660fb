#include "spheres/delaunay.h"

#include <algorithm>
#include <cmath>

#include "spheres/qhull.h"

namespace polymorph {
namespace {

/// Sets the circumscribed sphere of the corners of `t`; returns false if they are coplanar.
bool circumscribe(std::span<const Vec3d> points, Tetrahedron& t) {
  const Vec3d a = points[t.points[0]], b = points[t.points[1]] - a, c = points[t.points[2]] - a,
              d = points[t.points[3]] - a;
  const double six_volumes = dot(b, cross(c, d));
  const Vec3d sum = cross(c, d) * dot(b, b) + cross(d, b) * dot(c, c) + cross(b, c) * dot(d, d);
  if (six_volumes == 0) return false;
  const Vec3d to_center = sum * (0.5 / six_volumes);
  t.center = a + to_center;
  t.radius = length(to_center);
  return std::isfinite(t.radius);
}

}  // namespace

Result<std::vector<Tetrahedron>> delaunay_tetrahedra(std::span<const Vec3d> points) {
  // Qbb: scaled lifting; Qt: only simplices; Q12: wide facets are no error; Qz: a point at
  // infinity, for points on one sphere.
  Qhull hull(points, "qhull d Qbb Qt Q12 Qz");
  if (hull.failed)
    return make_error(ErrorCode::kInput, "cannot triangulate {} points ({})", points.size(),
                      hull.first_message());
  qhT* const qh = &hull.state;  // the name that Qhull's macros use
  std::vector<std::uint32_t> index_by_facet(qh->facet_id, Tetrahedron::kNone);
  std::vector<const facetT*> facets;
  std::vector<Tetrahedron> tetrahedra;
  facetT* facet = nullptr;
  FORALLfacets {
    if (facet->upperdelaunay || !facet->simplicial) continue;  // not a Delaunay cell
    Tetrahedron t;
    int corner = 0;
    vertexT *vertex = nullptr, **vertexp = nullptr;
    FOREACHvertex_(facet->vertices) {
      const int id = qh_pointid(qh, vertex->point);
      if (id < 0 || id >= static_cast<int>(points.size()) || corner == 4) {
        corner = 5;  // not 4: a facet at Qhull's point at infinity is no tetrahedron
        break;
      }
      t.points[static_cast<std::size_t>(corner++)] = static_cast<std::uint32_t>(id);
    }
    if (corner != 4) continue;
    std::sort(t.points.begin(), t.points.end());
    if (!circumscribe(points, t)) continue;
    index_by_facet[facet->id] = static_cast<std::uint32_t>(tetrahedra.size());
    facets.push_back(facet);
    tetrahedra.push_back(t);
  }
  // Link neighbours, now that all tetrahedra have an index.
  for (std::size_t i = 0; i < facets.size(); ++i) {
    std::size_t side = 0;
    tetrahedra[i].neighbors.fill(Tetrahedron::kNone);
    facetT *neighbor = nullptr, **neighborp = nullptr;
    FOREACHneighbor_(facets[i]) {
      if (side < 4) tetrahedra[i].neighbors[side++] = index_by_facet[neighbor->id];
    }
  }
  return tetrahedra;
}

}  // namespace polymorph
