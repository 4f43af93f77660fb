#include "render/path/integrator.h"

#include <algorithm>
#include <bit>
#include <cstring>

#include "render/path/scatter.h"

namespace polymorph {
namespace {

SurfacePoint lane(const SurfacePointOf<Pack3>& p, int l) {
  return {lane(p.position, l), lane(p.normal, l), lane(p.shading, l), lane(p.lifted, l),
          p.inside[l] != 0};
}
Shading lane(const ShadingOf<Pack3>& s, int l) {
  return {lane(s.color, l), lane(s.specular, l), s.roughness[l],
          s.metallic[l],    s.transmission[l],   s.ior[l]};
}
Sample4 lane(const Sample4Of<Pack>& s, int l) { return {s.a[l], s.b[l], s.c[l], s.d[l]}; }

/// A list of paths of the wave. Each item is the path's row, that is its index in Tracer::paths_.
struct PathList {
  std::array<std::uint16_t, Wavefront::kMax> items;
  int count = 0;
  void add(std::uint32_t item) { items[count++] = static_cast<std::uint16_t>(item); }
  /// Adds the rows of the lanes `where`.
  void add(PackBits rows, PackMask where) {
    for (std::uint32_t bits = Lanes<Pack>::bits(where); bits != 0; bits &= bits - 1)
      add(rows[countr_zero(bits)]);
  }
};

/// Traces all paths of a wavefront. In each step paths are sorted by the kind of surface that they
/// hit, and those of one kind are processed eight at a time.
class Tracer {
 public:
  Tracer(const World& world, const FrameSampler& sampler, Wavefront& wave, RayStats& stats)
      : world_(world), sampler_(sampler), wave_(wave), stats_(stats) {
    PathRow start;
    start.depth_left = static_cast<float>(world.max_depth);
    for (int i = 0; i < wave.count; ++i) {
      PathRow& path = paths_[i] = start;
      path.ray = wave.rays[i];
      path.ray.far = kInfinity;
      path.sample = wave.samples[i];
      active_.add(static_cast<std::uint32_t>(i));
      direct_[i] = {};
    }
  }

  void trace() {
    for (depth_ = 1; active_.count > 0; ++depth_) {
      intersect_active_paths();
      active_.count = 0;
      for_each_pack(meshes_, [&](Paths& path, PackBits rows, PackMask live) {
        return shade_mesh_hits(path, rows, live);
      });
      for_each_pack(floors_, [&](Paths& path, PackBits rows, PackMask live) {
        return shade_floor_hits(path, rows, live);
      });
      for_each_pack(escaped_, [&](Paths& path, PackBits, PackMask live) {
        leave_scene(world_, path, live);
        return PackMask{};
      });
      for_each_pack(inside_glass_, [&](Paths& path, PackBits, PackMask live) {
        add_sky(world_, path, broadcast<Pack>(1), live);
        return PackMask{};
      });
      test_final_rays();
      const std::uint8_t* occluded = final_occluded_.data();
      for_each_pack(depth_limit_, [&](Paths& path, PackBits rows, PackMask live) {
        end_final_rays(path, rows, live, *occluded++);
        return PackMask{};
      });
    }
    shadows_.flush();
  }

  PathLight result(int path) const { return make_result(paths_[path], direct_[path]); }

 private:
  /// Loads eight entries of a list; beyond its end the last one is repeated.
  PackBits load_row_indices(const PathList& list, int first) const {
    PackBits rows;
    for (int l = 0; l < kLanes; ++l) rows[l] = list.items[std::min(first + l, list.count - 1)];
    return rows;
  }
  /// Loads eight paths, one per lane, or only as much of each as T has, which consists of packs.
  template <class T>
  T load(PackBits rows) const {
    constexpr std::size_t kWidth = sizeof(T) / sizeof(Pack);
    const float* starts[kLanes];
    for (int l = 0; l < kLanes; ++l) starts[l] = &paths_[rows[l]].ray.origin.x;
    std::array<Pack, kWidth> columns;
    load_rows<kWidth>(starts, columns.data());
    return std::bit_cast<T>(columns);
  }
  /// Stores the paths of the lanes `where`.
  void store(const Paths& path, PackBits rows, PackMask where) {
    Pack columns[kPathWidth];
    std::memcpy(columns, &path, sizeof path);
    PathRow unused;  // receives the lanes that are not stored
    float* starts[kLanes];
    for (int l = 0; l < kLanes; ++l)
      starts[l] = &(where[l] ? paths_[rows[l]] : unused).ray.origin.x;
    store_rows<kPathWidth>(columns, starts);
  }
  IntersectionOf<Pack> load_intersection(PackBits rows) const {
    const float* starts[kLanes];
    for (int l = 0; l < kLanes; ++l)
      starts[l] = reinterpret_cast<const float*>(&intersections_[rows[l]]);
    Pack columns[8];  // the columns of an IntersectionRow
    load_rows<8>(starts, columns);
    IntersectionOf<Pack> intersection;
    std::memcpy(&intersection, columns, sizeof intersection);
    return intersection;
  }

