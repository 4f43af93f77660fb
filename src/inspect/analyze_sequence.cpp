#include "inspect/analyze_sequence.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>

#include "analyze/facing_error.h"
#include "analyze/measure.h"
#include "analyze/registration_error.h"
#include "base/plural.h"
#include "leg/boundary_surface.h"
#include "leg/leg_surface.h"
#include "mesh/append.h"
#include "mesh/normals.h"
#include "model/load/load_model.h"
#include "morph/cost.h"
#include "morph/motion.h"
#include "scene/mesh_numbers.h"
#include "sequence/prepare/actor_poses.h"

namespace polymorph {
namespace {

Error stopped_error() { return {ErrorCode::kResumable, "stopped before the last frame"}; }

Mesh mesh_of(const Model& model) { return {model.points, point_normals(model), model.triangles}; }

/// Measures the label purity of the plan and of a random plan: MorphEnds::purity and chance. Leaves
/// both empty unless each object has several labels.
void measure_labels(const MorphPlan& plan, MorphEnds& ends) {
  std::map<std::int32_t, double> from_masses, to_masses;
  double same_label = 0;
  for (const Pair& pair : plan.pairs) {
    const std::int32_t from_label =
        plan.from_labels.empty() ? kNoLabel : plan.from_labels[pair.from];
    const std::int32_t to_label = plan.to_labels.empty() ? kNoLabel : plan.to_labels[pair.to];
    from_masses[from_label] += pair.mass;
    to_masses[to_label] += pair.mass;
    if (from_label == to_label) same_label += pair.mass;
  }
  if (from_masses.size() < 2 || to_masses.size() < 2) return;
  double chance = 0;
  for (const auto& [label, mass] : from_masses)
    if (const auto other = to_masses.find(label); other != to_masses.end())
      chance += mass * other->second;
  ends.purity = same_label;
  ends.chance = chance;
}

/// Measures the error of each landmark. For a DistanceLeg, the landmark's position at half of the
/// leg's time is mapped back to both objects; the error is its larger distance from the landmark
/// there. For any other leg, the source's landmark moves with its nearest ball; the error is its
/// distance from the target's landmark.
Status measure_landmarks(const Leg& leg, Engine& engine, MorphEnds& ends) {
  const MorphPlan& plan = leg.plan;
  if (plan.landmarks.empty()) return Ok{};
  if (std::holds_alternative<DistanceLeg>(leg.kind)) {
    PM_TRY(const LegState half, leg_state(leg, 0.5f * leg.until, engine));
    const std::vector<Vec3> positions = landmark_positions(plan, half.time, half.balls);
    PM_TRY(const PullBack pulled, pull_back(leg, half, positions, engine));
    for (std::size_t l = 0; l < positions.size(); ++l)
      ends.landmark_errors.push_back(
          static_cast<double>(std::max(length(pulled.source[l] - plan.landmarks[l].from),
                                       length(pulled.target[l] - plan.landmarks[l].to))));
    return Ok{};
  }
  for (const PlanLandmark& landmark : plan.landmarks) {
    // The landmark moves to the mean of the targets of its nearest ball, weighted by the pairs'
    // shares of the ball.
    std::uint32_t nearest = 0;
    for (std::uint32_t i = 0; i < plan.from.size(); ++i)
      if (length(plan.from[i].center - landmark.from) <
          length(plan.from[nearest].center - landmark.from))
        nearest = i;
    Vec3d target;
    for (const Pair& pair : plan.pairs)
      if (pair.from == nearest)
        target = target + Vec3d(plan.to[pair.to].center) * static_cast<double>(pair.from_share);
    ends.landmark_errors.push_back(length(target - Vec3d(landmark.to)));
  }
  return Ok{};
}

/// Measures the angle about the vertical, in degrees, between the plan's rotation and the best fit
/// of its pairs.
std::optional<double> measure_facing(const MorphPlan& plan) {
  std::vector<Vec3d> from, to;
  std::vector<double> masses;
  for (const Pair& pair : plan.pairs) {
    from.emplace_back(plan.from[pair.from].center);
    to.emplace_back(plan.to[pair.to].center);
    masses.push_back(pair.mass);
  }
  const auto angle = rotation_about_vertical({from, to, masses}, plan.alignment.rotation);
  return angle ? std::optional(std::abs(*angle)) : std::nullopt;
}

/// Computes the larger missed_fraction() of the leg's first and last surface. Each surface is
/// mapped to the other object by the map at its own end of the leg.
Result<std::optional<double>> measure_registration(const Leg& leg, const Mesh& first,
                                                   const Mesh& last, Engine& engine) {
  const double scale = leg.plan.alignment.scale;
  std::optional<double> largest;
  for (const bool reversed : {false, true}) {
    const ThicknessSamples samples = sample_thickness(reversed ? last : first);
    PM_TRY(const LegState state, leg_state(leg, reversed ? 1 : 0, engine));
    PM_TRY(const PullBack mapped, pull_back(leg, state, samples.points, engine));
    const auto fraction = missed_fraction(samples, reversed ? mapped.source : mapped.target,
                                          reversed ? first : last, reversed ? 1 / scale : scale);
    if (!fraction) return std::optional<double>();
    largest = std::max(largest.value_or(0), *fraction);
  }
  return largest;
}

/// An actor's leg, whose index is `leg`, in the frames of its volumetric stage.
class LegFrames {
 public:
  LegFrames(const PreparedActor& actor, std::size_t leg)
      : actor_(actor), leg_(static_cast<int>(leg)) {}
  bool has_moving_end() const { return polymorph::has_moving_end(actor_, leg_); }
  /// Returns the frame nearest to a fraction of the stage's time.
  int frame_at(float fraction) const {
    const Timeline& timeline = actor_.timeline;
    const LegTiming& timing = timeline.legs[static_cast<std::size_t>(leg_)];
    // The volumetric stage, with the fraction shares[2] of the leg's time, is the third (Stage).
    const float leg_fraction = timing.shares[0] + timing.shares[1] + fraction * timing.shares[2];
    const auto step =
        static_cast<int>(std::lround(leg_fraction * static_cast<float>(timing.steps)));
    return std::min(1 + timeline.hold_start + timing.first_step + step, timeline.count);
  }
  /// Returns the leg between the poses of its objects in a frame. Errors: as leg_at().
  Result<std::shared_ptr<const Leg>> at(int frame, Engine& engine) const {
    return leg_at(actor_, leg_, frame, engine);
  }

