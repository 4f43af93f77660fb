#include "assets/load_models.h"
#include "sequence/prepare/prepare.h"

#include <gtest/gtest.h>

#include <fstream>

#include "base/file.h"
#include "base/parallel.h"
#include "device/device.h"
#include "film/render_sequence.h"
#include "image/image_io.h"
#include "kernels/devices.h"
#include "mesh/mesh_check.h"
#include "scene/load_scene.h"
#include "sequence/frame/frame_geometry.h"
#include "spheres/quality.h"
#include "testing/paths.h"
#include "testing/temporary_folder.h"

namespace polymorph {
namespace {

namespace fs = std::filesystem;

/// A small scene of built-in shapes; fast, and with every stage in it.
class SequenceTest : public FolderTest {
 protected:
  void SetUp() override {
    ASSERT_TRUE(
        write_file(folder / "scene.json",
                   R"({"source": {"shape": "cube", "spheres": {"balls": 12}}, "target": "torus",
      "intermediate": [{"shape": "puddle", "meta": true}], "spheres": {"balls": 24},
      "frames": {"count": 14}, "surface": {"resolution": 32},
      "image": {"width": 48, "height": 36, "samples": 2}})")
            .ok());
    auto loaded = load_scene(folder / "scene.json");
    ASSERT_TRUE(loaded.ok()) << loaded.error().message;
    scene = *loaded;
  }
  void TearDown() override { set_thread_count(0); }
  SequenceSettings settings(std::vector<int> frames, const std::string& pattern) {
    SequenceSettings s;
    s.frames = std::move(frames);
    s.exr = *parse_pattern((folder / pattern).string());
    s.device = "cpu";
    s.cache_folder = shared_cache();
    return s;
  }
  std::string digest(const std::string& file) {
    const auto image = read_image(folder / file);
    EXPECT_TRUE(image.ok()) << (image.ok() ? "" : image.error().message);
    return image.ok() ? pixel_digest(*image) : "";
  }
  Scene scene;
};

TEST_F(SequenceTest, ObjectsStandAtTheSourcesSizeUnlessToldOtherwise) {
  const auto loaded = load_models(scene, chain_objects(scene), false);
  ASSERT_TRUE(loaded.ok());
  const float size = loaded->models[0].box().diagonal();
  for (const Model& model : loaded->models) {
    const Box box = model.box();
    EXPECT_NEAR(box.low.y, 0, 1e-5);
    EXPECT_NEAR(box.center().x, 0, 1e-5);
    EXPECT_NEAR(box.diagonal() / size, 1, 1e-4);
  }
  scene.actors[0].target.scale = {2, 2, 2};
  scene.actors[0].target.translate = {1, 0, 0};
  const Box box = load_models(scene, chain_objects(scene), false)->models[2].box();
  EXPECT_NEAR(box.diagonal() / size, 2, 1e-4);
  EXPECT_NEAR(box.center().x, 1, 1e-4);
  EXPECT_NEAR(box.low.y, 0, 1e-5);
}

TEST_F(SequenceTest, TurningAnObjectDoesNotChangeItsSize) {
  scene.actors[0].source.rotate = scene.actors[0].target.rotate = {0, 45, 0};
  scene.actors[0].target.shape = "cube";
  const auto loaded = load_models(scene, chain_objects(scene), false);
  ASSERT_TRUE(loaded.ok());
  EXPECT_NEAR(loaded->models[2].box().diagonal() / loaded->models[0].box().diagonal(), 1, 1e-4);
}

TEST_F(SequenceTest, ACreaseDecidesWhichEdgesAreSharp) {
  // A roof of 70 degrees between its faces, whose file says that it is smooth.
  std::ofstream(folder / "roof.obj")
      << "v 0 0 0\nv 1 0 0\nv 0 0.7 1\nv 1 0.7 1\nv 0 0 2\nv 1 0 2\nvn 0 1 0\n"
         "f 1//1 3//1 4//1\nf 1//1 4//1 2//1\nf 3//1 5//1 6//1\nf 3//1 6//1 4//1\n";
  scene.actors[0].source = {};
  scene.actors[0].source.model = folder / "roof.obj";
  const auto normals = [&](std::optional<float> crease) {
    scene.actors[0].source.crease = crease;
    const auto loaded = load_models(scene, chain_objects(scene), false);
    EXPECT_TRUE(loaded.ok());
    return loaded->models[0].corner_normals;
  };
  for (const Vec3 n : normals(std::nullopt)) EXPECT_EQ(std::abs(n.y), 1) << "as in the file";
  const auto is_sharp = [](const std::vector<Vec3>& n) { return dot(n[1], n[6]) < 0.5f; };
  EXPECT_TRUE(is_sharp(normals(60.0f)));
  EXPECT_FALSE(is_sharp(normals(80.0f)));
  // Each face has its own normal, which is of length 1.
  for (const Vec3 n : normals(0.0f)) EXPECT_NEAR(dot(n, n), 1, 1e-5f);
}

TEST_F(SequenceTest, TheHashKnowsEverythingThatDecidesPixels) {
  const auto hash = [&] {
    const auto prepared = prepare_scene(scene, *make_cpu_engine(), {shared_cache()});
    EXPECT_TRUE(prepared.ok());
    return prepared.ok() ? prepared->hashes.scene : "";
  };
  const std::string before = hash();
  scene.description = "another word";
  scene.output.png = true;
  scene.output.file = "elsewhere.####.png";
  scene.path = fs::relative(scene.path);
  scene.output.png_bits = 16;
  EXPECT_EQ(hash(), before)
      << "neither words nor where frames go nor how the path is written change a pixel";
  scene.output = {};
  Image sky = make_image(4, 2, {"R", "G", "B"});
  ASSERT_TRUE(write_image(folder / "sky.exr", sky).ok());
  scene.lights.environment = folder / "sky.exr";
  const std::string with_sky = hash();
  EXPECT_NE(with_sky, before);
  sky.pixels[0] = 1;
  ASSERT_TRUE(write_image(folder / "sky.exr", sky).ok());
  EXPECT_NE(hash(), with_sky) << "the environment's content counts, not its name";
}

TEST_F(SequenceTest, PngFramesAreSkippedWhenCurrent) {
  auto s = settings({1, 2}, "f.####.exr");
  s.png = *parse_pattern((folder / "f.####.png").string());
  ASSERT_TRUE(render_sequence(scene, s, nullptr).ok());
  s.existing = Existing::kSkip;
  EXPECT_EQ(render_sequence(scene, s, nullptr)->count(FrameRecord::State::kSkipped), 2u);
  s.exr = {};
  EXPECT_EQ(render_sequence(scene, s, nullptr)->count(FrameRecord::State::kSkipped), 2u);
  fs::rename(folder / "f.0002.png", folder / "f.0001.png");
  EXPECT_EQ(render_sequence(scene, s, nullptr)->count(FrameRecord::State::kDone), 2u)
      << "frame 2 is not frame 1";
}

TEST_F(SequenceTest, BallsEncloseTheModelsVolumeAndFramesGoEvenlyBetween) {
  const auto engine = make_cpu_engine();
  Scene fine = scene;  // 32 cells lose 2 % of the flat puddle; the fit is exact on its own lattice
  fine.surface.resolution = 128;
  const auto exact = prepare_scene(fine, *engine, {shared_cache()});
  ASSERT_TRUE(exact.ok()) << exact.error().message;
  for (const auto& object : exact->actors[0].objects) {
    const double solid = solid_volume(object->model, InsideTest(object->model));
    EXPECT_NEAR(object->ball_volume / solid, 1, 0.004) << object->name;
    EXPECT_NEAR(object->distances.volume / solid, 1, 0.03) << object->name;
  }
  const auto prepared = prepare_scene(scene, *engine, {shared_cache()});
  ASSERT_TRUE(prepared.ok()) << prepared.error().message;
  for (int frame = 1; frame <= 14; ++frame) {
    const auto geometry = geometry_at(*prepared, *engine, frame);
    ASSERT_TRUE(geometry.ok());
    const MorphState& m = geometry->actors[0].moment;
    EXPECT_TRUE(!geometry->actors[0].points.empty() ||
                !geometry->actors[0].surface.triangles.empty())
        << "frame " << frame << " shows nothing";
    if (geometry->actors[0].surface.triangles.empty()) continue;
    const MeshReport report = check_mesh(geometry->actors[0].surface);
    EXPECT_TRUE(report.is_closed()) << frame;
    EXPECT_EQ(report.degenerate_triangles, 0u) << frame;
    if (m.stage != Stage::kVolume) continue;
    const ObjectList& objects = prepared->actors[0].objects;
    const double from = objects[static_cast<std::size_t>(m.leg)]->distances.volume,
                 to = objects[static_cast<std::size_t>(m.leg) + 1]->distances.volume;
    const double wanted = (1 - static_cast<double>(m.u)) * from + static_cast<double>(m.u) * to;
    EXPECT_NEAR(report.volume / wanted, 1, 0.03) << frame;
  }
}

TEST_F(SequenceTest, PixelsDoNotDependOnThreadsOrderCacheOrNeighbours) {
  const auto run = [&](SequenceSettings s, int threads, const fs::path& cache) {
    set_thread_count(threads);
    s.cache_folder = cache;
    const auto report = render_sequence(scene, s, nullptr);
    EXPECT_TRUE(report.ok()) << (report.ok() ? "" : report.error().message);
    return report.ok() ? *report : RunReport{};
  };
  const fs::path cache = folder / "cache";
  const RunReport cold = run(settings({3, 7, 11}, "a.####.exr"), 1, cache);
  const RunReport warm = run(settings({11, 7, 3}, "b.####.exr"), 2, cache);
  const RunReport alone = run(settings({7}, "c.####.exr"), 2, {});
  for (const char* frame : {"0003", "0007", "0011"})
    EXPECT_EQ(digest(std::string("a.") + frame + ".exr"),
              digest(std::string("b.") + frame + ".exr"))
        << frame;
  EXPECT_EQ(digest("a.0007.exr"), digest("c.0007.exr"));
  EXPECT_NE(digest("a.0007.exr"), digest("a.0011.exr"));
  EXPECT_EQ(cold.frames[1].digest, alone.frames[0].digest);
  EXPECT_EQ(cold.frames[0].digest, warm.frames[2].digest);
  EXPECT_FALSE(cold.frames[1].digest.empty());
}

TEST_F(SequenceTest, ExistingFramesAreRefusedSkippedOrReplaced) {
  auto s = settings({1, 2}, "f.####.exr");
  ASSERT_TRUE(render_sequence(scene, s, nullptr).ok());
  const auto refused = render_sequence(scene, s, nullptr);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kOutput);
  EXPECT_NE(refused.error().message.find("--skip-existing"), std::string::npos);
  s.existing = Existing::kSkip;
  EXPECT_EQ(render_sequence(scene, s, nullptr)->count(FrameRecord::State::kSkipped), 2u);
  fs::remove(folder / "f.0002.exr");
  const auto resumed = render_sequence(scene, s, nullptr);
  EXPECT_EQ(resumed->count(FrameRecord::State::kSkipped), 1u);
  EXPECT_EQ(resumed->count(FrameRecord::State::kDone), 1u);
  scene.look.roughness = 0.5f;  // the files are now of another scene
  EXPECT_EQ(render_sequence(scene, s, nullptr)->count(FrameRecord::State::kDone), 2u);
}

