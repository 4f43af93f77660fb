// Ray queries: Embree finds candidate triangles, and callbacks test them exactly.
#include <algorithm>
#include <array>
#include <cstring>

#include "render/rays/scene_build.h"

namespace polymorph {
namespace {

/// The rays of one call and their hits so far. Embree passes the query to the callbacks as their
/// context. A ray's `id` is its index in the arrays.
struct Query {
  RTCIntersectContext context;  // must be the first member, because Embree passes its address
  float slack;                  // TracedScene::slack() plus start_margin()
  const RayOf<Pack3>* rays;     // one or two packs
  // Per ray: the nearest hit so far; without a hit, `distance` is the ray's `far`.
  alignas(32) std::array<double, kPacket> distance;
  alignas(32) std::array<float, kPacket> u, v;
  alignas(32) std::array<std::uint32_t, kPacket> mesh, triangle;

  Query(const TracedScene& scene, const RayOf<Pack3>* packs)
      : slack(scene.slack() + scene.start_margin()), rays(packs) {
    rtcInitIntersectContext(&context);
  }
};

/// Returns the active lanes of Embree's query: bit i for lane i of n.
std::uint32_t active_lanes(const int* valid, unsigned n) {
  std::uint32_t bits = 0;
  if (n % kLanes == 0) {
    for (unsigned first = 0; first < n; first += kLanes) {
      PackMask lanes;
      std::memcpy(&lanes, valid + first, sizeof lanes);
      bits |= Lanes<Pack>::bits(lanes != 0) << first;
    }
    return bits;
  }
  for (unsigned lane = 0; lane < n; ++lane) bits |= (valid[lane] != 0 ? 1u : 0u) << lane;
  return bits;
}

/// Calls f(lane, index of the ray, triangle, intersection) for every triangle that the rays hit,
/// among Embree's candidates and their neighbours. f returns whether Embree should accept the hit.
template <class F>
void for_intersected(const RTCFilterFunctionNArguments* args, const F& f) {
  const auto& traced = *static_cast<const MeshToTrace*>(args->geometryUserPtr);
  const auto& query = *reinterpret_cast<const Query*>(args->context);
  const unsigned n = args->N;
  for (std::uint32_t bits = active_lanes(args->valid, n); bits != 0; bits &= bits - 1) {
    const auto lane = static_cast<unsigned>(countr_zero(bits));
    const unsigned i = RTCRayN_id(args->ray, n, lane), l = i % kLanes;
    const RayOf<Pack3>& pack = query.rays[i / kLanes];
    const Ray ray{{pack.origin.x[l], pack.origin.y[l], pack.origin.z[l]},
                  {pack.direction.x[l], pack.direction.y[l], pack.direction.z[l]},
                  pack.time[l],
                  pack.far[l]};
    const Vec3d d(ray.direction);
    const auto accept = [&](std::uint32_t triangle, const TriangleIntersection& intersection) {
      return intersection.distance > 0 && intersection.distance < static_cast<double>(ray.far) &&
             f(lane, i, triangle, intersection);
    };
    const std::uint32_t triangle = RTCHitN_primID(args->hit, n, lane);
    const EdgeFunctions edges =
        compute_edge_functions(traced, traced.mesh->triangles[triangle], ray, d);
    bool any_hit = false;
    if (edges.closest() > traced.near_limit || !edges.near_any(traced.margin2)) {
      any_hit = edges.inside() && accept(triangle, compute_intersection(edges, d));
    } else {
      // Embree may report only one of several triangles at the edge.
      EdgeNeighborhood(traced, ray).for_each_near(triangle, edges, [&](std::uint32_t other) {
        TriangleIntersection intersection;
        if (intersects_triangle(traced, other, ray, intersection))
          any_hit = accept(other, intersection) || any_hit;
      });
    }
    if (!any_hit) args->valid[lane] = 0;
  }
}

/// Callback for closest(): stores the hit in the query if it is the nearest so far. Of equally near
/// hits, the one with the lowest mesh and then the lowest triangle counts.
void accept_nearest(const RTCFilterFunctionNArguments* args) {
  auto& query = *reinterpret_cast<Query*>(args->context);
  for_intersected(args, [&](unsigned lane, unsigned i, std::uint32_t triangle,
                            const TriangleIntersection& intersection) {
    const std::uint32_t mesh = RTCHitN_geomID(args->hit, args->N, lane);
    if (intersection.distance > query.distance[i]) return false;
    if (intersection.distance == query.distance[i] &&
        (mesh > query.mesh[i] || (mesh == query.mesh[i] && triangle >= query.triangle[i])))
      return false;
    query.distance[i] = intersection.distance;
    query.u[i] = static_cast<float>(intersection.u);
    query.v[i] = static_cast<float>(intersection.v);
    query.mesh[i] = mesh;
    query.triangle[i] = triangle;
    // Embree's own distances are inexact, so Embree must search slightly beyond the hit.
    RTCRayN_tfar(args->ray, args->N, lane) =
        static_cast<float>(intersection.distance) + query.slack;
    return true;
  });
}

/// Callback for test_occlusion(): accepts every hit of the exact test.
void accept_any(const RTCFilterFunctionNArguments* args) {
  for_intersected(
      args, [](unsigned, unsigned, std::uint32_t, const TriangleIntersection&) { return true; });
}

/// Fills the packet and marks the rays that hit the bounds of the meshes as valid. Returns false if
/// there are none.
bool fill_packet(const TracedScene& scene, const Query& query, int count, RTCRay16& packet,
                 int* valid) {
  // Debian's Embree asserts that inactive lanes hold finite numbers, too. Without AVX-512, Embree
  // ignores `valid` for packets of 16 and tests whether [tnear, tfar] is empty.
  if (count <= kLanes) std::memset(&packet, 0, sizeof packet);
  std::memset(valid, 0, kPacket * sizeof(int));
  bool any_active = false;
  for (int first = 0; first < count; first += kLanes) {
    const RayOf<Pack3>& ray = query.rays[first / kLanes];
    const PackMask hits_bounds = (!scene.misses_bounds(ray)) & first_lanes(count - first);
    any_active = any_active || any(hits_bounds);
    std::memcpy(valid + first, &hits_bounds, sizeof hits_bounds);
    const Pack3 start = ray.origin - ray.direction * scene.start_margin();
    Lanes<Pack>::store(packet.org_x + first, start.x);
    Lanes<Pack>::store(packet.org_y + first, start.y);
    Lanes<Pack>::store(packet.org_z + first, start.z);
    Lanes<Pack>::store(packet.tnear + first,
                       select(hits_bounds, broadcast<Pack>(0), broadcast<Pack>(kInfinity)));
    Lanes<Pack>::store(packet.dir_x + first, ray.direction.x);
    Lanes<Pack>::store(packet.dir_y + first, ray.direction.y);
    Lanes<Pack>::store(packet.dir_z + first, ray.direction.z);
    Lanes<Pack>::store(packet.time + first, ray.time);
    Lanes<Pack>::store(packet.tfar + first,
                       select(hits_bounds, ray.far + query.slack, broadcast<Pack>(0)));
    const PackBits all = PackBits{} + 0xffffffffu, none{};
    std::memcpy(packet.mask + first, &all, sizeof all);
    std::memcpy(packet.flags + first, &none, sizeof none);
    const PackBits id = PackBits{0, 1, 2, 3, 4, 5, 6, 7} + static_cast<std::uint32_t>(first);
    std::memcpy(packet.id + first, &id, sizeof id);
  }
  return any_active;
}

}  // namespace

void set_filters(RTCGeometry geometry) {
  rtcSetGeometryIntersectFilterFunction(geometry, accept_nearest);
  rtcSetGeometryOccludedFilterFunction(geometry, accept_any);
}

MeshHit TracedScene::closest(const Ray& ray) const {
  if (misses_bounds(ray)) return {};
  const RayOf<Pack3> pack{broadcast3<Pack3>(ray.origin), broadcast3<Pack3>(ray.direction),
                          broadcast<Pack>(ray.time), broadcast<Pack>(ray.far)};
  Query query(*this, &pack);
  query.distance[0] = static_cast<double>(ray.far);
  query.mesh[0] = kNoMesh;
  RTCRayHit single;
  const Vec3 start = ray.origin - ray.direction * start_margin();
  single.ray = {start.x,
                start.y,
                start.z,
                0.0f,  // tnear
                ray.direction.x,
                ray.direction.y,
                ray.direction.z,
                ray.time,
                ray.far + query.slack,
                0xffffffffu,  // mask
                0,            // id
                0};           // flags
  single.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  single.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(scene_.get(), &query.context, &single);
  if (query.mesh[0] == kNoMesh) return {};
  return {query.mesh[0], query.triangle[0], static_cast<float>(query.distance[0]), query.u[0],
          query.v[0]};
}

void TracedScene::closest(const RayOf<Pack3>* rays, MeshHitOf<Pack>* hits, int count,
                          bool coherent) const {
  alignas(64) int valid[kPacket];
  alignas(64) RTCRayHit16 packet;
  Query query(*this, rays);
  query.mesh.fill(kNoMesh);
  query.triangle.fill(0);
  for (int i = 0; i < count; ++i)
    query.distance[i] = static_cast<double>(rays[i / kLanes].far[i % kLanes]);
  // All bits set: RTC_INVALID_GEOMETRY_ID.
  std::memset(packet.hit.geomID, 0xff, sizeof packet.hit.geomID);
  std::memset(packet.hit.instID, 0xff, sizeof packet.hit.instID);
  if (fill_packet(*this, query, count, packet.ray, valid)) {
    if (coherent) query.context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    rtcIntersect16(valid, scene_.get(), &query.context, &packet);
  }
  for (int first = 0; first < count; first += kLanes) {
    MeshHitOf<Pack>& hit = hits[first / kLanes];
    std::memcpy(&hit.mesh, &query.mesh[first], sizeof hit.mesh);
    std::memcpy(&hit.triangle, &query.triangle[first], sizeof hit.triangle);
    for (int l = 0; l < kLanes; ++l)
      hit.distance[l] = static_cast<float>(query.distance[first + l]);
    hit.u = Lanes<Pack>::load(&query.u[first]);
    hit.v = Lanes<Pack>::load(&query.v[first]);
  }
}

std::uint32_t TracedScene::test_occlusion(const RayOf<Pack3>* rays, int count) const {
  alignas(64) int valid[kPacket];
  alignas(64) RTCRay16 packet;
  Query query(*this, rays);
  if (!fill_packet(*this, query, count, packet, valid)) return 0;
  rtcOccluded16(valid, scene_.get(), &query.context, &packet);
  std::uint32_t bits = 0;
  for (int first = 0; first < count; first += kLanes)  // Embree makes tfar of occluded rays -inf
    bits |= Lanes<Pack>::bits(Lanes<Pack>::load(packet.tfar + first) < 0.0f) << first;
  return bits;
}

}  // namespace polymorph
