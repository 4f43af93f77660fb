// An engine that forwards its calls to another one, for tests that watch or change some of them.
#pragma once

#include <memory>
#include <vector>

#include "kernels/engine.h"

namespace polymorph {

/// Forwards all calls to another engine, except those that limit and report memory.
class ForwardingEngine : public Engine {
 public:
  explicit ForwardingEngine(Engine& engine) : engine_(engine) {}

  EngineStatus extract(const BallSet& balls, const Grid& grid, const ExtractSettings& settings,
                       Mesh& mesh) override {
    return engine_.extract(balls, grid, settings, mesh);
  }
  EngineStatus extract(const MorphSurface& surface, const Grid& grid,
                       const ExtractSettings& settings, Mesh& mesh) override {
    return engine_.extract(surface, grid, settings, mesh);
  }
  EngineStatus extract(const std::shared_ptr<const DistanceGrid>& object, const Grid& grid,
                       const ExtractSettings& settings, Mesh& mesh) override {
    return engine_.extract(object, grid, settings, mesh);
  }
  EngineStatus sample(const BallSet& balls, const std::vector<Vec3>& points,
                      const ExtractSettings& settings, std::vector<float>& values) override {
    return engine_.sample(balls, points, settings, values);
  }
  EngineStatus move_balls(const std::shared_ptr<const BallPaths>& paths, const MotionState& state,
                          const std::vector<float>& eased_times, BallSet& balls) override {
    return engine_.move_balls(paths, state, eased_times, balls);
  }
  EngineStatus interpolate(const BallSet& balls, const std::vector<BallAttribute>& attributes,
                           const std::vector<Vec3>& points, const ExtractSettings& settings,
                           std::vector<AttributeValues>& values) override {
    return engine_.interpolate(balls, attributes, points, settings, values);
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

/// Counts the surfaces between two objects that the other engine extracts.
class CountingEngine : public ForwardingEngine {
 public:
  using ForwardingEngine::extract;
  using ForwardingEngine::ForwardingEngine;
  int surfaces = 0;

  EngineStatus extract(const MorphSurface& surface, const Grid& grid,
                       const ExtractSettings& settings, Mesh& mesh) override {
    ++surfaces;
    return engine_.extract(surface, grid, settings, mesh);
  }
};

}  // namespace polymorph
