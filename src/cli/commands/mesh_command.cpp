#include <algorithm>
#include <optional>

#include "base/file.h"
#include "base/log.h"
#include "base/plural.h"
#include "base/text.h"
#include "cli/command_line.h"
#include "cli/scene_options.h"
#include "cli/write_play_page.h"
#include "export/carried_frames.h"
#include "export/surface_frames.h"
#include "field/balls_io.h"
#include "field/level.h"
#include "interchange/obj.h"
#include "interchange/ply.h"
#include "interchange/simplify.h"
#include "interchange/surface_writer.h"
#include "mesh/append.h"
#include "mesh/mesh_check.h"
#include "sequence/frame/frame_geometry.h"
#include "sequence/prepare/actor_poses.h"
#include "sequence/run/frames.h"

namespace polymorph {
namespace {

namespace fs = std::filesystem;

struct MeshOptions {
  std::string scene, output, html, frames, error, topology = "changing";
  bool quantize = false;
  std::vector<std::string> sets;
};

enum class MeshFormat { kObj, kPly, kBalls, kUsd, kGlb };

/// Tests whether the format holds all frames in one file.
bool is_sequence(MeshFormat format) {
  return format == MeshFormat::kUsd || format == MeshFormat::kGlb;
}

Result<MeshFormat> parse_format(const std::string& output) {
  constexpr std::pair<const char*, MeshFormat> kFormats[] = {{".obj", MeshFormat::kObj},
                                                             {".ply", MeshFormat::kPly},
                                                             {".json", MeshFormat::kBalls},
                                                             {".usda", MeshFormat::kUsd},
                                                             {".glb", MeshFormat::kGlb}};
  const std::string extension = fs::path(output).extension().string();
  for (const auto& [name, format] : kFormats)
    if (extension == name) return format;
  return make_error(ErrorCode::kUsage,
                    "{}: unknown format \"{}\" - use .obj, .ply, .usda or .glb for surfaces, .json "
                    "for balls",
                    output, extension);
}

Status write_balls(const PreparedScene& prepared, const FrameGeometry& geometry,
                   const fs::path& path) {
  const FieldKind kind = prepared.scene.field.kind;
  std::vector<Ball> balls;
  for (const ActorGeometry& actor : geometry.actors) {
    const std::vector<Ball> own = rescale_balls(actor.balls.balls(), kind, actor.iso);
    balls.insert(balls.end(), own.begin(), own.end());
  }
  if (balls.empty()) log_info("frame {}: only the model shows, no balls", geometry.frame);
  PM_TRY_STATUS(write_file(path, encode_balls(balls, kind)));
  print_data("{} {} balls\n", path.string(), balls.size());
  return Ok{};
}

/// Joins the surfaces of all actors.
Mesh join_meshes(std::span<const SurfaceFrame> frames) {
  Mesh mesh;
  for (const SurfaceFrame& frame : frames)
    append(mesh, frame.positions, frame.normals, frame.triangles);
  return mesh;
}

/// Returns the kinds of the surfaces: "surface", "model" or both, joined by a comma.
std::string surface_kinds(std::span<const SurfaceFrame> frames) {
  std::vector<std::string> kinds;
  for (const SurfaceFrame& frame : frames) {
    const std::string kind = frame.is_model ? "model" : "surface";
    if (std::find(kinds.begin(), kinds.end(), kind) == kinds.end()) kinds.push_back(kind);
  }
  return fmt::format("{}", fmt::join(kinds, ", "));
}

/// Prints a line with the properties of a frame's surfaces.
void print_surfaces(const fs::path& path, const std::string& stage,
                    std::span<const SurfaceFrame> frames) {
  const MeshReport report = check_mesh(join_meshes(frames));
  print_data(
      "{} {} {}: {} vertices, {} triangles, {}, genus {}, {}, volume {:.6g}, area {:.6g}, "
      "digest {}\n",
      path.string(), stage, surface_kinds(frames), report.vertices, report.triangles,
      report.is_closed() ? "closed" : "NOT CLOSED",
      report.is_closed() ? fmt::format("{}", report.genus) : "-", plural(report.components, "part"),
      report.volume, report.area, report.digest);
}

/// Writes the meshes of a scene's frames in one format.
class MeshRun {
 public:
  MeshRun(const CommandLine& line, const MeshOptions& options, MeshFormat format)
      : line_(line), options_(options), format_(format) {}