  /// Sorts the paths of the lanes `where` by what they hit.
  void sort_by_hit(const IntersectionOf<Pack>& hits, PackBits rows, PackMask where) {
    const PackMask on_mesh = where & (hits.mesh.mesh != kNoMesh);
    const PackMask on_floor = where & !on_mesh & (hits.floor < kInfinity);
    meshes_.add(rows, on_mesh);
    floors_.add(rows, on_floor);
    escaped_.add(rows, where & !on_mesh & !on_floor);
  }

  /// Stores the intersections of the lanes `where`.
  void store_intersection(const IntersectionOf<Pack>& intersection, PackBits rows, PackMask where) {
    Pack columns[8] = {};
    std::memcpy(columns, &intersection, sizeof intersection);
    IntersectionRow unused;  // receives the lanes that are not stored
    float* starts[kLanes];
    for (int l = 0; l < kLanes; ++l)
      starts[l] = reinterpret_cast<float*>(where[l] ? &intersections_[rows[l]] : &unused);
    store_rows<8>(columns, starts);
  }

  /// Calls f(paths, rows, live) for eight paths of a list at a time, and stores the paths that f
  /// has not stored (handled_). `live`: lanes that hold a path. f returns the lanes whose paths
  /// continue. It adds the paths that it has stored to a list itself.
  template <class F>
  void for_each_pack(const PathList& list, const F& f) {
    for (int first = 0; first < list.count; first += kLanes) {
      const PackBits rows = load_row_indices(list, first);
      const PackMask live = first_lanes(list.count - first);
      Paths path = load<Paths>(rows);
      const PackMask continues = f(path, rows, live);
      store(path, rows, live & !handled_);
      handled_ = PackMask{};
      active_.add(rows, continues);
    }
  }

  /// Intersects the rays of all active paths and sorts the paths by what they hit.
  void intersect_active_paths() {
    escaped_.count = floors_.count = meshes_.count = inside_glass_.count = depth_limit_.count = 0;
    PathList to_intersect;
    for (int i = 0; i < active_.count; ++i) {
      const std::uint32_t row = active_.items[i];
      (paths_[row].depth_left > 0 ? to_intersect : depth_limit_).add(row);
    }
    if (depth_ == 1 && wave_.is_intersected) {
      intersections_ = wave_.intersections;
      for (int first = 0; first < to_intersect.count; first += kLanes) {
        const PackBits rows = load_row_indices(to_intersect, first);
        sort_by_hit(load_intersection(rows), rows, first_lanes(to_intersect.count - first));
      }
      return;
    }
    for (int first = 0; first < to_intersect.count; first += kPacket) {
      const int count = std::min(kPacket, to_intersect.count - first);
      RayOf<Pack3> rays[2];
      PackBits rows[2];
      IntersectionOf<Pack> intersections[2];
      for (int k = 0; k < count; k += kLanes) {
        rows[k / kLanes] = load_row_indices(to_intersect, first + k);
        rays[k / kLanes] = load<RayOf<Pack3>>(rows[k / kLanes]);
      }
      intersect_closest(world_, rays, intersections, count, /*coherent=*/depth_ == 1, stats_);
      for (int k = 0; k < count; k += kLanes) {
        const IntersectionOf<Pack>& hits = intersections[k / kLanes];
        const PackMask live = first_lanes(count - k);
        store_intersection(hits, rows[k / kLanes], live);
        sort_by_hit(hits, rows[k / kLanes], live);
      }
    }
  }

