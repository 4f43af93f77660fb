#include "mesh/carry/deviation.h"

#include <algorithm>
#include <array>
#include <utility>

#include "base/parallel.h"

namespace polymorph {
namespace {

/// Maximum number of bisections of a triangle's sides.
constexpr int kMaxDepth = 10;

/// A point of the mesh, with its distance from the other mesh.
struct Corner {
  Vec3 point;
  float distance;
  std::uint32_t triangle;  ///< nearest triangle of the other mesh
};
using FacePiece = std::array<Corner, 3>;

/// Finds the closest triangle to a point, or takes one of the hinted ones, or one next to them, if
/// it is so near that the distance need not be resolved.
Corner find_corner(const MeshQuery& other, const DeviationSettings& settings, Vec3 p,
                   std::array<std::uint32_t, 2> hints) {
  std::uint32_t hint = hints[0];
  if (hint < other.triangles.size()) {
    float distance = other.distance_to(p, hint);
    if (distance > settings.sufficient && hints[1] != hint && hints[1] < other.triangles.size())
      if (const float d = other.distance_to(p, hints[1]); d < distance)
        distance = d, hint = hints[1];
    if (distance <= settings.sufficient) return {p, distance, hint};
    if (other.fans)
      if (const auto hit = other.walk_to_closest(p, hint)) {
        if (hit->distance <= settings.negligible - settings.precision)
          return {p, hit->distance, hit->triangle};
        hint = hit->triangle;
      }
  }
  const ClosestPoint hit = other.closest(p, hint);
  return {p, hit.distance, hit.triangle};
}

/// Measures the distances of triangles, one after another, from the other mesh. Memory for
/// witnesses is kept: most triangles have three, and allocating them in steps took a tenth of the
/// time of carrying a mesh.
class TriangleDeviation {
 public:
  TriangleDeviation(const MeshQuery& other, const DeviationSettings& settings)
      : other_(other), settings_(settings) {}

  Deviation::PerTriangle measure(const FacePiece& triangle) {
    furthest_ = 0;
    witnesses_.clear();
    result_ = {};
    for (const Corner& corner : triangle)
      if (corner.distance >= furthest_)
        furthest_ = corner.distance, result_.position = corner.point;
    divide(triangle, 0);
    if (!settings_.are_witnesses_listed) return std::move(result_);
    std::sort(witnesses_.begin(), witnesses_.end());
    result_.witnesses.assign(witnesses_.begin(), std::unique(witnesses_.begin(), witnesses_.end()));
    return std::move(result_);
  }

 private:
  /// A piece whose bound is at most this is not divided: its distance is negligible, or exceeds the
  /// largest one found by no more than the precision.
  float threshold() const {
    return std::max(settings_.negligible, furthest_ + settings_.precision);
  }

  /// Upper bound of the distance over the piece. It is refined only until it is below the
  /// threshold.
  float compute_bound(const FacePiece& piece) const {
    float longest = 0, furthest = 0;
    for (int k = 0; k < 3; ++k) {
      longest = std::max(longest, length(piece[k].point - piece[(k + 1) % 3].point));
      furthest = std::max(furthest, piece[k].distance);
    }
    // Each point of a triangle has a corner within 1/sqrt 3 of its longest side (Jung 1901).
    float bound = furthest + 0.57736f * longest;
    if (bound <= threshold()) return bound;
    // The distance from a single triangle is convex, so over the piece it is largest at a corner.
    for (int n = 0; n < 3; ++n) {
      float max_distance = 0;
      for (int k = 0; k < 3 && max_distance < bound; ++k)
        max_distance =
            std::max(max_distance, piece[k].triangle == piece[n].triangle
                                       ? piece[k].distance
                                       : other_.distance_to(piece[k].point, piece[n].triangle));
      bound = std::min(bound, max_distance);
    }
    return bound;
  }

