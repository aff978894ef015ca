#include <fmt/core.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "lib/scoring/figures.h"
#include "lib/scoring/score.h"

namespace mocap::scoring {
namespace {

std::string or_dash(const std::optional<double>& figure, const char* unit) {
  return figure ? fmt::format("{:.3f} {}", *figure, unit) : std::string("-");
}

}  // namespace

std::string to_json(const Score& s) {
  const nlohmann::ordered_json object = {{"frames", s.frames},
                                         {"stream_frames", s.stream_frames},
                                         {"frames_without_truth", s.frames_without_truth},
                                         {"complete_share", or_null(s.complete_share)},
                                         {"labels_expected", s.labels_expected},
                                         {"labels_right", s.labels_right},
                                         {"label_errors", s.label_errors},
                                         {"filled_off", s.filled_off},
                                         {"missing", s.missing},
                                         {"unknown_labels", s.unknown_labels},
                                         {"marker_rms_mm", or_null(s.marker_rms_mm)},
                                         {"marker_max_mm", or_null(s.marker_max_mm)},
                                         {"filled_rms_mm", or_null(s.filled_rms_mm)},
                                         {"joint_rms_mm", or_null(s.joint_rms_mm)},
                                         {"joint_max_mm", or_null(s.joint_max_mm)},
                                         {"rotation_rms_deg", or_null(s.rotation_rms_deg)},
                                         {"time_to_first_label_s", or_null(s.time_to_first_label_s)},
                                         {"unlabelled", s.unlabelled},
                                         {"ghosts", s.ghosts},
                                         {"gaps", s.gaps},
                                         {"duplicates", s.duplicates}};
  return object.dump();
}

std::string to_text(const Score& s) {
  const double expected = static_cast<double>(std::max<std::uint64_t>(s.labels_expected, 1));
  std::string text = fmt::format("frames    {} judged of {} ({} without truth), {} lost, {} repeated\n", s.frames,
                                 s.stream_frames, s.frames_without_truth, s.gaps, s.duplicates);
  text += fmt::format("sets      {} complete, first label after {}\n",
                      s.complete_share ? fmt::format("{:.2f} %", 100.0 * *s.complete_share) : "-",
                      or_dash(s.time_to_first_label_s, "s"));
  text += fmt::format("labels    {} expected, {} right ({:.3f} %), {} wrong, {} filled in wrongly, {} missing\n",
                      s.labels_expected, s.labels_right, 100.0 * static_cast<double>(s.labels_right) / expected,
                      s.label_errors, s.filled_off, s.missing);
  text += fmt::format("markers   rms {}, max {} (filled in: rms {})\n", or_dash(s.marker_rms_mm, "mm"),
                      or_dash(s.marker_max_mm, "mm"), or_dash(s.filled_rms_mm, "mm"));
  text += fmt::format("joints    rms {}, max {}, rotation rms {}\n", or_dash(s.joint_rms_mm, "mm"),
                      or_dash(s.joint_max_mm, "mm"), or_dash(s.rotation_rms_deg, "deg"));
  text += fmt::format("unlabelled {} markers, {} ghosts\n", s.unlabelled, s.ghosts);
  if (s.unknown_labels > 0) {
    text += fmt::format("warning   {} labels have names that the truth does not know: other marker set?\n",
                        s.unknown_labels);
  }
  return text;
}

}  // namespace mocap::scoring
