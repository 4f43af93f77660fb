#include "model/load/asset_path.h"

#include <algorithm>

#include "base/text.h"

namespace polymorph {
namespace {

namespace fs = std::filesystem;

bool is_file(const fs::path& path) {
  std::error_code error;
  return fs::is_regular_file(path, error);
}

/// Tests whether a path lies in a folder, without following links.
bool is_inside(const fs::path& root, const fs::path& path) {
  const fs::path relative = path.lexically_normal().lexically_relative(root.lexically_normal());
  return !relative.empty() && *relative.begin() != "..";
}

}  // namespace

AssetFinder::AssetFinder(fs::path root, const fs::path& model) : root_(std::move(root)) {
  std::error_code error;
  if (!fs::is_symlink(model, error)) return;
  const fs::path file = fs::canonical(model, error);
  if (!error) linked_ = file.parent_path();
}

bool AssetFinder::is_usable(const fs::path& path) const {
  std::error_code error;
  const fs::path root = fs::canonical(root_.empty() ? fs::path(".") : root_, error);
  if (error) return false;
  const fs::path target = fs::canonical(path, error);
  if (error || !is_file(target)) return false;
  return is_inside(root, target) || (!linked_.empty() && is_inside(linked_, target));
}

fs::path AssetFinder::find_any_case(const fs::path& folder, const fs::path& relative) {
  fs::path resolved = folder;
  for (const fs::path& component : relative) {
    std::error_code error;
    if (component == "." || component == ".." || fs::exists(resolved / component, error)) {
      resolved /= component;
      continue;
    }
    const auto& names = names_in(resolved);
    const auto name = names.find(lower_case(component.string()));
    if (name == names.end()) return {};
    resolved /= name->second;
  }
  return is_usable(resolved) ? resolved : fs::path{};
}

const std::map<std::string, std::string>& AssetFinder::names_in(const fs::path& folder) {
  const auto [entry, added] = folders_.try_emplace(folder);
  if (!added) return entry->second;
  std::error_code error;
  fs::directory_iterator it(folder.empty() ? fs::path(".") : folder, error);
  for (const fs::directory_iterator end; !error && it != end; it.increment(error)) {
    const std::string name = it->path().filename().string();
    std::string& first = entry->second.try_emplace(lower_case(name), name).first->second;
    first = std::min(first, name);  // if names differ only in case, the same one on any machine
  }
  return entry->second;
}

Result<AssetPath> AssetFinder::find(const fs::path& folder, std::string_view name) {
  std::string text(name);
  std::replace(text.begin(), text.end(), '\\', '/');
  const bool has_drive =
      text.size() > 1 && text[1] == ':' && std::isalpha(static_cast<unsigned char>(text[0]));
  const fs::path named(text);
  // An empty path is the current folder; lexically_relative needs the same form on both sides.
  const fs::path base = folder.empty() ? fs::path(".") : folder;
  const fs::path root = root_.empty() ? fs::path(".") : root_;
  const bool is_outside = has_drive || named.is_absolute() || !is_inside(root, base / named);
  if (!is_outside) {
    if (is_usable(base / named)) return AssetPath{base / named, {}};
    if (is_file(base / named))
      return make_error(ErrorCode::kInput,
                        "\"{}\" is or lies behind a link that leads outside the model's folder and "
                        "is not opened - copy the file beside the model",
                        name);
    const fs::path other_case = find_any_case(base, named);
    if (!other_case.empty())
      return AssetPath{other_case, fmt::format("\"{}\" is written in another case - {} is used",
                                               name, other_case.string())};
  }
  const fs::path file_name = named.filename();
  for (const fs::path& candidate_folder : {base, root}) {
    const fs::path substitute =
        file_name.empty() ? fs::path{} : find_any_case(candidate_folder, file_name);
    if (!substitute.empty())
      return AssetPath{substitute,
                       fmt::format("\"{}\" {} - {} is used", name,
                                   is_outside ? "lies outside the model's folder" : "is not there",
                                   substitute.string())};
  }
  if (is_outside)
    return make_error(
        ErrorCode::kInput,
        "\"{}\" lies outside the model's folder and is not opened - copy {} beside the model", name,
        file_name.string());
  return AssetPath{};
}

}  // namespace polymorph