  Result<int> run();

 private:
  Status check_outputs();
  bool is_carried() const { return options_.topology == "constant"; }
  bool has_velocities() const {
    return format_ == MeshFormat::kPly || format_ == MeshFormat::kUsd ||
           (format_ == MeshFormat::kGlb && !options_.quantize);
  }
  Result<FrameGeometry> make_geometry(int frame);
  Result<std::vector<SurfaceFrame>> make_surfaces(const FrameGeometry& geometry);
  Status write_frame(int frame);
  Status write_frames();
  Status check_stop() const;
  Status write_carried();
  Status write_surfaces(int frame, const std::string& stage, std::span<const SurfaceFrame> frames);
  Result<std::vector<NewFile>> make_library();
  fs::path output_path(int frame) const {
    return is_sequence(format_) ? fs::path(options_.output) : frame_path(pattern_, frame);
  }
  /// Returns the path of the MTL or a texture: the output's name without the frame number, with
  /// another ending.
  fs::path library_path(const std::string& ending) const {
    fs::path path = options_.output;
    if (pattern_.has_number()) {
      fs::path stem = fs::path(pattern_.before).filename();
      while (!stem.empty() && (stem.string().back() == '.' || stem.string().back() == '_'))
        stem = stem.string().substr(0, stem.string().size() - 1);
      path = fs::path(pattern_.before).parent_path() / (stem.empty() ? fs::path("mesh") : stem);
    } else {
      path.replace_extension();
    }
    path += ending;
    return path;
  }

