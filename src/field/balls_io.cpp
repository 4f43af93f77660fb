#include "field/balls_io.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <nlohmann/json.hpp>

#include "base/file.h"
#include "field/near_balls.h"
#include "kernels/field_kinds.h"

namespace polymorph {
namespace {

/// Of the ball alone; 0 where it shows no surface.
float visible_radius(const Ball& ball, FieldKind kind) {
  return visit(kind, [&](auto field) {
    const float q = std::max(field.surface(ball), 0.0f);
    const float radius = std::sqrt(field.kCompactSupport ? q / ball.a : q);
    return std::min(radius, std::numeric_limits<float>::max());  // JSON has no infinity
  });
}

/// The ellipsoid of a ball that is not round.
std::string shape_text(const Ball& ball) {
  const Sym3& s = ball.shape;
  return is_round(ball) ? std::string()
                        : fmt::format(", \"shape\": [{}, {}, {}, {}, {}, {}]", s.xx, s.yy, s.zz,
                                      s.xy, s.xz, s.yz);
}

}  // namespace

std::string encode_balls(const std::vector<Ball>& balls, FieldKind kind) {
  std::string text = fmt::format("{{\n  \"field\": \"{}\",\n  \"balls\": [", field_name(kind));
  auto out = std::back_inserter(text);
  for (std::size_t i = 0; i < balls.size(); ++i)
    fmt::format_to(out,
                   "{}\n    {{\"center\": [{}, {}, {}], \"a\": {}, \"w\": {}, \"radius\": {}{}}}",
                   i ? "," : "", balls[i].center.x, balls[i].center.y, balls[i].center.z,
                   balls[i].a, balls[i].w, visible_radius(balls[i], kind), shape_text(balls[i]));
  text += "\n  ]\n}\n";
  return text;
}

std::string encode_balls_csv(const std::vector<Ball>& balls, FieldKind kind) {
  std::string text = "x,y,z,a,w,radius,xx,yy,zz,xy,xz,yz\n";
  auto out = std::back_inserter(text);
  for (const Ball& b : balls)
    fmt::format_to(out, "{},{},{},{},{},{},{},{},{},{},{},{}\n", b.center.x, b.center.y, b.center.z,
                   b.a, b.w, visible_radius(b, kind), b.shape.xx, b.shape.yy, b.shape.zz,
                   b.shape.xy, b.shape.xz, b.shape.yz);
  return text;
}

Result<BallFile> read_balls(const std::filesystem::path& path) {
  remember_input(path);
  PM_TRY(const std::string text, read_file(path));
  return decode_balls(text, path.string());
}

Result<BallFile> decode_balls(std::string_view text, const std::string& name) {
  BallFile file;
  try {
    const auto json = nlohmann::json::parse(text);
    const std::string field = json.value("field", std::string(field_name(file.kind)));
    const auto* kind = std::find_if(std::begin(kFieldKinds), std::end(kFieldKinds),
                                    [&](FieldKind k) { return field_name(k) == field; });
    if (kind == std::end(kFieldKinds))
      return make_error(ErrorCode::kInput, "{}: unknown field \"{}\"", name, field);
    file.kind = *kind;
    for (const auto& entry : json.at("balls")) {
      Ball ball;
      const auto& c = entry.at("center");
      ball.center = {c.at(0).get<float>(), c.at(1).get<float>(), c.at(2).get<float>()};
      ball.a = entry.value("a", 1.0f);
      ball.w = entry.at("w").get<float>();
      if (entry.contains("shape")) {
        const auto s = entry.at("shape").get<std::array<float, 6>>();
        ball.shape = {s[0], s[1], s[2], s[3], s[4], s[5]};
      }
      const Sym3& s = ball.shape;
      const float sum = ball.center.x + ball.center.y + ball.center.z + ball.a + ball.w + s.xx +
                        s.yy + s.zz + s.xy + s.xz + s.yz;
      if (!std::isfinite(sum) || !(ball.a > 0))
        return make_error(ErrorCode::kInput,
                          "{}: ball {}: its numbers must be finite, and a above 0", name,
                          file.balls.size() + 1);
      file.balls.push_back(ball);
    }
  } catch (const nlohmann::json::exception& error) {
    return make_error(ErrorCode::kInput, "{}: not a file of balls ({})", name, error.what());
  }
  return file;
}

}  // namespace polymorph
