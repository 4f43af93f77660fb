#include "interchange/play_page.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "base/html_page.h"
#include "base/json.h"
#include "base/packed_text.h"
#include "base/result.h"
#include "base/text.h"
#include "image/srgb.h"
#include "interchange/json_vectors.h"
#include "kernels/field_kinds.h"
#include "kernels/mc_tables.h"

namespace polymorph {

extern const std::string_view play_page;  // play.html

namespace {

/// Quantization steps of distances, in cells of the surface, and of thinness, which is in [0, 1].
/// Errors are at most half a step.
constexpr float kDistanceStep = 1.0f / 40;
constexpr float kThinnessStep = 1.0f / 256;
/// Numbers of quantization steps over the range of a leg's changing values.
constexpr float kMotionSteps = 16383,  ///< distance legs
    kBallSteps = 65000,                ///< ball legs, whose field is steep
    kDisplaySteps = 511;               ///< balls of distance legs, which are only displayed

/// Dimensions of an array, x fastest, and the axes along which its values are smooth.
struct Shape {
  std::array<int, 3> n;
  std::array<bool, 3> smooth;
  std::size_t size() const {
    return static_cast<std::size_t>(n[0]) * static_cast<std::size_t>(n[1]) *
           static_cast<std::size_t>(n[2]);
  }
};

JsonValue grid_json(const Grid& grid) {
  return {
      {"origin", to_array(grid.origin)}, {"cell", grid.cell}, {"points", to_array(grid.points)}};
}

/// Visits all elements from coarse to fine: calls `visit(index, prediction)`, which sets
/// values[index]. Along a smooth axis, the prediction of an element halfway between two visited
/// ones is the value of the cubic through the four nearest visited ones (interpolating subdivision,
/// Dubuc 1986). readArray() of play.html visits the same elements in the same order.
template <class F>
void refine(const Shape& shape, const std::vector<double>& values, const F& visit) {
  const std::int64_t stride[3] = {1, shape.n[0], std::int64_t{shape.n[0]} * shape.n[1]};
  const auto visit_all = [&](const int(&first)[3], const int(&step)[3], const auto& predict) {
    for (int z = first[2]; z < shape.n[2]; z += step[2])
      for (int y = first[1]; y < shape.n[1]; y += step[1])
        for (int x = first[0]; x < shape.n[0]; x += step[0]) {
          const int at[3] = {x, y, z};
          const std::int64_t i = x + stride[1] * y + stride[2] * z;
          visit(static_cast<std::size_t>(i), predict(at, i));
        }
  };
  // Visit the coarsest level: index 0 along the smooth axes.
  int coarsest = 1;
  for (int axis = 0; axis < 3; ++axis)
    while (shape.smooth[axis] && coarsest < shape.n[axis]) coarsest *= 2;
  int first[3] = {0, 0, 0}, step[3];
  for (int axis = 0; axis < 3; ++axis) step[axis] = shape.smooth[axis] ? coarsest : 1;
  visit_all(first, step, [](const int(&)[3], std::int64_t) { return 0.0; });
  // Halve the spacing, axis by axis.
  for (int half = coarsest / 2; half >= 1; half /= 2)
    for (int axis = 0; axis < 3; ++axis) {
      if (!shape.smooth[axis]) continue;
      first[axis] = half;
      const std::int64_t neighbour_step = half * stride[axis];
      visit_all(first, step, [&](const int(&at)[3], std::int64_t i) {
        const auto value = [&](std::int64_t j) { return values[static_cast<std::size_t>(j)]; };
        const int index = at[axis], n = shape.n[axis];
        const double low = value(i - neighbour_step);
        // Near the ends of the axis, fewer than four visited neighbours exist.
        if (index + half >= n) return low;
        const double high = value(i + neighbour_step);
        if (index < 3 * half || index + 3 * half >= n) return (low + high) / 2;
        return (9 * (low + high) -
                (value(i - 3 * neighbour_step) + value(i + 3 * neighbour_step))) /
               16;
      });
      first[axis] = 0;
      step[axis] = half;
    }
}

/// Packs arrays as 16-bit differences from predictions by neighbours (refine()). All low bytes of
/// an array come before its high bytes, so that deflate finds similar bytes together.
class Packer {
 public:
  /// Adds an array with an error of at most half of `step`. Differences of more than 16 bits are
  /// clamped. Returns what the page needs to decode the array.
  JsonValue add(std::span<const float> values, const Shape& shape, float step) {
    PM_CHECK(values.size() == shape.size());
    const auto [low, high] = std::minmax_element(values.begin(), values.end());
    const double middle = (static_cast<double>(*low) + static_cast<double>(*high)) / 2;
    const double step_size = step > 0 ? static_cast<double>(step) : 1;
    const std::size_t at = bytes_.size(), count = values.size();
    bytes_.resize(at + 2 * count);
    std::vector<double> reconstruction(count);  // as the page will decode them, minus the middle
    std::size_t next = 0;
    refine(shape, reconstruction, [&](std::size_t i, double prediction) {
      const double offset_value = static_cast<double>(values[i]) - middle;
      const auto steps = static_cast<int>(
          std::clamp(std::round((offset_value - prediction) / step_size), -32768.0, 32767.0));
      reconstruction[i] = prediction + steps * step_size;
      // Zigzag encoding: small steps of either sign become small numbers.
      const unsigned zigzag = static_cast<unsigned>(steps >= 0 ? 2 * steps : -2 * steps - 1);
      bytes_[at + next] = static_cast<char>(zigzag & 255);
      bytes_[at + count + next] = static_cast<char>(zigzag >> 8);
      ++next;
    });
    return {{"at", at},
            {"n", shape.n},
            {"smooth", shape.smooth},
            {"middle", middle},
            {"step", step_size}};
  }

  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

/// Computes the step that divides the range of the values into `steps`; 0 if all are equal.
float range_step(std::span<const float> values, float steps) {
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  return (*high - *low) / steps;
}

Shape make_shape(Int3 points) {
  return {{points.x, points.y, points.z}, /*smooth=*/{true, true, true}};
}

JsonValue object_json(const PlayObject& object, float cell, Packer& packer) {
  JsonValue json{{"name", printable(object.name)}, {"color", to_array(object.color)}};
  const auto add_volume = [&](const char* name, const DistanceGrid* volume, float step) {
    if (!volume) return;
    json[name] = grid_json(volume->grid);
    json[name]["values"] = packer.add(volume->values, make_shape(volume->grid.points), step);
  };
  add_volume("distances", object.distances.get(), kDistanceStep * cell);
  add_volume("smooth", object.smooth.get(), kDistanceStep * cell);
  add_volume("thinness", object.thinness.get(), kThinnessStep);
  if (!object.colors.empty()) {
    json["colors"] = grid_json(object.color_grid);
    for (float Vec3::*c : {&Vec3::x, &Vec3::y, &Vec3::z}) {
      std::vector<float> channel;
      for (const Vec3& color : object.colors) channel.push_back(linear_to_srgb(color.*c));
      json["colors"]["values"].push_back(
          packer.add(channel, make_shape(object.color_grid.points), /*step=*/1.0f / 128));
    }
  }
  return json;
}

/// Lower triangular factor L of a shape L L^T (Cholesky). The page gets the logarithms of its
/// diagonal and its columns divided by the diagonal, because rounding the shape itself
/// would distort thin ellipsoids.
struct Factor {
  float xx, xy, xz, yy, yz, zz;
};
Factor factorize(const Sym3& s) {
  constexpr float kMin = 1e-12f;  // rounding may make radicands negative
  Factor f{};
  f.xx = std::sqrt(std::max(s.xx, kMin));
  f.xy = s.xy / f.xx;
  f.xz = s.xz / f.xx;
  f.yy = std::sqrt(std::max(s.yy - f.xy * f.xy, kMin));
  f.yz = (s.yz - f.xz * f.xy) / f.yy;
  f.zz = std::sqrt(std::max(s.zz - f.xz * f.xz - f.yz * f.yz, kMin));
  return f;
}

/// First channel of list_channels() that describes a ball's size and shape, and the number of these
/// channels (a, w and six of the factor). Distance legs only display the balls.
constexpr std::size_t kFirstDisplayed = 3, kDisplayed = 8;

/// Lists the channels of one pair at a key, in the order of play.html.
std::vector<float> list_channels(const PlayKey& key, std::size_t pair) {
  const Ball& ball = key.balls[pair];
  const Factor f = factorize(ball.shape);
  const Regression& map = *key.between.map;
  const RegressionSample& sample = map.samples[pair];
  std::vector<float> v{
      sample.center.x, sample.center.y,  sample.center.z,      std::log(ball.a), ball.w,
      std::log(f.xx),  f.xy / f.xx,      f.xz / f.xx,          std::log(f.yy),   f.yz / f.yy,
      std::log(f.zz),  sample.deviation, std::log(sample.mass)};
  for (std::size_t m = 0; m < 2; ++m)
    for (const float value : map.values[2 * pair + m].value) v.push_back(value);
  if (map.sloped)
    for (std::size_t m = 0; m < 2; ++m)
      for (int row = 0; row < 3; ++row) {
        const Vec3 slope = map.values[2 * pair + m].slope[row];
        v.insert(v.end(), {slope.x, slope.y, slope.z});
      }
  return v;
}

/// Lists the values that are common to all pairs of a key, in the order of play.html.
JsonValue common_json(const PlayKey& key) {
  JsonValue numbers = JsonValue::array();
  const auto add = [&](Vec3 v) {
    for (const float f : {v.x, v.y, v.z}) numbers.push_back(f);
  };
  for (const AffineMap& map : key.between.map->affine) {
    for (const Vec3 row : map.rows) add(row);
    add(map.offset);
  }
  add(key.box.low);
  add(key.box.high);
  for (const float f :
       {key.between.map->lattice.cell, key.between.from_scale, key.between.to_scale,
        key.between.level, key.progress, key.between.linear_range, key.min_component_share})
    numbers.push_back(f);
  return numbers;
}

/// Writes the progress at which an object's detail begins to fade and at which it is gone. Returns
/// null if the object has no distances without detail: its detail stays.
JsonValue fade_json(const std::shared_ptr<const DistanceGrid>& smooth, const DetailFade& fade) {
  return smooth ? JsonValue::array({fade.begin, fade.end}) : JsonValue();
}

/// Writes the landmarks of a leg's maps: their positions on both objects ("goals") and, for each
/// key, their positions in between and deviations ("places").
JsonValue landmarks_json(const PlayLeg& leg) {
  JsonValue goals = JsonValue::array(), positions = JsonValue::array();
  for (const RegressionLandmark& landmark : leg.keys.front().between.map->landmarks) {
    const auto& [a, b] = landmark.goal;
    goals.push_back(JsonValue::array({a.x, a.y, a.z, b.x, b.y, b.z}));
  }
  for (const PlayKey& key : leg.keys) {
    JsonValue numbers = JsonValue::array();
    for (const auto& [position, deviation, goal] : key.between.map->landmarks)
      for (const float v : {position.x, position.y, position.z, deviation}) numbers.push_back(v);
    positions.push_back(numbers);
  }
  return {{"goals", goals}, {"places", positions}};
}

/// Writes a leg: the channels of all keys and pairs as packed arrays, everything else as numbers.
JsonValue leg_json(const PlayLeg& leg, Packer& packer) {
  JsonValue times = JsonValue::array(), common = JsonValue::array();
  std::vector<std::vector<float>> rows;  // one per key and pair
  for (const PlayKey& key : leg.keys) {
    times.push_back(key.time);
    common.push_back(common_json(key));
    for (std::size_t e = 0; e < key.balls.size(); ++e) rows.push_back(list_channels(key, e));
  }
  const int keys = static_cast<int>(leg.keys.size()),
            pairs = static_cast<int>(leg.keys.front().balls.size());
  const Shape shape{{pairs, keys, 1}, /*smooth=*/{false, true, false}};  // smooth in time
  JsonValue channels = JsonValue::array();
  for (std::size_t c = 0; c < rows.front().size(); ++c) {
    std::vector<float> values;
    for (const std::vector<float>& row : rows) values.push_back(row[c]);
    const bool display_only =
        leg.distance && c >= kFirstDisplayed && c < kFirstDisplayed + kDisplayed;
    const float steps = display_only ? kDisplaySteps : leg.distance ? kMotionSteps : kBallSteps;
    channels.push_back(packer.add(values, shape, range_step(values, steps)));
  }
  const MorphSurface& first = leg.keys.front().between;
  return {{"from", leg.from},
          {"to", leg.to},
          {"distance", leg.distance},
          {"fades", JsonValue::array({fade_json(first.smooth_from, first.fade_from),
                                      fade_json(first.smooth_to, first.fade_to)})},
          {"weighed", first.map->thinness[0] != nullptr},
          {"times", times},
          {"common", common},
          {"landmarks", landmarks_json(leg)},
          {"pairs", pairs},
          {"channels", channels}};
}

/// Packs one number per ball.
JsonValue ball_json(std::span<const float> values, Packer& packer) {
  const Shape shape{{static_cast<int>(values.size()), 1, 1}, /*smooth=*/{false, false, false}};
  return packer.add(values, shape, range_step(values, kBallSteps));
}

JsonValue space_json(const PlaySpace& space, Packer& packer) {
  JsonValue json{{"masses", space.masses},           {"radii", space.deviations},
                 {"middle", to_array(space.middle)}, {"keeps_volume", space.keeps_volume},
                 {"contact", space.contact},         {"look", space.look}};
  const auto vector = [](Vec3d v) { return JsonValue::array({v.x, v.y, v.z}); };
  for (const PlaySpaceObject& object : space.objects) {
    JsonValue entry{{"low", to_array(object.box.low)},
                    {"high", to_array(object.box.high)},
                    {"volume", object.volume},
                    {"min_part", object.min_component_share},
                    {"from", vector(object.from_center)},
                    {"to", vector(object.to_center)},
                    {"turn", vector(object.axis_angle)},
                    {"log_scale", object.log_scale}};
    for (float Vec3::*c : {&Vec3::x, &Vec3::y, &Vec3::z}) {
      std::vector<float> axis;
      for (const Vec3& position : object.balls) axis.push_back(position.*c);
      entry["places"].push_back(ball_json(axis, packer));
    }
    json["objects"].push_back(std::move(entry));
  }
  return json;
}

JsonValue actor_json(const PlayActor& actor, Packer& packer) {
  JsonValue json{
      {"name", printable(actor.name)}, {"cell", actor.cell}, {"legs", JsonValue::array()}};
  for (const PlayObject& object : actor.objects)
    json["objects"].push_back(object_json(object, actor.cell, packer));
  for (const PlayLeg& leg : actor.legs) json["legs"].push_back(leg_json(leg, packer));
  const bool mixes = !actor.space.objects.empty();
  if (mixes) json["space"] = space_json(actor.space, packer);
  for (const PlayFrame& frame : actor.frames)
    json["frames"].push_back(mixes ? JsonValue(frame.weights)
                                   : JsonValue::array({frame.leg, frame.time, frame.look}));
  return json;
}

/// Lists the triangles of each case of marching cubes as a text with three digits per triangle, to
/// base 12: the edges of its vertices.
JsonValue cases_json() {
  constexpr const char* kDigits = "0123456789ab";
  const McTable& table = mc_table();
  JsonValue cases = JsonValue::array();
  for (int key = 0; key < 256; ++key) {
    std::string edges;
    for (int i = 0; i < 3 * table.count[key]; ++i) edges += kDigits[table.edges[key][i]];
    cases.push_back(edges);
  }
  return cases;
}

}  // namespace

std::string encode_play_page(const PlayPage& page) {
  Packer packer;
  const FrameCamera& c = page.camera;
  JsonValue json{{"title", printable(page.title)},
                 {"fps", page.fps},
                 {"field", field_name(page.field)},
                 {"look",
                  {{"color", to_array(page.look.color)},
                   {"roughness", page.look.roughness},
                   {"metallic", page.look.metallic}}},
                 {"camera",
                  {{"position", to_array(c.position)},
                   {"forward", to_array(c.forward)},
                   {"tan_half_fov_y", c.tan_half_fov_y}}},
                 {"low", to_array(page.box.low)},
                 {"high", to_array(page.box.high)},
                 {"ground", page.has_ground ? JsonValue(page.ground) : JsonValue()}};
  for (const PlayActor& actor : page.actors) json["actors"].push_back(actor_json(actor, packer));
  json["cases"] = cases_json();
  return fill_page(play_page, {{"{{title}}", escape_markup(page.title)},
                               {"{{morph}}", json_in_script(format_json(json))},
                               {"{{bytes}}", pack_text(packer.bytes())}});
}

}  // namespace polymorph
