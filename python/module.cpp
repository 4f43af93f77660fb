// The Python module _polymorph: scenes, models, balls, meshes and frames as numpy arrays.
// polymorph/__init__.py wraps it and documents shapes and units.
#include <nanobind/nanobind.h>
#include <nanobind/stl/map.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <map>
#include <memory>

#include "analyze/analysis_report.h"
#include "arrays.h"
#include "base/activity.h"
#include "base/log.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/program_identity.h"
#include "call.h"
#include "device/device.h"
#include "export/play_data.h"
#include "field/extract_surface.h"
#include "field/level.h"
#include "inspect/analyze_sequence.h"
#include "kernels/field_kinds.h"
#include "leg/leg_surface.h"
#include "mesh/append.h"
#include "model/load/load_model.h"
#include "model/shapes.h"
#include "scene/load_scene.h"
#include "sequence/frame/frame_geometry.h"
#include "sequence/frame/render_frame.h"
#include "sequence/prepare/prepare.h"
#include "spheres/spheres.h"

namespace nb = nanobind;

namespace polymorph {
namespace {

/// Returns the scene, or throws one error with all findings. Line numbers are given only for files
/// (`is_file`): the caller never saw the text of a dict.
Scene take_scene(SceneReading reading, const std::string& name, bool is_file) {
  Error error{ErrorCode::kInput, ""};
  for (const SceneFinding& finding : reading.findings) {
    if (!error.message.empty()) error.message += "\n";
    error.message += is_file ? to_string(finding, name)
                             : fmt::format("{}: {}: {}", name, finding.pointer, finding.message);
  }
  if (!reading.findings.empty()) throw PythonError{std::move(error)};
  return std::move(reading.scene);
}

/// Approximates the source of a scene. `text`: the scene's JSON; its other objects are ignored.
nb::dict approximate_source(const std::string& text, const std::string& cache,
                            const nb::object& progress) {
  Approximation approximation;
  run_call(progress, [&] {
    const Scene scene =
        take_scene(take(read_scene_text("settings", text)), "settings", /*is_file=*/false);
    const ObjectSettings& object = *chain_objects(scene.actors.front()).front();
    const Activity activity("fitting balls to " + object.name);
    const Model model = object.shape.empty() ? take(load_model(object.model)).model
                                             : take(make_shape(object.shape));
    approximation = take(approximate_cached(model, object.spheres, cache));
  });
  std::vector<float> spheres;
  const std::vector<Sphere> leaves = approximation.tree.leaves();
  for (const Sphere& s : leaves)
    spheres.insert(spheres.end(), {s.center.x, s.center.y, s.center.z, s.radius});
  const std::vector<float> levels(approximation.balls.size(), 1);
  nb::dict out = to_dict({approximation.balls, levels}, FieldKind::kGaussian);
  out["spheres"] = to_array(std::move(spheres), {leaves.size(), 4});
  return out;
}

/// Evaluates the field of balls at points.
nb::object evaluate_field(const Rows<3>& centers, const Column& a, const Column& w,
                          const Rows<9>& shapes, const std::string& kind, const Rows<3>& points) {
  const BallSet balls(to_balls(centers, a, w, shapes));
  const std::vector<Vec3> positions = to_points(points);
  ExtractSettings settings;
  const auto* named_kind = std::find_if(std::begin(kFieldKinds), std::end(kFieldKinds),
                                        [&](FieldKind k) { return field_name(k) == kind; });
  if (named_kind == std::end(kFieldKinds))
    throw PythonError{make_error(ErrorCode::kUsage, "no field is called \"{}\"", kind)};
  settings.field = *named_kind;
  std::vector<float> values;
  run_call(nb::none(), [&] {
    check(to_status(make_cpu_engine()->sample(balls, positions, settings, values)));
  });
  return to_array(std::move(values), {positions.size()});
}

/// Holds meshes in memory and gives them paths that scenes can name while this object lives.
class PythonModels {
 public:
  std::string add(const std::string& name, const MemoryMesh& mesh) {
    return models_.add(name, mesh).string();
  }
  std::string add_sequence(const std::string& name, const std::vector<const MemoryMesh*>& meshes) {
    std::vector<MemoryMesh> copies;
    for (const MemoryMesh* mesh : meshes) copies.push_back(*mesh);
    return models_.add(name, std::move(copies)).string();
  }

