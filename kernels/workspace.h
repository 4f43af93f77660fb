// Work buffers of an engine, and the backend that they belong to. The buffers only grow, so that
// frames after the first rarely allocate memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "ball_paths.h"
#include "ball_set.h"
#include "bricks.h"
#include "engine.h"
#include "falloff.h"
#include "far_field.h"
#include "meet_landmarks.h"
#include "morph_surface.h"
#include "regression.h"
#include "tree.h"
#include "types.h"
#include "view.h"

namespace polymorph {

/// Element of Workspace::totals that holds the mesh's numbers of vertices and triangles.
constexpr int kMeshTotal = kMaxLevels;

/// The buffers of all passes. Between calls, only the contents that an `uploaded_...` member or
/// `has_table` describes stay valid.
template <class B>
struct Workspace {
  template <class T>
  using Buffer = typename B::template Buffer<T>;

  explicit Workspace(B own_backend) : backend(std::move(own_backend)) {}

  B backend;

  // Moving balls (ball_paths.h).
  Buffer<BallPath> paths;
  Buffer<PathPart> parts;
  Buffer<PartPose> poses;
  Buffer<float> eased_times;
  std::shared_ptr<const BallPaths> uploaded_paths;  ///< contents of `paths` and `parts`

  // Balls as they are given, and balls as the kernels read them.
  Buffer<Ball> raw_balls;
  BallSet uploaded_balls;  ///< contents of raw_balls; empty: unknown
  Buffer<RoundBall> round_balls;
  Buffer<EllipsoidBall> ellipsoids;
  Buffer<std::uint32_t> all_balls;  ///< 0, 1, 2, ...: the list of all balls' indices

  // Points and attributes of the caller.
  Buffer<Vec3> points;
  Buffer<float> point_values;
  Buffer<BallAttribute> attributes;
  Buffer<AttributeValues> attribute_values;

  // Regression (regression.h).
  Buffer<KernelSample> kernel_samples;
  Buffer<float> lattice_nodes;
  Buffer<std::uint32_t> regressed_nodes;                  ///< RegressNodes::listed
  std::shared_ptr<const Regression> uploaded_regression;  ///< contents of lattice_nodes
  Buffer<Strain> strain[2];  ///< read and written in turn by a CPU's passes; a GPU writes one
  Buffer<Vec3> landmark_positions;
  Buffer<AttributeValues> landmark_values;
  Buffer<LandmarkTerm> landmark_terms;

  /// A distance grid in backend memory.
  struct UploadedDistances {
    std::shared_ptr<const DistanceGrid> object;  ///< contents of `values`; null: unknown
    Buffer<float> buffer;
    View<float> values;
  };
  /// Grids in order of use, the most recently used at the end.
  std::vector<std::unique_ptr<UploadedDistances>> uploaded_distances;

  // The tree (tree.h). The index is the level or, where only two levels are needed at a time,
  // level % 2.
  Buffer<Node> nodes[kMaxLevels];
  Buffer<std::uint32_t> entries[2];
  Buffer<FarField> far[2];
  Buffer<Counts> node_counts[2];  ///< children and entries per node
  Buffer<std::uint32_t> child_entries;
  /// Prefix sums of node_counts, each node's first child and entry, where a scan computes them.
  Buffer<Offsets> first;

  /// Element `level`: the level's numbers of nodes and entries; element kMeshTotal: the mesh's
  /// numbers of vertices and triangles.
  Buffer<Offsets> totals_buffer;
  View<Offsets> totals;

  // Bricks (bricks.h).
  Buffer<BrickTable> table;
  bool has_table = false;  ///< whether `table` holds brick_table()
  Buffer<float> values;
  Buffer<std::uint8_t> inside;
  Buffer<std::uint32_t> rows;
  Buffer<Counts> brick_counts;
  Buffer<Offsets> brick_first;

  // The mesh, unless the backend writes into the caller's memory.
  Buffer<Vec3> positions, normals;
  Buffer<Triangle> triangles;
};

}  // namespace polymorph