  VertexRandom make_vertex_random(const Paths& path) const {
    return {{sampler_, wave_.sequence, path.sample}, depth_, world_.direct_only};
  }

  // The shade functions add light and scatter the paths. They return the lanes whose paths
  // continue.

  PackMask shade_floor_hits(Paths& path, PackBits rows, PackMask live) {
    const Pack distance = load_intersection(rows).floor;
    add_hit_lamps(world_, path, distance, live);
    const FloorPointOf<Pack3> point = floor_point(world_.floor, path.ray, distance);
    add_sky(world_, path, point.fade, live);
    path.throughput = path.throughput * (1.0f - point.fade);
    Vertices vertices{path, rows, /*origin=*/{}, live, /*uses_mis=*/{}, shadows_};
    const PackMask continues =
        scatter_on_floor(world_, vertices, point, make_vertex_random(path), stats_);
    path.depth_left = path.depth_left - 1.0f;
    return continues;
  }

  PackMask shade_mesh_hits(Paths& path, PackBits rows, PackMask live) {
    const MeshHitOf<Pack> hit = load_intersection(rows).mesh;
    add_hit_lamps(world_, path, hit.distance, live);
    add_sky(world_, path, /*fraction=*/Pack{}, live);
    const SurfacePointOf<Pack3> point = world_.geometry->surface_point(path.ray, hit);
    const VertexRandom random = make_vertex_random(path);
    const ShadingOf<Pack3> own = own_shading(world_, hit);
    const bool keeps_hits = depth_ == 1 && wave_.is_intersected;
    ShadingOf<Pack3> mixed;
    if (keeps_hits || world_.has_glass) mixed = mixed_shading(world_, hit, own);
    if (keeps_hits) keep_hits(rows, live, point, mixed.color);
    if (world_.has_glass) {
      const Sample4Of<Pack> sample = random.glass();
      handled_ = live & (mixed.transmission > sample.b);
      store(path, rows, handled_);
      pass_glass_one_by_one(rows, handled_, point, mixed, sample);
      live = live & !handled_;
      if (!any(live)) return PackMask{};
    }
    const BsdfOf<Pack3> bsdf =
        make_bsdf_at(world_, hit, own, point.shading, -path.ray.direction, has(path, kScattered));
    Vertices vertices{path, rows, /*origin=*/{}, live, /*uses_mis=*/{}, shadows_};
    return scatter_on_mesh(world_, vertices, point, bsdf, random);
  }

  /// Keeps what has been looked up at the first hits of the lanes `live`.
  void keep_hits(PackBits rows, PackMask live, const SurfacePointOf<Pack3>& point,
                 const Pack3& albedo) {
    for (std::uint32_t bits = Lanes<Pack>::bits(live); bits != 0; bits &= bits - 1) {
      const int l = countr_zero(bits);
      wave_.shaded_hits[rows[l]] = {lane(point.position, l), lane(point.shading, l),
                                    lane(albedo, l)};
    }
  }

  /// Refracts or reflects the paths of the lanes `glass` one by one. They must be stored.
  void pass_glass_one_by_one(PackBits rows, PackMask glass, const SurfacePointOf<Pack3>& point,
                             const ShadingOf<Pack3>& shading, const Sample4Of<Pack>& random) {
    for (int l = 0; l < kLanes; ++l) {
      if (!glass[l]) continue;
      PathRow& row = paths_[rows[l]];
      if (row.flags >> kGlassShift == 0) {
        // A path that has passed the maximum number of boundaries sees the sky along its ray.
        inside_glass_.add(rows[l]);
        continue;
      }
      row.flags -= 1u << kGlassShift;
      pass_glass(world_, row, lane(point, l), lane(shading, l), lane(random, l));
      active_.add(rows[l]);
    }
  }