 private:
  MemoryModels models_;
};

/// Shows as an activity (base/activity.h) which of several surfaces is being measured.
class MeasuringActivity {
 public:
  void show(int done, int count) {
    activity_.reset();
    activity_ = std::make_unique<Activity>(
        fmt::format("measuring surface {} of {}", std::min(done + 1, count), count));
  }

 private:
  std::unique_ptr<Activity> activity_;
};

/// Returns what `polymorph analyze 'seq.####.obj' --json` prints. Empty `source`, `target`: none.
std::string analyze_sequence(const std::string& meshes, const std::string& source,
                             const std::string& target, const nb::object& progress) {
  std::string report;
  run_call(progress, [&] {
    MeasuringActivity activity;
    const MeshMorph morph{take(parse_file_pattern(meshes)), source, target, /*truth=*/{}};
    report = dump_json(analysis_json(take(analyze_meshes(morph, [&](int done, int count) {
      activity.show(done, count);
      return true;  // continues
    }))));
  });
  return report;
}

/// A prepared scene. Calls from several threads run one after the other.
class PythonScene {
 public:
  /// Reads the file `path` if `text` is empty. Otherwise `text` is the scene, and its paths are
  /// relative to the folder of `path`.
  PythonScene(const std::string& path, const std::string& text,
              const std::map<std::string, std::string>& overrides, const std::string& device,
              const std::string& cache, const nb::object& progress)
      : cache_(cache) {
    run_call(progress, [&] {
      const std::vector<Override> override_list(overrides.begin(), overrides.end());
      const bool is_file = text.empty();
      SceneReading reading = take(is_file ? read_scene(path, override_list)
                                          : read_scene_text(path, text, override_list));
      const Scene scene = take_scene(std::move(reading), path, is_file);
      engine_ = take(make_engine(device, device_));
      prepared_ = take(prepare_scene(scene, *engine_, {cache, {memory_limit(), /*pictures=*/0}}));
    });
  }

  int frame_count() const { return prepared_.frame_count; }
  int width() const { return prepared_.scene.image.width; }
  int height() const { return prepared_.scene.image.height; }
  const std::vector<std::string>& warnings() const { return prepared_.warnings; }
  const std::string& device() const { return device_; }

  nb::dict balls(int frame, const nb::object& progress) {
    const FieldKind kind = prepared_.scene.field.kind;
    LeveledBalls rescaled;
    call(progress, [&] {
      for (const ActorGeometry& actor : geometry(frame).actors) {
        const std::vector<Ball> actor_balls = rescale_balls(actor.balls.balls(), kind, actor.iso);
        rescaled.balls.insert(rescaled.balls.end(), actor_balls.begin(), actor_balls.end());
        rescaled.levels.insert(rescaled.levels.end(), actor_balls.size(), actor.iso);
      }
    });
    return to_dict(rescaled, kind);
  }

  /// Returns the mesh of all actors. `frame` may lie between two frames.
  nb::dict mesh(double frame, const nb::object& progress) {
    Mesh mesh;
    call(progress, [&] {
      check_frame(frame);
      const Activity activity(fmt::format("extracting the surfaces of frame {:g}", frame));
      const FrameSettings& frames = prepared_.scene.frames;
      // All frames of a turntable show the same time of the morph.
      const double morph_frame = frames.turntable > 0 ? frames.still : frame;
      for (const PreparedActor& actor : prepared_.actors)
        append(
            mesh,
            shown_mesh(actor, take(actor_geometry_at(
                                  actor, morph_state_at(actor.timeline, morph_frame), *engine_))));
    });
    return to_dict(mesh);
  }

