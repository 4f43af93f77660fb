// Construction of a scene's hierarchy (bvh.h) on a GPU.
#pragma once

#include <cub/device/device_radix_sort.cuh>
#include <cub/device/device_scan.cuh>

#include "render/device/cuda_memory.cuh"
#include "render/device/device_frame.h"

namespace polymorph {

inline constexpr int kThreads = 128;
inline unsigned block_count(std::size_t threads) {
  return static_cast<unsigned>((threads + kThreads - 1) / kThreads);
}

namespace hierarchy {

__device__ inline int thread_index() {
  return static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
}

/// Arrays of a hierarchy under construction, in device memory.
struct Arrays {
  BvhTriangle *unsorted, *triangles;  ///< in the meshes' order, and in the order along the curve
  std::uint32_t *positions, *sorted_positions;  ///< curve_position() of each triangle
  std::uint32_t *order, *sorted_order;          ///< index in `unsorted` of each position
  BvhCluster* clusters[2];                      ///< before and after a round, in turn
  int* nearest;                                 ///< nearest_cluster() of each cluster
  unsigned long long* slots;  ///< per cluster, and one for the end; see count_slots()
  BvhNode* nodes;
};

/// Computes the curve position of each triangle of a mesh, whose triangles begin at index `first`.
__global__ void __launch_bounds__(kThreads)
    place_triangles(const __grid_constant__ DeviceScene scene, std::uint32_t mesh, int first,
                    int count, Arrays arrays) {
  const int i = thread_index();
  if (i >= count) return;
  const BvhTriangle triangle{mesh, static_cast<std::uint32_t>(i)};
  arrays.unsorted[first + i] = triangle;
  arrays.order[first + i] = static_cast<std::uint32_t>(first + i);
  arrays.positions[first + i] = curve_position(scene.triangle_box(triangle).center(), scene.bounds);
}

/// Makes a cluster of each triangle, in sorted order.
__global__ void __launch_bounds__(kThreads)
    make_leaves(const __grid_constant__ DeviceScene scene, int count, Arrays arrays) {
  const int i = thread_index();
  if (i >= count) return;
  const BvhTriangle triangle = arrays.unsorted[arrays.sorted_order[i]];
  arrays.triangles[i] = triangle;
  arrays.clusters[0][i] = {scene.triangle_box(triangle), ~i};
}

__global__ void __launch_bounds__(kThreads)
    find_nearest(const BvhCluster* clusters, int count, int* nearest) {
  const int i = thread_index();
  if (i < count) nearest[i] = nearest_cluster(clusters, count, i);
}

/// Sets the addends of a prefix sum: the lower 32 bits count the clusters that remain after the
/// round, the upper 32 bits the nodes that merging makes.
__global__ void __launch_bounds__(kThreads)
    count_slots(const int* nearest, int count, int round, unsigned long long* slots) {
  const int i = thread_index();
  if (i > count) return;
  const int partner = i < count ? merge_partner(nearest, count, i, round) : -1;
  const bool remains = i < count && !(partner >= 0 && partner < i);
  slots[i] = (remains ? 1ull : 0) | (remains && partner >= 0 ? 1ull << 32 : 0);
}

/// Merges each cluster with its partner, and writes the clusters that remain. `slots`: prefix sums
/// of count_slots().
__global__ void __launch_bounds__(kThreads)
    merge_clusters(const BvhCluster* clusters, const int* nearest, int count, int round,
                   const unsigned long long* slots, int node_count, BvhNode* nodes,
                   BvhCluster* merged) {
  const int i = thread_index();
  if (i >= count) return;
  const int partner = merge_partner(nearest, count, i, round);
  if (partner >= 0 && partner < i) return;
  BvhCluster cluster = clusters[i];
  if (partner >= 0) {
    const BvhCluster other = clusters[partner];
    const int node = node_count + static_cast<int>(slots[i] >> 32);
    nodes[node] = {{cluster.box, other.box}, {cluster.node, other.node}};
    cluster = {unite(cluster.box, other.box), node};
  }
  merged[static_cast<std::uint32_t>(slots[i])] = cluster;
}

}  // namespace hierarchy

/// Builds hierarchies, in memory that it keeps for the next one.
class CudaHierarchy {
 public:
  /// Builds the hierarchy of a packed scene, and sets its nodes, triangles and root.
  /// `triangle_counts`: number of triangles per mesh.
  cudaError_t build(const std::vector<std::size_t>& triangle_counts, cudaStream_t stream,
                    DeviceScene& scene) {
    std::size_t count = 0;
    for (const std::size_t triangles : triangle_counts) count += triangles;
    hierarchy::Arrays arrays{};
    if (const cudaError_t error = reserve(count, arrays)) return error;
    int first = 0;
    for (std::uint32_t m = 0; m < triangle_counts.size(); ++m) {
      const int triangles = static_cast<int>(triangle_counts[m]);
      if (triangles == 0) continue;
      hierarchy::place_triangles<<<block_count(triangle_counts[m]), kThreads, 0, stream>>>(
          scene, m, first, triangles, arrays);
      first += triangles;
    }
    int node_count = 0;
    if (count > 0) {
      std::size_t bytes = scratch_.size();
      const int n = static_cast<int>(count);
      cub::DeviceRadixSort::SortPairs(scratch_.data(), bytes, arrays.positions,
                                      arrays.sorted_positions, arrays.order, arrays.sorted_order, n,
                                      0, 30, stream);  // a position has 30 bits
      hierarchy::make_leaves<<<block_count(count), kThreads, 0, stream>>>(scene, n, arrays);
      if (const cudaError_t error = merge(n, stream, arrays, node_count)) return error;
    }
    if (count == 1) {  // traversal begins at a node
      const BvhNode node{{scene.bounds, scene.bounds}, {~0, ~0}};
      cudaMemcpyAsync(arrays.nodes, &node, sizeof node, cudaMemcpyHostToDevice, stream);
      node_count = 1;
    }
    scene.nodes = {arrays.nodes, static_cast<std::size_t>(node_count)};
    scene.triangles = {arrays.triangles, count};
    scene.root = node_count - 1;
    return cudaGetLastError();
  }

