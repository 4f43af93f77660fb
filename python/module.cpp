// The Python module: scenes, models, balls, meshes and frames as numpy arrays. What users see, with
// shapes and units, stands in polymorph/__init__.py; this is what it needs of the rooms.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/map.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <map>

#include "base/log.h"
#include "base/parallel.h"
#include "base/program_identity.h"
#include "mesh/append.h"
#include "model/load/load_model.h"
#include "model/shapes.h"
#include "scene/load_scene.h"
#include "sequence/frame/frame_geometry.h"
#include "sequence/frame/render_frame.h"
#include "sequence/prepare/prepare.h"
#include "sequence/run/device.h"
#include "spheres/spheres.h"

namespace nb = nanobind;

namespace polymorph {
namespace {

/// Thrown across the border, where it becomes polymorph.Error(message, code).
struct PythonError {
  Error error;
};

template <class T>
T take(Result<T> result) {
  if (!result) throw PythonError{std::move(result).error()};
  return std::move(result).value();
}
void check(Status status) {
  if (!status) throw PythonError{std::move(status).error()};
}

/// Everything that is wrong with a scene becomes one error. Places in a text that the caller never
/// saw are left out.
Scene good_scene(SceneReading reading, const std::string& name, bool is_file) {
  Error error{ErrorCode::kInput, ""};
  for (const SceneFinding& finding : reading.findings) {
    if (!error.message.empty()) error.message += "\n";
    error.message += is_file ? to_string(finding, name)
                             : fmt::format("{}: {}: {}", name, finding.pointer, finding.message);
  }
  if (!reading.findings.empty()) throw PythonError{std::move(error)};
  return std::move(reading.scene);
}

/// Numpy's own from then on.
template <class T>
nb::object array(std::vector<T> values, std::vector<std::size_t> shape) {
  auto* kept = new std::vector<T>(std::move(values));
  nb::capsule owner(kept, [](void* p) noexcept { delete static_cast<std::vector<T>*>(p); });
  return nb::cast(nb::ndarray<nb::numpy, T>(kept->data(), shape.size(), shape.data(), owner));
}

nb::object array(const std::vector<Vec3>& points) {
  std::vector<float> values;
  values.reserve(3 * points.size());
  for (const Vec3 p : points) values.insert(values.end(), {p.x, p.y, p.z});
  return array(std::move(values), {points.size(), 3});
}

nb::dict to_dict(const std::vector<Ball>& balls) {
  std::vector<Vec3> centers;
  std::vector<float> a, w, shapes;
  for (const Ball& ball : balls) {
    const Sym3& s = ball.shape;
    centers.push_back(ball.center);
    a.push_back(ball.a);
    w.push_back(ball.w);
    shapes.insert(shapes.end(), {s.xx, s.xy, s.xz, s.xy, s.yy, s.yz, s.xz, s.yz, s.zz});
  }
  nb::dict out;
  out["centers"] = array(centers);
  out["a"] = array(std::move(a), {balls.size()});
  out["w"] = array(std::move(w), {balls.size()});
  out["shapes"] = array(std::move(shapes), {balls.size(), 3, 3});
  return out;
}

nb::dict to_dict(const Mesh& mesh) {
  std::vector<std::uint32_t> triangles;
  for (const Triangle& t : mesh.triangles)
    triangles.insert(triangles.end(), {t.v[0], t.v[1], t.v[2]});
  nb::dict out;
  out["positions"] = array(mesh.positions);
  out["normals"] = array(mesh.normals);
  out["triangles"] = array(std::move(triangles), {mesh.triangles.size(), 3});
  return out;
}

/// `text`: a scene's JSON, of which the source counts; its model by a name or a path.
nb::dict approximate_source(const std::string& text, const std::string& cache) {
  Approximation approximation;
  {
    const nb::gil_scoped_release release;
    const Scene scene = good_scene(take(read_scene_text("settings", text)), "settings", false);
    const ObjectSettings& object = *chain_objects(scene.actors.front()).front();
    const Model model = object.shape.empty() ? take(load_model(object.model)).model
                                             : take(make_shape(object.shape));
    approximation = take(approximate_cached(model, object.spheres, cache));
  }
  std::vector<float> spheres;
  const std::vector<Sphere> leaves = approximation.tree.leaves();
  for (const Sphere& s : leaves)
    spheres.insert(spheres.end(), {s.center.x, s.center.y, s.center.z, s.radius});
  nb::dict out = to_dict(approximation.balls);
  out["spheres"] = array(std::move(spheres), {leaves.size(), 4});
  return out;
}

/// A prepared scene.
class PythonScene {
 public:
  /// `text` empty: of the file `path`; else the scene itself, its paths relative to the folder of
  /// `path`.
  PythonScene(const std::string& path, const std::string& text,
              const std::map<std::string, std::string>& overrides, const std::string& device,
              const std::string& cache) {
    const nb::gil_scoped_release release;
    const std::vector<Override> set(overrides.begin(), overrides.end());
    const bool is_file = text.empty();
    SceneReading reading = take(is_file ? read_scene(path, set) : read_scene_text(path, text, set));
    const Scene scene = good_scene(std::move(reading), path, is_file);
    engine_ = take(make_engine(device, device_));
    prepared_ = take(prepare_scene(scene, *engine_, cache));
  }

