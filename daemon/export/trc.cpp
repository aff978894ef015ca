#include "export/trc.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <vector>

#include "export/clip/in_axes.h"
#include "export/labels.h"

namespace mocap::exports {
namespace {

std::string without_spaces(std::string label) {
  std::ranges::replace_if(
      label, [](char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }, '_');
  return label;
}

std::string trc_header(const Clip& clip, const std::vector<std::string>& labels, Unit unit) {
  std::string text = fmt::format("PathFileType\t4\t(X/Y/Z)\t{}.trc\n", without_spaces(clip.name));
  text += "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames\n";
  text += fmt::format("{0:.6f}\t{0:.6f}\t{1}\t{2}\t{3}\t{0:.6f}\t{4}\t{1}\n", clip.rate.hz(), clip.frames,
                      labels.size(), name_of(unit), clip.first_frame + 1);
  text += "Frame#\tTime";
  for (const std::string& label : labels) text += '\t' + without_spaces(label) + "\t\t";
  text += "\n\t";
  for (std::size_t i = 1; i <= labels.size(); ++i) text += fmt::format("\tX{0}\tY{0}\tZ{0}", i);
  text += "\n\n";
  return text;
}

void append_trc_row(std::string& text, const Clip& clip, std::size_t frame, const WriteOptions& options) {
  auto out = std::back_inserter(text);
  fmt::format_to(out, "{}\t{:.8f}", frame + 1, clip.rate.time_s(static_cast<std::int64_t>(frame)));
  const int decimals = decimals_of(options.unit);
  for (const MarkerSample& marker : markers_in(clip, frame)) {
    if (marker.state == LabelState::Lost) {
      text += "\t\t\t";
      continue;
    }
    const Eigen::Vector3d at = per_metre(options.unit) * in_axes(marker.position_m, options.axes);
    fmt::format_to(out, "\t{:.{}f}\t{:.{}f}\t{:.{}f}", at.x(), decimals, at.y(), decimals, at.z(), decimals);
  }
  text += '\n';
}

}  // namespace

Status write_trc(const Clip& clip, const WriteOptions& options, const Sink& sink) {
  const std::vector<std::string> labels = marker_labels(clip);
  if (labels.empty()) return Error{ErrorCode::InvalidArgument, "TRC: the take has no markers"};
  BufferedSink out(sink);
  out.text() = trc_header(clip, labels, options.unit);
  for (std::size_t frame = 0; frame < clip.frames; ++frame) {
    append_trc_row(out.text(), clip, frame, options);
    if (const Status passed = out.pass_on(); !passed) return passed;
  }
  return out.finish();
}

}  // namespace mocap::exports
