#include "compare/display_mismatch.h"

#include "base/result.h"
#include "base/text.h"
#include "image/attributes.h"
#include "image/image_io.h"

namespace polymorph {
namespace {

/// A header entry that changes how pixels are shown.
struct ShownEntry {
  const char* name;
  const char* label;
  double default_value;  ///< value if the entry is absent
};
constexpr ShownEntry kShownEntries[] = {{kPixelAspectAttribute, "pixel aspect ratio", 1},
                                        {kOrientationAttribute, "orientation", 1},
                                        {kGammaAttribute, "gamma", 0}};

/// Returns the number in a header entry, or its default value if it is absent or a text.
double entry_value(const Image& image, const ShownEntry& entry) {
  for (const Attribute& attribute : image.attributes) {
    if (attribute.name != entry.name) continue;
    if (const int* integer = std::get_if<int>(&attribute.value)) return *integer;
    if (const float* real = std::get_if<float>(&attribute.value)) return static_cast<double>(*real);
  }
  return entry.default_value;
}

/// Entries that are texts. An absent text is "", so `default_value` is unused.
constexpr ShownEntry kShownTexts[] = {{kColorProfileAttribute, "colour profile", 0}};

}  // namespace

std::string describe_display_mismatch(const Image& actual, const Image& reference) {
  std::string text;
  for (const ShownEntry& entry : kShownEntries) {
    const double a = entry_value(actual, entry), b = entry_value(reference, entry);
    const auto value = [&](double v) {
      return v == 0 ? std::string("none") : fmt::format("{:.6g}", v);
    };
    if (a != b)
      text += fmt::format("{}{} {} instead of {}", text.empty() ? "" : ", ", entry.label, value(a),
                          value(b));
  }
  for (const ShownEntry& entry : kShownTexts) {
    const std::string a = find_text(actual, entry.name), b = find_text(reference, entry.name);
    const auto value = [](const std::string& v) {
      return v.empty() ? std::string("none") : printable(v);
    };
    if (a != b)
      text += fmt::format("{}{} {} instead of {}", text.empty() ? "" : ", ", entry.label, value(a),
                          value(b));
  }
  const std::string a = color_space_name(actual), b = color_space_name(reference);
  if (a != b)
    text += fmt::format("{}colour space {} instead of {}", text.empty() ? "" : ", ", printable(a),
                        printable(b));
  return text;
}

}  // namespace polymorph