TEST_F(SequenceTest, ADamagedFrameIsNotTakenForFinished) {
  auto s = settings({1}, "f.####.exr");
  ASSERT_TRUE(render_sequence(scene, s, nullptr).ok());
  const std::string bytes = *read_file(folder / "f.0001.exr");
  ASSERT_TRUE(
      write_file(folder / "f.0001.exr", std::string_view(bytes).substr(0, bytes.size() / 2)).ok());
  s.existing = Existing::kSkip;
  EXPECT_EQ(render_sequence(scene, s, nullptr)->count(FrameRecord::State::kDone), 1u);
}

TEST_F(SequenceTest, DryRunWritesNothingAndSaysWhatIsMissing) {
  auto s = settings({1, 2}, "f.####.exr");
  s.dry_run = true;
  const auto report = render_sequence(scene, s, nullptr);
  ASSERT_TRUE(report.ok());
  EXPECT_EQ(report->count(FrameRecord::State::kPlanned), 2u);
  EXPECT_FALSE(fs::exists(folder / "f.0001.exr"));
}

TEST_F(SequenceTest, AStopLeavesFinishedFramesWhole) {
  std::atomic<bool> stop{false};
  auto s = settings({1, 2, 3, 4, 5, 6, 7}, "f.####.exr");
  s.stop = &stop;
  const auto report =
      render_sequence(scene, s, [&](std::size_t, std::size_t, const FrameRecord&) { stop = true; });
  ASSERT_TRUE(report.ok());
  EXPECT_TRUE(report->stopped);
  EXPECT_FALSE(digest("f.0001.exr").empty());
  // Those that were traced or written at the time are finished, no more.
  EXPECT_FALSE(fs::exists(folder / "f.0007.exr"));
  for (const FrameRecord& record : report->frames)
    EXPECT_EQ(record.state, FrameRecord::State::kDone) << record.frame;
}

