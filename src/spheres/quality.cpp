#include "spheres/quality.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/random.h"
#include "field/extract_surface.h"
#include "field/sample_field.h"
#include "kernels/linear.h"
#include "mesh/closest.h"
#include "mesh/sample_surface.h"
#include "model/repair/diagnose.h"

namespace polymorph {
namespace {

/// Numbers of lattice points inside the model, inside the field's surface (field > 1), and in both.
struct Counts {
  std::size_t model = 0, field = 0, both = 0;
};

/// Points of a jittered lattice through the model's box and a margin. Each represents a cell of
/// `volume`.
struct Lattice {
  std::vector<Vec3> points;
  double volume = 0;
};
Lattice make_lattice(const Model& model, double point_count) {
  const Box box = model.box();
  const float margin = 0.03f * box.diagonal();
  const Vec3 size = box.size() + Vec3{2, 2, 2} * margin, low = box.low - Vec3{1, 1, 1} * margin;
  const double step = cube_root(static_cast<double>(size.x) * static_cast<double>(size.y) *
                                static_cast<double>(size.z) / point_count);
  const auto steps = [&](float length) { return static_cast<int>(length / step) + 1; };
  const int nx = steps(size.x), ny = steps(size.y), nz = steps(size.z);
  Lattice lattice{{}, step * step * step};
  std::vector<Vec3>& points = lattice.points;
  points.reserve(static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny) *
                 static_cast<std::size_t>(nz));
  for (int z = 0; z < nz; ++z)
    for (int y = 0; y < ny; ++y)
      for (int x = 0; x < nx; ++x) {
        const std::uint64_t i = points.size();
        const auto at = [&](int k, std::uint64_t stream) {
          return static_cast<float>(step *
                                    (k + static_cast<double>(random_float(/*seed=*/7, stream, i))));
        };
        points.push_back(low + Vec3{at(x, 0), at(y, 1), at(z, 2)});
      }
  return lattice;
}

Result<Counts> count_lattice(const Model& model, const InsideTest& inside,
                             const std::vector<Ball>& balls, FieldKind kind, double point_count) {
  const std::vector<Vec3> points = make_lattice(model, point_count).points;
  const std::vector<std::uint8_t> is_inside = inside.inside(points);
  ExtractSettings settings;
  settings.field = kind;
  PM_TRY(const std::vector<float> values, sample_field(*make_cpu_engine(), balls, points, settings,
                                                       "measuring how well the balls fit"));
  Counts counts;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const bool field = values[i] > 1;
    counts.model += is_inside[i];
    counts.field += field;
    counts.both += field && is_inside[i];
  }
  return counts;
}

/// Distances relative to the model's diagonal. The defaults stand for a field without a surface.
struct Distances {
  double rms = 1, largest = 1;
};

/// Measures the distances of points from a surface. The RMS is that of the first `rms_count`
/// points.
Distances measure_distances(const std::vector<Vec3>& points, const ClosestPointQuery& target,
                            double diagonal, std::size_t rms_count) {
  Distances result{/*rms=*/0, /*largest=*/0};
  const std::vector<ClosestPoint> closest = target.closest(points);
  for (std::size_t i = 0; i < closest.size(); ++i) {
    const double d = static_cast<double>(closest[i].distance) / diagonal;
    if (i < rms_count) result.rms += d * d;
    result.largest = std::max(result.largest, d);
  }
  result.rms = std::sqrt(result.rms / static_cast<double>(std::max<std::size_t>(rms_count, 1)));
  return result;
}

/// Lists `count` evenly distributed samples of a mesh, then its vertices.
std::vector<Vec3> list_points(const Mesh& mesh, std::size_t count) {
  Model model;
  model.points = mesh.positions;
  model.triangles = mesh.triangles;
  std::vector<Vec3> points;
  for (const SurfaceSample& s : sample_surface(model, count)) points.push_back(s.point);
  points.insert(points.end(), mesh.positions.begin(), mesh.positions.end());
  return points;
}

std::vector<Vec3> list_points(const std::vector<BoundarySample>& samples) {
  std::vector<Vec3> points;
  for (const BoundarySample& s : samples) points.push_back(s.point);
  return points;
}

constexpr std::size_t kSamples = 20000;  // per surface

}  // namespace

