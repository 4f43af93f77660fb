#include "assets/mesh_sequence.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <limits>
#include <map>

#include "assets/content_hash.h"
#include "assets/memory_estimate.h"
#include "base/file.h"
#include "base/hash.h"
#include "base/log.h"
#include "base/parallel.h"
#include "image/image_io.h"
#include "model/load/ply_velocities.h"
#include "scene/animated_model.h"
#include "scene/memory_models.h"
#include "scene/mesh_numbers.h"

namespace polymorph {
namespace {

/// Lists directions over the whole sphere, neighbours at most 15 degrees apart: from the centre of
/// a cubic grid of 8^3 cells to the grid points on the cube's surface. They are not normalized.
std::vector<Vec3> cube_directions() {
  constexpr int kHalf = 4;  // cells from the centre to a face of the cube
  std::vector<Vec3> directions;
  for (int x = -kHalf; x <= kHalf; ++x)
    for (int y = -kHalf; y <= kHalf; ++y)
      for (int z = -kHalf; z <= kHalf; ++z)
        if (std::max({std::abs(x), std::abs(y), std::abs(z)}) == kHalf)
          directions.push_back(
              {static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)});
  return directions;
}

/// Multiplies a direction by the transpose of the transform: a point is outermost along the result
/// if its image is outermost along `direction`.
Vec3 pull_direction_back(const Transform& t, Vec3 direction) {
  const auto column = [&](int j) {
    return t.m[0][j] * direction.x + t.m[1][j] * direction.y + t.m[2][j] * direction.z;
  };
  return {column(0), column(1), column(2)};
}

/// Lists the directions in which a sequence's outermost points are sought, in the coordinates of
/// its upright meshes: the directions that the object's rotation maps to cube_directions(), and
/// those that all transforms map to the scene's axes, so that boxes in the scene are exact.
std::vector<Vec3> survey_directions(const Scene& scene, const ChainObject& chained) {
  const ObjectSettings& object = *chained.settings;
  const ActorSettings& actor = *chained.actor;
  const bool stand = scene.arrange == Arrange::kStand && object.arrange;
  const Transform rotation = make_transform({}, object.rotate, {1, 1, 1});
  // Standing objects are scaled after their rotation, others before (arrange(), load_models.cpp).
  const Transform placing = stand ? compose(make_transform({}, {}, object.scale), rotation)
                                  : make_transform({}, object.rotate, object.scale);
  const Transform to_scene = compose(make_transform({}, actor.rotate, actor.scale), placing);
  std::vector<Vec3> directions;
  for (const Vec3 d : cube_directions()) directions.push_back(pull_direction_back(rotation, d));
  for (const Vec3 axis : {Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}})
    for (const float side : {-1.0f, 1.0f})
      directions.push_back(pull_direction_back(to_scene, axis * side));
  return directions;
}

/// Returns the outermost points along all directions, without repetition, in the order of `points`.
std::vector<Vec3> outermost_points(const std::vector<Vec3>& points,
                                   const std::vector<Vec3>& directions) {
  std::vector<std::size_t> outermost;
  for (const Vec3 direction : directions) {
    std::size_t best = 0;
    float farthest = -std::numeric_limits<float>::infinity();
    for (std::size_t i = 0; i < points.size(); ++i)
      if (const float distance = dot(points[i], direction); distance > farthest)
        farthest = distance, best = i;
    outermost.push_back(best);
  }
  std::sort(outermost.begin(), outermost.end());
  outermost.erase(std::unique(outermost.begin(), outermost.end()), outermost.end());
  std::vector<Vec3> result;
  for (const std::size_t i : outermost) result.push_back(points[i]);
  return result;
}

/// Returns the settings of a single mesh of the sequence.
ObjectSettings mesh_settings(const ObjectSettings& sequence, const std::filesystem::path& file) {
  ObjectSettings object = sequence;
  object.model = file;
  return object;
}

/// Hashes the faces. Meshes that differ only in their points' positions have equal hashes. The
/// orientation of faces is ignored, because the reader chooses it by the positions.
std::string topology_digest(const Model& model) {
  std::vector<std::uint32_t> corners;
  for (const Triangle& t : model.triangles) {
    corners.insert(corners.end(), {t.v[0], t.v[1], t.v[2]});
    std::sort(corners.end() - 3, corners.end());
  }
  Hasher hasher;
  hasher.add(model.points.size()).add(std::span<const std::uint32_t>(corners));
  return hasher.hex();
}

