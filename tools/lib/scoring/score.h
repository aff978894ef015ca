#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "lib/scoring/frames.h"
#include "lib/scoring/truth.h"

namespace mocap::scoring {

struct ScoreSettings {
  double after_s = 1.0;         ///< scoring begins this long after the first label
  double wrong_from_mm = 20.0;  ///< a label farther than this from its marker is wrong
  double ghost_from_mm = 50.0;  ///< an unlabelled marker farther than this from all true markers is a ghost
};

/// Comparison of a stream with the truth. A figure without data is absent.
struct Score {
  std::uint64_t stream_frames = 0;              ///< all frames of the stream
  std::uint64_t gaps = 0;                       ///< missing frame numbers
  std::uint64_t duplicates = 0;                 ///< frames whose number is not greater than the number before
  std::optional<double> time_to_first_label_s;  ///< since the first frame

  std::uint64_t frames = 0;                ///< scored frames: at least `after_s` after the first label, and with truth
  std::uint64_t frames_without_truth = 0;  ///< frames that were not scored because the truth has a gap
  std::optional<double> complete_share;    ///< share of the scored frames with images of all cameras
  std::uint64_t labels_expected = 0;       ///< markers of the truth, summed over the scored frames
  std::uint64_t labels_right = 0;          ///< labels, measured or filled, near their own markers
  std::uint64_t label_errors = 0;       ///< measured labels that are too far from their own marker or closer to another
  std::uint64_t filled_off = 0;         ///< filled labels too far from their own markers
  std::uint64_t missing = 0;            ///< expected labels that the stream does not report
  std::uint64_t unknown_labels = 0;     ///< reported labels that the truth does not contain
  std::optional<double> marker_rms_mm;  ///< of measured markers with the right label
  std::optional<double> marker_max_mm;
  std::optional<double> filled_rms_mm;  ///< of all filled markers
  std::optional<double> joint_rms_mm;   ///< of the joints that stream and truth contain
  std::optional<double> joint_max_mm;
  std::optional<double> rotation_rms_deg;  ///< of the world rotations of the bones
  std::uint64_t unlabelled = 0;
  std::uint64_t ghosts = 0;
};

Score score(const Truth& truth, const std::vector<EvalFrame>& stream, const ScoreSettings& settings);

/// One JSON object in one line; absent figures are null.
std::string to_json(const Score& score);

/// Several lines of text for a terminal.
std::string to_text(const Score& score);

}  // namespace mocap::scoring