  nb::object field(int frame, const Rows<3>& points, int actor, const nb::object& progress) {
    std::vector<Vec3> positions = to_points(points);
    std::vector<float> values;
    call(progress, [&] {
      check_frame(frame);
      if (actor < 0 || actor >= static_cast<int>(prepared_.actors.size()))
        throw PythonError{make_error(ErrorCode::kUsage, "actor {}: there are actors 0 to {}", actor,
                                     prepared_.actors.size() - 1)};
      const PreparedActor& prepared_actor = prepared_.actors[static_cast<std::size_t>(actor)];
      if (prepared_actor.sequence)
        throw PythonError{
            make_error(ErrorCode::kUsage, "actor {}: is a mesh sequence, without field", actor)};
      const MorphState state =
          morph_state_at(prepared_actor.timeline, shown_frame(prepared_.scene, frame));
      if (prepared_actor.space) {  // the actor mixes three objects or more
        const Mixture mixture = take(mix_objects(*prepared_actor.space, state.weights));
        const WeightedSurface mixed_surface = take(weighted_surface(mixture, *engine_));
        values = take(weighted_field(mixture, mixed_surface, positions, *engine_));
        return;
      }
      const Leg& leg = *prepared_actor.legs[static_cast<std::size_t>(state.leg)];
      for (Vec3& p : positions) p = p - prepared_actor.offset;
      const LegSurface surface = take(leg_surface(leg, state.time, *engine_));
      values = take(surface_field(leg, surface, positions, *engine_));
    });
    return to_array(std::move(values), {positions.size()});
  }

  nb::tuple frame(int frame, const nb::object& progress) {
    Image image;
    call(progress, [&] { image = render(frame); });
    const auto size = [](int n) { return static_cast<std::size_t>(n); };
    std::vector<std::size_t> shape{size(image.height), size(image.width), image.channel_count()};
    return nb::make_tuple(to_array(std::move(image.pixels), std::move(shape)), image.channels);
  }

  /// Renders a frame and returns its colours, as to_color_array() does.
  nb::object colors(int frame, bool bytes, const nb::object& progress) {
    Image image;
    call(progress, [&] { image = render(frame); });
    const Scene scene = scene_at(prepared_.scene, static_cast<double>(frame));
    return to_color_array(image, bytes, scene.image.exposure);
  }

  /// Returns the page of `polymorph mesh --html`. The scene is prepared again for it, with at most
  /// kPlayResolution cells.
  std::string page(const nb::object& progress) {
    call(progress, [&] {
      if (!page_.empty()) return;
      check(check_has_no_mesh_sequence(prepared_));
      Scene scene = prepared_.scene;
      scene.surface.resolution = std::min(scene.surface.resolution, kPlayResolution);
      const PreparedScene prepared = take(
          prepare_scene(scene, *engine_,
                        {cache_, {memory_limit(), /*pictures=*/0}, Fits::kMake, Sharing::kNone}));
      page_ = encode_play_page(take(make_play_page(prepared, *engine_)));
    });
    return page_;
  }

  /// Returns the report of `polymorph analyze --json`.
  std::string analyze(int frames, const nb::object& progress) {
    std::string report;
    call(progress, [&] {
      MeasuringActivity activity;
      report = dump_json(
          analysis_json(take(analyze_scene(prepared_, *engine_, frames, [&](int done, int count) {
            activity.show(done, count);
            return true;  // continues
          }))));
    });
    return report;
  }

  /// Returns a dict per leg, actor by actor, with balls in the scene's coordinates.
  nb::list plans() const {
    nb::list plans;
    for (const PreparedActor& actor : prepared_.actors)
      for (const auto& leg : actor.legs) {
        MorphPlan world_plan = leg->plan;
        for (Ball& ball : world_plan.from) ball.center = ball.center + actor.offset;
        for (Ball& ball : world_plan.to) ball.center = ball.center + actor.offset;
        nb::dict plan = to_dict(world_plan);
        plan["actor"] = actor.name;
        plan["source"] = leg->from->name;
        plan["target"] = leg->to->name;
        plans.append(plan);
      }
    return plans;
  }