std::string velocity_digest(const std::vector<PointVelocity>& velocities) {
  Hasher hasher;
  for (const auto& [point, velocity] : velocities)
    hasher.add(velocity.x).add(velocity.y).add(velocity.z);
  return hasher.hex();
}

/// If the scene needs motion, logs the number of meshes whose motion to the next one is unknown.
void log_unknown_motion(const Scene& scene, const MeshSequence& sequence) {
  if (!needs_motion(scene)) return;
  const std::vector<MeshFile>& files = sequence.files;
  std::size_t unknown = 0, first = 0;  // number of these meshes, and index of the first
  for (std::size_t i = files.size(); i-- > 1;)
    if (files[i - 1].topology != files[i].topology && files[i - 1].velocities.empty())
      ++unknown, first = i - 1;
  if (unknown == 0) return;
  log_info(
      "{}: no motion blur or vectors between {} of its meshes and the next, as between {} and "
      "{}: their faces differ, and they store no velocities (vx vy vz of a PLY file)",
      sequence.object.name, unknown, files[first].number, files[first + 1].number);
}

/// Properties of one mesh that the survey keeps.
struct MeshFacts {
  std::vector<Vec3> outermost;  ///< points farthest along survey_directions()
  Box box;                      ///< bounding box in the file's coordinates
  std::vector<std::string> labels, warnings;
  std::uint64_t bytes = 0;  ///< model_bytes()
  std::size_t triangles = 0, textures = 0;
};

/// Reads a mesh, fills in `file`, and returns the facts. Sets file.problem if the mesh cannot be
/// shown.
MeshFacts inspect_mesh(const ObjectSettings& object, const std::vector<Vec3>& directions,
                       bool textures, MeshFile& file) {
  MeshFacts mesh_facts;
  const std::optional<AnimatedPose> pose = parse_pose_path(file.file);
  remember_input(pose ? pose->file : file.file);
  if (!model_exists(file.file)) {
    file.problem = fmt::format("mesh {}: {}: no such file", file.number, file.file.string());
    return mesh_facts;
  }
  const auto read = load_object(mesh_settings(object, file.file), textures, /*vertices=*/false,
                                mesh_facts.warnings);
  if (!read) {
    file.problem = fmt::format("mesh {}: {}", file.number, read.error().message);
    return mesh_facts;
  }
  file.digest = model_digest(read->model);
  file.topology = topology_digest(read->model);
  const std::vector<PointVelocity> velocities = load_ply_velocities(file.file);
  if (!velocities.empty()) file.velocities = velocity_digest(velocities);
  mesh_facts.outermost = outermost_points(read->model.points, directions);
  mesh_facts.box = read->placing.box;
  mesh_facts.labels = read->model.label_names;
  mesh_facts.bytes = model_bytes(read->model);
  mesh_facts.triangles = read->model.triangles.size();
  mesh_facts.textures = read->model.textures.size();
  return mesh_facts;
}

/// Adds the warnings of the first mesh that has any, and the number of other meshes that have any.
/// Of these, a pose of an animated model counts only if its warnings differ from the first ones.
void add_warnings(const MeshSequence& sequence, const std::vector<MeshFacts>& facts,
                  std::vector<std::string>& warnings) {
  const std::string model_path = sequence.object.model.string();
  const bool are_poses = parse_pose_path(sequence.files.front().file).has_value();
  std::vector<std::string> first_warnings;
  std::size_t others = 0;  // other meshes with warnings
  for (std::size_t i = 0; i < facts.size(); ++i) {
    std::vector<std::string> mesh_warnings = facts[i].warnings;
    const std::string file = sequence.files[i].file.string();
    // Name the model instead of the pose, so that equal warnings of two poses compare equal.
    for (std::string& warning : mesh_warnings)
      if (are_poses && warning.starts_with(file))
        warning = model_path + warning.substr(file.size());
    if (mesh_warnings.empty() || (are_poses && mesh_warnings == first_warnings)) continue;
    if (!first_warnings.empty()) ++others;
    if (first_warnings.empty()) first_warnings = std::move(mesh_warnings);
  }
  warnings.insert(warnings.end(), first_warnings.begin(), first_warnings.end());
  if (others > 0)
    warnings.push_back(fmt::format(
        "{}: {} more mesh{} warnings of {} own - info FILE prints those of a mesh", model_path,
        others, others == 1 ? " has" : "es have", others == 1 ? "its" : "their"));
}

