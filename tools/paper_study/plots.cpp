#include "paper_study/plots.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <system_error>
#include <vector>

#include "paper_study/methods.h"
#include "paper_study/see.h"

namespace mocap::paper_study {
namespace {

constexpr int kPlottedClips = 3;
constexpr std::size_t kGateEvery = 5;
constexpr double kWidestGate_px = 300.0;  // a gate of the size of the image would hide everything else

void add_way(std::string& svg, const std::vector<Eigen::Vector2d>& way_px, bool labelled) {
  svg += "<polyline class=\"";
  svg += labelled ? "way" : "other";
  svg += "\" points=\"";
  for (const Eigen::Vector2d& point : way_px)
    fmt::format_to(std::back_inserter(svg), "{:.1f},{:.1f} ", point.x(), point.y());
  svg += "\"/>\n";
}

void add_barrier(std::string& svg, const Barrier& barrier) {
  const Eigen::Vector2d along = barrier.half_length_px * barrier.along;
  const Eigen::Vector2d across = barrier.half_height_px * Eigen::Vector2d(-barrier.along.y(), barrier.along.x());
  svg += "<polygon class=\"barrier\" points=\"";
  for (const auto& [a, b] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}) {
    const Eigen::Vector2d corner = barrier.centre_px + a * along + b * across;
    fmt::format_to(std::back_inserter(svg), "{:.1f},{:.1f} ", corner.x(), corner.y());
  }
  svg += "\"/>\n";
}

void add_frame(std::string& svg, const FollowedFrame& frame, const Eigen::Vector2d& truth_px, bool with_gate) {
  auto out = std::back_inserter(svg);
  const Eigen::Vector2d& at = frame.predicted_px;
  if (with_gate && frame.gate_radius_px > 0.0 && frame.gate_radius_px < kWidestGate_px) {
    fmt::format_to(out, "<circle class=\"gate\" cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{:.1f}\"/>\n", at.x(), at.y(),
                   frame.gate_radius_px);
  }
  fmt::format_to(out, "<line class=\"error\" x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\"/>\n", at.x(),
                 at.y(), truth_px.x(), truth_px.y());
  fmt::format_to(out, "<circle class=\"{}\" cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"2\"/>\n",
                 frame.held ? "prediction" : "missed", at.x(), at.y());
}

Status write(const std::filesystem::path& path, const std::string& text) {
  std::ofstream out(path);
  out << text;
  out.close();
  if (!out) return Error{ErrorCode::Io, fmt::format("cannot write {}: is the folder writable?", path.string())};
  return {};
}

}  // namespace

std::string plot(const Clip& clip, const Followed& followed, const std::string& title) {
  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" "
      "height=\"{1}\">\n<style>rect{{fill:white}} text{{font:14px sans-serif}} "
      ".way,.other{{fill:none;stroke:black;stroke-dasharray:4 2}} .other{{stroke:#bbb}} "
      ".barrier{{fill:#8888;stroke:#555}} .gate{{fill:none;stroke:#36c;stroke-opacity:.5}} "
      ".error{{stroke:#d33;stroke-opacity:.5}} .prediction{{fill:#d33}} .missed{{fill:none;stroke:#d33}} "
      ".label{{fill:none;stroke:#080;stroke-width:3}} .key{{font-size:10px;fill:#555}}</style>\n<rect "
      "width=\"{0}\" height=\"{1}\"/>\n",
      kWidth_px, kHeight_px);
  for (const Barrier& barrier : clip.barriers) add_barrier(svg, barrier);
  for (std::size_t i = clip.ways_px.size(); i-- > 0;) add_way(svg, clip.ways_px[i], i == 0);
  for (std::size_t k = 0; k < followed.frames.size(); ++k) {
    const FollowedFrame& frame = followed.frames[k];
    add_frame(svg, frame, clip.ways_px[0][k + 1], k % kGateEvery == 0 || !frame.held);
  }
  if (!followed.frames.empty()) {
    const Eigen::Vector2d& label = followed.frames.back().label_px;
    svg += fmt::format("<circle class=\"label\" cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"9\"/>\n", label.x(), label.y());
  }
  svg += fmt::format("<text x=\"8\" y=\"18\">{}{}</text>\n", title, followed.lost ? " - lost" : "");
  svg +=
      "<text class=\"key\" x=\"8\" y=\"472\">red: predicted (open: no blob); blue: gate; "
      "green: last position of the label; dashed: paths; grey: barrier</text>\n</svg>\n";
  return svg;
}

Status draw_plots(const QualitySettings& settings, const std::filesystem::path& folder) {
  std::error_code failure;
  std::filesystem::create_directories(folder, failure);
  if (failure) {
    return Error{ErrorCode::Io, fmt::format("cannot make the folder {}: {}", folder.string(), failure.message())};
  }
  std::vector<Situation> situations(kStudied.begin(), kStudied.end());
  situations.insert(situations.end(), kHarder.begin(), kHarder.end());
  Viewer viewer;
  for (const Situation situation : situations) {
    for (int i = 0; i < std::min(settings.clips, kPlottedClips); ++i) {
      const std::uint64_t seed = clip_seed(settings.seed_base, situation, static_cast<std::size_t>(i));
      const Clip clip = make_clip(situation, seed);
      const Sightings sightings = viewer.see(clip);
      for (const Method& method : methods()) {
        const Followed followed =
            follow(*method.make({.seed = seed}), clip, method.paper_detector ? sightings.paper : sightings.ours);
        const std::string title = fmt::format("{} {}: {}", name_of(situation), i, method.name);
        const Status written = write(folder / fmt::format("{}_{}_{}.svg", name_of(situation), i, method.name),
                                     plot(clip, followed, title));
        if (!written) return written;
      }
    }
  }
  return {};
}

}  // namespace mocap::paper_study
