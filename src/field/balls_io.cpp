#include "field/balls_io.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>

#include "base/file.h"
#include "base/json.h"
#include "field/near_balls.h"
#include "kernels/field_kinds.h"

namespace polymorph {
namespace {

/// Returns the radius of the surface of a single ball; 0 if it has none.
float visible_radius(const Ball& ball, FieldKind kind) {
  return visit(kind, [&](auto field) {
    // q = a r^2, or r^2 for kinds with infinite support (field_kinds.h).
    const float q = std::max(field.surface(ball), 0.0f);
    const float radius = std::sqrt(field.kCompactSupport ? q / ball.a : q);
    return std::min(radius, std::numeric_limits<float>::max());  // JSON has no infinity
  });
}

/// Formats a ball's shape as a JSON member; empty for a round ball.
std::string shape_text(const Ball& ball) {
  const Sym3& s = ball.shape;
  return is_round(ball) ? std::string()
                        : fmt::format(", \"shape\": [{}, {}, {}, {}, {}, {}]", s.xx, s.yy, s.zz,
                                      s.xy, s.xz, s.yz);
}

bool read_number(const JsonValue& value, float& out) {
  out = static_cast<float>(value.number);
  return value.is_number();
}

/// Reads the first N items of a list; false if there are fewer or one is not a number.
template <std::size_t N>
bool read_numbers(const JsonValue& list, std::array<float, N>& out) {
  if (list.items.size() < N) return false;
  for (std::size_t i = 0; i < N; ++i)
    if (!read_number(list.items[i], out[i])) return false;
  return true;
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
  PM_TRY(const JsonDocument document, parse_json(name, std::string(text)));
  const JsonValue& balls = document.root.get("balls");
  if (!balls.is_array())
    return make_error(ErrorCode::kInput, "{}: not a file of balls - it has no list \"balls\"",
                      name);
  BallFile file;
  if (const JsonValue* field = document.root.find("field")) {
    const auto* kind = std::find_if(std::begin(kFieldKinds), std::end(kFieldKinds),
                                    [&](FieldKind k) { return field_name(k) == field->string; });
    if (kind == std::end(kFieldKinds))
      return make_error(ErrorCode::kInput, "{}: unknown field \"{}\"", name, field->string);
    file.kind = *kind;
  }
  for (const JsonValue& entry : balls.items) {
    Ball ball;
    std::array<float, 3> c{};
    std::array<float, 6> s{};
    if (!read_numbers(entry.get("center"), c) || !read_number(entry.get("w"), ball.w) ||
        (entry.contains("a") && !read_number(entry.get("a"), ball.a)) ||
        (entry.contains("shape") && !read_numbers(entry.get("shape"), s)))
      return make_error(ErrorCode::kInput,
                        "{}: ball {}: needs \"center\", a list of 3 numbers, and the number \"w\"; "
                        "\"a\" is a number, \"shape\" a list of 6",
                        name, file.balls.size() + 1);
    ball.center = {c[0], c[1], c[2]};
    if (entry.contains("shape")) ball.shape = {s[0], s[1], s[2], s[3], s[4], s[5]};
    const Sym3& shape = ball.shape;
    const float sum = c[0] + c[1] + c[2] + ball.a + ball.w + shape.xx + shape.yy + shape.zz +
                      shape.xy + shape.xz + shape.yz;
    if (!std::isfinite(sum) || !(ball.a > 0))
      return make_error(ErrorCode::kInput, "{}: ball {}: its numbers must be finite, and a above 0",
                        name, file.balls.size() + 1);
    file.balls.push_back(ball);
  }
  return file;
}

}  // namespace polymorph
