#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "mocap_client.hpp"

namespace mocap::natnet {

/// The description of one bone. The parent has a lower index; -1: the root.
struct Bone {
  std::string name;
  std::string unity_name;  ///< of HumanBodyBones; empty: none
  int parent = -1;
  mocap_vec3 rest_offset{};  ///< from the parent, in the rest pose
};

struct Marker {
  std::string name;
  int bone = 0;
  mocap_vec3 offset{};  ///< in the frame of the bone
};

/// A bone that is not tracked is at rest relative to its parent; the root of such a subject is at the origin.
struct BonePose {
  mocap_vec3 position{};
  mocap_quat rotation{0.0F, 0.0F, 0.0F, 1.0F};
  mocap_vec3 local_position{};
  mocap_quat local_rotation{0.0F, 0.0F, 0.0F, 1.0F};
  bool tracked = false;
};

struct MarkerPose {
  mocap_vec3 position{};  ///< of the body model if it was not measured
  bool known = false;     ///< the position has a meaning
  bool measured = false;
};

/// A subject: with one bone a prop, which is a rigid body of NatNet, with more bones a skeleton.
struct Model {
  std::string name;
  std::int32_t id = 0;  ///< 1 and up
  float error_m = 0.0F;
  std::vector<Bone> bones;
  std::vector<Marker> markers;
  std::vector<BonePose> poses;           ///< one for each bone
  std::vector<MarkerPose> marker_poses;  ///< one for each marker

  bool is_body() const { return bones.size() == 1; }
};

struct Point {
  mocap_vec3 position{};
  std::int32_t id = 0;  ///< 1 to 65535, of the 3D track; 65535 tracks later it repeats; 0: no track
};

/// All that NatNet sends of one instant, in the axes of the feed. Instants are ns on this machine's monotonic clock.
struct Scene {
  std::int32_t number = 0;
  std::uint64_t exposed_ns = 0;
  std::uint64_t received_ns = 0;
  std::uint32_t timecode = 0;  ///< hours, minutes, seconds, frames: one byte each; 0: none
  std::uint32_t subframe = 0;  ///< of the timecode
  float rate_hz = 0.0F;        ///< nominal
  bool models_changed = false;
  std::vector<Model> models;
  std::vector<Point> unlabelled;
};

/// Builds scenes from frames of the feed and keeps their memory. Reads no clock.
class SceneReader {
 public:
  /// Reads a frame in the axes of the feed. `now_ns`: this machine's monotonic clock. `anew`: the frame has another
  /// description than the frame before.
  const Scene& read(const ClientFrame& frame, bool anew, std::int64_t now_ns);

  /// The scene after the loss of the daemon: nothing is tracked, no marker is seen, there is no timecode.
  const Scene& lose(std::int64_t now_ns);

  const Scene& scene() const { return scene_; }

 private:
  void describe(const ClientFrame& frame);
  void read_instants(const mocap_frame_info& info, std::optional<std::int64_t> age_ns, std::int64_t now_ns);

  Scene scene_;
  std::int64_t offset_ns_ = 0;  // this machine's monotonic clock minus the daemon's
  std::int64_t changed_ns_ = 0;
};

}  // namespace mocap::natnet
