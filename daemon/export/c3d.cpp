#include "export/c3d.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "export/c3d_parameters.h"
#include "export/clip/in_axes.h"
#include "export/labels.h"
#include "model/clock/timecode.h"

namespace mocap::exports {
namespace {

constexpr std::size_t kMaxFrames = 65535, kMaxPoints = 65535;  // of 16-bit fields
constexpr std::size_t kMaxHeaderEvents = 18;
constexpr std::uint16_t kHeaderEventsKey = 12345;  // event labels of four characters
constexpr int kCameraBits = 7;

// POINT:SCALE of the manual: the largest coordinate is 32000 steps. The least one keeps residuals up to 12 mm when all
// markers are near the origin.
constexpr double kSteps = 32000.0, kLeastScale_m = 5e-5;

Error refused(std::string message) { return {ErrorCode::InvalidArgument, "C3D: " + std::move(message)}; }

// The facts that header and parameters share.
struct Shape {
  std::vector<std::string> labels;
  double scale = 0.0;  // in the file's unit
  std::int64_t first = 1, last = 1;
  std::uint16_t header_first = 1, header_last = 1;
};

// The file's range in 16 bits; where it does not fit, the same number of frames from 1, at most 65535.
Shape shape_of(const Clip& clip, const WriteOptions& options) {
  Shape shape;
  shape.labels = marker_labels(clip);
  double largest_m = kSteps * kLeastScale_m;
  for (const ClipSubject& subject : clip.subjects) {
    for (const MarkerSample& marker : subject.markers) {
      if (marker.state != LabelState::Lost) largest_m = std::max(largest_m, marker.position_m.cwiseAbs().maxCoeff());
    }
  }
  shape.scale = largest_m * per_metre(options.unit) / kSteps;
  shape.first = clip.first_frame + 1;
  shape.last = clip.first_frame + static_cast<std::int64_t>(clip.frames);
  const bool fits = shape.first >= 1 && shape.last <= static_cast<std::int64_t>(kMaxFrames);
  shape.header_first = fits ? static_cast<std::uint16_t>(shape.first) : std::uint16_t{1};
  shape.header_last =
      fits ? static_cast<std::uint16_t>(shape.last) : static_cast<std::uint16_t>(std::min(clip.frames, kMaxFrames));
  return shape;
}

std::vector<std::string> descriptions_of(const Clip& clip) {
  std::vector<std::string> descriptions;
  for (const ClipSubject& subject : clip.subjects) {
    const auto& bones = subject.subject.marker_set.skeleton.bones;
    for (const MarkerOnBone& marker : subject.subject.marker_set.markers) {
      const auto bone = static_cast<std::size_t>(marker.bone);
      descriptions.push_back(bone < bones.size() ? bones[bone].name : "marker");
    }
  }
  return descriptions;
}

void add_points(C3dParameters& all, const Clip& clip, const Shape& shape, const WriteOptions& options,
                std::uint16_t data_start) {
  all.group("POINT", "3D points");
  all.integer("USED", static_cast<std::uint16_t>(shape.labels.size()), "number of points");
  all.real("SCALE", static_cast<float>(-shape.scale), "negative: floating-point; unit of residuals");
  all.real("RATE", static_cast<float>(clip.rate.hz()), "frames per second");
  all.integer("DATA_START", data_start, "first block of the data section");
  all.integer("FRAMES", static_cast<std::uint16_t>(std::min(clip.frames, kMaxFrames)), "number of frames");
  if (clip.frames > kMaxFrames) all.real("LONG_FRAMES", static_cast<float>(clip.frames), "number of frames");
  all.long_texts("LABELS", shape.labels, "names of the points");
  all.long_texts("DESCRIPTIONS", descriptions_of(clip), "the bone that has the marker");
  all.text("UNITS", name_of(options.unit), "unit of positions and residuals");
  all.text("X_SCREEN", "+X", "axis to the right");
  all.text("Y_SCREEN", options.axes == Axes::ZUp ? "+Z" : "+Y", "axis upwards");
}

// Readers fail if these two groups are absent, though the file has no analog channel.
void add_analog(C3dParameters& all, const Clip& clip) {
  all.group("ANALOG", "no analog channels");
  all.integer("USED", 0, "number of channels");
  all.texts("LABELS", {}, "");
  all.texts("DESCRIPTIONS", {}, "");
  all.real("GEN_SCALE", 1.0F, "");
  all.reals("SCALE", {0}, {}, "");
  all.integers("OFFSET", {0}, {}, "");
  all.texts("UNITS", {}, "");
  all.real("RATE", static_cast<float>(clip.rate.hz()), "samples per second");
  all.text("FORMAT", "SIGNED", "");
  all.integer("BITS", 16, "");
  all.group("FORCE_PLATFORM", "no force platforms");
  all.integer("USED", 0, "number of platforms");
  all.integers("TYPE", {0}, {}, "");
  const std::array<std::uint16_t, 2> no_frames{0, 0};
  all.integers("ZERO", {2}, no_frames, "");
  all.reals("CORNERS", {3, 4, 0}, {}, "");
  all.reals("ORIGIN", {3, 0}, {}, "");
  all.integers("CHANNEL", {6, 0}, {}, "");
}

void add_trial(C3dParameters& all, const Clip& clip, const Shape& shape) {
  const auto halves = [](std::int64_t number) {
    const auto bits = static_cast<std::uint32_t>(number);
    return std::array<std::uint16_t, 2>{static_cast<std::uint16_t>(bits & 0xFFFF),
                                        static_cast<std::uint16_t>(bits >> 16)};
  };
  all.group("TRIAL", "the recording");
  all.integers("ACTUAL_START_FIELD", {2}, halves(shape.first), "first frame, low and high word");
  all.integers("ACTUAL_END_FIELD", {2}, halves(shape.last), "last frame, low and high word");
  all.real("CAMERA_RATE", static_cast<float>(clip.rate.hz()), "frames per second");
}

void add_subjects(C3dParameters& all, const Clip& clip) {
  std::vector<std::string> names, prefixes, sets;
  for (const ClipSubject& subject : clip.subjects) {
    names.push_back(subject.subject.name);
    prefixes.push_back(prefix_of(clip, subject));
    sets.push_back(subject.subject.marker_set.name);
  }
  all.group("SUBJECTS", "persons and props");
  all.integer("USED", static_cast<std::uint16_t>(names.size()), "number of subjects");
  all.integer("IS_STATIC", 0, "1: a static trial");
  all.integer("USES_PREFIXES", names.size() > 1 ? 1 : 0, "1: labels begin with a prefix");
  all.texts("NAMES", names, "");
  all.texts("LABEL_PREFIXES", prefixes, "what labels begin with");
  all.texts("MARKER_SETS", sets, "");
}

// The text up to a length, without a part of a character at its end (UTF-8).
std::string cut_to(const std::string& text, std::size_t most_bytes) {
  std::size_t end = std::min(text.size(), most_bytes);
  if (end < text.size()) {
    while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0U) == 0x80U) --end;
  }
  return text.substr(0, end);
}