Result<ApproximationQuality> measure_quality(const Model& model, const InsideTest& inside,
                                             const std::vector<Ball>& balls, FieldKind kind,
                                             const QualitySettings& settings) {
  const Vec3 size = model.box().size();
  const double diagonal = static_cast<double>(model.box().diagonal());
  const auto engine = make_cpu_engine();
  ExtractSettings extract;
  extract.field = kind;
  const float cell = std::max({size.x, size.y, size.z}) / static_cast<float>(settings.grid);
  PM_TRY(const Mesh mesh, extract_surface(*engine, balls, cell, extract));
  PM_TRY(const Counts counts, count_lattice(model, inside, balls, kind, settings.points));
  ApproximationQuality quality;
  quality.triangles = mesh.triangles.size();
  // At least 1, as a divisor.
  const auto clamped_count = [](std::size_t n) {
    return static_cast<double>(std::max<std::size_t>(n, 1));
  };
  quality.iou =
      static_cast<double>(counts.both) / clamped_count(counts.model + counts.field - counts.both);
  quality.volume_ratio = static_cast<double>(counts.field) / clamped_count(counts.model);
  Distances to_model, to_surface;
  if (!mesh.triangles.empty()) {
    to_model = measure_distances(list_points(mesh, kSamples), ClosestPointQuery(model), diagonal,
                                 kSamples);
    const std::vector<Vec3> boundary = list_points(sample_boundary(model, inside, kSamples));
    to_surface = measure_distances(boundary, ClosestPointQuery(mesh.positions, mesh.triangles),
                                   diagonal, boundary.size());
  }
  quality.rms_to_model = to_model.rms;
  quality.hausdorff_to_model = to_model.largest;
  quality.rms_to_surface = to_surface.rms;
  quality.hausdorff_to_surface = to_surface.largest;
  return quality;
}

bool is_good_fit(const ApproximationQuality& quality) {
  constexpr double kMinOverlap = 0.7, kMaxDistance = 0.15;
  return quality.iou >= kMinOverlap &&
         std::max(quality.hausdorff_to_model, quality.hausdorff_to_surface) <= kMaxDistance;
}

std::string describe_fit(const ApproximationQuality& quality) {
  const bool is_good = is_good_fit(quality);
  return fmt::format("the balls fit {}: {:.0f} % overlap, up to {:.0f} % of the size off{}",
                     is_good ? "well" : "poorly", 100 * quality.iou,
                     100 * std::max(quality.hausdorff_to_model, quality.hausdorff_to_surface),
                     is_good ? "" : " - use more balls, or fix what `check` reports");
}

Result<double> hausdorff_distance(const Model& model, const std::vector<BoundarySample>& samples,
                                  const Approximation& approximation) {
  const double diagonal = static_cast<double>(model.box().diagonal());
  if (approximation.balls.empty()) {  // no fit: the spheres themselves represent the model
    double largest = 0;
    const std::vector<Sphere> spheres = approximation.tree.leaves();
    for (const BoundarySample& s : samples) {
      double nearest = diagonal;
      for (const Sphere& sphere : spheres)
        nearest =
            std::min(nearest, static_cast<double>(length(s.point - sphere.center) - sphere.radius));
      largest = std::max(largest, nearest);
    }
    return largest / diagonal;
  }
  const auto engine = make_cpu_engine();
  PM_TRY(const Mesh mesh,
         extract_surface(*engine, approximation.balls, model.box().diagonal() / 300, {}));
  if (mesh.triangles.empty()) return 1.0;
  const Distances forward =
      measure_distances(mesh.positions, ClosestPointQuery(model), diagonal, /*rms_count=*/0);
  const Distances backward = measure_distances(
      list_points(samples), ClosestPointQuery(mesh.positions, mesh.triangles), diagonal,
      /*rms_count=*/0);
  return std::max(forward.largest, backward.largest);
}

double solid_volume(const Model& model, const InsideTest& inside) {
  const Diagnosis diagnosis = diagnose(model);
  if (diagnosis.closed && diagnosis.shells == 1 && diagnosis.volume > 0) return diagnosis.volume;
  const Lattice lattice = make_lattice(model, /*point_count=*/2e5);
  double volume = 0;
  for (const std::uint8_t is_inside : inside.inside(lattice.points))
    volume += is_inside * lattice.volume;
  return volume;
}

Result<double> lattice_volume_ratio(const Model& model, const InsideTest& inside,
                                    const std::vector<Ball>& balls) {
  PM_TRY(const Counts counts,
         count_lattice(model, inside, balls, FieldKind::kGaussian, /*point_count=*/1e5));
  return static_cast<double>(counts.field) /
         static_cast<double>(std::max<std::size_t>(counts.model, 1));
}

}  // namespace polymorph