/// Returns the index of the first mesh that can be shown; 0 if none can.
int first_usable_mesh(const std::vector<MeshFile>& files) {
  const auto usable = std::find_if(files.begin(), files.end(),
                                   [](const MeshFile& file) { return file.problem.empty(); });
  return usable == files.end() ? 0 : static_cast<int>(usable - files.begin());
}

/// Replaces the model's textures by equal ones of other meshes that are in memory.
void share_textures(TexturePool& pool, Model& model) {
  const std::lock_guard lock(pool.mutex);
  for (std::shared_ptr<const Texture>& texture : model.textures) {
    std::weak_ptr<const Texture>& pooled = pool.textures[pixel_digest(*texture)];
    if (const std::shared_ptr<const Texture> shared = pooled.lock())
      texture = shared;
    else
      pooled = texture;
  }
}

}  // namespace

Result<MeshSurvey> survey_meshes(const Scene& scene, const ChainObject& object, bool textures,
                                 std::vector<std::string>& warnings) {
  const ObjectSettings& settings = *object.settings;
  MeshSurvey survey;
  MeshSequence& sequence = survey.sequence;
  sequence.object = settings;
  sequence.textures = std::make_shared<TexturePool>();
  for (const int number : mesh_numbers(settings)) {
    MeshFile& file = sequence.files.emplace_back();
    file.number = number;
    file.file = mesh_file(settings, number);
  }
  const std::vector<Vec3> directions = survey_directions(scene, object);
  std::vector<MeshFacts> facts(sequence.files.size());
  parallel_for(static_cast<std::int64_t>(facts.size()), [&](std::int64_t index) {
    const auto i = static_cast<std::size_t>(index);
    facts[i] = inspect_mesh(settings, directions, textures, sequence.files[i]);
  });
  // Merge the facts in the order of the files.
  sequence.reference = first_usable_mesh(sequence.files);
  Model& model = survey.stand_in.model;
  survey.stand_in.placing.to_scene = upright(settings.up);
  model.name = settings.name;
  model.materials.emplace_back();  // a model has one material or more
  for (const MeshFacts& mesh_facts : facts) {
    model.points.insert(model.points.end(), mesh_facts.outermost.begin(),
                        mesh_facts.outermost.end());
    survey.stand_in.placing.box = unite(survey.stand_in.placing.box, mesh_facts.box);
    for (const std::string& label : mesh_facts.labels)
      if (std::find(model.label_names.begin(), model.label_names.end(), label) ==
          model.label_names.end())
        model.label_names.push_back(label);
    sequence.max_bytes = std::max(sequence.max_bytes, mesh_facts.bytes);
    sequence.max_triangles = std::max(sequence.max_triangles, mesh_facts.triangles);
    sequence.max_textures = std::max(sequence.max_textures, mesh_facts.textures);
  }
  add_warnings(sequence, facts, warnings);
  if (const auto pose = parse_pose_path(sequence.files.front().file))
    if (std::string others = describe_other_animations(*pose); !others.empty())
      warnings.push_back(std::move(others));
  log_unknown_motion(scene, sequence);
  if (model.points.empty())  // no mesh could be read
    return make_error(ErrorCode::kInput, "{}", sequence.files.front().problem);
  return survey;
}

Result<Model> load_mesh(const MeshSequence& sequence, int mesh) {
  const MeshFile& file = sequence.files[static_cast<std::size_t>(mesh)];
  if (!file.problem.empty()) return make_error(ErrorCode::kInput, "{}", file.problem);
  std::vector<std::string> warnings;  // the survey has reported them
  PM_TRY(LoadedObject read,
         load_object(mesh_settings(sequence.object, file.file), /*textures=*/true,
                     /*vertices=*/false, warnings));
  if (model_digest(read.model) != file.digest)
    return make_error(ErrorCode::kInput, "mesh {}: {}: was changed while it was used", file.number,
                      file.file.string());
  share_textures(*sequence.textures, read.model);
  apply_materials(read.model, sequence.object);
  for (const Transform& step : sequence.steps) read.model = transformed(read.model, step);
  return std::move(read.model);
}

