#include "sequence/prepare.h"

#include <algorithm>
#include <cmath>

#include "base/hash.h"
#include "base/log.h"
#include "image/image_io.h"
#include "model/load_obj.h"
#include "model/normals.h"
#include "model/shapes.h"
#include "morph/labels.h"
#include "morph/motion.h"
#include "morph/pull_back.h"
#include "scene/load_scene.h"
#include "spheres/figures.h"
#include "surface/crossfade.h"
#include "surface/crumbs.h"
#include "surface/grid.h"
#include "surface/level.h"
#include "surface/mesh_check.h"

namespace polymorph {
namespace {

constexpr float kSurfaceId = 2;  // 0 is nothing, 1 the ground
constexpr float kFirstObjectId = 3;

Result<Model> load_object(const ObjectSettings& object, bool textures,
                          std::vector<std::string>& warnings) {
  if (!object.shape.empty()) return make_shape(object.shape);
  LoadObjSettings settings;
  settings.textures = textures;
  PM_TRY(LoadedModel loaded, load_obj(object.model, settings));
  warnings.insert(warnings.end(), loaded.warnings.begin(), loaded.warnings.end());
  return std::move(loaded.model);
}

void paint(Model& model, Vec3 color) {
  Material material;
  material.name = "color";
  material.color = color;
  model.materials = {material};
  model.triangle_materials.assign(model.triangles.size(), 0);
  model.textures.clear();
}

/// Puts an object in its place. Standing: turned, brought to the wanted size, centred on the y axis
/// with its foot on y = 0; the user's scale then works about that foot. `size` <= 0 leaves the size
/// as it is.
Model arranged(const Model& model, const ObjectSettings& object, bool stand, float size) {
  if (!stand)
    return transformed(model, make_transform(object.translate, object.rotate, object.scale));
  const Model turned = transformed(model, make_transform({}, object.rotate, {1, 1, 1}));
  const Box box = turned.box();
  const float diagonal = model.box().diagonal();  // before turning: a turn must not change the size
  const float factor = size > 0 && diagonal > 0 ? size / diagonal : 1;
  const Vec3 foot{box.center().x, box.low.y, box.center().z};
  const Transform to_origin = make_transform(-factor * foot, {}, {factor, factor, factor});
  const Transform by_user = make_transform(object.translate, {}, object.scale);
  return transformed(turned, compose(by_user, to_origin));
}

/// Everything that decides the pixels: settings, models, textures, environment, and the program
/// itself.
std::string content_hash(const Scene& scene, const std::vector<Model>& models,
                         const Image* environment) {
  Scene settings = scene;
  settings.output = {};  // where frames go does not change them
  settings.description.clear();
  Hasher hasher;
  hasher.add(std::string_view(PM_VERSION));
  hasher.add(scene_to_json(settings, std::filesystem::absolute(scene.path).parent_path()));
  for (const Model& model : models) {
    hasher.add(std::span<const Vec3>(model.points)).add(std::span<const Triangle>(model.triangles));
    hasher.add(std::span<const Vec3>(model.corner_normals))
        .add(std::span<const Vec2>(model.corner_uvs));
    hasher.add(std::span<const std::uint32_t>(model.triangle_materials));
    for (const Material& m : model.materials) {
      for (const Vec3 v : {m.color, m.specular}) hasher.add(v.x).add(v.y).add(v.z);
      hasher.add(m.roughness).add(m.metallic).add(m.texture);
    }
    for (const auto& texture : model.textures) hasher.add(pixel_digest(*texture));
  }
  if (environment) hasher.add(pixel_digest(*environment));
  return hasher.hex();
}

/// What turns the model into its balls' surface and back.
Status make_boundary(PreparedObject& object, const InsideTest& inside, Mesh surface,
                     const Scene& scene, float cell, const ExtractSettings& extract,
                     SurfaceExtractor& extractor) {
  constexpr double kArrived = 0.98;
  object.boundary = scene.boundary.method;
  if (object.boundary == BoundaryMethod::kCrossfade)
    object.shrink_targets = shrink_targets(object.model, object.balls, scene.field.kind);
  if (object.boundary == BoundaryMethod::kProject) {
    object.projection = project_model(object.model, inside, object.balls, scene.field.kind);
    const double arrived = object.projection.arrived;
    if (arrived >= kArrived) {
      log_debug("{}: {:.1f} % of its mesh arrives on the balls' surface", object.name,
                100 * arrived);
    } else {
      log_info("{}: only {:.1f} % of its mesh arrives on the balls' surface - blended instead",
               object.name, 100 * arrived);
      object.boundary = BoundaryMethod::kBlend;
    }
  }
  if (object.boundary == BoundaryMethod::kBlend) {
    PM_TRY(object.blend, make_blend_field(object.model, inside, *object.closest, object.balls,
                                          std::move(surface), cell, extract, extractor));
  }
  return Ok{};
}

/// Balls of one object, their surface's volume, and what the boundary stages need.
Status make_balls(PreparedObject& object, const ObjectSettings& settings, const Scene& scene,
                  float cell, const ExtractSettings& extract, SurfaceExtractor& extractor,
                  const std::filesystem::path& cache) {
  SphereSettings spheres = settings.spheres;
  if (scene.field.kind != FieldKind::kGaussian) spheres.fit = FitKind::kNone;  // fits are Gaussian
  auto approximation = approximate_cached(object.model, spheres, cache);
  if (!approximation)
    return make_error(approximation.error().code, "{}: {}", object.name,
                      approximation.error().message);
  object.sphere_count = approximation->tree.leaves().size();
  const InsideTest inside(object.model);
  object.model_volume = solid_volume(object.model, inside);
  if (!approximation->balls.empty()) {
    object.balls = std::move(approximation->balls);
  } else {
    PM_TRY(object.balls,
           unfitted_balls(approximation->tree.leaves(), spheres.method, object.model_volume,
                          scene.field, cell, extract, extractor));
  }
  PM_TRY(Mesh mesh, extract_surface(extractor, object.balls, cell, extract));
  object.ball_volume = volume_of(mesh);
  if (mesh.triangles.empty())
    return make_error(ErrorCode::kInput,
                      "{}: its {} balls have no surface at this threshold - lower field.threshold "
                      "or raise spheres.resolution",
                      object.name, object.balls.size());
  PM_TRY(object.field_maximum, field_maximum(extractor, object.balls, extract));
  object.closest = std::make_shared<const ClosestPointQuery>(object.model);
  object.charts = texture_charts(object.model);
  if (object.meta) return Ok{};
  return make_boundary(object, inside, std::move(mesh), scene, cell, extract, extractor);
}

PlanSide plan_side(const PreparedObject& object, const std::vector<std::int32_t>& classes) {
  PlanSide side;
  side.balls = object.balls;
  for (const std::uint32_t label : face_labels(object.model, object.balls))
    side.labels.push_back(classes[label]);
  return side;
}

Status make_plans(PreparedScene& prepared) {
  const Scene& scene = prepared.scene;
  std::vector<LabelledObject> labels;
  for (const PreparedObject& object : prepared.objects)
    labels.push_back({object.name, object.model.label_names});
  PM_TRY_STATUS(check_label_map(labels, scene.plan.labels));
  for (std::size_t i = 0; i + 1 < prepared.objects.size(); ++i) {
    const LabelMatch match = match_labels(labels[i], labels[i + 1], scene.plan.labels);
    PlanSide from = plan_side(prepared.objects[i], match.from);
    PlanSide to = plan_side(prepared.objects[i + 1], match.to);
    for (const LandmarkSettings& landmark : scene.plan.landmarks)
      if (landmark.leg == static_cast<int>(i) + 1) {
        from.landmarks.push_back(landmark.from);
        to.landmarks.push_back(landmark.to);
      }
    prepared.plans.push_back(plan_morph(std::move(from), std::move(to), scene.field.kind,
                                        scene.plan, prepared.timeline.legs[i].motion));
  }
  return Ok{};
}

void place_camera(PreparedScene& prepared) {
  const Scene& scene = prepared.scene;
  std::vector<Vec3> points;  // the models themselves: their common box has empty corners
  for (const PreparedObject& object : prepared.objects)
    points.insert(points.end(), object.model.points.begin(), object.model.points.end());
  prepared.camera = make_camera(scene.camera, points, scene.image.width, scene.image.height);
  prepared.ground = scene.ground;
  // A hair below the feet, so that flat bottoms do not share a plane with it.
  if (!prepared.ground.height)
    prepared.ground.height = prepared.box.low.y - 1e-3f * prepared.box.diagonal();
}

/// One object of the chain in its place; `size` is the source's, or 0 for the source itself.
Result<Model> load_arranged(const Scene& scene, const ObjectSettings& object, bool textures,
                            float& size, std::vector<std::string>& warnings) {
  PM_TRY(Model model, load_object(object, textures, warnings));
  if (object.color) paint(model, *object.color);
  const bool is_source = size == 0;
  if (is_source) size = model.box().diagonal();
  const bool stand = scene.arrange == Arrange::kStand && object.arrange;
  return arranged(model, object, stand, is_source ? 0 : size);
}

}  // namespace

Result<LoadedScene> load_models(const Scene& scene, bool textures) {
  LoadedScene loaded;
  float size = 0;
  for (const ObjectSettings* object : chain_objects(scene)) {
    PM_TRY(Model model, load_arranged(scene, *object, textures, size, loaded.warnings));
    loaded.models.push_back(std::move(model));
  }
  return loaded;
}

std::vector<std::string> find_problems(const Scene& scene, const std::filesystem::path& cache,
                                       LoadedScene& loaded) {
  std::vector<std::string> problems;
  float size = 0;
  for (const ObjectSettings* object : chain_objects(scene)) {
    auto model = load_arranged(scene, *object, true, size, loaded.warnings);
    loaded.models.push_back(model ? std::move(*model) : Model{});
    // A fit takes seconds and fails at nothing that its spheres do not fail at.
    SphereSettings unfitted = object->spheres;
    unfitted.fit = FitKind::kNone;
    unfitted.error = 0;
    if (!model) {
      problems.push_back(model.error().message);
    } else if (const auto spheres = approximate_cached(loaded.models.back(), unfitted, cache);
               !spheres) {
      problems.push_back(fmt::format("{}: {}", object->name, spheres.error().message));
    }
  }
  if (!scene.lights.environment.empty())
    if (const auto image = read_image(scene.lights.environment); !image)
      problems.push_back(image.error().message);
  return problems;
}

Result<PreparedScene> prepare_scene(const Scene& scene, SurfaceExtractor& extractor,
                                    const std::filesystem::path& cache) {
  PM_TRY(LoadedScene loaded, load_models(scene, true));
  PreparedScene prepared;
  prepared.scene = scene;
  prepared.warnings = std::move(loaded.warnings);
  if (!scene.lights.environment.empty()) {
    PM_TRY(Image image, read_image(scene.lights.environment));
    prepared.environment = std::make_shared<const Image>(std::move(image));
  }
  prepared.hash = content_hash(scene, loaded.models, prepared.environment.get());
  prepared.timeline = make_timeline(scene);
  prepared.extract.field = scene.field.kind;
  prepared.extract.influence = scene.surface.influence;
  for (const Model& model : loaded.models) prepared.box = unite(prepared.box, model.box());
  const Vec3 size = prepared.box.size();
  prepared.cell = std::max({size.x, size.y, size.z}) / static_cast<float>(scene.surface.resolution);
  if (!(prepared.cell > 0))
    return make_error(ErrorCode::kInput, "{}: the objects have no extent - check their scale",
                      scene.path.string());

  const auto settings = chain_objects(scene);
  for (std::size_t i = 0; i < settings.size(); ++i) {
    PreparedObject object;
    object.name = settings[i]->name;
    object.meta = settings[i]->meta;
    object.model = std::move(loaded.models[i]);
    PM_TRY_STATUS(
        make_balls(object, *settings[i], scene, prepared.cell, prepared.extract, extractor, cache));
    prepared.objects.push_back(std::move(object));
  }
  PM_TRY_STATUS(make_plans(prepared));
  place_camera(prepared);
  return prepared;
}

Result<FrameGeometry> volume_at(const PreparedScene& prepared, SurfaceExtractor& extractor, int leg,
                                float time) {
  const MorphPlan& plan = prepared.plans[static_cast<std::size_t>(leg)];
  FrameGeometry geometry;
  geometry.moment.leg = leg;
  geometry.moment.time = time;
  geometry.moment.u = progress_at(plan, time);
  geometry.balls = balls_at(plan, time);
  if (plan.motion.keep_volume && time > 0 && time < 1) {
    const auto u = static_cast<double>(geometry.moment.u);
    const double from = prepared.objects[static_cast<std::size_t>(leg)].ball_volume;
    const double to = prepared.objects[static_cast<std::size_t>(leg) + 1].ball_volume;
    PM_TRY(geometry.iso, iso_for_volume(extractor, geometry.balls, prepared.cell, prepared.extract,
                                        (1 - u) * from + u * to));
  }
  ExtractSettings extract = prepared.extract;
  extract.iso = geometry.iso;
  extract.method = prepared.scene.surface.method;
  extract.placement = prepared.scene.surface.placement;
  extract.flat = prepared.scene.surface.flat;
  PM_TRY(geometry.surface, extract_surface(extractor, geometry.balls, prepared.cell, extract));
  // The cubes of a matrix are parts of their own.
  if (extract.method == SurfaceMethod::kMarchingCubes)
    drop_crumbs(geometry.surface, static_cast<double>(prepared.scene.surface.crumbs));
  return geometry;
}

namespace {

Clothes clothes_of(const PreparedScene& prepared, int object, const Mesh& surface,
                   std::span<const Vec3> at) {
  const PreparedObject& o = prepared.objects[static_cast<std::size_t>(object)];
  return {object, transfer_materials(o.model, *o.closest, o.charts, at, surface.triangles)};
}

/// Gives the volumetric stage's surface what the objects wear at the points it was pulled back to.
void dress(const PreparedScene& prepared, FrameGeometry& geometry) {
  if (prepared.scene.look.kind != LookKind::kOwn || geometry.surface.triangles.empty()) return;
  const Moment& m = geometry.moment;
  const PullBack pulled = pull_back(prepared.plans[static_cast<std::size_t>(m.leg)], m.time,
                                    geometry.balls, geometry.surface.positions);
  geometry.own = clothes_of(prepared, m.leg, geometry.surface, pulled.source);
  geometry.other = clothes_of(prepared, m.leg + 1, geometry.surface, pulled.target);
}

}  // namespace

Result<FrameGeometry> geometry_at(const PreparedScene& prepared, SurfaceExtractor& extractor,
                                  int frame) {
  FrameGeometry geometry;
  const Moment moment = moment_at(prepared.timeline, frame);
  const auto at = [](int i) { return static_cast<std::size_t>(i); };
  if (moment.object < 0) {
    PM_TRY(geometry, volume_at(prepared, extractor, moment.leg, moment.time));
    geometry.moment = moment;
    dress(prepared, geometry);
    return geometry;
  }
  geometry.moment = moment;
  const PreparedObject& object = prepared.objects[at(moment.object)];
  const float way = 1 - moment.boundary;  // from the model to its balls
  if (way <= 0) {
    geometry.points = object.model.points;
    return geometry;
  }
  switch (object.boundary) {
    case BoundaryMethod::kBlend:
      geometry.surface = blend_surface(object.blend, object.model, *object.closest, way);
      if (prepared.scene.look.kind == LookKind::kOwn)
        geometry.own =
            clothes_of(prepared, moment.object, geometry.surface, geometry.surface.positions);
      return geometry;
    case BoundaryMethod::kProject: {
      MovingMesh mesh = projected_mesh(object.model, object.projection, way);
      geometry.points = std::move(mesh.points);
      geometry.corner_normals = std::move(mesh.corner_normals);
      return geometry;
    }
    case BoundaryMethod::kCrossfade:
      break;
    case BoundaryMethod::kCut:
      PM_CHECK(false);  // has no such stage
  }
  if (moment.boundary > 0)
    geometry.points = shrunk_points(object.model, object.shrink_targets, moment.boundary);
  geometry.balls = grown(balls_at(prepared.plans[at(moment.leg)], moment.time),
                         prepared.scene.field.kind, moment.growth, object.field_maximum);
  PM_TRY(geometry.surface,
         extract_surface(extractor, geometry.balls, prepared.cell, prepared.extract));
  if (prepared.scene.look.kind == LookKind::kOwn)
    geometry.own =
        clothes_of(prepared, moment.object, geometry.surface, geometry.surface.positions);
  return geometry;
}

namespace {

MaterialLayer layer_of(const PreparedScene& prepared, const Clothes& clothes) {
  if (clothes.object < 0) return {};
  const Model& model = prepared.objects[static_cast<std::size_t>(clothes.object)].model;
  return {clothes.materials.corner_uvs, clothes.materials.triangle_materials, model.materials,
          model.textures};
}

}  // namespace

RenderScene render_scene(const PreparedScene& prepared, const FrameGeometry& geometry) {
  RenderScene scene;
  scene.camera = prepared.camera;
  scene.lights = prepared.scene.lights;
  scene.ground = prepared.ground;
  scene.look = prepared.scene.look;
  scene.environment = prepared.environment;
  scene.bounds = prepared.box;
  if (!geometry.surface.triangles.empty()) {
    RenderMesh mesh;
    mesh.positions = geometry.surface.positions;
    mesh.triangles = geometry.surface.triangles;
    mesh.vertex_normals = geometry.surface.normals;
    static_cast<MaterialLayer&>(mesh) = layer_of(prepared, geometry.own);
    mesh.other = layer_of(prepared, geometry.other);
    mesh.other_share = std::clamp(geometry.moment.u, 0.0f, 1.0f);
    mesh.look = geometry.own.object < 0 ? 1.0f : 0.0f;
    mesh.id = kSurfaceId;
    scene.meshes.push_back(mesh);
  }
  if (!geometry.points.empty()) {
    const Model& model = prepared.objects[static_cast<std::size_t>(geometry.moment.object)].model;
    RenderMesh mesh;
    mesh.positions = geometry.points;
    mesh.triangles = model.triangles;
    mesh.corner_normals =
        geometry.corner_normals.empty() ? model.corner_normals : geometry.corner_normals;
    mesh.corner_uvs = model.corner_uvs;
    mesh.triangle_materials = model.triangle_materials;
    mesh.materials = model.materials;
    mesh.textures = model.textures;
    mesh.look = geometry.moment.look;
    mesh.id = kFirstObjectId + static_cast<float>(geometry.moment.object);
    scene.meshes.push_back(mesh);
  }
  return scene;
}

}  // namespace polymorph
