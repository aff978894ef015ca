#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/result.h"
#include "lib/simworld/scene_actors.h"
#include "lib/simworld/scene_file.h"
#include "scene/random.h"

namespace mocap::simworld {

/// A time interval of a scene, including `from_s`, excluding `to_s`.
struct Span {
  double from_s = 0.0;
  double to_s = 0.0;

  bool has(double t_s) const { return t_s >= from_s && t_s < to_s; }
};

/// An interval in which one joint is scored separately.
struct JointWatch {
  Span span;
  std::uint32_t subject = 0;
  std::uint32_t bone = 0;
};

/// Events of a scene: [[blackout]], [[image_loss]], [[hide]] and [[only_camera]].
class SceneEvents {
 public:
  /// Fails if an event refers to a marker, bone or camera that does not exist. `rays` = false: the markers of
  /// [[only_camera]] are hidden from that camera too.
  static Result<SceneEvents> make(const SceneFile& scene, const std::vector<Performer>& performers, std::size_t cameras,
                                  std::uint64_t seed, bool rays);

  /// Advances to time `t_s`, which must be later than the previous time.
  void advance(double t_s);

  /// Whether a [[blackout]] is active.
  bool blind() const { return blind_; }
  /// Whether the camera delivers an image: no [[image_loss]] is active.
  bool delivers(std::uint32_t camera) const;
  /// Whether an event hides the marker from the camera.
  bool hides(std::uint32_t performer, std::uint32_t marker, std::uint32_t camera) const;
  /// Whether [[only_camera]] makes the marker visible to this camera, even through a body.
  bool shows(std::uint32_t performer, std::uint32_t marker, std::uint32_t camera) const;

  const std::vector<Span>& blackouts() const { return blackouts_; }
  const std::vector<JointWatch>& watches() const { return watches_; }

 private:
  struct Hidden {
    double until_s = 0.0;
    bool hidden = false;
  };
  // Which markers of each performer a [[hide]] concerns.
  struct Hide {
    SceneHide wanted;
    std::vector<std::vector<bool>> markers;  // by performer, then by marker
  };
  struct OneMarker {
    Span span;
    std::uint32_t performer = 0;
    std::uint32_t marker = 0;
    std::uint32_t camera = 0;  // kNone: hidden from all cameras
  };
  static constexpr std::uint32_t kNone = 0xFFFF'FFFF;

  explicit SceneEvents(std::uint64_t seed) : random_(seed) {}
  void plan_blackouts(const SceneFile& scene);
  void plan_image_losses(const SceneFile& scene, std::size_t cameras);
  Status plan_single_views(const SceneFile& scene, const std::vector<Performer>& performers, std::size_t cameras,
                           bool rays);
  Status add_markers(const SceneOnlyCamera& only, const std::string& names, std::uint32_t performer,
                     const MarkerSet& marker_set, std::uint32_t camera);
  Status plan_hides(const SceneFile& scene, const std::vector<Performer>& performers);
  void advance_marker(const SceneHide& hide, Hidden& marker);
  double visible_s(const SceneHide& hide);
  double hidden_s(const SceneHide& hide);

  scene::Random random_;
  std::vector<Span> blackouts_;
  std::vector<std::vector<Span>> image_losses_;  // by camera
  std::vector<Hide> hides_;
  std::vector<OneMarker> single_views_;
  std::vector<JointWatch> watches_;
  std::vector<std::vector<Hidden>>
      hidden_;  // by performer, then by marker; where several [[hide]] overlap, the last of them decides
  double t_s_ = 0.0;
  bool blind_ = false;
};

}  // namespace mocap::simworld
