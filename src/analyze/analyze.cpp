#include "analyze/analyze.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

#include "analyze/measure.h"
#include "analyze/smoothness.h"
#include "base/box.h"
#include "base/result.h"
#include "mesh/closest.h"
#include "morph/features.h"

namespace polymorph {
namespace {

constexpr double kDegrees = 57.29577951308232;
constexpr double kPi = 3.141592653589793;

/// The source on its way to the target, when that is the source moved: a rotation and a scaling
/// about the middle, which goes straight.
Mesh on_the_way(const Mesh& source, const Similarity& truth,
                const std::optional<Similarity>& recovered, double u) {
  Vec3d middle;
  for (const Vec3& p : source.positions) middle = middle + Vec3d(p);
  middle = middle * (1 / static_cast<double>(source.positions.size()));
  const Vec3d end = truth.rotation * middle * truth.scale + truth.shift;
  Vec3d way = log_rotation(truth.rotation);
  // Half a turn goes either way round: the one that was taken.
  constexpr double kNearlyHalf = 179 / kDegrees;
  if (recovered && length(way) > kNearlyHalf && dot(way, log_rotation(recovered->rotation)) < 0)
    way = way * (-(2 * kPi - length(way)) / length(way));
  const Mat3 turn = exp_rotation(way * u);
  const double scale = std::pow(truth.scale, u);
  Mesh moved = source;
  for (Vec3& p : moved.positions)
    p = to_float(middle * (1 - u) + end * u + turn * (Vec3d(p) - middle) * scale);
  return moved;
}

/// Without the faces that lie deeper than `depth` inside a closed surface: a spout goes on inside
/// its pot, where its end is not visible.
Mesh without_hidden(Mesh mesh, const Mesh& surface, double depth) {
  const ClosestPointQuery query(surface.positions, surface.triangles);
  const std::vector<ClosestPoint> closest = query.closest(mesh.positions);
  const auto is_hidden = [&](std::uint32_t v) {
    const ClosestPoint& near = closest[v];
    if (near.triangle == ClosestPoint::kNoTriangle) return false;
    const auto& corner = surface.triangles[near.triangle].v;
    const Vec3 a = surface.positions[corner[0]];
    const Vec3 out = cross(surface.positions[corner[1]] - a, surface.positions[corner[2]] - a);
    return static_cast<double>(near.distance) > depth &&
           dot(out, mesh.positions[v] - near.point) < 0;
  };
  std::erase_if(mesh.triangles, [&](const Triangle& t) {
    return is_hidden(t.v[0]) && is_hidden(t.v[1]) && is_hidden(t.v[2]);
  });
  return mesh;
}

double rms_step(const MorphFrame& a, const MorphFrame& b, const std::vector<double>& masses) {
  double sum = 0, mass = 0;
  for (std::size_t e = 0; e < a.centers.size(); ++e) {
    const Vec3d d = Vec3d(b.centers[e]) - Vec3d(a.centers[e]);
    sum += masses[e] * dot(d, d);
    mass += masses[e];
  }
  return mass > 0 ? std::sqrt(sum / mass) : 0;
}

/// Principle 4: how far the distances between neighbours are from those in between the ends.
std::vector<double> strains(const std::vector<MorphFrame>& frames, double size) {
  std::vector<double> result(frames.size(), 0);
  const std::vector<Vec3>& first = frames.front().centers;
  const std::vector<Vec3>& last = frames.back().centers;
  const auto neighbors = nearest_neighbors(first, 8);
  for (std::size_t k = 0; k < frames.size(); ++k) {
    double sum = 0;
    std::size_t count = 0;
    for (std::size_t e = 0; e < first.size(); ++e)
      for (const std::uint32_t f : neighbors[e]) {
        const auto between = [&](const std::vector<Vec3>& centers) {
          return length(Vec3d(centers[e]) - Vec3d(centers[f]));
        };
        // Parts of one ball start in one place: nothing to compare with.
        const double even = (1 - frames[k].u) * between(first) + frames[k].u * between(last);
        const double now = between(frames[k].centers);
        if (even < 1e-3 * size || now < 1e-6 * size) continue;
        sum += std::pow(std::log(now / even), 2);
        ++count;
      }
    if (count > 0) result[k] = std::sqrt(sum / static_cast<double>(count));
  }
  return result;
}

class Analyzer {
 public:
  Analyzer(const MorphEnds& ends, const std::vector<MorphFrame>& frames)
      : ends_(ends), frames_(frames) {
    PM_CHECK(frames.size() >= 2);
    std::vector<Vec3> points = ends.source.positions;
    points.insert(points.end(), ends.target.positions.begin(), ends.target.positions.end());
    size_ = static_cast<double>(box_of(points).diagonal());
    points_ = std::move(points);
    for (const MorphFrame& frame : frames) has_balls_ |= !frame.centers.empty();
  }

