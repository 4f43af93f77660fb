// Denoising by Intel's Open Image Denoise, an optional library that is loaded at run time, because
// Debian 12 lacks it.
#pragma once

#include <memory>

#include "base/result.h"
#include "image/image.h"
#include "render/path/world.h"

namespace polymorph {

/// Auxiliary features of a camera ray for the denoiser: normal and albedo of the first surface that
/// is neither a mirror nor glass, or of the surface after eight of these. The albedo is tinted by
/// the mirrors and glass before that surface.
struct Guide {
  Vec3 albedo;  ///< [0, 1]; the backdrop's if nothing is hit: the sky's radiance, or 1 for paper
  Vec3 normal;  ///< world space; 0 if nothing is hit
};
/// Computes the guide of a camera ray with this first intersection.
Guide trace_guide(const World& world, Ray ray, Intersection intersection, RayStats& stats);

/// Lists the channels of the guides. They are the last channels of a film, until denoise() removes
/// them.
std::vector<std::string> list_guide_channels();

/// The loaded library and its device. Not thread-safe.
class Denoiser {
 public:
  /// Loads libOpenImageDenoise.so.2 from the system's library path, or the file that the
  /// environment variable POLYMORPH_OIDN names. Errors: kResource; the message says how to get the
  /// library.
  static Result<Denoiser> open();
  ~Denoiser();
  Denoiser(Denoiser&&) noexcept;
  Denoiser& operator=(Denoiser&&) noexcept;

  /// Denoises R, G and B, guided by albedo and normals, and removes the guides. Alpha and all other
  /// channels stay unchanged. Errors: kResource.
  Status denoise(Image& film);

 private:
  struct State;
  explicit Denoiser(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace polymorph
