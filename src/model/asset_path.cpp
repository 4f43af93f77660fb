#include "model/asset_path.h"

#include <algorithm>
#include <cctype>

namespace polymorph {
namespace {

namespace fs = std::filesystem;

std::string lower_case(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

bool is_file(const fs::path& path) {
  std::error_code error;
  return fs::is_regular_file(path, error);
}

/// `relative` below `folder` with the case of each part as it is on the disk; empty if there is
/// none.
fs::path find_any_case(const fs::path& folder, const fs::path& relative) {
  fs::path found = folder;
  for (const fs::path& part : relative) {
    std::error_code error;
    if (part == "." || part == ".." || fs::exists(found / part, error)) {
      found /= part;
      continue;
    }
    const std::string wanted = lower_case(part.string());
    std::vector<std::string> names;
    fs::directory_iterator it(found.empty() ? fs::path(".") : found, error);
    for (const fs::directory_iterator end; !error && it != end; it.increment(error)) {
      std::string name = it->path().filename().string();
      if (lower_case(name) == wanted) names.push_back(std::move(name));
    }
    if (names.empty()) return {};
    found /= *std::min_element(names.begin(), names.end());  // not the directory's order
  }
  return is_file(found) ? found : fs::path{};
}

bool is_inside(const fs::path& root, const fs::path& path) {
  const fs::path relative = path.lexically_normal().lexically_relative(root.lexically_normal());
  return !relative.empty() && *relative.begin() != "..";
}

}  // namespace

Result<AssetPath> find_asset(const fs::path& root, const fs::path& folder, std::string_view name) {
  std::string text(name);
  std::replace(text.begin(), text.end(), '\\', '/');
  const bool drive =
      text.size() > 1 && text[1] == ':' && std::isalpha(static_cast<unsigned char>(text[0]));
  const fs::path named(text);
  // An empty folder is the current one; lexically_relative needs both sides named alike.
  const fs::path base = folder.empty() ? fs::path(".") : folder;
  const fs::path top = root.empty() ? fs::path(".") : root;
  const bool outside = drive || named.is_absolute() || !is_inside(top, base / named);
  if (!outside) {
    if (is_file(base / named)) return AssetPath{base / named, {}};
    const fs::path other_case = find_any_case(base, named);
    if (!other_case.empty())
      return AssetPath{other_case, fmt::format("\"{}\" is written in another case - {} is used",
                                               name, other_case.string())};
  }
  const fs::path file_name = named.filename();
  for (const fs::path& place : {base, top}) {
    const fs::path beside = file_name.empty() ? fs::path{} : find_any_case(place, file_name);
    if (!beside.empty())
      return AssetPath{beside,
                       fmt::format("\"{}\" {} - {} is used", name,
                                   outside ? "lies outside the model's folder" : "is not there",
                                   beside.string())};
  }
  if (outside)
    return make_error(
        ErrorCode::kInput,
        "\"{}\" lies outside the model's folder and is not opened - copy {} beside the model", name,
        file_name.string());
  return AssetPath{};
}

}  // namespace polymorph
