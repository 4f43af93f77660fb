// Rendering of a golden suite's frames, by polymorph from its scene or by another program.
#pragma once

#include <memory>
#include <string>

#include "compare/explain.h"
#include "compare/golden.h"
#include "golden/golden_run.h"
#include "scene/scene.h"
#include "sequence/prepare/prepared_scene.h"

namespace polymorph {

/// A rendered frame, and the facts that tests and reports need.
struct RenderedFrame {
  SurfaceRecord surface;  ///< has only the frame's number if another program renders
  Image image;            ///< pixels decoded from `bytes`
  std::string bytes;      ///< content of the file: EXR, or as the other program wrote it
  /// pixel_sha256() of the rendered pixels before encoding; of `image` if another program renders.
  std::string pixel_hash;
  ChangeContext context;  ///< only `cell` and `balls` are set
};

/// Renderer for the frames of a suite. It prepares the scene only once.
class SuiteRenderer {
 public:
  /// Prepares the suite's scene, unless the suite has a command. Errors: kInput (a bad scene, or a
  /// frame outside its range), kResource.
  static Result<SuiteRenderer> create(const GoldenSuite& suite, const GoldenSettings& settings);
  SuiteRenderer(SuiteRenderer&&) noexcept;
  SuiteRenderer& operator=(SuiteRenderer&&) noexcept;
  ~SuiteRenderer();

  /// Renders the frame of this number. Errors: kInput (also if the command fails), kResource,
  /// kOutput.
  Result<RenderedFrame> render(int frame);
  /// Returns RenderedFrame::pixel_hash without encoding the frame.
  Result<std::string> hash(int frame);
  int frame_count() const;  ///< number of frames of the scene; 0 if a command renders

 private:
  SuiteRenderer();
  struct State;
  std::unique_ptr<State> state_;
};

/// Loads the scene of a suite and turns denoising off. Errors: kInput, also if output.colorspace is
/// not Rec. 709.
Result<Scene> load_golden_scene(const GoldenSuite& suite);

/// Hashes all inputs of a suite's frames except the program: the scene and all files that it names,
/// or the suite's command. Loads the models, but prepares nothing. Errors: kInput.
Result<std::string> suite_hash(const GoldenSuite& suite);

/// Returns the SHA-256 of an image's size, channel names and pixels.
std::string pixel_sha256(const Image& image);

}  // namespace polymorph
