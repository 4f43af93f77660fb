#include "device/failover_engine.h"

#include <string>
#include <utility>

#include "base/log.h"

namespace polymorph {
namespace {

/// Engine of make_failover_engine(); its methods forward to the device or to the CPU.
class FailoverEngine : public Engine {
 public:
  explicit FailoverEngine(std::unique_ptr<Engine> device) : device_(std::move(device)) {}

  EngineStatus extract(const BallSet& balls, const Grid& grid, const ExtractSettings& settings,
                       Mesh& mesh) override {
    return call([&](Engine& engine) { return engine.extract(balls, grid, settings, mesh); });
  }
  EngineStatus extract(const MorphSurface& surface, const Grid& grid,
                       const ExtractSettings& settings, Mesh& mesh) override {
    return call([&](Engine& engine) { return engine.extract(surface, grid, settings, mesh); });
  }
  EngineStatus extract(const std::shared_ptr<const DistanceGrid>& object, const Grid& grid,
                       const ExtractSettings& settings, Mesh& mesh) override {
    return call([&](Engine& engine) { return engine.extract(object, grid, settings, mesh); });
  }
  EngineStatus sample(const BallSet& balls, const std::vector<Vec3>& points,
                      const ExtractSettings& settings, std::vector<float>& values) override {
    return call([&](Engine& engine) { return engine.sample(balls, points, settings, values); });
  }
  EngineStatus move_balls(const std::shared_ptr<const BallPaths>& paths, const MotionState& state,
                          const std::vector<float>& eased_times, BallSet& balls) override {
    return call(
        [&](Engine& engine) { return engine.move_balls(paths, state, eased_times, balls); });
  }
  EngineStatus interpolate(const BallSet& balls, const std::vector<BallAttribute>& attributes,
                           const std::vector<Vec3>& points, const ExtractSettings& settings,
                           std::vector<AttributeValues>& values) override {
    return call([&](Engine& engine) {
      return engine.interpolate(balls, attributes, points, settings, values);
    });
  }
  EngineStatus regress(const std::shared_ptr<const Regression>& regression,
                       const std::vector<Vec3>& points,
                       std::vector<AttributeValues>& values) override {
    return call([&](Engine& engine) { return engine.regress(regression, points, values); });
  }
  void limit_memory(std::size_t bytes) override {
    max_memory_ = bytes;
    device_->limit_memory(bytes);
    if (cpu_) cpu_->limit_memory(bytes);
  }
  std::vector<PassTime> pass_times() const override { return last_used().pass_times(); }
  std::size_t memory_used() const override { return last_used().memory_used(); }

 private:
  /// Calls the function with the engine of the device. If that has failed before, or fails now, or
  /// has too little memory, calls the function with the CPU's engine.
  template <class F>
  EngineStatus call(const F& f) {
    called_cpu_ = false;
    if (!has_failed_) {
      EngineStatus status = f(*device_);
      has_failed_ = status.code == EngineCode::kDeviceError;
      if (!has_failed_ && status.code != EngineCode::kOutOfMemory) return status;
      if (status.message != logged_reason_)
        log_info("the CPU makes the surfaces that the GPU does not: {}", status.message);
      logged_reason_ = status.message;
    }
    if (!cpu_) {
      cpu_ = make_cpu_engine();
      cpu_->limit_memory(max_memory_);
    }
    called_cpu_ = true;
    return f(*cpu_);
  }
  /// Returns the engine that ran the last call.
  const Engine& last_used() const { return called_cpu_ ? *cpu_ : *device_; }

  std::unique_ptr<Engine> device_, cpu_;  ///< cpu_: null until the device has failed
  std::size_t max_memory_ = 0;
  std::string logged_reason_;  ///< the reason that was logged last
  bool has_failed_ = false;    ///< the device had an error and is no longer used
  bool called_cpu_ = false;    ///< the last call used the CPU
};

}  // namespace

std::unique_ptr<Engine> make_failover_engine(std::unique_ptr<Engine> device) {
  return std::make_unique<FailoverEngine>(std::move(device));
}

}  // namespace polymorph
