// The same bits from any number of threads, after flush-to-zero, and from the CPU and CUDA
// backends.
#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <cstring>
#include <vector>

#include "kernels/backend_engine.h"
#include "kernels/ball_passes.h"
#include "kernels/cpu_backend.h"
#include "kernels/devices.h"
#include "kernels/level_set_passes.h"
#include "kernels/motion_passes.h"
#include "testing/backend.h"
#include "testing/between.h"
#include "testing/mesh.h"

namespace polymorph {
namespace {

/// Random balls; of a field with shapes also the same as ellipsoids, of one of infinite support
/// also weaker ones, of which some take away: many small surfaces with most balls distant.
std::vector<std::vector<Ball>> ball_sets(int count, FieldKind field, unsigned seed) {
  std::vector<std::vector<Ball>> sets = {random_balls(count, field, seed)};
  if (field != FieldKind::kInverseSquare) {
    sets.push_back(squeezed(sets[0], seed));
  } else {
    sets.push_back(with_holes(sets[0]));
    for (Ball& ball : sets[1]) ball.w *= 20 / static_cast<float>(count + 20);
  }
  return sets;
}

/// What the balls carry to some points, two quadruples each.
std::vector<AttributeValues> blended(Engine& engine, const std::vector<Ball>& balls,
                                     FieldKind field) {
  std::vector<BallAttribute> carried(2 * balls.size());
  for (std::size_t i = 0; i < carried.size(); ++i)
    for (int k = 0; k < 4; ++k) {
      const float number = static_cast<float>(i % 97) - 40, of = static_cast<float>(k + 1);
      carried[i].value[k] = number / of;
      carried[i].slope[k] = {of, number * 0.1f, -of};
    }
  std::vector<Vec3> points;
  for (const Ball& ball : random_balls(5003, field, 77)) points.push_back(ball.center * 1.2f);
  ExtractSettings settings;
  settings.field = field;
  std::vector<AttributeValues> values;
  const EngineStatus status = engine.interpolate(balls, carried, points, settings, values);
  EXPECT_EQ(status.code, EngineCode::kOk) << status.message;
  EXPECT_EQ(values.size(), 2 * points.size());
  return values;
}

void expect_same_values(const std::vector<AttributeValues>& a,
                        const std::vector<AttributeValues>& b) {
  ASSERT_EQ(a.size(), b.size());
  EXPECT_EQ(std::memcmp(a.data(), b.data(), a.size() * sizeof(AttributeValues)), 0);
}

Mesh extract_with_threads(int threads, FieldKind field) {
  const tbb::global_control control(tbb::global_control::max_allowed_parallelism,
                                    static_cast<std::size_t>(threads));
  tbb::task_arena arena(threads);
  Mesh mesh;
  arena.execute([&] {
    ExtractSettings settings;
    settings.field = field;
    const auto engine = make_cpu_engine();
    const EngineStatus status =
        engine->extract(random_balls(80, field, 5), cube_grid(71, 1.6f), settings, mesh);
    EXPECT_EQ(status.code, EngineCode::kOk) << status.message;
  });
  return mesh;
}

TEST(Determinism, any_number_of_threads_gives_the_same_bits) {
  for (const FieldKind field : kFieldKinds) {
    const Mesh one = extract_with_threads(1, field);
    ASSERT_FALSE(one.triangles.empty());
    for (int threads : {2, 3, 7}) expect_same_mesh(extract_with_threads(threads, field), one);
  }
}

/// Surfaces and maps between two objects, for every kind of map.
struct BetweenCase {
  MorphSurface surface;
  Grid grid;
};
std::vector<BetweenCase> between_cases() {
  std::vector<BetweenCase> cases;
  const auto torus = torus_distances(1, 0.3f), sphere = sphere_distances(0.8f, {0.2f, 0, 0});
  for (const bool sloped : {false, true})
    for (const int samples : {7, 300})
      for (const bool thin : {false, true}) {
        auto map = std::make_shared<Regression>(
            *random_map(samples, 0.3f, static_cast<unsigned>(samples), sloped));
        MorphSurface surface = {map, torus, sphere, 1.1f, 0.9f, 0.03f};
        if (thin) {
          map->thinness[0] = sphere, map->thinness[1] = torus;
          surface.smooth_from = torus_distances(1, 0.22f);
          surface.smooth_to = sphere_distances(0.6f, {0.2f, 0, 0});
          surface.fade_to = {0, 0.8f};
        }
        cases.push_back({surface, cube_grid(sloped ? 91 : 127, 1.7f)});
      }
  for (const int landmarks : {1, 9}) {
    auto map = std::make_shared<Regression>(
        *map_with_landmarks(*random_map(300, 0.3f, 31, true), landmarks, 0.2f, 32));
    map->thinness[0] = sphere, map->thinness[1] = torus;
    cases.push_back({{map, torus, sphere, 1.1f, 0.9f, 0.03f}, cube_grid(91, 1.7f)});
  }
  return cases;
}
void expect_same_between(Engine& a, Engine& b) {
  std::vector<Vec3> points;
  for (const Ball& ball : random_balls(2003, FieldKind::kGaussian, 78))
    points.push_back(ball.center * 1.3f);
  for (const BetweenCase& at : between_cases()) {
    ExtractSettings settings;
    settings.refine_steps = 2;
    Mesh one, other;
    ASSERT_EQ(a.extract(at.surface, at.grid, settings, one).code, EngineCode::kOk);
    ASSERT_EQ(b.extract(at.surface, at.grid, settings, other).code, EngineCode::kOk);
    ASSERT_FALSE(one.triangles.empty());
    expect_same_mesh(one, other);
    ASSERT_EQ(a.extract(at.surface.from, at.grid, settings, one).code, EngineCode::kOk);
    ASSERT_EQ(b.extract(at.surface.from, at.grid, settings, other).code, EngineCode::kOk);
    ASSERT_FALSE(one.triangles.empty());
    expect_same_mesh(one, other);
    std::vector<AttributeValues> values, others;
    ASSERT_EQ(a.regress(at.surface.map, points, values).code, EngineCode::kOk);
    ASSERT_EQ(b.regress(at.surface.map, points, others).code, EngineCode::kOk);
    expect_same_values(values, others);
  }
}

/// The passes as a GPU thread sees them, one point at a time and down from many roots, without a
/// GPU.
struct ScalarBackend : BasicCpuBackend<float> {
  static constexpr bool kManyRoots = true;
};

/// Grids of 4096 points along one axis, thin along the others, and 65 536 balls along them: what
/// counts and indices have to hold.
struct LongCase {
  std::vector<Ball> balls;
  Grid grid;
};
std::vector<LongCase> long_cases() {
  std::vector<LongCase> cases;
  constexpr float kCell = 0.01f, kHalf = 20.475f;
  for (int axis = 0; axis < 3; ++axis) {
    LongCase at = {random_balls(65536, FieldKind::kGaussian, 90 + static_cast<unsigned>(axis)), {}};
    const Vec3 size = axis == 0   ? Vec3{kHalf, 0.06f, 0.045f}
                      : axis == 1 ? Vec3{0.045f, kHalf, 0.06f}
                                  : Vec3{0.06f, 0.045f, kHalf};
    for (Ball& ball : at.balls) {
      // Some are off the grid; they are small enough to leave holes.
      ball.center = 1.1f * (ball.center * size);
      ball.a = 4 / (0.014f * 0.014f), ball.w = 1;
    }
    at.grid = {-size, kCell, {13, 13, 13}};
    (axis == 0 ? at.grid.points.x : axis == 1 ? at.grid.points.y : at.grid.points.z) = 4096;
    cases.push_back(at);
  }
  return cases;
}
void expect_same_long_surfaces(Engine& a, Engine& b) {
  for (const LongCase& at : long_cases()) {
    Mesh one, other;
    ASSERT_EQ(a.extract(at.balls, at.grid, {}, one).code, EngineCode::kOk);
    ASSERT_EQ(b.extract(at.balls, at.grid, {}, other).code, EngineCode::kOk);
    EXPECT_GT(one.triangles.size(), std::size_t{100000});
    expect_same_mesh(one, other);
  }
}

class InstructionsTest : public testing::TestWithParam<CpuIsa> {};

TEST_P(InstructionsTest, one_point_at_a_time_gives_the_bits_of_packs) {
  BackendEngine<ScalarBackend> scalar;
  const auto lanes = make_cpu_engine(GetParam());
  if (lanes == nullptr) GTEST_SKIP() << "not these instructions";
  expect_same_between(scalar, *lanes);
  for (const FieldKind field : kFieldKinds) {
    ExtractSettings settings;
    settings.field = field;
    settings.refine_steps = 2;
    for (const std::vector<Ball>& balls : ball_sets(150, field, 31)) {
      Mesh one, packs;
      ASSERT_EQ(scalar.extract(balls, cube_grid(83, 1.6f), settings, one).code, EngineCode::kOk);
      ASSERT_EQ(lanes->extract(balls, cube_grid(83, 1.6f), settings, packs).code, EngineCode::kOk);
      ASSERT_FALSE(one.triangles.empty());
      expect_same_mesh(one, packs);
      expect_same_values(blended(scalar, balls, field), blended(*lanes, balls, field));
    }
  }
}

TEST_P(InstructionsTest, every_way_to_draw_the_samples_has_the_same_bits) {
  BackendEngine<ScalarBackend> scalar;
  const auto lanes = make_cpu_engine(GetParam());
  if (lanes == nullptr) GTEST_SKIP() << "not these instructions";
  const std::vector<Ball> balls = random_balls(150, FieldKind::kGaussian, 32);
  // The border cuts the balls on every side; the last grid has bricks that end beyond it.
  const Grid grid = {{-0.9f, -0.8f, -0.7f}, 0.017f, {100, 94, 83}};
  ExtractSettings matrix, midpoint, coarse;
  matrix.method = SurfaceMethod::kMatrix;
  midpoint.placement = Placement::kMidpoint;
  coarse.sample_stride = 3;
  for (const ExtractSettings& settings : {ExtractSettings{}, matrix, midpoint, coarse}) {
    Mesh one, packs;
    ASSERT_EQ(scalar.extract(balls, grid, settings, one).code, EngineCode::kOk);
    ASSERT_EQ(lanes->extract(balls, grid, settings, packs).code, EngineCode::kOk);
    ASSERT_FALSE(one.triangles.empty());
    expect_same_mesh(one, packs);
  }
}

TEST_P(InstructionsTest, long_grids_of_many_balls_have_the_same_bits) {
  BackendEngine<ScalarBackend> scalar;
  const auto lanes = make_cpu_engine(GetParam());
  if (lanes == nullptr) GTEST_SKIP() << "not these instructions";
  expect_same_long_surfaces(scalar, *lanes);
}

INSTANTIATE_TEST_SUITE_P(Determinism, InstructionsTest,
                         testing::Values(CpuIsa::kBaseline, CpuIsa::kAvx512), [](const auto& isa) {
                           return isa.param == CpuIsa::kAvx512 ? "avx512" : "baseline";
                         });

TEST(Determinism, flush_to_zero_left_by_a_renderer_changes_nothing) {
  const auto extract = [] {
    // Weak, wide balls at a tiny iso: their contributions come near the smallest normal floats.
    ExtractSettings settings;
    settings.iso = 1e-20f;
    settings.cutoff = 1e-12f;
    std::vector<Ball> balls = random_balls(40, FieldKind::kGaussian, 9);
    for (Ball& ball : balls) ball.w -= 46.0517f;  // ln 1e20
    Mesh mesh;
    const auto engine = make_cpu_engine();
    EXPECT_EQ(engine->extract(balls, cube_grid(50, 1.6f), settings, mesh).code, EngineCode::kOk);
    return mesh;
  };
  const Mesh plain = extract();
  ASSERT_FALSE(plain.triangles.empty());
  const DenormalMode saved = denormal_register();
  set_denormal_register(saved | kFlushMode);
  const Mesh flushed = extract();
  const DenormalMode after = denormal_register();
  set_denormal_register(saved);
  EXPECT_EQ(after & kFlushMode, kFlushMode) << "the caller's mode is not ours to change";
  expect_same_mesh(flushed, plain);
}

class ParityTest : public testing::TestWithParam<FieldKind> {};

TEST_P(ParityTest, cuda_gives_the_bits_of_the_cpu) {
  EngineStatus status;
  const auto cuda = make_cuda_engine(0, status);
  PM_SKIP_WITHOUT(cuda, status);
  const auto cpu = make_cpu_engine();
  struct Case {
    int balls, points, refine_steps;
    float iso, cutoff;
  };
  unsigned seed = 100;
  for (const Case& c :
       {Case{1, 20, 0, 1, 1e-4f}, Case{40, 33, 1, 1, 1e-4f}, Case{200, 75, 2, 0.5f, 1e-3f},
        Case{1000, 130, 1, 1, 1e-4f}, Case{60, 64, 4, 3, 1e-6f}}) {
    SCOPED_TRACE(testing::Message() << c.balls << " balls, " << c.points << " points");
    ExtractSettings settings;
    settings.field = GetParam();
    settings.iso = c.iso;
    settings.cutoff = c.cutoff;
    settings.refine_steps = c.refine_steps;
    ++seed;
    for (const std::vector<Ball>& balls : ball_sets(c.balls, GetParam(), seed)) {
      const Grid grid = cube_grid(c.points, 1.55f);
      Mesh from_cpu, from_cuda;
      ASSERT_EQ(cpu->extract(balls, grid, settings, from_cpu).code, EngineCode::kOk);
      status = cuda->extract(balls, grid, settings, from_cuda);
      ASSERT_EQ(status.code, EngineCode::kOk) << status.message;
      expect_same_mesh(from_cuda, from_cpu);
      std::vector<Vec3> points;
      for (const Ball& ball : random_balls(10007, GetParam(), seed + 50))
        points.push_back(ball.center * 1.6f);
      std::vector<float> cpu_values, cuda_values;
      ASSERT_EQ(cpu->sample(balls, points, settings, cpu_values).code, EngineCode::kOk);
      ASSERT_EQ(cuda->sample(balls, points, settings, cuda_values).code, EngineCode::kOk);
      EXPECT_TRUE(same_bits(cpu_values, cuda_values));
      expect_same_values(blended(*cuda, balls, GetParam()), blended(*cpu, balls, GetParam()));
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Cuda, ParityTest, testing::ValuesIn(kFieldKinds),
                         [](const testing::TestParamInfo<FieldKind>& field) {
                           return std::string(field_name(field.param));
                         });

TEST(CudaDownload, every_number_of_values_arrives) {
  EngineStatus status;
  const auto cuda = make_cuda_engine(0, status);
  PM_SKIP_WITHOUT(cuda, status);
  const std::vector<Ball> balls = random_balls(3, FieldKind::kGaussian, 5);
  // The last is larger than the pinned memory, whose chunks are then used several times.
  constexpr std::size_t kMost = 9'000'001;
  std::vector<Vec3> points(kMost);
  for (std::size_t i = 0; i < kMost; ++i) points[i].x = 1e-7f * static_cast<float>(i);
  std::vector<float> all;
  ASSERT_EQ(make_cpu_engine()->sample(balls, points, {}, all).code, EngineCode::kOk);
  std::vector<std::size_t> sizes = {65'537, 1'000'003, kMost};
  for (std::size_t n = 1; n < 1100; n += 3) sizes.push_back(n);
  for (const std::size_t n : sizes) {
    std::vector<float> values;
    status = cuda->sample(balls, {points.begin(), points.begin() + static_cast<std::ptrdiff_t>(n)},
                          {}, values);
    ASSERT_EQ(status.code, EngineCode::kOk) << status.message;
    ASSERT_EQ(values.size(), n);
    ASSERT_EQ(std::memcmp(values.data(), all.data(), n * sizeof(float)), 0) << n << " values";
  }
}

TEST(CudaParityBetween, cuda_gives_the_bits_of_the_cpu) {
  EngineStatus status;
  const auto cuda = make_cuda_engine(0, status);
  PM_SKIP_WITHOUT(cuda, status);
  expect_same_between(*cuda, *make_cpu_engine());
}

TEST(CudaParityLong, cuda_gives_the_bits_of_the_cpu) {
  EngineStatus status;
  const auto cuda = make_cuda_engine(0, status);
  PM_SKIP_WITHOUT(cuda, status);
  expect_same_long_surfaces(*cuda, *make_cpu_engine());
}

TEST(Devices, the_list_agrees_with_what_can_be_made) {
  const DeviceList list = list_cuda_devices();
  EngineStatus status;
  EXPECT_EQ(make_cuda_engine(0, status) != nullptr, !list.devices.empty()) << status.message;
  EXPECT_EQ(status.code == EngineCode::kBuiltWithoutCuda, !list.built_with_cuda);
  EXPECT_EQ(list.runtime.empty(), !list.built_with_cuda);
  EXPECT_EQ(list.driver.empty(), !list.built_with_cuda);
}

TEST(Devices, an_index_that_is_not_there_says_why) {
  EngineStatus status;
  EXPECT_EQ(make_cuda_engine(4711, status), nullptr);
  EXPECT_NE(status.code, EngineCode::kOk);
  EXPECT_FALSE(status.message.empty());
}

}  // namespace
}  // namespace polymorph
