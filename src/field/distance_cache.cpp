#include "field/distance_cache.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "base/array3.h"
#include "base/cache_file.h"
#include "base/hash.h"
#include "base/parallel.h"
#include "field/extract_surface.h"
#include "field/hollow_distances.h"
#include "field/remove_detail.h"
#include "field/thinness.h"
#include "mesh/components.h"
#include "mesh/handles.h"
#include "mesh/mesh_check.h"
#include "model/repair/solidify.h"
#include "model/repair/vessel.h"

namespace polymorph {
namespace {

// A cache file contains: face classes, undecided fraction, volume, smallest component, genus,
// whether the object is a vessel, distances, the thinness unless the object is a shell, and the
// distances of a vessel's walls. Distances are stored as grid, Lipschitz constant, spline
// (SmoothDistances), and the indices and values of all blocks of points that differ from the
// spline.
constexpr int kBlockEdge = 4;  ///< points along a block's edge
constexpr std::size_t kBlockPoints = kBlockEdge * kBlockEdge * kBlockEdge;

std::string make_key(const Model& model, const DistanceMeasure& measure) {
  Hasher hasher;
  hasher.add("distances").add(kDistancesVersion);
  hasher.add(std::span<const Vec3>(model.points)).add(std::span<const Triangle>(model.triangles));
  hasher.add(measure.cell).add(measure.thinnest).add(measure.min_component_share);
  hasher.add(static_cast<std::uint8_t>(measure.solidified ? 1 : 0));
  return hasher.hex();
}

Int3 count_blocks(const Grid& grid) {
  const auto count = [](int points) { return (points + kBlockEdge - 1) / kBlockEdge; };
  return {count(grid.points.x), count(grid.points.y), count(grid.points.z)};
}

/// Calls f(index of a grid point, index within the block) for the points of block b.
template <class F>
void for_each_block_point(const Grid& grid, std::int64_t b, const F& f) {
  const Int3 blocks = count_blocks(grid), n = grid.points;
  const auto first_x = static_cast<int>(b % blocks.x) * kBlockEdge,
             first_y = static_cast<int>(b / blocks.x % blocks.y) * kBlockEdge,
             first_z = static_cast<int>(b / blocks.x / blocks.y) * kBlockEdge;
  for (int z = 0; z < std::min(kBlockEdge, n.z - first_z); ++z)
    for (int y = 0; y < std::min(kBlockEdge, n.y - first_y); ++y)
      for (int x = 0; x < std::min(kBlockEdge, n.x - first_x); ++x)
        f(array3_index(n, first_x + x, first_y + y, first_z + z),
          static_cast<std::size_t>((z * kBlockEdge + y) * kBlockEdge + x));
}

void put_grid(std::string& bytes, const Grid& grid) {
  put(bytes, grid.origin);
  put(bytes, grid.cell);
  put(bytes, grid.points);
}
Grid take_grid(std::string_view& bytes) {
  Grid grid;
  grid.origin = take<Vec3>(bytes);
  grid.cell = take<float>(bytes);
  grid.points = take<Int3>(bytes);
  return grid;
}
constexpr std::size_t kGridSize = sizeof(Vec3) + sizeof(float) + sizeof(Int3);

/// Appends the number of values and the values.
template <class T>
void put_counted(std::string& bytes, const std::vector<T>& values) {
  put(bytes, static_cast<std::uint64_t>(values.size()));
  put_array(bytes, values);
}
/// Reads what put_counted() has appended; returns false if `bytes` is too short.
template <class T>
bool take_counted(std::string_view& bytes, std::vector<T>& values) {
  if (bytes.size() < sizeof(std::uint64_t)) return false;
  const auto count = take<std::uint64_t>(bytes);
  if (count > bytes.size() / sizeof(T)) return false;
  values = take_array<T>(bytes, static_cast<std::size_t>(count));
  return true;
}

/// Makes distances from the spline alone, which hold far from the surface.
DistanceGrid make_smooth_part(const SmoothDistances& smooth, const Grid& grid) {
  DistanceGrid distances{grid, evaluate_spline(smooth, grid), /*lipschitz=*/1};
  close_border(distances);
  return distances;
}

/// Distances, and the spline with which they agree away from the surface.
struct MeasuredGrid {
  std::shared_ptr<const DistanceGrid> distances;
  SmoothDistances spline;
};

/// Finds the blocks of one layer, along z, of which a value differs from make_smooth_part().
/// Appends their numbers and all their values.
void find_near_blocks(const DistanceGrid& distances, const SmoothDistances& spline, int layer,
                      std::vector<std::uint32_t>& numbers, std::vector<float>& near_values) {
  const Grid& grid = distances.grid;
  const Int3 blocks = count_blocks(grid);
  const int begin = layer * kBlockEdge, end = std::min(begin + kBlockEdge, grid.points.z);
  const std::size_t points = array3_index(grid.points, 0, 0, 1);  // of a layer
  std::vector<float> smooth(static_cast<std::size_t>(end - begin) * points);
  evaluate_spline_layers(spline, grid, begin, end, smooth.data());
  for (int z = begin; z < end; ++z)
    close_border(grid, z, smooth.data() + static_cast<std::size_t>(z - begin) * points);
  const float* const values = distances.values.data();
  const std::size_t first_point = static_cast<std::size_t>(begin) * points;
  const std::int64_t per_layer = std::int64_t{blocks.x} * blocks.y;
  for (std::int64_t b = layer * per_layer; b < (layer + 1) * per_layer; ++b) {
    bool differs = false;
    for_each_block_point(grid, b, [&](std::size_t i, std::size_t) {
      differs |= values[i] != smooth[i - first_point];
    });
    if (!differs) continue;
    numbers.push_back(static_cast<std::uint32_t>(b));
    near_values.resize(near_values.size() + kBlockPoints);
    float* to = near_values.data() + near_values.size() - kBlockPoints;
    for_each_block_point(grid, b, [&](std::size_t i, std::size_t k) { to[k] = values[i]; });
  }
}

void put_distances(std::string& bytes, const MeasuredGrid& measured) {
  const auto& distances = measured.distances;
  const auto& spline = measured.spline;
  const Grid& grid = distances->grid;
  put_grid(bytes, grid);
  put(bytes, distances->lipschitz);
  put_grid(bytes, spline.grid);
  put_counted(bytes, spline.values);
  // The blocks that differ from the spline, and all their values. Each layer of blocks has its own
  // lists. The spline's values fill a few layers of points at a time, because new memory for all
  // would take longer than they do.
  struct NearBlocks {
    std::vector<std::uint32_t> numbers;
    std::vector<float> values;
  };
  std::vector<NearBlocks> layers(static_cast<std::size_t>(count_blocks(grid).z));
  parallel_for(static_cast<std::int64_t>(layers.size()), [&](std::int64_t layer) {
    NearBlocks& near = layers[static_cast<std::size_t>(layer)];
    find_near_blocks(*distances, spline, static_cast<int>(layer), near.numbers, near.values);
  });
  std::vector<std::uint32_t> block_numbers;
  std::vector<float> near_values;
  for (const NearBlocks& near : layers) {
    block_numbers.insert(block_numbers.end(), near.numbers.begin(), near.numbers.end());
    near_values.insert(near_values.end(), near.values.begin(), near.values.end());
  }
  put_counted(bytes, block_numbers);
  put_counted(bytes, near_values);
}

/// Grids measured on a model's faces, from which set_grids() derives those of ObjectDistances.
struct Measurement {
  MeasuredGrid solid;
  std::optional<DistanceGrid> thinness;  ///< none for a shell
  std::optional<MeasuredGrid> walls;     ///< walls of a vessel; then `solid` is the filled vessel
};

std::string encode(const ObjectDistances& object, const Measurement& measurement) {
  std::string bytes;
  put_counted(bytes, object.face_classes);
  put(bytes, object.undecided_fraction);
  put(bytes, object.volume);
  put(bytes, object.smallest_component_share);
  put(bytes, object.genus);
  put(bytes, static_cast<std::uint8_t>(object.is_vessel));
  put_distances(bytes, measurement.solid);
  if (const auto& thinness = measurement.thinness) {
    put_grid(bytes, thinness->grid);
    put(bytes, thinness->lipschitz);
    put_counted(bytes, thinness->values);
  }
  if (measurement.walls) put_distances(bytes, *measurement.walls);
  return bytes;
}

/// Tests whether a grid from a file, which may be damaged, has plausible sizes.
bool is_sound(const Grid& grid) {
  constexpr int kMaxPoints = 4096;  // far above kMaxDistanceCells and the margins
  const auto is_plausible = [](int points) { return points >= 2 && points <= kMaxPoints; };
  return is_plausible(grid.points.x) && is_plausible(grid.points.y) &&
         is_plausible(grid.points.z) && grid.cell > 0 && std::isfinite(grid.cell);
}

std::size_t point_count(const Grid& grid) {
  return static_cast<std::size_t>(std::int64_t{grid.points.x} * grid.points.y * grid.points.z);
}

/// Reads the thinness that encode() has appended; returns false if the data is damaged.
bool take_thinness(std::string_view& bytes, DistanceGrid& thinness) {
  if (bytes.size() < kGridSize + sizeof(float)) return false;
  thinness.grid = take_grid(bytes);
  thinness.lipschitz = take<float>(bytes);
  return is_sound(thinness.grid) && take_counted(bytes, thinness.values) &&
         thinness.values.size() == point_count(thinness.grid);
}

/// Reads what put_distances() has appended; returns false if the data is damaged.
bool take_distances(std::string_view& bytes, MeasuredGrid& measured) {
  if (bytes.size() < 2 * kGridSize + sizeof(float)) return false;
  const Grid grid = take_grid(bytes);
  const auto lipschitz = take<float>(bytes);
  SmoothDistances& spline = measured.spline;
  spline.grid = take_grid(bytes);
  std::vector<std::uint32_t> block_numbers;
  std::vector<float> near_values;
  if (!is_sound(grid) || !is_sound(spline.grid) || !take_counted(bytes, spline.values) ||
      !take_counted(bytes, block_numbers) || !take_counted(bytes, near_values))
    return false;
  const Int3 blocks = count_blocks(grid);
  const std::int64_t count = std::int64_t{blocks.x} * blocks.y * blocks.z;
  if (spline.values.size() != point_count(spline.grid) ||
      near_values.size() != kBlockPoints * block_numbers.size() ||
      std::any_of(block_numbers.begin(), block_numbers.end(),
                  [&](std::uint32_t b) { return b >= count; }))
    return false;
  DistanceGrid distances = make_smooth_part(spline, grid);
  distances.lipschitz = lipschitz;
  parallel_for(
      static_cast<std::int64_t>(block_numbers.size()),
      [&](std::int64_t i) {
        const auto at = static_cast<std::size_t>(i);
        const float* from = near_values.data() + kBlockPoints * at;
        for_each_block_point(grid, block_numbers[at],
                             [&](std::size_t p, std::size_t k) { distances.values[p] = from[k]; });
      },
      /*grain=*/256);
  measured.distances = std::make_shared<const DistanceGrid>(std::move(distances));
  return true;
}

/// Sets the grids of an object whose other members are set. `size`: diagonal of the object's box.
void set_grids(Measurement measurement, float size, ObjectDistances& object) {
  const DistanceGrid& solid = *measurement.solid.distances;
  if (measurement.thinness) {
    object.smooth = std::make_shared<const DistanceGrid>(
        remove_detail(solid, std::move(measurement.solid.spline), *measurement.thinness, size));
    object.thinness = std::make_shared<const DistanceGrid>(
        limit_thinness(std::move(*measurement.thinness), solid));
  }
  object.grid = measurement.solid.distances;
  if (measurement.walls)
    object.grid = std::make_shared<const DistanceGrid>(
        hollow_distances(*measurement.walls->distances, solid));
}

/// Sets all members of `object` but its key; returns false if the content is damaged or does not
/// belong to the model.
bool decode(std::string_view bytes, const Model& model, ObjectDistances& object) {
  if (!take_counted(bytes, object.face_classes) ||
      object.face_classes.size() != model.triangles.size())
    return false;
  if (bytes.size() < 3 * sizeof(double) + sizeof(std::int64_t) + sizeof(std::uint8_t)) return false;
  object.undecided_fraction = take<double>(bytes);
  object.volume = take<double>(bytes);
  object.smallest_component_share = take<double>(bytes);
  object.genus = take<std::int64_t>(bytes);
  object.is_vessel = take<std::uint8_t>(bytes) != 0;
  Measurement measurement;
  if (!take_distances(bytes, measurement.solid)) return false;
  if (!is_shell(object) && !take_thinness(bytes, measurement.thinness.emplace())) return false;
  if (object.is_vessel &&
      (!take_distances(bytes, measurement.walls.emplace()) ||
       measurement.walls->distances->values.size() != measurement.solid.distances->values.size()))
    return false;
  if (!bytes.empty()) return false;
  set_grids(std::move(measurement), model.box().diagonal(), object);
  return true;
}

MeasuredGrid measure_grid(const QueriedModel& queried, const DistanceMeasure& measure) {
  MeasuredGrid grid;
  grid.distances = std::make_shared<const DistanceGrid>(
      compute_signed_distances(queried, 0.5f * measure.cell, measure.thinnest, &grid.spline));
  return grid;
}

/// Measures the distances of a solid or a shell, and sets the object's face classes and undecided
/// fraction.
MeasuredGrid measure_solid(const Model& solid, const ClosestPointQuery& closest,
                           const InsideTest& inside, const DistanceMeasure& measure,
                           ObjectDistances& object) {
  /// Distance from a face, in cells, at which its two sides are classified.
  constexpr float kFaceStep = 0.01f;
  const Mesh faces{solid.points, {}, solid.triangles};
  const bool closed = check_mesh(faces).is_closed() && volume_of(faces) > 0;
  object.undecided_fraction = closed ? 0 : measure_undecided_fraction(solid, inside);
  object.face_classes = object.undecided_fraction < kMinShellFraction
                            ? classify_faces(solid, inside, kFaceStep * measure.cell)
                            : std::vector<FaceClass>(solid.triangles.size(), FaceClass::kSheet);
  return measure_grid({solid, inside, closest, object.face_classes, solid.box()}, measure);
}

/// Measures the solid that represents the model: the model itself, the result of solidify(), or the
/// filled vessel.
Result<Measurement> measure_model(const Model& model, const ClosestPointQuery& closest,
                                  const DistanceMeasure& measure, ObjectDistances& object) {
  Measurement measurement;
  if (measure.solidified) {
    PM_TRY(const Model solid, solidify(model));
    measurement.solid =
        measure_solid(solid, ClosestPointQuery(solid), InsideTest(solid), measure, object);
    // The classes of the model's triangles replace those of the solid's.
    object.face_classes.assign(model.triangles.size(), FaceClass::kBoundary);
    return measurement;
  }
  const InsideTest inside(model);
  const std::optional<FilledVessel> vessel = fill_vessel(model, inside);
  if (!vessel) {
    measurement.solid = measure_solid(model, closest, inside, measure, object);
    return measurement;
  }
  const Model& filled = vessel->model;
  measurement.solid =
      measure_solid(filled, ClosestPointQuery(filled), InsideTest(filled), measure, object);
  object.is_vessel = true;
  const std::vector<FaceClass> walls(model.triangles.size(),
                                     vessel->is_sheet ? FaceClass::kSheet : FaceClass::kBoundary);
  if (vessel->is_sheet)  // the filled model begins with the model's triangles
    object.face_classes.resize(model.triangles.size());
  else
    object.face_classes = walls;
  measurement.walls = measure_grid({model, inside, closest, walls, filled.box()}, measure);
  return measurement;
}

}  // namespace

Result<ObjectDistances> load_or_measure_distances(const Model& model,
                                                  const ClosestPointQuery& closest,
                                                  const DistanceMeasure& measure, Engine& engine,
                                                  const std::filesystem::path& folder) {
  ObjectDistances object;
  object.key = make_key(model, measure);
  if (!folder.empty()) {
    if (const auto bytes = load_cached(folder, object.key, kDistanceFiles)) {
      const char* problem = nullptr;
      const auto content = cached_content(*bytes, object.key, kDistanceFiles, problem);
      ObjectDistances stored = object;  // decode() may fail half way
      if (content && decode(*content, model, stored)) return stored;
      warn_unusable(folder, object.key, kDistanceFiles, "holds no sound distances");
    }
  }
  PM_TRY(Measurement measurement, measure_model(model, closest, measure, object));
  PM_TRY(Mesh mesh, extract_distances(engine, measurement.solid.distances, measure.cell, {}));
  remove_small_components(mesh, measure.min_component_share);
  object.volume = volume_of(mesh);
  object.smallest_component_share = smallest_component_share(mesh);
  object.genus = compute_genus(mesh);
  const float size = model.box().diagonal();
  if (!is_shell(object))
    measurement.thinness = compute_thinness(*measurement.solid.distances, size);
  if (!folder.empty())
    store_cached(folder, object.key, kDistanceFiles, model.name, encode(object, measurement));
  set_grids(std::move(measurement), size, object);
  return object;
}

}  // namespace polymorph
