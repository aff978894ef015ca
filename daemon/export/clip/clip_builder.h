#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "base/result.h"
#include "base/time.h"
#include "export/clip/clip.h"
#include "model/description.h"
#include "model/snapshot.h"

namespace mocap::exports {

/// Snapshots that do not become a frame of their own, frames without a snapshot, and marks without a frame.
struct ClipReport {
  std::size_t snapshots = 0;
  std::size_t missing = 0;        ///< frames without a snapshot: all markers and bones are Lost
  std::size_t repeated = 0;       ///< snapshots that are not later than the one before, left out
  std::size_t marks_outside = 0;  ///< marks before the first or after the last frame, left out
};

/// Builds a clip at the recorded rate from the snapshots of a recording.
///
/// The period is the median time between sets of consecutive numbers. A snapshot becomes the frame whose time is
/// nearest, counted from the snapshot before, so that neither jitter nor a clock that is slow or fast shifts frames; a
/// lost set is a missing frame. Nothing is interpolated. A mark becomes an event at the time of the nearest frame.
class ClipBuilder {
 public:
  /// `subjects`: names of the subjects to keep; empty: all.
  ClipBuilder(std::string name, std::vector<std::string> subjects);

  /// Takes over names and bodies for the snapshots that follow. Bone lengths and marker offsets of the last description
  /// count. Fails with InvalidArgument if a subject has other markers or bones than before, by number, name or parent.
  Status learn(const Description& description);

  /// Adds the next snapshot. Fails with InvalidArgument if its markers or bones do not fit the description.
  Status add(const Snapshot& snapshot, std::optional<std::int64_t> utc_minus_host_ns);

  /// Adds a mark of the operator, in any order. build() leaves out and counts a mark before the first or after the last
  /// frame.
  void mark(Timestamp at, std::string name);

  /// Fails with InvalidArgument if there is no snapshot, if one of the subjects to keep is in no description, or if
  /// nearly all frames are missing.
  Result<Clip> build();

  const ClipReport& report() const noexcept { return report_; }

 private:
  struct Track {
    ClipSubject rows;  // a row for each snapshot; the last rows may be missing
  };
  struct Viewpoint {
    Eigen::Vector3d at_m;
    double focal_px;
  };
  struct Mark {
    Timestamp at;
    std::string name;
  };

  bool wanted(const std::string& subject) const;
  Status learn(const Subject& subject);
  Status check_subjects() const;
  Status add_markers(const SubjectLabels& labels);
  Status add_bones(const SubjectPose& pose);
  Track* track_of(SubjectId subject);
  double metres_per_px(const Eigen::Vector3d& at_m) const;
  double period_s() const;
  std::vector<std::int64_t> frames_at(double period_s);
  Rate rate_for(double period_s, std::int64_t last_frame) const;
  void add_events(Clip& clip, double period_s, const std::vector<std::int64_t>& frame_of);

  std::string name_;
  std::vector<std::string> wanted_;
  std::set<std::string> names_;  // of all subjects of the descriptions
  std::vector<Track> tracks_;
  std::vector<int> track_by_index_;  // of the last description; -1: not wanted
  std::vector<Viewpoint> viewpoints_;
  std::string producer_;
  double nominal_rate_hz_ = 0.0;
  std::vector<Timestamp> times_;
  std::vector<std::uint64_t> numbers_;
  std::optional<std::int64_t> utc_minus_host_ns_;
  std::optional<Timecode> timecode_;
  std::size_t timecode_at_ = 0;  // snapshot with timecode_
  std::vector<Mark> marks_;
  ClipReport report_;
};

}  // namespace mocap::exports
