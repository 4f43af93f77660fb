#include "assets/place_landmarks.h"

#include <algorithm>
#include <optional>

#include "base/text.h"
#include "mesh/closest.h"

namespace polymorph {
namespace {

std::string point_text(Vec3 p) { return fmt::format("({:.4g}, {:.4g}, {:.4g})", p.x, p.y, p.z); }

/// Collects the problems of a scene's landmarks, without repetition.
class LandmarkProblems {
 public:
  LandmarkProblems(const Scene& scene, std::vector<std::string>& problems)
      : file_(scene.path.string()), problems_(problems) {}

  void add(const LandmarkPoint& landmark, const std::string& message) {
    const std::string line =
        to_string({landmark.line, landmark.column, landmark.pointer, message}, file_);
    if (std::find(problems_.begin(), problems_.end(), line) == problems_.end())
      problems_.push_back(line);
  }

 private:
  std::string file_;
  std::vector<std::string>& problems_;
};

/// An object of the chain, in scene coordinates.
struct LandmarkedObject {
  const ObjectSettings& settings;
  const Model& model;
  const ObjectPlacement& placing;
};

/// Returns the landmark's point in the file's coordinates. If the file has no such vertex, adds a
/// problem and returns nullopt.
std::optional<Vec3> point_in_file(const LandmarkedObject& object, const LandmarkPoint& landmark,
                                  LandmarkProblems& problems) {
  if (landmark.point) return landmark.point;
  const auto vertex_count = static_cast<long long>(object.placing.vertices.size());
  if (landmark.vertex <= vertex_count)
    return object.placing.vertices[static_cast<std::size_t>(landmark.vertex - 1)];
  problems.add(landmark, fmt::format("is vertex {}, but {} has {}", landmark.vertex,
                                     object.settings.name, vertex_count));
  return std::nullopt;
}

/// Moves the landmarks of one object to the closest points of its surface. Leaves out those that
/// cannot be used, with a problem for each.
PlacedLandmarks place_on_surface(const LandmarkedObject& object, const ObjectLandmarks& landmarks,
                                 LandmarkProblems& problems) {
  // As fractions of `size`: maximum distance from the surface, minimum distance of two landmarks.
  constexpr float kMaxOffset = 0.1f, kMinSpacing = 1e-3f;
  const float size = object.model.box().diagonal();
  const ClosestPointQuery surface(object.model);
  PlacedLandmarks points;
  for (const auto& [name, landmark] : landmarks) {
    const std::optional<Vec3> point = point_in_file(object, landmark, problems);
    if (!point) continue;
    const ClosestPoint hit = surface.closest(apply(object.placing.to_scene, *point));
    if (!(hit.distance <= kMaxOffset * size)) {
      const Box& box = object.placing.box;
      problems.add(landmark,
                   fmt::format("{} is {:.3g} times the size of {} away from its surface, which "
                               "reaches from {} to {} - give the point in the file's own "
                               "coordinates",
                               point_text(*point), hit.distance / size, object.settings.name,
                               point_text(box.low), point_text(box.high)));
      continue;
    }
    const auto twin = std::find_if(points.begin(), points.end(), [&](const auto& other) {
      return length(other.second - hit.point) < kMinSpacing * size;
    });
    if (twin != points.end())
      problems.add(landmark, fmt::format("is in the same place as \"{}\" - leave one of them out",
                                         printable(twin->first)));
    else
      points.emplace(name, hit.point);
  }
  return points;
}

}  // namespace

std::vector<PlacedLandmarks> place_landmarks(const Scene& scene, std::span<const ChainObject> chain,
                                             const LoadedScene& loaded,
                                             std::vector<std::string>& problems) {
  LandmarkProblems collector(scene, problems);
  std::vector<PlacedLandmarks> lists;  // one per object
  for (std::size_t i = 0; i < chain.size(); ++i) {
    const ObjectLandmarks* landmarks = find_landmarks(chain[i].actor->plan, *chain[i].settings);
    const bool can_place = landmarks && !loaded.fitted_model(i).triangles.empty();
    lists.push_back(can_place ? place_on_surface({*chain[i].settings, loaded.fitted_model(i),
                                                  loaded.placements[i]},
                                                 *landmarks, collector)
                              : PlacedLandmarks{});
  }
  return lists;
}

}  // namespace polymorph
