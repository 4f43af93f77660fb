#include "model/load/mtl.h"

#include <tiny_obj_loader.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <sstream>

#include "base/file.h"
#include "base/text.h"
#include "model/load/asset_path.h"
#include "model/load/text_lines.h"

namespace polymorph {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMaxMtlBytes = 64u << 20;  // of one file
constexpr float kMaxDielectricSpecular = 0.2f;     // above diamond's 0.17

/// One newmtl block. The flags tell which properties it sets, because tinyobjloader does not tell
/// whether a value was given or is the default. Line numbers are from 1.
struct MtlBlock {
  bool kd = false, ks = false, ns = false, pr = false, pm = false;
  std::uint32_t line = 0, texture_line = 0;
  std::size_t begin = 0;  ///< offset of the block in MtlScan::text
};

/// Result of scanning one MTL.
struct MtlScan {
  std::string text;  ///< the supported statements, checked
  std::vector<MtlBlock> blocks;
  std::vector<std::string> warnings;
};

class MtlScanner {
 public:
  MtlScanner(std::string_view text, const std::string& file)
      : lines_(text), file_(file), errors_(file) {}

  Result<MtlScan> scan() {
    while (lines_.next() && !errors_.full()) scan_line(lines_.line());
    if (!errors_.empty()) return errors_.error();
    report(spectral_, "colours are spectral curves - the default colour is used");
    report(before_first_material_, "statements stand before the first newmtl - ignored");
    return std::move(result_);
  }

 private:
  void scan_line(std::string_view line);
  /// Checks `count` numbers (1 or 3) and copies the line; a single number is repeated where three
  /// are required.
  void scan_numbers(std::string_view word, std::string_view text, std::size_t count);
  void report(const Occurrences& events, const char* text) {
    if (events.count > 0)
      result_.warnings.push_back(
          fmt::format("{}:{}: {} {}", file_, events.first_line, events.count, text));
  }

  LineReader lines_;
  std::string file_;
  ErrorList errors_;
  MtlScan result_;
  std::set<std::string> names_;  ///< materials defined so far
  Occurrences spectral_, before_first_material_;
};

void MtlScanner::scan_line(std::string_view line) {
  if (line.empty() || line.front() == '#') return;
  std::string_view arguments = line;
  const std::string_view word = take_word(arguments);
  arguments = trim(arguments);
  if (word == "newmtl") {
    if (arguments.empty()) {
      errors_.add(lines_.number(), "newmtl has no name");
      return;
    }
    if (!names_.emplace(arguments).second)
      result_.warnings.push_back(
          fmt::format("{}:{}: material \"{}\" is defined twice - the first one counts", file_,
                      lines_.number(), printable(arguments)));
    result_.blocks.push_back({});
    result_.blocks.back().line = lines_.number();
    result_.blocks.back().begin = result_.text.size();
    result_.text += fmt::format("newmtl {}\n", arguments);
    return;
  }
  const bool color = word == "Kd" || word == "Ks";
  const bool number = word == "Ns" || word == "Pr" || word == "Pm";
  const bool texture = word == "map_Kd";
  if (!color && !number && !texture) return;
  if (result_.blocks.empty()) {
    before_first_material_.note(lines_.number());
    return;
  }
  if (color && (arguments.starts_with("spectral") || arguments.starts_with("xyz"))) {
    spectral_.note(lines_.number());
    return;
  }
  if (!texture) {
    scan_numbers(word, arguments, color ? 3 : 1);
    return;
  }
  result_.blocks.back().texture_line = lines_.number();
  result_.text += fmt::format("map_Kd {}\n", arguments);
}

void MtlScanner::scan_numbers(std::string_view word, std::string_view text, std::size_t count) {
  std::vector<float> values;
  for (std::string_view token = take_word(text); !token.empty() && !token.starts_with("#");
       token = take_word(text)) {
    const ParsedReal real = parse_real(token);
    if (real.problem) {
      errors_.add(lines_.number(),
                  fmt::format("{} value \"{}\" {}", word, printable(token), real.problem));
      return;
    }
    values.push_back(real.value);
  }
  // "Kd r" alone means r for all three (MTL specification).
  if (values.size() == 1 && count == 3) values.assign(3, values[0]);
  if (values.size() < count) {
    errors_.add(lines_.number(),
                fmt::format("{} has {} of {} numbers", word, values.size(), count));
    return;
  }
  MtlBlock& block = result_.blocks.back();
  (word == "Kd"   ? block.kd
   : word == "Ks" ? block.ks
   : word == "Ns" ? block.ns
   : word == "Pr" ? block.pr
                  : block.pm) = true;
  result_.text += word;
  for (std::size_t i = 0; i < count; ++i) result_.text += fmt::format(" {}", values[i]);
  result_.text += '\n';
}

Vec3 clamp_color(const tinyobj::real_t (&c)[3], float high) {
  return {std::clamp(c[0], 0.0f, high), std::clamp(c[1], 0.0f, high), std::clamp(c[2], 0.0f, high)};
}

MtlMaterial map_material(const tinyobj::material_t& from, const MtlBlock& block) {
  MtlMaterial to;
  Material& m = to.material;
  m.name = from.name;
  to.texture = std::string(trim(from.diffuse_texname));
  to.texture_line = block.texture_line;
  if (!to.texture.empty()) {
    to.uv_scale = {from.diffuse_texopt.scale[0], from.diffuse_texopt.scale[1]};
    to.uv_offset = {from.diffuse_texopt.origin_offset[0], from.diffuse_texopt.origin_offset[1]};
  }
  if (block.kd) m.color = clamp_color(from.diffuse, 1);
  // If Kd is missing, the texture alone gives the colour. A black Kd is ignored, too, because it
  // would hide the texture.
  if (!to.texture.empty() && (!block.kd || m.color == Vec3{})) m.color = {1, 1, 1};
  if (block.pm) m.metallic = std::clamp(from.metallic, 0.0f, 1.0f);
  if (block.ks)
    m.specular = clamp_color(from.specular, m.metallic > 0.5f ? 1.0f : kMaxDielectricSpecular);
  if (block.ns) m.roughness = std::sqrt(2.0f / (std::max(from.shininess, 0.0f) + 2.0f));
  if (block.pr) m.roughness = std::clamp(from.roughness, 0.0f, 1.0f);
  return to;
}

/// Lists the file names of one mtllib line: its whole text (names may contain spaces) or, if there
/// is no such file, each of its words.
std::vector<std::string> list_library_names(AssetFinder& finder, const fs::path& folder,
                                            const std::string& line) {
  const auto exists = [&](const std::string& name) {
    const auto asset = finder.find(folder, name);
    return asset && !asset->path.empty();
  };
  if (line.size() < 4096 && exists(line)) return {line};  // longer paths do not exist (PATH_MAX)
  std::vector<std::string> words;
  std::string_view arguments = line;
  for (std::string_view word = take_word(arguments); !word.empty() && words.size() <= kMaxLibraries;
       word = take_word(arguments))
    words.emplace_back(word);
  if (words.size() < 2) return {line};
  // Too many words are returned, too: load_mtls() reports them.
  if (words.size() > kMaxLibraries || std::any_of(words.begin(), words.end(), exists)) return words;
  return {line};
}

}  // namespace

