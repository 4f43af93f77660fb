// Centre lines of limbs: piecewise linear functions of the fraction of a limb's length.
#pragma once

#include <array>
#include <cstddef>

#include "morph/limbs.h"

namespace polymorph {

/// Number of points of a centre line that is extended to the limb's root and tip.
inline constexpr std::size_t kLinePoints = kLimbStations + 2;

/// Positions of a centre line's points: 0, each limb_station() and 1.
inline constexpr std::array<double, kLinePoints> kLineStations = [] {
  std::array<double, kLinePoints> stations{};
  for (std::size_t k = 0; k < kLimbStations; ++k) stations[k + 1] = limb_station(k);
  stations.back() = 1;
  return stations;
}();

/// Interpolates `values` at the ascending `stations` linearly; constant beyond their ends.
template <class T, std::size_t N>
T interpolated(const std::array<double, N>& stations, const std::array<T, N>& values, double t) {
  if (t <= stations[0]) return values[0];
  for (std::size_t k = 1; k < N; ++k)
    if (t <= stations[k]) {
      const double s = (t - stations[k - 1]) / (stations[k] - stations[k - 1]);
      return values[k - 1] * (1 - s) + values[k] * s;
    }
  return values[N - 1];
}

/// Interpolates values of a centre line's segments, each of which is taken at its segment's middle.
template <class T>
T interpolated(const std::array<T, kLinePoints - 1>& segments, double t) {
  std::array<double, kLinePoints - 1> middles;
  for (std::size_t k = 0; k < middles.size(); ++k)
    middles[k] = (kLineStations[k] + kLineStations[k + 1]) / 2;
  return interpolated(middles, segments, t);
}

}  // namespace polymorph