TEST_F(SequenceTest, TheSamePicturesHoweverManyFramesAtOnce) {
  const std::vector<int> frames{2, 5, 6, 7, 9};
  ASSERT_TRUE(render_sequence(scene, settings(frames, "a.####.exr"), nullptr).ok());
  auto several = settings(frames, "b.####.exr");
  several.jobs = 3;
  std::vector<int> order;
  ASSERT_TRUE(render_sequence(scene, several,
                              [&](std::size_t done, std::size_t of, const FrameRecord& last) {
                                EXPECT_EQ(done, order.size() + 1);
                                EXPECT_EQ(of, frames.size());
                                order.push_back(last.frame);
                              })
                  .ok());
  EXPECT_EQ(order, frames) << "told in their order";
  for (const int frame : frames)
    EXPECT_EQ(digest(fmt::format("a.{:04}.exr", frame)), digest(fmt::format("b.{:04}.exr", frame)));
}

/// Three devices, which are the CPU each time: a GPU is not needed to share a film. Where there is
/// one, two contexts of it do so as well.
TEST_F(SequenceTest, TheSamePicturesByHoweverManyDevices) {
  const std::vector<int> frames{2, 5, 6, 7, 9};
  ASSERT_TRUE(render_sequence(scene, settings(frames, "a.####.exr"), nullptr).ok());
  std::vector<std::string> lists{"cpu,cpu,cpu"};
  if (!list_cuda_devices().devices.empty())
    lists.insert(lists.end(), {"cuda:0,cuda:0", "cpu,cuda:0", "cuda:all"});
  for (const std::string& list : lists) {
    auto shared = settings(frames, "b.####.exr");
    shared.device = list;
    shared.jobs = 0;
    shared.existing = Existing::kOverwrite;
    const auto report = render_sequence(scene, shared, nullptr);
    ASSERT_TRUE(report.ok()) << report.error().message;
    EXPECT_TRUE(list == "cuda:all" || report->device == list) << report->device;
    for (const FrameRecord& record : report->frames) {
      EXPECT_GT(record.triangles, 0u);
      EXPECT_GT(record.surface_seconds, 0);
    }
    for (const int frame : frames)
      EXPECT_EQ(digest(fmt::format("a.{:04}.exr", frame)),
                digest(fmt::format("b.{:04}.exr", frame)))
          << list;
  }
}

