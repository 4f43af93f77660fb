#include "morph/timeline.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <numeric>

#include "base/result.h"
#include "morph/plan.h"
#include "scene/load_scene.h"

namespace polymorph {
namespace {

constexpr int kFramesPerLeg = 24;
constexpr std::array<StageInfo, 5> kStages{{
    {Stage::kLookOut, "look-out", "the source's own materials fade to the common look"},
    {Stage::kBoundaryOut, "boundary-out", "the source's mesh becomes its balls"},
    {Stage::kVolume, "volume", "balls move from source to target"},
    {Stage::kBoundaryIn, "boundary-in", "the target's balls become its mesh"},
    {Stage::kLookIn, "look-in", "the common look fades to the target's own materials"},
}};

/// Shares of a leg's stages, given which of its ends are shown as a model.
void set_shares(Leg& leg, bool from_full, bool to_full, const BoundarySettings& settings) {
  const float boundary = settings.method == BoundaryMethod::kCut ? 0 : settings.boundary_share;
  leg.shares[0] = from_full ? settings.look_share : 0;
  leg.shares[1] = from_full ? boundary : 0;
  leg.shares[3] = to_full ? boundary : 0;
  leg.shares[4] = to_full ? settings.look_share : 0;
  // Shares that leave no time for the morph itself are scaled down to four fifths.
  const float ends = leg.shares[0] + leg.shares[1] + leg.shares[3] + leg.shares[4];
  if (ends > 0.8f)
    for (const int i : {0, 1, 3, 4}) leg.shares[i] *= 0.8f / ends;
  leg.shares[2] = 1 - (leg.shares[0] + leg.shares[1] + leg.shares[3] + leg.shares[4]);
}

}  // namespace

std::span<const StageInfo> stage_table() { return kStages; }

const char* stage_name(Stage stage) { return kStages[static_cast<std::size_t>(stage)].name; }

Timeline make_timeline(const Scene& scene) {
  const auto objects = chain_objects(scene);
  const std::size_t legs = objects.size() - 1;
  std::vector<int> frames = scene.frames.per_leg;
  if (frames.empty()) frames.assign(legs, kFramesPerLeg);
  PM_CHECK(frames.size() == legs);

  Timeline timeline;
  timeline.hold_start = scene.frames.hold_start;
  timeline.hold_end = scene.frames.hold_end;
  timeline.easing = scene.motion.easing;
  const int total = std::accumulate(frames.begin(), frames.end(), 0);
  const bool counted = scene.frames.count > 0 && scene.frames.per_leg.empty();
  timeline.count =
      counted ? scene.frames.count : std::max(2, total) + timeline.hold_start + timeline.hold_end;
  float start = 0;
  for (std::size_t i = 0; i < legs; ++i) {
    Leg leg;
    leg.start = start;
    leg.length = static_cast<float>(frames[i]) / static_cast<float>(total);
    start += leg.length;
    set_shares(leg, !objects[i]->meta, !objects[i + 1]->meta, scene.boundary);
    timeline.legs.push_back(leg);
  }
  return timeline;
}

Moment moment_at(const Timeline& timeline, int frame) {
  PM_CHECK(frame >= 1 && frame <= timeline.count);
  const int moving = timeline.count - timeline.hold_start - timeline.hold_end;
  const int step = std::clamp(frame - 1 - timeline.hold_start, 0, moving - 1);
  Moment moment;
  moment.frame = frame;
  moment.t = moving > 1 ? static_cast<float>(step) / static_cast<float>(moving - 1) : 0;

  std::size_t index = 0;
  while (index + 1 < timeline.legs.size() && moment.t >= timeline.legs[index + 1].start) ++index;
  const Leg& leg = timeline.legs[index];
  moment.leg = static_cast<int>(index);
  float local = std::clamp((moment.t - leg.start) / leg.length, 0.0f, 1.0f);
  if (step == moving - 1) local = 1;

  int stage = 0;
  while (stage < 4 && (leg.shares[stage] <= 0 || local > leg.shares[stage]))
    local -= leg.shares[stage++];
  // The last stage that has a share takes what rounding left over.
  while (leg.shares[stage] <= 0) local = leg.shares[--stage];
  moment.stage = static_cast<Stage>(stage);
  moment.progress = std::clamp(local / leg.shares[stage], 0.0f, 1.0f);

  const float faded = ease(Easing::kSmoothstep, moment.progress);
  const int from = moment.leg, to = moment.leg + 1;
  switch (moment.stage) {
    case Stage::kLookOut:
      moment.object = from, moment.look = faded, moment.boundary = 1, moment.growth = 0,
      moment.u = 0;
      break;
    case Stage::kBoundaryOut:
      moment.object = from, moment.look = 1, moment.boundary = 1 - faded, moment.growth = faded,
      moment.u = 0;
      break;
    case Stage::kVolume:
      moment.u = ease(timeline.easing, moment.progress);
      break;
    case Stage::kBoundaryIn:
      moment.object = to, moment.look = 1, moment.boundary = faded, moment.growth = 1 - faded,
      moment.u = 1;
      break;
    case Stage::kLookIn:
      moment.object = to, moment.look = 1 - faded, moment.boundary = 1, moment.growth = 0,
      moment.u = 1;
      break;
  }
  return moment;
}

}  // namespace polymorph
