// The CPU goes on where a GPU fails: after an error of the device for good, without memory for one
// call. The GPU is the CPU's engine here, which is told to fail.
#include "device/failover_engine.h"

#include <gtest/gtest.h>

#include "field/extract_surface.h"
#include "testing/forwarding_engine.h"

namespace polymorph {
namespace {

struct Device {
  std::unique_ptr<Engine> engine = make_cpu_engine();
  EngineStatus next;  ///< what the next call answers, unless it is ok
  int calls = 0;
};

class FailingEngine : public ForwardingEngine {
 public:
  explicit FailingEngine(Device& device) : ForwardingEngine(*device.engine), device_(device) {}
  using ForwardingEngine::extract;
  EngineStatus extract(const BallSet& balls, const Grid& grid, const ExtractSettings& settings,
                       Mesh& mesh) override {
    ++device_.calls;
    if (device_.next.code != EngineCode::kOk) return device_.next;
    return ForwardingEngine::extract(balls, grid, settings, mesh);
  }

 private:
  Device& device_;
};

class Failover : public ::testing::Test {
 protected:
  /// Extracts the surface, and counts its triangles.
  std::size_t extract() {
    Mesh mesh;
    const EngineStatus status =
        engine->extract(balls, *fit_grid({{-2, -2, -2}, {2, 2, 2}}, 0.2f), {}, mesh);
    EXPECT_EQ(status.code, EngineCode::kOk) << status.message;
    return mesh.triangles.size();
  }

  Device device;
  BallSet balls{Ball{{0, 0, 0}, 1.0f, 1.0f}};
  std::unique_ptr<Engine> engine = make_failover_engine(std::make_unique<FailingEngine>(device));
};

TEST_F(Failover, ADeviceThatFailsIsNotAskedAgain) {
  const std::size_t triangles = extract();
  EXPECT_GT(triangles, 100u);
  device.next = {EngineCode::kDeviceError, "the device is lost"};
  EXPECT_EQ(extract(), triangles);
  EXPECT_EQ(device.calls, 2);
  device.next = {};
  EXPECT_EQ(extract(), triangles);
  EXPECT_EQ(device.calls, 2);
}

TEST_F(Failover, ADeviceWithoutMemoryIsAskedAgain) {
  device.next = {EngineCode::kOutOfMemory, "out of memory"};
  const std::size_t triangles = extract();
  EXPECT_GT(triangles, 100u);
  device.next = {};
  EXPECT_EQ(extract(), triangles);
  EXPECT_EQ(device.calls, 2);
}

TEST_F(Failover, WrongInputIsAnError) {
  device.next = {EngineCode::kBadInput, "no"};
  Mesh mesh;
  EXPECT_EQ(engine->extract(balls, Grid{}, {}, mesh).code, EngineCode::kBadInput);
}

}  // namespace
}  // namespace polymorph
