// Display and view of an OpenColorIO config, by which pictures for screens are made. OpenColorIO is
// linked into a module that is opened on first use.
#pragma once

#include <memory>
#include <string>

#include "base/result.h"
#include "image/image.h"

namespace polymorph {

/// Names in the config; an empty one is the config's default, both empty: no view, the sRGB curve.
struct DisplayView {
  std::string display, view;
  bool empty() const { return display.empty() && view.empty(); }
};

/// PNG's text, as in "sRGB - Display, ACES 1.0 - SDR Video": the view by which it was made.
inline constexpr const char* kViewAttribute = "polymorph/view";
/// The value of kViewAttribute; "" without a view.
std::string view_text(const DisplayView& view);

/// An open view. Safe from several threads.
class ViewTransform {
 public:
  /// Opens a view of the config that the environment variable OCIO names. Errors: kResource where
  /// the module is missing (the environment variable POLYMORPH_OCIO_MODULE names another file, and
  /// then only that is tried), kInput for a missing or bad config and names that it has not.
  static Result<ViewTransform> open(const DisplayView& view);

  /// Brightens the colours by `exposure` stops and replaces them by those that give the view's
  /// codes once they have the sRGB curve of encode_png(), encode_gif() and movies. What the display
  /// cannot show is clamped. Alpha stays. Errors: kResource.
  Status apply(Image& image, float exposure = 0) const;

 private:
  struct State;
  explicit ViewTransform(std::shared_ptr<State> state) : state_(std::move(state)) {}
  std::shared_ptr<State> state_;
};

}  // namespace polymorph
