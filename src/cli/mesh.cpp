#include <algorithm>

#include "base/file.h"
#include "base/log.h"
#include "cli/command_line.h"
#include "sequence/device.h"
#include "sequence/frames.h"
#include "sequence/geometry.h"
#include "sequence/render_sequence.h"
#include "surface/level.h"
#include "surface/mesh_check.h"
#include "surface/mesh_io.h"

namespace polymorph {
namespace {

struct MeshOptions {
  std::string scene, output, frames;
  std::vector<std::string> sets;
};

Status write_balls(const PreparedScene& prepared, const FrameGeometry& geometry,
                   const std::filesystem::path& path) {
  const FieldKind kind = prepared.scene.field.kind;
  std::vector<Ball> balls;
  for (const ActorGeometry& actor : geometry.actors) {
    const std::vector<Ball> own = rescaled(actor.balls, kind, actor.iso);
    balls.insert(balls.end(), own.begin(), own.end());
  }
  if (balls.empty()) log_info("frame {}: only the model shows, no balls", geometry.frame);
  PM_TRY_STATUS(write_file(path, encode_balls(balls, kind)));
  print_data("{} {} balls\n", path.string(), balls.size());
  return Ok{};
}

Status write_one(const PreparedScene& prepared, const FrameGeometry& geometry,
                 SurfaceExtractor& extractor, const std::filesystem::path& path) {
  if (path.extension() == ".json") return write_balls(prepared, geometry, path);
  PM_TRY(const FrameMesh frame, mesh_of(prepared, geometry, extractor));
  if (frame.mesh.triangles.empty())
    log_warning("frame {}: the balls have no surface at this level", geometry.frame);
  PM_TRY_STATUS(write_mesh(path, frame.mesh, frame.tags));
  const MeshReport report = check_mesh(frame.mesh);
  print_data(
      "{} {} {}: {} vertices, {} triangles, {}, genus {}, {} part{}, volume {:.6g}, area {:.6g}, "
      "digest {}\n",
      path.string(), geometry.stage, frame.what, report.vertices, report.triangles,
      report.closed() ? "closed" : "NOT CLOSED",
      report.closed() ? fmt::format("{}", report.genus) : "-", report.components,
      report.components == 1 ? "" : "s", report.volume, report.area, report.digest);
  return Ok{};
}

Result<int> run_mesh(const CommandLine& line, const MeshOptions& options) {
  PM_TRY(const std::vector<Override> overrides, parse_overrides(options.sets));
  PM_TRY(const Scene scene, load_scene(options.scene, overrides));
  const int count = frame_count(scene);
  PM_TRY(
      const std::vector<int> frames,
      parse_frames(options.frames.empty() ? fmt::format("1-{}", count) : options.frames, 1, count));
  PM_TRY(FramePattern pattern, parse_pattern(options.output));
  if (frames.size() > 1) pattern = numbered(pattern);
  const std::string extension = frame_path(pattern, 1).extension().string();
  if (extension != ".obj" && extension != ".ply" && extension != ".json")
    return make_error(ErrorCode::kUsage,
                      "{}: unknown format \"{}\" - use .obj or .ply for surfaces, .json for balls",
                      options.output, extension);
  for (const int frame : frames) {
    PM_TRY_STATUS(check_output(frame_path(pattern, frame), line.common.overwrite));
  }
  std::string device;
  PM_TRY(const auto extractor, make_extractor(line.common.device, device, line.common.max_memory));
  PM_TRY(const PreparedScene prepared, prepare_scene(scene, *extractor, cache_folder(line.common)));
  for (const std::string& warning : prepared.warnings) log_warning("{}", warning);
  for (const int frame : frames) {
    if (stop_requested())
      return make_error(stop_code(), "stopped - the files named so far are whole");
    PM_TRY(const FrameGeometry geometry, geometry_at(prepared, *extractor, frame));
    PM_TRY_STATUS(write_one(prepared, geometry, *extractor, frame_path(pattern, frame)));
  }
  return 0;
}

}  // namespace

void add_mesh(CommandLine& line) {
  auto options = std::make_shared<MeshOptions>();
  CLI::App* command = add_command(
      line, "mesh", "Write the surface (OBJ, PLY with labels) or the balls (JSON) of frames.",
      "  polymorph mesh scene.json -f 12 -o half.obj\n"
      "  polymorph mesh scene.json -o 'surface.####.ply'\n"
      "  polymorph mesh scene.json -f 12 -o balls.json",
      "  0 written   2 usage   3 bad scene or model   4 cannot write\n"
      "  5 device or memory   130, 143 stopped by a signal");
  command->add_option("scene", options->scene, "the scene file")
      ->required()
      ->type_name("SCENE")
      ->group("Main");
  command
      ->add_option("-o,--output", options->output, "surface.####.obj, .ply, or .json for the balls")
      ->required()
      ->type_name("FILE")
      ->group("Main");
  command->add_option("-f,--frames", options->frames, "1-48, 1-48x2, 5-1, 1,5,10-20; default: all")
      ->type_name("LIST")
      ->group("Main");
  add_overwrite(command, line.common)->group("Main");
  add_overrides(command, options->sets);
  command->callback(
      [&line, options] { line.action = [&line, options] { return run_mesh(line, *options); }; });
}

}  // namespace polymorph