  Analysis run() {
    analysis_.actor = ends_.actor;
    analysis_.from = ends_.from;
    analysis_.to = ends_.to;
    measure_frames();
    attributes();
    topology();
    features();
    rigidity();
    smoothness();
    add_roughness_metrics(analysis_);
    add_step_metrics(ends_, frames_, size_, analysis_);
    monotonicity();
    transformations();
    slow_in_out();
    certificates();
    return std::move(analysis_);
  }

 private:
  void add(const char* name, const char* principle, std::optional<double> value,
           const std::string& goal, const char* what) {
    analysis_.metrics.push_back({name, principle, value, goal, what});
  }
  const std::vector<FrameMeasures>& rows() const { return analysis_.frames; }

  void measure_frames() {
    constexpr double kHullMargin = 0.02;
    const DilatedHull hull(points_, kHullMargin * size_);
    const RoughnessScale scale = roughness_scale(
        unite(box_of(frames_.front().surface.positions), box_of(frames_.back().surface.positions)));
    std::optional<MeasuredSurface> previous;
    for (const MorphFrame& frame : frames_) {
      FrameMeasures row;
      row.time = frame.time;
      row.u = frame.u;
      row.surface = check_mesh(frame.surface);
      row.bending = bending_energy(frame.surface);
      row.roughness = roughness_of(frame.surface, scale);
      row.leakage = hull.leakage(frame.surface);
      MeasuredSurface now(frame.surface);
      if (ends_.truth)
        row.off_similarity =
            now.distance_to(MeasuredSurface(on_the_way(frames_[0].surface, *ends_.truth,
                                                       ends_.recovered, frame.u)))
                .largest /
            size_;
      if (previous) {
        FrameMeasures& before = analysis_.frames.back();
        const MeasuredSurface::Distance step = previous->distance_to(now);
        before.step = step.mean;
        before.farthest = step.largest;
        before.rate = row.u - before.u > 0 ? before.step / (row.u - before.u) : 0;
      } else {
        source_error_ = now.distance_to(MeasuredSurface(ends_.source)).largest / size_;
      }
      previous = std::move(now);
      analysis_.frames.push_back(std::move(row));
    }
    target_error_ = previous->distance_to(MeasuredSurface(ends_.target)).largest / size_;
    for (std::size_t k = 0; k + 1 < frames_.size(); ++k)
      analysis_.frames[k].speed = has_balls_ ? rms_step(frames_[k], frames_[k + 1], ends_.masses)
                                             : analysis_.frames[k].step;
    if (!has_balls_) return;
    const std::vector<double> strain = strains(frames_, size_);
    for (std::size_t k = 0; k < strain.size(); ++k) analysis_.frames[k].strain = strain[k];
  }

  void attributes() {
    std::optional<double> value;
    if (ends_.purity && ends_.chance && *ends_.chance < 1)
      value = (*ends_.purity - *ends_.chance) / (1 - *ends_.chance);
    add("attributes", "1 attributes", value, ">= 0.95",
        "share of the volume that keeps its label, beyond chance");
  }

