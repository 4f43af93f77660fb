#include <algorithm>
#include <cmath>

#include "base/activity.h"
#include "base/json.h"
#include "base/log.h"
#include "cli/command_line.h"
#include "image/image_io.h"
#include "model/load/load_model.h"
#include "model/repair/diagnose.h"
#include "morph/timeline.h"

namespace polymorph {
namespace {

struct InfoOptions {
  std::string input;
  std::vector<std::string> sets;
  bool timeline = false;
  JsonOutput json;
};

struct ChannelRange {
  float low = 0, high = 0;
  double mean = 0;
  std::size_t not_finite = 0;
};

ChannelRange range_of(const Image& image, std::size_t channel) {
  ChannelRange range{INFINITY, -INFINITY, 0, 0};
  std::size_t count = 0;
  for (std::size_t i = channel; i < image.pixels.size(); i += image.channel_count()) {
    const float v = image.pixels[i];
    if (!std::isfinite(v)) {
      ++range.not_finite;
      continue;
    }
    range.low = std::min(range.low, v);
    range.high = std::max(range.high, v);
    range.mean += static_cast<double>(v);
    ++count;
  }
  if (count > 0) range.mean /= static_cast<double>(count);
  return range;
}

Result<int> image_info(const InfoOptions& options) {
  PM_TRY(const Image image, read_image(options.input));
  JsonValue json{{"file", options.input}, {"width", image.width}, {"height", image.height}};
  json["channels"] = JsonValue::array();
  if (!options.json.enabled)
    print_data("{}: {} x {}, {} channels\n", options.input, image.width, image.height,
               image.channel_count());
  for (std::size_t c = 0; c < image.channel_count(); ++c) {
    const ChannelRange range = range_of(image, c);
    json["channels"].push_back({{"name", image.channels[c]},
                                {"min", range.low},
                                {"max", range.high},
                                {"mean", range.mean},
                                {"not_finite", range.not_finite}});
    if (!options.json.enabled)
      print_data("  {:<12} {:>12.6g} to {:<12.6g} mean {:<12.6g}{}\n", image.channels[c], range.low,
                 range.high, range.mean,
                 range.not_finite ? fmt::format(" {} NaN or infinite", range.not_finite) : "");
  }
  for (const Attribute& attribute : image.attributes) {
    std::visit(
        [&](const auto& value) {
          json["attributes"][attribute.name] = value;
          if (!options.json.enabled) print_data("  {} = {}\n", attribute.name, value);
        },
        attribute.value);
  }
  if (options.json.enabled) PM_TRY_STATUS(write_json(options.json, json));
  return 0;
}

/// Prints the state of an actor in each frame.
JsonValue print_frames(const InfoOptions& options, const Scene& scene, const ActorSettings& actor) {
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
  if (!options.json.enabled)
    print_data("{:>5} {:>7} {:<24} {:<12} {:>8} {:>7}\n", "frame", "t", "from -> to", "stage",
               "progress", "u");
  for (int frame = 1; frame <= timeline.count; ++frame) {
    const MorphState m = morph_state_at(timeline, frame);
    if (!options.json.enabled)
      print_data("{:>5} {:>7.4f} {:<24} {:<12} {:>8.4f} {:>7.4f}\n", frame, m.t,
                 name(m.leg) + " -> " + name(m.leg + 1), stage_name(m.stage), m.progress, m.u);
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
  }
  return json;
}

/// Prints the states of all actors, and the stages.
Status print_frames(const InfoOptions& options, const Scene& scene) {
  JsonValue json{{"stages", JsonValue::array()}, {"actors", JsonValue::array()}};
  for (const StageInfo& stage : stage_table())
    json["stages"].push_back({{"name", stage.name}, {"what", stage.what}});
  for (const ActorSettings& actor : scene.actors) {
    if (!options.json.enabled && scene.actors.size() > 1) print_data("{}:\n", actor.name);
    json["actors"].push_back(print_frames(options, scene, actor));
  }
  return options.json.enabled ? write_json(options.json, json) : Status(Ok{});
}

/// An actor's objects, and its runs of frames in one stage of one leg.
void print_actor(const Scene& scene, const ActorSettings& actor) {
  const Timeline timeline = make_timeline(scene, actor);
  const auto objects = chain_objects(actor);
  if (scene.actors.size() > 1) print_data("  {}:\n", actor.name);
  for (std::size_t i = 0; i < objects.size(); ++i)
    print_data("  {}{} {}\n", objects[i]->name, objects[i]->meta ? " (meta)" : "",
               objects[i]->shape.empty() ? objects[i]->model.string() : "built-in shape");
  for (int frame = 1; frame <= timeline.count;) {
    const MorphState moment = morph_state_at(timeline, frame);
    int last = frame;
    while (last < timeline.count && morph_state_at(timeline, last + 1).stage == moment.stage &&
           morph_state_at(timeline, last + 1).leg == moment.leg)
      ++last;
    print_data("  frames {:>4} - {:<4} {} -> {}: {}\n", frame, last,
               objects[static_cast<std::size_t>(moment.leg)]->name,
               objects[static_cast<std::size_t>(moment.leg) + 1]->name, stage_name(moment.stage));
    frame = last + 1;
  }
}

Result<int> scene_info(const InfoOptions& options) {
  PM_TRY(const std::vector<Override> overrides, parse_overrides(options.sets));
  PM_TRY(const Scene scene, load_scene(options.input, overrides));
  if (options.timeline) {
    PM_TRY_STATUS(print_frames(options, scene));
    return 0;
  }
  if (options.json.enabled) {
    PM_TRY_STATUS(
        write_text(options.json,
                   scene_to_json(scene, std::filesystem::absolute(options.input).parent_path())));
    return 0;
  }
  print_data("{}: {} frames at {} fps, {} x {}\n", options.input, frame_count(scene),
             scene.frames.fps, scene.image.width, scene.image.height);
  for (const ActorSettings& actor : scene.actors) print_actor(scene, actor);
  print_data("--json prints every setting with its value.\n");
  return 0;
}

Result<int> model_info(const InfoOptions& options) {
  PM_TRY(const LoadedModel loaded, [&] {
    const Activity activity("reading " + options.input);
    return load_model(options.input);
  }());
  for (const std::string& warning : loaded.warnings) log_warning("{}", warning);
  const Diagnosis d = [&] {
    const Activity activity("looking for faults in " + options.input);
    return diagnose_fully(loaded.model);
  }();
  const Vec3 size = d.box.size();
  if (options.json.enabled) {
    const JsonValue json{{"file", options.input},
                         {"points", d.points},
                         {"triangles", d.triangles},
                         {"shells", d.shells},
                         {"closed", d.closed},
                         {"genus", d.genus},
                         {"euler", d.euler},
                         {"boundary_edges", d.boundary_edges},
                         {"non_manifold_edges", d.non_manifold_edges},
                         {"size", JsonValue::array({size.x, size.y, size.z})},
                         {"volume", d.volume},
                         {"area", d.area},
                         {"labels", loaded.model.label_names},
                         {"textures", loaded.model.textures.size()}};
    PM_TRY_STATUS(write_json(options.json, json));
    return 0;
  }
  print_data("{}: {} points, {} triangles, {} shell{}\n", options.input, d.points, d.triangles,
             d.shells, d.shells == 1 ? "" : "s");
  print_data("  {}, box {:.4g} x {:.4g} x {:.4g}, volume {:.4g}, area {:.4g}\n",
             d.closed ? fmt::format("closed, genus {}", d.genus) : "not closed", size.x, size.y,
             size.z, d.volume, d.area);
  constexpr std::size_t kMaxLabels = 100;
  const std::vector<std::string>& names = loaded.model.label_names;
  std::string labels;
  for (std::size_t i = 0; i < std::min(names.size(), kMaxLabels); ++i)
    labels += (i == 0 ? "" : ", ") + names[i];
  if (names.size() > kMaxLabels)
    labels += fmt::format(" and {} more (--json has them all)", names.size() - kMaxLabels);
  print_data("  labels: {}\n  {} materials, {} textures\n", labels, loaded.model.materials.size(),
             loaded.model.textures.size());
  for (const std::string& problem : describe_problems(d)) print_data("  {}\n", problem);
  if (const std::string crossings = describe_crossings(d); !crossings.empty())
    print_data("  {}\n", crossings);
  return 0;
}

Result<int> run_info(const InfoOptions& options) {
  std::string extension = std::filesystem::path(options.input).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  if (extension == ".json") return scene_info(options);
  if (options.timeline)
    return make_error(ErrorCode::kUsage, "{}: --timeline is for scenes (.json)", options.input);
  if (extension == ".obj" || is_foreign_model(options.input)) return model_info(options);
  return image_info(options);
}

}  // namespace

void add_info(CommandLine& line) {
  auto options = std::make_shared<InfoOptions>();
  Command command =
      add_command(line, "info", "Describe a scene, a model or an image.",
                  "  polymorph info scene.json\n  polymorph info scene.json "
                  "--json\n  polymorph info scene.json --timeline\n  polymorph info frame.0012.exr",
                  "  0 described   2 usage   3 unreadable");
  command.add_option("input", options->input, "a scene (.json), a model or an image")
      .required()
      .type_name("FILE")
      .group("Main");
  command
      .add_flag("--timeline", options->timeline,
                "scene: content of each frame, a line per frame; --json: with all stages")
      .group("Main");
  add_overrides(command, options->sets);
  add_json(command, options->json);
  set_action(line, command, [options] { return run_info(*options); });
}

}  // namespace polymorph
