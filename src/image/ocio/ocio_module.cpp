#include <OpenColorIO/OpenColorIO.h>

#include <exception>
#include <string>

#include "image/ocio_module.h"

namespace {

namespace OCIO = OCIO_NAMESPACE;

/// Names of linear Rec. 709 in configs: that of the Color Interop Forum, and those in the ACES
/// configs from version 2 on, in ACES 1.2 and in Blender.
constexpr const char* kRec709Names[] = {
    "lin_rec709_scene",       "lin_rec709",     "lin_srgb",
    "Linear Rec.709 (sRGB)",  "Linear Rec.709", "Utility - Linear - Rec.709",
    "Utility - Linear - sRGB"};

/// The returned view, with the storage that its pointer refers to.
struct View : PmOcioView {
  View() : PmOcioView{} {}
  std::string error_text;
  OCIO::ConstCPUProcessorRcPtr processor;
};

void fail(View& view, std::string reason) {
  view.error_text = std::move(reason);
  view.error = view.error_text.c_str();
}

/// Lists the `count` names that `name_at` returns.
template <class NameAt>
std::vector<std::string> list_names(int count, NameAt name_at) {
  std::vector<std::string> names;
  for (int i = 0; i < count; ++i) names.emplace_back(name_at(i));
  return names;
}

/// Checks that `name` is one of `names`; an empty `name` becomes the default. Otherwise sets the
/// view's error and returns false. `kind` is "display" or "view".
bool choose(View& view, const char* kind, std::string& name, const char* default_name,
            const std::vector<std::string>& names) {
  if (name.empty()) name = default_name;
  std::string known;
  for (const std::string& other : names) {
    if (name == other) return true;
    known += (known.empty() ? "\"" : ", \"") + other + "\"";
  }
  fail(view, std::string("has no ") + kind + " \"" + name + "\" (known: " + known + ")");
  return false;
}

/// Makes the transform from linear Rec. 709 to the display; null if the config has neither a name
/// of kRec709Names nor the role aces_interchange.
OCIO::ConstTransformRcPtr make_transform(const OCIO::ConstConfigRcPtr& config,
                                         const std::string& display, const std::string& view) {
  const auto to_display = OCIO::DisplayViewTransform::Create();
  to_display->setDisplay(display.c_str());
  to_display->setView(view.c_str());
  for (const char* name : kRec709Names)
    if (config->getColorSpace(name)) {
      to_display->setSrc(name);
      return to_display;
    }
  if (!config->hasRole(OCIO::ROLE_INTERCHANGE_SCENE)) return nullptr;
  // Convert to ACES2065-1, the space that this role stands for, by way of ACEScg.
  const auto group = OCIO::GroupTransform::Create();
  const auto to_ap1 = OCIO::BuiltinTransform::Create();
  to_ap1->setStyle("UTILITY - ACES-AP1_to_LINEAR-REC709_BFD");
  to_ap1->setDirection(OCIO::TRANSFORM_DIR_INVERSE);
  const auto to_ap0 = OCIO::BuiltinTransform::Create();
  to_ap0->setStyle("ACEScg_to_ACES2065-1");
  to_display->setSrc(OCIO::ROLE_INTERCHANGE_SCENE);
  group->appendTransform(to_ap1);
  group->appendTransform(to_ap0);
  group->appendTransform(to_display);
  return group;
}

/// Opens a view as polymorph_ocio_open() does; sets `view.processor` or the view's error.
void open(const char* file, std::string display, std::string view_name, View& view) {
  const OCIO::ConstConfigRcPtr config = OCIO::Config::CreateFromFile(file);
  if (!choose(view, "display", display, config->getDefaultDisplay(),
              list_names(config->getNumDisplays(), [&](int i) { return config->getDisplay(i); })))
    return;
  if (!choose(view, "view", view_name, config->getDefaultView(display.c_str()),
              list_names(config->getNumViews(display.c_str()),
                         [&](int i) { return config->getView(display.c_str(), i); })))
    return;
  const OCIO::ConstTransformRcPtr transform = make_transform(config, display, view_name);
  if (!transform)
    return fail(
        view,
        "has neither a colour space called lin_rec709_scene, by that or another usual name, "
        "nor the role aces_interchange - add one of them");
  view.processor = config->getProcessor(transform)->getDefaultCPUProcessor();
}

}  // namespace

extern "C" {

__attribute__((visibility("default"))) int polymorph_ocio_interface(void) {
  return PM_OCIO_INTERFACE;
}

__attribute__((visibility("default"))) PmOcioView* polymorph_ocio_open(const char* config,
                                                                       const char* display,
                                                                       const char* name) {
  auto* view = new View;
  try {
    OCIO::SetLoggingLevel(OCIO::LOGGING_LEVEL_NONE);  // errors are returned, not logged
    open(config, display, name, *view);
  } catch (const std::exception& e) {
    fail(*view, e.what());
  }
  return view;
}

__attribute__((visibility("default"))) const char* polymorph_ocio_apply(PmOcioView* view,
                                                                        float* pixels,
                                                                        std::size_t count) {
  try {
    OCIO::PackedImageDesc image(pixels, static_cast<long>(count), 1, 3);
    static_cast<View*>(view)->processor->apply(image);
  } catch (const std::exception&) {
    return "OpenColorIO cannot apply the view";
  }
  return nullptr;
}

__attribute__((visibility("default"))) void polymorph_ocio_close(PmOcioView* view) {
  delete static_cast<View*>(view);
}

}  // extern "C"