  void topology() {
    double changes = 0;
    const auto parts = [](const FrameMeasures& row) {
      return static_cast<double>(row.surface.components);
    };
    const auto genus = [](const FrameMeasures& row) {
      return static_cast<double>(row.surface.genus);
    };
    for (std::size_t k = 0; k + 1 < rows().size(); ++k)
      changes += std::abs(parts(rows()[k + 1]) - parts(rows()[k])) +
                 std::abs(genus(rows()[k + 1]) - genus(rows()[k]));
    changes -= std::abs(parts(rows().back()) - parts(rows().front())) +
               std::abs(genus(rows().back()) - genus(rows().front()));
    add("topology", "2 topology", changes, "<= 0",
        "changes of parts and handles beyond those between the ends");
    double largest = 0;
    for (const FrameMeasures& row : rows()) largest = std::max(largest, parts(row));
    add("parts", "2 topology", largest,
        fmt::format("<= {:g}", std::max(parts(rows().front()), parts(rows().back()))),
        "largest number of parts at once; goal: as many as the larger end has");
  }

  void features() {
    std::optional<double> landmarks;
    for (const double error : ends_.landmark_errors)
      landmarks = std::max(landmarks.value_or(0), error / size_);
    add("landmarks", "3 features", landmarks, "<= 0.05", "largest error of a landmark, over L");
    add("source_error", "3 features", source_error_, "<= 0.02",
        "Hausdorff distance of the first frame from the source, over L");
    add("target_error", "3 features", target_error_, "<= 0.02",
        "Hausdorff distance of the last frame from the target, over L");
  }

  void rigidity() {
    std::optional<double> value;
    if (has_balls_) {
      double sum = 0;
      for (const FrameMeasures& row : rows()) sum += row.strain * row.strain;
      value = std::sqrt(sum / static_cast<double>(rows().size()));
    }
    add("rigidity", "4 rigidity", value, "<= 0.3",
        "RMS ln of neighbouring balls' distances over the even ones");
  }

  void smoothness() {
    double largest = 0;
    for (const FrameMeasures& row : rows()) largest = std::max(largest, row.bending);
    const double ends = std::max(rows().front().bending, rows().back().bending);
    add("bending", "5 smoothness", ends > 0 ? std::optional(largest / ends) : std::nullopt, "<= 1",
        "largest bending energy over the larger one of the ends");
    // Where time nearly stands still the rate is a quotient of two numbers near 0.
    constexpr double kSlow = 0.1;
    double fastest = 0;
    for (std::size_t k = 0; k + 1 < rows().size(); ++k)
      fastest = std::max(fastest, rows()[k + 1].u - rows()[k].u);
    const auto counts = [&](std::size_t k) {
      return rows()[k + 1].u - rows()[k].u > kSlow * fastest;
    };
    double pop = 0, mean = 0;
    for (const FrameMeasures& row : rows()) mean += row.rate / static_cast<double>(rows().size());
    for (std::size_t k = 1; k + 2 < rows().size(); ++k) {
      if (!counts(k - 1) || !counts(k) || !counts(k + 1)) continue;
      const double around = rows()[k - 1].rate + rows()[k + 1].rate;
      // Still surfaces only flicker by the grid: 1/1000 of the mean pace is nothing.
      if (around > 1e-3 * mean && rows()[k].rate > 1e-6 * size_)
        pop = std::max(pop, 2 * rows()[k].rate / around);
    }
    // What an even step of the volumetric stage is beside a hand-over.
    const std::size_t intervals = rows().size() - 1;
    const auto even_step = [&](bool first) {
      for (std::size_t i = 0; i < intervals; ++i) {
        const std::size_t k = first ? i : intervals - 1 - i;
        if (counts(k)) return rows()[k].rate / static_cast<double>(intervals);
      }
      return 0.0;
    };
    std::optional<double> jump;
    for (const auto& [handover, frame, first] :
         {std::tuple(&ends_.leaving, &frames_.front(), true),
          std::tuple(&ends_.arriving, &frames_.back(), false)}) {
      if (handover->shown.empty()) continue;
      const HandoverSteps steps = steps_of(*handover, frame->surface);
      jump = std::max(jump.value_or(0), steps.jump / size_);
      pop = std::max({pop, steps.pop, steps.pop_of_jump(even_step(first))});
    }
    add("pop", "5 smoothness", pop, "<= 2",
        "largest pace of a frame over its neighbours' mean; boundary stages and hand-overs count");
    add("handover", "5 smoothness", jump, "<= 0.002",
        "largest step between an object's mesh and the balls' surface, over L");
  }

