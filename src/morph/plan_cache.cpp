#include "morph/plan_cache.h"

#include <algorithm>
#include <span>
#include <type_traits>

#include "base/cache_file.h"
#include "base/hash.h"
#include "morph/cost.h"

namespace polymorph {
namespace {

// No struct that is hashed or stored has padding.
static_assert(sizeof(Ball) == 11 * sizeof(float) && sizeof(Vec3) == 3 * sizeof(float) &&
              sizeof(Pair) == 4 * sizeof(float) + sizeof(double) &&
              sizeof(LimbCurve) == 4 * LimbCurve::kPoints * sizeof(float) &&
              sizeof(Mat3) == 9 * sizeof(double) && std::is_trivially_copyable_v<Mat3>);

/// Writes the size of from_limbs, then from_limbs, to_limbs and the names, one line per pair of
/// limbs.
void put_limbs(std::string& bytes, const Correspondence& correspondence) {
  std::string names;
  for (const auto& [from, to] : correspondence.limb_names) names += from + "\t" + to + "\n";
  put(bytes, static_cast<std::uint64_t>(correspondence.from_limbs.size()));
  put_array(bytes, correspondence.from_limbs);
  put_array(bytes, correspondence.to_limbs);
  put(bytes, static_cast<std::uint64_t>(names.size()));
  bytes += names;
}

/// Reads what put_limbs() wrote, and removes it from `bytes`. Returns false if it does not fit the
/// numbers of balls, `from` and `to`.
bool take_limbs(std::string_view& bytes, std::size_t from, std::size_t to,
                Correspondence& correspondence) {
  if (bytes.size() < sizeof(std::uint64_t)) return false;
  const auto ball_count = take<std::uint64_t>(bytes);
  if (ball_count != 0) {
    if (ball_count != from || bytes.size() < (from + to) * sizeof(std::int32_t)) return false;
    correspondence.from_limbs = take_array<std::int32_t>(bytes, from);
    correspondence.to_limbs = take_array<std::int32_t>(bytes, to);
  }
  if (bytes.size() < sizeof(std::uint64_t)) return false;
  const auto length = take<std::uint64_t>(bytes);
  if (bytes.size() < length) return false;
  std::string_view names = bytes.substr(0, length);
  bytes.remove_prefix(length);
  while (!names.empty()) {
    const std::size_t tab = names.find('\t'), end = names.find('\n');
    if (end == names.npos || tab > end) return false;
    correspondence.limb_names.emplace_back(names.substr(0, tab),
                                           names.substr(tab + 1, end - tab - 1));
    names.remove_prefix(end + 1);
  }
  return true;
}

/// Writes the numbers of curves and balls, then the curves.
void put_curves(std::string& bytes, const LimbCurves& curves) {
  for (const std::size_t count :
       {curves.matched.size(), curves.lone.size(), curves.stations.size()})
    put(bytes, static_cast<std::uint64_t>(count));
  put_array(bytes, curves.matched);
  put_array(bytes, curves.lone);
  put_array(bytes, curves.counterparts);
  put_array(bytes, curves.lone_limbs);
  put_array(bytes, curves.stations);
}

/// Reads what put_curves() wrote, and removes it from `bytes`. Returns false if it does not fit the
/// number of balls, `balls`.
bool take_curves(std::string_view& bytes, std::size_t balls, LimbCurves& curves) {
  if (bytes.size() < 3 * sizeof(std::uint64_t)) return false;
  const auto matched = take<std::uint64_t>(bytes), lone = take<std::uint64_t>(bytes),
             stations = take<std::uint64_t>(bytes);
  if (matched > balls || lone > balls || (stations != 0 && stations != balls) ||
      bytes.size() < (matched + lone) * sizeof(LimbCurve) + lone * sizeof(Vec3) +
                         stations * (sizeof(std::int32_t) + sizeof(float)))
    return false;
  curves.matched = take_array<LimbCurve>(bytes, matched);
  curves.lone = take_array<LimbCurve>(bytes, lone);
  curves.counterparts = take_array<Vec3>(bytes, lone);
  curves.lone_limbs = take_array<std::int32_t>(bytes, stations);
  curves.stations = take_array<float>(bytes, stations);
  return std::all_of(curves.lone_limbs.begin(), curves.lone_limbs.end(), [&](std::int32_t limb) {
    return limb >= kNoLabel && limb < static_cast<std::int32_t>(lone);
  });
}

}  // namespace

std::string correspondence_key(const PlanSide& from, const PlanSide& to, FieldKind kind,
                               const PlanSettings& settings) {
  // The bindings name every setting, so that a new one does not compile until it is added here. The
  // settings' landmarks are already in the sides, and so are the labels; limbs also depend on
  // whether the user has named any label.
  const auto& [method, seed, align, weights, label_mode, structure, labels, landmarks] = settings;
  const auto& [align_gain, align_tip_residual, size_weight, feature_weight, landmark_weight,
               label_weight] = weights;
  Hasher hasher;
  hasher.add("plan").add(kPlanVersion).add(static_cast<std::uint8_t>(kind));
  hasher.add(static_cast<std::uint8_t>(method)).add(seed);
  hasher.add(static_cast<std::uint8_t>(align)).add(align_gain).add(align_tip_residual);
  hasher.add(size_weight).add(feature_weight).add(landmark_weight).add(label_weight);
  hasher.add(static_cast<std::uint8_t>(label_mode)).add(static_cast<std::uint8_t>(structure));
  hasher.add(static_cast<std::uint8_t>(labels.empty() ? 0 : 1));
  for (const PlanSide* side : {&from, &to}) {
    hasher.add(std::span<const Ball>(side->balls));
    hasher.add(std::span<const std::int32_t>(side->labels));
    hasher.add(std::span<const Vec3>(side->landmarks));
    hasher.add(static_cast<std::uint8_t>(side->front ? 1 : 0)).add(side->front.value_or(0));
  }
  return hasher.hex();
}

std::optional<Correspondence> load_correspondence(const std::filesystem::path& folder,
                                                  const std::string& key, const PlanSide& from,
                                                  const PlanSide& to) {
  const auto file = load_cached(folder, key, kPlanFiles);
  if (!file) return std::nullopt;
  const char* problem = nullptr;
  const auto content = cached_content(*file, key, kPlanFiles, problem);
  const std::size_t balls = from.balls.size() + to.balls.size();
  const std::size_t min_size = sizeof(Mat3) + balls * sizeof(double);
  if (!content || content->size() < min_size) return std::nullopt;
  std::string_view bytes = *content;
  Correspondence correspondence;
  correspondence.rotation = take<Mat3>(bytes);
  correspondence.from_masses = take_array<double>(bytes, from.balls.size());
  correspondence.to_masses = take_array<double>(bytes, to.balls.size());
  if (!take_limbs(bytes, from.balls.size(), to.balls.size(), correspondence) ||
      !take_curves(bytes, from.balls.size(), correspondence.from_curves) ||
      !take_curves(bytes, to.balls.size(), correspondence.to_curves) ||
      bytes.size() % sizeof(Pair) != 0)
    return std::nullopt;
  correspondence.pairs = take_array<Pair>(bytes, bytes.size() / sizeof(Pair));
  const bool in_range = std::all_of(
      correspondence.pairs.begin(), correspondence.pairs.end(),
      [&](const Pair& pair) { return pair.from < from.balls.size() && pair.to < to.balls.size(); });
  if (correspondence.pairs.empty() || !in_range) return std::nullopt;
  return correspondence;
}

void store_correspondence(const std::filesystem::path& folder, const std::string& key,
                          std::string_view origin, const Correspondence& correspondence) {
  std::string bytes;
  put(bytes, correspondence.rotation);
  put_array(bytes, correspondence.from_masses);
  put_array(bytes, correspondence.to_masses);
  put_limbs(bytes, correspondence);
  put_curves(bytes, correspondence.from_curves);
  put_curves(bytes, correspondence.to_curves);
  put_array(bytes, correspondence.pairs);
  store_cached(folder, key, kPlanFiles, origin, bytes);
}

}  // namespace polymorph
