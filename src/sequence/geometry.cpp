#include "sequence/geometry.h"

#include <algorithm>

#include "base/parallel.h"
#include "kernels/morph_surface.h"
#include "model/normals.h"
#include "morph/labels.h"
#include "morph/motion.h"
#include "morph/pull_back.h"
#include "morph/smooth_map.h"
#include "sequence/film.h"
#include "surface/components.h"
#include "surface/crossfade.h"
#include "surface/grid.h"
#include "surface/level.h"

namespace polymorph {
namespace {

constexpr float kFirstId = 2;  // 0 is nothing, 1 the ground

const PreparedObject& object_of(const PreparedActor& actor, int object) {
  return actor.objects[static_cast<std::size_t>(object)];
}

const PreparedLeg& leg_of(const PreparedActor& actor, int leg) {
  return actor.legs[static_cast<std::size_t>(leg)];
}

std::string each_once(const std::vector<std::string>& names) {
  std::vector<std::string> seen;
  for (const std::string& name : names)
    if (std::find(seen.begin(), seen.end(), name) == seen.end()) seen.push_back(name);
  return fmt::format("{}", fmt::join(seen, ", "));
}

/// The model that shows, as it stands.
Mesh model_mesh(const PreparedActor& actor, const ActorGeometry& geometry) {
  Model model = object_of(actor, geometry.moment.object).model;
  model.points = geometry.points;
  return {model.points, point_normals(model), model.triangles};
}

/// `more` after `mesh`.
void append(Mesh& mesh, const Mesh& more) {
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  mesh.positions.insert(mesh.positions.end(), more.positions.begin(), more.positions.end());
  mesh.normals.insert(mesh.normals.end(), more.normals.begin(), more.normals.end());
  for (const Triangle& t : more.triangles)
    mesh.triangles.push_back({{t.v[0] + first, t.v[1] + first, t.v[2] + first}});
  // A flat one, which has no normals, makes the whole flat.
  if (mesh.normals.size() != mesh.positions.size()) mesh.normals.clear();
}

/// The object's labels in the actor's numbering.
std::vector<std::uint32_t> label_numbers(const PreparedActor& actor, const PreparedObject& object) {
  std::vector<std::uint32_t> numbers;
  for (const std::string& name : object.model.label_names)
    numbers.push_back(static_cast<std::uint32_t>(
        std::find(actor.label_names.begin(), actor.label_names.end(), name) -
        actor.label_names.begin()));
  return numbers;
}

/// One a point of the model: that of its last face.
std::vector<std::uint32_t> model_labels(const PreparedActor& actor, const PreparedObject& object) {
  const std::vector<std::uint32_t> numbers = label_numbers(actor, object);
  std::vector<std::uint32_t> labels(object.model.points.size(), 0);
  for (std::size_t t = 0; t < object.model.triangles.size(); ++t)
    for (const std::uint32_t v : object.model.triangles[t].v)
      labels[v] = numbers[object.model.labels[t]];
  return labels;
}

ObjectLayer object_layer(const PreparedActor& actor, std::size_t object, const Mesh& surface,
                         std::span<const Vec3> at, float share = 1) {
  const PreparedObject& o = actor.objects[object];
  return {object, share, transfer_materials(o.model, *o.outer, o.charts, at, surface.triangles)};
}

/// The objects' size at an eased time, by which a smooth map measures.
float size_at(const PreparedActor& actor, const PreparedLeg& leg, float u) {
  const float from = actor.objects[leg.from].model.box().diagonal(),
              to = actor.objects[leg.to].model.box().diagonal();
  return lerp(from, to, std::clamp(u, 0.0f, 1.0f));
}

/// A model's own normals on a surface that is nearly the model: mixed in by `weight`, taken where
/// the surface comes from (goes to). Else a smoothly shaded model would show its faces as soon as
/// it moves.
void add_shading(const PreparedObject& object, const AffineMap& map, const std::vector<Vec3>& at,
                 float weight, std::vector<Vec3>& normals) {
  const Model& model = object.model;
  if (model.corner_normals.size() != 3 * model.triangles.size() || normals.size() != at.size())
    return;
  const std::vector<ClosestPoint> closest = object.outer->closest(at);
  // Gradients turn back by the transposed map.
  const auto turned = [&](Vec3 n) {
    return normalized(map.rows[0] * n.x + map.rows[1] * n.y + map.rows[2] * n.z);
  };
  parallel_for(
      static_cast<std::int64_t>(at.size()),
      [&](std::int64_t index) {
        const auto i = static_cast<std::size_t>(index);
        const Vec3 shading = turned(interpolated_normal(model, closest[i]));
        // Not where the surface is another: beside edges, in gaps that it closes.
        if (dot(shading, normals[i]) > 0.8f)
          normals[i] = normalized(lerp(normals[i], shading, weight));
      },
      256);
}

/// The normals of a leg's surface near its ends.
Status blend_end_normals(const PreparedActor& actor, const PreparedLeg& leg,
                         SurfaceExtractor& extractor, ActorGeometry& geometry) {
  // Gone before much has changed.
  constexpr float kGone = 0.3f;
  const float u = geometry.moment.u, near = std::min(u, 1 - u);
  if (near >= kGone || geometry.surface.normals.empty()) return Ok{};
  const float fade = 1 - near / kGone, weight = fade * fade * (3 - 2 * fade);
  const FrameMap& map = geometry.map;
  PM_TRY(const PullBack pulled, pull_back(map, geometry.surface.positions, extractor));
  const bool leaving = u < 0.5f;
  add_shading(actor.objects[leaving ? leg.from : leg.to], map.regression->affine[leaving ? 0 : 1],
              leaving ? pulled.source : pulled.target, weight, geometry.surface.normals);
  return Ok{};
}

/// Where points of a leg's moving surface come from and go to; `map` is that of a leg made of
/// distances.
Result<PullBack> pulled_back(const PreparedLeg& leg, float time, const std::vector<Ball>& balls,
                             const FrameMap& map, const std::vector<Vec3>& points,
                             SurfaceExtractor& extractor) {
  if (leg.distance) return pull_back(map, points, extractor);
  return pull_back(leg.plan, time, balls, points, extractor);
}

float smooth_step(float from, float to, float u) {
  const float t = std::clamp((u - from) / (to - from), 0.0f, 1.0f);
  return t * t * (3 - 2 * t);
}

/// When a leg's colours change, by its progress: the source's detail goes, then the colours that
/// are left turn into the target's, then the target's detail comes. Detail of both at once would
/// show a face on a back; half way, where maps stretch most, it would be torn.
struct ColorFade {
  float color;           ///< share of the target
  float source, target;  ///< shares of either's detail
};
ColorFade color_fade(float u) {
  return {smooth_step(0.2f, 0.8f, u), 1 - smooth_step(0.1f, 0.45f, u), smooth_step(0.55f, 0.9f, u)};
}

Vec3 plain_color(const PreparedObject& object, Vec3 at) {
  return object.colors ? object.colors->at(at) : object.model.materials.front().color;
}

/// The surface's colours without detail after a leg, on what they were before it.
void fade_colors(const PreparedActor& actor, const PreparedLeg& leg, const PullBack& pulled,
                 const ColorFade& fade, ActorGeometry& geometry) {
  const PreparedObject &from = actor.objects[leg.from], &to = actor.objects[leg.to];
  if (std::all_of(actor.objects.begin(), actor.objects.end(),
                  [](const PreparedObject& object) { return !object.colors; }))
    return;
  if (geometry.colors.empty()) {
    geometry.colors.resize(pulled.source.size());
    parallel_for(
        static_cast<std::int64_t>(pulled.source.size()),
        [&](std::int64_t i) {
          const auto at = static_cast<std::size_t>(i);
          geometry.colors[at] = plain_color(from, pulled.source[at]);
        },
        4096);
  }
  parallel_for(
      static_cast<std::int64_t>(pulled.target.size()),
      [&](std::int64_t i) {
        const auto at = static_cast<std::size_t>(i);
        geometry.colors[at] =
            lerp(geometry.colors[at], plain_color(to, pulled.target[at]), fade.color);
      },
      4096);
  const float detail = (1 - geometry.color_share) * fade.source + fade.target;
  geometry.color_share = 1 - detail;
}

/// What the points of a moving surface wear: what the leg comes from, as it was there, and over it
/// what it goes to.
Status transfer_looks(const PreparedActor& actor, std::size_t leg, float time,
                      const std::vector<Ball>& balls, const FrameMap& map,
                      const std::vector<Vec3>& points, SurfaceExtractor& extractor,
                      ActorGeometry& geometry) {
  const PreparedLeg& way = actor.legs[leg];
  PM_TRY(const PullBack pulled, pulled_back(way, time, balls, map, points, extractor));
  // Balls in flight wore what the leg before them had made of its objects by then.
  const bool was_in_flight = leg > 0 && actor.legs[leg - 1].until < 1;
  if (was_in_flight) {
    const PreparedLeg& before = actor.legs[leg - 1];
    const std::vector<Ball> then = balls_at(before.plan, before.until);
    const FrameMap map_then =
        before.distance ? map_at(actor, before, before.until, then) : FrameMap{};
    PM_TRY_STATUS(transfer_looks(actor, leg - 1, before.until, then, map_then, pulled.source,
                                 extractor, geometry));
  } else {
    geometry.layers.push_back(object_layer(actor, way.from, geometry.surface, pulled.source));
  }
  const ColorFade fade = color_fade(std::clamp(progress_at(way.plan, time), 0.0f, 1.0f));
  geometry.layers.push_back(
      object_layer(actor, way.to, geometry.surface, pulled.target, fade.color));
  fade_colors(actor, way, pulled, fade, geometry);
  return Ok{};
}

/// The moment of a stage in which a model shows, whole or on its way to or from its balls.
Result<ActorGeometry> model_at(const PreparedScene& prepared, const PreparedActor& actor,
                               SurfaceExtractor& extractor, const MorphState& moment) {
  ActorGeometry geometry;
  geometry.moment = moment;
  const PreparedObject& object = object_of(actor, moment.object);
  const bool own_look = prepared.scene.look.kind == LookKind::kOwn;
  const auto add_own_layer = [&] {
    if (own_look)
      geometry.layers.push_back(object_layer(actor, static_cast<std::size_t>(moment.object),
                                             geometry.surface, geometry.surface.positions));
  };
  const float way = 1 - moment.boundary;  // from the model to its balls
  if (way <= 0) {
    geometry.points = object.model.points;
    return geometry;
  }
  switch (object.boundary) {
    case BoundaryMethod::kBlend:
      geometry.surface = blend_surface(object.blend, object.model, *object.closest, way);
      add_own_layer();
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
  PM_TRY(std::vector<Ball> balls, balls_at(leg_of(actor, moment.leg).plan, moment.time, extractor));
  geometry.balls =
      grown(std::move(balls), prepared.scene.field.kind, moment.growth, object.field_maximum);
  PM_TRY(geometry.surface,
         extract_surface(extractor, geometry.balls, actor.cell, prepared.extract));
  add_own_layer();
  return geometry;
}

/// Where what shows now goes until the next frame, within its stage. What the level does to keep
/// the volume is left out, and so are blended surfaces, which move by less than a cell.
Status add_flow(const PreparedActor& actor, SurfaceExtractor& extractor, bool last,
                ActorGeometry& geometry) {
  const MorphState& now = geometry.moment;
  const MorphState next = last ? now : morph_state_at(actor.timeline, now.frame + 1);
  if (now.object < 0) {
    const PreparedLeg& leg = leg_of(actor, now.leg);
    const bool goes_on = next.leg == now.leg && next.object < 0;
    const float then = goes_on ? next.time : leg.until;
    const std::vector<Vec3>& points = geometry.surface.positions;
    if (leg.distance) {
      PM_TRY(geometry.flow, flow_at(leg.plan, now.time, then, geometry.balls,
                                    size_at(actor, leg, now.u), points, extractor));
    } else {
      PM_TRY(geometry.flow, flow_at(leg.plan, now.time, then, geometry.balls, points, extractor));
    }
    return Ok{};
  }
  const PreparedObject& object = object_of(actor, now.object);
  if (object.boundary != BoundaryMethod::kProject || geometry.points.empty()) return Ok{};
  if (next.object >= 0 && next.object != now.object) return Ok{};
  const float way = next.object < 0 ? 1 : 1 - next.boundary;
  if (way == 1 - now.boundary) return Ok{};
  geometry.displacement = projected_mesh(object.model, object.projection, way).points;
  for (std::size_t i = 0; i < geometry.points.size(); ++i)
    geometry.displacement[i] = geometry.displacement[i] - geometry.points[i];
  return Ok{};
}

MaterialLayer layer_of(const PreparedActor& actor, const ObjectLayer& layers) {
  const Model& model = actor.objects[layers.object].model;
  return {layers.materials.corner_uvs, layers.materials.triangle_materials, model.materials,
          model.textures};
}

/// The actor's meshes; `id` is its surface's, its objects' follow. `first_label`: of the layer.
void add_meshes(const PreparedActor& actor, const ActorGeometry& geometry, float id,
                std::uint32_t first_label, const std::vector<std::string>& label_names,
                RenderScene& scene) {
  if (!geometry.surface.triangles.empty()) {
    RenderMesh mesh;
    mesh.positions = geometry.surface.positions;
    mesh.triangles = geometry.surface.triangles;
    mesh.vertex_normals = geometry.surface.normals;
    const std::vector<ObjectLayer>& layers = geometry.layers;
    if (!layers.empty()) static_cast<MaterialLayer&>(mesh) = layer_of(actor, layers.front());
    for (std::size_t i = 1; i < layers.size(); ++i)
      mesh.over.push_back({layer_of(actor, layers[i]), layers[i].share});
    mesh.vertex_colors = geometry.colors;
    mesh.vertex_color_share = geometry.color_share;
    mesh.look = layers.empty() ? 1.0f : 0.0f;
    mesh.id = id;
    mesh.vertex_labels = geometry.surface_labels;
    mesh.first_label = first_label;
    mesh.displacement = geometry.flow.displacement;
    mesh.vertex_blend = geometry.flow.blend;
    mesh.blend = geometry.moment.time;  // 0 and 1 on the ways out of and into a model
    mesh.moves = geometry.moves;
    mesh.name = actor.name;
    mesh.label_names = label_names;
    scene.meshes.push_back(mesh);
  }
  if (!geometry.points.empty()) {
    const Model& model = object_of(actor, geometry.moment.object).model;
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
    mesh.id = id + 1 + static_cast<float>(geometry.moment.object);
    mesh.vertex_labels = geometry.point_labels;
    mesh.first_label = first_label;
    mesh.displacement = geometry.displacement;
    mesh.blend = geometry.moment.time;
    mesh.moves = geometry.moves;
    mesh.name = actor.name;
    mesh.label_names = label_names;
    scene.meshes.push_back(mesh);
  }
}

}  // namespace

Result<ActorGeometry> balls_on_way(const PreparedScene& prepared, const PreparedActor& actor,
                                   SurfaceExtractor& extractor, int leg, float time) {
  const MorphPlan& plan = leg_of(actor, leg).plan;
  ActorGeometry geometry;
  geometry.moment.leg = leg;
  geometry.moment.time = time;
  geometry.moment.u = progress_at(plan, time);
  PM_TRY(geometry.balls, balls_at(plan, time, extractor));
  if (!leg_of(actor, leg).distance && plan.motion.keep_volume && time > 0 && time < 1) {
    const auto u = static_cast<double>(geometry.moment.u);
    const double from = actor.objects[leg_of(actor, leg).from].ball_volume;
    const double to = actor.objects[leg_of(actor, leg).to].ball_volume;
    const double volume = (1 - u) * from + u * to;
    // Most of the search on cells twice as large, which cost a fourth.
    PM_TRY(const float near,
           iso_for_volume(extractor, geometry.balls, 2 * actor.cell, prepared.extract, volume));
    PM_TRY(geometry.iso,
           iso_for_volume(extractor, geometry.balls, actor.cell, prepared.extract, volume, near));
  }
  return geometry;
}

namespace {

/// The least share of the volume that a part of the surface may have. What comes off between two
/// objects, a limb's tip perhaps, is left out unless it is as large as a part that one of them has.
double min_component_share_of(const PreparedActor& actor, const PreparedLeg& leg,
                              float min_component_share) {
  constexpr double kFragment = 0.015;
  const auto least = static_cast<double>(min_component_share);
  if (!leg.distance || least <= 0) return least;
  const double smallest = std::min(actor.objects[leg.from].distances.smallest_component_share,
                                   actor.objects[leg.to].distances.smallest_component_share);
  return std::max(least, std::min(kFragment, 0.5 * smallest));
}

}  // namespace

FrameMap map_at(const PreparedActor& actor, const PreparedLeg& leg, float time,
                const std::vector<Ball>& balls) {
  return frame_map(leg.plan, time, balls, size_at(actor, leg, progress_at(leg.plan, time)));
}

Result<Mesh> surface_between(const PreparedActor& actor, const PreparedLeg& leg,
                             const ActorGeometry& geometry, float cell,
                             const ExtractSettings& extract, SurfaceExtractor& extractor) {
  // No further than this share of the objects' size may the level go for the volume's sake.
  constexpr float kFurthest = 0.08f;
  const MorphState& moment = geometry.moment;
  const PreparedObject &from = actor.objects[leg.from], &to = actor.objects[leg.to];
  const FrameMap& map = geometry.map;
  const MorphSurface between = {map.regression, from.distances.grid, to.distances.grid,
                                map.from_scale, map.to_scale,        0};
  const bool at_an_end = moment.time <= 0 || moment.time >= 1;
  if (!leg.plan.motion.keep_volume || at_an_end)
    return extract_between(extractor, between, map.box, cell, extract);
  const auto u = static_cast<double>(moment.u);
  const double volume = (1 - u) * from.distances.volume + u * to.distances.volume;
  return surface_of_volume(extractor, between, map.box, cell, extract, volume,
                           kFurthest * size_at(actor, leg, moment.u));
}

Result<ActorGeometry> volume_at(const PreparedScene& prepared, const PreparedActor& actor,
                                SurfaceExtractor& extractor, int leg, float time) {
  PM_TRY(ActorGeometry geometry, balls_on_way(prepared, actor, extractor, leg, time));
  ExtractSettings extract = prepared.extract;
  extract.iso = geometry.iso;
  extract.method = prepared.scene.surface.method;
  extract.placement = prepared.scene.surface.placement;
  extract.flat = prepared.scene.surface.flat;
  if (leg_of(actor, leg).distance) {
    geometry.map = map_at(actor, leg_of(actor, leg), time, geometry.balls);
    PM_TRY(geometry.surface,
           surface_between(actor, leg_of(actor, leg), geometry, actor.cell, extract, extractor));
  } else {
    PM_TRY(geometry.surface, extract_surface(extractor, geometry.balls, actor.cell, extract));
  }
  // The cubes of a matrix are parts of their own.
  if (extract.method == SurfaceMethod::kMarchingCubes)
    remove_small_components(geometry.surface,
                            min_component_share_of(actor, leg_of(actor, leg),
                                                   prepared.scene.surface.min_component_share));
  return geometry;
}

Result<ActorGeometry> boundary_at(const PreparedScene& prepared, const PreparedActor& actor,
                                  SurfaceExtractor& extractor, int leg, bool leaving, float way) {
  MorphState moment;
  moment.leg = leg;
  moment.object = static_cast<int>(leaving ? leg_of(actor, leg).from : leg_of(actor, leg).to);
  if (object_of(actor, moment.object).boundary == BoundaryMethod::kCut) way = 0;
  moment.time = leaving ? 0.0f : 1.0f;
  moment.boundary = 1 - way;
  moment.growth = way;
  return model_at(prepared, actor, extractor, moment);
}

Mesh shown_mesh(const PreparedActor& actor, const ActorGeometry& geometry) {
  Mesh mesh = geometry.surface;
  if (!geometry.points.empty()) append(mesh, model_mesh(actor, geometry));
  return mesh;
}

Result<FrameGeometry> geometry_at(const PreparedScene& prepared, SurfaceExtractor& extractor,
                                  int frame) {
  FrameGeometry geometry;
  geometry.frame = frame;
  const int shown = shown_frame(prepared.scene, frame);
  const bool turned = prepared.scene.frames.turntable > 0;  // nothing but the camera moves
  const bool last = turned || frame == prepared.frame_count;
  geometry.t = sequence_time(prepared.scene, shown);
  geometry.stage = stage_names(prepared, frame);
  const bool flows = wants_flow(scene_at(prepared.scene, static_cast<double>(frame)));
  for (const PreparedActor& actor : prepared.actors) {
    const MorphState moment = morph_state_at(actor.timeline, shown);
    if (moment.object >= 0) {
      PM_TRY(ActorGeometry one, model_at(prepared, actor, extractor, moment));
      if (flows) PM_TRY_STATUS(add_flow(actor, extractor, last, one));
      geometry.actors.push_back(std::move(one));
      continue;
    }
    PM_TRY(ActorGeometry one, volume_at(prepared, actor, extractor, moment.leg, moment.time));
    one.moment = moment;
    if (leg_of(actor, moment.leg).distance)
      PM_TRY_STATUS(blend_end_normals(actor, leg_of(actor, moment.leg), extractor, one));
    if (prepared.scene.look.kind == LookKind::kOwn && !one.surface.triangles.empty())
      PM_TRY_STATUS(transfer_looks(actor, static_cast<std::size_t>(moment.leg), moment.time,
                                   one.balls, one.map, one.surface.positions, extractor, one));
    if (flows) PM_TRY_STATUS(add_flow(actor, extractor, last, one));
    geometry.actors.push_back(std::move(one));
  }
  for (std::size_t a = 0; a < prepared.actors.size(); ++a)
    geometry.actors[a].moves = !turned && moves_at(prepared.actors[a].timeline, shown);
  if (aov_is_chosen(prepared.scene.image.aovs, "label") ||
      aov_is_chosen(prepared.scene.image.aovs, "crypto_label"))
    for (std::size_t a = 0; a < prepared.actors.size(); ++a) {
      const PreparedActor& actor = prepared.actors[a];
      ActorGeometry& one = geometry.actors[a];
      if (!one.surface.positions.empty()) {
        PM_TRY(one.surface_labels, surface_labels(actor, one, extractor));
      }
      if (!one.points.empty())
        one.point_labels = model_labels(actor, object_of(actor, one.moment.object));
    }
  return geometry;
}

std::string stage_names(const PreparedScene& prepared, int frame) {
  std::vector<std::string> names;
  for (const PreparedActor& actor : prepared.actors)
    names.emplace_back(
        stage_name(morph_state_at(actor.timeline, shown_frame(prepared.scene, frame)).stage));
  return each_once(names);
}

std::size_t ball_count(const FrameGeometry& geometry) {
  std::size_t count = 0;
  for (const ActorGeometry& actor : geometry.actors) count += actor.balls.size();
  return count;
}

Mesh surfaces_of(const FrameGeometry& geometry) {
  Mesh mesh;
  for (const ActorGeometry& actor : geometry.actors) append(mesh, actor.surface);
  return mesh;
}

Result<std::vector<std::uint32_t>> surface_labels(const PreparedActor& actor,
                                                  const ActorGeometry& geometry,
                                                  SurfaceExtractor& extractor) {
  const std::vector<Vec3>& points = geometry.surface.positions;
  const MorphState& moment = geometry.moment;
  if (moment.object < 0) {
    const PreparedLeg& leg = leg_of(actor, moment.leg);
    const auto names = [&](std::size_t object) {
      const std::vector<std::uint32_t> numbers = label_numbers(actor, actor.objects[object]);
      std::vector<std::uint32_t> own;
      for (const std::uint32_t label : actor.objects[object].ball_labels)
        own.push_back(numbers[label]);
      return own;
    };
    return label_points(leg.plan, moment.time, geometry.balls, points, names(leg.from),
                        names(leg.to), extractor);
  }
  const PreparedObject& object = object_of(actor, moment.object);
  const std::vector<std::uint32_t> numbers = label_numbers(actor, object);
  std::vector<std::uint32_t> labels;
  for (const ClosestPoint& point : object.outer->closest(points))
    labels.push_back(numbers[object.model.labels[point.triangle]]);
  return labels;
}

Result<FrameMesh> mesh_of(const PreparedScene& prepared, const FrameGeometry& geometry,
                          SurfaceExtractor& extractor) {
  FrameMesh frame;
  std::vector<std::string> kinds;
  for (std::size_t a = 0; a < prepared.actors.size(); ++a) {
    const ActorGeometry& one = geometry.actors[a];
    const bool is_model = one.surface.triangles.empty() && !one.points.empty();
    kinds.push_back(is_model ? "model" : "surface");
    const PreparedActor& actor = prepared.actors[a];
    const auto first = static_cast<std::uint32_t>(frame.tags.label_names.size());
    for (const std::string& name : actor.label_names)
      frame.tags.label_names.push_back(prepared.actors.size() > 1 ? actor.name + "." + name : name);
    std::vector<std::uint32_t> labels;
    if (is_model) {
      labels = model_labels(actor, object_of(actor, one.moment.object));
    } else {
      PM_TRY(labels, surface_labels(actor, one, extractor));
    }
    for (const std::uint32_t label : labels) frame.tags.labels.push_back(first + label);
    frame.tags.parts.push_back({actor.name, frame.mesh.triangles.size()});
    append(frame.mesh, is_model ? model_mesh(actor, one) : one.surface);
  }
  frame.what = each_once(kinds);
  return frame;
}

RenderScene render_scene(const PreparedScene& prepared, const FrameGeometry& geometry) {
  RenderScene scene;
  const FrameView view = view_of(prepared, geometry.frame);
  scene.camera = view.camera;
  scene.camera_motion = view.camera_motion;
  scene.rig = view.rig;
  scene.lights = view.scene.lights;
  scene.ground = view.ground;
  scene.look = view.scene.look;
  scene.environment = prepared.environment;
  scene.bounds = prepared.box;
  scene.moment = geometry.t;
  float id = kFirstId;
  std::uint32_t label = 1;  // 0 is nothing and the ground
  for (std::size_t a = 0; a < prepared.actors.size(); ++a) {
    std::vector<std::string> names = prepared.actors[a].label_names;
    if (prepared.actors.size() > 1)
      for (std::string& name : names) name = prepared.actors[a].name + "." + name;
    add_meshes(prepared.actors[a], geometry.actors[a], id, label, names, scene);
    label += static_cast<std::uint32_t>(prepared.actors[a].label_names.size());
    id += 1 + static_cast<float>(prepared.actors[a].objects.size());
  }
  return scene;
}

}  // namespace polymorph
