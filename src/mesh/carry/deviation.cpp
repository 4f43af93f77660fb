#include "mesh/carry/deviation.h"

#include <algorithm>
#include <array>
#include <utility>

#include "base/parallel.h"

namespace polymorph {
namespace {

/// A triangle's sides are halved at most so many times.
constexpr int kDepth = 10;

struct Corner {
  Vec3 point;
  float distance;
  std::uint32_t triangle;  ///< of the other mesh
};
using Piece = std::array<Corner, 3>;

/// One triangle's measurement.
class TriangleDeviation {
 public:
  TriangleDeviation(const MeshQuery& other, const DeviationSettings& settings)
      : other_(other), settings_(settings) {}

  Deviation::OfTriangle measure(const Piece& whole) {
    for (const Corner& corner : whole)
      if (corner.distance >= furthest_) furthest_ = corner.distance, of_.place = corner.point;
    divide(whole, 0);
    std::sort(of_.witnesses.begin(), of_.witnesses.end());
    of_.witnesses.erase(std::unique(of_.witnesses.begin(), of_.witnesses.end()),
                        of_.witnesses.end());
    return std::move(of_);
  }

 private:
  float enough() const { return std::max(settings_.negligible, furthest_ + settings_.precision); }

  /// No point of the piece is further off than this; exact where that is enough.
  float bound_of(const Piece& piece) const {
    float longest = 0, furthest = 0;
    for (int k = 0; k < 3; ++k) {
      longest = std::max(longest, length(piece[k].point - piece[(k + 1) % 3].point));
      furthest = std::max(furthest, piece[k].distance);
    }
    // Each point has a corner within 1/sqrt 3 of the longest side (Jung 1901).
    float bound = furthest + 0.57736f * longest;
    if (bound <= enough()) return bound;
    // The distance from one triangle is convex: largest at a corner.
    for (int n = 0; n < 3; ++n) {
      float from_one = 0;
      for (int k = 0; k < 3 && from_one < bound; ++k)
        from_one = std::max(from_one, piece[k].triangle == piece[n].triangle
                                          ? piece[k].distance
                                          : other_.distance_to(piece[k].point, piece[n].triangle));
      bound = std::min(bound, from_one);
    }
    return bound;
  }

  Corner middle(const Corner& a, const Corner& b) {
    const Vec3 p = (a.point + b.point) * 0.5f;
    const ClosestPoint hit = other_.closest(p, a.distance <= b.distance ? a.triangle : b.triangle);
    const Corner c{p, hit.distance, hit.triangle};
    if (c.distance > furthest_) furthest_ = c.distance, of_.place = c.point;
    if (c.distance > settings_.listed) of_.listed.push_back({c.point, c.distance, c.triangle});
    return c;
  }

  void divide(const Piece& piece, int depth) {
    const float bound = bound_of(piece);
    if (depth == kDepth || bound <= enough()) {
      of_.distance = std::max(of_.distance, bound);
      for (const Corner& corner : piece) of_.witnesses.push_back(corner.triangle);
      return;
    }
    const auto& [a, b, c] = piece;
    const Corner ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
    for (const Piece& part : {Piece{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}})
      divide(part, depth + 1);
  }

  const MeshQuery& other_;
  const DeviationSettings& settings_;
  float furthest_ = 0;
  Deviation::OfTriangle of_;
};

/// What is known of a triangle, with the other mesh's numbers of now. Whether that is so still: far
/// triangles may have come nearer where the other mesh has changed.
bool recall(const KnownDeviation& known, std::uint32_t f, float negligible,
            Deviation::OfTriangle& of) {
  if (known.own[f] == KnownDeviation::kNew) return false;
  const Deviation::OfTriangle& last = known.last.triangles[known.own[f]];
  if (!known.is_other_same) {
    if (last.distance > negligible) return false;
    const auto is_gone = [&](std::uint32_t t) { return known.other[t] == KnownDeviation::kNew; };
    if (std::any_of(last.witnesses.begin(), last.witnesses.end(), is_gone)) return false;
  }
  of = last;
  if (!known.is_other_same) {
    for (std::uint32_t& t : of.witnesses) t = known.other[t];
    for (Deviation::Listed& listed : of.listed) {
      if (known.other[listed.triangle] == KnownDeviation::kNew) return false;
      listed.triangle = known.other[listed.triangle];
    }
  }
  return true;
}

}  // namespace

Deviation deviation(std::span<const Vec3> points, std::span<const Triangle> triangles,
                    const MeshQuery& other, const DeviationSettings& settings,
                    std::vector<std::uint32_t> hints, const KnownDeviation* known) {
  Deviation d;
  d.nearest = std::move(hints);
  const std::vector<ClosestPoint> hits = other.closest(points, d.nearest);
  d.triangles.resize(triangles.size());
  parallel_for(
      static_cast<std::int64_t>(triangles.size()),
      [&](std::int64_t i) {
        const auto f = static_cast<std::uint32_t>(i);
        if (known && recall(*known, f, settings.negligible, d.triangles[f])) return;
        Piece whole;
        for (int k = 0; k < 3; ++k) {
          const std::uint32_t v = triangles[f].v[k];
          whole[k] = {points[v], hits[v].distance, hits[v].triangle};
        }
        d.triangles[f] = TriangleDeviation(other, settings).measure(whole);
        for (int k = 0; k < 3; ++k)
          if (whole[k].distance > settings.listed)
            d.triangles[f].listed.push_back({whole[k].point, whole[k].distance, whole[k].triangle});
      },
      64);
  return d;
}

}  // namespace polymorph
