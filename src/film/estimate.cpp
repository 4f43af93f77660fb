#include "film/estimate.h"

#include <algorithm>
#include <utility>

#include "base/activity.h"
#include "base/parallel.h"
#include "base/stopwatch.h"
#include "image/image_io.h"
#include "sequence/frame/frame_geometry.h"
#include "sequence/frame/render_scene.h"

namespace polymorph {
namespace {

constexpr int kMaxMeasured = 3;    ///< maximum number of measured frames
constexpr int kSampleDivisor = 8;  ///< a measured frame has 1 / kSampleDivisor of the samples

/// Stopwatch whose lap() returns the seconds since the call before, or since the construction.
class Laps {
 public:
  double lap() {
    const double now = stopwatch_.seconds();
    return now - std::exchange(last_, now);
  }

 private:
  Stopwatch stopwatch_;
  double last_ = 0;
};

/// Adds the objects whose balls a dry run does not fit, and the time that their fits would take.
void add_fits(const PreparedScene& prepared, FrameEstimate& estimate) {
  // Processor seconds: 64 to 512 balls took 11 to 17 ms each on two processors
  // (docs/performance.md).
  constexpr double kSecondsPerBall = 0.026;
  for (const PreparedActor& actor : prepared.actors)
    for (const auto& object : actor.objects) {
      if (object->missing_balls == 0) continue;
      estimate.unfitted.push_back(object->name);
      estimate.fit_seconds += kSecondsPerBall * object->missing_balls / thread_count();
    }
}

}  // namespace

Result<FrameEstimate> estimate_frames(const PreparedScene& prepared, Engine& engine,
                                      Renderer& renderer, std::span<const int> frames,
                                      const std::optional<SampleRange>& part) {
  FrameEstimate estimate;
  estimate.memory = prepared.memory.total();
  add_fits(prepared, estimate);
  if (frames.empty()) return estimate;
  const Activity activity("rendering some frames to estimate the others");
  // Settings of the measured frames: fewer samples, and no adaptive sampling.
  const int samples = part ? part->count() : prepared.scene.image.samples;
  const int measured_samples =
      part ? std::min(samples, kSampleBlock) : std::max(1, samples / kSampleDivisor);
  RenderSettings settings;
  settings.image = prepared.scene.image;
  settings.image.samples = part ? part->total : measured_samples;
  settings.image.noise = 0;
  if (part) settings.part = {part->first, part->first + measured_samples, part->total};
  const auto count = std::min<std::size_t>(frames.size(), kMaxMeasured);
  for (std::size_t i = 0; i < count; ++i) {
    // Measure the middle frame of the i-th of `count` equal groups.
    settings.frame = frames[(2 * i + 1) * frames.size() / (2 * count)];
    Laps watch;
    PM_TRY(const FrameGeometry geometry, geometry_at(prepared, engine, settings.frame));
    estimate.seconds += watch.lap();
    PM_TRY(const Image image, renderer.render(render_scene(prepared, geometry), settings));
    estimate.seconds += watch.lap() * samples / measured_samples;
    PM_TRY(const std::string exr, encode_exr(image));
    estimate.seconds += watch.lap();
    // A part's file holds one picture per node of the part (render/sample_range.h). `image` is the
    // picture of one node.
    const std::size_t nodes = part ? list_nodes(*part).size() : 1;
    estimate.exr_bytes += static_cast<double>(nodes * exr.size());
    if (part) continue;  // a part is never a PNG
    PngSettings png;
    png.exposure = prepared.scene.image.exposure;
    png.bits = prepared.scene.output.png_bits;
    PM_TRY(const std::string picture, encode_png(image, png));
    estimate.png_bytes += static_cast<double>(picture.size());
  }
  // Turn the sums into means per frame.
  const auto divisor = static_cast<double>(count);
  estimate.measured = static_cast<int>(count);
  estimate.seconds /= divisor;
  estimate.exr_bytes /= divisor;
  estimate.png_bytes /= divisor;
  return estimate;
}

}  // namespace polymorph
