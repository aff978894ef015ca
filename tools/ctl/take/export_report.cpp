#include "ctl/take/export_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "ctl/json_line.h"
#include "export/clip/interpolation.h"
#include "lib/cli/shown_text.h"

namespace mocap::ctl {
namespace {

using exports::Clip;
using exports::ClipSubject;

std::vector<std::string> names_of_subjects(const Clip& clip) {
  std::vector<std::string> names;
  for (const ClipSubject& subject : clip.subjects) names.push_back(subject.subject.name);
  return names;
}

std::size_t count_of_markers(const Clip& clip) {
  std::size_t markers = 0;
  for (const ClipSubject& subject : clip.subjects) markers += subject.subject.marker_set.markers.size();
  return markers;
}

std::size_t count_of_bones(const Clip& clip) {
  std::size_t bones = 0;
  for (const ClipSubject& subject : clip.subjects) bones += subject.subject.marker_set.skeleton.bones.size();
  return bones;
}

// Number of frames in which a bone of the subject is known.
std::size_t frames_with_pose(const ClipSubject& subject, std::size_t frames) {
  const auto bones = static_cast<std::ptrdiff_t>(subject.subject.marker_set.skeleton.bones.size());
  std::size_t count = 0;
  for (std::size_t f = 0; f < frames; ++f) {
    const auto first = subject.bones.begin() + static_cast<std::ptrdiff_t>(f) * bones;
    if (std::any_of(first, first + bones, [](const exports::BoneSample& bone) { return known(bone); })) ++count;
  }
  return count;
}

void print_faults(const take::RecordingFaults& faults) {
  if (faults.damaged_parts > 0) fmt::print("{} damaged parts of the take were left out\n", faults.damaged_parts);
  if (faults.undescribed_snapshots > 0) {
    fmt::print("{} snapshots were left out: their description was in a damaged part\n", faults.undescribed_snapshots);
  }
  if (faults.being_written) {
    fmt::print("the take is still being recorded; the file has what was on the disk\n");
  } else if (faults.cut_off) {
    fmt::print("the take was cut off; the file ends with its last whole part\n");
  }
}

}  // namespace

void print_export_json(const ExportReport& report, const Clip& clip) {
  nlohmann::ordered_json poses = nlohmann::ordered_json::object();
  for (const ClipSubject& subject : clip.subjects) {
    poses[subject.subject.name] = frames_with_pose(subject, clip.frames);
  }
  const nlohmann::ordered_json all{{"file", report.file.string()},
                                   {"frames", clip.frames},
                                   {"first_frame", clip.first_frame},
                                   {"rate_hz", clip.rate.hz()},
                                   {"rate", {clip.rate.numerator, clip.rate.denominator}},
                                   {"subjects", names_of_subjects(clip)},
                                   {"markers", count_of_markers(clip)},
                                   {"bones", count_of_bones(clip)},
                                   {"pose_frames", poses},
                                   {"marks", clip.events.size()},
                                   {"marks_left_out", report.marks_left_out + report.recorded.marks_outside},
                                   {"axes", exports::name_of(report.options.axes)},
                                   {"unit", exports::name_of(report.options.unit)},
                                   {"recorded_snapshots", report.recorded.snapshots},
                                   {"recorded_missing_frames", report.recorded.missing},
                                   {"recorded_repeated_snapshots", report.recorded.repeated},
                                   {"damaged_parts", report.faults.damaged_parts},
                                   {"undescribed_snapshots", report.faults.undescribed_snapshots},
                                   {"cut_off", report.faults.cut_off},
                                   {"being_written", report.faults.being_written}};
  fmt::print("{}\n", json_line(all));
}

void print_export_text(const ExportReport& report, const Clip& clip) {
  fmt::print("{}: {} frames at {:.6g} Hz of {}; {} markers, {} bones; {}, {}\n", cli::shown(report.file.string()),
             clip.frames, clip.rate.hz(), cli::shown(fmt::format("{}", fmt::join(names_of_subjects(clip), ", "))),
             count_of_markers(clip), count_of_bones(clip), exports::name_of(report.options.axes),
             exports::name_of(report.options.unit));
  const exports::ClipReport& recorded = report.recorded;
  if (recorded.missing > 0) {
    fmt::print("{} of {} frames of the take were not recorded; they are empty\n", recorded.missing,
               recorded.snapshots - recorded.repeated + recorded.missing);
  }
  print_faults(report.faults);
  for (const ClipSubject& subject : clip.subjects) {
    if (subject.subject.marker_set.skeleton.bones.empty() || frames_with_pose(subject, clip.frames) > 0) continue;
    fmt::print("{} has a pose in 0 of {} frames\n", cli::shown(subject.subject.name), clip.frames);
  }
  if (recorded.marks_outside > 0) {
    fmt::print("{} marks were left out: they are before the first or after the last frame of the take\n",
               recorded.marks_outside);
  }
  if (report.marks_left_out > 0) {
    fmt::print("{} of {} marks were left out: a {} file holds {}\n", report.marks_left_out,
               clip.events.size() + report.marks_left_out, report.format->name, report.format->most_marks);
  }
}

}  // namespace mocap::ctl
