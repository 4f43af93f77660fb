#include "spheres/delaunay.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>

extern "C" {
#include <libqhull_r/qhull_ra.h>
}

namespace polymorph {
namespace {

/// Qhull's state and messages, released together.
struct Hull {
  qhT state{};
  char* text = nullptr;
  std::size_t text_size = 0;
  std::FILE* messages = open_memstream(&text, &text_size);

  Hull() { qh_zero(&state, messages); }
  ~Hull() {
    qh_freeqhull(&state, !qh_ALL);
    int long_blocks = 0, bytes = 0;
    qh_memfreeshort(&state, &long_blocks, &bytes);
    if (messages) std::fclose(messages);
    std::free(text);
  }
  Hull(const Hull&) = delete;
  Hull& operator=(const Hull&) = delete;
};

/// The first line of Qhull's message, e.g. "QH6214 qhull input error: ...".
std::string first_message(Hull& hull) {
  if (!hull.messages) return "no message";
  std::fflush(hull.messages);
  const std::string text(hull.text, hull.text_size);
  return text.substr(0, text.find('\n'));
}

/// Computes the circumscribed sphere of four points; false if they are coplanar.
bool circumscribe(std::span<const Vec3d> points, Tetrahedron& t) {
  const Vec3d a = points[t.points[0]], b = points[t.points[1]] - a, c = points[t.points[2]] - a,
              d = points[t.points[3]] - a;
  const double volume = dot(b, cross(c, d));
  const Vec3d sum = cross(c, d) * dot(b, b) + cross(d, b) * dot(c, c) + cross(b, c) * dot(d, d);
  if (volume == 0) return false;
  const Vec3d to_center = sum * (0.5 / volume);
  t.center = a + to_center;
  t.radius = length(to_center);
  return std::isfinite(t.radius);
}

}  // namespace

Result<std::vector<Tetrahedron>> delaunay_tetrahedra(std::span<const Vec3d> points) {
  std::vector<double> coordinates;
  coordinates.reserve(3 * points.size());
  for (const Vec3d p : points) coordinates.insert(coordinates.end(), {p.x, p.y, p.z});
  Hull hull;
  // Qbb: scaled lifting; Qt: only simplices; Q12: wide facets are no error; Qz: a point at
  // infinity, for points on one sphere.
  char options[] = "qhull d Qbb Qt Q12 Qz";
  const int failed = qh_new_qhull(&hull.state, 3, static_cast<int>(points.size()),
                                  coordinates.data(), False, options, nullptr, hull.messages);
  if (failed)
    return make_error(ErrorCode::kInput, "cannot triangulate {} points ({})", points.size(),
                      first_message(hull));
  qhT* const qh = &hull.state;  // the name that Qhull's macros use
  std::vector<std::uint32_t> to_index(qh->facet_id, Tetrahedron::kNone);
  std::vector<const facetT*> facets;
  std::vector<Tetrahedron> tetrahedra;
  facetT* facet = nullptr;
  FORALLfacets {
    if (facet->upperdelaunay || !facet->simplicial) continue;
    Tetrahedron t;
    int corner = 0;
    vertexT *vertex = nullptr, **vertexp = nullptr;
    FOREACHvertex_(facet->vertices) {
      const int id = qh_pointid(qh, vertex->point);
      if (id < 0 || id >= static_cast<int>(points.size()) || corner == 4) {
        corner = 5;  // the point at infinity
        break;
      }
      t.points[static_cast<std::size_t>(corner++)] = static_cast<std::uint32_t>(id);
    }
    if (corner != 4) continue;
    std::sort(t.points.begin(), t.points.end());
    if (!circumscribe(points, t)) continue;
    to_index[facet->id] = static_cast<std::uint32_t>(tetrahedra.size());
    facets.push_back(facet);
    tetrahedra.push_back(t);
  }
  for (std::size_t i = 0; i < facets.size(); ++i) {
    std::size_t side = 0;
    tetrahedra[i].neighbors.fill(Tetrahedron::kNone);
    facetT *neighbor = nullptr, **neighborp = nullptr;
    FOREACHneighbor_(facets[i]) {
      if (side < 4) tetrahedra[i].neighbors[side++] = to_index[neighbor->id];
    }
  }
  return tetrahedra;
}

}  // namespace polymorph