  int frame_count() const { return prepared_.frame_count; }
  int width() const { return prepared_.scene.image.width; }
  int height() const { return prepared_.scene.image.height; }
  const std::vector<std::string>& warnings() const { return prepared_.warnings; }
  const std::string& device() const { return device_; }

  nb::dict balls(int frame) {
    std::vector<Ball> balls;
    {
      const nb::gil_scoped_release release;
      for (const ActorGeometry& actor : geometry(frame).actors)
        balls.insert(balls.end(), actor.balls.begin(), actor.balls.end());
    }
    return to_dict(balls);
  }

  nb::dict mesh(int frame) {
    Mesh mesh;
    {
      const nb::gil_scoped_release release;
      const FrameGeometry shown = geometry(frame);
      for (std::size_t i = 0; i < shown.actors.size(); ++i)
        append(mesh, shown_mesh(prepared_.actors[i], shown.actors[i]));
    }
    return to_dict(mesh);
  }

  nb::tuple frame(int frame) {
    Image image;
    {
      const nb::gil_scoped_release release;
      if (!renderer_) renderer_ = std::make_unique<Renderer>(take(Renderer::create()));
      image = take(render_frame(prepared_, geometry(frame), *renderer_, device_, ""));
    }
    const auto size = [](int n) { return static_cast<std::size_t>(n); };
    std::vector<std::size_t> shape{size(image.height), size(image.width), image.channel_count()};
    return nb::make_tuple(array(std::move(image.pixels), std::move(shape)), image.channels);
  }

 private:
  FrameGeometry geometry(int frame) {
    if (frame < 1 || frame > prepared_.frame_count)
      throw PythonError{make_error(ErrorCode::kUsage, "frame {}: there are frames 1 to {}", frame,
                                   prepared_.frame_count)};
    return take(geometry_at(prepared_, *engine_, frame));
  }

  std::string device_;
  std::unique_ptr<Engine> engine_;
  PreparedScene prepared_;
  std::unique_ptr<Renderer> renderer_;
};

}  // namespace
}  // namespace polymorph

NB_MODULE(_polymorph, m) {
  using namespace polymorph;
  // Warnings are handed to the caller instead.
  LogSettings log;
  log.level = LogLevel::kError;
  check(set_log(log));

  static nb::object error_type;
  error_type = nb::module_::import_("polymorph.error").attr("Error");
  nb::register_exception_translator([](const std::exception_ptr& thrown, void*) {
    try {
      std::rethrow_exception(thrown);
    } catch (const PythonError& e) {
      const nb::object object = error_type(e.error.message, static_cast<int>(e.error.code));
      PyErr_SetObject(error_type.ptr(), object.ptr());
    }
  });
  m.def("approximate", &approximate_source);
  m.def("schema", &scene_schema);
  m.def("identity", [] { return std::string(program_identity()); });
  m.def("default_cache_folder", [] { return default_cache_folder().string(); });
  m.def("set_thread_count", &set_thread_count);
  nb::class_<PythonScene>(m, "Scene")
      .def(nb::init<const std::string&, const std::string&,
                    const std::map<std::string, std::string>&, const std::string&,
                    const std::string&>())
      .def_prop_ro("frame_count", &PythonScene::frame_count)
      .def_prop_ro("width", &PythonScene::width)
      .def_prop_ro("height", &PythonScene::height)
      .def_prop_ro("warnings", &PythonScene::warnings)
      .def_prop_ro("device", &PythonScene::device)
      .def("balls", &PythonScene::balls)
      .def("mesh", &PythonScene::mesh)
      .def("frame", &PythonScene::frame);
}
