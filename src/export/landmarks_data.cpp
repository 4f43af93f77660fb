#include "export/landmarks_data.h"

#include <map>
#include <memory>
#include <utility>

#include "export/landmark_candidates.h"
#include "leg/leg_surface.h"
#include "leg/origin_colors.h"
#include "mesh/normals.h"

namespace polymorph {
namespace {

/// Makes the colours, candidates and landmarks of a leg. The caller sets the indices of its
/// objects.
Result<LandmarksLeg> make_landmarks_leg(const std::shared_ptr<const Leg>& shared_leg,
                                        const LegCandidates& candidates, Engine& engine) {
  const Leg& leg = *shared_leg;
  LandmarksLeg out;
  const Box box = leg.from->model.box();
  out.from_colors = colors_by_position(leg.from->model.points, box);
  PM_TRY(const LegState end, leg_state(leg, 1, engine));
  PM_TRY(const std::vector<Vec3> origins,
         trace_back({&shared_leg, 1}, end, leg.to->model.points, engine));
  out.to_colors = colors_by_position(origins, box);
  out.candidates = matched_tips(candidates);
  // landmark_candidates() has rejected flattened objects.
  const Transform from_file = *inverse(leg.from->to_scene), to_file = *inverse(leg.to->to_scene);
  for (std::size_t l = 0; l < leg.plan.landmarks.size(); ++l)
    out.landmarks.push_back({leg.landmark_names[l], apply(from_file, leg.plan.landmarks[l].from),
                             apply(to_file, leg.plan.landmarks[l].to)});
  return out;
}

}  // namespace

Result<LandmarksPage> make_landmarks_page(const PreparedScene& prepared, Engine& engine) {
  PM_TRY(const std::vector<LegCandidates> legs, landmark_candidates(prepared));
  if (legs.empty())
    return make_error(
        ErrorCode::kInput,
        "{}: no leg begins at an object that is reached, so there is nothing to click",
        prepared.scene.path.string());
  LandmarksPage page;
  std::map<std::pair<int, int>, int> indices;  // {actor, object}: index in page.objects
  const auto find_or_add_object = [&](int actor, int object, const std::string& key) {
    const auto [entry, is_new] =
        indices.try_emplace({actor, object}, static_cast<int>(page.objects.size()));
    if (is_new) {
      const PreparedObject& from = *prepared.actors[static_cast<std::size_t>(actor)]
                                        .objects[static_cast<std::size_t>(object)];
      page.objects.push_back({key,
                              {from.model.points, point_normals(from.model), from.model.triangles},
                              from.to_scene,
                              *inverse(from.to_scene)});
    }
    return entry->second;
  };
  for (const LegCandidates& leg : legs) {
    const PreparedActor& actor = prepared.actors[static_cast<std::size_t>(leg.actor)];
    // Leg k of an actor leads to object k + 1.
    PM_TRY(LandmarksLeg page_leg,
           make_landmarks_leg(actor.legs[static_cast<std::size_t>(leg.to) - 1], leg, engine));
    page_leg.from = find_or_add_object(leg.actor, leg.from, leg.from_key);
    page_leg.to = find_or_add_object(leg.actor, leg.to, leg.to_key);
    page.legs.push_back(std::move(page_leg));
    if (!page.title.empty()) page.title += ", ";
    page.title += actor.objects[static_cast<std::size_t>(leg.from)]->name + " to " +
                  actor.objects[static_cast<std::size_t>(leg.to)]->name;
  }
  return page;
}

}  // namespace polymorph
