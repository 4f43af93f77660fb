#include "morph/limb_names.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string_view>

#include "morph/align.h"

namespace polymorph {
namespace {

/// Height above the object's lowest point, over the object's height.
double relative_height(const Limbs& limbs, Vec3d p) {
  return (p.y - limbs.low) / std::max(limbs.high - limbs.low, 1e-9);
}

Vec3d direction(const Limb& limb) { return normalized(limb.tip() - limb.line.front()); }

/// Indices of the limbs without a noun that sit on no other limb, the largest first.
std::vector<std::size_t> others_by_volume(const Limbs& limbs,
                                          const std::vector<std::string_view>& nouns) {
  std::vector<std::size_t> others;
  for (std::size_t i = 0; i < nouns.size(); ++i)
    if (nouns[i].empty()) others.push_back(i);
  for (const Limb& limb : limbs.limbs)
    for (const std::uint32_t i : limb.nested) std::erase(others, i);
  std::stable_sort(others.begin(), others.end(), [&](std::size_t i, std::size_t k) {
    return limbs.limbs[i].volume > limbs.limbs[k].volume;
  });
  return others;
}

/// Chooses each limb's noun. Limbs that lead down to the floor are legs. With more than two legs,
/// the largest other limb is the head, and the second largest the tail if it points the opposite
/// way. Otherwise the head points up from the shoulders or higher, and the other limbs that begin
/// there are arms.
std::vector<std::string_view> choose_nouns(const Limbs& limbs) {
  // Max relative_height() of a foot; min relative_height() of a shoulder; min upward component of a
  // head's unit direction.
  constexpr double kFloor = 0.15, kShoulder = 0.5, kUp = 0.5;
  std::vector<std::string_view> nouns(limbs.limbs.size());
  std::size_t legs = 0;
  for (std::size_t i = 0; i < nouns.size(); ++i) {
    const Limb& limb = limbs.limbs[i];
    if (relative_height(limbs, limb.tip()) < kFloor && limb.tip().y < limb.root.y)
      nouns[i] = "leg", ++legs;
  }
  const std::vector<std::size_t> others = others_by_volume(limbs, nouns);
  if (legs > 2) {
    if (!others.empty()) nouns[others[0]] = "head";
    for (std::size_t k = 1; k < others.size(); ++k) {
      const Vec3d head = limbs.limbs[others[0]].tip() - limbs.middle,
                  tail = limbs.limbs[others[k]].tip() - limbs.middle;
      if (k == 1 && head.x * tail.x + head.z * tail.z < 0) nouns[others[k]] = "tail";
    }
  } else {
    // Raised arms point upwards, too. The head is the limb nearest to the vertical axis.
    const auto distance2 = [&](std::size_t i) {
      const Vec3d d = limbs.limbs[i].tip() - limbs.middle;
      return d.x * d.x + d.z * d.z;
    };
    std::size_t head = nouns.size();
    for (const std::size_t i : others)
      if (direction(limbs.limbs[i]).y > kUp &&
          relative_height(limbs, limbs.limbs[i].root) > kShoulder &&
          (head == nouns.size() || distance2(i) < distance2(head)))
        head = i;
    if (head < nouns.size()) nouns[head] = "head";
    for (const std::size_t i : others)
      if (i != head && relative_height(limbs, limbs.limbs[i].root) > kShoulder) nouns[i] = "arm";
  }
  for (std::string_view& noun : nouns)
    if (noun.empty()) noun = "limb";
  return nouns;
}

/// Describes the position of a limb in the group of limbs with the same noun, such as "front left
/// "; empty for a group of one. `to_original` undoes the object's rotation.
std::string describe_side(const Limbs& limbs, const Mat3& to_original,
                          const std::vector<std::size_t>& group, std::size_t limb) {
  if (group.size() < 2) return "";
  const auto tip = [&](std::size_t i) { return to_original * limbs.limbs[i].tip(); };
  Vec3d low = tip(group[0]), high = low;
  for (const std::size_t i : group) {
    const Vec3d p = tip(i);
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  // An axis counts if the group's width along it is at least this fraction of its width along the
  // other axis. A limb of a pair gets a word for the wider axis only, a limb of a larger group for
  // each axis that counts.
  constexpr double kMinAspect = 0.25;
  const Vec3d p = tip(limb), middle = (low + high) * 0.5, size = high - low;
  const bool by_x = size.x >= kMinAspect * size.z, by_z = size.z >= kMinAspect * size.x;
  std::string side;
  if (by_z && (group.size() > 2 || !by_x || size.z > size.x))
    side += p.z > middle.z ? "front " : "back ";
  if (by_x && (group.size() > 2 || !by_z || size.x >= size.z))
    side += p.x < middle.x ? "left " : "right ";
  return side;
}

}  // namespace

std::vector<std::string> limb_names(const Limbs& limbs, double angle) {
  const Mat3 to_original = about_vertical(-angle);
  const std::vector<std::string_view> nouns = choose_nouns(limbs);
  std::map<std::string_view, std::vector<std::size_t>> groups;
  for (std::size_t i = 0; i < nouns.size(); ++i) groups[nouns[i]].push_back(i);
  std::vector<std::string> names;
  std::map<std::string, int> uses;
  for (std::size_t i = 0; i < nouns.size(); ++i) {
    std::string name =
        describe_side(limbs, to_original, groups[nouns[i]], i) + std::string(nouns[i]);
    if (const int earlier = uses[name]++; earlier > 0)
      name.append(" ").append(std::to_string(earlier + 1));
    names.push_back(std::move(name));
  }
  return names;
}

}  // namespace polymorph
