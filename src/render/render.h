// Renderer: ray traces one frame of meshes, camera and lights into an image with AOVs. The only
// room that includes Embree.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"
#include "image/image.h"
#include "kernels/types.h"
#include "model/model.h"
#include "model/transfer.h"
#include "scene/scene.h"

namespace polymorph {

/// Where a mesh that took its materials from a model crosses borders of the model's charts or
/// materials. A hit there asks the model itself: else borders would be as jagged as the triangles.
/// Borrowed.
struct MaterialBorders {
  const Model* model = nullptr;
  const ClosestPointQuery* closest = nullptr;
  std::span<const BorderTriangle> triangles;
  /// Of each triangle of the mesh one of those, or TransferredMaterials::kNoBorder; empty: none.
  std::span<const std::uint32_t> border_of;
};

/// What a mesh is made of. Spans are borrowed.
struct MaterialLayer {
  std::span<const Vec2> corner_uvs;                   ///< 3 per triangle, or empty
  std::span<const std::uint32_t> triangle_materials;  ///< one per triangle, or empty = material 0
  std::span<const Material> materials;                ///< empty = wholly the common look
  std::span<const std::shared_ptr<const Image>> textures;
  MaterialBorders borders = {};
};

/// The material and the place on its texture at a point of one of the mesh's triangles; `u` and `v`
/// are the weights of its second and third corner.
TexturePoint texture_point(const MaterialLayer& layer, std::uint32_t triangle, float u, float v);

/// A layer over others: colours, gloss and roughness are mixed.
struct MixedLayer : MaterialLayer {
  float share = 0;  ///< [0, 1]
};

/// One surface to trace, with its own materials. Spans are borrowed for the length of the call.
struct RenderMesh : MaterialLayer {
  std::span<const Vec3> positions;
  std::span<const Triangle> triangles;
  std::span<const Vec3> vertex_normals;  ///< one per position, or empty
  std::span<const Vec3>
      corner_normals;            ///< 3 per triangle, or empty; used when vertex_normals is empty
  std::vector<MixedLayer> over;  ///< what it turns into, one over the other
  /// Scene-linear, one per position, or empty: mixed over the layers' colour.
  std::span<const Vec3> vertex_colors;
  float vertex_color_share = 0;  ///< [0, 1]
  float look = 0;  ///< 0 = own materials, 1 = the common look; between: the two BSDFs mixed
  float id = 0;    ///< written to the id AOV; > 0 (ground 1 is reserved; 0 = nothing hit)
  std::span<const Vec3> displacement;  ///< from this frame to the next, one per position, or empty
  /// Of the morph AOV, one per position, or empty = `progress`.
  std::span<const float> vertex_progress;
  std::span<const std::uint32_t> vertex_labels;  ///< of the label AOV, one per position, or empty
  std::uint32_t first_label = 1;                 ///< what label 0 is written as
  float progress = 0;  ///< [0, 1]: 0 = wholly what the leg comes from, 1 = what it goes to
  bool moves = true;   ///< it is another in the frames before and after: its noise is new
  /// Of the crypto_object matte, and of crypto_label: what vertex_labels count from 0.
  std::string name;
  std::vector<std::string> label_names;
};

/// A camera, ready to shoot.
struct Camera {
  Vec3 position{0, 0, 5};
  Vec3 right{1, 0, 0}, up{0, 1, 0}, forward{0, 0, -1};  ///< orthonormal
  float tan_half_fov_y = 0.27f;
  float lens_radius = 0;  ///< of a thin lens; 0 = a pinhole
  float focus = 1;        ///< distance along `forward` that is sharp; for lens_radius > 0
  float shutter = 0;      ///< frames that it is open, half before and half after the moment
};

/// Frames a box: the smallest distance at which the box's 8 corners keep the margin, unless the
/// settings fix the position. `orbit` is the angle that the camera has gone round already.
Camera make_camera(const CameraSettings& settings, const Box& box, int width, int height);
/// The same for the points themselves, which keeps less empty space than their box.
Camera make_camera(const CameraSettings& settings, std::span<const Vec3> points, int width,
                   int height);

/// One framing for a camera that moves.
struct Framing {
  Vec3 middle;         ///< of all objects
  Vec3 anchor;         ///< the camera looks at it, where the settings have no target
  float distance = 1;  ///< from there, at the margin `margin` and for dolly 1
  float margin = 0;
};
/// The distance at which the points keep the least margin of all poses, with the widest field of
/// view of all, in whatever direction a pose looks. Poses that all look the same way are framed as
/// tightly as a camera that stands still.
Framing make_framing(std::span<const CameraSettings> poses, std::span<const Vec3> points, int width,
                     int height);
/// A camera of a film, framed with all others.
Camera make_camera(const CameraSettings& settings, const Framing& framing);

/// A camera beside the frame's own, where it moves.
struct CameraMotion {
  Camera opening, closing;  ///< when the shutter opens and closes
  Camera next;              ///< in the next frame; on the last one the frame's own
};

struct RenderScene {
  std::vector<RenderMesh> meshes;
  Camera camera;
  std::optional<CameraMotion> camera_motion;  ///< empty: it stands still
  std::optional<Camera> rig;  ///< whose bearing the lights and the studio have; empty: `camera`
  LightSettings lights;
  GroundSettings ground;  ///< `height` must be set when enabled
  LookSettings look;
  /// Lat-long, row 0 the zenith, the middle looking along -z, a quarter to its right +x. It is the
  /// backdrop, too, and the floor fades into it. Null = the built-in studio, whose sky only
  /// reflections see; the camera sees a paper of the floor's colour.
  std::shared_ptr<const Image> environment;
  Box bounds;        ///< of the whole sequence: sizes the ground's fade and ray offsets
  float moment = 0;  ///< [0, 1] of the sequence, written to the morph AOV
};

struct RenderSettings {
  ImageSettings image;
  /// Part of the random keys: noise differs from frame to frame, with image.steady only where
  /// something moves (RenderMesh::moves) or the camera does.
  int frame = 0;
};

/// Bytes of a picture as render() makes it, with all its channels.
std::uint64_t picture_bytes(const ImageSettings& image);

/// Is the library there that image.denoise needs? Errors (kResource): how to get it.
Status check_denoiser();

/// Path tracing. Lights: `key_intensity` is the irradiance on a surface that faces the key light,
/// `sky_intensity` scales the sky; the defaults put a mid-grey object at about half of the sRGB
/// range and a white one just below white. A path may scatter at `max_depth` surfaces; two sharp
/// mirrors are free. Biases, for clean pictures at few samples: strong light by way of a second
/// surface is cut off (path.cpp, kIndirectLimit), and after a diffuse surface gloss is
/// followed as diffuse of the same colour (no caustics; light goes straight on through glass).
/// Filter: Blackman-Harris, radius 1.35 pixels. With image.noise, a block of pixels is sampled in
/// doubling rounds, 16 samples first, until its estimated error is below it.
///
/// With image.denoise the colours are cleaned at last (render/film/denoise.h).
///
/// Keeps the Embree device and the sky between frames. Not shared between threads.
class Renderer {
 public:
  /// `isa`: "" = the best the machine has; "avx2", "sse2", ... pins it (goldens).
  /// Errors: kResource.
  static Result<Renderer> create(const std::string& isa = "");
  ~Renderer();
  Renderer(Renderer&&) noexcept;
  Renderer& operator=(Renderer&&) noexcept;

  /// Channels R G B A (alpha below 1 only where the image is transparent or the ground
  /// shadow_only), then the AOVs, each of what the ray through the pixel's centre met first
  /// (render/aov.h). Same image for any number of threads.
  Result<Image> render(const RenderScene& scene, const RenderSettings& settings);

  struct Stats {
    double build_seconds = 0, trace_seconds = 0, denoise_seconds = 0;
    std::uint64_t rays = 0, paths = 0;
  };
  Stats stats() const;  ///< of the last call
  std::string isa() const;

 private:
  struct State;
  explicit Renderer(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace polymorph