// Icons of Vicon: 1 foot strike, 2 foot off, 0 another event. Times of this group count from frame 1 of the trial,
// those of the header from the first frame of the file.
void add_events(C3dParameters& all, const Clip& clip, const Shape& shape) {
  const std::size_t count = clip.events.size();
  std::vector<std::string> labels;
  std::vector<float> times;
  for (const ClipEvent& event : clip.events) {
    labels.push_back(event.name.empty() ? "Event" : cut_to(event.name, kMaxText_bytes));
    const double time_s = clip.rate.time_s(shape.first - 1) + event.time_s;
    const double minutes = std::floor(time_s / 60.0);
    times.push_back(static_cast<float>(minutes));
    times.push_back(static_cast<float>(time_s - 60.0 * minutes));
  }
  const std::vector<std::string> contexts(count, "General"), about(count, "Mark of the operator"), nobody(count, " ");
  const std::vector<std::uint16_t> zeros(count, 0);
  all.group("EVENT", "marks of the take");
  all.integer("USED", static_cast<std::uint16_t>(count), "number of events");
  all.texts("CONTEXTS", contexts, "");
  all.texts("LABELS", labels, "");
  all.texts("DESCRIPTIONS", about, "");
  all.reals("TIMES", {2, count}, times, "minutes, seconds after frame 1 of the trial");
  all.texts("SUBJECTS", nobody, "");
  all.integers("ICON_IDS", {count}, zeros, "");
  all.integers("GENERIC_FLAGS", {count}, zeros, "");
  const std::array<std::string, 3> sides{"Left", "Right", "General"}, sides_about{"Left side", "Right side", "No side"};
  const std::array<std::uint16_t, 3> icons{0, 1, 2};
  const std::array<std::uint16_t, 9> colours{255, 0, 0, 0, 255, 0, 0, 0, 255};
  all.group("EVENT_CONTEXT", "contexts of events");
  all.integer("USED", 3, "number of contexts");
  all.integers("ICON_IDS", {3}, icons, "");
  all.texts("LABELS", sides, "");
  all.texts("DESCRIPTIONS", sides_about, "");
  all.integers("COLOURS", {3, 3}, colours, "red, green, blue");
}

void add_origin(C3dParameters& all, const Clip& clip) {
  all.group("MANUFACTURER", "origin of the file");
  all.text("COMPANY", "mocapd", "");
  all.text("SOFTWARE", cut_to(clip.producer, kMaxText_bytes), "");
  all.text("TAKE", cut_to(clip.name, kMaxText_bytes), "name of the take");
  if (!clip.first_timecode) return;
  const Timecode& timecode = *clip.first_timecode;
  all.group("TIMECODE", "SMPTE timecode");
  all.text("START", text_of(timecode), "of the first frame; ; before frames: drop-frame");
  all.real("RATE", static_cast<float>(rate_hz(timecode)), "timecode frames per second");
  all.integer("STANDARD", static_cast<std::uint16_t>(timecode.frames_per_second), "nominal frames per second");
  all.integer("DROP_FRAME", timecode.drop_frame ? 1 : 0, "1: drop-frame");
}

