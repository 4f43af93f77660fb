// Engine: marching cubes on metaball fields and distance fields, on the CPU or with CUDA. This is
// the host interface of the kernels; the passes themselves are in backend_engine.h, once for both
// backends. Bad input and failures of memory or device are returned as a status, never thrown.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "ball_paths.h"
#include "ball_set.h"
#include "mesh.h"
#include "morph_surface.h"
#include "types.h"

namespace polymorph {

/// Settings of sampling and of vertex placement.
struct ExtractSettings {
  FieldKind field = FieldKind::kGaussian;
  /// Surface at field = iso; inside is field > iso. 1e-20..1e20.
  float iso = 1.0f;
  /// A Gaussian ball ends where it contributes less than this fraction of iso. 1e-12..0.1.
  float cutoff = 1e-4f;
  /// Steps of root finding along a grid edge after the linear interpolation; one step is exact for
  /// a single Gaussian ball. 0..4.
  int refine_steps = 1;
  SurfaceMethod method = SurfaceMethod::kMarchingCubes;
  Placement placement = Placement::kRoot;
  /// True: no normals, so that every triangle is flat, as in the report's marching cubes.
  bool flat = false;
  /// The field is computed at every sample_stride-th point along each axis and interpolated
  /// linearly between these points (the report's influence resolution, 5.2.3.1). Above 1, vertices
  /// are not refined. 1..16.
  int sample_stride = 1;
  /// False: the mesh stays on the device and is lost with the next call; for measurements. The CPU
  /// backend writes directly into the mesh and ignores this.
  bool download = true;
  /// If true, pass_times() can be called afterwards. On a GPU no pass then starts before the one
  /// before it has ended, which costs 0.01 ms.
  bool time_passes = false;
};

enum class EngineCode : std::uint8_t {
  kOk,
  kBuiltWithoutCuda,  ///< the program was built without CUDA
  kNoDevice,
  kOutOfMemory,
  kDeviceError,
  kBadInput
};

struct EngineStatus {
  EngineCode code = EngineCode::kOk;
  std::string message;  ///< error, cause and remedy; empty when ok
};

/// Time that one pass of the last call took.
struct PassTime {
  const char* name = "";
  double seconds = 0;
};

/// One backend with its work buffers, which are kept between frames. Threads must not share one.
class Engine {
 public:
  virtual ~Engine() = default;

  /// Extracts the surface `field = iso` of the balls on `grid` into `mesh` (replaced).
  /// The mesh is closed, manifold and consistently oriented for any input. All points beyond the
  /// grid count as outside, so where the surface leaves the grid, a flat cut closes it, 1/512 of a
  /// cell beyond the border. Vertices and triangles are ordered by brick (tree.h), within a brick
  /// by row (bricks.h); their order is the same on every backend and for any number of threads. If
  /// there are no balls or none reaches iso, the mesh is empty (kOk). kBadInput: NaN or infinite
  /// balls, a <= 0 or a shape that is not positive definite (except for kInverseSquare), settings
  /// out of range, more than 2^20 balls, a surface of 2^32 - 1 vertices or more, or a grid with
  /// fewer than 2 or more than 2^20 points along an axis, or further from the origin than half a
  /// million cells (float cannot tell its points apart).
  virtual EngineStatus extract(const BallSet& balls, const Grid& grid,
                               const ExtractSettings& settings, Mesh& mesh) = 0;

  /// Extracts the surface between two objects, where their mixed distance equals the level times
  /// the level's weight at the point (c w in morph_field.h); everything else is as for balls.
  /// Ignores the settings `field`, `iso`, `cutoff` and `sample_stride`. Call with the same objects
  /// in every frame: an engine keeps them on its device. The regression's lattice must extend one
  /// node beyond the grid on every side.
  virtual EngineStatus extract(const MorphSurface& surface, const Grid& grid,
                               const ExtractSettings& settings, Mesh& mesh) = 0;

