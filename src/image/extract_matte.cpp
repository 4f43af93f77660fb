#include "image/extract_matte.h"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cstdint>
#include <set>
#include <vector>

#include "base/json.h"
#include "base/text.h"
#include "image/attributes.h"

namespace polymorph {
namespace {

/// A name in a layer's manifest.
struct ManifestEntry {
  std::string layer, name;
  std::uint32_t id;  ///< bits of the float that stands for the name in the id channels
};

/// Parses a manifest, a JSON object of names and hexadecimal ids, and appends its entries.
Status add_manifest(const std::string& layer, const std::string& text, const std::string& file,
                    std::vector<ManifestEntry>& entries) {
  PM_TRY(const JsonDocument document, parse_json(fmt::format("{}: manifest", file), text));
  for (const JsonMember& member : document.root.members) {
    const std::string& digits = member.value.string;
    std::uint32_t id = 0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), id, 16);
    if (error != std::errc() || end != digits.data() + digits.size())
      return make_error(ErrorCode::kInput, "{}: the Cryptomatte manifest has no id for \"{}\"",
                        file, printable(member.key));
    entries.push_back({layer, member.key, id});
  }
  return Ok{};
}

/// Lists the names of all manifests, layer by layer.
Result<std::vector<ManifestEntry>> list_entries(const Image& image, const std::string& file) {
  std::vector<ManifestEntry> entries;
  constexpr std::string_view kPrefix = "cryptomatte/", kSuffix = "/manifest";
  for (const Attribute& attribute : image.attributes) {
    const std::string& key = attribute.name;
    const auto* text = std::get_if<std::string>(&attribute.value);
    if (!text || !key.starts_with(kPrefix) || !key.ends_with(kSuffix)) continue;
    const std::string layer =
        find_text(image, key.substr(0, key.size() - kSuffix.size()) + "/name");
    PM_TRY_STATUS(add_manifest(layer, *text, file, entries));
  }
  if (entries.empty())
    return make_error(ErrorCode::kInput,
                      "{}: has no Cryptomatte with a manifest - render it with "
                      "--set image.aovs=crypto_object",
                      file);
  return entries;
}

/// Channel indices of a Cryptomatte rank. In each pixel the rank states an id and its coverage.
struct Rank {
  std::size_t id, coverage;
};

/// Finds the ranks of a Cryptomatte layer, in ascending order.
std::vector<Rank> find_ranks(const Image& image, const std::string& layer) {
  // LAYER00, LAYER01 and so on have two ranks each: (R, G) and (B, A).
  struct Spelling {
    const char *id[2], *coverage[2];
  };
  constexpr Spelling kSpellings[] = {
      {{"R", "B"}, {"G", "A"}}, {{"r", "b"}, {"g", "a"}}, {{"red", "blue"}, {"green", "alpha"}}};
  std::vector<Rank> ranks;
  for (int group = 0; group < 100; ++group)
    for (const Spelling& spelling : kSpellings)
      for (int pair = 0; pair < 2; ++pair) {
        const std::string prefix = fmt::format("{}{:02}.", layer, group);
        const int id = image.find_channel(prefix + spelling.id[pair]),
                  coverage = image.find_channel(prefix + spelling.coverage[pair]);
        if (id >= 0 && coverage >= 0)
          ranks.push_back({static_cast<std::size_t>(id), static_cast<std::size_t>(coverage)});
      }
  return ranks;
}

/// Draws the coverage of an entry: in each pixel the sum over the ranks that state its id.
Image sum_coverage(const Image& image, const ManifestEntry& entry) {
  const std::vector<Rank> ranks = find_ranks(image, entry.layer);
  Image matte = make_image(image.width, image.height, {"R", "G", "B"});
  const std::size_t count = image.channel_count();
  for (std::size_t i = 0; i * 3 < matte.pixels.size(); ++i) {
    const float* pixel = &image.pixels[i * count];
    float sum = 0;
    for (const Rank& rank : ranks)
      if (std::bit_cast<std::uint32_t>(pixel[rank.id]) == entry.id) sum += pixel[rank.coverage];
    std::fill_n(&matte.pixels[3 * i], 3, sum);
  }
  return matte;
}

/// Makes the error of a name that no manifest has; it lists up to kMaxListed names.
Error make_unknown_name_error(const std::vector<ManifestEntry>& entries, const std::string& name,
                              const std::string& file) {
  constexpr std::size_t kMaxListed = 60;  // names
  std::set<std::string> known;
  for (const ManifestEntry& entry : entries) known.insert(printable(entry.name));
  std::vector<std::string> names(known.begin(), known.end());
  const std::string guess = did_you_mean(name, names);
  const std::size_t unlisted = names.size() > kMaxListed ? names.size() - kMaxListed : 0;
  names.resize(names.size() - unlisted);
  return make_error(ErrorCode::kUsage, "{}: no matte is called \"{}\"{} (known: {}{})", file,
                    printable(name), guess, join_quoted(names),
                    unlisted > 0 ? fmt::format(" and {} more", unlisted) : "");
}

}  // namespace

Result<Image> extract_matte(const Image& image, const std::string& name, const std::string& file) {
  PM_TRY(const std::vector<ManifestEntry> entries, list_entries(image, file));
  std::optional<Image> matte;
  std::string layers;
  bool is_ambiguous = false;
  for (const ManifestEntry& entry : entries) {
    if (entry.name != name && entry.layer + "." + entry.name != name) continue;
    Image candidate = sum_coverage(image, entry);
    is_ambiguous = is_ambiguous || (matte && matte->pixels != candidate.pixels);
    layers += (layers.empty() ? "" : " or ") + printable(entry.layer + "." + entry.name);
    if (!matte) matte = std::move(candidate);
  }
  if (!matte) return make_unknown_name_error(entries, name, file);
  if (is_ambiguous)
    return make_error(ErrorCode::kUsage, "{}: \"{}\" is another matte in each layer - write {}",
                      file, printable(name), layers);
  return *std::move(matte);
}

}  // namespace polymorph
