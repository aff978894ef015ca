#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "base/time.h"
#include "mocap/v1/snapshot.pb.h"
#include "model/description.h"
#include "model/take/take_health.h"
#include "take/take_info.h"

namespace mocap::take {

/// How often a marker was seen. The rest of the sets: lost.
struct MarkerFigures {
  std::string name;
  std::uint64_t seen = 0;
  std::uint64_t filled = 0;
  double longest_gap_s = 0.0;  ///< longest time without a measurement
};

struct SubjectFigures {
  std::string name;
  std::uint64_t tracked_sets = 0;
  std::uint64_t label_changes = 0;  ///< a track went from one marker to another one
  double residual_m = 0.0;          ///< rms of the markers on the skeleton, mean of the sets
  std::vector<MarkerFigures> markers;
};

struct CameraFigures {
  std::string name;
  std::uint64_t sets = 0;  ///< with a view of this camera
};

struct QualityReport {
  TakeQuality quality = TakeQuality::Unknown;
  std::vector<std::string> reasons;  ///< the worst first; empty: good
  double seconds = 0.0;
  std::uint64_t sets = 0;
  std::uint64_t lost_sets = 0;     ///< gaps in the numbers of the sets
  std::uint64_t dropped_sets = 0;  ///< of lost_sets: at the full queue to the recorder
  std::uint64_t lost_images = 0;   ///< that the recording could not keep
  double residual_px = 0.0;        ///< mean of the measured markers
  double longest_gap_s = 0.0;
  std::vector<SubjectFigures> subjects;
  std::vector<CameraFigures> cameras;
};

const char* name_of(TakeQuality quality);

/// The report as JSON on one line; shares are in percent of the sets.
std::string to_json(const QualityReport& report);

/// Adds the quality to the info of a take as far as the info then `fits_on_a_full_disk`: the most important first.
/// `ended_early`: why the take ended before its time; empty: it did not.
void add_quality(TakeInfo& info, const QualityReport& report, const std::string& ended_early);

/// Removes what `add_quality` added.
void remove_quality(TakeInfo& info);

/// Writes the figures of the report, not name, path, state and size.
void write_quality(const QualityReport& report, TakeHealth& into);

/// Measures the quality of a take, set by set: the same while it is recorded and from its file.
class TakeMeter {
 public:
  /// In force from the next snapshot on. Figures of subjects and cameras of the same name go on.
  void describe(const Description& description);
  void add(const v1::Snapshot& snapshot);
  /// What the recording could not keep so far.
  void set_lost(std::uint64_t images, std::uint64_t sets) {
    lost_images_ = images;
    dropped_sets_ = sets;
  }

  QualityReport report() const;

 private:
  struct Marker {
    std::string name;
    std::uint64_t seen = 0, filled = 0;
    std::int64_t seen_at_ns = -1;  // -1: not yet
    std::int64_t longest_gap_ns = 0;
    std::uint32_t track = 0;  // plus one, in the last set; 0: none
  };
  struct Subject {
    std::string name;
    std::uint64_t tracked_sets = 0, label_changes = 0, residuals = 0;
    double residual_sum_m = 0.0;
    std::vector<Marker> markers;
  };
  void add(const v1::SubjectState& from, std::int64_t at_ns);
  void count_label_changes(Subject& subject, const v1::LabelledMarkers& markers);
  QualityReport figures() const;

  std::vector<Subject> subjects_;      // all of the take
  std::vector<std::size_t> by_index_;  // of the description in force, in subjects_
  std::vector<CameraFigures> cameras_;
  std::uint64_t sets_ = 0, lost_sets_ = 0, dropped_sets_ = 0, lost_images_ = 0;
  std::uint64_t last_number_ = 0;
  std::int64_t first_at_ns_ = 0, last_at_ns_ = 0;
  double residual_sum_px_ = 0.0;
  std::uint64_t residuals_ = 0;
  std::map<std::uint32_t, std::size_t> tracks_;  // scratch: marker by track plus one
};

}  // namespace mocap::take
