// Renderer: ray traces one frame of meshes, camera and lights into an image with AOVs. Only the
// folder src/render includes Embree.
#pragma once

#include <algorithm>
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
#include "render/sample_range.h"
#include "scene/scene.h"

namespace polymorph {

/// Borders between texture charts or materials, for a mesh whose materials were transferred from a
/// model. Hits on triangles that cross a border look up the model itself, so that borders do not
/// follow the mesh's triangles. All members are borrowed.
struct MaterialBorders {
  const Model* model = nullptr;
  const ClosestPointQuery* closest = nullptr;  ///< finds closest points on the model's surface
  std::span<const BorderTriangle> triangles;   ///< the mesh's triangles that cross a border
  /// Per mesh triangle: its index in `triangles`, or TransferredMaterials::kNoBorder. Empty: there
  /// are no borders.
  std::span<const std::uint32_t> border_index;

  /// The model's material and texture coordinates at a point of triangles[border]; `u` and `v` as
  /// for texture_point().
  TexturePoint at(std::uint32_t border, float u, float v) const;
};

/// Materials and texture coordinates of a mesh. Spans are borrowed.
struct MaterialLayer {
  std::span<const Vec2> corner_uvs;  ///< 3 per triangle, or empty; then textures are not used
  std::span<const std::uint32_t> triangle_materials;  ///< one per triangle, or empty = material 0
  std::span<const Material> materials;                ///< empty = RenderScene::look instead
  std::span<const std::shared_ptr<const Texture>> textures;  ///< indexed by Material::texture
  MaterialBorders borders = {};
  /// If not null, looks up what `corner_uvs`, `triangle_materials` and `borders` would hold.
  const MaterialTransfer* transfer = nullptr;

