#include "compare/channel_rule.h"

#include <algorithm>
#include <cctype>

namespace polymorph {
namespace {

bool is_digit(char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; }

bool is_cryptomatte_id(std::string name) {
  std::transform(name.begin(), name.end(), name.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  const auto dot = name.rfind('.');
  if (dot == std::string::npos || dot < 2) return false;
  const std::string channel = name.substr(dot + 1);
  const bool ranked = is_digit(name[dot - 1]) && is_digit(name[dot - 2]);
  return ranked && name.find("crypto") < dot &&
         (channel == "r" || channel == "b" || channel == "red" || channel == "blue");
}

}  // namespace

ChannelRule channel_rule(const std::string& name) {
  if (name == "R" || name == "G" || name == "B" || name == "A") return ChannelRule::kColor;
  if (name == "Z") return ChannelRule::kDepth;
  if (name.starts_with("N.")) return ChannelRule::kNormal;
  if (name == "id" || name == "label" || name.starts_with("id.") || is_cryptomatte_id(name))
    return ChannelRule::kId;
  return ChannelRule::kOther;
}

}  // namespace polymorph
