#include "analyze/mesh_difference.h"

#include <algorithm>

#include "analyze/measure.h"

namespace polymorph {
namespace {

bool are_equal(const Model& a, const Model& b) {
  const auto same_triangle = [](const Triangle& s, const Triangle& t) {
    return s.v[0] == t.v[0] && s.v[1] == t.v[1] && s.v[2] == t.v[2];
  };
  return a.points == b.points && std::equal(a.triangles.begin(), a.triangles.end(),
                                            b.triangles.begin(), b.triangles.end(), same_triangle);
}

}  // namespace

MeshDifference mesh_difference(const Model& actual, const Model& reference) {
  MeshDifference difference;
  difference.is_same = are_equal(actual, reference);
  if (difference.is_same) return difference;
  const MeasuredSurface actual_surface(actual.points, actual.triangles),
      reference_surface(reference.points, reference.triangles);
  const MeasuredSurface::Distance distance = actual_surface.distance_to(reference_surface);
  const auto size = static_cast<double>(reference.box().diagonal());
  difference.mean = distance.mean / size;
  difference.largest = distance.largest / size;
  return difference;
}

}  // namespace polymorph
