// An engine that hands its calls on, for tests that watch or change one of them.
#pragma once

#include <memory>
#include <vector>

#include "kernels/engine.h"

namespace polymorph {

/// Does what another engine does.
class ForwardingEngine : public Engine {
 public:
  explicit ForwardingEngine(Engine& engine) : engine_(engine) {}

  EngineStatus extract(const BallSet& balls, const Grid& grid, const ExtractSettings& settings,
                       Mesh& mesh) override {
    return engine_.extract(balls, grid, settings, mesh);
  }
  EngineStatus extract(const MorphSurface& between, const Grid& grid,
                       const ExtractSettings& settings, Mesh& mesh) override {
    return engine_.extract(between, grid, settings, mesh);
  }
  EngineStatus extract(const std::shared_ptr<const DistanceGrid>& object, const Grid& grid,
                       const ExtractSettings& settings, Mesh& mesh) override {
    return engine_.extract(object, grid, settings, mesh);
  }
  EngineStatus sample(const BallSet& balls, const std::vector<Vec3>& points,
                      const ExtractSettings& settings, std::vector<float>& values) override {
    return engine_.sample(balls, points, settings, values);
  }
  EngineStatus move_balls(const std::shared_ptr<const BallPaths>& paths, const MotionState& moment,
                          const std::vector<float>& eased_times, BallSet& balls) override {
    return engine_.move_balls(paths, moment, eased_times, balls);
  }
  EngineStatus interpolate(const BallSet& balls, const std::vector<BallAttribute>& carried,
                           const std::vector<Vec3>& points, const ExtractSettings& settings,
                           std::vector<AttributeValues>& values) override {
    return engine_.interpolate(balls, carried, points, settings, values);
  }
  EngineStatus regress(const std::shared_ptr<const Regression>& regression,
                       const std::vector<Vec3>& points,
                       std::vector<AttributeValues>& values) override {
    return engine_.regress(regression, points, values);
  }
  std::vector<PassTime> pass_times() const override { return engine_.pass_times(); }

 protected:
  Engine& engine_;
};

/// Counts the surfaces between objects that another engine is asked for.
class CountingEngine : public ForwardingEngine {
 public:
  using ForwardingEngine::extract;
  using ForwardingEngine::ForwardingEngine;
  int surfaces = 0;

  EngineStatus extract(const MorphSurface& between, const Grid& grid,
                       const ExtractSettings& settings, Mesh& mesh) override {
    ++surfaces;
    return engine_.extract(between, grid, settings, mesh);
  }
};

}  // namespace polymorph