Result<MtlSet> parse_mtl(std::string_view bytes, const std::string& file) {
  PM_TRY(const std::string_view text, check_text(bytes, file));
  PM_TRY(MtlScan scan, MtlScanner(text, file).scan());
  MtlSet set;
  set.warnings = std::move(scan.warnings);
  if (scan.blocks.empty()) return set;
  // Parse in batches, because tinyobjloader takes more than 2 KB per material.
  constexpr std::size_t kBatch = 1024;
  for (std::size_t first = 0; first < scan.blocks.size(); first += kBatch) {
    const std::size_t last = std::min(first + kBatch, scan.blocks.size());
    const std::size_t begin = scan.blocks[first].begin;
    const std::size_t end = last < scan.blocks.size() ? scan.blocks[last].begin : scan.text.size();
    std::map<std::string, int> ignored_map;
    std::vector<tinyobj::material_t> parsed;
    std::string warning, error;
    std::istringstream stream(scan.text.substr(begin, end - begin));
    tinyobj::LoadMtl(&ignored_map, &parsed, &stream, &warning, &error);
    PM_CHECK(parsed.size() == last - first);
    for (std::size_t i = first; i < last; ++i) {
      set.materials.push_back(map_material(parsed[i - first], scan.blocks[i]));
      set.materials.back().file = file;
    }
  }
  return set;
}

MtlNames::MtlNames(const MtlSet& set) {
  for (const MtlMaterial& material : set.materials)
    by_name_.try_emplace(material.material.name, &material);
}

const MtlMaterial* MtlNames::find(const std::string& name) const {
  const auto entry = by_name_.find(name);
  return entry == by_name_.end() ? nullptr : entry->second;
}

Result<MtlSet> load_mtls(const fs::path& obj, const std::vector<NamedLine>& libraries,
                         bool strict) {
  MtlSet all;
  std::set<fs::path> loaded;  // some exporters repeat the mtllib line for every object
  std::set<std::string> lines, names;
  const fs::path folder = obj.parent_path();
  AssetFinder finder(folder, obj);
  for (const NamedLine& library : libraries) {
    if (!lines.insert(library.name).second) continue;
    const std::string location = fmt::format("{}:{}: mtllib", obj.string(), library.line);
    for (const std::string& name : list_library_names(finder, folder, library.name)) {
      if (!names.insert(name).second) continue;
      if (names.size() > kMaxLibraries)
        return make_error(ErrorCode::kInput,
                          "{} names more than {} material libraries - is this a Wavefront OBJ?",
                          location, kMaxLibraries);
      auto asset = finder.find(folder, name);
      if (!asset) return make_error(ErrorCode::kInput, "{} {}", location, asset.error().message);
      if (asset->path.empty()) {
        if (strict)
          return make_error(ErrorCode::kInput, "{} \"{}\" is not there - put it beside the model",
                            location, printable(name));
        all.warnings.push_back(fmt::format("{} \"{}\" is not there - a default grey is used",
                                           location, printable(name)));
        continue;
      }
      if (!loaded.insert(asset->path).second) continue;
      if (!asset->note.empty()) all.warnings.push_back(fmt::format("{} {}", location, asset->note));
      remember_input(asset->path);
      PM_TRY(const std::string bytes, read_file(asset->path, kMaxMtlBytes));
      PM_TRY(MtlSet file_set, parse_mtl(bytes, asset->path.string()));
      std::move(file_set.materials.begin(), file_set.materials.end(),
                std::back_inserter(all.materials));
      std::move(file_set.warnings.begin(), file_set.warnings.end(),
                std::back_inserter(all.warnings));
    }
  }
  return all;
}

}  // namespace polymorph
