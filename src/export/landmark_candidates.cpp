#include "export/landmark_candidates.h"

#include "mesh/closest.h"
#include "morph/limb_names.h"
#include "morph/limbs.h"
#include "morph/match_limbs.h"
#include "scene/load_scene.h"

namespace polymorph {
namespace {

/// The limbs of an object, with their names and tips.
struct NamedLimbs {
  Limbs limbs;
  std::vector<std::string> names;
  std::vector<Vec3> tips;  ///< points of the surface, in the file's coordinates
};

/// Finds the point of the surface nearest to the end of a limb's centre line, extended beyond the
/// limb.
Vec3 find_tip(const Limb& limb, const ClosestPointQuery& surface) {
  // Length of the extension over the length of the line's last segment. It is proportional to this
  // length, because short limbs have blunt ends.
  constexpr double kExtension = 1.5;
  const Vec3d line_end = limb.line[kLimbStations - 1];
  const Vec3d extension = (line_end - limb.line[kLimbStations - 2]) * kExtension;
  return surface.closest(to_float(line_end + extension)).point;
}

/// Finds an object's limbs, and names them. Errors: kInput if the object's scale is 0 along an
/// axis.
Result<NamedLimbs> name_limbs(const PreparedObject& object) {
  const auto to_file = inverse(object.to_scene);
  if (!to_file)
    return make_error(ErrorCode::kInput,
                      "{}: its scale flattens it, so no point of it has a place in its file",
                      object.name);
  NamedLimbs out;
  out.limbs = find_limbs(object.balls);
  out.names = limb_names(out.limbs);
  for (const Limb& limb : out.limbs.limbs)
    out.tips.push_back(apply(*to_file, find_tip(limb, *object.closest)));
  return out;
}

/// Renames limb `k`. Another limb of that name gets the old name of limb `k`, so that names stay
/// unique.
void rename_limb(NamedLimbs& limbs, std::size_t k, const std::string& name) {
  for (std::size_t i = 0; i < limbs.names.size(); ++i)
    if (i != k && limbs.names[i] == name) limbs.names[i] = limbs.names[k];
  limbs.names[k] = name;
}

/// Gives the target's limbs the names of the source's limbs that they are matched with, and lists
/// the tips. `angle`: rotation of the plan about the vertical, in radians.
std::vector<LegCandidates::Tip> list_tips(const NamedLimbs& from, NamedLimbs& to, double angle) {
  std::vector<LegCandidates::Tip> tips;
  std::vector<bool> from_matched(from.names.size()), to_matched(to.names.size());
  if (!from.names.empty() && !to.names.empty())
    for (const auto& [i, k] : match_limbs(from.limbs, to.limbs, angle).limbs) {
      rename_limb(to, k, from.names[i]);
      from_matched[i] = to_matched[k] = true;
      tips.push_back({from.names[i], from.tips[i], to.tips[k]});
    }
  for (std::size_t i = 0; i < from.names.size(); ++i)
    if (!from_matched[i]) tips.push_back({from.names[i], from.tips[i], std::nullopt});
  for (std::size_t k = 0; k < to.names.size(); ++k)
    if (!to_matched[k]) tips.push_back({to.names[k], std::nullopt, to.tips[k]});
  return tips;
}

}  // namespace

std::string landmark_key(const Scene& scene, const ObjectSettings& object) {
  if (object.model.empty()) return object.name;
  const std::filesystem::path file = object.model.filename();
  for (const ChainObject& other : chain_objects(scene))
    if (other.settings->model.filename() == file && other.settings->model != object.model)
      return object.name;
  return file.string();
}

Result<std::vector<LegCandidates>> landmark_candidates(const PreparedScene& prepared) {
  std::vector<LegCandidates> out;
  for (std::size_t a = 0; a < prepared.actors.size(); ++a) {
    const PreparedActor& actor = prepared.actors[a];
    const std::vector<const ObjectSettings*> chain = chain_objects(prepared.scene.actors[a]);
    std::vector<NamedLimbs> limbs;
    for (std::size_t i = 0; i < chain.size(); ++i) {
      PM_TRY(NamedLimbs object_limbs, name_limbs(*actor.objects[i]));
      limbs.push_back(std::move(object_limbs));
    }
    for (std::size_t i = 0; i + 1 < chain.size(); ++i) {
      const std::size_t from = actor.space ? 0 : i;  // all legs of a blend have one source
      if (actor.legs[i]->from != actor.objects[from])
        continue;  // the leg begins with moving balls, which have no file
      const double angle = actor.legs[i]->plan.alignment.rotation_vector.y;
      out.push_back({static_cast<int>(a), static_cast<int>(from), static_cast<int>(i + 1),
                     landmark_key(prepared.scene, *chain[from]),
                     landmark_key(prepared.scene, *chain[i + 1]),
                     list_tips(limbs[from], limbs[i + 1], angle)});
    }
  }
  return out;
}

std::vector<NamedPair> matched_tips(const LegCandidates& leg) {
  std::vector<NamedPair> matched;
  for (const auto& [name, from, to] : leg.tips)
    if (from && to) matched.push_back({name, *from, *to});
  return matched;
}

}  // namespace polymorph