  bool has_uvs() const { return transfer ? transfer->has_uvs() : !corner_uvs.empty(); }
};

/// Material and texture coordinates at a point of one of the mesh's triangles; `u` and `v` are the
/// barycentric weights of its second and third corner.
TexturePoint texture_point(const MaterialLayer& layer, std::uint32_t triangle, float u, float v);

/// A layer that is blended over others: all parameters of the materials are interpolated.
struct MixedLayer : MaterialLayer {
  float opacity = 0;  ///< weight of this layer over those below it, which have the rest; [0, 1]
};

/// One surface to trace, with its own materials. Spans are borrowed while a frame is rendered.
struct RenderMesh : MaterialLayer {
  std::span<const Vec3> positions;
  std::span<const Triangle> triangles;
  std::span<const Vec3> vertex_normals;  ///< one per position, or empty
  std::span<const Vec3>
      corner_normals;  ///< 3 per triangle, or empty; used when vertex_normals is empty
  std::vector<MixedLayer> upper_layers;  ///< layers blended over this one, the lowest first
  /// Scene-linear colours, one per position, or empty. They are blended over the layers' colours.
  std::span<const Vec3> vertex_colors;
  float vertex_color_opacity = 0;  ///< [0, 1]
  float look = 0;  ///< weight of RenderScene::look, [0, 1]; the mesh's materials have the rest
  float id = 0;    ///< written to the id AOV; above 1, because 1 is the ground and 0 no hit
  std::span<const Vec3>
      displacement;  ///< motion to the next frame, one per position; empty = static
  /// Values of the channel morph.blend, one per position; empty = `progress`.
  std::span<const float> vertex_progress;
  std::span<const std::uint32_t>
      vertex_labels;              ///< values of the label AOV, one per position, or empty
  std::uint32_t first_label = 1;  ///< value of the label AOV for label 0
  float progress = 0;  ///< progress of the leg (the morph from one object to the next), [0, 1]
  bool moves = true;   ///< changes between frames; with image.steady only such meshes get new noise
  std::string name;    ///< name in the layer crypto_object
  std::vector<std::string> label_names;  ///< names of vertex_labels in the layer crypto_label
};

/// Tests whether the predicate holds for the mesh's own layer or for one blended over it.
template <class Predicate>
bool any_layer(const RenderMesh& mesh, const Predicate& predicate) {
  return predicate(mesh) ||
         std::any_of(mesh.upper_layers.begin(), mesh.upper_layers.end(), predicate);
}

/// A camera with resolved position, orientation and lens.
struct Camera {
  Vec3 position{0, 0, 5};
  Vec3 right{1, 0, 0}, up{0, 1, 0}, forward{0, 0, -1};  ///< orthonormal
  float tan_half_fov_y = 0.27f;
  float lens_radius = 0;  ///< radius of a thin lens; 0 = a pinhole
  float focus = 1;        ///< distance of sharp points along `forward`; used if lens_radius > 0
  float shutter = 0;      ///< time that the shutter is open, in frames, centred at the frame's time
};

/// Makes a camera that frames a box. Its distance is the smallest at which the box's 8 corners keep
/// settings.margin, unless the settings fix the position. settings.orbit is the angle, in degrees,
/// by which the camera has orbited so far.
Camera make_camera(const CameraSettings& settings, const Box& box, int width, int height);
/// Makes a camera that frames points, more tightly than their box.
Camera make_camera(const CameraSettings& settings, std::span<const Vec3> points, int width,
                   int height);

/// Common framing of all poses of a moving camera. A pose is the camera's settings at one frame.
struct Framing {
  Vec3 middle;         ///< centre of all objects
  Vec3 anchor;         ///< point that the camera looks at if the settings have no target
  float distance = 1;  ///< distance from the anchor if CameraSettings::dolly is 1
  float margin = 0;    ///< smallest CameraSettings::margin of all poses
};
/// Computes a framing at which the points keep the margin when seen from every pose's direction. It
/// uses the smallest margin and the largest field of view of all poses. If all poses have the same
/// direction, the framing is as tight as for a static camera.
Framing make_framing(std::span<const CameraSettings> poses, std::span<const Vec3> points, int width,
                     int height);
/// Makes the camera of one frame of a film with this framing.
Camera make_camera(const CameraSettings& settings, const Framing& framing);

/// Cameras at other times than the frame's, if the camera moves.
struct CameraMotion {
  Camera opening, closing;  ///< cameras when the shutter opens and closes
  Camera next;              ///< camera of the next frame, or of this frame if it is the last
};

/// Everything that one frame shows.
struct RenderScene {
  std::vector<RenderMesh> meshes;
  Camera camera;
  std::optional<CameraMotion> camera_motion;  ///< empty: the camera is static
  std::optional<Camera>
      rig;  ///< camera to which the lights and the sky are attached; empty: `camera`
  LightSettings lights;
  GroundSettings ground;  ///< `height` must be set when enabled
  LookSettings look;
  /// Latitude-longitude image: row 0 is the zenith, the middle column -z, a quarter of the width to
  /// its right +x. It is also the backdrop, and the floor fades into it. Null = the sky that
  /// `lights` chooses: a clear day or the studio, a sky of soft boxes. The studio is visible in
  /// reflections only; the camera sees a seamless backdrop paper of the floor's colour.
  std::shared_ptr<const Image> environment;
  Box bounds;  ///< bounds of all frames; the floor's fade and the offsets of rays depend on them
  float time = 0;  ///< time within the sequence, [0, 1], written to the channel morph.t
};

/// Settings of one frame.
struct RenderSettings {
  ImageSettings image;
  /// Frame number, part of the random keys. Noise differs between frames. With image.steady it does
  /// so only where something moves (RenderMesh::moves), or everywhere if the camera moves.
  int frame = 0;
  /// If set, only this range of the image.samples samples is rendered, as a part
  /// (render/film/part.h). Not allowed with image.noise or image.denoise.
  std::optional<SampleRange> part;
};

/// Returns the memory of a rendered image with all its channels, in bytes. If `part` is set, this
/// includes the part's sums per Cryptomatte id (MatteSums, render/film/part.h).
std::uint64_t picture_bytes(const ImageSettings& image,
                            const std::optional<SampleRange>& part = {});

/// Checks that the library for image.denoise is installed. Errors (kResource) say how to get it.
Status check_denoiser();

class DeviceTracer;

/// Renders frames on the CPU or a GPU. If image.denoise is set, the colours are denoised last
/// (render/film/denoise.h).
class Renderer {
 public:
  /// Creates a renderer. `isa`: instruction set of Embree, such as "avx2" (golden tests pin it). If
  /// it is empty, the environment variable POLYMORPH_ISA names it; without that it is the machine's
  /// best. Errors: kUsage, kResource.
  static Result<Renderer> create(const std::string& isa = "");
  ~Renderer();
  Renderer(Renderer&&) noexcept;
  Renderer& operator=(Renderer&&) noexcept;

  /// Renders a frame, or a part of it. A frame has the channels R G B A (alpha is below 1 only if
  /// the image is transparent or the ground shadow_only), then the AOVs of the first surface that
  /// the ray through the pixel's centre hits (render/aov.h). The image is the same for any number
  /// of threads. Errors: kResource.
  Result<Image> render(const RenderScene& scene, const RenderSettings& settings);

  /// Lets a GPU (render/device/device_tracer.h) trace frames. The CPU traces the frames that the
  /// GPU does not support or at which it fails, with the same bits, and the reason is logged.
  void set_device_tracer(std::unique_ptr<DeviceTracer> tracer);
  bool traced_on_cpu() const;  ///< whether the last frame was traced on the CPU

  struct Stats {
    double build_seconds = 0, trace_seconds = 0, denoise_seconds = 0;
    std::uint64_t rays = 0, paths = 0;  ///< one path per sample of a pixel
  };
  Stats stats() const;      ///< statistics of the last call of render()
  std::string isa() const;  ///< Embree's instruction set (create())

 private:
  struct State;
  explicit Renderer(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace polymorph
