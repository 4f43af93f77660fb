#include "morph/plan.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <span>

#include "base/random.h"
#include "base/result.h"

namespace polymorph {
namespace {

/// The report's correspondence (5.2.7): array order; the surplus of the longer list is paired with
/// pseudo-randomly chosen balls of the other.
std::vector<Pair> pair_by_index(std::size_t from, std::size_t to, std::uint64_t seed) {
  std::vector<Pair> pairs(std::max(from, to));
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const auto random = [&](std::size_t n) {
      return random_below(static_cast<std::uint32_t>(n), seed, 0, i);
    };
    pairs[i].from = i < from ? static_cast<std::uint32_t>(i) : random(from);
    pairs[i].to = i < to ? static_cast<std::uint32_t>(i) : random(to);
  }
  // A ball that serves several pairs gives each an equal share.
  std::vector<float> from_uses(from), to_uses(to);
  for (const Pair& pair : pairs) {
    ++from_uses[pair.from];
    ++to_uses[pair.to];
  }
  for (Pair& pair : pairs) {
    pair.from_share = 1 / from_uses[pair.from];
    pair.to_share = 1 / to_uses[pair.to];
  }
  return pairs;
}

/// A part of a ball's mass.
struct Part {
  std::uint32_t ball = 0;
  double share = 1;  ///< of the ball
  double mass = 0;
};

double total_mass(std::span<const Part> parts) {
  double sum = 0;
  for (const Part& part : parts) sum += part.mass;
  return sum;
}

double coordinate(const Ball& ball, int axis) {
  return axis == 0 ? ball.center.x : axis == 1 ? ball.center.y : ball.center.z;
}

/// Mass-weighted standard deviation along each axis.
std::array<double, 3> spread(std::span<const Part> parts, const std::vector<Ball>& balls) {
  std::array<double, 3> result{};
  const double mass = total_mass(parts);
  for (int axis = 0; axis < 3; ++axis) {
    double mean = 0, square = 0;
    for (const Part& part : parts) mean += part.mass * coordinate(balls[part.ball], axis);
    mean /= mass;
    for (const Part& part : parts) {
      const double d = coordinate(balls[part.ball], axis) - mean;
      square += part.mass * d * d;
    }
    result[static_cast<std::size_t>(axis)] = std::sqrt(square / mass);
  }
  return result;
}

void sort_along(std::vector<Part>& parts, const std::vector<Ball>& balls, int axis) {
  std::sort(parts.begin(), parts.end(), [&](const Part& p, const Part& q) {
    const double x = coordinate(balls[p.ball], axis), y = coordinate(balls[q.ball], axis);
    return x != y ? x < y : p.ball < q.ball;
  });
}

/// Cuts off the first `mass` of the sorted parts; the part on the border is divided, unless one
/// side of it would be a mere sliver.
std::vector<Part> cut_front(std::vector<Part>& parts, double mass) {
  constexpr double kSliver = 0.2;
  std::vector<Part> front;
  std::size_t next = 0;
  for (; next < parts.size(); ++next) {
    Part& part = parts[next];
    const bool last_chance = next + 1 == parts.size();  // both sides keep something
    const double wanted = mass / part.mass;
    if (!last_chance && wanted >= 1 - kSliver) {
      front.push_back(part);
      mass -= part.mass;
      continue;
    }
    if (wanted > kSliver || front.empty()) {
      const double fraction = std::clamp(wanted, kSliver, 1 - kSliver);
      front.push_back({part.ball, part.share * fraction, part.mass * fraction});
      part.share *= 1 - fraction;
      part.mass *= 1 - fraction;
    }
    break;
  }
  parts.erase(parts.begin(), parts.begin() + static_cast<std::ptrdiff_t>(next));
  return front;
}

/// Halves both sets along the axis in which they are widest and goes on with the halves: like goes
/// to like (top to top, left to left) in O(n log^2 n), and neighbours stay neighbours.
class Bisection {
 public:
  Bisection(const std::vector<Ball>& from, const std::vector<Ball>& to) : from_(from), to_(to) {}

  std::vector<Pair> run() {
    divide(whole(from_), whole(to_));
    return std::move(pairs_);
  }

