#include "analyze/analyze.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "analyze/correspondence_metrics.h"
#include "analyze/distortion.h"
#include "analyze/measure.h"
#include "analyze/smoothness.h"
#include "base/box.h"
#include "base/procrustes.h"
#include "base/result.h"
#include "morph/features.h"

namespace polymorph {
namespace {

constexpr double kDegreesPerRadian = 180 / std::numbers::pi;

/// Returns the source moved by the fraction u of the known similarity `truth`: rotated and scaled
/// about its centroid, which moves on a straight line. `recovered` is the plan's similarity.
Mesh ground_truth_at(const Mesh& source, const Similarity& truth,
                     const std::optional<Similarity>& recovered, double u) {
  Vec3d center;
  for (const Vec3& p : source.positions) center = center + Vec3d(p);
  center = center * (1 / static_cast<double>(source.positions.size()));
  const Vec3d end = truth.rotation * center * truth.scale + truth.shift;
  Vec3d axis_angle = log_rotation(truth.rotation);
  // A rotation by nearly 180 degrees has two axis-angle vectors of nearly equal length and opposite
  // directions. Use the one on the side of the plan's rotation.
  constexpr double kNearlyPi = 179 / kDegreesPerRadian;
  if (recovered && length(axis_angle) > kNearlyPi &&
      dot(axis_angle, log_rotation(recovered->rotation)) < 0)
    axis_angle = axis_angle * (-(2 * std::numbers::pi - length(axis_angle)) / length(axis_angle));
  const Mat3 rotation = exp_rotation(axis_angle * u);
  const double scale = std::pow(truth.scale, u);
  Mesh moved = source;
  for (Vec3& p : moved.positions)
    p = to_float(center * (1 - u) + end * u + rotation * (Vec3d(p) - center) * scale);
  return moved;
}

/// Returns the RMS distance that the balls move between two frames, weighted by mass.
double rms_step(const MorphFrame& a, const MorphFrame& b, const std::vector<double>& masses) {
  double sum = 0, mass = 0;
  for (std::size_t e = 0; e < a.centers.size(); ++e) {
    const Vec3d d = Vec3d(b.centers[e]) - Vec3d(a.centers[e]);
    sum += masses[e] * dot(d, d);
    mass += masses[e];
  }
  return mass > 0 ? std::sqrt(sum / mass) : 0;
}

/// Computes the strain of each frame (FrameMeasures::strain, principle 4): distances between
/// neighbouring balls are compared with distances interpolated between the ends. `size` is L.
std::vector<double> compute_strains(const std::vector<MorphFrame>& frames, double size) {
  std::vector<double> result(frames.size(), 0);
  const std::vector<Vec3>& first = frames.front().centers;
  const std::vector<Vec3>& last = frames.back().centers;
  const auto neighbors = nearest_neighbors(first, /*count=*/8);
  for (std::size_t k = 0; k < frames.size(); ++k) {
    double sum = 0;
    std::size_t count = 0;
    for (std::size_t e = 0; e < first.size(); ++e)
      for (const std::uint32_t f : neighbors[e]) {
        const auto distance = [&](const std::vector<Vec3>& centers) {
          return length(Vec3d(centers[e]) - Vec3d(centers[f]));
        };
        // Skip balls that nearly coincide, because their ratio is undefined: a source ball that is
        // divided among several pairs gives several moving balls with one center.
        const double expected = (1 - frames[k].u) * distance(first) + frames[k].u * distance(last);
        const double actual = distance(frames[k].centers);
        if (expected < 1e-3 * size || actual < 1e-6 * size) continue;
        sum += std::pow(std::log(actual / expected), 2);
        ++count;
      }
    if (count > 0) result[k] = std::sqrt(sum / static_cast<double>(count));
  }
  return result;
}

/// Returns the vertices of both objects.
std::vector<Vec3> object_points(const MorphEnds& ends) {
  std::vector<Vec3> points = ends.source.positions;
  points.insert(points.end(), ends.target.positions.begin(), ends.target.positions.end());
  return points;
}

/// A morph with the values that several metrics need.
struct MeasuredMorph {
  const MorphEnds& ends;
  const std::vector<MorphFrame>& frames;
  double size = 1;  ///< L: diagonal of the bounding box of both objects
  bool has_balls = false;
};

/// Hausdorff distances of the first and last frame from the objects, over L.
struct EndErrors {
  double source = 0, target = 0;
};

/// Appends the measures of every frame to `analysis.frames`. Returns the errors at the ends.
EndErrors measure_frames(const MeasuredMorph& morph, Analysis& analysis) {
  constexpr double kHullMargin = 0.02;  // over L
  const DilatedHull hull(object_points(morph.ends), kHullMargin * morph.size);
  const RoughnessScale scale =
      roughness_scale(unite(bounding_box(morph.frames.front().surface.positions),
                            bounding_box(morph.frames.back().surface.positions)));
  const Mesh& first = morph.frames.front().surface;
  const bool has_distortion =
      std::all_of(morph.frames.begin(), morph.frames.end(),
                  [&](const MorphFrame& frame) { return corresponds(first, frame.surface); });
  EndErrors errors;
  std::optional<MeasuredSurface> previous;
  // Measure each surface, and the step to it from the previous one.
  for (const MorphFrame& frame : morph.frames) {
    FrameMeasures row = measure_frame(frame);
    if (has_distortion) row.distortion = conformal_distortion(first, frame.surface);
    row.roughness = measure_roughness(frame.surface, scale);
    row.leakage = hull.leakage(frame.surface);
    MeasuredSurface current(frame.surface);
    if (morph.ends.truth) {
      const MeasuredSurface reference(ground_truth_at(morph.frames[0].surface, *morph.ends.truth,
                                                      morph.ends.recovered, frame.u));
      row.off_similarity = current.distance_to(reference).largest / morph.size;
    }
    if (previous) {
      FrameMeasures& previous_row = analysis.frames.back();
      const MeasuredSurface::Distance step = previous->distance_to(current);
      previous_row.step = step.mean;
      previous_row.farthest = step.largest;
      previous_row.rate =
          row.u - previous_row.u > 0 ? previous_row.step / (row.u - previous_row.u) : 0;
    } else {
      errors.source = current.distance_to(MeasuredSurface(morph.ends.source)).largest / morph.size;
    }
    previous = std::move(current);
    analysis.frames.push_back(std::move(row));
  }
  errors.target = previous->distance_to(MeasuredSurface(morph.ends.target)).largest / morph.size;
  // Measure the balls.
  for (std::size_t k = 0; k + 1 < morph.frames.size(); ++k)
    analysis.frames[k].speed =
        morph.has_balls ? rms_step(morph.frames[k], morph.frames[k + 1], morph.ends.masses)
                        : analysis.frames[k].step;
  if (!morph.has_balls) return errors;
  const std::vector<double> strain = compute_strains(morph.frames, morph.size);
  for (std::size_t k = 0; k < strain.size(); ++k) analysis.frames[k].strain = strain[k];
  return errors;
}

/// Appends attributes: the purity corrected for chance, as Cohen's kappa.
void add_attributes(const MeasuredMorph& morph, Analysis& analysis) {
  std::optional<double> value;
  if (morph.ends.purity && morph.ends.chance && *morph.ends.chance < 1)
    value = (*morph.ends.purity - *morph.ends.chance) / (1 - *morph.ends.chance);
  analysis.metrics.push_back({"attributes", "1 attributes", value, ">= 0.95",
                              "share of the volume that keeps its label, beyond chance"});
}

/// Appends topology, the changes of the number of components and of the genus, and parts.
void add_topology(Analysis& analysis) {
  const std::vector<FrameMeasures>& rows = analysis.frames;
  double changes = 0;
  const auto components = [](const FrameMeasures& row) {
    return static_cast<double>(row.surface.components);
  };
  const auto genus = [](const FrameMeasures& row) {
    return static_cast<double>(row.surface.genus);
  };
  for (std::size_t k = 0; k + 1 < rows.size(); ++k)
    changes += std::abs(components(rows[k + 1]) - components(rows[k])) +
               std::abs(genus(rows[k + 1]) - genus(rows[k]));
  changes -= std::abs(components(rows.back()) - components(rows.front())) +
             std::abs(genus(rows.back()) - genus(rows.front()));
  analysis.metrics.push_back({"topology", "2 topology", changes, "<= 0",
                              "changes of parts and handles beyond those between the ends"});
  double largest = 0;
  for (const FrameMeasures& row : rows) largest = std::max(largest, components(row));
  analysis.metrics.push_back(
      {"parts", "2 topology", largest,
       fmt::format("<= {:g}", std::max(components(rows.front()), components(rows.back()))),
       "largest number of parts at once; goal: as many as the larger end has"});
}

void add_features(const MeasuredMorph& morph, const EndErrors& errors, Analysis& analysis) {
  std::optional<double> landmarks;
  for (const double error : morph.ends.landmark_errors)
    landmarks = std::max(landmarks.value_or(0), error / morph.size);
  analysis.metrics.push_back(
      {"landmarks", "3 features", landmarks, "<= 0.05", "largest error of a landmark, over L"});
  analysis.metrics.push_back({"source_error", "3 features", errors.source, "<= 0.02",
                              "Hausdorff distance of the first frame from the source, over L"});
  analysis.metrics.push_back({"target_error", "3 features", errors.target, "<= 0.02",
                              "Hausdorff distance of the last frame from the target, over L"});
}

void add_rigidity(const MeasuredMorph& morph, Analysis& analysis) {
  const std::vector<FrameMeasures>& rows = analysis.frames;
  std::optional<double> value;
  if (morph.has_balls) {
    double sum = 0;
    for (const FrameMeasures& row : rows) sum += row.strain * row.strain;
    value = std::sqrt(sum / static_cast<double>(rows.size()));
  }
  analysis.metrics.push_back(
      {"rigidity", "4 rigidity", value, "<= 0.3",
       "RMS of ln(distance of neighbouring balls / the distance interpolated between the ends)"});
}

/// Appends backtrack and dip of the volume, and area_backtrack and area_dip of the area. A
/// backtrack is the sum of all steps against the direction from the first to the last frame, a dip
/// the smallest value of all frames over the smaller end's.
void add_monotonicity(Analysis& analysis) {
  const std::vector<FrameMeasures>& rows = analysis.frames;
  const auto add_backtrack_and_dip = [&](const char* backtrack, const char* dip, const auto& value,
                                         const char* backtrack_definition,
                                         const char* dip_definition) {
    const double first = value(rows.front()), last = value(rows.back());
    double backtrack_sum = 0, lowest = first;
    for (std::size_t k = 0; k + 1 < rows.size(); ++k) {
      const double step = value(rows[k + 1]) - value(rows[k]);
      const double sign = last > first ? 1 : last < first ? -1 : 0;
      backtrack_sum += std::max(0.0, -sign * step);
      lowest = std::min(lowest, value(rows[k + 1]));
    }
    analysis.metrics.push_back({backtrack, "6 monotonicity", backtrack_sum / std::max(first, last),
                                "<= 0.005", backtrack_definition});
    analysis.metrics.push_back(
        {dip, "6 monotonicity", lowest / std::min(first, last), ">= 0.98", dip_definition});
  };
  add_backtrack_and_dip(
      "backtrack", "dip", [](const FrameMeasures& row) { return row.surface.volume; },
      "volume lost against the trend, over the larger end's",
      "smallest volume over the smaller end's");
  add_backtrack_and_dip(
      "area_backtrack", "area_dip", [](const FrameMeasures& row) { return row.surface.area; },
      "area lost against the trend, over the larger end's", "smallest area over the smaller end's");
}

/// Appends nonlinearity and the errors of the plan's similarity. These metrics have no values
/// unless the target is the source moved by a similarity.
void add_transformations(const MeasuredMorph& morph, Analysis& analysis) {
  const std::vector<FrameMeasures>& rows = analysis.frames;
  std::optional<double> error, angle, scale, shift;
  if (morph.ends.truth) {
    error = 0;
    for (const FrameMeasures& row : rows) error = std::max(*error, *row.off_similarity);
    if (morph.ends.recovered) {
      angle =
          rotation_angle(transposed(morph.ends.truth->rotation) * morph.ends.recovered->rotation) *
          kDegreesPerRadian;
      scale = std::abs(morph.ends.recovered->scale / morph.ends.truth->scale - 1);
      // The two shifts are compared at the center of the source.
      const Vec3d center(bounding_box(morph.ends.source.positions).center());
      const auto transform_center = [&](const Similarity& s) {
        return s.rotation * center * s.scale + s.shift;
      };
      shift =
          length(transform_center(*morph.ends.recovered) - transform_center(*morph.ends.truth)) /
          morph.size;
    }
  }
  analysis.metrics.push_back(
      {"nonlinearity", "7 nonlinearity", error, "<= 0.02",
       "Hausdorff distance from the moved source, over L, if the target is the source moved"});
  analysis.metrics.push_back(
      {"rotation_error", "8 transformation groups", angle, "<= 0.5", "degrees"});
  analysis.metrics.push_back(
      {"scale_error", "8 transformation groups", scale, "<= 0.01", "relative"});
  analysis.metrics.push_back(
      {"translation_error", "8 transformation groups", shift, "<= 0.01", "over L"});
}

void add_slow_in_out(Analysis& analysis) {
  const std::vector<FrameMeasures>& rows = analysis.frames;
  double largest = 0, peak = 0;
  for (std::size_t k = 0; k + 1 < rows.size(); ++k)
    if (rows[k].speed > largest) {
      largest = rows[k].speed;
      peak = (rows[k].time + rows[k + 1].time) / 2;
    }
  const bool moves = largest > 0;
  const auto over_largest = [&](std::size_t k) {
    return moves ? std::optional(rows[k].speed / largest) : std::nullopt;
  };
  analysis.metrics.push_back(
      {"slow_in", "9 slow-in, slow-out", over_largest(0), "<= 0.3", "first step over the largest"});
  analysis.metrics.push_back({"slow_out", "9 slow-in, slow-out", over_largest(rows.size() - 2),
                              "<= 0.3", "last step over the largest"});
  analysis.metrics.push_back({"peak", "9 slow-in, slow-out",
                              moves ? std::optional(peak) : std::nullopt, "",
                              "time of the largest step; goal 0.4 to 0.6"});
}

void add_surface_checks(Analysis& analysis) {
  const std::vector<FrameMeasures>& rows = analysis.frames;
  double leakage = 0, invalid_surfaces = 0;
  for (const FrameMeasures& row : rows) {
    leakage = std::max(leakage, row.leakage);
    invalid_surfaces += row.surface.is_manifold() && row.surface.triangles > 0 ? 0 : 1;
  }
  const double volume = std::max(rows.front().surface.volume, rows.back().surface.volume);
  analysis.metrics.push_back(
      {"leakage", "10 no leakage", volume > 0 ? leakage / volume : leakage, "<= 0",
       "largest volume outside both objects' hull, dilated by 2 % of L, over the larger end's"});
  analysis.metrics.push_back({"bad_surfaces", "surface", invalid_surfaces, "<= 0",
                              "frames without a surface that is closed, manifold and oriented"});
}

/// Appends all metrics. `analysis` already contains the measures of the frames.
void add_metrics(const MeasuredMorph& morph, const EndErrors& errors, Analysis& analysis) {
  add_attributes(morph, analysis);
  add_topology(analysis);
  add_features(morph, errors, analysis);
  add_correspondence_metrics(morph.ends, analysis);
  add_rigidity(morph, analysis);
  add_smoothness_metrics(morph.ends, morph.frames, morph.size, analysis);
  add_roughness_metrics(analysis);
  add_step_metrics(morph.ends, morph.frames, morph.size, analysis);
  add_monotonicity(analysis);
  add_body_metrics(analysis);
  add_transformations(morph, analysis);
  add_slow_in_out(analysis);
  add_surface_checks(analysis);
}

}  // namespace

const Metric* Analysis::find(const std::string& name) const {
  for (const Metric& metric : metrics)
    if (metric.name == name) return &metric;
  return nullptr;
}

std::string morph_name(const Analysis& morph) {
  return fmt::format("{}{}{} -> {}", morph.actor, morph.actor.empty() ? "" : ": ", morph.from,
                     morph.to);
}

Analysis analyze_morph(const MorphEnds& ends, const std::vector<MorphFrame>& frames) {
  PM_CHECK(frames.size() >= 2);
  const MeasuredMorph morph = {
      ends, frames, static_cast<double>(bounding_box(object_points(ends)).diagonal()),
      std::any_of(frames.begin(), frames.end(),
                  [](const MorphFrame& frame) { return !frame.centers.empty(); })};
  Analysis analysis;
  analysis.actor = ends.actor;
  analysis.from = ends.from;
  analysis.to = ends.to;
  const EndErrors errors = measure_frames(morph, analysis);
  add_metrics(morph, errors, analysis);
  return analysis;
}

std::vector<std::string> metric_names() {
  // Every morph has all metrics, so frames that were not measured name them.
  MorphEnds ends;
  ends.source_shown = ends.target_shown = false;
  const std::vector<MorphFrame> frames(2);
  Analysis analysis;
  analysis.frames.resize(frames.size());
  add_metrics({ends, frames}, {}, analysis);
  std::vector<std::string> names;
  for (const Metric& metric : analysis.metrics) names.push_back(metric.name);
  return names;
}

std::optional<Similarity> fit_similarity(const std::vector<Vec3>& from,
                                         const std::vector<Vec3>& to) {
  if (from.size() != to.size() || from.size() < 4) return std::nullopt;
  const auto count = static_cast<double>(from.size());
  PairMoments moments;
  for (std::size_t i = 0; i < from.size(); ++i) {
    moments.from_center = moments.from_center + Vec3d(from[i]) * (1 / count);
    moments.to_center = moments.to_center + Vec3d(to[i]) * (1 / count);
  }
  for (std::size_t i = 0; i < from.size(); ++i)
    moments.add(Vec3d(from[i]) - moments.from_center, Vec3d(to[i]) - moments.to_center,
                /*weight=*/1);
  if (!(moments.from_square > 0 && moments.to_square > 0)) return std::nullopt;
  Similarity fit{nearest_rotation(moments.covariance), moments.scale(), /*shift=*/{}};
  fit.shift = moments.to_center - fit.rotation * moments.from_center * fit.scale;
  double max_error = 0;
  for (std::size_t i = 0; i < from.size(); ++i) {
    const Vec3d d = fit.rotation * Vec3d(from[i]) * fit.scale + fit.shift - Vec3d(to[i]);
    max_error = std::max(max_error, length(d));
  }
  constexpr double kTolerance = 1e-3;
  if (max_error > kTolerance * std::sqrt(moments.to_square / count)) return std::nullopt;
  return fit;
}

}  // namespace polymorph
