#include "base/file.h"
#include "cli/command_line.h"
#include "inspect/inspect_spheres.h"

namespace polymorph {
namespace {

struct SpheresOptions {
  SpheresRequest request;
  bool no_fit = false, no_measure = false;
  JsonOutput json;
};

/// Checks before any work that the outputs have known formats and may be written.
Status check_outputs(const SpheresRequest& request, bool overwrite) {
  const auto check_extension = [](const std::string& file,
                                  std::initializer_list<const char*> extensions) -> Status {
    const std::string extension = std::filesystem::path(file).extension().string();
    std::string list;
    for (const char* known : extensions) {
      if (extension == known) return Ok{};
      list += (list.empty() ? "" : " or ") + std::string(known);
    }
    return make_error(ErrorCode::kUsage, "{}: unknown format \"{}\" - use {}", file, extension,
                      list);
  };
  if (!request.write_balls.empty())
    PM_TRY_STATUS(check_extension(request.write_balls, {".json", ".csv"}));
  if (!request.write_surface.empty())
    PM_TRY_STATUS(check_extension(request.write_surface, {".obj", ".ply"}));
  if (!request.write_spheres.empty())
    PM_TRY_STATUS(check_extension(request.write_spheres, {".obj", ".ply", ".json"}));
  if (!request.output.empty()) PM_TRY_STATUS(check_extension(request.output, {".png", ".exr"}));
  for (const std::string& file :
       {request.write_balls, request.write_surface, request.write_spheres, request.output}) {
    if (file.empty()) continue;
    PM_TRY_STATUS(check_output(file, overwrite));
  }
  return Ok{};
}

Result<int> run_spheres(const CommandLine& line, const SpheresOptions& options) {
  PM_TRY_STATUS(check_outputs(options.request, line.common.overwrite));
  SpheresRequest request = options.request;
  if (options.no_fit) request.settings.fit = FitKind::kNone;
  request.cache_folder = cache_folder(line.common);
  request.measure = !options.no_measure;
  PM_TRY(const SpheresResult result, inspect_spheres(request));
  if (options.json.enabled) {
    PM_TRY_STATUS(write_json(options.json, result.report.json));
  } else {
    print_data("{}", result.report.text);
  }
  PM_TRY_STATUS(write_spheres(request, result));
  return 0;
}

}  // namespace

void add_spheres(CommandLine& line) {
  auto options = std::make_shared<SpheresOptions>();
  Command command =
      add_command(line, "spheres", "Approximate a model by spheres and fitted balls; say how well.",
                  "  polymorph spheres teapot.obj --balls 128 -o teapot.png\n"
                  "  polymorph spheres teapot.obj --error 0.005 --write-balls balls.json\n"
                  "  polymorph spheres teapot.obj --method octree --resolution 5 --no-fit --json",
                  "  0 done   2 usage   3 bad model, or nothing of it is inside\n"
                  "  4 cannot write   5 memory");
  SphereSettings& settings = options->request.settings;
  command
      .add_option("model", options->request.model, "MODEL",
                  "a model file, or sphere, cube, torus, puddle, drops")
      .required();
  command.add_choice("--method", settings.method, "NAME",
                     {{"medial", SphereMethod::kMedial},
                      {"hubbard", SphereMethod::kHubbard},
                      {"octree", SphereMethod::kOctree},
                      {"active", SphereMethod::kActive}},
                     "medial, hubbard, octree or active");
  Option balls =
      command.add_option("--balls", settings.balls, "N", "number of balls (256)").range(1, 4096);
  Option error =
      command
          .add_option("--error", settings.error, "E",
                      "fewest balls within this Hausdorff distance, a share of the diagonal")
          .range(1e-4, 0.5);
  error.excludes(balls);
  command
      .add_option("--resolution", settings.resolution, "R",
                  "resolution of octree and active: 2^(R-1) cells per axis")
      .range(1, 9);
  command
      .add_option("--root-margin", settings.root_margin, "M",
                  "share by which the root cube of octree and active exceeds the model (0)")
      .range(0.0, 1.0);
  const Option fit = command.add_choice(
      "--fit", settings.fit, "KIND",
      {{"ellipsoid", FitKind::kEllipsoid}, {"round", FitKind::kRound}}, "ellipsoid or round balls");
  command.add_flag("--no-fit", options->no_fit, "balls straight from the spheres, as in the report")
      .excludes(fit);
  command.add_flag("--no-measure", options->no_measure,
                   "make the spheres and balls, but do not measure how well they fit");
  command.add_choice("--inside", settings.inside, "TEST",
                     {{"winding", InsideMethod::kWinding}, {"parity", InsideMethod::kParity}},
                     "inside test: winding or parity");
  command.add_flag("--solidify", settings.solidify, "fill cavities and close holes first");
  command
      .add_option("--grid", options->request.grid, "N",
                  "cells along the longest side, for the surface (192)")
      .range(8, 4096);
  command.add_option("-o,--output", options->request.output, "FILE",
                     "picture: model | spheres | surface");
  command
      .add_option("--width", options->request.width, "PIXELS",
                  "width of each of the three pictures (480)")
      .range(16, 8192);
  command.add_option("--write-balls", options->request.write_balls, "FILE",
                     "balls as .json or .csv");
  command.add_option("--write-surface", options->request.write_surface, "FILE",
                     "their surface as .obj or .ply");
  command.add_option("--write-spheres", options->request.write_spheres, "FILE",
                     "the spheres as .obj, .ply, or .json with their tree");
  add_overwrite(command, line.common);
  add_json(command, options->json);
  set_action(line, command, [&line, options] { return run_spheres(line, *options); });
}

}  // namespace polymorph
