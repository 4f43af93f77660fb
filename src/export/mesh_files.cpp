#include "export/mesh_files.h"

#include <algorithm>
#include <memory>
#include <optional>

#include "base/file.h"
#include "base/log.h"
#include "base/plural.h"
#include "base/stop.h"
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

namespace polymorph {
namespace {

namespace fs = std::filesystem;

/// Inputs and state of the writing of mesh files.
struct MeshRun {
  const MeshFileSettings& settings;
  const PreparedScene& prepared;
  Engine& engine;
  SurfaceSequence sequence;
  std::unique_ptr<SurfaceWriter> writer = nullptr;  ///< null: a file per frame
  /// Geometry of the frame after the present one, which the present velocities need.
  std::optional<FrameGeometry> next_geometry = std::nullopt;
  MaterialCatalog catalog = {};             ///< OBJ: materials and textures of all frames so far
  std::size_t written_materials = 0;        ///< materials of `catalog` that the MTL file has
  std::size_t vertices = 0, triangles = 0;  ///< sums over all surfaces so far
};

bool has_velocities(const MeshFileSettings& settings) {
  return settings.format == MeshFormat::kPly || settings.format == MeshFormat::kUsd ||
         (settings.format == MeshFormat::kGlb && !settings.quantize);
}

fs::path output_path(const MeshFileSettings& settings, int frame) {
  return is_one_file(settings.format) ? settings.output : frame_path(settings.pattern, frame);
}

/// Returns the path of the MTL or a texture: the output's name without the frame number and the
/// dots and underscores before it, and with another ending. out/walk_####.obj has out/walk.mtl.
fs::path library_path(const MeshFileSettings& settings, const std::string& ending) {
  fs::path path = settings.output;
  if (settings.pattern.has_number()) {
    fs::path stem = fs::path(settings.pattern.before).filename();
    while (!stem.empty() && (stem.string().back() == '.' || stem.string().back() == '_'))
      stem = stem.string().substr(0, stem.string().size() - 1);
    path =
        fs::path(settings.pattern.before).parent_path() / (stem.empty() ? fs::path("mesh") : stem);
  } else {
    path.replace_extension();
  }
  path += ending;
  return path;
}

Status write_balls(const MeshRun& run, const FrameGeometry& geometry, const fs::path& path) {
  const FieldKind kind = run.prepared.scene.field.kind;
  std::vector<Ball> balls;
  for (const ActorGeometry& actor : geometry.actors) {
    const std::vector<Ball> actor_balls = rescale_balls(actor.balls.balls(), kind, actor.iso);
    balls.insert(balls.end(), actor_balls.begin(), actor_balls.end());
  }
  if (balls.empty()) log_info("frame {}: only the model shows, no balls", geometry.frame);
  PM_TRY_STATUS(write_file(path, encode_balls(balls, kind)));
  run.settings.print(fmt::format("{} {} balls\n", path.string(), balls.size()));
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

/// Returns a line with the properties of a frame's surfaces.
std::string describe_surfaces(const fs::path& path, const std::string& stage,
                              std::span<const SurfaceFrame> frames) {
  const MeshReport report = check_mesh(join_meshes(frames));
  return fmt::format(
      "{} {} {}: {} vertices, {} triangles, {}, genus {}, {}, volume {:.6g}, area {:.6g}, "
      "digest {}\n",
      path.string(), stage, surface_kinds(frames), report.vertices, report.triangles,
      report.is_closed() ? "closed" : "NOT CLOSED",
      report.is_closed() ? fmt::format("{}", report.genus) : "-", plural(report.components, "part"),
      report.volume, report.area, report.digest);
}

/// Returns an error if a signal has asked to stop.
Status check_stop(const MeshRun& run) {
  if (!stop_requested()) return Ok{};
  return Error{stop_code(), run.writer ? "stopped - nothing is written"
                                       : "stopped - the files named so far are whole"};
}

/// Returns the frame's geometry, which may have been made for the velocities of the frame before.
Result<FrameGeometry> make_geometry(MeshRun& run, int frame) {
  if (run.next_geometry && run.next_geometry->frame == frame) {
    FrameGeometry geometry = std::move(*run.next_geometry);
    run.next_geometry.reset();
    return geometry;
  }
  return geometry_at(run.prepared, run.engine, frame);
}

/// Makes the surfaces of all actors, with velocities if the format has them, and simplifies them.
Result<std::vector<SurfaceFrame>> make_surfaces(MeshRun& run, const FrameGeometry& geometry) {
  const bool has_motion =
      std::any_of(geometry.actors.begin(), geometry.actors.end(), [](const ActorGeometry& a) {
        return !a.flow.displacement.empty() || !a.displacement.empty();
      });
  if (has_velocities(run.settings) && has_motion && geometry.frame < run.prepared.frame_count) {
    PM_TRY(run.next_geometry, geometry_at(run.prepared, run.engine, geometry.frame + 1));
  }
  std::vector<SurfaceFrame> frames =
      surface_frames(run.prepared, geometry, run.next_geometry ? &*run.next_geometry : nullptr);
  if (run.settings.error > 0)
    for (std::size_t a = 0; a < frames.size(); ++a) {
      const float distance =
          static_cast<float>(run.settings.error) * run.prepared.actors[a].box.diagonal();
      const std::size_t full_count = frames[a].triangles.size();
      const float error = simplify(frames[a], distance);
      log_debug("frame {}: {} of {} triangles, {:.4f} % of the diagonal off", geometry.frame,
                frames[a].triangles.size(), full_count,
                100 * static_cast<double>(error / run.prepared.actors[a].box.diagonal()));
    }
  return frames;
}

/// Encodes the MTL file and its textures. Returns no files if there is no new material since the
/// last call.
Result<std::vector<NewFile>> make_library(MeshRun& run) {
  std::vector<NewFile> files;
  if (run.written_materials == run.catalog.materials.size()) return files;
  std::vector<std::string> names;
  for (std::size_t i = 0; i < run.catalog.textures.size(); ++i) {
    const fs::path path = library_path(run.settings, fmt::format(".texture{}.png", i + 1));
    names.push_back(path.filename().string());
    PM_TRY(std::string png, texture_png(*run.catalog.textures[i]));
    files.push_back({path, std::move(png)});
  }
  run.written_materials = run.catalog.materials.size();
  files.push_back({library_path(run.settings, ".mtl"), encode_mtl(run.catalog, names)});
  return files;
}

/// Adds the frame to the file of all frames, or writes its own file and prints a line about it.
Status write_surfaces(MeshRun& run, int frame, const std::string& stage,
                      std::span<const SurfaceFrame> frames) {
  const fs::path path = output_path(run.settings, frame);
  if (std::all_of(frames.begin(), frames.end(),
                  [](const SurfaceFrame& f) { return f.triangles.empty(); }))
    log_warning("frame {}: the balls have no surface at this level", frame);
  for (const SurfaceFrame& f : frames) {
    run.vertices += f.positions.size();
    run.triangles += f.triangles.size();
  }
  if (run.writer) return run.writer->add(frame, frames);
  if (run.settings.format == MeshFormat::kObj) {
    const std::string library = library_path(run.settings, ".mtl").filename().string();
    std::string text = encode_obj(frames, run.sequence, library, run.catalog);
    PM_TRY(std::vector<NewFile> files, make_library(run));
    files.push_back({path, std::move(text)});
    PM_TRY_STATUS(write_files(files));
  } else {
    PM_TRY_STATUS(write_file(path, encode_ply(frames, run.sequence)));
  }
  run.settings.print(describe_surfaces(path, stage, frames));
  return Ok{};
}

Status write_frame(MeshRun& run, int frame) {
  PM_TRY(const FrameGeometry geometry, make_geometry(run, frame));
  const fs::path path = output_path(run.settings, frame);
  if (run.settings.format == MeshFormat::kBalls) return write_balls(run, geometry, path);
  PM_TRY(const std::vector<SurfaceFrame> frames, make_surfaces(run, geometry));
  return write_surfaces(run, frame, geometry.stage, frames);
}

Status write_frames(MeshRun& run) {
  for (const int frame : run.settings.frames) {
    PM_TRY_STATUS(check_stop(run));
    PM_TRY_STATUS(write_frame(run, frame));
  }
  return Ok{};
}

/// Writes all frames with one mesh per actor, whose vertices move (--topology constant).
Status write_carried(MeshRun& run) {
  const auto check_stopped = [&] { return check_stop(run); };
  std::vector<CarriedActor> actors;
  for (const PreparedActor& actor : run.prepared.actors) {
    PM_TRY(CarriedActor carried, carry_actor({run.prepared.scene, actor, run.settings.frames},
                                             run.engine, check_stopped));
    log_info(
        "{}: {} triangles through {} frames, at most {:.2f} % of the diagonal off the surface",
        actor.name, carried.mesh.triangles.size(), run.settings.frames.size(),
        100 * static_cast<double>(*std::max_element(carried.errors.begin(), carried.errors.end())));
    actors.push_back(std::move(carried));
  }
  for (std::size_t k = 0; k < run.settings.frames.size(); ++k) {
    PM_TRY_STATUS(check_stop(run));
    std::vector<SurfaceFrame> frames;
    for (std::size_t a = 0; a < actors.size(); ++a) {
      PM_TRY(SurfaceFrame frame,
             make_carried_frame({run.prepared.scene, run.prepared.actors[a], run.settings.frames},
                                actors[a], k, run.engine));
      frames.push_back(std::move(frame));
    }
    PM_TRY_STATUS(write_surfaces(run, run.settings.frames[k],
                                 stage_names(run.prepared, run.settings.frames[k]), frames));
  }
  return Ok{};
}

}  // namespace

bool is_one_file(MeshFormat format) {
  return format == MeshFormat::kUsd || format == MeshFormat::kGlb;
}

Result<MeshFormat> parse_mesh_format(const fs::path& output) {
  constexpr std::pair<const char*, MeshFormat> kFormats[] = {{".obj", MeshFormat::kObj},
                                                             {".ply", MeshFormat::kPly},
                                                             {".json", MeshFormat::kBalls},
                                                             {".usda", MeshFormat::kUsd},
                                                             {".glb", MeshFormat::kGlb}};
  const std::string extension = output.extension().string();
  for (const auto& [name, format] : kFormats)
    if (extension == name) return format;
  return make_error(ErrorCode::kUsage,
                    "{}: unknown format \"{}\" - use .obj, .ply, .usda or .glb for surfaces, .json "
                    "for balls",
                    output.string(), extension);
}

Status complete_mesh_settings(MeshFileSettings& settings) {
  if (is_one_file(settings.format) || settings.constant_topology)
    std::sort(settings.frames.begin(), settings.frames.end());
  if (is_one_file(settings.format)) return Ok{};
  PM_TRY(settings.pattern, parse_pattern(settings.output.string()));
  if (settings.frames.size() > 1) settings.pattern = add_number(settings.pattern);
  return Ok{};
}

Status check_mesh_files(const MeshFileSettings& settings, std::span<const PreparedActor> actors) {
  for (const int frame : settings.frames) {
    PM_TRY_STATUS(check_output(output_path(settings, frame), settings.overwrite));
    if (is_one_file(settings.format)) break;
  }
  if (settings.format == MeshFormat::kObj)
    PM_TRY_STATUS(check_output(library_path(settings, ".mtl"), settings.overwrite));
  if (settings.format != MeshFormat::kObj && settings.format != MeshFormat::kUsd) return Ok{};
  std::size_t textures = 0;  // upper bound of the number of texture files
  for (const PreparedActor& actor : actors) {
    if (actor.sequence) textures += actor.sequence->max_textures * actor.sequence->files.size();
    if (actor.poses)
      for (const MovingObject& object : actor.poses->objects)
        if (object.sequence)
          textures += object.sequence->max_textures * object.sequence->files.size();
    for (const auto& object : actor.objects) textures += object->model.textures.size();
  }
  for (std::size_t i = 1; i <= textures; ++i)
    PM_TRY_STATUS(
        check_output(library_path(settings, fmt::format(".texture{}.png", i)), settings.overwrite));
  return Ok{};
}

void request_mesh_attributes(Scene& scene, const MeshFileSettings& settings) {
  request_attributes(scene, has_velocities(settings),
                     settings.format == MeshFormat::kPly || settings.format == MeshFormat::kUsd);
}

Status write_mesh_files(const MeshFileSettings& settings, const PreparedScene& prepared,
                        Engine& engine) {
  MeshRun run{settings, prepared, engine,
              surface_sequence(prepared, settings.frames.front(), settings.frames.back())};
  if (settings.constant_topology)  // carried meshes have one normal per point
    run.sequence.constant_topology = true, run.sequence.has_corner_normals = false;
  if (settings.format == MeshFormat::kUsd) {
    PM_TRY(run.writer, make_usd_writer(settings.output, run.sequence, settings.overwrite));
  } else if (settings.format == MeshFormat::kGlb) {
    PM_TRY(run.writer, make_glb_writer(settings.output, run.sequence, {settings.quantize}));
  }
  PM_TRY_STATUS(settings.constant_topology ? write_carried(run) : write_frames(run));
  if (!run.writer) return Ok{};
  PM_TRY_STATUS(run.writer->finish());
  settings.print(fmt::format("{} {} frames, {}, {} vertices, {} triangles\n",
                             settings.output.string(), settings.frames.size(),
                             plural(prepared.actors.size(), "actor"), run.vertices, run.triangles));
  return Ok{};
}

}  // namespace polymorph
