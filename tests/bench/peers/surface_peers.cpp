// Isosurface peers beside the CPU engine, in one run and by turns: VTK's flying edges on a dense
// grid (BSD) and OpenVDB's volumeToMesh on a narrow band (MPL). Only measured against, never linked
// into the program.
//
//   surface_peers [POINTS [TURNS]]    n points along an axis (256), repetitions (5)
//
// All get the 1032 Gaussian balls of `polymorph bench surface` on [-1.9, 1.9]^3. What the peers
// mesh is sampled for them ball by ball on every grid point that the ball reaches, which is what a
// program around them would do, and timed by itself.
#include <openvdb/openvdb.h>
#include <openvdb/tools/Dense.h>
#include <openvdb/tools/VolumeToMesh.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <vtkCellArray.h>
#include <vtkDataArray.h>
#include <vtkFloatArray.h>
#include <vtkFlyingEdges3D.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkSMPTools.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "base/random.h"
#include "kernels/engine.h"
#include "kernels/field_kinds.h"

namespace polymorph {
namespace {

constexpr float kCutoff = 1e-4f;

/// The balls of `polymorph bench surface` (bench/bench_surface.cpp).
std::vector<Ball> torus_balls(int n) {
  constexpr double kPi = 3.14159265358979323846, kMinor = 0.4;
  const double spacing = std::sqrt(4 * kPi * kPi * kMinor / n);
  std::vector<Ball> balls;
  for (int i = 0; i < n; ++i) {
    const double u = 2 * kPi * i / n, v = 2 * kPi * std::fmod(i * 0.6180339887498949, 1.0);
    const double ring = 1 + kMinor * std::cos(v);
    const double random = static_cast<double>(random_float(1, 0, static_cast<std::uint64_t>(i)));
    balls.push_back(GaussianField::from_sphere(
        {static_cast<float>(ring * std::cos(u)), static_cast<float>(kMinor * std::sin(v)),
         static_cast<float>(ring * std::sin(u))},
        static_cast<float>(spacing * (0.85 + 0.3 * random)), {}));
  }
  return balls;
}

/// The field at every grid point, x first, by slabs of the grid.
void sample_dense(const std::vector<Ball>& balls, const Grid& grid, float* values) {
  const std::int64_t row = grid.points.x, layer = row * grid.points.y;
  tbb::parallel_for(tbb::blocked_range<int>(0, grid.points.z, 8), [&](const auto& slab) {
    std::fill(values + layer * slab.begin(), values + layer * slab.end(), 0.0f);
    std::vector<float> along_x(static_cast<std::size_t>(row));
    for (const Ball& ball : balls) {
      const float end = GaussianField::end(ball, kCutoff), reach = std::sqrt(end / ball.a);
      const auto first = [&](float center, float origin) {
        return std::max(0, static_cast<int>(std::ceil((center - reach - origin) / grid.cell)));
      };
      const auto last = [&](float center, float origin, int n) {
        return std::min(n - 1, static_cast<int>((center + reach - origin) / grid.cell));
      };
      const int x0 = first(ball.center.x, grid.origin.x),
                x1 = last(ball.center.x, grid.origin.x, grid.points.x),
                y0 = first(ball.center.y, grid.origin.y),
                y1 = last(ball.center.y, grid.origin.y, grid.points.y),
                z0 = std::max(slab.begin(), first(ball.center.z, grid.origin.z)),
                z1 = std::min(slab.end() - 1, last(ball.center.z, grid.origin.z, grid.points.z));
      const auto square = [&](int i, float origin, float center) {
        const float d = origin + grid.cell * static_cast<float>(i) - center;
        return ball.a * d * d;
      };
      if (z0 > z1) continue;
      for (int x = x0; x <= x1; ++x)
        along_x[static_cast<std::size_t>(x)] =
            std::exp(ball.w - square(x, grid.origin.x, ball.center.x));
      for (int z = z0; z <= z1; ++z)
        for (int y = y0; y <= y1; ++y) {
          const float yz =
              square(y, grid.origin.y, ball.center.y) + square(z, grid.origin.z, ball.center.z);
          const float factor = std::exp(-yz);
          float* to = values + row * y + layer * z;
          for (int x = x0; x <= x1; ++x) to[x] += factor * along_x[static_cast<std::size_t>(x)];
        }
    }
  });
}

double seconds(const std::function<void()>& run) {
  const auto start = std::chrono::steady_clock::now();
  run();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

struct Row {
  std::vector<double> times;
  std::size_t triangles = 0;
};

void measure(int n, int turns) {
  const std::vector<Ball> balls = torus_balls(1032);
  const Grid grid = {{-1.9f, -1.9f, -1.9f}, 3.8f / static_cast<float>(n - 1), {n, n, n}};
  std::map<std::string, Row> rows;
  const auto engine = make_cpu_engine();
  Mesh mesh;
  vtkNew<vtkFloatArray> values;
  values->SetNumberOfTuples(std::int64_t{n} * n * n);
  vtkNew<vtkImageData> image;
  image->SetDimensions(n, n, n);
  image->SetSpacing(grid.cell, grid.cell, grid.cell);
  image->SetOrigin(grid.origin.x, grid.origin.y, grid.origin.z);
  image->GetPointData()->SetScalars(values);
  for (int turn = 0; turn < turns; ++turn) {
    const auto add = [&](const char* name, double time, std::size_t triangles) {
      rows[name].times.push_back(time);
      rows[name].triangles = triangles;
    };
    const double whole = seconds([&] { (void)engine->extract(balls, grid, {}, mesh); });
    add("polymorph: field, surface and normals", whole, mesh.triangles.size());
    add("dense samples for the peers",
        seconds([&] { sample_dense(balls, grid, values->GetPointer(0)); }), 0);
    image->Modified();

    vtkNew<vtkFlyingEdges3D> edges;
    edges->SetInputData(image);
    edges->SetValue(0, 1);
    edges->ComputeNormalsOn();
    edges->ComputeGradientsOff();
    edges->ComputeScalarsOff();
    const double flying = seconds([&] { edges->Update(); });
    add("VTK flying edges: mesh and normals", flying,
        static_cast<std::size_t>(edges->GetOutput()->GetNumberOfPolys()));

    openvdb::FloatGrid::Ptr band;
    const double sparse = seconds([&] {
      // Far from the surface the values are constant, and become tiles.
      constexpr float kLow = 0.4f, kHigh = 2.5f;
      std::vector<float> clamped(static_cast<std::size_t>(n) * n * n);
      const float* from = values->GetPointer(0);
      tbb::parallel_for(tbb::blocked_range<std::size_t>(0, clamped.size(), 1 << 16),
                        [&](const auto& part) {
                          for (std::size_t i = part.begin(); i < part.end(); ++i)
                            clamped[i] = std::clamp(from[i], kLow, kHigh);
                        });
      using Dense = openvdb::tools::Dense<float, openvdb::tools::LayoutXYZ>;
      const Dense dense(openvdb::CoordBBox(openvdb::Coord(0), openvdb::Coord(n - 1)),
                        clamped.data());
      band = openvdb::FloatGrid::create(kLow);
      openvdb::tools::copyFromDense(dense, *band, 0.0f);
    });
    add("OpenVDB: narrow band of the samples", sparse, 0);
    std::vector<openvdb::Vec3s> points;
    std::vector<openvdb::Vec3I> triangles;
    std::vector<openvdb::Vec4I> quads;
    const double meshed =
        seconds([&] { openvdb::tools::volumeToMesh(*band, points, triangles, quads, 1.0); });
    add("OpenVDB volumeToMesh: mesh", meshed, triangles.size() + 2 * quads.size());
  }
  std::printf("%d^3, %d turns, VTK on %s\n%-42s %10s %10s %12s\n", n, turns,
              vtkSMPTools::GetBackend(), "", "median ms", "least ms", "triangles");
  for (auto& [name, row] : rows) {
    std::sort(row.times.begin(), row.times.end());
    std::printf("%-42s %10.2f %10.2f %12zu\n", name.c_str(), 1e3 * row.times[row.times.size() / 2],
                1e3 * row.times[0], row.triangles);
  }
}

}  // namespace
}  // namespace polymorph

int main(int argc, char** argv) {
  openvdb::initialize();
  vtkSMPTools::Initialize();
  const int points = argc > 1 ? std::atoi(argv[1]) : 256, turns = argc > 2 ? std::atoi(argv[2]) : 5;
  if (points < 8 || points > 1024 || turns < 1) {
    std::fputs("usage: surface_peers [POINTS (8 to 1024) [TURNS]]\n", stderr);
    return 2;
  }
  polymorph::measure(points, turns);
  return 0;
}