  /// Extracts the surface of one object's distances, where they are 0 (positive inside); between
  /// the points of `object` they are trilinear (distance_field.h). Values that are no distances are
  /// allowed, too, if none on the border is positive and DistanceGrid::lipschitz is a Lipschitz
  /// constant of them. Everything else is as for a MorphSurface.
  virtual EngineStatus extract(const std::shared_ptr<const DistanceGrid>& object, const Grid& grid,
                               const ExtractSettings& settings, Mesh& mesh) = 0;

  /// Computes field values at arbitrary points. A Gaussian ball ends at `cutoff`, a Wyvill ball at
  /// its support, an inverse-square ball nowhere. At a grid point the value has the bits that
  /// extract() compares with iso; for kInverseSquare it is at least on the same side of iso.
  /// `values` is resized to points.size().
  virtual EngineStatus sample(const BallSet& balls, const std::vector<Vec3>& points,
                              const ExtractSettings& settings, std::vector<float>& values) = 0;

  /// Moves the balls along their paths to `state` and returns them in `balls`, one per path. Balls
  /// and paths stay on the device: call with the same object in every frame. `eased_times`: each
  /// ball's eased time, or empty if all balls use MotionState::eased. kBadInput: `eased_times`
  /// of another size, or a ball whose part (PathPart) is not in the list.
  virtual EngineStatus move_balls(const std::shared_ptr<const BallPaths>& paths,
                                  const MotionState& state, const std::vector<float>& eased_times,
                                  BallSet& balls) = 0;

  /// Interpolates the balls' attributes at arbitrary points: the mean of their values there,
  /// weighted by each ball's share of the field (docs/method.md, Colour). Balls with less than 1e-4
  /// of the strongest ball's share do not count; a point that no ball reaches takes the nearest
  /// ball's values. `attributes`: one or two per ball, ball by ball; `values` is resized to as many
  /// per point. It is fastest if adjacent elements of `points` are neighbours, as a mesh's vertices
  /// are. Of the settings only `field` is used. kBadInput: as extract(), or `attributes` of another
  /// size.
  virtual EngineStatus interpolate(const BallSet& balls,
                                   const std::vector<BallAttribute>& attributes,
                                   const std::vector<Vec3>& points, const ExtractSettings& settings,
                                   std::vector<AttributeValues>& values) = 0;

  /// Evaluates the regression at points within its lattice. `values` is resized to Regression::maps
  /// per point. kBadInput: no samples, not `maps` values per sample, samples or landmarks that are
  /// not finite, or a lattice of less than 4 nodes per side.
  virtual EngineStatus regress(const std::shared_ptr<const Regression>& regression,
                               const std::vector<Vec3>& points,
                               std::vector<AttributeValues>& values) = 0;

  /// Limits the memory of work buffers and mesh from now on, in bytes, on the machine (CPU) or on
  /// the device (CUDA); 0: no limit. A call that needs more ends with kOutOfMemory.
  virtual void limit_memory(std::size_t /*bytes*/) {}

  /// Returns the time of each pass of the last call, in the order in which the passes first ran. A
  /// GPU measures them only if ExtractSettings::time_passes asked for it; else there are none.
  virtual std::vector<PassTime> pass_times() const = 0;
  /// Bytes held by the buffers, and on the CPU by the mesh of the last call.
  virtual std::size_t memory_used() const { return 0; }
};

/// Instruction set of the CPU backend; surfaces have the same bits with each.
enum class CpuIsa : std::uint8_t {
  kBest,      ///< the best that both build and processor support
  kBaseline,  ///< the one that the program is compiled for
  kAvx512,
};

/// Makes the CPU backend, which runs in the caller's TBB arena. Returns null if `isa` is kAvx512
/// and build or processor lacks it.
std::unique_ptr<Engine> make_cpu_engine(CpuIsa isa = CpuIsa::kBest);

/// Makes the CUDA backend on device `index`. Returns null, with the reason in `status`, if
/// polymorph was built without CUDA or no such device answers.
std::unique_ptr<Engine> make_cuda_engine(int index, EngineStatus& status);

}  // namespace polymorph
