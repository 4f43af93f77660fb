#include "morph/easing.h"

#include <algorithm>
#include <cmath>

#include "base/exact_math.h"

namespace polymorph {
namespace {

/// One coordinate, at parameter s, of the Bezier curve with control points 0, p, q, 1.
double bezier(double p, double q, double s) {
  const double r = 1 - s;
  return 3 * r * r * s * p + 3 * r * s * s * q + s * s * s;
}

double bezier_ease(const MotionSettings& motion, double t) {
  const auto coordinate = [&](std::size_t i) { return static_cast<double>(motion.bezier[i]); };
  // `motion.bezier` holds x1, y1, x2, y2. x(s) is monotone for x1, x2 in [0, 1], so bisection finds
  // the s with x(s) = t; 40 steps suffice for a float.
  double low = 0, high = 1;
  for (int i = 0; i < 40; ++i) {
    const double middle = (low + high) / 2;
    (bezier(coordinate(0), coordinate(2), middle) < t ? low : high) = middle;
  }
  return bezier(coordinate(1), coordinate(3), (low + high) / 2);
}

/// Solution of m x'' + b x' + k x = 0 with x(0) = 1, x'(0) = 0. g is the decay rate, w0 the
/// undamped angular frequency.
double spring_deflection(double mass, double damping, double stiffness, double t) {
  const double g = damping / (2 * mass), w0 = std::sqrt(stiffness / mass);
  const double difference = w0 * w0 - g * g;
  // Max |difference|, as a fraction of w0^2, of a spring that counts as critically damped.
  constexpr double kCritical = 1e-9;
  if (difference > kCritical * w0 * w0) {
    const double w = std::sqrt(difference);
    return exact::exp(-g * t) * (exact::cos(w * t) + g / w * exact::sin(w * t));
  }
  if (difference >= -kCritical * w0 * w0) return exact::exp(-g * t) * (1 + g * t);
  // Overdamped: a sum of two decays, at the rates `slow` and `fast`. The equivalent formula with
  // cosh and sinh would overflow under strong damping.
  const double root = std::sqrt(-difference), slow = g - root, fast = g + root;
  return (fast * exact::exp(-slow * t) - slow * exact::exp(-fast * t)) / (fast - slow);
}

double spring_ease(const SpringSettings& s, double inertia, double t) {
  const auto remaining = [&](double at) {
    return spring_deflection(static_cast<double>(s.mass) * inertia, static_cast<double>(s.damping),
                             static_cast<double>(s.stiffness), at);
  };
  // Adds the deflection left at t = 1, weighted by a smoothstep, so that the motion ends at 1.
  return 1 - remaining(t) + remaining(1) * t * t * (3 - 2 * t);
}

}  // namespace

float ease(const MotionSettings& motion, float time, float inertia) {
  if (time <= 0) return 0;
  if (time >= 1) return 1;
  const auto t = static_cast<double>(time);
  double u = t;
  switch (motion.easing) {
    case Easing::kLinear:
      break;
    case Easing::kSmoothstep:
      u = t * t * (3 - 2 * t);
      break;
    case Easing::kQuintic:
      u = t * t * t * (t * (6 * t - 15) + 10);
      break;
    case Easing::kBezier:
      u = bezier_ease(motion, t);
      break;
    case Easing::kSpring:
      u = spring_ease(motion.spring, static_cast<double>(inertia), t);
      break;
  }
  return static_cast<float>(u);
}

}  // namespace polymorph
