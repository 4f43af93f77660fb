#include <array>
#include <limits>
#include <vector>

#include "render/math/vector_math.h"
#include "render/render.h"

namespace polymorph {
namespace {

/// Coordinates of a point relative to the target: along one axis of the picture, and along the view
/// axis.
struct AxisPoint {
  float across, along;
};
using AxisPoints = std::vector<AxisPoint>;

/// Bounds of the shifts c with which a camera at distance d sees all points. They follow from
/// |across - c| <= t (d + along), where t is the tangent of half the field of view: low - t d <= c
/// <= high + t d, with low = max(across - t along) and high = min(across + t along).
struct ShiftRange {
  float low, high;
};
ShiftRange shift_range(const AxisPoints& points, float t) {
  ShiftRange range{-std::numeric_limits<float>::infinity(), std::numeric_limits<float>::infinity()};
  for (AxisPoint point : points) {
    range.low = std::max(range.low, point.across - t * point.along);
    range.high = std::min(range.high, point.across + t * point.along);
  }
  return range;
}

/// Computes the smallest distance at which some shift lets the camera see all points.
float smallest_distance(const AxisPoints& points, float t) {
  const ShiftRange range = shift_range(points, t);
  return (range.low - range.high) / (2 * t);
}

/// Computes the smallest distance without a shift, that is with the view axis through the target.
float smallest_centered_distance(const AxisPoints& points, float t) {
  float distance = 0;
  for (AxisPoint point : points)
    distance = std::max(distance, std::fabs(point.across) / t - point.along);
  return distance;
}

/// Computes the shift that centres the projection at distance d. It finds the smallest t with which
/// the camera sees all points by bisection; at this t only one shift is possible.
float centering_shift(const AxisPoints& points, float d, float t) {
  float low = 0, high = t;
  for (int i = 0; i < 40; ++i) {  // more steps than a float has bits
    const float middle = 0.5f * (low + high);
    const ShiftRange range = shift_range(points, middle);
    (range.low - range.high <= 2 * middle * d ? high : low) = middle;
  }
  const ShiftRange range = shift_range(points, high);
  return 0.5f * (range.low + range.high);
}

void set_axes(Camera& camera, Vec3 forward, Vec3 up) {
  camera.forward = normalized(forward);
  Vec3 right = cross(camera.forward, up);
  // If the camera looks along `up`, `right` may be any fixed axis across the view.
  if (dot(right, right) < 1e-8f * dot(up, up) || !(dot(up, up) > 0))
    right = make_frame(camera.forward).x;
  camera.right = normalized(right);
  camera.up = cross(camera.right, camera.forward);
}

/// Replaces an empty box by a cube of edge length 2 around 0, and a point by one around it.
Box make_usable_box(const Box& box) {
  if (box.empty()) return {{-1, -1, -1}, {1, 1, 1}};
  if (box.diagonal() > 0) return box;
  return widened(box, 1);
}

Vec3 rotate_about_y(Vec3 offset, float degrees) {
  if (degrees == 0) return offset;
  const Vec3 rotation = direction_at(radians(degrees), 0);  // its x is the sine, its z the cosine
  return {rotation.z * offset.x + rotation.x * offset.z, offset.y,
          rotation.z * offset.z - rotation.x * offset.x};
}

/// Sets the field of view and orientation, from a given position or from angles.
void set_view(Camera& camera, const CameraSettings& settings, Vec3 target) {
  camera.tan_half_fov_y = tangent(0.5f * radians(settings.fov));
  if (settings.position) {
    const Vec3 forward = rotate_about_y(target - *settings.position, settings.orbit);
    set_axes(camera, dot(forward, forward) > 0 ? forward : Vec3{0, 0, -1}, settings.up);
    return;
  }
  const float azimuth = radians(settings.azimuth + settings.orbit),
              elevation = radians(settings.elevation);
  const Vec3 to_camera = direction_at(azimuth, elevation);
  set_axes(camera, -to_camera, settings.up);
}

/// Returns the given position after orbit and dolly: without either, exactly the given numbers.
Vec3 get_position(const CameraSettings& settings, Vec3 target) {
  if (settings.orbit == 0 && settings.dolly == 1) return *settings.position;
  return target + rotate_about_y(*settings.position - target, settings.orbit) * settings.dolly;
}

/// Sets lens and shutter. Without a given focus the target is sharp, if it is in front of the
/// camera.
void set_lens(Camera& camera, const CameraSettings& settings, Vec3 target) {
  camera.lens_radius = 0.5f * settings.aperture;
  camera.focus =
      settings.focus.value_or(std::max(dot(target - camera.position, camera.forward), 1e-6f));
  camera.shutter = settings.shutter;
}

/// Fraction of the picture's half height or width that the margins leave, at least a tenth: margins
/// of a half would leave nothing.
float usable_fraction(float margin) { return std::max(0.1f, 1 - 2 * margin); }

/// Coordinates of points relative to the target, for the picture's x and y axis.
struct ProjectedPoints {
  AxisPoints x, y;
};
ProjectedPoints project_points(const Camera& camera, std::span<const Vec3> points, Vec3 target) {
  ProjectedPoints result;
  result.x.reserve(points.size());
  result.y.reserve(points.size());
  for (const Vec3& point : points) {
    const Vec3 p = point - target;
    result.x.push_back({dot(p, camera.right), dot(p, camera.forward)});
    result.y.push_back({dot(p, camera.up), dot(p, camera.forward)});
  }
  return result;
}

/// Makes a camera without a lens: at the given position, or at the smallest distance at which the
/// points keep the margin.
Camera frame_points(const CameraSettings& settings, std::span<const Vec3> points, Vec3 target,
                    int width, int height) {
  Camera camera;
  set_view(camera, settings, target);
  if (settings.position) {
    camera.position = get_position(settings, target);
    return camera;
  }
  const auto [x, y] = project_points(camera, points, target);
  // Tangents of the half angles within which the points must lie.
  const float ty = camera.tan_half_fov_y * usable_fraction(settings.margin);
  const float tx = ty * static_cast<float>(width) / static_cast<float>(height);
  if (settings.target) {
    // The view axis must pass through the given target.
    const float d = std::max(smallest_centered_distance(x, tx), smallest_centered_distance(y, ty));
    camera.position = target - camera.forward * (d * settings.dolly);
    return camera;
  }
  const float d = std::max(smallest_distance(x, tx), smallest_distance(y, ty));
  camera.position = target - camera.forward * (d * settings.dolly) +
                    camera.right * centering_shift(x, d, tx) +
                    camera.up * centering_shift(y, d, ty);
  return camera;
}

}  // namespace

Camera make_camera(const CameraSettings& settings, const Box& scene_box, int width, int height) {
  const Box box = make_usable_box(scene_box);
  std::array<Vec3, 8> corners;
  for (unsigned i = 0; i < 8; ++i)
    corners[i] = {i & 1 ? box.high.x : box.low.x, i & 2 ? box.high.y : box.low.y,
                  i & 4 ? box.high.z : box.low.z};
  return make_camera(settings, corners, width, height);
}

Camera make_camera(const CameraSettings& settings, std::span<const Vec3> points, int width,
                   int height) {
  const Box box = bounding_box(points);
  // Points without an extent are replaced by the corners of a cube (make_usable_box()).
  if (!(box.diagonal() > 0)) return make_camera(settings, box, width, height);
  const Vec3 target = settings.target.value_or(box.center());
  Camera camera = frame_points(settings, points, target, width, height);
  set_lens(camera, settings, target);
  return camera;
}

Framing make_framing(std::span<const CameraSettings> poses, std::span<const Vec3> points, int width,
                     int height) {
  Framing framing;
  framing.middle = framing.anchor = make_usable_box(bounding_box(points)).center();
  framing.margin = poses.front().margin;
  float fov = poses.front().fov;
  for (const CameraSettings& pose : poses) {
    framing.margin = std::min(framing.margin, pose.margin);
    fov = std::max(fov, pose.fov);
  }
  const auto with_common_lens = [&](const CameraSettings& pose) {
    CameraSettings wide = pose;
    wide.fov = fov;
    wide.margin = framing.margin;
    wide.dolly = 1;
    return wide;
  };
  const auto has_first_direction = [&](const CameraSettings& pose) {
    const CameraSettings& first = poses.front();
    return pose.azimuth + pose.orbit == first.azimuth + first.orbit &&
           pose.elevation == first.elevation && pose.up == first.up && pose.target == first.target;
  };
  if (std::all_of(poses.begin(), poses.end(), has_first_direction)) {
    const Camera camera = make_camera(with_common_lens(poses.front()), points, width, height);
    const Vec3 target = poses.front().target.value_or(framing.middle);
    framing.distance = dot(target - camera.position, camera.forward);
    framing.anchor = camera.position + camera.forward * framing.distance;
    return framing;
  }
  // Otherwise the camera looks at the middle, from the largest distance that a pose needs.
  framing.distance = 0;
  for (const CameraSettings& pose : poses) {
    CameraSettings centered = with_common_lens(pose);
    if (!centered.target) centered.target = framing.middle;
    const Camera camera = make_camera(centered, points, width, height);
    framing.distance =
        std::max(framing.distance, dot(*centered.target - camera.position, camera.forward));
  }
  return framing;
}

Camera make_camera(const CameraSettings& settings, const Framing& framing) {
  Camera camera;
  const Vec3 target = settings.target.value_or(framing.middle);
  set_view(camera, settings, target);
  if (settings.position) {
    camera.position = get_position(settings, target);
  } else {
    // A larger margin than the smallest of all poses needs a larger distance.
    const float distance = framing.distance * settings.dolly * usable_fraction(framing.margin) /
                           usable_fraction(settings.margin);
    camera.position = settings.target.value_or(framing.anchor) - camera.forward * distance;
  }
  set_lens(camera, settings, target);
  return camera;
}

}  // namespace polymorph
