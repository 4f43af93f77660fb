#include "compare/channel_rule.h"

#include <cctype>
#include <utility>
#include <vector>

#include "base/text.h"

namespace polymorph {
namespace {

bool is_digit(char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; }

/// Tests for id channels of Cryptomatte ranks, such as "crypto_object00.R", where 00 is the rank.
bool is_cryptomatte_id(std::string name) {
  name = lower_case(std::move(name));
  const auto dot = name.rfind('.');
  if (dot == std::string::npos || dot < 2) return false;
  const std::string channel = name.substr(dot + 1);
  const bool has_rank = is_digit(name[dot - 1]) && is_digit(name[dot - 2]);
  return has_rank && name.find("crypto") < dot &&
         (channel == "r" || channel == "b" || channel == "red" || channel == "blue");
}

/// Splits a name into words in lower case: "ViewLayer.objectID" is "view", "layer", "object", "id".
std::vector<std::string> split_words(const std::string& name) {
  std::vector<std::string> words(1);
  // Tests a character's class. False outside the name; i - 1 wraps around for i = 0.
  const auto is_class = [&](std::size_t i, int (*kind)(int)) {
    return i < name.size() && kind(static_cast<unsigned char>(name[i])) != 0;
  };
  for (std::size_t i = 0; i < name.size(); ++i) {
    // A capital begins a word after a lower-case letter. The last of several capitals begins one
    // before a lower-case letter, as in "IDMask", but not before a plural s, as in "IDs".
    const bool plural = name.compare(i + 1, 1, "s") == 0 && !is_class(i + 2, std::isalpha);
    const bool ends_capitals =
        is_class(i - 1, std::isupper) && is_class(i + 1, std::islower) && !plural;
    const bool begins =
        i > 0 && is_class(i, std::isupper) && (is_class(i - 1, std::islower) || ends_capitals);
    if (begins || !is_class(i, std::isalpha)) words.emplace_back();
    if (is_class(i, std::isalpha))
      words.back() += static_cast<char>(std::tolower(static_cast<unsigned char>(name[i])));
  }
  return words;
}

/// Tests for a word that means "id", and for Blender's "IndexOB" and "IndexMA".
bool contains_id_word(const std::string& name) {
  const std::vector<std::string> words = split_words(name);
  for (std::size_t i = 0; i < words.size(); ++i) {
    for (const char* id : {"id", "ids", "label", "labels", "objectid", "materialid", "instanceid"})
      if (words[i] == id) return true;
    if (i > 0 && words[i - 1] == "index" && (words[i] == "ob" || words[i] == "ma")) return true;
  }
  return false;
}

}  // namespace

ChannelRule channel_rule(const std::string& name) {
  if (name == "R" || name == "G" || name == "B" || name == "A") return ChannelRule::kColor;
  if (name == "Z") return ChannelRule::kDepth;
  if (name.starts_with("N.")) return ChannelRule::kNormal;
  if (is_cryptomatte_id(name)) return ChannelRule::kId;
  // Other channels of Cryptomattes are coverages or a preview, whatever words their names have.
  if (lower_case(name).find("crypto") == std::string::npos && contains_id_word(name))
    return ChannelRule::kId;
  return ChannelRule::kOther;
}

}  // namespace polymorph
