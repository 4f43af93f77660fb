// The frames of a golden suite, rendered: by polymorph from its scene, or by another program.
#pragma once

#include <memory>
#include <string>

#include "compare/explain.h"
#include "compare/golden.h"
#include "golden/golden_run.h"
#include "scene/scene.h"
#include "sequence/prepare/prepared_scene.h"

namespace polymorph {

/// A frame as rendered.
struct RenderedFrame {
  SurfaceRecord surface;  ///< without a digest where another program renders
  Image image;            ///< pixels as they come back from the file
  std::string bytes;      ///< the file: EXR, or what the other program wrote
  std::string pixels;     ///< SHA-256 of the pixels as rendered, before any file
  ChangeContext context;  ///< cell and balls
};

/// Prepared once for all frames of a suite.
class SuiteRenderer {
 public:
  /// Errors: kInput (scene, a frame outside of it), kResource.
  static Result<SuiteRenderer> create(const GoldenSuite& suite, const GoldenSettings& settings);
  SuiteRenderer(SuiteRenderer&&) noexcept;
  SuiteRenderer& operator=(SuiteRenderer&&) noexcept;
  ~SuiteRenderer();

  Result<RenderedFrame> render(int frame);
  /// RenderedFrame::pixels alone.
  Result<std::string> hash(int frame);
  int frame_count() const;  ///< length of the scene; 0 with a command

 private:
  SuiteRenderer();
  struct State;
  std::unique_ptr<State> state_;
};

/// The scene of a suite, never denoised. Errors: kInput, also for another output.colorspace than
/// Rec. 709.
Result<Scene> load_golden_scene(const GoldenSuite& suite);

/// Hash of all that decides a suite's frames beside the program: its scene and all files, or its
/// command. Loads the models, prepares nothing. Errors: kInput.
Result<std::string> suite_hash(const GoldenSuite& suite);

/// SHA-256 of size, channel names and pixels.
std::string pixel_sha256(const Image& image);

}  // namespace polymorph