  /// Tests which final rays of paths at the depth limit meshes occlude, sixteen at a time. Sets the
  /// bits of `final_occluded_`. Glass needs trace_transmittance() instead.
  void test_final_rays() {
    for (int first = 0; first < depth_limit_.count && !world_.has_glass; first += kPacket) {
      const int count = std::min(kPacket, depth_limit_.count - first);
      RayOf<Pack3> rays[2];
      for (int k = 0; k < count; k += kLanes)
        rays[k / kLanes] = load<RayOf<Pack3>>(load_row_indices(depth_limit_, first + k));
      stats_.rays += static_cast<std::uint64_t>(count);
      const std::uint32_t occluded = world_.geometry->test_occlusion(rays, count);
      for (int k = 0; k < kPacket; k += kLanes)
        final_occluded_[(first + k) / kLanes] = static_cast<std::uint8_t>(occluded >> k);
    }
  }

  /// Adds the light of final rays, which only test whether they see the sky. The floor counts as
  /// the sky's lower half. `occluded`: bit l for lane l, from test_final_rays().
  void end_final_rays(Paths& path, PackBits rows, PackMask live, std::uint32_t occluded) {
    Pack3 transmittance = broadcast3<Pack3>({1, 1, 1});
    if (world_.has_glass) {
      for (int l = 0; l < kLanes; ++l)
        if (live[l])
          set_lane(transmittance, l,
                   trace_transmittance(world_, *world_.geometry, paths_[rows[l]].ray, stats_));
    } else {
      for (int l = 0; l < kLanes; ++l)
        if ((occluded >> l) & 1) set_lane(transmittance, l, {});
    }
    // With a single bounce, an occluding surface reflects a fraction of the sky (kGuessedBounce).
    const PackMask hidden = live & is_black(transmittance);
    if (any(hidden))
      add_sky(world_, path, broadcast<Pack>(world_.max_depth == 1 ? kGuessedBounce : 0), hidden);
    const PackMask visible = live & !hidden;
    // For unoccluded rays the control variate is exact. For rays through glass it is subtracted,
    // and the attenuated sky is added below.
    const PackMask attenuated = visible & (min_component(transmittance) < 1.0f);
    if (any(attenuated)) add_sky(world_, path, /*fraction=*/Pack{}, attenuated);
    path.throughput = path.throughput * transmittance;
    leave_scene(world_, path, visible);
  }