TEST(ListDevices, KnowsListsAndNamesOfAll) {
  EXPECT_EQ(*list_devices("auto"), std::vector<std::string>{"auto"});
  EXPECT_EQ(*list_devices("cuda:0,cuda:1"), (std::vector<std::string>{"cuda:0", "cuda:1"}));
  EXPECT_EQ(list_devices("cuda:0,").error().code, ErrorCode::kUsage);
  const std::size_t gpus = list_cuda_devices().devices.size();
  const auto all = list_devices("cuda:all");
  EXPECT_EQ(all.ok(), gpus > 0);
  if (all.ok())
    EXPECT_EQ(all->size(), gpus);
  else
    EXPECT_EQ(all.error().code, ErrorCode::kResource);
}

TEST_F(SequenceTest, LayersShowHowPointsMoveAndWhatTheyBecome) {
  scene.image.aovs = "all";
  scene.image.width = 96;
  scene.image.height = 72;
  ASSERT_TRUE(render_sequence(scene, settings({6, 7, 14}, "f.####.exr"), nullptr).ok());
  const auto image = read_image(folder / "f.0006.exr"), last = read_image(folder / "f.0014.exr");
  ASSERT_TRUE(image.ok() && last.ok());
  double moving = 0, between = 0;
  const auto at = [](const Image& i, int x, int y, const char* name) {
    return i.at(x, y, i.find_channel(name));
  };
  for (int y = 0; y < 72; ++y)
    for (int x = 0; x < 96; ++x) {
      const float id = at(*image, x, y, "id");
      const float blend = at(*image, x, y, "morph.blend");
      EXPECT_GE(blend, 0);
      EXPECT_LE(blend, 1);
      EXPECT_EQ(at(*image, x, y, "label") >= 1, id >= 2) << "all that is no ground has a label";
      const float motion = std::hypot(at(*image, x, y, "motion.X"), at(*image, x, y, "motion.Y"));
      if (id <= 1) {
        EXPECT_EQ(motion, 0) << "the ground stands still";
      }
      moving += motion > 0.2f;
      between += blend > 0 && blend < 1;
      EXPECT_EQ(at(*last, x, y, "motion.X"), 0) << "nothing comes after the last frame";
    }
  EXPECT_GT(moving, 50);
  EXPECT_GT(between, 50);
}

