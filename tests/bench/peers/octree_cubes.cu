// A sparse marching cubes baseline on the GPU beside the CUDA engine, in one run and by turns: an
// octree whose nodes are kept where a Lipschitz bound lets the surface pass, down to single cells,
// and then those cells, each by one thread. It is what a program gets that samples its field at
// points and knows how fast that changes (as NVIDIA Warp's examples do), written plainly: every
// sample is the sum over all balls, vertices are not shared, and there are no normals.
//
//   octree_cubes [POINTS [TURNS]]    n points along an axis (256), repetitions (9)
#include <cuda_runtime.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <vector>

#include "base/random.h"
#include "kernels/engine.h"
#include "kernels/field_kinds.h"
#include "kernels/mc_tables.h"

namespace polymorph {
namespace {

constexpr int kRootCells = 64, kThreads = 128;
constexpr float kIso = 1, kCutoff = 1e-4f;

void check(cudaError_t error) {
  if (error != cudaSuccess) throw std::runtime_error(cudaGetErrorString(error));
}

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

/// exp(w - a d^2) up to a d^2 = end.
struct Sample {
  Vec3 center;
  float a, w, end;
};

/// A case's triangles by the corners inside (corner i in bit i: x, y, z): for each of their
/// vertices the lower corner of its edge and the edge's axis.
struct Cases {
  unsigned char count[256], low[256][15], axis[256][15];
};

Cases make_cases() {
  Cases out = {};
  for (int corners = 0; corners < 256; ++corners) {
    int key = 0;
    for (int c = 0; c < 8; ++c) key |= (corners >> c & 1) != 0 ? corner_weight(c) : 0;
    out.count[corners] = static_cast<unsigned char>(mc_table().count[key]);
    for (int i = 0; i < 3 * out.count[corners]; ++i) {
      const int e = mc_table().edges[key][i];
      out.low[corners][i] = static_cast<unsigned char>(edge_low_corner(e));
      out.axis[corners][i] = static_cast<unsigned char>(edge_axis(e));
    }
  }
  return out;
}

__device__ float field_at(const Sample* balls, int count, Vec3 p) {
  float sum = 0;
  for (int i = 0; i < count; ++i) {
    const Vec3 d = p - balls[i].center;
    const float q = balls[i].a * dot(d, d);
    if (q <= balls[i].end) sum += __expf(balls[i].w - q);
  }
  return sum;
}

/// Is |field - iso| at the node's middle at most as large as the field can change from there to a
/// corner, `reach` away: by the sum of the balls' largest slopes within that distance?
__device__ bool may_cross(const Sample* balls, int count, Vec3 middle, float reach) {
  float sum = 0, slope = 0;
  for (int i = 0; i < count; ++i) {
    const Vec3 d = middle - balls[i].center;
    const float distance = sqrtf(dot(d, d)), steepest = rsqrtf(2 * balls[i].a);
    const float at = fminf(fmaxf(steepest, distance - reach), distance + reach);
    sum += __expf(balls[i].w - balls[i].a * distance * distance);
    slope += 2 * balls[i].a * at * __expf(balls[i].w - balls[i].a * at * at);
  }
  return fabsf(sum - kIso) <= slope * reach;
}

/// The eight children of each node that may hold surface; a node is its lowest cell.
__global__ void subdivide(const Sample* balls, int count, Grid grid, int cells, const Int3* nodes,
                          const unsigned* node_count, Int3* children, unsigned* child_count) {
  const unsigned n = 8 * *node_count;
  for (unsigned i = blockIdx.x * blockDim.x + threadIdx.x; i < n; i += gridDim.x * blockDim.x) {
    const Int3 node = nodes[i / 8];
    const Int3 at = {node.x + static_cast<int>(i & 1) * cells,
                     node.y + static_cast<int>(i >> 1 & 1) * cells,
                     node.z + static_cast<int>(i >> 2 & 1) * cells};
    if (at.x >= grid.points.x - 1 || at.y >= grid.points.y - 1 || at.z >= grid.points.z - 1)
      continue;
    const float half = 0.5f * static_cast<float>(cells) * grid.cell;
    const Vec3 middle = grid_point(grid, at) + Vec3{half, half, half};
    if (may_cross(balls, count, middle, 1.7320508f * half))
      children[atomicAdd(child_count, 1u)] = at;
  }
}

__global__ void emit(const Sample* balls, int count, Grid grid, const Cases* cases,
                     const Int3* cells, const unsigned* cell_count, Vec3* vertices,
                     unsigned* triangle_count, unsigned capacity) {
  for (unsigned i = blockIdx.x * blockDim.x + threadIdx.x; i < *cell_count;
       i += gridDim.x * blockDim.x) {
    float value[8];
    int corners = 0;
    for (int c = 0; c < 8; ++c) {
      const Int3 at = {cells[i].x + (c & 1), cells[i].y + (c >> 1 & 1), cells[i].z + (c >> 2)};
      value[c] = field_at(balls, count, grid_point(grid, at));
      corners |= (value[c] > kIso ? 1 : 0) << c;
    }
    const unsigned made = cases->count[corners], first = atomicAdd(triangle_count, made);
    if (first + made > capacity) return;
    for (unsigned v = 0; v < 3 * made; ++v) {
      const int low = cases->low[corners][v], axis = cases->axis[corners][v];
      const float a = value[low], b = value[low + (1 << axis)], t = (kIso - a) / (b - a);
      const Int3 at = {cells[i].x + (low & 1), cells[i].y + (low >> 1 & 1),
                       cells[i].z + (low >> 2)};
      const float along = t * grid.cell;
      vertices[3 * first + v] =
          grid_point(grid, at) +
          Vec3{axis == 0 ? along : 0.0f, axis == 1 ? along : 0.0f, axis == 2 ? along : 0.0f};
    }
  }
}

double seconds(const std::chrono::steady_clock::time_point& start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

struct Octree {
  explicit Octree(const std::vector<Ball>& balls, int n) : count(static_cast<int>(balls.size())) {
    std::vector<Sample> samples;
    for (const Ball& ball : balls)
      samples.push_back({ball.center, ball.a, ball.w, GaussianField::end(ball, kCutoff)});
    const Cases table = make_cases();
    // About twice the cells that a torus of this size has.
    capacity = static_cast<unsigned>(32 * static_cast<std::int64_t>(n) * n);
    check(cudaMalloc(&all, samples.size() * sizeof(Sample)));
    check(cudaMalloc(&cases, sizeof(Cases)));
    check(cudaMalloc(&nodes[0], capacity * sizeof(Int3)));
    check(cudaMalloc(&nodes[1], capacity * sizeof(Int3)));
    check(cudaMalloc(&vertices, 3 * std::size_t{capacity} * sizeof(Vec3)));
    check(cudaMalloc(&counts, 16 * sizeof(unsigned)));
    check(cudaMemcpy(all, samples.data(), samples.size() * sizeof(Sample), cudaMemcpyHostToDevice));
    check(cudaMemcpy(cases, &table, sizeof(Cases), cudaMemcpyHostToDevice));
    const int roots = (n - 1 + kRootCells - 1) / kRootCells;
    for (int i = 0; i < roots * roots * roots; ++i)
      first.push_back(
          {i % roots * kRootCells, i / roots % roots * kRootCells, i / roots / roots * kRootCells});
  }
  /// Returns the triangles made.
  unsigned run(const Grid& grid) {
    unsigned host[16] = {static_cast<unsigned>(first.size())};
    check(cudaMemcpy(counts, host, sizeof host, cudaMemcpyHostToDevice));
    check(cudaMemcpy(nodes[0], first.data(), first.size() * sizeof(Int3), cudaMemcpyHostToDevice));
    int level = 0;
    for (int cells = kRootCells / 2; cells > 0; cells /= 2, ++level)
      subdivide<<<2048, kThreads>>>(all, count, grid, cells, nodes[level % 2], counts + level,
                                    nodes[(level + 1) % 2], counts + level + 1);
    emit<<<2048, kThreads>>>(all, count, grid, cases, nodes[level % 2], counts + level, vertices,
                             counts + level + 1, capacity);
    check(cudaGetLastError());
    check(cudaMemcpy(host, counts, sizeof host, cudaMemcpyDeviceToHost));
    if (host[level] > capacity || host[level + 1] > capacity)
      throw std::runtime_error("more cells or triangles than there is room for");
    return host[level + 1];
  }

  int count;
  unsigned capacity = 0;
  std::vector<Int3> first;
  Sample* all = nullptr;
  Cases* cases = nullptr;
  Int3* nodes[2] = {};
  Vec3* vertices = nullptr;
  unsigned* counts = nullptr;
};

void measure(int n, int turns) {
  const std::vector<Ball> balls = torus_balls(1032);
  const Grid grid = {{-1.9f, -1.9f, -1.9f}, 3.8f / static_cast<float>(n - 1), {n, n, n}};
  EngineStatus status;
  const auto engine = make_cuda_engine(0, status);
  if (!engine) throw std::runtime_error(status.message);
  ExtractSettings settings;
  Mesh mesh;
  (void)engine->extract(balls, grid, settings, mesh);
  settings.download = false;
  Octree octree(balls, n);
  std::vector<double> times[2];
  unsigned triangles = 0;
  const BallSet set = balls;
  Mesh none;
  for (int turn = 0; turn < turns + 1; ++turn) {
    auto start = std::chrono::steady_clock::now();
    (void)engine->extract(set, grid, settings, none);
    const double engine_time = seconds(start);
    start = std::chrono::steady_clock::now();
    triangles = octree.run(grid);
    if (turn > 0) times[0].push_back(engine_time), times[1].push_back(seconds(start));
  }
  const char* names[] = {"polymorph: shared vertices and normals", "octree, then cells: triangles"};
  std::printf("%d^3, %d turns\n%-42s %10s %10s %12s\n", n, turns, "", "median ms", "least ms",
              "triangles");
  for (int i = 0; i < 2; ++i) {
    std::sort(times[i].begin(), times[i].end());
    std::printf("%-42s %10.3f %10.3f %12zu\n", names[i], 1e3 * times[i][times[i].size() / 2],
                1e3 * times[i][0], i == 0 ? mesh.triangles.size() : std::size_t{triangles});
  }
}

}  // namespace
}  // namespace polymorph

int main(int argc, char** argv) {
  const int points = argc > 1 ? std::atoi(argv[1]) : 256, turns = argc > 2 ? std::atoi(argv[2]) : 9;
  if (points < 8 || points > 1024 || turns < 1) {
    std::fputs("usage: octree_cubes [POINTS (8 to 1024) [TURNS]]\n", stderr);
    return 2;
  }
  try {
    polymorph::measure(points, turns);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    return 1;
  }
  return 0;
}