  const World& world_;
  const FrameSampler& sampler_;
  Wavefront& wave_;
  RayStats& stats_;
  std::uint32_t depth_ = 1;
  PackMask handled_{};  ///< lanes of the current pack whose rows are already stored
  /// One bit per path of depth_limit_: whether meshes occlude its final ray.
  std::array<std::uint8_t, Wavefront::kMax / kLanes> final_occluded_;
  // active_: paths that continue in the next step. The other lists divide the paths of this step by
  // what they hit, or by the limit that they have reached: of glass boundaries or of depth.
  PathList active_, escaped_, floors_, meshes_, inside_glass_, depth_limit_;
  union {  // leaves the rows without a value until the constructor sets those of the wave's paths
    std::array<PathRow, Wavefront::kMax> paths_;
  };
  std::array<IntersectionRow, Wavefront::kMax> intersections_;
  std::array<Vec3, Wavefront::kMax> direct_;  ///< light of each path's shadow rays
  ShadowRays shadows_{world_, stats_, direct_.data()};
};

/// Looks up the hits of eight rays, of which those of the lanes `on_mesh` hit a mesh. At least one
/// does.
void shade_hits(const World& world, const RayOf<Pack3>& rays, MeshHitOf<Pack> hit,
                CostlyValues values, PackMask on_mesh, ShadedHit (&shaded)[kLanes]) {
  // The other lanes repeat the first hit, because the lookups need eight hits.
  const int first_hit_lane = countr_zero(Lanes<Pack>::bits(on_mesh));
  hit.mesh = on_mesh ? hit.mesh : PackBits{} + hit.mesh[first_hit_lane];
  hit.triangle = on_mesh ? hit.triangle : PackBits{} + hit.triangle[first_hit_lane];
  hit.u = select(on_mesh, hit.u, broadcast<Pack>(hit.u[first_hit_lane]));
  hit.v = select(on_mesh, hit.v, broadcast<Pack>(hit.v[first_hit_lane]));
  hit.distance = select(on_mesh, hit.distance, broadcast<Pack>(hit.distance[first_hit_lane]));
  const SurfacePointOf<Pack3> points = world.geometry->surface_point(rays, hit);
  Pack3 albedos{};
  if (values.albedo) albedos = mixed_shading(world, hit, own_shading(world, hit)).color;
  for (int l = 0; l < kLanes; ++l)
    shaded[l] = {lane(points.position, l), lane(points.shading, l), lane(albedos, l)};
}

/// Computes hits[l] for each lane l of `on_mesh`. `hit`: intersections of the rays; `shaded`: what
/// has been looked up at them.
void set_mesh_values(const World& world, const MeshHitOf<Pack>& hit, CostlyValues values,
                     PackMask on_mesh, const ShadedHit* shaded, FirstHit (&hits)[kLanes]) {
  for (std::uint32_t bits = Lanes<Pack>::bits(on_mesh); bits != 0; bits &= bits - 1) {
    const int l = countr_zero(bits);
    const RenderMesh& mesh = world.geometry->mesh(hit.mesh[l]);
    const float u = hit.u[l], v = hit.v[l];
    const Triangle& t = mesh.triangles[hit.triangle[l]];
    const auto interpolate = [&](const auto& items) {
      return items[t.v[0]] * (1 - u - v) + items[t.v[1]] * u + items[t.v[2]] * v;
    };
    FirstHit& result = hits[l];
    result.depth = hit.distance[l];
    result.normal = shaded[l].normal;
    result.id = mesh.id;
    result.position = result.next = shaded[l].position;
    if (!mesh.displacement.empty()) result.next = result.position + interpolate(mesh.displacement);
    if (values.albedo) result.albedo = shaded[l].albedo;
    if (values.uv) result.uv = texture_point(mesh, hit.triangle[l], u, v).uv;
    result.progress =
        mesh.vertex_progress.empty() ? mesh.progress : interpolate(mesh.vertex_progress);
    result.t = world.time;
    if (!mesh.vertex_labels.empty()) {
      const MeshHit lane_hit{hit.mesh[l], hit.triangle[l], hit.distance[l], u, v};
      result.label = static_cast<float>(mesh.first_label + nearest_label(mesh, lane_hit));
    }
  }
}

}  // namespace

void trace(const World& world, const FrameSampler& sampler, Wavefront& wave, RayStats& stats) {
  stats.paths += static_cast<std::uint64_t>(wave.count);
  Tracer tracer(world, sampler, wave, stats);
  tracer.trace();
  for (int i = 0; i < wave.count; ++i) wave.path_lights[i] = tracer.result(i);
}

void find_first_hits(const World& world, const RayOf<Pack3>& rays,
                     const IntersectionOf<Pack>& first, CostlyValues values,
                     const ShadedHit* shaded, FirstHit (&hits)[kLanes]) {
  const PackMask on_mesh = first.mesh.mesh != kNoMesh;
  const PackMask on_floor = (!on_mesh) & (first.floor < kInfinity);
  if (any(on_mesh)) {
    ShadedHit looked_up[kLanes];
    if (!shaded) shade_hits(world, rays, first.mesh, values, on_mesh, looked_up);
    set_mesh_values(world, first.mesh, values, on_mesh, shaded ? shaded : looked_up, hits);
  }
  if (!any(on_floor)) return;
  const FloorPointOf<Pack3> point = floor_point(world.floor, rays, first.floor);
  for (std::uint32_t bits = Lanes<Pack>::bits(on_floor); bits != 0; bits &= bits - 1) {
    const int l = countr_zero(bits);
    FirstHit& hit = hits[l];
    hit.depth = first.floor[l];
    hit.normal = {0, 1, 0};
    hit.id = 1;
    hit.position = hit.next = lane(point.position, l);
    hit.albedo = world.floor.color * point.tone[l];
  }
}

std::uint32_t nearest_label(const RenderMesh& mesh, const MeshHit& hit) {
  const float w = 1 - hit.u - hit.v;
  const int nearest = w >= hit.u && w >= hit.v ? 0 : hit.u >= hit.v ? 1 : 2;
  return mesh.vertex_labels[mesh.triangles[hit.triangle].v[nearest]];
}

}  // namespace polymorph