  const CommandLine& line_;
  const MeshOptions& options_;
  MeshFormat format_;
  double error_ = 0;  ///< --error as a fraction of the box's diagonal; 0: no simplification
  std::vector<int> frames_;
  FramePattern pattern_;
  PreparedScene prepared_;
  SurfaceSequence sequence_;
  std::unique_ptr<Engine> engine_;
  std::unique_ptr<SurfaceWriter> writer_;
  std::optional<FrameGeometry> next_geometry_;  ///< made ahead for the previous frame's velocities
  MaterialCatalog catalog_;
  std::size_t written_materials_ = 0;
  std::size_t vertices_ = 0, triangles_ = 0;
};

Status MeshRun::check_outputs() {
  const bool overwrite = line_.common.overwrite;
  for (const int frame : frames_) {
    PM_TRY_STATUS(check_output(output_path(frame), overwrite));
    if (is_sequence(format_)) break;
  }
  if (format_ == MeshFormat::kObj) PM_TRY_STATUS(check_output(library_path(".mtl"), overwrite));
  if (format_ != MeshFormat::kObj && format_ != MeshFormat::kUsd) return Ok{};
  // No textures are known before the scene is prepared.
  std::size_t textures = 0;
  for (const PreparedActor& actor : prepared_.actors) {
    if (actor.sequence) textures += actor.sequence->max_textures * actor.sequence->files.size();
    if (actor.poses)
      for (const MovingObject& object : actor.poses->objects)
        if (object.sequence)
          textures += object.sequence->max_textures * object.sequence->files.size();
    for (const auto& object : actor.objects) textures += object->model.textures.size();
  }
  for (std::size_t i = 1; i <= textures; ++i)
    PM_TRY_STATUS(check_output(library_path(fmt::format(".texture{}.png", i)), overwrite));
  return Ok{};
}

Result<FrameGeometry> MeshRun::make_geometry(int frame) {
  if (next_geometry_ && next_geometry_->frame == frame) {
    FrameGeometry geometry = std::move(*next_geometry_);
    next_geometry_.reset();
    return geometry;
  }
  return geometry_at(prepared_, *engine_, frame);
}

Result<std::vector<SurfaceFrame>> MeshRun::make_surfaces(const FrameGeometry& geometry) {
  const bool moves =
      std::any_of(geometry.actors.begin(), geometry.actors.end(), [](const ActorGeometry& a) {
        return !a.flow.displacement.empty() || !a.displacement.empty();
      });
  if (has_velocities() && moves && geometry.frame < prepared_.frame_count) {
    PM_TRY(next_geometry_, geometry_at(prepared_, *engine_, geometry.frame + 1));
  }
  std::vector<SurfaceFrame> frames =
      surface_frames(prepared_, geometry, next_geometry_ ? &*next_geometry_ : nullptr);
  if (error_ > 0)
    for (std::size_t a = 0; a < frames.size(); ++a) {
      const float distance = static_cast<float>(error_) * prepared_.actors[a].box.diagonal();
      const std::size_t before = frames[a].triangles.size();
      const float error = simplify(frames[a], distance);
      log_debug("frame {}: {} of {} triangles, {:.4f} % of the diagonal off", geometry.frame,
                frames[a].triangles.size(), before,
                100 * static_cast<double>(error / prepared_.actors[a].box.diagonal()));
    }
  return frames;
}

/// Encodes the MTL and its textures; nothing if the frame has no new material since they were
/// written.
Result<std::vector<NewFile>> MeshRun::make_library() {
  std::vector<NewFile> files;
  if (written_materials_ == catalog_.materials.size()) return files;
  std::vector<std::string> names;
  for (std::size_t i = 0; i < catalog_.textures.size(); ++i) {
    const fs::path path = library_path(fmt::format(".texture{}.png", i + 1));
    names.push_back(path.filename().string());
    PM_TRY(std::string png, texture_png(*catalog_.textures[i]));
    files.push_back({path, std::move(png)});
  }
  written_materials_ = catalog_.materials.size();
  files.push_back({library_path(".mtl"), encode_mtl(catalog_, names)});
  return files;
}

Status MeshRun::write_frame(int frame) {
  PM_TRY(const FrameGeometry geometry, make_geometry(frame));
  const fs::path path = output_path(frame);
  if (format_ == MeshFormat::kBalls) return write_balls(prepared_, geometry, path);
  PM_TRY(const std::vector<SurfaceFrame> frames, make_surfaces(geometry));
  return write_surfaces(frame, geometry.stage, frames);
}

/// Returns an error if a signal has asked to stop.
Status MeshRun::check_stop() const {
  if (!stop_requested()) return Ok{};
  return Error{stop_code(), writer_ ? "stopped - nothing is written"
                                    : "stopped - the files named so far are whole"};
}

/// Writes all frames with one mesh per actor, whose vertices move (--topology constant).
Status MeshRun::write_carried() {
  const auto stopped = [&]() -> Status {
    if (stop_requested()) return Error{stop_code(), "stopped - nothing is written"};
    return Ok{};
  };
  std::vector<CarriedActor> actors;
  for (const PreparedActor& actor : prepared_.actors) {
    PM_TRY(CarriedActor carried, carry_actor({prepared_.scene, actor, frames_}, *engine_, stopped));
    const auto worst = static_cast<std::size_t>(
        std::max_element(carried.errors.begin(), carried.errors.end()) - carried.errors.begin());
    log_info("{}: {} triangles through {} frames, at most {:.2f} % of the diagonal off the surface",
             actor.name, carried.mesh.triangles.size(), frames_.size(),
             100 * static_cast<double>(carried.errors[worst]));
    actors.push_back(std::move(carried));
  }
  for (std::size_t k = 0; k < frames_.size(); ++k) {
    PM_TRY_STATUS(check_stop());
    std::vector<SurfaceFrame> frames;
    for (std::size_t a = 0; a < actors.size(); ++a) {
      PM_TRY(SurfaceFrame frame, carried_frame({prepared_.scene, prepared_.actors[a], frames_},
                                               actors[a], k, *engine_));
      frames.push_back(std::move(frame));
    }
    PM_TRY_STATUS(write_surfaces(frames_[k], stage_names(prepared_, frames_[k]), frames));
  }
  return Ok{};
}

Status MeshRun::write_frames() {
  for (const int frame : frames_) {
    PM_TRY_STATUS(check_stop());
    PM_TRY_STATUS(write_frame(frame));
  }
  return Ok{};
}

Status MeshRun::write_surfaces(int frame, const std::string& stage,
                               std::span<const SurfaceFrame> frames) {
  const fs::path path = output_path(frame);
  if (std::all_of(frames.begin(), frames.end(),
                  [](const SurfaceFrame& f) { return f.triangles.empty(); }))
    log_warning("frame {}: the balls have no surface at this level", frame);
  for (const SurfaceFrame& f : frames) {
    vertices_ += f.positions.size();
    triangles_ += f.triangles.size();
  }
  if (writer_) return writer_->add(frame, frames);
  if (format_ == MeshFormat::kObj) {
    const std::string library = library_path(".mtl").filename().string();
    std::string text = encode_obj(frames, sequence_, library, catalog_);
    PM_TRY(std::vector<NewFile> files, make_library());
    files.push_back({path, std::move(text)});
    PM_TRY_STATUS(write_files(files));
  } else {
    PM_TRY_STATUS(write_file(path, encode_ply(frames, sequence_)));
  }
  print_surfaces(path, stage, frames);
  return Ok{};
}

Result<int> MeshRun::run() {
  PM_TRY(const std::vector<Override> overrides, parse_overrides(options_.sets));
  PM_TRY(Scene scene, load_scene(options_.scene, overrides));
  const int count = frame_count(scene);
  PM_TRY(frames_, parse_frame_option(options_.frames, count));
  if (!options_.error.empty()) {
    std::string_view number = options_.error;
    const bool percent = number.ends_with('%');
    if (percent) number.remove_suffix(1);
    error_ = parse_number(number).value_or(0) * (percent ? 0.01 : 1);
    if (!(error_ > 0 && error_ <= 0.1))
      return make_error(ErrorCode::kUsage,
                        "--error: {} is no value for it - write a share of the diagonal up to 10%, "
                        "as in 0.02%",
                        options_.error);
  }
  if (options_.quantize && format_ != MeshFormat::kGlb)
    return make_error(ErrorCode::kUsage, "--quantize is for .glb files");
  if (is_carried() && (error_ > 0 || options_.quantize || format_ == MeshFormat::kBalls))
    return make_error(
        ErrorCode::kUsage,
        "--topology constant: a carried mesh is neither simplified nor quantized, and has no "
        "balls - leave out --error and --quantize, and write .glb, .usda, .obj or .ply");
  if (is_sequence(format_) || is_carried()) {
    std::sort(frames_.begin(), frames_.end());
  }
  if (!is_sequence(format_)) {
    PM_TRY(pattern_, parse_pattern(options_.output));
    if (frames_.size() > 1) pattern_ = add_number(pattern_);
  }
  PM_TRY_STATUS(check_outputs());
  ask_for_attributes(scene, has_velocities(),
                     format_ == MeshFormat::kPly || format_ == MeshFormat::kUsd);
  PM_TRY(EngineScene engine_scene, prepare_on_engine(line_, scene));
  engine_ = std::move(engine_scene.engine);
  prepared_ = std::move(engine_scene.prepared);
  // Check again: now all input files are known, also those that models and materials name.
  PM_TRY_STATUS(check_outputs());
  sequence_ = surface_sequence(prepared_, frames_.front(), frames_.back());
  if (is_carried()) sequence_.constant_topology = true, sequence_.has_corner_normals = false;
  if (format_ == MeshFormat::kUsd) {
    PM_TRY(writer_, make_usd_writer(options_.output, sequence_, line_.common.overwrite));
  } else if (format_ == MeshFormat::kGlb) {
    PM_TRY(writer_, make_glb_writer(options_.output, sequence_, {options_.quantize}));
  }
  if (is_carried()) {
    PM_TRY_STATUS(write_carried());
  } else {
    PM_TRY_STATUS(write_frames());
  }
  if (writer_) {
    PM_TRY_STATUS(writer_->finish());
    print_data("{} {} frames, {}, {} vertices, {} triangles\n", options_.output, frames_.size(),
               plural(prepared_.actors.size(), "actor"), vertices_, triangles_);
  }
  return 0;
}

Result<int> write_page(const CommandLine& line, const MeshOptions& options) {
  if (!options.frames.empty() || !options.error.empty() || options.quantize ||
      options.topology == "constant")
    return make_error(ErrorCode::kUsage,
                      "--html: a page has all frames and makes its own surfaces - leave out "
                      "--frames, --error, --quantize and --topology");
  PM_TRY_STATUS(check_play_page(line, options.html));
  PM_TRY(const std::vector<Override> overrides, parse_overrides(options.sets));
  PM_TRY(Scene scene, load_scene(options.scene, overrides));
  PM_TRY_STATUS(write_play_page(line, std::move(scene), options.html));
  return 0;
}

Result<int> run_mesh(const CommandLine& line, const MeshOptions& options) {
  if (options.output.empty() == options.html.empty())
    return make_error(ErrorCode::kUsage,
                      "give -o morph.usda (or another mesh) or --html play.html");
  if (!options.html.empty()) return write_page(line, options);
  PM_TRY(const MeshFormat format, parse_format(options.output));
  return MeshRun(line, options, format).run();
}

}  // namespace

void add_mesh(CommandLine& line) {
  auto options = std::make_shared<MeshOptions>();
  Command command = add_command(
      line, "mesh", "Write the surface for other programs (USD, glTF, PLY, OBJ), or the balls.",
      "  polymorph mesh scene.json -o morph.usda\n"
      "  polymorph mesh scene.json -o morph.glb --quantize --error 0.02%\n"
      "  polymorph mesh scene.json -o 'surface.####.ply'\n"
      "  polymorph mesh scene.json --topology constant -o targets.glb\n"
      "  polymorph mesh scene.json -f 12 -o half.obj\n"
      "  polymorph mesh scene.json --html play.html\n"
      "  polymorph mesh scene.json -f 12 -o balls.json",
      "  0 written   2 usage   3 bad scene or model   4 cannot write\n"
      "  5 device or memory   130, 143 stopped by a signal");
  command.add_option("scene", options->scene, "SCENE", "the scene file").required();
  command.add_option("-o,--output", options->output, "FILE",
                     "morph.usda or morph.glb; surface.####.ply or .obj; .json for the balls");
  command.add_option("--html", options->html, "FILE",
                     "instead: a page that plays the morph in a browser");
  command
      .add_option("--topology", options->topology, "WHAT",
                  "constant: one mesh carried through a leg, for morph targets; default: changing")
      .choices({"changing", "constant"});
  command.add_option("-f,--frames", options->frames, "LIST",
                     "1-48, 1-48x2, 5-1, 1,5,10-20; default: all");
  command.add_option("--error", options->error, "E",
                     "simplify: maximum Hausdorff distance, a share of the diagonal, as 0.02%");
  command.add_flag("--quantize", options->quantize,
                   ".glb: 16 bits for positions, 8 for normals, no velocities");
  add_overwrite(command, line.common);
  add_overrides(command, options->sets);
  set_action(line, command, [&line, options] { return run_mesh(line, *options); });
}

}  // namespace polymorph
