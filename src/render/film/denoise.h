// Denoising by Intel's Open Image Denoise, a library that is looked for when the program runs: it
// is not in Debian 12, and nothing needs it.
#pragma once

#include <memory>

#include "base/result.h"
#include "image/image.h"
#include "render/path/world.h"

namespace polymorph {

/// What guides the denoiser at a camera ray: colour and normal of the first surface that is neither
/// a mirror nor clear glass, tinted by those on the way.
struct Guide {
  Vec3 albedo;  ///< [0, 1]
  Vec3 normal;  ///< world; 0 where nothing is
};
/// `intersection`: the first one of the ray.
Guide guide_of(const World& world, Ray ray, Intersection intersection, RayStats& stats);

/// The channels of a film that is to be denoised, behind all others; denoise() takes them away.
std::vector<std::string> guide_channels();

/// An open library and its device. Not shared between threads.
class Denoiser {
 public:
  /// Looks for libOpenImageDenoise.so.2 where the system looks for libraries; the environment
  /// variable POLYMORPH_OIDN names another file, and then only that one is tried. Errors:
  /// kResource, saying how to get it.
  static Result<Denoiser> open();
  ~Denoiser();
  Denoiser(Denoiser&&) noexcept;
  Denoiser& operator=(Denoiser&&) noexcept;

  /// Replaces R, G and B by what the noise hides, as far as colours, albedo and normals tell, and
  /// takes the guides away. Alpha and all other channels stay as they are. Errors: kResource.
  Status denoise(Image& film);

 private:
  struct State;
  explicit Denoiser(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace polymorph
