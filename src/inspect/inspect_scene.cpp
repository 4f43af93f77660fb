#include "inspect/inspection.h"
#include "morph/timeline.h"
#include "scene/load_scene.h"
#include "scene/mesh_numbers.h"

namespace polymorph {
namespace {

/// Adds the timing of an actor's legs, and the actor's state in each frame.
void add_frames(Inspection& out, const Scene& scene, const ActorSettings& actor) {
  const Timeline timeline = make_timeline(scene, actor);
  const auto objects = chain_objects(actor);
  const auto name = [&](int index) { return objects[static_cast<std::size_t>(index)]->name; };
  // List the legs.
  JsonValue json{
      {"name", actor.name}, {"legs", JsonValue::array()}, {"frames", JsonValue::array()}};
  for (std::size_t i = 0; i < timeline.legs.size(); ++i) {
    const LegTiming& leg = timeline.legs[i];
    JsonValue shares;
    for (const StageInfo& stage : stage_table())
      shares[stage.name] = leg.shares[static_cast<std::size_t>(stage.stage)];
    // All legs of a blend begin at the first object.
    json["legs"].push_back({{"from", name(mixes_many(timeline) ? 0 : static_cast<int>(i))},
                            {"to", name(static_cast<int>(i) + 1)},
                            {"from_meta", !leg.starts_at_model},
                            {"to_meta", !leg.ends_at_model},
                            {"shares", std::move(shares)}});
  }
  // List the frames.
  out.text += fmt::format("{:>5} {:>7} {:<24} {:<12} {:>8} {:>7}\n", "frame", "t", "from -> to",
                          "stage", "progress", "u");
  // Numbers in the names of each object's mesh files, [object][mesh in the order of play].
  std::vector<std::vector<int>> file_numbers;
  for (const ObjectSettings* object : objects) file_numbers.push_back(mesh_numbers(*object));
  // "horse 12": the object's name, and the number of its mesh if it has a mesh sequence.
  const auto object_name = [&](int object, int mesh) {
    return mesh < 0 ? name(object)
                    : fmt::format("{} {}", name(object),
                                  file_numbers[static_cast<std::size_t>(object)]
                                              [static_cast<std::size_t>(mesh)]);
  };
  const auto describe_state = [&](const MorphState& state) {
    if (state.stage == Stage::kPlay) return object_name(0, state.mesh);
    if (state.stage != Stage::kBlend)
      return object_name(state.leg, state.mesh) + " -> " +
             object_name(state.leg + 1, state.to_mesh);
    std::vector<std::string> terms;
    for (std::size_t i = 0; i < state.weights.size(); ++i)
      if (state.weights[i] > 0)
        terms.push_back(fmt::format("{} {:.3g}", objects[i]->name, state.weights[i]));
    return fmt::format("{}", fmt::join(terms, ", "));
  };
  for (int frame = 1; frame <= timeline.count; ++frame) {
    const MorphState state = morph_state_at(timeline, frame);
    out.text +=
        fmt::format("{:>5} {:>7.4f} {:<24} {:<12} {:>8.4f} {:>7.4f}\n", frame, state.t,
                    describe_state(state), stage_name(state.stage), state.progress, state.u);
    json["frames"].push_back(
        {{"frame", frame},
         {"t", state.t},
         {"leg", state.leg},
         {"stage", stage_name(state.stage)},
         {"progress", state.progress},
         {"time", state.time},
         {"u", state.u},
         {"mesh", state.object >= 0 ? JsonValue(name(state.object)) : JsonValue()},
         {"look", state.look},
         {"boundary", state.boundary},
         {"growth", state.growth}});
    if (!state.weights.empty()) {
      JsonValue weights = JsonValue::array();
      for (const float weight : state.weights) weights.push_back(weight);
      json["frames"].items.back()["weights"] = std::move(weights);
    }
    // Adds the file number of an object's current mesh, unless `mesh` is -1: no mesh sequence.
    const auto add_number = [&](const char* key, int object, int mesh) {
      if (mesh >= 0)
        json["frames"].items.back()[key] =
            file_numbers[static_cast<std::size_t>(object)][static_cast<std::size_t>(mesh)];
    };
    add_number("number", state.leg, state.mesh);
    add_number("to_number", state.leg + 1, state.to_mesh);
  }
  out.json["actors"].push_back(json);
}

/// Adds an actor's objects, and its ranges of frames in the same stage of the same leg.
void add_actor(Inspection& out, const Scene& scene, const ActorSettings& actor) {
  const Timeline timeline = make_timeline(scene, actor);
  const auto objects = chain_objects(actor);
  if (scene.actors.size() > 1) out.text += fmt::format("  {}:\n", actor.name);
  for (std::size_t i = 0; i < objects.size(); ++i)
    out.text +=
        fmt::format("  {}{} {}\n", objects[i]->name, objects[i]->meta ? " (meta)" : "",
                    objects[i]->shape.empty() ? objects[i]->model.string() : "built-in shape");
  if (plays_sequence_alone(actor)) {
    out.text += fmt::format("  {}\n  frames {:>4} - {:<4} {}\n", describe_sequence(actor.source), 1,
                            timeline.count, stage_name(Stage::kPlay));
    return;
  }
  for (int frame = 1; frame <= timeline.count;) {
    const MorphState state = morph_state_at(timeline, frame);
    int last = frame;
    while (last < timeline.count && morph_state_at(timeline, last + 1).stage == state.stage &&
           (mixes_many(timeline) || morph_state_at(timeline, last + 1).leg == state.leg))
      ++last;
    const auto leg = static_cast<std::size_t>(state.leg);
    out.text += fmt::format("  frames {:>4} - {:<4} {}{}\n", frame, last,
                            mixes_many(timeline)
                                ? std::string()
                                : objects[leg]->name + " -> " + objects[leg + 1]->name + ": ",
                            stage_name(state.stage));
    frame = last + 1;
  }
}

}  // namespace

Inspection inspect_timeline(const Scene& scene) {
  Inspection out;
  out.json = {{"stages", JsonValue::array()}, {"actors", JsonValue::array()}};
  for (const StageInfo& stage : stage_table())
    out.json["stages"].push_back({{"name", stage.name}, {"what", stage.what}});
  for (const ActorSettings& actor : scene.actors) {
    if (scene.actors.size() > 1) out.text += fmt::format("{}:\n", actor.name);
    add_frames(out, scene, actor);
  }
  return out;
}

Inspection inspect_scene(const std::string& file, const Scene& scene) {
  Inspection out;
  out.text = fmt::format("{}: {} frames at {} fps, {} x {}\n", file, frame_count(scene),
                         scene.frames.fps, scene.image.width, scene.image.height);
  for (const ActorSettings& actor : scene.actors) add_actor(out, scene, actor);
  return out;
}

}  // namespace polymorph