TEST(MakeEngine, KnowsItsDevices) {
  std::string chosen;
  EXPECT_TRUE(make_engine("cpu", chosen).ok());
  EXPECT_EQ(chosen, "cpu");
  for (const char* bad : {"gpu", "cuda:x", "cuda:-1", ""})
    EXPECT_EQ(make_engine(bad, chosen).error().code, ErrorCode::kUsage) << bad;
  const auto cuda = make_engine("cuda:900", chosen);
  ASSERT_FALSE(cuda.ok()) << "no machine has 901 devices";
  EXPECT_EQ(cuda.error().code, ErrorCode::kResource);
}

TEST_F(SequenceTest, EveryFieldMorphsFromAClosedSurfaceToAnother) {
  const auto engine = make_cpu_engine();
  scene.spheres.balls = scene.actors[0].source.spheres.balls =
      scene.actors[0].target.spheres.balls = 30;
  scene.actors[0].intermediate.clear();
  for (const FieldKind kind :
       {FieldKind::kGaussian, FieldKind::kWyvill, FieldKind::kInverseSquare}) {
    for (const BoundaryMethod boundary :
         {BoundaryMethod::kProject, BoundaryMethod::kBlend, BoundaryMethod::kCrossfade}) {
      scene.field.kind = kind;
      scene.boundary.method = boundary;
      const auto prepared = prepare_scene(scene, *engine, {shared_cache()});
      ASSERT_TRUE(prepared.ok()) << prepared.error().message;
      for (const auto& object : prepared->actors[0].objects)
        EXPECT_NEAR(object->ball_volume / solid_volume(object->model, InsideTest(object->model)), 1,
                    0.03)
            << object->name;
      for (const int frame : {2, 3, 7, 12, 13}) {
        const auto geometry = geometry_at(*prepared, *engine, frame);
        ASSERT_TRUE(geometry.ok()) << geometry.error().message;
        if (geometry->actors[0].surface.triangles.empty()) continue;
        EXPECT_TRUE(check_mesh(geometry->actors[0].surface).is_closed()) << frame;
        EXPECT_EQ(geometry->actors[0].look.layers.at(0).materials->all().triangle_materials.size(),
                  geometry->actors[0].surface.triangles.size());
      }
    }
  }
}

/// The step from the model's mesh to the balls' surface and back cannot be seen: where the mesh has
/// arrived, no point of either surface is far from the other.
TEST(Handover, IsWithinAThousandthOfTheModel) {
  for (const char* name : {"teapot", "penguin", "monkey", "torus"}) {
    for (const char* method : {"project", "blend"}) {
      Scene scene;
      scene.path = source_dir() / "scenes/test.json";
      scene.actors[0].source.name = name;
      scene.actors[0].source.model = source_dir() / "scenes/models" / (name + std::string(".obj"));
      scene.actors[0].source.spheres.balls = 128;
      scene.actors[0].target.name = scene.actors[0].target.shape = "sphere";
      scene.actors[0].target.spheres.balls = 4;
      scene.boundary.method =
          method == std::string("blend") ? BoundaryMethod::kBlend : BoundaryMethod::kProject;
      scene.frames.count = 400;
      scene.actors[0].target.motion.interpolate = Interpolation::kBalls;
      const auto engine = make_cpu_engine();
      const auto prepared = prepare_scene(scene, *engine, {shared_cache()});
      ASSERT_TRUE(prepared.ok()) << prepared.error().message;
      int last = 1;  // of the boundary stage
      while (morph_state_at(prepared->actors[0].timeline, last + 1).object == 0) ++last;
      const auto before = geometry_at(*prepared, *engine, last);
      const auto after = geometry_at(*prepared, *engine, last + 1);
      ASSERT_TRUE(before.ok() && after.ok());
      const std::string what = fmt::format("{} {}", name, method);
      const bool projected =
          std::holds_alternative<Projection>(prepared->actors[0].objects[0]->boundary);
      EXPECT_EQ(projected, std::string(method) == "project") << what;
      const Model& model = prepared->actors[0].objects[0]->model;
      const ClosestPointQuery mesh =
          projected ? ClosestPointQuery(before->actors[0].points, model.triangles)
                    : ClosestPointQuery(before->actors[0].surface.positions,
                                        before->actors[0].surface.triangles);
      const float size = model.box().diagonal();
      double sum = 0;
      float largest = 0;
      for (const ClosestPoint& p : mesh.closest(after->actors[0].surface.positions)) {
        sum += static_cast<double>(p.distance);
        largest = std::max(largest, p.distance);
      }
      EXPECT_LT(sum / static_cast<double>(after->actors[0].surface.positions.size()),
                0.001 * static_cast<double>(size))
          << what;
      EXPECT_LT(largest, 0.02f * size) << what;
    }
  }
}

}  // namespace
}  // namespace polymorph