 private:
  /// Allocates memory for `count` triangles, and places the arrays in it one after the other, each
  /// aligned to 256 bytes.
  cudaError_t reserve(std::size_t count, hierarchy::Arrays& arrays) {
    std::size_t size = 0;
    const auto assign = [&](auto*& array, std::size_t items) {
      array = reinterpret_cast<std::remove_reference_t<decltype(array)>>(memory_.data() + size);
      size += (items * sizeof *array + 255) / 256 * 256;
    };
    for (int pass = 0; pass < 2; ++pass) {  // the first pass only finds the size
      size = 0;
      assign(arrays.nodes, count);
      assign(arrays.triangles, count);
      assign(arrays.unsorted, count);
      assign(arrays.positions, count);
      assign(arrays.sorted_positions, count);
      assign(arrays.order, count);
      assign(arrays.sorted_order, count);
      assign(arrays.clusters[0], count);
      assign(arrays.clusters[1], count);
      assign(arrays.nearest, count);
      assign(arrays.slots, count + 1);
      if (const cudaError_t error = memory_.reserve(size)) return error;
    }
    std::size_t sort_bytes = 0, scan_bytes = 0;
    const int n = static_cast<int>(count);
    cub::DeviceRadixSort::SortPairs(nullptr, sort_bytes, arrays.positions, arrays.sorted_positions,
                                    arrays.order, arrays.sorted_order, n);
    cub::DeviceScan::ExclusiveSum(nullptr, scan_bytes, arrays.slots, arrays.slots, n + 1);
    if (const cudaError_t error = total_.reserve(sizeof(unsigned long long))) return error;
    return scratch_.reserve(std::max(sort_bytes, scan_bytes));
  }

  /// Merges clusters in rounds until one is left.
  cudaError_t merge(int count, cudaStream_t stream, const hierarchy::Arrays& arrays,
                    int& node_count) {
    for (int round = 0; count > 1; ++round) {
      const BvhCluster* clusters = arrays.clusters[round % 2];
      const auto threads = static_cast<std::size_t>(count);
      hierarchy::find_nearest<<<block_count(threads), kThreads, 0, stream>>>(clusters, count,
                                                                             arrays.nearest);
      hierarchy::count_slots<<<block_count(threads + 1), kThreads, 0, stream>>>(
          arrays.nearest, count, round, arrays.slots);
      std::size_t bytes = scratch_.size();
      cub::DeviceScan::ExclusiveSum(scratch_.data(), bytes, arrays.slots, arrays.slots, count + 1,
                                    stream);
      hierarchy::merge_clusters<<<block_count(threads), kThreads, 0, stream>>>(
          clusters, arrays.nearest, count, round, arrays.slots, node_count, arrays.nodes,
          arrays.clusters[(round + 1) % 2]);
      auto& total = *reinterpret_cast<unsigned long long*>(total_.data());
      cudaMemcpyAsync(&total, arrays.slots + count, sizeof total, cudaMemcpyDeviceToHost, stream);
      if (const cudaError_t error = cudaStreamSynchronize(stream)) return error;
      count = static_cast<int>(total & 0xffffffffu);
      node_count += static_cast<int>(total >> 32);
    }
    return cudaSuccess;
  }

  DeviceMemory memory_, scratch_;
  HostMemory total_;
};

}  // namespace polymorph
