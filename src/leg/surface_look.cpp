#include "leg/surface_look.h"

#include <algorithm>

#include "base/parallel.h"
#include "leg/leg_surface.h"
#include "mesh/closest.h"
#include "morph/easing.h"
#include "morph/motion.h"

namespace polymorph {
namespace {

float smoothstep(float low, float high, float x) {
  const float t = std::clamp((x - low) / (high - low), 0.0f, 1.0f);
  return t * t * (3.0f - 2.0f * t);
}

/// Mixes the leg's colours without detail over the colours of the legs before it. `is_last`: no
/// other leg follows.
void fade_colors(const Leg& leg, const PullBack& pulled, const ColorFade& fade, bool is_last,
                 SurfaceLook& look) {
  if (!leg.settings.has_colors) return;
  // Weight of the detail. The detail of the layers below fades as the source's detail does.
  const float detail = (1 - look.color_opacity) * fade.source + fade.target;
  look.color_opacity = 1 - detail;
  if (is_last && detail >= 1) {  // the detail covers these colours
    look.colors.clear();
    return;
  }
  const bool is_first_leg = look.colors.empty();
  look.colors.resize(pulled.source.size());
  parallel_for(
      static_cast<std::int64_t>(pulled.source.size()),
      [&](std::int64_t index) {
        const auto i = static_cast<std::size_t>(index);
        Vec3& color = look.colors[i];
        if (is_first_leg && fade.color < 1) color = plain_color(*leg.from, pulled.source[i]);
        if (fade.color > 0) color = lerp(color, plain_color(*leg.to, pulled.target[i]), fade.color);
      },
      /*grain=*/4096);
}

/// The surface whose look is computed, and the look of the legs added so far.
struct LookTarget {
  std::span<const Triangle> triangles;
  Engine& engine;
  SurfaceLook look;
};

/// The points of a surface on both objects of a leg.
struct LegOrigins {
  const PullBack& pulled;
  std::vector<ClosestPoint> source, target;  ///< closest points of the objects, as in Origins
};

/// Adds the look of a leg at a time of its motion. If the leg began with the balls in flight of an
/// earlier one, the look of that leg is added first, below.
Status add_look(const Leg& leg, float time, const LegOrigins& origins, bool is_last,
                LookTarget& target) {
  const PullBack& pulled = origins.pulled;
  const ColorFade fade = color_fade(std::clamp(progress_at(leg.plan, time), 0.0f, 1.0f));
  std::vector<ObjectLayer>& layers = target.look.layers;
  // Layers whose weight would be 0 are skipped.
  if (leg.before && fade.color < 1) {
    PM_TRY(const LegState handover, leg_state(*leg.before, leg.before->until, target.engine));
    PM_TRY(const PullBack earlier, pull_back(*leg.before, handover, pulled.source, target.engine));
    PM_TRY_STATUS(add_look(*leg.before, handover.time, {earlier, /*source=*/{}, /*target=*/{}},
                           /*is_last=*/false, target));
  } else if (fade.color < 1) {
    layers.push_back(object_layer(leg.from, target.triangles, {pulled.source, origins.source}));
  }
  if (fade.color > 0)
    layers.push_back(
        object_layer(leg.to, target.triangles, {pulled.target, origins.target}, fade.color));
  fade_colors(leg, pulled, fade, is_last, target.look);
  return Ok{};
}

}  // namespace

ColorFade color_fade(float u) {
  return {smoothstep(0.2f, 0.8f, u), 1 - smoothstep(0.1f, 0.45f, u), smoothstep(0.55f, 0.9f, u)};
}

ObjectLayer object_layer(std::shared_ptr<const PreparedObject> object,
                         std::span<const Triangle> triangles, const Origins& origins,
                         float opacity) {
  auto materials = std::make_shared<const MaterialTransfer>(object->model, *object->outer,
                                                            object->charts, origins, triangles);
  return {std::move(object), opacity, std::move(materials)};
}

Vec3 plain_color(const PreparedObject& object, Vec3 at) {
  return object.colors ? object.colors->at(at) : object.model.materials.front().color;
}

std::vector<ClosestPoint> add_end_normals(const EndNormals& end, std::vector<Vec3>& normals) {
  const PreparedObject& object = end.object;
  const std::vector<Vec3>& origins = end.origins;
  const Model& model = object.model;
  if (model.corner_normals.size() != 3 * model.triangles.size() || normals.size() != origins.size())
    return {};
  std::vector<ClosestPoint> closest = object.outer->closest(origins);
  parallel_for(
      static_cast<std::int64_t>(origins.size()),
      [&](std::int64_t index) {
        const auto i = static_cast<std::size_t>(index);
        const Vec3 n = interpolate_normal(model, model.corner_normals, closest[i]);
        // Normals transform from the object to the surface by the transposed map.
        const Vec3 shading =
            normalized(end.map.rows[0] * n.x + end.map.rows[1] * n.y + end.map.rows[2] * n.z);
        // Where the surface differs from the model, at edges and in filled gaps, the normal stays.
        if (dot(shading, normals[i]) > 0.8f)  // within 37 degrees
          normals[i] = normalized(lerp(normals[i], shading, end.weight));
      },
      /*grain=*/256);
  return closest;
}

float end_normals_weight(float distance) {
  // Eased progress from an end within which the surface has not changed much at any pace.
  constexpr float kMaxEndDistance = 0.3f;
  return smoothstep(0, 1, 1 - distance / kMaxEndDistance);
}

Result<SurfaceLook> leg_look(const Leg& leg, bool own_look, LegSurface& surface, Engine& engine) {
  Mesh& mesh = surface.mesh;
  const bool has_look = own_look && !mesh.triangles.empty();
  const float u = ease(leg.plan.motion, surface.state.time);
  const float weight = visit(
      leg, [] { return 0.0f; },
      [&](const DistanceLeg&) {
        return mesh.normals.empty() ? 0 : end_normals_weight(std::min(u, 1 - u));
      });
  LookTarget target{mesh.triangles, engine, /*look=*/{}};
  if (!has_look && weight == 0) return std::move(target.look);
  PM_TRY(const PullBack pulled, pull_back(leg, surface.state, mesh.positions, engine));
  LegOrigins origins{pulled, /*source=*/{}, /*target=*/{}};
  if (weight > 0) {
    const bool leaving = u < 0.5f;
    (leaving ? origins.source : origins.target) = add_end_normals(
        {leaving ? *leg.from : *leg.to, surface.state.map.regression->affine[leaving ? 0 : 1],
         leaving ? pulled.source : pulled.target, weight},
        mesh.normals);
  }
  if (has_look) PM_TRY_STATUS(add_look(leg, surface.state.time, origins, /*is_last=*/true, target));
  return std::move(target.look);
}

}  // namespace polymorph
