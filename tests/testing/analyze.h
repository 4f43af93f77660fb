// Helpers of the tests of analyze/: values of metrics, box meshes.
#pragma once

#include <gtest/gtest.h>

#include <cmath>

#include "analyze/analyze.h"
#include "testing/model.h"

namespace polymorph {

/// Returns the value of a metric. If it was not measured, fails the test and returns NaN.
inline double value(const Analysis& analysis, const char* name) {
  const Metric* metric = analysis.find(name);
  EXPECT_TRUE(metric && metric->value) << name;
  return metric && metric->value ? *metric->value : NAN;
}

inline Mesh box_mesh(Vec3 low, Vec3 high) {
  const Model model = box_model(low, high);
  return {model.points, {}, model.triangles};
}

}  // namespace polymorph
