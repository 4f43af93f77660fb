// Balls of every kind, close to each other, on grids that cut through them: the mesh is closed and
// manifold, and the same bits with one point at a time as with eight.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string_view>
#include <type_traits>

#include "base/result.h"
#include "kernels/backend_engine.h"
#include "kernels/ball_passes.h"
#include "kernels/cpu_backend.h"
#include "kernels/level_set_passes.h"
#include "kernels/motion_passes.h"
#include "mesh/mesh_check.h"

using namespace polymorph;

namespace {

/// Takes numbers off the input; zeros when it has ended.
class Bytes {
 public:
  Bytes(const std::uint8_t* data, std::size_t size) : data_(data), left_(size) {}
  bool ended() const { return left_ == 0; }
  std::uint8_t byte() {
    if (left_ == 0) return 0;
    --left_;
    return *data_++;
  }
  /// In [low, high], on a coarse lattice: balls that touch exactly are worth more than noise.
  float number(float low, float high) {
    return low + (high - low) * static_cast<float>(byte()) / 255;
  }

 private:
  const std::uint8_t* data_;
  std::size_t left_;
};

struct ScalarBackend : BasicCpuBackend<float> {
  static constexpr bool kManyRoots = true;
};

template <class T>
bool same_bits(const std::vector<T>& a, const std::vector<T>& b) {
  static_assert(std::is_trivially_copyable_v<T>);
  return a.size() == b.size() &&
         (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Bytes in(data, size);
  ExtractSettings settings;
  settings.field = static_cast<FieldKind>(in.byte() % 3);
  settings.refine_steps = in.byte() % 5;
  settings.sample_stride = 1 + in.byte() % 3;
  settings.placement = in.byte() % 2 ? Placement::kRoot : ExtractSettings().placement;
  settings.iso = std::ldexp(1.0f, in.byte() % 16 - 8);
  const int points = 2 + in.byte() % 18;
  const float edge = in.number(0.5f, 3);
  const Grid grid{{-edge, -edge, -edge},
                  2 * edge / static_cast<float>(points - 1),
                  {points, 2 + in.byte() % 18, 2 + in.byte() % 18}};
  std::vector<Ball> balls;
  while (!in.ended() && balls.size() < 64) {
    Ball ball;
    ball.center = {in.number(-2, 2), in.number(-2, 2), in.number(-2, 2)};
    ball.a = std::ldexp(1.0f, in.byte() % 16 - 8);
    ball.w = in.number(-8, 8);
    if (in.byte() % 2) {
      ball.shape.xx = in.number(0.1f, 4);
      ball.shape.yy = in.number(0.1f, 4);
      ball.shape.zz = in.number(0.1f, 4);
      ball.shape.xy = in.number(-0.05f, 0.05f);
    }
    balls.push_back(ball);
  }
  Mesh eight, one;
  const EngineStatus status = make_cpu_engine()->extract(balls, grid, settings, eight);
  BackendEngine<ScalarBackend> scalar;
  PM_CHECK(scalar.extract(balls, grid, settings, one).code == status.code);
  if (status.code != EngineCode::kOk) return 0;
  PM_CHECK(same_bits(eight.positions, one.positions));
  PM_CHECK(same_bits(eight.normals, one.normals));
  PM_CHECK(same_bits(eight.triangles, one.triangles));
  PM_CHECK(check_mesh(eight).is_manifold());
  for (const Vec3 p : eight.positions) PM_CHECK(std::isfinite(p.x + p.y + p.z));
  return 0;
}
