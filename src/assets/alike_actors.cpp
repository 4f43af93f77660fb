#include "assets/alike_actors.h"

#include <algorithm>
#include <map>
#include <string>

#include "base/text.h"
#include "morph/timeline.h"
#include "scene/mesh_numbers.h"

namespace polymorph {
namespace {

/// Writes the settings of an actor that decide its shape and motion, but not its position, as text.
/// `scene`: the scene of the actor.
std::string shared_settings(const Scene& scene, const ActorSettings& actor) {
  Scene single_actor;
  single_actor.motion = scene.motion;
  single_actor.spheres = scene.spheres;
  single_actor.actors = {actor};
  ActorSettings& copy = single_actor.actors.front();
  copy.name.clear();
  copy.translate = {};
  copy.start = 1;
  std::string text = scene_to_json(single_actor, /*folder=*/{});
  // Models are compared by whole paths. The text has these, too, because no folder shortens them.
  for_each_object(copy, [&](ObjectSettings& object) { text += "\n" + object.model.string(); });
  // An actor that starts later may have fewer frames left, so the times of its legs are added.
  for (const LegTiming& leg : make_timeline(scene, actor).legs) {
    text += fmt::format("\n{} {} {} {} {} {}", leg.first_step, leg.steps, leg.starts_at_model,
                        leg.ends_at_model, leg.until, static_cast<int>(leg.interpolation));
    for (const float share : leg.shares) text += fmt::format(" {}", share);
  }
  return text;
}

/// Tests whether `model` is `from` translated by `offset`. Equal settings do not suffice, because
/// the scene's first object keeps its size and all others are scaled to it.
bool is_shifted(const Model& model, const Model& from, Vec3 offset) {
  constexpr float kTolerance = 1e-5f;  // times the diagonal of `bounds`; rounding is about 6e-8
  if (model.points.size() != from.points.size() || model.triangles.size() != from.triangles.size())
    return false;
  // The bounds include the origin, because rounding errors grow with the distance from it.
  const Box bounds = unite(unite(model.box(), from.box()), Box{{}, {}});
  const float tolerance = kTolerance * bounds.diagonal();
  for (std::size_t i = 0; i < model.points.size(); ++i)
    if (!(length(model.points[i] - from.points[i] - offset) <= tolerance)) return false;
  return true;
}

}  // namespace

std::vector<SharedActor> find_shared_actors(const Scene& scene, std::span<const ChainObject> chain,
                                            const LoadedScene& loaded) {
  const std::vector<std::span<const ChainObject>> actors = actor_chains(chain);
  std::vector<SharedActor> shared;
  std::vector<std::size_t> first_models;  // index of each actor's first model
  // The actors that share nothing with an earlier one, grouped by shared_settings().
  std::map<std::string, std::vector<std::size_t>> firsts_by_settings;
  for (std::size_t a = 0, first_model = 0; a < actors.size();
       first_model += actors[a].size(), ++a) {
    shared.push_back({a, /*offset=*/{}});
    first_models.push_back(first_model);
    const ActorSettings& actor = *actors[a].front().actor;
    const bool has_sequence =
        std::any_of(actors[a].begin(), actors[a].end(),
                    [](const ChainObject& object) { return is_mesh_sequence(*object.settings); });
    // Actors of these kinds, and the only actor of a scene, share nothing.
    if (actors.size() == 1 || has_sequence || !actor.blend.empty()) continue;
    std::vector<std::size_t>& candidates = firsts_by_settings[shared_settings(scene, actor)];
    for (const std::size_t first : candidates) {
      const Vec3 offset = actor.translate - actors[first].front().actor->translate;
      bool is_alike = true;
      for (std::size_t i = 0; is_alike && i < actors[a].size(); ++i)
        is_alike = is_shifted(loaded.models[first_model + i],
                              loaded.models[first_models[first] + i], offset);
      if (!is_alike) continue;
      shared.back() = {first, offset};
      break;
    }
    if (shared.back().first == a) candidates.push_back(a);
  }
  return shared;
}

std::vector<SharedActor> unshared_actors(const Scene& scene) {
  std::vector<SharedActor> unshared;
  for (std::size_t a = 0; a < scene.actors.size(); ++a) unshared.push_back({a, /*offset=*/{}});
  return unshared;
}

}  // namespace polymorph
