#include "golden/golden_frames.h"

#include <sys/wait.h>

#include <cstdlib>

#include "base/file.h"
#include "base/hash.h"
#include "base/sha256.h"
#include "base/shell_quote.h"
#include "device/device.h"
#include "film/frame_files.h"
#include "film/render_sequence.h"
#include "film/status.h"
#include "golden/work_folder.h"
#include "image/image_io.h"
#include "mesh/mesh_check.h"
#include "scene/load_scene.h"
#include "sequence/frame/frame_geometry.h"
#include "sequence/frame/render_frame.h"
#include "sequence/prepare/engine_scene.h"

namespace polymorph {
namespace {

namespace fs = std::filesystem;

void replace_all(std::string& text, const std::string& from, const std::string& to) {
  for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
    text.replace(at, from.size(), to);
}

/// Renders a frame with the suite's command, which writes the frame's file to a temporary folder.
/// Errors: kInput, kOutput.
Result<RenderedFrame> run_command(const GoldenSuite& suite, int frame) {
  PM_TRY(const WorkFolder work, WorkFolder::create());
  const fs::path frame_file = work.path() / fmt::format("frame.{:04}.{}", frame, suite.format);
  std::string command = suite.command;
  replace_all(command, "{out}", quote_for_shell(frame_file.string()));
  replace_all(command, "{frame}", fmt::format("{}", frame));
  // Run the command in the suite's folder. Its standard output goes to standard error, because
  // polymorph's standard output is for data.
  const std::string shell_line =
      fmt::format("cd {} && ( {} ) 1>&2", quote_for_shell(suite.folder.string()), command);
  const int status = std::system(shell_line.c_str());
  RenderedFrame rendered;
  rendered.surface.frame = frame;
  if (status != 0)
    return make_error(
        ErrorCode::kInput, "{}: frame {}: the command ended with {}: {}",
        (suite.folder / "suite.json").string(), frame,
        WIFEXITED(status) ? fmt::format("exit code {}", WEXITSTATUS(status)) : "a signal", command);
  auto bytes = read_file(frame_file, std::size_t{1} << 30);  // at most 1 GiB
  if (!bytes)
    return make_error(ErrorCode::kInput, "{}: frame {}: the command wrote no {}",
                      (suite.folder / "suite.json").string(), frame,
                      frame_file.filename().string());
  rendered.bytes = std::move(*bytes);
  PM_TRY(rendered.image, decode_image(rendered.bytes, frame_file.filename().string(),
                                      {.single_picture = true, .stored_colors = true}));
  rendered.pixel_hash = pixel_sha256(rendered.image);
  return rendered;
}

}  // namespace

struct SuiteRenderer::State {
  GoldenSuite suite;
  EngineScene engine_scene;            ///< unused if a command renders
  std::unique_ptr<Renderer> renderer;  ///< null if a command renders
};

SuiteRenderer::SuiteRenderer() : state_(std::make_unique<State>()) {}
SuiteRenderer::SuiteRenderer(SuiteRenderer&&) noexcept = default;
SuiteRenderer& SuiteRenderer::operator=(SuiteRenderer&&) noexcept = default;
SuiteRenderer::~SuiteRenderer() = default;

Result<SuiteRenderer> SuiteRenderer::create(const GoldenSuite& suite,
                                            const GoldenSettings& settings) {
  SuiteRenderer result;
  State& state = *result.state_;
  state.suite = suite;
  if (!suite.command.empty()) return result;
  PM_TRY(const Scene scene, load_golden_scene(suite));
  PM_TRY(state.engine_scene, prepare_on_engine(scene, {settings.device, settings.cache_folder}));
  PM_TRY(Renderer renderer, make_renderer(state.engine_scene.device));
  state.renderer = std::make_unique<Renderer>(std::move(renderer));
  for (const int frame : suite.frames)
    if (frame < 1 || frame > state.engine_scene.prepared.frame_count)
      return make_error(ErrorCode::kInput, "{}: frame {} is outside the scene's 1-{}",
                        (suite.folder / "suite.json").string(), frame,
                        state.engine_scene.prepared.frame_count);
  return result;
}

int SuiteRenderer::frame_count() const { return state_->engine_scene.prepared.frame_count; }

Result<RenderedFrame> SuiteRenderer::render(int frame) {
  State& state = *state_;
  if (!state.suite.command.empty()) return run_command(state.suite, frame);
  PM_TRY(const FrameGeometry geometry,
         geometry_at(state.engine_scene.prepared, *state.engine_scene.engine, frame));
  PM_TRY(const Image image, render_frame(state.engine_scene.prepared, geometry, *state.renderer,
                                         state.engine_scene.device, /*command=*/""));
  const Mesh surface = join_surfaces(geometry);
  RenderedFrame rendered;
  rendered.surface = {frame, surface.positions.size(), surface.triangles.size(),
                      mesh_digest(surface)};
  for (std::size_t i = 0; i < geometry.actors.size(); ++i) {
    for (const Ball& ball : geometry.actors[i].balls) rendered.context.balls.push_back(ball.center);
    rendered.context.cell =
        std::max(rendered.context.cell, state.engine_scene.prepared.actors[i].settings.cell);
  }
  rendered.pixel_hash = pixel_sha256(image);
  // Goldens have half floats, so round the frame to half floats as well, by encoding it.
  PM_TRY(rendered.bytes, encode_exr(image, exr_settings(state.engine_scene.prepared.scene)));
  PM_TRY(rendered.image, decode_image(rendered.bytes, fmt::format("frame {}", frame)));
  return rendered;
}

Result<std::string> SuiteRenderer::hash(int frame) {
  State& state = *state_;
  if (!state.suite.command.empty()) {
    PM_TRY(const RenderedFrame rendered, run_command(state.suite, frame));
    return rendered.pixel_hash;
  }
  PM_TRY(const FrameGeometry geometry,
         geometry_at(state.engine_scene.prepared, *state.engine_scene.engine, frame));
  PM_TRY(const Image image, render_frame(state.engine_scene.prepared, geometry, *state.renderer,
                                         state.engine_scene.device, /*command=*/""));
  return pixel_sha256(image);
}

Result<std::string> suite_hash(const GoldenSuite& suite) {
  if (!suite.command.empty())
    return Hasher().add(std::string_view(suite.command)).add(std::string_view(suite.format)).hex();
  PM_TRY(const Scene scene, load_scene(suite.scene));
  return source_hash(scene);
}

Result<Scene> load_golden_scene(const GoldenSuite& suite) {
  PM_TRY(Scene scene, load_scene(suite.scene));
  if (scene.output.color_space != ColorSpace::kRec709)
    return make_error(ErrorCode::kInput,
                      "{}: golden frames are in linear Rec. 709, as the program computes - remove "
                      "output.colorspace from the scene",
                      suite.scene.string());
  scene.image.denoise = false;  // the denoiser is another library, which is not tested here
  return scene;
}

std::string pixel_sha256(const Image& image) {
  Sha256 sha;
  std::string head = fmt::format("{} {}", image.width, image.height);
  for (const std::string& channel : image.channels) head += " " + channel;
  head += "\n";
  sha.add(head.data(), head.size());
  return sha.add(image.pixels.data(), image.pixels.size() * sizeof(float)).hex();
}

}  // namespace polymorph