  struct HandoverSteps {
    double pop = 0;                ///< among the boundary stage's own steps
    std::optional<double> before;  ///< the last of these
    double jump = 0;               ///< the step after it
    double pop_of_jump(double after) const {
      const double around = before.value_or(after) + after;
      return around > 0 ? 2 * jump / around : 0;
    }
  };
  HandoverSteps steps_of(const Handover& handover, const Mesh& surface) const {
    std::vector<double> step;
    MeasuredSurface previous(handover.shown.front());
    for (std::size_t k = 1; k < handover.shown.size(); ++k) {
      MeasuredSurface now(handover.shown[k]);
      step.push_back(previous.distance_to(now).mean);
      previous = std::move(now);
    }
    HandoverSteps steps;
    // A ten thousandth of the object is no step.
    for (std::size_t k = 1; k + 1 < step.size(); ++k)
      if (step[k] > 1e-4 * size_)
        steps.pop = std::max(steps.pop, 2 * step[k] / (step[k - 1] + step[k + 1]));
    if (!step.empty()) steps.before = step.back();
    steps.jump =
        MeasuredSurface(without_hidden(handover.shown.back(), surface, kHiddenDepth * size_))
            .distance_to(MeasuredSurface(surface))
            .mean;
    return steps;
  }

  void monotonicity() {
    const auto one = [&](const char* backtrack, const char* dip, const auto& value,
                         const char* what_back, const char* what_dip) {
      const double first = value(rows().front()), last = value(rows().back());
      double back = 0, lowest = first;
      for (std::size_t k = 0; k + 1 < rows().size(); ++k) {
        const double step = value(rows()[k + 1]) - value(rows()[k]);
        const double sign = last > first ? 1 : last < first ? -1 : 0;
        back += std::max(0.0, -sign * step);
        lowest = std::min(lowest, value(rows()[k + 1]));
      }
      add(backtrack, "6 monotonicity", back / std::max(first, last), "<= 0.005", what_back);
      add(dip, "6 monotonicity", lowest / std::min(first, last), ">= 0.98", what_dip);
    };
    one(
        "backtrack", "dip", [](const FrameMeasures& row) { return row.surface.volume; },
        "volume gone back, over the larger end's", "least volume over the smaller end's");
    one(
        "area_backtrack", "area_dip", [](const FrameMeasures& row) { return row.surface.area; },
        "area gone back, over the larger end's", "least area over the smaller end's");
  }

  void transformations() {
    std::optional<double> off, turn, scale, shift;
    if (ends_.truth) {
      off = 0;
      for (const FrameMeasures& row : rows()) off = std::max(*off, *row.off_similarity);
      if (ends_.recovered) {
        turn = angle_of(transposed(ends_.truth->rotation) * ends_.recovered->rotation) * kDegrees;
        scale = std::abs(ends_.recovered->scale / ends_.truth->scale - 1);
        // Where the two send the middle of the source.
        const Vec3d middle(box_of(ends_.source.positions).center());
        const auto sent = [&](const Similarity& s) {
          return s.rotation * middle * s.scale + s.shift;
        };
        shift = length(sent(*ends_.recovered) - sent(*ends_.truth)) / size_;
      }
    }
    add("nonlinearity", "7 nonlinearity", off, "<= 0.02",
        "Hausdorff distance from the moved source, over L, where the target is just that");
    add("rotation_error", "8 transformation groups", turn, "<= 0.5", "degrees");
    add("scale_error", "8 transformation groups", scale, "<= 0.01", "relative");
    add("translation_error", "8 transformation groups", shift, "<= 0.01", "over L");
  }

