// Engine: marching cubes on metaball fields and distance fields, on the CPU or with CUDA. This is
// the host interface of the kernels; the passes themselves are in backend_engine.h, once for both
// backends. What only a device can fail at comes back as a status, not an exception.
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
  /// A Gaussian ball is dropped where it contributes less than this fraction of iso. 1e-12..0.1.
  float cutoff = 1e-4f;
  /// Steps on the field along a grid edge after the linear interpolation; one is exact for a lone
  /// Gaussian ball. 0..4.
  int refine_steps = 1;
  SurfaceMethod method = SurfaceMethod::kMarchingCubes;
  Placement placement = Placement::kRoot;
  /// No normals: every triangle is flat, as in the report's marching cubes.
  bool flat = false;
  /// Cells between the points at which the field is computed; it is interpolated linearly between
  /// them (the report's influence resolution, 5.2.3.1). Above 1, vertices are not refined. 1..16.
  int sample_stride = 1;
  /// False: the mesh stays on the device and is lost with the next call; for measuring. The CPU
  /// backend writes straight into the mesh and ignores this.
  bool download = true;
};

enum class EngineCode : std::uint8_t {
  kOk,
  kBuiltWithout,
  kNoDevice,
  kOutOfMemory,
  kDeviceError,
  kBadInput
};

struct EngineStatus {
  EngineCode code = EngineCode::kOk;
  std::string message;  ///< error, cause and remedy; empty when ok
};

/// Seconds spent in each pass of the last call, in order.
struct PassTime {
  const char* name = "";
  double seconds = 0;
};

/// One backend with its work buffers, which stay between frames. Not shared between threads.
class Engine {
 public:
  virtual ~Engine() = default;

  /// Extracts the surface `field = iso` of the balls on `grid` into `mesh` (replaced).
  /// The mesh is closed, manifold and consistently oriented for any input; beyond the grid's border
  /// the field counts as outside, so where the surface leaves the grid it is closed by a flat cut,
  /// 1/512 of a cell outside. Vertices and triangles come brick by brick (tree.h), in a brick by
  /// row (bricks.h), the same on every backend and for any number of threads.
  /// No balls, or none that reaches iso: an empty mesh and kOk. kBadInput: NaN or infinite balls, a
  /// <= 0 or a shape that is not positive definite (but for kInverseSquare), settings out of range,
  /// more than 2^20 balls, a surface of 2^32 - 1 vertices or more, or a grid with fewer than 2 or
  /// more than 2^20 points along an axis, or further from the origin than half a million cells
  /// (float cannot tell its points apart).
  virtual EngineStatus extract(const BallSet& balls, const Grid& grid,
                               const ExtractSettings& settings, Mesh& mesh) = 0;

  /// Extracts the surface between two objects, where their mixed distance equals the level times
  /// its weight (morph_field.h); otherwise as for balls. Ignores the settings `field`, `iso`,
  /// `cutoff` and `sample_stride`. Call with the same objects frame by frame: an engine keeps them
  /// on its device. The regression's lattice must reach a node beyond the grid on every side.
  virtual EngineStatus extract(const MorphSurface& between, const Grid& grid,
                               const ExtractSettings& settings, Mesh& mesh) = 0;

  /// Extracts the surface of one object's distances, where they are 0 (positive inside); between
  /// the points of `object` they are trilinear (distance_field.h). Any field of values will do that
  /// is not positive on the border and keeps its `lipschitz`. Otherwise as for a MorphSurface.
  virtual EngineStatus extract(const std::shared_ptr<const DistanceGrid>& object, const Grid& grid,
                               const ExtractSettings& settings, Mesh& mesh) = 0;

  /// Field values at arbitrary points (no culling for kInverseSquare, `cutoff` culling for
  /// kGaussian): bit for bit what extract() compares with iso at a grid point, or, for
  /// kInverseSquare, on the same side of iso as that. `values` is resized to points.size().
  virtual EngineStatus sample(const BallSet& balls, const std::vector<Vec3>& points,
                              const ExtractSettings& settings, std::vector<float>& values) = 0;

  /// Moves the balls to a moment of their paths and returns them in `balls`, one per path. Balls
  /// and paths stay on the device: call with the same object frame by frame. `eased_times`: each
  /// ball's eased time, or empty where they share the moment's. kBadInput: `eased_times` of another
  /// size, a part that is not there.
  virtual EngineStatus move_balls(const std::shared_ptr<const BallPaths>& paths,
                                  const MotionState& moment, const std::vector<float>& eased_times,
                                  BallSet& balls) = 0;

  /// Interpolates the balls' attributes at arbitrary points: the mean of their values there,
  /// weighted by each ball's share of the field (docs/method.md, Colour). Balls with less than 1e-4
  /// of the strongest one's share do not count; a point that none reaches takes the nearest ball's
  /// values. `carried`: one or two per ball, ball by ball; `values` is resized to as many per
  /// point. Fastest where neighbours follow each other in `points`, as a mesh's vertices do. Only
  /// the setting `field` matters. kBadInput as extract(), and where `carried` is of another size.
  virtual EngineStatus interpolate(const BallSet& balls, const std::vector<BallAttribute>& carried,
                                   const std::vector<Vec3>& points, const ExtractSettings& settings,
                                   std::vector<AttributeValues>& values) = 0;

  /// Evaluates the regression at points within its lattice: `maps` values per point. kBadInput: no
  /// samples, values of another size, a lattice of less than 4 nodes per side.
  virtual EngineStatus regress(const std::shared_ptr<const Regression>& regression,
                               const std::vector<Vec3>& points,
                               std::vector<AttributeValues>& values) = 0;

  /// Bytes that work buffers and mesh may take from now on, of the machine (CPU) or of the device;
  /// 0 = no limit. A call that needs more ends with kOutOfMemory.
  virtual void limit_memory(std::size_t /*bytes*/) {}

  virtual std::vector<PassTime> pass_times() const = 0;
  /// Bytes held by the buffers, and on the CPU by the mesh of the last call.
  virtual std::size_t memory_used() const { return 0; }
};

/// Instructions of the CPU backend; surfaces are the same bits with all of them.
enum class CpuIsa : std::uint8_t {
  kBest,      ///< the best that build and processor have
  kBaseline,  ///< those that the program is compiled for
  kAvx512,
};

/// CPU backend; runs in the caller's TBB arena. Null where `isa` is kAvx512 and build or processor
/// is without it.
std::unique_ptr<Engine> make_cpu_engine(CpuIsa isa = CpuIsa::kBest);

/// CUDA backend on device `index`. Null, with `status` saying why, when polymorph was built without
/// CUDA or no such device answers.
std::unique_ptr<Engine> make_cuda_engine(int index, EngineStatus& status);

}  // namespace polymorph
