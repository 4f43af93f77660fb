#include <algorithm>

#include "base/file.h"
#include "base/plural.h"
#include "cli/command_line.h"
#include "cli/write_play_page.h"
#include "device/device.h"
#include "export/landmark_candidates.h"
#include "export/landmarks_data.h"
#include "export/play_data.h"

namespace polymorph {
namespace {

struct LandmarksOptions {
  std::string scene, html;
  std::vector<std::string> sets;
  JsonOutput json;
};

/// Writes a point in the form of plan.landmarks, with 6 significant digits.
JsonValue point_json(Vec3 p) {
  JsonValue point = JsonValue::array();
  for (const float v : {p.x, p.y, p.z})
    point.push_back(parse_number(fmt::format("{:.6g}", v)).value_or(0));
  return point;
}

/// Formats a point for the table of tips; "-" if an object has none.
std::string point_text(const std::optional<Vec3>& p) {
  return p ? fmt::format("[{:.6g}, {:.6g}, {:.6g}]", p->x, p->y, p->z) : "-";
}

/// Writes the matched tips of limbs in the form of plan.landmarks. If several legs have a
/// tip of the same name, the point of the first leg is written.
JsonValue landmarks_json(const std::vector<LegCandidates>& legs) {
  JsonValue landmarks = JsonValue::object();
  const auto set = [&](const std::string& key, const std::string& name, Vec3 p) {
    if (!landmarks[key].contains(name)) landmarks[key][name] = point_json(p);
  };
  for (const LegCandidates& leg : legs)
    for (const auto& [name, from, to] : matched_tips(leg)) {
      set(leg.from_key, name, from);
      set(leg.to_key, name, to);
    }
  return landmarks;
}

void print_candidates(const std::vector<LegCandidates>& legs) {
  for (const LegCandidates& leg : legs) {
    print_data("{} -> {}\n", leg.from_key, leg.to_key);
    if (leg.tips.empty()) print_data("  no limbs\n");
    for (const auto& [name, from, to] : leg.tips)
      print_data("  {:<24} {:<36} {}\n", name, point_text(from), point_text(to));
  }
}

Result<int> run_landmarks(const CommandLine& line, const LandmarksOptions& options) {
  if (!options.html.empty()) PM_TRY_STATUS(check_play_page(line, options.html));
  PM_TRY(const std::vector<Override> overrides, parse_overrides(options.sets));
  PM_TRY(Scene scene, load_scene(options.scene, overrides));
  // The tips of limbs are the same at the coarse resolution of a page.
  PM_TRY(const EngineScene page_scene, prepare_page(line, std::move(scene)));
  if (options.html.empty()) {
    PM_TRY(const std::vector<LegCandidates> legs, landmark_candidates(page_scene.prepared));
    if (options.json.enabled)
      PM_TRY_STATUS(write_json(options.json, {{"landmarks", landmarks_json(legs)}}));
    else
      print_candidates(legs);
    return 0;
  }
  // Check again: now all input files are known, also those that models and materials name.
  PM_TRY_STATUS(check_play_page(line, options.html));
  PM_TRY(const LandmarksPage page, make_landmarks_page(page_scene.prepared, *page_scene.engine));
  const std::string html = encode_landmarks_page(page);
  PM_TRY_STATUS(write_file(options.html, html));
  print_data("{} {}, {}\n", options.html, plural(page.legs.size(), "leg"),
             format_bytes(static_cast<double>(html.size())));
  return 0;
}

}  // namespace

void add_landmarks(CommandLine& line) {
  auto options = std::make_shared<LandmarksOptions>();
  Command command = add_command(
      line, "landmarks", "Find or click the points of objects that become each other.",
      "  polymorph landmarks scene.json\n"
      "  polymorph landmarks scene.json --json\n"
      "  polymorph landmarks scene.json --html landmarks.html",
      "  0 written   2 usage   3 bad scene or model   4 cannot write   5 device or memory\n"
      "  130, 143 stopped by a signal");
  command.add_option("scene", options->scene, "SCENE", "a scene .json").required();
  command.add_option("--html", options->html, "FILE",
                     "a page that shows both objects of each leg and on which pins are set; "
                     "default: print tips of limbs, matched ones in one line");
  add_overrides(command, options->sets);
  add_overwrite(command, line.common);
  add_json(command, options->json);
  set_action(line, command, [&line, options] { return run_landmarks(line, *options); });
}

}  // namespace polymorph
