#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/result.h"
#include "lib/simworld/scene_actors.h"
#include "lib/simworld/scene_file.h"
#include "scene/random.h"

namespace mocap::simworld {

/// A stretch of a scene.
struct Span {
  double from_s = 0.0;
  double to_s = 0.0;

  bool has(double t_s) const { return t_s >= from_s && t_s < to_s; }
};

/// While it lasts, one joint is judged by itself.
struct JointWatch {
  Span span;
  std::uint32_t subject = 0;
  std::uint32_t bone = 0;
};

/// What keeps cameras from seeing, when: the scene's [[blackout]], [[hide]] and [[only_camera]].
class SceneEvents {
 public:
  /// Fails where an event names a marker, bone or camera that is not there. `rays`: false hides from the one camera,
  /// too.
  static Result<SceneEvents> make(const SceneFile& scene, const std::vector<Performer>& performers, std::size_t cameras,
                                  std::uint64_t seed, bool rays);

  /// Goes on to an instant, later than the last.
  void advance(double t_s);

  bool blind() const { return blind_; }
  bool hides(std::uint32_t performer, std::uint32_t marker, std::uint32_t camera) const;
  /// Whether the marker is left to this camera, which then sees it whatever body is in between.
  bool shows(std::uint32_t performer, std::uint32_t marker, std::uint32_t camera) const;

  const std::vector<Span>& blackouts() const { return blackouts_; }
  const std::vector<JointWatch>& watches() const { return watches_; }

 private:
  struct Hidden {
    double until_s = 0.0;
    bool hidden = false;
  };
  struct OneMarker {
    Span span;
    std::uint32_t performer = 0;
    std::uint32_t marker = 0;
    std::uint32_t camera = 0;  // kNone: no camera sees it
  };
  static constexpr std::uint32_t kNone = 0xFFFF'FFFF;

  explicit SceneEvents(std::uint64_t seed) : random_(seed) {}
  void plan_blackouts(const SceneFile& scene);
  Status plan_single_views(const SceneFile& scene, const std::vector<Performer>& performers, std::size_t cameras,
                           bool rays);
  Status add_markers(const SceneOnlyCamera& only, const std::string& names, std::uint32_t performer,
                     const MarkerSet& worn, std::uint32_t camera);
  double visible_s(const SceneHide& hide);

  scene::Random random_;
  std::vector<Span> blackouts_;
  std::vector<SceneHide> hides_;
  std::vector<OneMarker> single_views_;
  std::vector<JointWatch> watches_;
  std::vector<std::vector<Hidden>> hidden_;  // by performer, by marker; of all [[hide]] together the last that began
  double t_s_ = 0.0;
  bool blind_ = false;
};

}  // namespace mocap::simworld
