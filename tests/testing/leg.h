// A small leg between two built-in shapes, with a few balls each.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "field/extract_surface.h"
#include "leg/make_leg.h"
#include "leg/prepared_object.h"
#include "mesh/mesh_check.h"
#include "model/shapes.h"
#include "morph/labels.h"

namespace polymorph {

inline LegSettings test_leg_settings() {
  LegSettings settings;
  settings.resolution = 20;
  settings.cell = 0.05f;
  return settings;
}

/// Returns a built-in shape, shifted by `place`, with a ball in the middle of each octant of its
/// box; all its labels are `label`.
inline std::shared_ptr<const PreparedObject> make_test_object(const std::string& shape, Vec3 place,
                                                              std::uint32_t label, Engine& engine) {
  const LegSettings settings = test_leg_settings();
  PreparedObject object;
  object.name = shape;
  object.model = *make_shape(shape);
  for (Vec3& point : object.model.points) point = point + place;
  const Box box = object.model.box();
  const float radius = 0.4f * box.size().x;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 side{corner & 1 ? 1.0f : -1.0f, corner & 2 ? 1.0f : -1.0f,
                    corner & 4 ? 1.0f : -1.0f};
    object.balls.push_back(
        {box.center() + side * (0.25f * box.size()), 4 / (radius * radius), 4, {}});
  }
  object.ball_labels = face_labels(object.model, object.balls);
  object.label_numbers.assign(object.model.label_names.size(), label);
  const auto mesh = extract_surface(engine, object.balls, settings.cell, settings.measured);
  EXPECT_TRUE(mesh.ok());
  object.ball_volume = volume_of(*mesh);
  object.closest = std::make_shared<const ClosestPointQuery>(object.model);
  auto distances = measure_distances(object,
                                     {settings.cell, kThinnestPart * settings.cell,
                                      /*min_component_share=*/1e-3, /*solidified=*/false},
                                     engine, {});
  EXPECT_TRUE(distances.ok());
  object.distances = std::move(*distances);
  prepare_transfer(object, /*with_colors=*/false, /*cache=*/{});
  return std::make_shared<const PreparedObject>(std::move(object));
}

/// Returns the leg from a cube to a sphere beside it.
inline std::shared_ptr<const Leg> make_test_leg(Interpolation kind, Engine& engine) {
  LegParts parts{make_test_object("cube", {}, 0, engine),
                 make_test_object("sphere", {0.8f, 0, 0}, 1, engine),
                 {},
                 {}};
  PlanSide from, to;
  from.balls = parts.from->balls;
  to.balls = parts.to->balls;
  LegTiming timing;
  timing.interpolation = kind;
  parts.plan = plan_morph(from, to, FieldKind::kGaussian, {}, timing.motion);
  const auto leg = make_leg(std::move(parts), timing, test_leg_settings(), engine, {});
  EXPECT_TRUE(leg.ok());
  return *leg;
}

}  // namespace polymorph
