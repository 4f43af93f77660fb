#include <cmath>
#include <map>
#include <optional>

#include "assets/load_models.h"
#include "assets/memory_estimate.h"
#include "assets/mesh_sequence.h"
#include "base/activity.h"
#include "base/json.h"
#include "base/log.h"
#include "base/plural.h"
#include "base/text.h"
#include "cli/command_line.h"
#include "inspect/inspection.h"
#include "morph/facing.h"
#include "morph/timeline.h"
#include "spheres/quality.h"
#include "spheres/spheres.h"

namespace polymorph {
namespace {

struct CheckOptions {
  std::string scene;
  bool strict = false, fit = false;
  std::vector<std::string> sets;
  JsonOutput json;
};

struct CheckResult {
  std::vector<SceneFinding> findings;
  std::vector<std::string> errors;  ///< errors of models, textures and memory
  std::vector<std::string> warnings;
  std::vector<std::string> notes;  ///< harmless oddities, good fits and possible fronts
  std::vector<std::pair<std::string, Diagnosis>> objects;  ///< names and diagnoses
  std::vector<std::string> sequences;                      ///< descriptions of the mesh sequences
  std::size_t object_count = 0;
  int frames = 0;
  MemoryEstimate memory;
};

std::string describe_object(const std::string& name, const Diagnosis& d) {
  const Vec3 size = d.box.size();
  std::string text = fmt::format("{}: {} triangles, {:.3g} x {:.3g} x {:.3g}, {}", name,
                                 d.triangles, size.x, size.y, size.z, describe_topology(d));
  if (d.shells > 1) text += fmt::format(", {} shells", d.shells);
  if (d.thickness && d.thickness->rays > 0)
    text += fmt::format(", {:.3g} thick", d.thickness->median);
  if (d.crossings && d.crossings->pairs > 0)
    text += fmt::format(", {} pairs of triangles cross", d.crossings->pairs);
  return text;
}

/// Quality of an object's balls, and the front that their mirror plane suggests.
struct FitFindings {
  ApproximationQuality quality;
  std::optional<double> front_axis;  ///< find_front_axis(): azimuth in radians; empty: no plane
};

/// Fits the balls of an object and measures the fit. Returns nullopt if no balls can be fitted.
Result<std::optional<FitFindings>> measure_fit(const Model& model, const ObjectSettings& object,
                                               const std::filesystem::path& cache) {
  const Activity activity("fitting balls to " + object.name);
  const auto proxy = make_solid_proxy(model, object.spheres);
  if (!proxy) return std::optional<FitFindings>();   // the diagnosis reports the reason
  const std::optional<Model>& solid_proxy = *proxy;  // empty: the model itself is solid
  const auto approximation = approximate_cached(model, object.spheres, cache, &solid_proxy);
  if (!approximation || approximation->balls.empty()) return std::optional<FitFindings>();
  const Model& solid = solid_proxy ? *solid_proxy : model;
  PM_TRY(const ApproximationQuality quality,
         measure_quality(solid, InsideTest(solid), approximation->balls, FieldKind::kGaussian,
                         {/*grid=*/96, /*points=*/5e4}));
  return std::optional(FitFindings{quality, find_front_axis(find_limbs(approximation->balls))});
}

/// Names the two possible directions of an object's front, which differ by 180 degrees.
std::string describe_front(const ObjectSettings& object, double front_axis) {
  constexpr double kDegreesPerRadian = 57.29577951308232;
  const int degrees = static_cast<int>(std::lround(front_axis * kDegreesPerRadian)) % 180;
  return fmt::format(
      "{}: by its mirror plane its front is at {} or {} degrees from +z towards +x - set \"front\" "
      "to one of them",
      object.name, degrees, degrees - 180);
}

/// Checks a scene in steps: its text, the files and sizes of its models, the models and the memory,
/// then each object's shape and, with --fit, its balls.
Result<CheckResult> check_scene(const CheckOptions& options, const CommonOptions& common) {
  const std::filesystem::path cache = cache_folder(common);
  PM_TRY(const std::vector<Override> overrides, parse_overrides(options.sets));
  PM_TRY(const SceneReading reading, read_scene(options.scene, overrides));
  CheckResult result;
  result.findings = reading.findings;
  if (!result.findings.empty()) return result;
  result.frames = frame_count(reading.scene);
  const std::vector<ChainObject> chain = chain_objects(reading.scene);
  result.object_count = chain.size();
  if (const Status status = check_model_files(chain, common.max_memory); !status) {
    result.errors.push_back(status.error().message);
    return result;
  }
  LoadedScene loaded;
  result.errors = find_problems(reading.scene, chain, cache, loaded);
  result.warnings = loaded.warnings;
  // The estimate is for one picture that is traced while another is written.
  const auto pictures = static_cast<std::size_t>(std::min(result.frames, 2));
  result.memory = estimate_memory(reading.scene, chain, loaded,
                                  find_shared_actors(reading.scene, chain, loaded), pictures);
  if (const Status status = check_memory(result.memory, common.max_memory); !status)
    result.errors.push_back(status.error().message);
  for (const auto& sequence : loaded.sequences)
    if (sequence) result.sequences.push_back(describe_meshes(*sequence));
  // Diagnose and fit each shape once: congruent objects share both, and similar ones, which also
  // differ in size, share the diagnosis, converted to their size.
  const std::vector<std::size_t> first_congruent = find_first_congruent(chain),
                                 first_similar = find_first_similar(chain);
  std::map<std::size_t, Diagnosis> diagnoses;
  std::map<std::size_t, std::optional<FitFindings>> fits;
  for (std::size_t i = 0; i < chain.size(); ++i) {
    const ObjectSettings& object = *chain[i].settings;
    const Model& model = loaded.fitted_model(i);
    if (model.triangles.empty()) continue;
    const Activity activity("looking for faults in " + object.name);
    if (first_congruent[i] == i)
      diagnoses.emplace(i, first_similar[i] == i
                               ? diagnose_fully(model)
                               : transfer_diagnosis(diagnoses.at(first_similar[i]), model));
    const Diagnosis& diagnosis = diagnoses.at(first_congruent[i]);
    for (const std::string& problem : describe_problems(diagnosis))
      result.warnings.push_back(object.name + ": " + problem);
    for (const std::string& oddity : describe_oddities(diagnosis))
      result.notes.push_back(object.name + ": " + oddity);
    // Triangles that cross each other change the parity of rays, not the winding number.
    if (const std::string crossings = describe_crossings(diagnosis);
        !crossings.empty() && object.spheres.inside == InsideMethod::kParity)
      result.warnings.push_back(object.name + ": " + crossings);
    result.objects.emplace_back(object.name, diagnosis);
    if (!options.fit || object.spheres.fit == FitKind::kNone) continue;
    if (first_congruent[i] == i) {
      PM_TRY(fits[i], measure_fit(model, object, cache));
    }
    if (const auto& fit = fits.at(first_congruent[i])) {
      (is_good_fit(fit->quality) ? result.notes : result.warnings)
          .push_back(object.name + ": " + describe_fit(fit->quality));
      if (fit->front_axis && object.front == Front::kAuto)
        result.notes.push_back(describe_front(object, *fit->front_axis));
    }
  }
  return result;
}

JsonValue to_json(const CheckResult& result, bool good) {
  JsonValue json{{"ok", good}, {"frames", result.frames}, {"memory_bytes", result.memory.total()}};
  json["findings"] = JsonValue::array();
  for (const SceneFinding& f : result.findings)
    json["findings"].push_back(
        {{"line", f.line}, {"column", f.column}, {"pointer", f.pointer}, {"message", f.message}});
  json["errors"] = result.errors;
  json["warnings"] = result.warnings;
  json["notes"] = result.notes;
  json["sequences"] = result.sequences;
  json["objects"] = JsonValue::array();
  for (const auto& [name, d] : result.objects) {
    JsonValue object{{"name", name}};
    object.update(to_json(d));
    object.update({{"crossing_pairs", d.crossings->pairs},
                   {"thickness", d.thickness->median},
                   {"balls_needed", d.thickness->balls},
                   {"sheet_share", *d.sheet_fraction},
                   {"thin", is_thin(*d.thickness)}});
    json["objects"].push_back(std::move(object));
  }
  return json;
}

Result<int> run_check(const CommandLine& line, const CheckOptions& options) {
  auto checked = check_scene(options, line.common);
  // A scene that cannot be read or parsed gets the answer "no" (exit code 1) as well, not 3.
  if (!checked && checked.error().code == ErrorCode::kInput) {
    CheckResult unreadable;
    unreadable.errors = {checked.error().message};
    checked = std::move(unreadable);
  }
  if (!checked) return checked.error();
  const CheckResult& result = *checked;
  const bool ok = result.findings.empty() && result.errors.empty() &&
                  !(options.strict && !result.warnings.empty());
  if (options.json.enabled) PM_TRY_STATUS(write_json(options.json, to_json(result, ok)));
  for (const SceneFinding& finding : result.findings)
    log_message(LogLevel::kError, to_string(finding, options.scene));
  for (const std::string& error : result.errors) log_message(LogLevel::kError, error);
  for (const std::string& warning : result.warnings) log_warning("{}", warning);
  if (!options.json.enabled) {
    for (const auto& [name, diagnosis] : result.objects)
      print_data("{}\n", describe_object(name, diagnosis));
    for (const std::string& sequence : result.sequences) print_data("{}\n", sequence);
    for (const std::string& note : result.notes) print_data("{}\n", note);
    if (ok)
      print_data("{}: ok, {}, {}, about {} of memory\n", options.scene,
                 plural(result.object_count, "object"), plural(result.frames, "frame"),
                 format_bytes(static_cast<double>(result.memory.total())));
    else
      print_data("{}: {}, {}\n", options.scene,
                 plural(result.findings.size() + result.errors.size(), "error"),
                 plural(result.warnings.size(), "warning"));
  }
  return ok ? 0 : static_cast<int>(ErrorCode::kAnswerNo);
}

}  // namespace

void add_check(CommandLine& line) {
  auto options = std::make_shared<CheckOptions>();
  Command command =
      add_command(line, "check", "Say everything that is wrong with a scene; render nothing.",
                  "  polymorph check scene.json\n  polymorph check scene.json --strict --json",
                  "  0 good   1 errors were found (with --strict: or warnings)   2 usage");
  command.add_option("scene", options->scene, "SCENE", "the scene file").required();
  command.add_flag("--strict", options->strict, "warnings count as errors");
  command.add_flag("--fit", options->fit, "fit the balls, too, and say how well they fit");
  add_overrides(command, options->sets);
  add_json(command, options->json);
  set_action(line, command, [&line, options] { return run_check(line, *options); });
}

}  // namespace polymorph
