#include "image/display_view.h"

#include <dlfcn.h>

#include <algorithm>
#include <cstdlib>
#include <vector>

#include "base/exact_math.h"
#include "image/module_file.h"
#include "image/ocio_module.h"
#include "image/rgb_channels.h"
#include "image/srgb.h"

namespace polymorph {
namespace {

struct OcioFunctions {
  PmOcioOpenFunction* open = nullptr;
  PmOcioApplyFunction* apply = nullptr;
  PmOcioCloseFunction* close = nullptr;
};

OcioFunctions find_ocio_functions(void* handle) {
  return {reinterpret_cast<PmOcioOpenFunction*>(dlsym(handle, "polymorph_ocio_open")),
          reinterpret_cast<PmOcioApplyFunction*>(dlsym(handle, "polymorph_ocio_apply")),
          reinterpret_cast<PmOcioCloseFunction*>(dlsym(handle, "polymorph_ocio_close"))};
}

bool is_current_ocio(void* handle) {
  auto* version =
      reinterpret_cast<PmOcioInterfaceFunction*>(dlsym(handle, "polymorph_ocio_interface"));
  const OcioFunctions functions = find_ocio_functions(handle);
  return version && functions.open && functions.apply && functions.close &&
         version() == PM_OCIO_INTERFACE;
}

/// Converts a code that the view computed to the linear colour that the sRGB curve maps to it.
float decode_display_code(float code) {
  return srgb_to_linear(code > 0 ? std::min(code, 1.0f) : 0.0f);  // NaN is 0
}

}  // namespace

struct ViewTransform::State {
  OcioFunctions functions;
  PmOcioView* view = nullptr;
  ~State() {
    if (view) functions.close(view);
  }
};

std::string view_text(const DisplayView& view) {
  return view.empty() ? "" : view.display + ", " + view.view;
}

Result<ViewTransform> ViewTransform::open(const DisplayView& view) {
  const auto handle = open_module("polymorph_ocio.so", "POLYMORPH_OCIO_MODULE", is_current_ocio);
  if (!handle)
    return make_error(
        ErrorCode::kResource,
        "cannot open polymorph_ocio.so, by which views are made - install OpenColorIO "
        "(on Debian libopencolorio2.1; libopencolorio-dev, and build again, where "
        "there is no such file), or leave out display and view; "
        "POLYMORPH_OCIO_MODULE names a module that lies elsewhere; tried:{}",
        handle.error().message);
  const char* config = std::getenv("OCIO");
  if (!config || !*config)
    return make_error(ErrorCode::kInput,
                      "display and view need an OpenColorIO config - name it in the environment, "
                      "as in OCIO=/studio/config.ocio");
  auto state = std::make_shared<State>();
  state->functions = find_ocio_functions(*handle);
  state->view = state->functions.open(config, view.display.c_str(), view.view.c_str());
  if (state->view->error)
    return make_error(ErrorCode::kInput, "{}: {}", config, state->view->error);
  return ViewTransform(std::move(state));
}

Status ViewTransform::apply(Image& image, float exposure) const {
  if (!has_rgb(image))
    return make_error(ErrorCode::kInput, "an image without R, G and B has no view");
  const std::array<int, 3> colors = find_rgb(image);
  const int alpha = image.find_channel("A");
  const std::size_t count = image.channel_count(),
                    pixels = count > 0 ? image.pixels.size() / count : 0;
  // Views apply to straight colours: the colours are divided by alpha before and multiplied after,
  // except where alpha is 0.
  const auto alpha_at = [&](std::size_t i) {
    const float a = alpha < 0 ? 1.0f : image.pixels[i * count + static_cast<std::size_t>(alpha)];
    return a > 0 ? a : 1.0f;
  };
  const auto gain = static_cast<float>(exact::exp2(static_cast<double>(exposure)));
  std::vector<float> rgb(3 * pixels);
  for (std::size_t i = 0; i < pixels; ++i)
    for (std::size_t c = 0; c < 3; ++c)
      rgb[3 * i + c] =
          gain * image.pixels[i * count + static_cast<std::size_t>(colors[c])] / alpha_at(i);
  if (const char* reason = state_->functions.apply(state_->view, rgb.data(), pixels))
    return make_error(ErrorCode::kResource, "{}", reason);
  for (std::size_t i = 0; i < pixels; ++i)
    for (std::size_t c = 0; c < 3; ++c)
      image.pixels[i * count + static_cast<std::size_t>(colors[c])] =
          decode_display_code(rgb[3 * i + c]) * alpha_at(i);
  return Ok{};
}

}  // namespace polymorph
