#include "morph/plan_cache.h"

#include <algorithm>
#include <span>
#include <type_traits>

#include "base/cache_file.h"
#include "base/hash.h"

namespace polymorph {
namespace {

// No padding is hashed or kept.
static_assert(sizeof(Ball) == 11 * sizeof(float) && sizeof(Vec3) == 3 * sizeof(float) &&
              sizeof(Pair) == 4 * sizeof(float) + sizeof(double) &&
              sizeof(Mat3) == 9 * sizeof(double) && std::is_trivially_copyable_v<Mat3>);

}  // namespace

std::string correspondence_key(const PlanSide& from, const PlanSide& to, FieldKind kind,
                               const PlanSettings& settings) {
  // By name, so that a new setting is not forgotten. Labels and landmarks are the sides' own.
  const auto& [method, seed, align, weights, label_mode, labels, landmarks] = settings;
  const auto& [align_gain, align_tip_residual, size_weight, feature_weight, landmark_weight,
               label_weight] = weights;
  Hasher hasher;
  hasher.add("plan").add(kPlanVersion).add(static_cast<std::uint8_t>(kind));
  hasher.add(static_cast<std::uint8_t>(method)).add(seed);
  hasher.add(static_cast<std::uint8_t>(align)).add(align_gain).add(align_tip_residual);
  hasher.add(size_weight).add(feature_weight).add(landmark_weight).add(label_weight);
  hasher.add(static_cast<std::uint8_t>(label_mode));
  for (const PlanSide* side : {&from, &to}) {
    hasher.add(std::span<const Ball>(side->balls));
    hasher.add(std::span<const std::int32_t>(side->labels));
    hasher.add(std::span<const Vec3>(side->landmarks));
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
  const std::size_t fixed = sizeof(Mat3) + balls * sizeof(double);
  if (!content || content->size() < fixed || (content->size() - fixed) % sizeof(Pair) != 0)
    return std::nullopt;
  std::string_view bytes = *content;
  Correspondence found;
  found.rotation = take<Mat3>(bytes);
  found.from_masses = take_all<double>(bytes, from.balls.size());
  found.to_masses = take_all<double>(bytes, to.balls.size());
  found.pairs = take_all<Pair>(bytes, bytes.size() / sizeof(Pair));
  const bool fits = std::all_of(found.pairs.begin(), found.pairs.end(), [&](const Pair& pair) {
    return pair.from < from.balls.size() && pair.to < to.balls.size();
  });
  if (found.pairs.empty() || !fits) return std::nullopt;
  return found;
}

void store_correspondence(const std::filesystem::path& folder, const std::string& key,
                          std::string_view origin, const Correspondence& found) {
  std::string bytes;
  put(bytes, found.rotation);
  put_all(bytes, found.from_masses);
  put_all(bytes, found.to_masses);
  put_all(bytes, found.pairs);
  store_cached(folder, key, kPlanFiles, origin, bytes);
}

}  // namespace polymorph
