#include "analyze/measure.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/box.h"
#include "kernels/linear.h"
#include "mesh/closest.h"
#include "mesh/inside.h"
#include "mesh/normals.h"
#include "mesh/sample_surface.h"
#include "model/model.h"

namespace polymorph {
namespace {

constexpr std::size_t kSamples = 4000;  // per surface

Model make_model(std::span<const Vec3> points, std::span<const Triangle> triangles) {
  Model model;
  model.points.assign(points.begin(), points.end());
  model.triangles.assign(triangles.begin(), triangles.end());
  return model;
}

/// Distances from samples of one surface to the other surface.
struct OneSidedDistance {
  double mean = 0, largest = 0;
};

}  // namespace

double bending_energy(const Mesh& mesh) {
  // The divergence of the normal is twice the mean curvature. It is averaged at the vertices,
  // weighted by area, because the divergence on a thin triangle of marching cubes is noise.
  const std::size_t n = mesh.positions.size();
  const std::vector<Vec3> averaged_normals =
      mesh.normals.size() == n ? std::vector<Vec3>()
                               : point_normals(make_model(mesh.positions, mesh.triangles));
  const std::vector<Vec3>& normals = mesh.normals.size() == n ? mesh.normals : averaged_normals;
  std::vector<double> area(n, 0), curvature(n, 0);  // per vertex: its area, and area times H
  for (const Triangle& t : mesh.triangles) {
    Vec3d p[3], normal[3];
    for (int k = 0; k < 3; ++k) {
      p[k] = Vec3d(mesh.positions[t.v[k]]);
      normal[k] = Vec3d(normals[t.v[k]]);
    }
    const Vec3d normal_twice_area = cross(p[1] - p[0], p[2] - p[0]);
    const double twice_area = length(normal_twice_area);
    if (!(twice_area > 0)) continue;
    const Vec3d unit_normal = normal_twice_area * (1 / twice_area);
    double flux = 0;  // area times divergence of the normal
    for (int k = 0; k < 3; ++k)
      flux += dot(normal[k], cross(unit_normal, p[(k + 2) % 3] - p[(k + 1) % 3])) / 2;
    for (int k = 0; k < 3; ++k) {
      area[t.v[k]] += twice_area / 6;
      curvature[t.v[k]] += flux / 6;  // a third of the area times H
    }
  }
  double sum = 0;
  for (std::size_t v = 0; v < n; ++v)
    if (area[v] > 0) sum += curvature[v] * curvature[v] / area[v];
  return sum;
}

struct MeasuredSurface::Data {
  std::vector<Vec3> samples;
  std::vector<Vec3> normals;  ///< one per triangle
  ClosestPointQuery query;

  /// Measures the distances of `points` to this surface. Points that lie deeper than `hidden_depth`
  /// inside it are left out.
  OneSidedDistance distance_from(const std::vector<Vec3>& points, double hidden_depth) const {
    OneSidedDistance result;
    const std::vector<ClosestPoint> closest = query.closest(points);
    std::size_t count = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const ClosestPoint& hit = closest[i];
      const auto distance = static_cast<double>(hit.distance);
      if (distance > hidden_depth && dot(normals[hit.triangle], points[i] - hit.point) < 0)
        continue;
      result.mean += distance;
      result.largest = std::max(result.largest, distance);
      ++count;
    }
    if (count > 0) result.mean /= static_cast<double>(count);
    return result;
  }
};

MeasuredSurface::MeasuredSurface(std::span<const Vec3> points, std::span<const Triangle> triangles)
    : data_(new Data{/*samples=*/{}, /*normals=*/{}, ClosestPointQuery(points, triangles)}) {
  const Model model = make_model(points, triangles);
  for (const SurfaceSample& sample : sample_surface(model, kSamples))
    data_->samples.push_back(sample.point);
  data_->normals = face_normals(model);
}
MeasuredSurface::~MeasuredSurface() = default;
MeasuredSurface::MeasuredSurface(MeasuredSurface&&) noexcept = default;
MeasuredSurface& MeasuredSurface::operator=(MeasuredSurface&&) noexcept = default;

bool MeasuredSurface::empty() const { return data_->samples.empty(); }

MeasuredSurface::Distance MeasuredSurface::distance_to(const MeasuredSurface& other,
                                                       double hidden_depth) const {
  if (empty() && other.empty()) return {};
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  if (empty() || other.empty()) return {kInfinite, kInfinite};
  const OneSidedDistance forward = other.data_->distance_from(data_->samples, hidden_depth);
  const OneSidedDistance backward = data_->distance_from(other.data_->samples, kInfinite);
  return {(forward.mean + backward.mean) / 2, std::max(forward.largest, backward.largest)};
}

DilatedHull::DilatedHull(std::span<const Vec3> points, double margin) {
  constexpr int kDirections = 512;
  // Spherical Fibonacci points (Gonzalez 2010): each is rotated by the golden angle.
  constexpr double kGoldenAngle = 2.399963229728653;  // radians
  for (int i = 0; i < kDirections; ++i) {
    const double z = 1 - (2.0 * i + 1) / kDirections, radius = std::sqrt(1 - z * z);
    directions_.push_back(to_float(
        Vec3d{radius * std::cos(kGoldenAngle * i), radius * std::sin(kGoldenAngle * i), z}));
    float limit = -std::numeric_limits<float>::infinity();
    for (const Vec3& p : points) limit = std::max(limit, dot(p, directions_.back()));
    limits_.push_back(limit + static_cast<float>(margin));
  }
}

bool DilatedHull::contains(Vec3 point) const {
  for (std::size_t k = 0; k < directions_.size(); ++k)
    if (dot(point, directions_[k]) > limits_[k]) return false;
  return true;
}

double DilatedHull::leakage(const Mesh& mesh) const {
  if (std::all_of(mesh.positions.begin(), mesh.positions.end(),
                  [&](Vec3 p) { return contains(p); }))
    return 0;
  const Box box = bounding_box(mesh.positions);
  const Vec3 size = box.size();
  constexpr double kPoints = 50000;
  const double cell = std::cbrt(static_cast<double>(size.x) * static_cast<double>(size.y) *
                                static_cast<double>(size.z) / kPoints);
  const auto step = static_cast<float>(cell);
  // A mesh thinner than a cell, such as a flat one, has next to no volume.
  if (std::min({size.x, size.y, size.z}) <= step / 2) return 0;
  std::vector<Vec3> points;
  for (float z = box.low.z + step / 2; z < box.high.z; z += step)
    for (float y = box.low.y + step / 2; y < box.high.y; y += step)
      for (float x = box.low.x + step / 2; x < box.high.x; x += step)
        if (!contains({x, y, z})) points.push_back({x, y, z});
  std::size_t count = 0;
  for (const std::uint8_t is_inside :
       InsideTest(make_model(mesh.positions, mesh.triangles)).inside(points))
    count += is_inside;
  return static_cast<double>(count) * cell * cell * cell;
}

}  // namespace polymorph
