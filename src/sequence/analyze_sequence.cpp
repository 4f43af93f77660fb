#include "sequence/analyze_sequence.h"

#include <cmath>
#include <map>

#include "mesh/normals.h"
#include "model/load/load_model.h"
#include "morph/cost.h"
#include "morph/motion.h"
#include "sequence/geometry/leg_surface.h"

namespace polymorph {
namespace {

Error stopped() { return {ErrorCode::kResumable, "stopped before the last frame"}; }

Mesh mesh_of(const Model& model) { return {model.points, point_normals(model), model.triangles}; }

/// Labels' purity in the plan and by chance (principle 1); nothing where no labels match.
void measure_labels(const MorphPlan& plan, MorphEnds& ends) {
  std::map<std::int32_t, double> in_from, in_to;
  double same = 0, matched = 0;
  for (const Pair& pair : plan.pairs) {
    const std::int32_t i = plan.from_labels.empty() ? kNoLabel : plan.from_labels[pair.from];
    const std::int32_t j = plan.to_labels.empty() ? kNoLabel : plan.to_labels[pair.to];
    in_from[i] += pair.mass;
    in_to[j] += pair.mass;
    if (i == j) same += pair.mass;
    if (i != kNoLabel && i == j) matched += pair.mass;
  }
  if (in_from.size() < 2 || in_to.size() < 2) return;
  double chance = 0;
  for (const auto& [label, mass] : in_from)
    if (const auto other = in_to.find(label); other != in_to.end()) chance += mass * other->second;
  ends.purity = same;
  ends.chance = chance;
}

/// Where the balls around each landmark arrive, against where they should.
void measure_landmarks(const MorphPlan& plan, const std::vector<LandmarkSettings>& landmarks,
                       int leg, MorphEnds& ends) {
  for (const LandmarkSettings& landmark : landmarks) {
    if (landmark.leg != leg + 1) continue;
    // The nearest ball's parts, each keeping its place beside the landmark.
    std::uint32_t nearest = 0;
    for (std::uint32_t i = 0; i < plan.from.size(); ++i)
      if (length(plan.from[i].center - landmark.from) <
          length(plan.from[nearest].center - landmark.from))
        nearest = i;
    Vec3d arrives;
    for (const Pair& pair : plan.pairs)
      if (pair.from == nearest)
        arrives = arrives + Vec3d(plan.to[pair.to].center) * static_cast<double>(pair.from_share);
    ends.landmark_errors.push_back(length(arrives - Vec3d(landmark.to)));
  }
}

MorphEnds ends_of(const PreparedActor& actor, const PlanSettings& settings, std::size_t leg) {
  const MorphPlan& plan = actor.legs[leg].plan;
  const PreparedObject& from = actor.objects[actor.legs[leg].from];
  // Where it is left before it is reached, the morph goes to what the next leg starts from.
  const bool arrives = actor.legs[leg].until == 1;
  const PreparedObject& to = actor.objects[arrives ? actor.legs[leg].to : actor.legs[leg + 1].from];
  MorphEnds ends;
  ends.from = from.name;
  ends.to = to.name;
  ends.source = mesh_of(from.model);
  ends.target = mesh_of(to.model);
  for (const Pair& pair : plan.pairs) ends.masses.push_back(pair.mass);
  measure_labels(plan, ends);
  measure_landmarks(plan, settings.landmarks, static_cast<int>(leg), ends);
  ends.truth = similarity_of(from.model.points, to.model.points);
  const Alignment& found = plan.alignment;
  ends.recovered = Similarity{found.rotation, found.scale,
                              found.to_center - found.rotation * found.from_center * found.scale};
  return ends;
}

/// The boundary stage at an end of a leg, in as many steps as its share of the time asks for beside
/// `count` frames of the motion; nothing at an end that shows no model.
Status measure_handover(const PreparedScene& prepared, const PreparedActor& actor, Engine& engine,
                        std::size_t leg, bool leaving, int count, Handover& handover) {
  const Leg& time = actor.timeline.legs[leg];
  if (!(leaving ? time.from_full : time.to_full)) return Ok{};
  constexpr int kMin = 4;
  const float share = time.shares[leaving ? 1 : 3] / time.shares[2];
  const int wanted = static_cast<int>(std::lround(static_cast<float>(count) * share));
  const int steps = share > 0 ? std::max(kMin, wanted) : 0;
  for (int k = 0; k <= steps; ++k) {
    const float way = steps > 0 ? static_cast<float>(k) / static_cast<float>(steps) : 0.0f;
    PM_TRY(const ActorGeometry geometry,
           boundary_at(prepared, actor, engine, static_cast<int>(leg), leaving, way));
    handover.shown.push_back(shown_mesh(actor, geometry));
  }
  return Ok{};
}

}  // namespace

Result<std::vector<Analysis>> analyze_scene(const PreparedScene& prepared, Engine& engine,
                                            int frames, const AnalyzeProgress& progress) {
  int total = 0, done = 0;
  const auto samples_of = [&](const Leg& leg) {
    return std::max(2, frames > 0 ? frames : leg.steps + 1);
  };
  for (const PreparedActor& actor : prepared.actors)
    for (const Leg& leg : actor.timeline.legs) total += samples_of(leg);
  std::vector<Analysis> morphs;
  for (std::size_t a = 0; a < prepared.actors.size(); ++a) {
    const PreparedActor& actor = prepared.actors[a];
    for (std::size_t leg = 0; leg < actor.legs.size(); ++leg) {
      std::vector<MorphFrame> samples;
      const int count = samples_of(actor.timeline.legs[leg]);
      for (int k = 0; k < count; ++k) {
        if (!progress(done++, total)) return stopped();
        const float way = static_cast<float>(k) / static_cast<float>(count - 1);
        const float until = actor.legs[leg].until, time = way * until;
        PM_TRY(ActorGeometry geometry,
               volume_at(prepared, actor, engine, static_cast<int>(leg), time));
        MorphFrame frame;
        frame.time = static_cast<double>(way);
        frame.u = static_cast<double>(geometry.moment.u / progress_at(actor.legs[leg].plan, until));
        frame.surface = std::move(geometry.surface);
        for (const Ball& ball : geometry.balls) frame.centers.push_back(ball.center);
        samples.push_back(std::move(frame));
      }
      MorphEnds ends = ends_of(actor, prepared.scene.actors[a].plan, leg);
      if (prepared.actors.size() > 1) ends.actor = actor.name;
      for (const bool leaving : {true, false})
        PM_TRY_STATUS(measure_handover(prepared, actor, engine, leg, leaving, count,
                                       leaving ? ends.leaving : ends.arriving));
      ends.source_shown = !ends.leaving.shown.empty();
      ends.target_shown = !ends.arriving.shown.empty();
      morphs.push_back(analyze_morph(ends, samples));
    }
  }
  return morphs;
}

Result<std::vector<Analysis>> analyze_meshes(const FramePattern& pattern,
                                             const std::filesystem::path& source,
                                             const std::filesystem::path& target,
                                             const AnalyzeProgress& progress) {
  PM_TRY(const std::vector<int> numbers, existing_frames(pattern));
  if (numbers.size() < 2)
    return make_error(ErrorCode::kInput, "{}: {} such file{} - a morph has at least two frames",
                      frame_path(pattern, 0).string(), numbers.size(),
                      numbers.size() == 1 ? "" : "s");
  LoadObjSettings settings;
  settings.textures = false;
  std::vector<MorphFrame> frames;
  for (std::size_t k = 0; k < numbers.size(); ++k) {
    if (!progress(static_cast<int>(k), static_cast<int>(numbers.size()))) return stopped();
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
  ends.source_shown = !source.empty();
  ends.target_shown = !target.empty();
  for (const auto& [file, name, mesh] :
       {std::tuple(&source, &ends.from, &ends.source), std::tuple(&target, &ends.to, &ends.target)})
    if (!file->empty()) {
      PM_TRY(const LoadedModel loaded, load_model(*file, settings));
      *name = file->filename().string();
      *mesh = mesh_of(loaded.model);
    }
  ends.truth = similarity_of(ends.source.positions, ends.target.positions);
  std::vector<Analysis> morphs;
  morphs.push_back(analyze_morph(ends, frames));
  return morphs;
}

}  // namespace polymorph
