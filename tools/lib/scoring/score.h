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
  double after_s = 1.0;         ///< judged from this long after the first label
  double wrong_from_mm = 20.0;  ///< a name this far off its marker is wrong
  double ghost_from_mm = 50.0;  ///< a nameless marker this far from all markers is none
};

/// How a stream compares with the truth. A figure that rests on nothing is absent.
struct Score {
  std::uint64_t stream_frames = 0;              ///< all
  std::uint64_t gaps = 0;                       ///< numbers left out between them
  std::uint64_t duplicates = 0;                 ///< numbers that stand again, or go back
  std::optional<double> time_to_first_label_s;  ///< from the first frame

  std::uint64_t frames = 0;                ///< judged: labels, with truth, after `after_s`
  std::uint64_t frames_without_truth = 0;  ///< not judged for want of it
  std::optional<double> complete_share;    ///< of the frames judged: all cameras took part
  std::uint64_t labels_expected = 0;       ///< markers in the truth, over the frames judged
  std::uint64_t labels_right = 0;          ///< measured or filled, and there
  std::uint64_t label_errors = 0;          ///< measured, and nearer to another marker or too far from its own
  std::uint64_t filled_off = 0;            ///< filled in, and too far from its own
  std::uint64_t missing = 0;               ///< the stream does not say where they are
  std::uint64_t unknown_labels = 0;        ///< names that the truth does not have
  std::optional<double> marker_rms_mm;     ///< of measured markers with the right name
  std::optional<double> marker_max_mm;
  std::optional<double> filled_rms_mm;  ///< of all that were filled in
  std::optional<double> joint_rms_mm;   ///< of the joints of both
  std::optional<double> joint_max_mm;
  std::optional<double> rotation_rms_deg;  ///< of the bones, in the world
  std::uint64_t unlabelled = 0;
  std::uint64_t ghosts = 0;
};

Score score(const Truth& truth, const std::vector<EvalFrame>& stream, const ScoreSettings& settings);

/// One JSON object in one line; absent figures are null.
std::string to_json(const Score& score);

/// For people; several lines.
std::string to_text(const Score& score);

}  // namespace mocap::scoring
