#include "render/device/bvh.h"

#include <array>
#include <memory>

#include "base/parallel.h"

namespace polymorph {
namespace {

constexpr unsigned kMaxLeaf = 4;

/// A node of Embree's builder with two children, or a leaf.
struct Built {
  Box boxes[2];
  const Built* children[2] = {nullptr, nullptr};
  unsigned count = 0;  ///< triangles of a leaf
  BvhTriangle triangles[kMaxLeaf];
};

Built* allocate(RTCThreadLocalAllocator allocator) {
  return new (rtcThreadLocalAlloc(allocator, sizeof(Built), 16)) Built;
}

void* make_node(RTCThreadLocalAllocator allocator, unsigned, void*) { return allocate(allocator); }
void* make_leaf(RTCThreadLocalAllocator allocator, const RTCBuildPrimitive* primitives,
                std::size_t count, void*) {
  Built* leaf = allocate(allocator);
  leaf->count = static_cast<unsigned>(count);
  for (std::size_t i = 0; i < count; ++i)
    leaf->triangles[i] = {primitives[i].geomID, primitives[i].primID};
  return leaf;
}
void set_children(void* node, void** children, unsigned count, void*) {
  for (unsigned i = 0; i < count; ++i)
    static_cast<Built*>(node)->children[i] = static_cast<const Built*>(children[i]);
}
void set_bounds(void* node, const RTCBounds** bounds, unsigned count, void*) {
  for (unsigned i = 0; i < count; ++i)
    static_cast<Built*>(node)->boxes[i] = {
        {bounds[i]->lower_x, bounds[i]->lower_y, bounds[i]->lower_z},
        {bounds[i]->upper_x, bounds[i]->upper_y, bounds[i]->upper_z}};
}

Box triangle_box(const MeshToTrace& traced, const Triangle& triangle) {
  Box box;
  for (const std::uint32_t v : triangle.v)
    box = extend(extend(box, traced.at(v, 0)), traced.at(v, 1));
  return box;
}

std::vector<RTCBuildPrimitive> list_primitives(const TracedScene& scene) {
  // 64 units in the last place of the longest ray; the test of a box errs by a few.
  const float pad = scene.slack() * 0x1p-4f;
  std::vector<RTCBuildPrimitive> primitives;
  for (std::uint32_t m = 0; m < scene.mesh_count(); ++m) {
    const MeshToTrace& traced = scene.mesh_to_trace(m);
    const std::size_t first = primitives.size(), count = traced.mesh->triangles.size();
    primitives.resize(first + count);
    parallel_for(
        static_cast<std::int64_t>(count),
        [&](std::int64_t i) {
          const Box box = triangle_box(traced, traced.mesh->triangles[static_cast<std::size_t>(i)]);
          const Vec3 low = box.low - Vec3{pad, pad, pad}, high = box.high + Vec3{pad, pad, pad};
          primitives[first + static_cast<std::size_t>(i)] = {
              low.x, low.y, low.z, m, high.x, high.y, high.z, static_cast<unsigned>(i)};
        },
        4096);
  }
  return primitives;
}

std::int32_t append(const Built& built, Bvh& bvh) {
  if (built.count > 0) {
    const auto first = static_cast<std::int32_t>(bvh.triangles.size());
    bvh.triangles.insert(bvh.triangles.end(), built.triangles, built.triangles + built.count);
    return ~((first << kLeafBits) | static_cast<std::int32_t>(built.count));
  }
  const std::size_t index = bvh.nodes.size();
  bvh.nodes.emplace_back();
  for (int i = 0; i < 2; ++i) {
    if (!built.children[i]) continue;
    const std::int32_t child = append(*built.children[i], bvh);
    bvh.nodes[index].boxes[i] = built.boxes[i];
    bvh.nodes[index].children[i] = child;
  }
  return static_cast<std::int32_t>(index);
}

}  // namespace

Result<Bvh> build_bvh(const RayDevice& device, const TracedScene& scene) {
  Bvh bvh;
  std::vector<RTCBuildPrimitive> primitives = list_primitives(scene);
  if (primitives.empty()) {
    bvh.nodes.emplace_back();
    return bvh;
  }
  const std::unique_ptr<RTCBVHTy, decltype(&rtcReleaseBVH)> builder(rtcNewBVH(device.device.get()),
                                                                    rtcReleaseBVH);
  RTCBuildArguments arguments = rtcDefaultBuildArguments();
  arguments.maxBranchingFactor = 2;
  arguments.maxDepth = kMaxBvhDepth;
  arguments.maxLeafSize = kMaxLeaf;
  arguments.bvh = builder.get();
  arguments.primitives = primitives.data();
  arguments.primitiveCount = primitives.size();
  arguments.primitiveArrayCapacity = primitives.size();
  arguments.createNode = make_node;
  arguments.setNodeChildren = set_children;
  arguments.setNodeBounds = set_bounds;
  arguments.createLeaf = make_leaf;
  const auto* root = static_cast<const Built*>(builder ? rtcBuildBVH(&arguments) : nullptr);
  PM_TRY_STATUS(take_device_error(device));
  if (!root) return make_error(ErrorCode::kResource, "embree builds no hierarchy");
  bvh.nodes.reserve(primitives.size());
  bvh.triangles.reserve(primitives.size());
  if (root->count > 0) {
    // A ray begins with a node.
    bvh.nodes.emplace_back();
    for (const RTCBuildPrimitive& p : primitives)
      bvh.nodes[0].boxes[0] = unite(bvh.nodes[0].boxes[0], {{p.lower_x, p.lower_y, p.lower_z},
                                                            {p.upper_x, p.upper_y, p.upper_z}});
    bvh.nodes[0].children[0] = append(*root, bvh);
    return bvh;
  }
  append(*root, bvh);
  return bvh;
}

}  // namespace polymorph
