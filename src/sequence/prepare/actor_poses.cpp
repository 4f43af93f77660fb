#include "sequence/prepare/actor_poses.h"

#include <algorithm>
#include <iterator>

#include "assets/mesh_sequence.h"
#include "leg/make_leg.h"
#include "mesh/closest.h"
#include "mesh/edges.h"
#include "spheres/spheres.h"

namespace polymorph {
namespace {

const MeshFile& file_of(const MeshSequence& sequence, int mesh) {
  return sequence.files[static_cast<std::size_t>(mesh)];
}

/// Lists the edges of a model's faces in ascending order, each as (lower vertex << 32 | higher).
std::vector<std::uint64_t> list_edges(const Model& model) {
  std::vector<std::uint64_t> edges;
  const std::vector<EdgeUse> uses = sorted_edge_uses(model.triangles);
  for_each_edge(uses, [&](std::size_t first, std::size_t) {
    edges.push_back(std::uint64_t{uses[first].low} << 32 | uses[first].high);
  });
  return edges;
}

/// Tests whether the points of a mesh correspond to those of the reference: whether the meshes
/// share most edges.
bool corresponds(const MovingObject& object, const Model& model) {
  // Bent polygons may be triangulated differently in another pose. If all polygons are quadrangles,
  // their sides, two thirds of the edges, are still shared.
  constexpr double kMinSharedEdges = 0.55;
  if (model.points.size() != object.reference->model.points.size()) return false;
  const std::vector<std::uint64_t> edges = list_edges(model);
  std::vector<std::uint64_t> shared;
  std::set_intersection(edges.begin(), edges.end(), object.edges.begin(), object.edges.end(),
                        std::back_inserter(shared));
  return static_cast<double>(shared.size()) >=
         kMinSharedEdges * static_cast<double>(std::max(edges.size(), object.edges.size()));
}

/// Moves the reference's balls and landmarks with its points to their new positions `points`.
PoseFit carry(const MovingObject& object, const std::vector<Vec3>& points) {
  const PreparedObject& reference = *object.reference;
  PoseFit fit;
  fit.balls = carry_balls(reference.model, reference.balls, object.bound, points);
  for (const auto& [name, place] : reference.landmarks) {
    const ClosestPoint hit = reference.closest->closest(place);
    fit.landmarks[name] = interpolate(points, reference.model.triangles[hit.triangle],
                                      weights_at(reference.model, hit));
  }
  return fit;
}

/// Moves and scales unfitted balls with the model's box, from `from` to `to`.
CarriedBalls move_with_box(const CarriedBalls& previous, const Box& from, const Box& to) {
  CarriedBalls moved_balls = previous;
  const float scale = from.diagonal() > 0 ? to.diagonal() / from.diagonal() : 1;
  for (Ball& ball : moved_balls.balls) {
    ball.center = to.center() + (ball.center - from.center()) * scale;
    ball.a /= scale * scale;
  }
  return moved_balls;
}

/// Tests whether the object's balls are fitted.
bool has_fit(const ActorPoses& poses, const MovingObject& object) {
  return is_fitted(poses.scene, object.settings.spheres) && object.reference->missing_balls == 0;
}

/// Balls and landmarks of a pose, and the box around its mesh.
struct FittedPose {
  PoseFit fit;
  Box box;
};

/// Fits balls and landmarks to a mesh whose vertices do not correspond to the previous one's.
Result<PoseFit> fit_from_previous(const ActorPoses& poses, const MovingObject& object,
                                  const Model& model, const FittedPose& previous) {
  PoseFit fit = previous.fit;
  if (has_fit(poses, object)) {
    PM_TRY(fit.balls.balls,
           refit_cached(model, object.settings.spheres, previous.fit.balls.balls, poses.cache));
  } else {
    fit.balls = move_with_box(previous.fit.balls, previous.box, model.box());
  }
  const ClosestPointQuery closest(model);
  for (auto& [name, place] : fit.landmarks) place = closest.closest(place).point;
  return fit;
}

/// Finds the balls and landmarks of a mesh whose points correspond to the reference's.
Result<PoseFit> fit_corresponding(const ActorPoses& poses, const MovingObject& object,
                                  const Model& model) {
  PoseFit fit = carry(object, model.points);
  // Only balls that show are fitted anew.
  if (object.kinds.balls && has_fit(poses, object)) {
    PM_TRY(fit.balls.balls,
           refit_cached(model, object.settings.spheres, fit.balls.balls, poses.cache));
  }
  return fit;
}

/// Finds the balls and landmarks of `model`, which is the mesh `mesh` of the object `index`. If the
/// points of the mesh do not correspond to the reference's, balls and landmarks are fitted from
/// mesh to mesh, beginning with the last earlier mesh that corresponds or has a fit.
Result<PoseFit> fit_pose(ActorPoses& poses, std::size_t index, int mesh, const Model& model) {
  const MovingObject& object = poses.objects[index];
  const MeshSequence& sequence = *object.sequence;
  if (corresponds(object, model)) return fit_corresponding(poses, object, model);
  std::vector<std::optional<PoseFit>>& fits = poses.fits[index];
  const auto known_fit = [&](int k) -> std::optional<PoseFit>& {
    return fits[static_cast<std::size_t>(k)];
  };
  if (known_fit(mesh)) return *known_fit(mesh);
  const std::string& topology = file_of(sequence, sequence.reference).topology;
  // Find the last earlier mesh whose fit is known. At the latest this is the reference, which is
  // the first mesh that can be shown.
  int start = mesh - 1;
  while (file_of(sequence, start).topology != topology && !known_fit(start)) --start;
  PM_TRY(const Model first, load_mesh(sequence, start));
  FittedPose previous = {/*fit=*/{}, first.box()};
  if (known_fit(start)) {
    previous.fit = *known_fit(start);
  } else {
    PM_TRY(previous.fit, fit_corresponding(poses, object, first));
  }
  // Fit from there to `mesh`; meshes with problems are skipped.
  for (int k = start + 1; k <= mesh; ++k) {
    if (!file_of(sequence, k).problem.empty()) continue;
    Model loaded_mesh;
    if (k < mesh) {
      PM_TRY(loaded_mesh, load_mesh(sequence, k));
    }
    const Model& current = k < mesh ? loaded_mesh : model;
    if (corresponds(object, current)) {
      PM_TRY(previous.fit, fit_corresponding(poses, object, current));
    } else {
      PM_TRY(previous.fit, fit_from_previous(poses, object, current, previous));
    }
    previous.box = current.box();
    known_fit(k) = previous.fit;
  }
  return previous.fit;
}

/// Gives a pose the labels of the reference's balls.
void label_balls(const PreparedObject& reference, const std::vector<std::string>& all_names,
                 PreparedObject& pose) {
  std::vector<std::string>& names = pose.model.label_names;
  for (const std::uint32_t label : reference.ball_labels) {
    const std::string& name = reference.model.label_names[label];
    const auto found = std::find(names.begin(), names.end(), name);
    pose.ball_labels.push_back(static_cast<std::uint32_t>(found - names.begin()));
    if (found == names.end()) names.push_back(name);
  }
  pose.label_numbers = label_numbers(names, all_names);
}

/// Makes the object in the pose of one of its meshes.
Result<std::shared_ptr<const PreparedObject>> make_pose(ActorPoses& poses, std::size_t index,
                                                        int mesh, Engine& engine) {
  const MovingObject& object = poses.objects[index];
  const PreparedObject& reference = *object.reference;
  PreparedObject pose;
  pose.name = reference.name;
  pose.meta = reference.meta;
  pose.front = reference.front;
  pose.to_scene = reference.to_scene;
  PM_TRY(pose.model, load_mesh(*object.sequence, mesh));
  PM_TRY(PoseFit fit, fit_pose(poses, index, mesh, pose.model));
  pose.balls = std::move(fit.balls.balls);
  pose.ball_rotations = std::move(fit.balls.rotations);
  pose.landmarks = std::move(fit.landmarks);
  label_balls(reference, poses.label_names, pose);
  PM_TRY_STATUS(finish_object({poses.scene, engine, poses.cache}, object.settings, poses.settings,
                              object.kinds, pose));
  return std::make_shared<const PreparedObject>(std::move(pose));
}

}  // namespace

std::shared_ptr<ActorPoses> make_poses(const Preparation& preparation, const ActorOutline& outline,
                                       std::span<const ChainObject> chain,
                                       const ObjectList& prepared, LoadedScene& loaded) {
  if (outline.sequence || outline.timeline.playbacks.empty()) return nullptr;
  auto poses = std::make_shared<ActorPoses>();
  poses->scene = preparation.scene;
  poses->cache = preparation.cache;
  poses->settings = outline.settings;
  poses->label_names = outline.label_names;
  for (std::size_t i = 0; i < prepared.size(); ++i) {
    const std::size_t index = outline.first_object + i;
    MovingObject& object = poses->objects.emplace_back();
    std::vector<std::optional<PoseFit>>& fits = poses->fits.emplace_back();
    object.sequence = loaded.sequences[index];
    if (!object.sequence) continue;
    fits.resize(object.sequence->files.size());
    object.settings = *chain[index].settings;
    object.outermost = std::move(loaded.models[index].points);
    object.reference = prepared[i];
    object.bound = bind_balls(prepared[i]->model, prepared[i]->balls);
    object.edges = list_edges(prepared[i]->model);
    object.kinds = leg_kinds(outline.timeline, i);
  }
  return poses;
}

Result<std::shared_ptr<const PreparedObject>> object_at(const PreparedActor& actor, int object,
                                                        int frame, Engine& engine) {
  const auto index = static_cast<std::size_t>(object);
  const int mesh = shown_mesh_number(actor.timeline, index, frame);
  if (!actor.poses || mesh < 0) return actor.objects[index];
  ActorPoses& poses = *actor.poses;
  if (mesh == poses.objects[index].sequence->reference) return actor.objects[index];
  const std::lock_guard lock(poses.mutex);
  const auto found = std::find_if(poses.cached.begin(), poses.cached.end(), [&](const auto& entry) {
    return entry.object == index && entry.mesh == mesh;
  });
  if (found != poses.cached.end()) {
    poses.cached.splice(poses.cached.begin(), poses.cached, found);
    return poses.cached.front().pose;
  }
  // The object's oldest entries are removed before the new pose is made, so that memory never holds
  // more than kMaxCachedPoses of them.
  int count = 0;
  std::erase_if(poses.cached, [&](const auto& entry) {
    return entry.object == index && ++count >= kMaxCachedPoses;
  });
  PM_TRY(std::shared_ptr<const PreparedObject> pose, make_pose(poses, index, mesh, engine));
  poses.cached.push_front({index, mesh, pose});
  return pose;
}

const MeshSequence* moving_sequence(const PreparedActor& actor, int object) {
  return actor.poses ? actor.poses->objects[static_cast<std::size_t>(object)].sequence.get()
                     : nullptr;
}

bool has_moving_end(const PreparedActor& actor, int leg) {
  return moving_sequence(actor, leg) || moving_sequence(actor, leg + 1);
}

Result<std::shared_ptr<const Leg>> leg_at(const PreparedActor& actor, int leg, int frame,
                                          Engine& engine) {
  MorphState moment;
  moment.leg = leg;
  moment.frame = frame;
  return leg_at(actor, moment, engine);
}

Result<std::shared_ptr<const Leg>> leg_at(const PreparedActor& actor, const MorphState& moment,
                                          Engine& engine) {
  const std::shared_ptr<const Leg>& reference = actor.legs[static_cast<std::size_t>(moment.leg)];
  if (!has_moving_end(actor, moment.leg)) return reference;
  std::shared_ptr<const PreparedObject> from = reference->from, to = reference->to;
  if (shows_source(moment)) {
    PM_TRY(from, object_at(actor, moment.leg, moment.frame, engine));
  }
  if (shows_target(moment)) {
    PM_TRY(to, object_at(actor, moment.leg + 1, moment.frame, engine));
  }
  if (from == reference->from && to == reference->to) return reference;
  return pose_leg(*reference, from, to);
}

}  // namespace polymorph
