#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cmath>
#include "base/parallel.h"
#include "model/load_obj.h"
#include "model/inside.h"
#include "model/shapes.h"
#include "spheres/boundary.h"
#include "spheres/medial.h"
#include "spheres/fit.h"
using namespace polymorph;
static double now() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }
int main(int argc, char** argv) {
  set_thread_count(0);
  const int n = std::atoi(argv[1]);
  const bool ell = std::atoi(argv[2]);
  const int rounds = std::atoi(argv[3]);
  const int its = std::atoi(argv[4]);
  for (int a = 5; a < argc; ++a) {
    LoadObjSettings ls; ls.textures = false;
    auto loaded = load_obj(argv[a], ls);
    if (!loaded) { std::printf("%s: %s\n", argv[a], loaded.error().message.c_str()); continue; }
    const Model& model = loaded->model;
    double t0 = now();
    InsideTest inside(model);
    const std::size_t P = std::max<std::size_t>(8000, 40 * n);
    auto samples = sample_boundary(model, inside, P);
    double t1 = now();
    auto spheres = medial_cover(samples, n);
    double t2 = now();
    auto fit = fit_balls(samples, inside, model.box(), spheres, {ell, its, rounds});
    double t3 = now();
    // IoU on a lattice; volume matched by shifting psi
    const int R = 96; Box box = model.box(); Vec3 sz = box.size(); float m = 0.03f * box.diagonal();
    std::vector<Vec3> pts; float cell = std::max({sz.x, sz.y, sz.z}) / R;
    for (float z = box.low.z - m; z < box.high.z + m; z += cell) for (float y = box.low.y - m; y < box.high.y + m; y += cell) for (float x = box.low.x - m; x < box.high.x + m; x += cell) pts.push_back({x, y, z});
    auto in = inside.inside(pts);
    std::vector<float> psi(pts.size());
    parallel_for(pts.size(), [&](std::int64_t i) { double s = 0; for (auto& b : fit.balls) { Vec3 d = pts[i] - b.center; float e = b.w - b.a * quadratic(b.shape, d); if (e > -15) s += std::exp(e); } psi[i] = std::log(std::max(s, 1e-30)); }, 1000);
    std::size_t vin = 0; for (auto v : in) vin += v;
    std::vector<float> sorted = psi; std::nth_element(sorted.begin(), sorted.begin() + vin, sorted.end(), std::greater<>());
    float level = sorted[vin];
    std::size_t i0 = 0, u0 = 0, i1 = 0, u1 = 0, v0 = 0;
    for (std::size_t i = 0; i < pts.size(); ++i) { bool f0 = psi[i] > 0, f1 = psi[i] > level; v0 += f0; i0 += f0 && in[i]; u0 += f0 || in[i]; i1 += f1 && in[i]; u1 += f1 || in[i]; }
    std::printf("%-44s tri %6zu samp %6zu sph %4zu | IoU %.4f vol %.4f | matched IoU %.4f level %.4f | rms %.3f%% | sample %.2f medial %.2f fit %.2f s\n", argv[a], model.triangles.size(), samples.size(), spheres.size(), double(i0) / u0, double(v0) / vin, double(i1) / u1, level, 100 * fit.rms / box.diagonal(), t1 - t0, t2 - t1, t3 - t2);
    std::fflush(stdout);
  }
}
