// OpenColorIO display and view transform for pictures that are made for screens. OpenColorIO is
// linked into a module that is opened on first use.
#pragma once

#include <memory>
#include <string>

#include "base/result.h"
#include "image/image.h"

namespace polymorph {

/// Names in an OpenColorIO config. An empty name stands for the config's default; if both are
/// empty, there is no view, and pictures get the sRGB curve.
struct DisplayView {
  std::string display, view;
  bool empty() const { return display.empty() && view.empty(); }
};

/// Name of the PNG text with the view that was applied: "DISPLAY, VIEW".
inline constexpr const char* kViewAttribute = "polymorph/view";
/// Returns the value of kViewAttribute; "" without a view.
std::string view_text(const DisplayView& view);

/// An open view. Several threads may use it at once.
class ViewTransform {
 public:
  /// Opens a view of the config that the environment variable OCIO names. Errors: kResource if the
  /// module is missing (if the environment variable POLYMORPH_OCIO_MODULE is set, it names the only
  /// file that is tried), kInput for a missing or bad config and for names that the config does not
  /// have.
  static Result<ViewTransform> open(const DisplayView& view);

  /// Brightens the colours by `exposure` stops, applies the view, and inverts the sRGB curve:
  /// encode_png(), encode_gif() and movies apply this curve and so get the view's codes. Colours
  /// that the display cannot show are clamped. Alpha does not change. Errors: kResource.
  Status apply(Image& image, float exposure = 0) const;

 private:
  struct State;
  explicit ViewTransform(std::shared_ptr<State> state) : state_(std::move(state)) {}
  std::shared_ptr<State> state_;
};

}  // namespace polymorph
