// Rays against the meshes: Embree proposes triangles, callbacks decide about them.
#include <algorithm>
#include <array>
#include <cstring>

#include "render/meet_triangle.h"
#include "render/scene_build.h"

namespace polymorph {
namespace {

/// The rays of one call and what they have met so far. Embree's callbacks get it as their context,
/// and the number of a ray in its `id`.
struct Query {
  RTCIntersectContext context;  // first: Embree knows only this
  float slack;
  const RayOf<Pack3>* rays;
  // Of the best triangle so far; the distance is that to the ray's end where there is none.
  alignas(32) std::array<double, kPacket> distance;
  alignas(32) std::array<float, kPacket> u, v;
  alignas(32) std::array<std::uint32_t, kPacket> mesh, triangle;

  Query(const TracedScene& scene, const RayOf<Pack3>* rays_) : slack(scene.slack()), rays(rays_) {
    rtcInitIntersectContext(&context);
  }
};

/// f(lane, number of the ray, meeting) -> whether Embree is to take it as a hit; for all triangles
/// that Embree proposes and their rays meet.
template <class F>
void for_met(const RTCFilterFunctionNArguments* args, const F& f) {
  const auto& traced = *static_cast<const MeshToTrace*>(args->geometryUserPtr);
  const auto& query = *reinterpret_cast<const Query*>(args->context);
  const unsigned n = args->N;
  for (unsigned lane = 0; lane < n; ++lane) {
    if (args->valid[lane] == 0) continue;
    const unsigned i = RTCRayN_id(args->ray, n, lane), l = i % kLanes;
    const RayOf<Pack3>& ray = query.rays[i / kLanes];
    const float time = ray.time[l];
    const Triangle& t = traced.mesh->triangles[RTCHitN_primID(args->hit, n, lane)];
    TriangleMeeting met;
    const bool meets = meet_triangle({ray.origin.x[l], ray.origin.y[l], ray.origin.z[l]},
                                     {ray.direction.x[l], ray.direction.y[l], ray.direction.z[l]},
                                     traced.at(t.v[0], time), traced.at(t.v[1], time),
                                     traced.at(t.v[2], time), met) &&
                       met.distance > 0 && met.distance < static_cast<double>(ray.far[l]);
    if (!meets || !f(lane, i, met)) args->valid[lane] = 0;
  }
}

void take_nearest(const RTCFilterFunctionNArguments* args) {
  auto& query = *reinterpret_cast<Query*>(args->context);
  for_met(args, [&](unsigned lane, unsigned i, const TriangleMeeting& met) {
    const std::uint32_t mesh = RTCHitN_geomID(args->hit, args->N, lane);
    const std::uint32_t triangle = RTCHitN_primID(args->hit, args->N, lane);
    if (met.distance > query.distance[i]) return false;
    if (met.distance == query.distance[i] &&
        (mesh > query.mesh[i] || (mesh == query.mesh[i] && triangle >= query.triangle[i])))
      return false;
    query.distance[i] = met.distance;
    query.u[i] = static_cast<float>(met.u);
    query.v[i] = static_cast<float>(met.v);
    query.mesh[i] = mesh;
    query.triangle[i] = triangle;
    // Embree's own distances are not exact: it is to go on to what might still be nearer.
    RTCRayN_tfar(args->ray, args->N, lane) = static_cast<float>(met.distance) + query.slack;
    return true;
  });
}

void take_any(const RTCFilterFunctionNArguments* args) {
  for_met(args, [](unsigned, unsigned, const TriangleMeeting&) { return true; });
}

/// Fills the packet and says which rays to follow: those that do not pass by everything.
bool fill(const TracedScene& scene, const RayOf<Pack3>* rays, int count, RTCRay16& packet,
          int* valid) {
  // Debian's Embree asserts that lanes which are switched off hold numbers, too.
  if (count <= kLanes) std::memset(&packet, 0, sizeof packet);
  std::memset(valid, 0, kPacket * sizeof(int));
  bool some = false;
  for (int first = 0; first < count; first += kLanes) {
    const RayOf<Pack3>& ray = rays[first / kLanes];
    const PackMask follow = opposite(scene.misses_bounds(ray)) & first_lanes(count - first);
    some = some || any(follow);
    std::memcpy(valid + first, &follow, sizeof follow);
    Lanes<Pack>::store(packet.org_x + first, ray.origin.x);
    Lanes<Pack>::store(packet.org_y + first, ray.origin.y);
    Lanes<Pack>::store(packet.org_z + first, ray.origin.z);
    Lanes<Pack>::store(packet.tnear + first, same<Pack>(0));
    Lanes<Pack>::store(packet.dir_x + first, ray.direction.x);
    Lanes<Pack>::store(packet.dir_y + first, ray.direction.y);
    Lanes<Pack>::store(packet.dir_z + first, ray.direction.z);
    Lanes<Pack>::store(packet.time + first, ray.time);
    Lanes<Pack>::store(packet.tfar + first, ray.far + scene.slack());
    const PackBits all = PackBits{} + 0xffffffffu, none{};
    std::memcpy(packet.mask + first, &all, sizeof all);
    std::memcpy(packet.flags + first, &none, sizeof none);
    const PackBits id = PackBits{0, 1, 2, 3, 4, 5, 6, 7} + static_cast<std::uint32_t>(first);
    std::memcpy(packet.id + first, &id, sizeof id);
  }
  return some;
}

}  // namespace

void set_filters(RTCGeometry geometry) {
  rtcSetGeometryIntersectFilterFunction(geometry, take_nearest);
  rtcSetGeometryOccludedFilterFunction(geometry, take_any);
}

MeshHit TracedScene::closest(const Ray& ray) const {
  if (misses_bounds(ray)) return {};
  const RayOf<Pack3> pack{same3<Pack3>(ray.origin), same3<Pack3>(ray.direction),
                          same<Pack>(ray.time), same<Pack>(ray.far)};
  Query query(*this, &pack);
  query.distance[0] = static_cast<double>(ray.far);
  query.mesh[0] = kNoMesh;
  RTCRayHit one;
  one.ray = {ray.origin.x,
             ray.origin.y,
             ray.origin.z,
             0.0f,
             ray.direction.x,
             ray.direction.y,
             ray.direction.z,
             ray.time,
             ray.far + slack(),
             0xffffffffu,
             0,
             0};
  one.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  one.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(scene_.get(), &query.context, &one);
  if (query.mesh[0] == kNoMesh) return {};
  return {query.mesh[0], query.triangle[0], static_cast<float>(query.distance[0]), query.u[0],
          query.v[0]};
}

void TracedScene::closest(const RayOf<Pack3>* rays, MeshHitOf<Pack>* hits, int count,
                          bool alike) const {
  alignas(64) int valid[kPacket];
  alignas(64) RTCRayHit16 packet;
  Query query(*this, rays);
  query.mesh.fill(kNoMesh);
  query.triangle.fill(0);
  for (int i = 0; i < count; ++i)
    query.distance[i] = static_cast<double>(rays[i / kLanes].far[i % kLanes]);
  std::memset(packet.hit.geomID, 0xff, sizeof packet.hit.geomID);
  std::memset(packet.hit.instID, 0xff, sizeof packet.hit.instID);
  if (fill(*this, rays, count, packet.ray, valid)) {
    if (alike) query.context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
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

std::uint32_t TracedScene::blocked(const RayOf<Pack3>* rays, int count) const {
  alignas(64) int valid[kPacket];
  alignas(64) RTCRay16 packet;
  Query query(*this, rays);
  if (!fill(*this, rays, count, packet, valid)) return 0;
  rtcOccluded16(valid, scene_.get(), &query.context, &packet);
  std::uint32_t bits = 0;
  for (int first = 0; first < count; first += kLanes)
    bits |= Lanes<Pack>::bits(Lanes<Pack>::load(packet.tfar + first) < 0.0f) << first;
  return bits;
}

}  // namespace polymorph
