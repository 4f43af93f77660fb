#include "assets/memory_estimate.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <set>

#include "base/parallel.h"
#include "base/text.h"
#include "field/distance_grid.h"
#include "morph/smooth_map.h"
#include "morph/timeline.h"
#include "render/render.h"
#include "scene/mesh_numbers.h"

namespace polymorph {
namespace {

// Bytes, measured as the VmHWM of runs that differ in one quantity (docs/reliability.md).
constexpr double kProgramBytes = 25e6;
constexpr double kTreeBytesPerTriangle = 270;
constexpr double kBytesPerFittedBall = 250e3;
/// Minimum of a fit: the surface that it examines, which has the same size for any number of balls.
constexpr double kMinFitBytes = 40e6;
/// Per point of a grid of distances, while it is made: a smoothed copy and squared distances to
/// ridges.
constexpr double kGridTemporaryBytesPerPoint = 7;
/// Per grid point: values of a mixture of three objects or more, and points near its surface.
constexpr double kMixtureBytesPerPoint = 12;
/// Number of triangles of a surface / resolution^2.
constexpr double kTrianglesPerSquaredResolution = 8;
constexpr double kBytesPerSurfaceTriangle = 450;
constexpr double kBytesPerTracedTriangle = 165;  ///< per traced picture beyond the first

template <class T>
double bytes_of(const std::vector<T>& values) {
  return static_cast<double>(values.size() * sizeof(T));
}

/// Computes the bytes of a model without its textures.
double bytes_of(const Model& model) {
  return bytes_of(model.points) + bytes_of(model.triangles) + bytes_of(model.corner_normals) +
         bytes_of(model.corner_uvs) + bytes_of(model.labels) + bytes_of(model.triangle_materials);
}

/// Counts the points of a grid.
double point_count(const Grid& grid) {
  return static_cast<double>(grid.points.x) * grid.points.y * grid.points.z;
}

}  // namespace

std::uint64_t model_bytes(const Model& model) {
  double bytes = bytes_of(model);
  for (const auto& texture : model.textures) bytes += static_cast<double>(pixel_bytes(*texture));
  return static_cast<std::uint64_t>(bytes);
}

MemoryEstimate estimate_memory(const Scene& scene, std::span<const ChainObject> chain,
                               const LoadedScene& loaded, std::span<const SharedActor> shared,
                               std::size_t pictures) {
  std::span<const Model> models = loaded.models;
  // All of these are bytes, except `surface_triangles`. `maps` and `mixtures` become a part of
  // MemoryEstimate::surfaces.
  double models_bytes = 0, trees = 0, fits = 0, distances = 0, grid_temporaries = 0,
         surface_triangles = 0, maps = 0;
  double mixtures = 0, copies = 0;
  std::set<const Texture*> textures;  // counted so far, because models share textures
  // Sequences: the survey holds one mesh per thread. Later each frame in progress holds one: half
  // of the pictures (rounded up) are being traced, and one more frame is being prepared.
  for (const auto& sequence : loaded.sequences) {
    if (!sequence) continue;
    const auto meshes_held = static_cast<double>(
        std::max<std::size_t>(static_cast<std::size_t>(thread_count()), pictures / 2 + 2));
    models_bytes += meshes_held * static_cast<double>(sequence->max_bytes);
    trees += meshes_held * kTreeBytesPerTriangle * static_cast<double>(sequence->max_triangles);
  }
  // Fits of balls: the largest counts.
  for (const ChainObject& object : chain)
    if (is_fitted(scene, object.settings->spheres) && !plays_sequence_alone(*object.actor))
      fits = std::max({fits, kMinFitBytes, kBytesPerFittedBall * object.settings->spheres.balls});
  PM_CHECK(models.size() == chain.size());
  std::size_t next = 0;
  for (const std::span<const ChainObject> objects : actor_chains(chain)) {
    const std::size_t actor = next++;
    const std::span<const Model> actor_models = models.first(objects.size());
    models = models.subspan(objects.size());
    // Number of triangles of the actor's surface while it morphs.
    const double triangles_between = kTrianglesPerSquaredResolution *
                                     static_cast<double>(scene.surface.resolution) *
                                     scene.surface.resolution;
    // An actor that shares the objects of an earlier one has copies of their models while files are
    // read, and later only a surface.
    if (shared[actor].first != actor) {
      double max_triangles = triangles_between;
      for (const Model& model : actor_models) {
        copies += bytes_of(model);
        max_triangles = std::max(max_triangles, static_cast<double>(model.triangles.size()));
      }
      surface_triangles += max_triangles;
      continue;
    }
    // Models, their textures and their search trees.
    for (const Model& model : actor_models) {
      models_bytes += bytes_of(model);
      trees += kTreeBytesPerTriangle * static_cast<double>(model.triangles.size());
      for (const auto& texture : model.textures)
        if (texture && textures.insert(texture.get()).second)
          models_bytes += static_cast<double>(pixel_bytes(*texture));
    }
    if (plays_sequence_alone(*objects.front().actor)) continue;
    // The surface of the morph, and the smooth map and the grid of values that it is made from.
    Box box;
    for (const Model& model : actor_models) box = unite(box, model.box());
    const Vec3 size = box.size();
    const double cell = static_cast<double>(std::max({size.x, size.y, size.z})) /
                        static_cast<double>(scene.surface.resolution);
    if (!(cell > 0)) continue;  // all models are empty or single points
    float smallest_diagonal = box.diagonal();
    for (const Model& model : actor_models)
      if (!model.triangles.empty())
        smallest_diagonal = std::min(smallest_diagonal, model.box().diagonal());
    maps = std::max(maps, regression_bytes(box, smallest_diagonal));
    surface_triangles += triangles_between;
    const Timeline timeline = make_timeline(scene, *objects.front().actor);
    if (mixes_many(timeline))
      mixtures +=
          kMixtureBytesPerPoint * point_count(make_distance_grid(box, static_cast<float>(cell)));
    // Grids of the objects' distances, with cells half as long as the surface's
    // (field/distance_cache.cpp).
    for (std::size_t i = 0; i < objects.size(); ++i) {
      const bool is_sequence = is_mesh_sequence(*objects[i].settings);
      if (!leg_kinds(timeline, i).distances || (actor_models[i].triangles.empty() && !is_sequence))
        continue;
      const double points =
          point_count(make_distance_grid(actor_models[i].box(), 0.5f * static_cast<float>(cell)));
      // Two grids, with and without detail, for the reference and for each cached pose.
      distances += 2 * sizeof(float) * points * (is_sequence ? 1 + kMaxCachedPoses : 1);
      grid_temporaries = std::max(grid_temporaries, kGridTemporaryBytesPerPoint * points);
    }
  }
  // About half of the pictures are being traced, and the others are written or wait on GPUs.
  const auto extra_pictures = static_cast<double>((std::max<std::size_t>(pictures, 1) - 1) / 2);
  const auto to_bytes = [](double bytes) { return static_cast<std::uint64_t>(bytes); };
  MemoryEstimate estimate;
  estimate.program = to_bytes(kProgramBytes);
  estimate.models = to_bytes(models_bytes);
  estimate.copies = to_bytes(copies);
  estimate.trees = to_bytes(trees);
  estimate.fits = to_bytes(fits);
  estimate.distances = to_bytes(distances);
  estimate.grid_temporaries = to_bytes(grid_temporaries);
  estimate.surfaces = to_bytes(
      maps + mixtures +
      (kBytesPerSurfaceTriangle + extra_pictures * kBytesPerTracedTriangle) * surface_triangles);
  estimate.pictures = pictures * picture_bytes(scene.image);
  return estimate;
}

Status check_model_files(std::span<const ChainObject> chain, std::uint64_t limit) {
  if (limit == 0) return Ok{};
  std::vector<std::filesystem::path> files;
  for (const ChainObject& object : chain) {
    if (!is_mesh_sequence(*object.settings))
      files.push_back(object.settings->model);
    else
      for (const int number : mesh_numbers(*object.settings))
        files.push_back(mesh_file(*object.settings, number));
  }
  for (const std::filesystem::path& model : files) {
    std::error_code error;
    const auto bytes = std::filesystem::file_size(model, error);
    if (!error && bytes > limit)
      return make_error(ErrorCode::kResource,
                        "{}: reading it takes at least {} of memory, and the limit is {} - use a "
                        "smaller model or raise --max-memory",
                        model.string(), format_bytes(static_cast<double>(bytes)),
                        format_bytes(static_cast<double>(limit)));
  }
  return Ok{};
}

Status check_memory(const MemoryEstimate& estimate, std::uint64_t limit) {
  if (limit == 0 || estimate.total() <= limit) return Ok{};
  struct Item {
    std::uint64_t bytes;
    const char *name, *remedy;
  };
  const Item items[] = {
      {estimate.program, "the program itself", ""},
      {std::max(estimate.models, estimate.copies), "models and textures",
       "smaller models or textures, "},
      {estimate.trees, "search trees over the models' faces", "models of fewer faces, "},
      {estimate.fits, "fitting balls", "fewer spheres.balls, "},
      {estimate.distances + estimate.grid_temporaries, "distances to the models",
       "a lower surface.resolution, "},
      {estimate.surfaces, "surfaces", "a lower surface.resolution, "},
      {estimate.pictures, "pictures", "smaller pictures, fewer image.aovs, "}};
  const Item& largest =
      *std::max_element(std::begin(items), std::end(items),
                        [](const Item& a, const Item& b) { return a.bytes < b.bytes; });
  return make_error(
      ErrorCode::kResource,
      "the scene needs about {} of memory, {} of it for {}, and the limit is {} - use "
      "{}or raise --max-memory",
      format_bytes(static_cast<double>(estimate.total())),
      format_bytes(static_cast<double>(largest.bytes)), largest.name,
      format_bytes(static_cast<double>(limit)), largest.remedy);
}

}  // namespace polymorph