 private:
  const PreparedActor& actor_;
  int leg_;
};

/// Measures the distance by which the surface of a leg moves when its objects change to their poses
/// in the next frame, divided by the larger distance by which the objects themselves move. Returns
/// nullopt if the objects stand still.
Result<std::optional<double>> measure_pose_step(const LegFrames& leg, float fraction,
                                                const Mesh& surface, Engine& engine) {
  const int frame = leg.frame_at(fraction);
  PM_TRY(const auto now, leg.at(frame, engine));
  PM_TRY(const auto next, leg.at(std::min(frame + 1, leg.frame_at(1)), engine));
  double object_step = 0;
  for (const auto& [a, b] : {std::pair(now->from, next->from), std::pair(now->to, next->to)}) {
    if (a == b) continue;
    const MeasuredSurface before(a->model.points, a->model.triangles),
        after(b->model.points, b->model.triangles);
    object_step = std::max(object_step, before.distance_to(after).mean);
  }
  if (!(object_step > 0)) return std::optional<double>();
  PM_TRY(const LegSurface moved, leg_surface(*next, fraction * next->until, engine));
  return std::optional(MeasuredSurface(surface).distance_to(MeasuredSurface(moved.mesh)).mean /
                       object_step);
}

/// Measures the errors of leg `number` at true points. Returns nullopt if an end of the leg is no
/// object of the scene but the moving balls of another leg.
Result<std::optional<TrueErrors>> measure_truth(const PreparedActor& actor,
                                                const ActorSettings& settings, std::size_t number,
                                                const Truth& truth, Engine& engine) {
  const Leg& leg = *actor.legs[number];
  const std::vector<const ObjectSettings*> chain = chain_objects(settings);
  const auto find_settings = [&](const PreparedObject* object) -> const ObjectSettings* {
    for (std::size_t i = 0; i < chain.size(); ++i)
      if (actor.objects[i].get() == object) return chain[i];
    return nullptr;
  };
  const ObjectSettings *from = find_settings(leg.from.get()), *to = find_settings(leg.to.get());
  if (!from || !to) return std::optional<TrueErrors>();
  return measure_true_errors(leg, {*from, leg.from->model}, {*to, leg.to->model},
                             {truth.find(from->model, from->name), truth.find(to->model, to->name)},
                             engine);
}

/// Measures the ends of leg `number`; `first` and `last` are this leg in the poses of its first and
/// last frame. If the leg is left before its target is reached, it ends at the source of the next
/// leg.
Result<MorphEnds> measure_ends(const PreparedActor& actor, std::size_t number, const Leg& first,
                               const Leg& last, Engine& engine) {
  const Leg& leg = first;
  const MorphPlan& plan = leg.plan;
  const PreparedObject& from = *leg.from;
  const PreparedObject& to = leg.until == 1 ? *last.to : *actor.legs[number + 1]->from;
  MorphEnds ends;
  ends.from = from.name;
  ends.to = to.name;
  ends.source = mesh_of(from.model);
  ends.target = mesh_of(to.model);
  for (const Pair& pair : plan.pairs) ends.masses.push_back(pair.mass);
  measure_labels(plan, ends);
  PM_TRY_STATUS(measure_landmarks(leg, engine, ends));
  ends.truth = fit_similarity(from.model.points, to.model.points);
  // The alignment is q = to_center + scale rotation (p - from_center).
  const Alignment& alignment = plan.alignment;
  ends.recovered = Similarity{
      alignment.rotation, alignment.scale,
      alignment.to_center - alignment.rotation * alignment.from_center * alignment.scale};
  return ends;
}

/// Samples the boundary stage at the source (`leaving`) or the target of a leg. Its steps are as
/// long as those between `count` frames of the volumetric stage, but there are at least four. If
/// the stage takes no time, the result is one mesh. It is empty if this end of the leg shows no
/// model.
Result<BoundaryMeshes> sample_boundary_stage(const Leg& leg, const LegTiming& timing, bool leaving,
                                             int count, Engine& engine) {
  BoundaryMeshes stage;
  if (!(leaving ? timing.starts_at_model : timing.ends_at_model)) return stage;
  constexpr int kMinSteps = 4;
  // Duration of the boundary stage (kBoundaryOut or kBoundaryIn) over that of the volumetric stage.
  const float time_ratio = timing.shares[leaving ? 1 : 3] / timing.shares[2];
  const int proportional = static_cast<int>(std::lround(static_cast<float>(count) * time_ratio));
  const int steps = time_ratio > 0 ? std::max(kMinSteps, proportional) : 0;
  for (int k = 0; k <= steps; ++k) {
    const float growth = steps > 0 ? static_cast<float>(k) / static_cast<float>(steps) : 0.0f;
    PM_TRY(BoundarySurface boundary, boundary_surface(leg, {leaving, 1 - growth, growth}, engine));
    Mesh mesh = std::move(boundary.surface);
    if (!boundary.points.empty())
      append(mesh, model_mesh((leaving ? *leg.from : *leg.to).model, boundary.points));
    stage.meshes.push_back(std::move(mesh));
  }
  return stage;
}

/// Samples the leg's volumetric stage at a fraction of its time until `leg.until`.
Result<MorphFrame> sample_leg(const Leg& leg, float fraction, Engine& engine) {
  PM_TRY(LegSurface surface, leg_surface(leg, fraction * leg.until, engine));
  MorphFrame frame;
  frame.time = static_cast<double>(fraction);
  frame.u = static_cast<double>(surface.state.u / progress_at(leg.plan, leg.until));
  frame.surface = std::move(surface.mesh);
  for (const Ball& ball : surface.state.balls) frame.centers.push_back(ball.center);
  return frame;
}

/// Returns the number of samples of an actor that mixes three objects or more.
int blend_sample_count(const PreparedActor& actor, int frames) {
  return std::max(2, frames > 0 ? frames : actor.timeline.count);
}

/// Analyzes an actor that mixes three objects or more, as a morph from the film's first frame to
/// its last. `next` is called before each sample and returns false to stop.
Result<Analysis> analyze_blend(const PreparedActor& actor, int count, Engine& engine,
                               const std::function<bool()>& next) {
  std::vector<MorphFrame> samples;
  MorphEnds ends;
  for (int k = 0; k < count; ++k) {
    if (!next()) return stopped_error();
    const double fraction = static_cast<double>(k) / (count - 1);
    const auto frame = static_cast<int>(std::lround(1 + fraction * (actor.timeline.count - 1)));
    const MorphState state = morph_state_at(actor.timeline, frame);
    PM_TRY(const Mixture mixture, mix_objects(*actor.space, state.weights));
    PM_TRY(WeightedSurface surface, weighted_surface(mixture, engine));
    MorphFrame& sample = samples.emplace_back();
    sample.time = sample.u = fraction;
    sample.surface = std::move(surface.mesh);
    for (const RegressionSample& ball : mixture.samples) {
      sample.centers.push_back(ball.center);
      if (k == 0) ends.masses.push_back(static_cast<double>(ball.mass));
    }
  }
  ends.from = "frame 1";
  ends.to = fmt::format("frame {}", actor.timeline.count);
  ends.source = samples.front().surface;
  ends.target = samples.back().surface;
  return analyze_morph(ends, samples);
}

}  // namespace

Result<std::vector<Analysis>> analyze_scene(const PreparedScene& prepared, Engine& engine,
                                            int frames, const AnalyzeProgress& progress,
                                            const Truth* truth) {
  // Count the samples of all morphs for the progress. An actor that blends is one morph; of other
  // actors each leg is one.
  int total = 0, done = 0;
  const auto sample_count = [&](const LegTiming& timing) {
    return std::max(2, frames > 0 ? frames : timing.steps + 1);
  };
  for (const PreparedActor& actor : prepared.actors) {
    if (actor.space)
      total += blend_sample_count(actor, frames);
    else
      for (const LegTiming& timing : actor.timeline.legs) total += sample_count(timing);
  }
  if (total == 0)
    return make_error(
        ErrorCode::kInput,
        "{}: has no morph to measure, only mesh sequences - to measure one as a morph "
        "from its first mesh to its last: analyze 'seq.####.obj'",
        prepared.scene.path.string());
  std::vector<Analysis> morphs;
  for (std::size_t a = 0; a < prepared.actors.size(); ++a) {
    const PreparedActor& actor = prepared.actors[a];
    if (actor.space) {
      PM_TRY(Analysis blend, analyze_blend(actor, blend_sample_count(actor, frames), engine,
                                           [&] { return progress(done++, total); }));
      if (prepared.actors.size() > 1) blend.actor = actor.name;
      morphs.push_back(std::move(blend));
      continue;
    }
    for (std::size_t number = 0; number < actor.legs.size(); ++number) {
      const LegTiming& timing = actor.timeline.legs[number];
      const LegFrames leg_frames(actor, number);
      // Sample the volumetric stage, with moving objects in their poses at each time.
      std::vector<MorphFrame> samples;
      std::optional<double> pose_step;
      const int count = sample_count(timing);
      for (int k = 0; k < count; ++k) {
        if (!progress(done++, total)) return stopped_error();
        const float fraction = static_cast<float>(k) / static_cast<float>(count - 1);
        PM_TRY(const auto posed_leg, leg_frames.at(leg_frames.frame_at(fraction), engine));
        PM_TRY(MorphFrame sample, sample_leg(*posed_leg, fraction, engine));
        if (leg_frames.has_moving_end()) {
          PM_TRY(const auto step, measure_pose_step(leg_frames, fraction, sample.surface, engine));
          if (step) pose_step = std::max(pose_step.value_or(0), *step);
        }
        samples.push_back(std::move(sample));
      }
      // Measure the two ends.
      PM_TRY(const auto first, leg_frames.at(leg_frames.frame_at(0), engine));
      PM_TRY(const auto last, leg_frames.at(leg_frames.frame_at(1), engine));
      const Leg& leg = *first;
      PM_TRY(MorphEnds ends, measure_ends(actor, number, *first, *last, engine));
      ends.pose_step = pose_step;
      if (prepared.actors.size() > 1) ends.actor = actor.name;
      ends.facing = measure_facing(leg.plan);
      // A leg that is left before its end never reaches the target that its map is made for.
      if (leg.until == 1) {
        // The map is that of one pair of poses, so the last surface must be in the same poses.
        const Mesh& target_surface = samples.back().surface;
        PM_TRY(const LegSurface arrived,
               first == last ? LegSurface{/*state=*/{}, /*iso=*/1, target_surface, /*field=*/{}}
                             : leg_surface(leg, 1, engine));
        PM_TRY(ends.registration,
               measure_registration(leg, samples.front().surface, arrived.mesh, engine));
        if (truth) {
          PM_TRY(ends.true_errors,
                 measure_truth(actor, prepared.scene.actors[a], number, *truth, engine));
        }
      }
      PM_TRY(ends.leaving, sample_boundary_stage(leg, timing, /*leaving=*/true, count, engine));
      PM_TRY(ends.arriving, sample_boundary_stage(*last, timing, /*leaving=*/false, count, engine));
      ends.source_shown = !ends.leaving.meshes.empty();
      ends.target_shown = !ends.arriving.meshes.empty();
      morphs.push_back(analyze_morph(ends, samples));
    }
  }
  return morphs;
}

Result<std::vector<Analysis>> analyze_meshes(const MeshMorph& morph,
                                             const AnalyzeProgress& progress) {
  const FramePattern& pattern = morph.frames;
  PM_TRY(const std::vector<int> numbers, existing_meshes(pattern));
  if (numbers.size() < 2)
    return make_error(ErrorCode::kInput, "{}: {} - a morph has at least two frames",
                      frame_path(pattern, 0).string(), plural(numbers.size(), "such file"));
  LoadObjSettings settings;
  settings.textures = false;
  std::vector<MorphFrame> frames;
  for (std::size_t k = 0; k < numbers.size(); ++k) {
    if (!progress(static_cast<int>(k), static_cast<int>(numbers.size()))) return stopped_error();
    PM_TRY(const LoadedModel loaded, load_model(frame_path(pattern, numbers[k]), settings));
    MorphFrame frame;
    frame.time = frame.u = static_cast<double>(k) / static_cast<double>(numbers.size() - 1);
    frame.surface = mesh_of(loaded.model);
    frames.push_back(std::move(frame));
  }
  MorphEnds ends;
  ends.from = frame_path(pattern, numbers.front()).filename().string();
  ends.to = frame_path(pattern, numbers.back()).filename().string();
  ends.source = frames.front().surface;
  ends.target = frames.back().surface;
  PM_TRY(ends.true_errors,
         measure_true_errors(frames.front().surface, frames.back().surface, morph.truth));
  ends.source_shown = !morph.source.empty();
  ends.target_shown = !morph.target.empty();
  for (const auto& [file, name, mesh] : {std::tuple(&morph.source, &ends.from, &ends.source),
                                         std::tuple(&morph.target, &ends.to, &ends.target)})
    if (!file->empty()) {
      PM_TRY(const LoadedModel loaded, load_model(*file, settings));
      *name = file->filename().string();
      *mesh = mesh_of(loaded.model);
    }
  ends.truth = fit_similarity(ends.source.positions, ends.target.positions);
  std::vector<Analysis> morphs;
  morphs.push_back(analyze_morph(ends, frames));
  return morphs;
}

}  // namespace polymorph
