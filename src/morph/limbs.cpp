#include "morph/limbs.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/exact_math.h"
#include "base/parallel.h"
#include "morph/farthest_points.h"
#include "morph/voxel_solid.h"

namespace polymorph {
namespace {

constexpr std::uint32_t kNone = VoxelSolid::kNone;
/// Max number of tips. The pruned tree then has at most 13 nodes, so that the limbs of tips and
/// nodes fit a mask of 32 bits (Limbs::ball_limbs).
constexpr std::size_t kMaxTips = 14;
/// Min prominence of a tip: its distance from the centre minus the distance of the saddle at which
/// its component merges. The limits are fractions of the largest distance from the centre, and of
/// the local radius at the saddle.
constexpr double kMinProminence = 0.1, kMinProminenceInRadii = 0.5;
/// Conditions on an inner arc of the merge tree, on which others sit, to be a limb: its min length,
/// as a fraction of the largest distance from the centre and of the longest arc that sits on it;
/// and its max fraction of the volume.
constexpr double kMinInnerLength = 0.06, kMinInnerLengthInLimbs = 0.4, kMaxInnerVolume = 0.25;

/// The object's voxels, with the distances and order in which its limbs are found.
struct Body {
  VoxelSolid solid;
  std::vector<std::uint32_t> radii;     ///< local_radii()
  std::uint32_t center = 0;             ///< voxel of Limbs::center
  double mean_distance = 0;             ///< mean distance from the centre, in the solid's units
  std::vector<std::uint32_t> distance;  ///< geodesic distance from the centre
  std::vector<std::uint32_t> order;     ///< voxels, the farthest first
  std::vector<std::uint32_t> rank;      ///< per voxel, its position in `order`
  BodySample sample;
};

/// Finds the voxel with the least mean geodesic distance to the body, estimated from 60 bases
/// (farthest point sampling). Voxels are weighted by 1 / local radius, so that the mean is roughly
/// over the surface. Stores the bases as the body's sample.
void find_center(Body& body) {
  constexpr std::size_t kBases = 60;
  const VoxelSolid& solid = body.solid;
  const std::size_t n = solid.size();
  std::vector<double> weights(n);
  for (std::size_t i = 0; i < n; ++i)
    weights[i] = 1 / static_cast<double>(std::max(body.radii[i], VoxelSolid::kStepUnits));
  const double total_weight = std::accumulate(weights.begin(), weights.end(), 0.0);
  for (double& weight : weights) weight /= total_weight;
  const auto deepest = static_cast<std::uint32_t>(
      std::max_element(solid.depth.begin(), solid.depth.end()) - solid.depth.begin());
  const auto sample = farthest_points(weights, kBases, deepest, [&](std::uint32_t base) {
    return geodesic_distances(solid, std::span(&base, 1));
  });
  body.sample.shares = sample.weights;
  // The weights sum to 1, so the weighted sum of a point's distances is their mean.
  std::vector<double> mean(n);
  for (std::size_t i = 0; i < n; ++i) mean[i] = sample.sum_distances(i);
  // Of voxels with nearly the same mean distance, the deepest is chosen.
  constexpr double kDepthWeight = 1e-3;
  const auto score = [&](std::size_t i) {
    return mean[i] - kDepthWeight * static_cast<double>(solid.depth[i]);
  };
  for (std::uint32_t i = 1; i < n; ++i)
    if (score(i) < score(body.center)) body.center = i;
  body.mean_distance = std::max(mean[body.center], 1.0);
  for (std::size_t b = 0; b < sample.bases.size(); ++b) {
    body.sample.points.push_back(solid.center(sample.bases[b]));
    std::vector<double>& distances = body.sample.distances.emplace_back();
    for (const std::uint32_t other : sample.bases)
      distances.push_back(static_cast<double>(sample.distances[b][other]) * solid.unit());
  }
}

Body make_body(const std::vector<Ball>& balls) {
  Body body;
  body.solid = voxel_solid(balls);
  if (body.solid.size() == 0) return body;
  body.radii = local_radii(body.solid);
  find_center(body);
  body.distance = geodesic_distances(body.solid, std::span(&body.center, 1));
  body.order.resize(body.solid.size());
  std::iota(body.order.begin(), body.order.end(), 0u);
  std::stable_sort(body.order.begin(), body.order.end(), [&](std::uint32_t i, std::uint32_t j) {
    return body.distance[i] > body.distance[j];
  });
  body.rank.resize(body.order.size());
  for (std::uint32_t k = 0; k < body.order.size(); ++k) body.rank[body.order[k]] = k;
  return body;
}

/// Builds the merge tree of the distance's superlevel sets by adding voxels, the farthest first.
/// Before each voxel is added, `visit_voxel(voxel, roots)` gets the components next to it, each
/// named by its farthest voxel, the farthest first. These then merge under the first name; a voxel
/// without such neighbours starts a component of its own.
template <class Visitor>
void merge_tree(const Body& body, const Visitor& visit_voxel) {
  const VoxelSolid& solid = body.solid;
  std::vector<std::uint32_t> parent(solid.size(), kNone);
  const auto find = [&](std::uint32_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  std::vector<std::uint32_t> roots;
  for (const std::uint32_t i : body.order) {
    roots.clear();
    for (std::uint32_t k = solid.first_neighbor[i]; k < solid.first_neighbor[i + 1]; ++k)
      if (parent[solid.neighbors[k]] != kNone) roots.push_back(find(solid.neighbors[k]));
    std::sort(roots.begin(), roots.end(),
              [&](std::uint32_t a, std::uint32_t b) { return body.rank[a] < body.rank[b]; });
    roots.erase(std::unique(roots.begin(), roots.end()), roots.end());
    visit_voxel(i, roots);
    parent[i] = i;
    for (const std::uint32_t root : roots) parent[root] = roots.front();
    if (!roots.empty()) parent[i] = roots.front();
  }
}

/// Finds at most kMaxTips tips whose prominence (persistence) is large enough, the most prominent
/// first.
std::vector<std::uint32_t> prominent_tips(const Body& body) {
  struct Tip {
    std::uint32_t voxel, prominence, saddle;
  };
  std::vector<Tip> tips;
  // All components but the first, which has the farthest voxel, end at `voxel`: it is their saddle.
  // One component is left at the end; the centre counts as its saddle.
  merge_tree(body, [&](std::uint32_t voxel, const std::vector<std::uint32_t>& roots) {
    for (std::size_t k = 1; k < roots.size(); ++k)
      tips.push_back({roots[k], body.distance[roots[k]] - body.distance[voxel], voxel});
  });
  const std::uint32_t farthest = body.order.front();
  tips.push_back({farthest, body.distance[farthest], body.center});
  const double minimum = kMinProminence * static_cast<double>(body.distance[farthest]);
  std::erase_if(tips, [&](const Tip& tip) {
    return tip.prominence < minimum ||
           tip.prominence < kMinProminenceInRadii * static_cast<double>(body.radii[tip.saddle]);
  });
  std::stable_sort(tips.begin(), tips.end(),
                   [](const Tip& a, const Tip& b) { return a.prominence > b.prominence; });
  if (tips.size() > kMaxTips) tips.resize(kMaxTips);
  std::vector<std::uint32_t> voxels;
  for (const Tip& tip : tips) voxels.push_back(tip.voxel);
  return voxels;
}

/// An arc of the merge tree after it is pruned to the prominent tips.
struct Arc {
  std::uint32_t tip = 0, root = 0;  ///< voxels: the farthest, and the one at which the arc ends
  std::uint32_t top = 0;  ///< distance from the centre of the tip or node at which the arc begins
  /// Indices of the arcs that end where this one begins, and of the arcs nested in these.
  std::vector<std::uint32_t> nested;
};

/// Finds the arcs of the merge tree pruned to `tips`: one per tip, then one per node at which arcs
/// meet. An arc ends at the node where it meets another, or at the body's centre.
std::vector<Arc> find_arcs(const Body& body, const std::vector<std::uint32_t>& tips) {
  std::vector<Arc> arcs;
  for (const std::uint32_t tip : tips)
    arcs.push_back({tip, body.center, body.distance[tip], /*nested=*/{}});
  // open_arc[v]: the arc that the component named v (its farthest voxel) belongs to so far, or
  // kNone.
  std::vector<std::uint32_t> open_arc(body.solid.size(), kNone);
  merge_tree(body, [&](std::uint32_t voxel, const std::vector<std::uint32_t>& roots) {
    if (roots.empty()) {
      const auto tip = std::find(tips.begin(), tips.end(), voxel);
      if (tip != tips.end()) open_arc[voxel] = static_cast<std::uint32_t>(tip - tips.begin());
      return;
    }
    std::vector<std::uint32_t> ending_arcs;
    for (const std::uint32_t root : roots)
      if (open_arc[root] != kNone) ending_arcs.push_back(open_arc[root]);
    if (ending_arcs.empty()) return;
    // Where two arcs or more meet, they end, and a new one begins.
    std::uint32_t arc = ending_arcs.front();
    if (ending_arcs.size() > 1) {
      Arc new_arc = {arcs[arc].tip, body.center, body.distance[voxel], /*nested=*/{}};
      for (const std::uint32_t end : ending_arcs) {
        arcs[end].root = voxel;
        if (body.distance[arcs[end].tip] > body.distance[new_arc.tip]) new_arc.tip = arcs[end].tip;
        new_arc.nested.push_back(end);
        new_arc.nested.insert(new_arc.nested.end(), arcs[end].nested.begin(),
                              arcs[end].nested.end());
      }
      arc = static_cast<std::uint32_t>(arcs.size());
      arcs.push_back(std::move(new_arc));
    }
    open_arc[roots.front()] = arc;
  });
  return arcs;
}

/// Collects the voxels of an arc and its nested arcs: those connected to its tip by voxels that are
/// farther from the centre than its root. Returns them in increasing order.
std::vector<std::uint32_t> collect_members(const Body& body, const Arc& arc) {
  std::vector<std::uint8_t> seen(body.solid.size(), 0);
  std::vector<std::uint32_t> members{arc.tip};
  seen[arc.tip] = 1;
  for (std::size_t i = 0; i < members.size(); ++i)
    for (std::uint32_t k = body.solid.first_neighbor[members[i]];
         k < body.solid.first_neighbor[members[i] + 1]; ++k) {
      const std::uint32_t to = body.solid.neighbors[k];
      if (!seen[to] && body.rank[to] < body.rank[arc.root]) seen[to] = 1, members.push_back(to);
    }
  std::sort(members.begin(), members.end());
  return members;
}

/// A cross-section of a limb.
struct Section {
  Vec3d middle;
  double radius = 0;      ///< half the thickness
  std::size_t count = 0;  ///< number of voxels; if 0, all members are 0
};
/// Measures the cross-section of the voxels at `at`, plus or minus `half_width`, along the limb.
/// `along`: position of each of `members`, as a fraction of the limb's length.
Section measure_section(const Body& body, const std::vector<std::uint32_t>& members,
                        const std::vector<double>& along, double at, double half_width) {
  Section section;
  for (std::size_t k = 0; k < members.size(); ++k) {
    if (!(std::fabs(along[k] - at) < half_width)) continue;
    section.middle = section.middle + body.solid.center(members[k]);
    section.radius += static_cast<double>(body.radii[members[k]]) * body.solid.unit();
    ++section.count;
  }
  if (section.count > 0) {
    const double weight = 1 / static_cast<double>(section.count);
    section.middle = section.middle * weight;
    section.radius *= weight;
  }
  return section;
}

/// Measures the limb of an arc. A station without voxels repeats the one before it.
Limb make_limb(const Body& body, const Arc& arc, const std::vector<std::uint32_t>& members) {
  // Fractions of the limb's length: half the length of a section, and the length of the stretch at
  // the root whose centroid is Limb::root.
  constexpr double kHalfSection = 0.09, kRootSection = 0.12;
  const auto root = static_cast<double>(body.distance[arc.root]),
             tip = static_cast<double>(body.distance[arc.tip]);
  std::vector<double> along;
  for (const std::uint32_t i : members)
    along.push_back((static_cast<double>(body.distance[i]) - root) / std::max(tip - root, 1.0));
  Limb limb;
  limb.root_distance = root * body.solid.unit();
  limb.tip_distance = tip * body.solid.unit();
  limb.stretch = (static_cast<double>(arc.top) - root) * body.solid.unit();
  limb.volume = static_cast<double>(members.size()) / static_cast<double>(body.solid.size());
  Section section = {body.solid.center(arc.root),
                     static_cast<double>(body.radii[arc.root]) * body.solid.unit(), 1};
  limb.root = section.middle;
  for (std::size_t k = 0; k < kLimbStations; ++k) {
    const Section here = measure_section(body, members, along, limb_station(k), kHalfSection);
    if (here.count > 0) section = here;
    limb.line[k] = section.middle;
    limb.radius[k] = section.radius;
  }
  const Section first = measure_section(body, members, along, 0, kRootSection);
  if (first.count > 0) limb.root = first.middle;
  return limb;
}

/// Marks the arcs that are limbs: all leaves, and the inner arcs that are long and slim enough.
std::vector<std::uint8_t> mark_limbs(const Body& body, const std::vector<Arc>& arcs,
                                     const std::vector<std::vector<std::uint32_t>>& members) {
  const auto own_length = [&](const Arc& arc) {
    return static_cast<double>(arc.top) - static_cast<double>(body.distance[arc.root]);
  };
  const auto max_distance = static_cast<double>(body.distance[body.order.front()]);
  std::vector<std::uint8_t> is_limb;
  for (std::size_t k = 0; k < arcs.size(); ++k) {
    const Arc& arc = arcs[k];
    double longest = 0;
    for (const std::uint32_t i : arc.nested)
      if (body.distance[arcs[i].root] == arc.top)  // sits on the arc directly
        longest = std::max(longest, own_length(arcs[i]));
    const double volume =
        static_cast<double>(members[k].size()) / static_cast<double>(body.solid.size());
    is_limb.push_back(arc.nested.empty() || (arc.root != body.center &&
                                             own_length(arc) >= kMinInnerLength * max_distance &&
                                             own_length(arc) >= kMinInnerLengthInLimbs * longest &&
                                             volume <= kMaxInnerVolume));
  }
  return is_limb;
}

/// Computes which limbs each ball belongs to, the balls' distances from the centre and the roots,
/// and the distances between tips. `arcs`, `members`: per limb, its arc and collect_members().
void add_balls(const Body& body, const std::vector<Ball>& balls, const std::vector<Arc>& arcs,
               const std::vector<std::vector<std::uint32_t>>& members, Limbs& limbs) {
  const double unit = body.solid.unit();
  std::vector<std::uint32_t> ball_voxels(balls.size());
  parallel_for(static_cast<std::int64_t>(balls.size()), [&](std::int64_t b) {
    const auto i = static_cast<std::size_t>(b);
    ball_voxels[i] = nearest_voxel(body.solid, balls[i].center);
  });
  for (const std::uint32_t i : ball_voxels)
    limbs.ball_distances.push_back(static_cast<double>(body.distance[i]) * unit);
  limbs.ball_limbs.assign(balls.size(), 0);
  limbs.ball_root_distances.resize(arcs.size());
  limbs.tip_distances.resize(arcs.size());
  parallel_for(static_cast<std::int64_t>(arcs.size()), [&](std::int64_t k) {
    const auto limb = static_cast<std::size_t>(k);
    const auto from_root = geodesic_distances(body.solid, std::span(&arcs[limb].root, 1));
    for (const std::uint32_t i : ball_voxels)
      limbs.ball_root_distances[limb].push_back(static_cast<double>(from_root[i]) * unit);
    const auto from_tip = geodesic_distances(body.solid, std::span(&arcs[limb].tip, 1));
    for (const Arc& other : arcs)
      limbs.tip_distances[limb].push_back(static_cast<double>(from_tip[other.tip]) * unit);
  });
  for (std::size_t limb = 0; limb < arcs.size(); ++limb)
    for (std::size_t b = 0; b < balls.size(); ++b)
      if (std::binary_search(members[limb].begin(), members[limb].end(), ball_voxels[b]))
        limbs.ball_limbs[b] |= 1u << limb;
}

/// Computes the object's middle, RMS size, height range, centre and distances from it.
void measure_whole(const Body& body, Limbs& limbs) {
  const VoxelSolid& solid = body.solid;
  const double weight = 1 / static_cast<double>(solid.size());
  limbs.low = limbs.high = solid.center(0).y;
  for (std::uint32_t i = 0; i < solid.size(); ++i) {
    const Vec3d p = solid.center(i);
    limbs.middle = limbs.middle + p * weight;
    limbs.low = std::min(limbs.low, p.y);
    limbs.high = std::max(limbs.high, p.y);
  }
  double square = 0;
  for (std::uint32_t i = 0; i < solid.size(); ++i) {
    const Vec3d d = solid.center(i) - limbs.middle;
    square += weight * dot(d, d);
  }
  limbs.rms = square > 0 ? std::sqrt(square) : 1;
  limbs.center = solid.center(body.center);
  limbs.mean_distance = body.mean_distance * solid.unit();
  limbs.max_distance = static_cast<double>(body.distance[body.order.front()]) * solid.unit();
}

/// Fraction of the solid's voxels whose mirror image lies in the solid, estimated from about 4000
/// voxels. The plane's normal has the given azimuth, and the plane is `offset` from `middle` along
/// it.
double mirror_overlap(const VoxelSolid& solid, Vec3d middle, double azimuth, double offset) {
  constexpr std::uint32_t kSamples = 4000;
  const Vec3d normal = {exact::sin(azimuth), 0, exact::cos(azimuth)};
  const auto count = static_cast<std::uint32_t>(solid.size());
  const std::uint32_t stride = std::max(1u, count / kSamples);
  std::size_t sample_count = 0, covered_count = 0;
  for (std::uint32_t i = 0; i < count; i += stride, ++sample_count) {
    const Vec3d p = solid.center(i);
    covered_count += solid.contains(p - normal * (2 * (dot(p - middle, normal) - offset)));
  }
  return static_cast<double>(covered_count) / static_cast<double>(sample_count);
}

/// Counts the pairs of tips that are swapped by the reflection in the vertical plane through
/// Limbs::middle whose normal has this azimuth.
int count_swapped(const Limbs& limbs, double azimuth) {
  // Max distance from a tip to another tip's mirror image, as a fraction of Limbs::rms.
  constexpr double kMaxDistance = 0.35;
  const Vec3d normal = {exact::sin(azimuth), 0, exact::cos(azimuth)};
  std::vector<Vec3d> tips;
  for (const Limb& limb : limbs.limbs)
    if (limb.nested.empty()) tips.push_back(limb.tip() - limbs.middle);
  // The tip nearest to the mirror image of tip i; i itself if none is near.
  const auto find_image = [&](std::size_t i) {
    const Vec3d image = tips[i] - normal * (2 * dot(tips[i], normal));
    std::size_t nearest = 0;
    for (std::size_t k = 1; k < tips.size(); ++k)
      if (length(tips[k] - image) < length(tips[nearest] - image)) nearest = k;
    return length(tips[nearest] - image) < kMaxDistance * limbs.rms ? nearest : i;
  };
  int swapped = 0;
  for (std::size_t i = 0; i < tips.size(); ++i) {
    const std::size_t k = find_image(i);
    swapped += k > i && find_image(k) == i;
  }
  return swapped;
}

/// Finds Limbs::mirror_planes among 60 azimuths. Of the parallel planes at five offsets from the
/// centroid, the one with the largest overlap counts.
std::vector<MirrorPlane> find_mirror_planes(const VoxelSolid& solid, const Limbs& limbs) {
  constexpr int kAngles = 60, kOffsets = 5;
  constexpr double kOffsetStep = 1.5;  // distance between neighbouring parallel planes, in voxels
  std::array<MirrorPlane, kAngles> planes;
  parallel_for(kAngles, [&](std::int64_t k) {
    MirrorPlane& plane = planes[static_cast<std::size_t>(k)];
    plane.azimuth = exact::kPi * static_cast<double>(k) / kAngles;
    for (int i = 0; i < kOffsets; ++i) {
      const double offset = kOffsetStep * (i - kOffsets / 2) * static_cast<double>(solid.grid.cell);
      plane.overlap =
          std::max(plane.overlap, mirror_overlap(solid, limbs.middle, plane.azimuth, offset));
    }
    plane.swapped = count_swapped(limbs, plane.azimuth);
  });
  std::stable_sort(planes.begin(), planes.end(), [](const MirrorPlane& a, const MirrorPlane& b) {
    return score_plane(a) > score_plane(b);
  });
  std::vector<MirrorPlane> distinct;
  for (const MirrorPlane& plane : planes)
    if (std::all_of(distinct.begin(), distinct.end(), [&](const MirrorPlane& better) {
          const double angle = std::fabs(plane.azimuth - better.azimuth);
          return std::min(angle, exact::kPi - angle) >= kMinPlaneAngle;
        }))
      distinct.push_back(plane);
  return distinct;
}

}  // namespace

double score_plane(const MirrorPlane& plane) {
  constexpr double kSwapBonus = 0.05;
  return plane.overlap + kSwapBonus * std::min(plane.swapped, 2);
}

Limbs find_limbs(const std::vector<Ball>& balls) {
  Limbs limbs;
  Body body = make_body(balls);
  if (body.solid.size() == 0) return limbs;
  measure_whole(body, limbs);
  std::vector<Arc> arcs = find_arcs(body, prominent_tips(body));
  std::vector<std::vector<std::uint32_t>> members(arcs.size());
  parallel_for(static_cast<std::int64_t>(arcs.size()), [&](std::int64_t k) {
    const auto i = static_cast<std::size_t>(k);
    members[i] = collect_members(body, arcs[i]);
  });
  const std::vector<std::uint8_t> is_limb = mark_limbs(body, arcs, members);
  // List the limbs. An arc's nested arcs stand before it, so their limbs' indices are known.
  std::vector<std::uint32_t> limb_index(arcs.size(), kNone);
  std::vector<Arc> limb_arcs;
  std::vector<std::vector<std::uint32_t>> limb_members;
  for (std::size_t k = 0; k < arcs.size(); ++k) {
    if (!is_limb[k]) continue;
    limb_index[k] = static_cast<std::uint32_t>(limb_arcs.size());
    Limb limb = make_limb(body, arcs[k], members[k]);
    for (const std::uint32_t i : arcs[k].nested)
      if (limb_index[i] != kNone) limb.nested.push_back(limb_index[i]);
    limbs.limbs.push_back(std::move(limb));
    limb_arcs.push_back(std::move(arcs[k]));
    limb_members.push_back(std::move(members[k]));
  }
  add_balls(body, balls, limb_arcs, limb_members, limbs);
  limbs.sample = std::move(body.sample);
  limbs.mirror_planes = find_mirror_planes(body.solid, limbs);
  return limbs;
}

}  // namespace polymorph