 private:
  template <class Work>
  void call(const nb::object& progress, const Work& work) {
    run_call(progress, [&] {
      const InterruptibleLock lock(mutex_);
      work();
    });
  }
  void check_frame(double frame) const {
    if (!(frame >= 1 && frame <= prepared_.frame_count))
      throw PythonError{make_error(ErrorCode::kUsage, "frame {:g}: there are frames 1 to {}", frame,
                                   prepared_.frame_count)};
  }
  FrameGeometry geometry(int frame) {
    check_frame(frame);
    const Activity activity(fmt::format("extracting the surfaces of frame {}", frame));
    return take(geometry_at(prepared_, *engine_, frame));
  }

  Image render(int frame) {
    check_frame(frame);
    check(check_picture_memory(prepared_.scene.image, /*pictures=*/1, memory_limit()));
    const FrameGeometry surfaces = geometry(frame);
    const Activity activity(fmt::format("rendering frame {}", frame));
    if (!renderer_)
      renderer_ = std::make_unique<Renderer>(take(make_renderer(device_, memory_limit())));
    return take(render_frame(prepared_, surfaces, *renderer_, device_, ""));
  }

  std::timed_mutex mutex_;  ///< held by each call that uses engine or renderer
  std::string device_, cache_;
  std::string page_;  ///< empty until page() is called
  std::unique_ptr<Engine> engine_;
  PreparedScene prepared_;
  std::unique_ptr<Renderer> renderer_;
};

void limit_threads(int count) {
  constexpr int kMaxCount = 4096;
  if (count < 0 || count > kMaxCount)
    throw PythonError{
        make_error(ErrorCode::kUsage, "{} threads: use 1 to {}, or 0 for all", count, kMaxCount)};
  set_thread_count(count);
}

}  // namespace
}  // namespace polymorph

NB_MODULE(_polymorph, m) {
  using namespace polymorph;
  register_errors(m);
  // Callers read warnings from Scene.warnings instead.
  LogSettings log;
  log.level = LogLevel::kError;
  check(set_log(log));

  m.attr("version") = std::string(program_version());
  m.def("approximate", &approximate_source, nb::arg(), nb::arg(), nb::arg().none());
  m.def("ball_field", &evaluate_field);
  m.def("analyze_meshes", &analyze_sequence, nb::arg(), nb::arg(), nb::arg(), nb::arg().none());
  m.def("schema", &scene_schema);
  m.def("identity", [] { return std::string(program_identity()); });
  m.def("default_cache_folder", [] { return default_cache_folder().string(); });
  m.def("set_thread_count", &limit_threads);
  nb::class_<MemoryMesh>(m, "MemoryMesh")
      .def("__init__", [](MemoryMesh* self, const Rows<3>& vertices, const Indices& corners,
                          const Indices& sizes, const Rows<3>& colors) {
        new (self) MemoryMesh(to_memory_mesh(vertices, corners, sizes, colors));
      });
  nb::class_<PythonModels>(m, "Models")
      .def(nb::init<>())
      .def("add", &PythonModels::add)
      .def("add_sequence", &PythonModels::add_sequence);
  nb::class_<PythonScene>(m, "Scene")
      .def(nb::init<const std::string&, const std::string&,
                    const std::map<std::string, std::string>&, const std::string&,
                    const std::string&, const nb::object&>(),
           nb::arg(), nb::arg(), nb::arg(), nb::arg(), nb::arg(), nb::arg().none())
      .def_prop_ro("frame_count", &PythonScene::frame_count)
      .def_prop_ro("width", &PythonScene::width)
      .def_prop_ro("height", &PythonScene::height)
      .def_prop_ro("warnings", &PythonScene::warnings)
      .def_prop_ro("device", &PythonScene::device)
      .def("balls", &PythonScene::balls, nb::arg(), nb::arg().none())
      .def("mesh", &PythonScene::mesh, nb::arg(), nb::arg().none())
      .def("field", &PythonScene::field, nb::arg(), nb::arg(), nb::arg(), nb::arg().none())
      .def("frame", &PythonScene::frame, nb::arg(), nb::arg().none())
      .def("colors", &PythonScene::colors, nb::arg(), nb::arg(), nb::arg().none())
      .def("page", &PythonScene::page, nb::arg().none())
      .def("analyze", &PythonScene::analyze, nb::arg(), nb::arg().none())
      .def("plans", &PythonScene::plans);
}
