#include <algorithm>

#include "base/activity.h"
#include "base/log.h"
#include "base/plural.h"
#include "inspect/inspection.h"
#include "interchange/json_vectors.h"
#include "model/load/load_model.h"
#include "scene/animated_model.h"

namespace polymorph {

JsonValue to_json(const Diagnosis& diagnosis) {
  return {{"triangles", diagnosis.triangles},
          {"closed", diagnosis.closed},
          {"genus", diagnosis.genus},
          {"shells", diagnosis.shells},
          {"boundary_edges", diagnosis.boundary_edges},
          {"volume", diagnosis.volume},
          {"area", diagnosis.area}};
}

std::string describe_topology(const Diagnosis& diagnosis) {
  return diagnosis.closed ? fmt::format("closed, genus {}", diagnosis.genus) : "not closed";
}

Result<Inspection> inspect_model(const std::string& file) {
  // Load the model, and look for its faults.
  PM_TRY(const LoadedModel loaded, [&] {
    const Activity activity("reading " + file);
    return load_model(file);
  }());
  for (const std::string& warning : loaded.warnings) log_warning("{}", warning);
  const Diagnosis d = [&] {
    const Activity activity("looking for faults in " + file);
    return diagnose_fully(loaded.model);
  }();
  // Write the JSON.
  const Vec3 size = d.box.size();
  Inspection out;
  out.json = {{"file", file}, {"points", d.points}};
  out.json.update(to_json(d));
  out.json.update({{"euler", d.euler},
                   {"non_manifold_edges", d.non_manifold_edges},
                   {"size", to_array(size)},
                   {"labels", loaded.model.label_names},
                   {"textures", loaded.model.textures.size()}});
  const Animation animation = read_animation(file);
  for (const std::string& name : animation.names) out.json["animations"].push_back(name);
  // Write the text.
  out.text += fmt::format("{}: {} points, {} triangles, {}\n", file, d.points, d.triangles,
                          plural(d.shells, "shell"));
  out.text += fmt::format("  {}, box {:.4g} x {:.4g} x {:.4g}, volume {:.4g}, area {:.4g}\n",
                          describe_topology(d), size.x, size.y, size.z, d.volume, d.area);
  constexpr std::size_t kMaxLabels = 100;
  const std::vector<std::string>& names = loaded.model.label_names;
  std::string labels;
  for (std::size_t i = 0; i < std::min(names.size(), kMaxLabels); ++i)
    labels += (i == 0 ? "" : ", ") + names[i];
  if (names.size() > kMaxLabels)
    labels += fmt::format(" and {} more (--json has them all)", names.size() - kMaxLabels);
  out.text += fmt::format("  labels: {}\n  {}, {}\n", labels,
                          plural(loaded.model.materials.size(), "material"),
                          plural(loaded.model.textures.size(), "texture"));
  if (!animation.names.empty()) {
    out.text += fmt::format(
        "  {}, {}: {} poses, {} per second\n", plural(animation.names.size(), "animation"),
        fmt::join(animation.names, ", "), animation.pose_count(), animation.poses_per_second);
    if (const std::string others =
            describe_other_animations({file, /*animation=*/{}, /*number=*/1});
        !others.empty())
      out.text += fmt::format("  {}\n", others);
  }
  for (const std::string& problem : describe_problems(d))
    out.text += fmt::format("  {}\n", problem);
  for (const std::string& oddity : describe_oddities(d))
    out.text += fmt::format("  harmless: {}\n", oddity);
  if (const std::string crossings = describe_crossings(d); !crossings.empty())
    out.text += fmt::format("  {}\n", crossings);
  return out;
}

}  // namespace polymorph