  void slow_in_out() {
    double largest = 0, peak = 0;
    for (std::size_t k = 0; k + 1 < rows().size(); ++k)
      if (rows()[k].speed > largest) {
        largest = rows()[k].speed;
        peak = (rows()[k].time + rows()[k + 1].time) / 2;
      }
    const bool moves = largest > 0;
    const auto over_largest = [&](std::size_t k) {
      return moves ? std::optional(rows()[k].speed / largest) : std::nullopt;
    };
    add("slow_in", "9 slow-in, slow-out", over_largest(0), "<= 0.3", "first step over the largest");
    add("slow_out", "9 slow-in, slow-out", over_largest(rows().size() - 2), "<= 0.3",
        "last step over the largest");
    add("peak", "9 slow-in, slow-out", moves ? std::optional(peak) : std::nullopt, "",
        "when the largest step is; goal 0.4 to 0.6");
  }

  void certificates() {
    double leakage = 0, bad = 0;
    for (const FrameMeasures& row : rows()) {
      leakage = std::max(leakage, row.leakage);
      bad += row.surface.manifold() && row.surface.triangles > 0 ? 0 : 1;
    }
    const double volume = std::max(rows().front().surface.volume, rows().back().surface.volume);
    add("leakage", "10 no leakage", volume > 0 ? leakage / volume : leakage, "<= 0",
        "largest volume outside both objects' hull, dilated by 2 % of L, over the larger end's");
    add("bad_surfaces", "surface", bad, "<= 0",
        "frames without a surface that is closed, manifold and oriented");
  }

  const MorphEnds& ends_;
  const std::vector<MorphFrame>& frames_;
  std::vector<Vec3> points_;
  double size_ = 1, source_error_ = 0, target_error_ = 0;
  bool has_balls_ = false;
  Analysis analysis_;
};

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
  return Analyzer(ends, frames).run();
}

std::optional<Similarity> similarity_of(const std::vector<Vec3>& from,
                                        const std::vector<Vec3>& to) {
  if (from.size() != to.size() || from.size() < 4) return std::nullopt;
  const auto count = static_cast<double>(from.size());
  Vec3d p0, q0;
  for (std::size_t i = 0; i < from.size(); ++i) {
    p0 = p0 + Vec3d(from[i]) * (1 / count);
    q0 = q0 + Vec3d(to[i]) * (1 / count);
  }
  Mat3 sum{{0, 0, 0, 0, 0, 0, 0, 0, 0}};
  double from_square = 0, to_square = 0;
  for (std::size_t i = 0; i < from.size(); ++i) {
    const Vec3d p = Vec3d(from[i]) - p0, q = Vec3d(to[i]) - q0;
    const double a[3] = {p.x, p.y, p.z}, b[3] = {q.x, q.y, q.z};
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) sum.at(r, c) += b[r] * a[c];
    from_square += dot(p, p);
    to_square += dot(q, q);
  }
  if (!(from_square > 0 && to_square > 0)) return std::nullopt;
  Similarity fit{nearest_rotation(sum), std::sqrt(to_square / from_square), {}};
  fit.shift = q0 - fit.rotation * p0 * fit.scale;
  double left = 0;
  for (std::size_t i = 0; i < from.size(); ++i) {
    const Vec3d d = fit.rotation * Vec3d(from[i]) * fit.scale + fit.shift - Vec3d(to[i]);
    left = std::max(left, length(d));
  }
  constexpr double kTolerance = 1e-3;
  if (left > kTolerance * std::sqrt(to_square / count)) return std::nullopt;
  return fit;
}

}  // namespace polymorph
