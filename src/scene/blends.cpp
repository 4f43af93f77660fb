#include "scene/blends.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <tuple>

#include "scene/load_scene.h"

namespace polymorph {
namespace {

std::string weight_pointer(std::size_t actor, std::size_t object) {
  return fmt::format("/actors/{}/blend/{}/weight", actor, object);
}

/// Sorts the blend of one actor and adapts the indices in the pointers of its weights' tracks.
void sort_blend(Scene& scene, std::size_t actor) {
  std::vector<ObjectSettings>& blend = scene.actors[actor].blend;
  // Sort keys: name, file, settings as JSON, and the index before sorting.
  std::vector<std::tuple<std::string, std::string, std::string, std::size_t>> keys;
  for (std::size_t i = 0; i < blend.size(); ++i)
    keys.emplace_back(
        blend[i].name, blend[i].model.string(),
        object_to_json(blend[i], scene.tracks, fmt::format("/actors/{}/blend/{}", actor, i)), i);
  std::sort(keys.begin(), keys.end());
  std::vector<ObjectSettings> sorted;
  std::vector<KeyframeTrack> tracks = scene.tracks;
  for (std::size_t i = 0; i < blend.size(); ++i) {
    const std::size_t old_index = std::get<3>(keys[i]);
    sorted.push_back(blend[old_index]);
    for (std::size_t t = 0; t < tracks.size(); ++t)  // scene.tracks keeps the old pointers
      if (scene.tracks[t].pointer == weight_pointer(actor, old_index))
        tracks[t].pointer = weight_pointer(actor, i);
  }
  // Sort the tracks, because frames are identified by the scene's text, which has them in order.
  std::stable_sort(tracks.begin(), tracks.end(),
                   [](const auto& a, const auto& b) { return a.pointer < b.pointer; });
  blend = std::move(sorted);
  scene.tracks = std::move(tracks);
}

}  // namespace

void sort_blends(Scene& scene) {
  // A scene without a list of actors has the blend at the top level.
  for (KeyframeTrack& track : scene.tracks)
    if (track.pointer.starts_with("/blend/"))
      track.pointer = fmt::format("/actors/0{}", track.pointer);
  for (std::size_t a = 0; a < scene.actors.size(); ++a)
    if (!scene.actors[a].blend.empty()) sort_blend(scene, a);
}

std::vector<float> blend_weights(const Scene& scene, std::size_t actor, const FilmTime& time) {
  const std::vector<ObjectSettings>& blend = scene.actors[actor].blend;
  std::vector<float> weights;
  for (std::size_t i = 0; i < blend.size(); ++i) {
    float weight = blend[i].weight.value_or(0);
    for (const KeyframeTrack& track : scene.tracks)
      if (track.pointer == weight_pointer(actor, i)) weight = value_at(track, time).x;
    weights.push_back(std::max(weight, 0.0f));
  }
  // Smooth curves give tiny weights near keys of value 0. Remove them.
  constexpr double kMinFraction = 1e-6;  // of the sum of all weights
  const double total = std::accumulate(weights.begin(), weights.end(), 0.0);
  for (float& weight : weights)
    if (static_cast<double>(weight) < kMinFraction * total) weight = 0;
  const double sum = std::accumulate(weights.begin(), weights.end(), 0.0);
  if (sum > 0)
    for (float& weight : weights) weight = static_cast<float>(static_cast<double>(weight) / sum);
  return weights;
}

}  // namespace polymorph