 private:
  static std::vector<Part> whole(const std::vector<Ball>& balls) {
    std::vector<Part> parts(balls.size());
    for (std::size_t i = 0; i < balls.size(); ++i) {
      const double size = 1 / std::sqrt(static_cast<double>(balls[i].a));
      parts[i] = {static_cast<std::uint32_t>(i), 1, size * size * size};
    }
    return parts;
  }
  void divide(std::vector<Part> a, std::vector<Part> b) {
    if (a.size() == 1 || b.size() == 1) {
      emit(a, b);
      return;
    }
    const auto wide_a = spread(a, from_), wide_b = spread(b, to_);
    int axis = 0;
    for (int i = 1; i < 3; ++i) {
      const auto at = [](const std::array<double, 3>& s, int k) {
        return s[static_cast<std::size_t>(k)];
      };
      if (at(wide_a, i) + at(wide_b, i) > at(wide_a, axis) + at(wide_b, axis)) axis = i;
    }
    sort_along(a, from_, axis);
    sort_along(b, to_, axis);
    // One side is cut between two of its balls, the other at the same fraction of its mass.
    const double mass_a = total_mass(a), mass_b = total_mass(b);
    double front_mass = 0;
    std::size_t middle = 0;
    while (middle + 1 < a.size() && (middle == 0 || front_mass + a[middle].mass / 2 < mass_a / 2))
      front_mass += a[middle++].mass;
    const auto border = a.begin() + static_cast<std::ptrdiff_t>(middle);
    std::vector<Part> front_a(a.begin(), border), back_a(border, a.end());
    std::vector<Part> front_b = cut_front(b, mass_b * front_mass / mass_a);
    divide(std::move(front_a), std::move(front_b));
    divide(std::move(back_a), std::move(b));
  }
  void emit(const std::vector<Part>& a, const std::vector<Part>& b) {
    const double mass_a = total_mass(a), mass_b = total_mass(b);
    for (const Part& p : a)
      for (const Part& q : b)
        pairs_.push_back({p.ball, q.ball, static_cast<float>(p.share * q.mass / mass_b),
                          static_cast<float>(q.share * p.mass / mass_a)});
  }

  const std::vector<Ball>& from_;
  const std::vector<Ball>& to_;
  std::vector<Pair> pairs_;
};

/// What the end points say of one pair; its state at u is linear in these.
struct PairEnds {
  Vec3 from, to;
  float from_volume, to_volume;  ///< a^-3/2
  float from_w, to_w;
};

PairEnds ends_of(const MorphPlan& plan, const Pair& pair) {
  const Ball& p = plan.from[pair.from];
  const Ball& q = plan.to[pair.to];
  const auto volume = [](float a) { return 1 / (a * std::sqrt(a)); };
  const auto strength = [&](float w, float share) {
    return plan.kind == FieldKind::kGaussian ? w + std::log(share) : w * share;
  };
  return {p.center,
          q.center,
          volume(p.a),
          volume(q.a),
          strength(p.w, pair.from_share),
          strength(q.w, pair.to_share)};
}

/// A shape between two: linear, brought back to determinant 1.
Sym3 between(const Sym3& s, const Sym3& t, float u) {
  if (u <= 0 || s == t) return s;
  if (u >= 1) return t;
  const Sym3 m{lerp(s.xx, t.xx, u), lerp(s.yy, t.yy, u), lerp(s.zz, t.zz, u),
               lerp(s.xy, t.xy, u), lerp(s.xz, t.xz, u), lerp(s.yz, t.yz, u)};
  const float scale = 1 / std::cbrt(determinant(m));
  return {m.xx * scale, m.yy * scale, m.zz * scale, m.xy * scale, m.xz * scale, m.yz * scale};
}

}  // namespace

MorphPlan plan_morph(std::vector<Ball> from, std::vector<Ball> to, FieldKind kind,
                     const PlanSettings& settings) {
  PM_CHECK(!from.empty() && !to.empty());
  MorphPlan plan{kind, std::move(from), std::move(to), {}};
  switch (settings.method) {
    case PlanMethod::kIndex:
      plan.pairs = pair_by_index(plan.from.size(), plan.to.size(), settings.seed);
      break;
    case PlanMethod::kBisection:
      plan.pairs = Bisection(plan.from, plan.to).run();
      break;
  }
  return plan;
}

std::vector<Ball> balls_at(const MorphPlan& plan, float u) {
  std::vector<Ball> balls(plan.pairs.size());
  for (std::size_t i = 0; i < balls.size(); ++i) {
    const PairEnds ends = ends_of(plan, plan.pairs[i]);
    const float volume = (1 - u) * ends.from_volume + u * ends.to_volume;
    // The ends' own a exactly, not its cube root's square: the two would differ in the last bits.
    const float size = std::cbrt(volume);
    const float a = u <= 0   ? plan.from[plan.pairs[i].from].a
                    : u >= 1 ? plan.to[plan.pairs[i].to].a
                             : 1 / (size * size);
    balls[i] = {(1 - u) * ends.from + u * ends.to, a, (1 - u) * ends.from_w + u * ends.to_w,
                between(plan.from[plan.pairs[i].from].shape, plan.to[plan.pairs[i].to].shape, u)};
  }
  return balls;
}

float ease(Easing easing, float t) {
  t = std::clamp(t, 0.0f, 1.0f);
  switch (easing) {
    case Easing::kLinear:
      return t;
    case Easing::kSmoothstep:
      return t * t * (3 - 2 * t);
    case Easing::kQuintic:
      return t * t * t * (t * (6 * t - 15) + 10);
  }
  return t;
}

}  // namespace polymorph