Result<std::string> parameters_of(const Clip& clip, const Shape& shape, const WriteOptions& options,
                                  std::uint16_t data_start) {
  C3dParameters all;
  add_points(all, clip, shape, options, data_start);
  add_analog(all, clip);
  add_trial(all, clip, shape);
  add_subjects(all, clip);
  add_events(all, clip, shape);
  add_origin(all, clip);
  return all.section();
}

// The first four characters of a name: more do not fit into the header.
std::string header_label(const std::string& name) {
  std::string label = cut_to(name, 4);
  label.resize(4, ' ');
  return label;
}

std::string c3d_header(const Clip& clip, const Shape& shape, std::uint16_t data_start) {
  const std::size_t events = std::min(clip.events.size(), kMaxHeaderEvents);
  std::string h("\2P", 2);  // the parameter section begins at block 2
  append_u16(h, static_cast<std::uint16_t>(shape.labels.size()));
  append_u16(h, 0);  // analog values in a frame
  append_u16(h, shape.header_first);
  append_u16(h, shape.header_last);
  append_u16(h, 0);  // longest interpolated gap
  append_float(h, static_cast<float>(-shape.scale));
  append_u16(h, data_start);
  append_u16(h, 1);  // analog samples in a frame
  append_float(h, static_cast<float>(clip.rate.hz()));
  h.resize(2 * 149, '\0');  // words 13 to 149 are reserved
  append_u16(h, kHeaderEventsKey);
  append_u16(h, static_cast<std::uint16_t>(events));
  append_u16(h, 0);
  for (std::size_t i = 0; i < kMaxHeaderEvents; ++i) {
    append_float(h, i < events ? static_cast<float>(clip.events[i].time_s) : 0.0F);
  }
  h.append(kMaxHeaderEvents, '\0');  // all are displayed
  append_u16(h, 0);
  for (std::size_t i = 0; i < kMaxHeaderEvents; ++i) h += i < events ? header_label(clip.events[i].name) : "    ";
  h.resize(kBlock_bytes, '\0');
  return h;
}

// The fourth word: camera bits in the high byte, residual in the low byte; -1: no position.
float fourth_word(const MarkerSample& marker, double steps_per_metre) {
  if (marker.state == LabelState::Lost) return -1.0F;
  if (marker.state == LabelState::Filled) return 0.0F;
  const int cameras = (1 << std::min<int>(marker.cameras, kCameraBits)) - 1;
  // At least 1: 0 stands for a filled marker.
  const double residual = std::clamp(std::round(marker.residual_m * steps_per_metre), 1.0, 255.0);
  return static_cast<float>(256 * cameras + static_cast<int>(residual));
}

Status write_frames(const Clip& clip, const Shape& shape, const WriteOptions& options, BufferedSink& out) {
  const double units = per_metre(options.unit), steps_per_metre = units / shape.scale;
  std::size_t bytes = 0;
  for (std::size_t frame = 0; frame < clip.frames; ++frame) {
    for (const MarkerSample& marker : markers_in(clip, frame)) {
      const bool there = marker.state != LabelState::Lost;
      const Eigen::Vector3d at = there ? in_axes(marker.position_m, options.axes) : Eigen::Vector3d::Zero();
      for (int axis = 0; axis < 3; ++axis) append_float(out.text(), static_cast<float>(units * at[axis]));
      append_float(out.text(), fourth_word(marker, steps_per_metre));
    }
    bytes += 16 * shape.labels.size();
    if (const Status passed = out.pass_on(); !passed) return passed;
  }
  out.text().append((kBlock_bytes - bytes % kBlock_bytes) % kBlock_bytes, '\0');
  return {};
}

Status write_file(const Clip& clip, const WriteOptions& options, const Sink& sink) {
  const Shape shape = shape_of(clip, options);
  const Result<std::string> draft = parameters_of(clip, shape, options, 0);
  if (!draft) return draft.error();
  const auto data_start = static_cast<std::uint16_t>(2 + draft->size() / kBlock_bytes);
  const Result<std::string> parameters = parameters_of(clip, shape, options, data_start);
  if (!parameters) return parameters.error();
  BufferedSink out(sink);
  out.text() = c3d_header(clip, shape, data_start) + *parameters;
  if (const Status written = write_frames(clip, shape, options, out); !written) return written;
  return out.finish();
}

}  // namespace

Status write_c3d(const Clip& clip, const WriteOptions& options, const Sink& sink) {
  const std::size_t points = marker_labels(clip).size();
  if (points == 0) return refused("the take has no markers");
  if (points > kMaxPoints) return refused(fmt::format("{} markers, at most {} are possible", points, kMaxPoints));
  if (clip.events.size() > kMaxC3dEvents) {
    return refused(
        fmt::format("{} events, at most {} are possible; export a --range", clip.events.size(), kMaxC3dEvents));
  }
  return write_file(clip, options, sink);
}

}  // namespace mocap::exports