  /// Finds the distance of the midpoint, and lists the point if it is far.
  Corner measure_midpoint(const Corner& a, const Corner& b) {
    const Vec3 p = (a.point + b.point) * 0.5f;
    const Corner& nearer = a.distance <= b.distance ? a : b;
    const Corner& farther = a.distance <= b.distance ? b : a;
    const Corner c = find_corner(other_, settings_, p, {nearer.triangle, farther.triangle});
    if (c.distance > furthest_) furthest_ = c.distance, result_.position = c.point;
    if (c.distance > settings_.listed) result_.listed.push_back({c.point, c.distance, c.triangle});
    return c;
  }

  void divide(const FacePiece& piece, int depth) {
    const float bound = compute_bound(piece);
    if (depth == kMaxDepth || bound <= threshold()) {
      result_.distance = std::max(result_.distance, bound);
      if (settings_.are_witnesses_listed)
        for (const Corner& corner : piece) witnesses_.push_back(corner.triangle);
      return;
    }
    const auto& [a, b, c] = piece;
    const Corner ab = measure_midpoint(a, b), bc = measure_midpoint(b, c),
                 ca = measure_midpoint(c, a);
    for (const FacePiece& child : {FacePiece{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}})
      divide(child, depth + 1);
  }

  const MeshQuery& other_;
  const DeviationSettings& settings_;
  float furthest_ = 0;                    ///< largest distance of a point evaluated so far
  std::vector<std::uint32_t> witnesses_;  ///< triangles of the other mesh, with repetitions
  Deviation::PerTriangle result_;
};

/// Reuses the earlier measurement of a triangle, if it is still valid, with the present indices of
/// the other mesh. Large distances are invalid if the other mesh has changed: its new triangles may
/// be closer.
bool reuse(const KnownDeviation& known, std::uint32_t f, float negligible,
           Deviation::PerTriangle& result) {
  if (known.former_index[f] == KnownDeviation::kNew) return false;
  const Deviation::PerTriangle& last = known.last.triangles[known.former_index[f]];
  if (!known.is_other_same) {
    if (last.distance > negligible) return false;
    const auto is_removed = [&](std::uint32_t t) {
      return known.present_index[t] == KnownDeviation::kNew;
    };
    if (std::any_of(last.witnesses.begin(), last.witnesses.end(), is_removed)) return false;
  }
  result = last;
  if (!known.is_other_same) {
    for (std::uint32_t& t : result.witnesses) t = known.present_index[t];
    for (Deviation::Listed& listed : result.listed) {
      if (known.present_index[listed.triangle] == KnownDeviation::kNew) return false;
      listed.triangle = known.present_index[listed.triangle];
    }
  }
  return true;
}

}  // namespace

Deviation measure_deviation(MeshView mesh, const MeshQuery& other,
                            const DeviationSettings& settings, std::vector<std::uint32_t> hints,
                            const KnownDeviation* known) {
  Deviation d;
  d.nearest = std::move(hints);
  d.nearest.resize(mesh.points.size(), ClosestPoint::kNoTriangle);
  std::vector<Corner> hits(mesh.points.size());
  parallel_for(
      static_cast<std::int64_t>(hits.size()),
      [&](std::int64_t i) {
        hits[i] = find_corner(other, settings, mesh.points[i], {d.nearest[i], d.nearest[i]});
        d.nearest[i] = hits[i].triangle;
      },
      /*grain=*/256);
  d.triangles.resize(mesh.triangles.size());
  const auto measure_triangle = [&](std::uint32_t f, TriangleDeviation& deviation) {
    if (known && reuse(*known, f, settings.negligible, d.triangles[f])) return;
    FacePiece corners;
    for (int k = 0; k < 3; ++k) corners[k] = hits[mesh.triangles[f].v[k]];
    d.triangles[f] = deviation.measure(corners);
    for (const Corner& corner : corners)
      if (corner.distance > settings.listed)
        d.triangles[f].listed.push_back({corner.point, corner.distance, corner.triangle});
  };
  parallel_ranges(static_cast<std::int64_t>(mesh.triangles.size()), /*grain=*/64,
                  [&](std::int64_t begin, std::int64_t end) {
                    TriangleDeviation deviation(other, settings);
                    for (std::int64_t i = begin; i < end; ++i)
                      measure_triangle(static_cast<std::uint32_t>(i), deviation);
                  });
  return d;
}

}  // namespace polymorph
