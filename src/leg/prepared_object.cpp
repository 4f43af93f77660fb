#include "leg/prepared_object.h"

#include <string_view>
#include <unordered_map>

#include "base/activity.h"
#include "base/log.h"
#include "model/color_cache.h"
#include "model/transfer.h"

namespace polymorph {

Result<ObjectDistances> measure_distances(const PreparedObject& object,
                                          const DistanceMeasure& measure, Engine& engine,
                                          const std::filesystem::path& cache) {
  const Activity activity("measuring distances to " + object.name);
  PM_TRY(ObjectDistances distances,
         load_or_measure_distances(object.model, *object.closest, measure, engine, cache));
  if (is_shell(distances))
    log_info(
        "{}: for {:.0f} % of the space around which its faces lie, inside and outside cannot be "
        "told apart (faces are open, or turned at random), so it is taken for a shell and given "
        "thickness; spheres.solidify fills it",
        object.name, 100 * distances.undecided_fraction);
  if (!(distances.volume > 0))
    return make_error(ErrorCode::kInput,
                      "{}: the model encloses nothing that cells of {:.3g} show "
                      "- raise surface.resolution or set spheres.solidify",
                      object.name, measure.cell);
  return distances;
}

void prepare_transfer(PreparedObject& object, bool with_colors,
                      const std::filesystem::path& cache) {
  object.outer = object.closest;
  object.charts = find_texture_charts(object.model);
  std::vector<FaceClass> face_classes = object.distances.face_classes;
  if (face_classes.empty())
    face_classes.assign(object.model.triangles.size(), FaceClass::kBoundary);
  const std::vector<std::uint32_t> outer = list_outer_faces(face_classes);
  if (outer.size() < face_classes.size())
    object.outer = std::make_shared<const ClosestPointQuery>(object.model, outer);
  if (with_colors)
    object.colors = std::make_shared<const ColorVolume>(
        load_or_make_color_volume(object.model, face_classes, cache));
}

std::vector<std::uint32_t> label_numbers(const std::vector<std::string>& names,
                                         const std::vector<std::string>& all) {
  std::unordered_map<std::string_view, std::uint32_t> index;
  for (const std::string& name : all) index.emplace(name, static_cast<std::uint32_t>(index.size()));
  std::vector<std::uint32_t> numbers;
  for (const std::string& name : names) numbers.push_back(index.at(name));
  return numbers;
}

std::vector<std::uint32_t> model_labels(const Model& model,
                                        std::span<const std::uint32_t> numbers) {
  std::vector<std::uint32_t> labels(model.points.size(), 0);
  for (std::size_t t = 0; t < model.triangles.size(); ++t)
    for (const std::uint32_t v : model.triangles[t].v) labels[v] = numbers[model.labels[t]];
  return labels;
}

std::vector<std::uint32_t> nearest_labels(const PreparedObject& object,
                                          std::span<const Vec3> points) {
  std::vector<std::uint32_t> labels;
  for (const ClosestPoint& point : object.outer->closest(points))
    labels.push_back(object.label_numbers[object.model.labels[point.triangle]]);
  return labels;
}

}  // namespace polymorph
