#include "inspect/inspection.h"
#include "morph/timeline.h"
#include "scene/load_scene.h"
#include "scene/mesh_numbers.h"

namespace polymorph {
namespace {

/// Adds the state of an actor in each frame.
void add_frames(Inspection& out, const Scene& scene, const ActorSettings& actor) {
  const Timeline timeline = make_timeline(scene, actor);
  const auto objects = chain_objects(actor);
  const auto name = [&](int index) { return objects[static_cast<std::size_t>(index)]->name; };
  JsonValue json{
      {"name", actor.name}, {"legs", JsonValue::array()}, {"frames", JsonValue::array()}};
  for (std::size_t i = 0; i < timeline.legs.size(); ++i) {
    const LegTiming& leg = timeline.legs[i];
    JsonValue shares;
    for (const StageInfo& stage : stage_table())
      shares[stage.name] = leg.shares[static_cast<std::size_t>(stage.stage)];
    json["legs"].push_back({{"from", name(static_cast<int>(i))},
                            {"to", name(static_cast<int>(i) + 1)},
                            {"from_meta", !leg.from_full},
                            {"to_meta", !leg.to_full},
                            {"shares", std::move(shares)}});
  }
  out.text += fmt::format("{:>5} {:>7} {:<24} {:<12} {:>8} {:>7}\n", "frame", "t", "from -> to",
                          "stage", "progress", "u");
  const std::vector<int> numbers =
      plays_meshes(actor) ? mesh_numbers(actor.source) : std::vector<int>{};
  for (int frame = 1; frame <= timeline.count; ++frame) {
    const MorphState m = morph_state_at(timeline, frame);
    const int mesh = m.mesh >= 0 ? numbers[static_cast<std::size_t>(m.mesh)] : 0;
    out.text += fmt::format("{:>5} {:>7.4f} {:<24} {:<12} {:>8.4f} {:>7.4f}\n", frame, m.t,
                            m.mesh >= 0 ? fmt::format("{} {}", actor.source.name, mesh)
                                        : name(m.leg) + " -> " + name(m.leg + 1),
                            stage_name(m.stage), m.progress, m.u);
    json["frames"].push_back({{"frame", frame},
                              {"t", m.t},
                              {"leg", m.leg},
                              {"stage", stage_name(m.stage)},
                              {"progress", m.progress},
                              {"time", m.time},
                              {"u", m.u},
                              {"mesh", m.object >= 0 ? JsonValue(name(m.object)) : JsonValue()},
                              {"look", m.look},
                              {"boundary", m.boundary},
                              {"growth", m.growth}});
    if (m.mesh >= 0) json["frames"].items.back()["number"] = mesh;
  }
  out.json["actors"].push_back(json);
}

/// Adds an actor's objects, and its runs of frames in one stage of one leg.
void add_actor(Inspection& out, const Scene& scene, const ActorSettings& actor) {
  const Timeline timeline = make_timeline(scene, actor);
  const auto objects = chain_objects(actor);
  if (scene.actors.size() > 1) out.text += fmt::format("  {}:\n", actor.name);
  for (std::size_t i = 0; i < objects.size(); ++i)
    out.text +=
        fmt::format("  {}{} {}\n", objects[i]->name, objects[i]->meta ? " (meta)" : "",
                    objects[i]->shape.empty() ? objects[i]->model.string() : "built-in shape");
  if (plays_meshes(actor)) {
    out.text += fmt::format("  {}\n  frames {:>4} - {:<4} {}\n", describe_files(actor.source), 1,
                            timeline.count, stage_name(Stage::kPlay));
    return;
  }
  for (int frame = 1; frame <= timeline.count;) {
    const MorphState moment = morph_state_at(timeline, frame);
    int last = frame;
    while (last < timeline.count && morph_state_at(timeline, last + 1).stage == moment.stage &&
           morph_state_at(timeline, last + 1).leg == moment.leg)
      ++last;
    out.text += fmt::format("  frames {:>4} - {:<4} {} -> {}: {}\n", frame, last,
                            objects[static_cast<std::size_t>(moment.leg)]->name,
                            objects[static_cast<std::size_t>(moment.leg) + 1]->name,
                            stage_name(moment.stage));
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