Result<std::vector<Vec3>> read_mesh_vertices(const MeshSequence& sequence, int mesh) {
  const MeshFile& file = sequence.files[static_cast<std::size_t>(mesh)];
  if (!file.problem.empty()) return make_error(ErrorCode::kInput, "{}", file.problem);
  std::vector<std::string> warnings;  // the survey has reported them
  PM_TRY(LoadedObject read,
         load_object(mesh_settings(sequence.object, file.file), /*textures=*/false,
                     /*vertices=*/true, warnings));
  return std::move(read.placing.vertices);
}

Result<std::vector<Vec3>> compute_mesh_motion(const MeshSequence& sequence, const Model& shown,
                                              const MeshStep& step) {
  std::vector<Vec3> motion;  // per point of `shown`
  if (step.mesh == step.next) return motion;
  const MeshFile &file = sequence.files[static_cast<std::size_t>(step.mesh)],
                 &next = sequence.files[static_cast<std::size_t>(step.next)];
  if (file.topology == next.topology) {
    PM_TRY(const Model next_mesh, load_mesh(sequence, step.next));
    for (std::size_t i = 0; i < shown.points.size(); ++i)
      motion.push_back(next_mesh.points[i] - shown.points[i]);
    return motion;
  }
  if (file.velocities.empty()) return motion;
  // Read the mesh once more, in the file's coordinates, in which the velocities are stored.
  std::vector<std::string> warnings;  // the survey has reported them
  ObjectSettings as_stored = mesh_settings(sequence.object, file.file);
  as_stored.up = UpAxis::kY;
  PM_TRY(const LoadedObject stored,
         load_object(as_stored, /*textures=*/false, /*vertices=*/true, warnings));
  // Map points to velocities. If both lists have the same length, use the coordinates of
  // load_object() as keys, because load_ply_velocities() may round the same digits differently.
  const std::vector<PointVelocity> velocities = load_ply_velocities(file.file);
  const std::vector<Vec3>& vertices = stored.placing.vertices;
  std::map<std::array<float, 3>, Vec3> velocity_at;
  for (std::size_t i = 0; i < velocities.size(); ++i) {
    const Vec3 p = vertices.size() == velocities.size() ? vertices[i] : velocities[i].point;
    velocity_at.try_emplace({p.x, p.y, p.z}, velocities[i].velocity);
  }
  // A descending range plays backwards.
  const float direction =
      sequence.files.size() > 1 && sequence.files.front().number > sequence.files.back().number
          ? -1.0f
          : 1.0f;
  // Transform the velocities into the scene.
  Transform to_scene = upright(sequence.object.up);
  for (const Transform& transform : sequence.steps) to_scene = compose(transform, to_scene);
  const Vec3 origin = apply(to_scene, {});
  for (const Vec3 p : stored.model.points) {
    const auto entry = velocity_at.find({p.x, p.y, p.z});
    Vec3 velocity = entry == velocity_at.end() ? Vec3{} : entry->second;
    // The limit of coordinates (model/load/text_lines.cpp), per second; NaN fails the test, too.
    constexpr float kMaxSpeed = 1e15f;
    if (!(length(velocity) < kMaxSpeed)) velocity = {};
    motion.push_back((apply(to_scene, velocity) - origin) * (direction / step.fps));
  }
  if (motion.size() != shown.points.size())
    return make_error(ErrorCode::kInput, "mesh {}: {}: was changed while it was used", file.number,
                      file.file.string());
  return motion;
}

std::vector<std::string> find_mesh_problems(const MeshSequence& sequence) {
  std::vector<std::string> problems;
  for (const MeshFile& file : sequence.files)
    if (!file.problem.empty()) problems.push_back(file.problem);
  return problems;
}

std::string describe_meshes(const MeshSequence& sequence) {
  std::size_t broken = 0;  // meshes that cannot be shown, besides missing ones
  for (const MeshFile& file : sequence.files) {
    if (!file.problem.empty() && model_exists(file.file)) ++broken;
  }
  std::string text = sequence.object.name + ": " + describe_sequence(sequence.object);
  if (broken > 0) text += fmt::format(", {} broken", broken);
  return text + fmt::format(", at most {} triangles", sequence.max_triangles);
}

}  // namespace polymorph
