#include "score/plots.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <utility>

namespace mocap::score {
namespace {

constexpr double kLeft_px = 130.0, kRight_px = 20.0, kTop_px = 52.0, kBottom_px = 34.0;
constexpr double kWide_px = 1000.0, kRow_px = 12.0, kHigh_px = 300.0;
constexpr double kLeastWide_px = 1.5;  // minimum width of a box that shows an error, so that a single set is visible

struct Look {
  scoring::LabelVerdict state;
  const char* colour;
  const char* words;
};
constexpr Look kLooks[] = {{scoring::LabelVerdict::Right, "#4daf6a", "measured, right"},
                           {scoring::LabelVerdict::Filled, "#9ecae1", "filled, within 20 mm"},
                           {scoring::LabelVerdict::FilledOff, "#f5a623", "filled, farther off"},
                           {scoring::LabelVerdict::Lost, "#555555", "in view, not measured"},
                           {scoring::LabelVerdict::Wrong, "#d62728", "wrong"},
                           {scoring::LabelVerdict::Unseen, "#eeeeee", "not in view, not reported"}};

const Look& look_of(scoring::LabelVerdict state) {
  return *std::ranges::find_if(kLooks, [state](const Look& look) { return look.state == state; });
}

bool is_bad(scoring::LabelVerdict state) {
  return state == scoring::LabelVerdict::Wrong || state == scoring::LabelVerdict::FilledOff;
}

std::string escaped(const std::string& text) {
  std::string safe;
  for (const char c : text) safe += c == '<' ? "&lt;" : c == '>' ? "&gt;" : c == '&' ? "&amp;" : std::string(1, c);
  return safe;
}

std::string text_at(double x, double y, const std::string& text, const char* anchor = "start", int size = 11) {
  return fmt::format("<text x='{:.1f}' y='{:.1f}' font-size='{}' text-anchor='{}'>{}</text>\n", x, y, size, anchor,
                     escaped(text));
}

std::string rectangle(double x, double y, double width, double height, const char* colour) {
  return fmt::format("<rect x='{:.2f}' y='{:.1f}' width='{:.2f}' height='{:.1f}' fill='{}'/>\n", x, y, width, height,
                     colour);
}

std::string line(double x0, double y0, double x1, double y1) {
  return fmt::format("<line x1='{:.1f}' y1='{:.1f}' x2='{:.1f}' y2='{:.1f}' stroke='#bbb' stroke-width='0.6'/>\n", x0,
                     y0, x1, y1);
}

// The time axis at the bottom, s.
class TimeAxis {
 public:
  TimeAxis(double begin_s, double end_s) : begin_s_(begin_s), span_s_(std::max(1e-6, end_s - begin_s)) {}

  double x(double t_s) const { return kLeft_px + kWide_px * (t_s - begin_s_) / span_s_; }

  std::string draw(double bottom_px) const {
    const double step_s = span_s_ > 40.0 ? 5.0 : span_s_ > 8.0 ? 1.0 : span_s_ > 1.5 ? 0.5 : 0.1;
    std::string svg;
    for (double t_s = std::ceil(begin_s_ / step_s) * step_s; t_s <= begin_s_ + span_s_ + 1e-9; t_s += step_s) {
      svg += line(x(t_s), kTop_px, x(t_s), bottom_px + 4.0);
      svg += text_at(x(t_s), bottom_px + 16.0, fmt::format("{:g}", std::round(t_s * 10.0) / 10.0), "middle");
    }
    return svg + text_at(kLeft_px + kWide_px, bottom_px + 29.0, "s", "end");
  }

 private:
  double begin_s_, span_s_;
};

Status write(const std::filesystem::path& file, double height_px, const std::string& body) {
  const double width_px = kLeft_px + kWide_px + kRight_px;
  std::ofstream out(file, std::ios::trunc);
  out << fmt::format(
      "<svg xmlns='http://www.w3.org/2000/svg' width='{0:.0f}' height='{1:.0f}' font-family='sans-serif'>\n"
      "<rect width='{0:.0f}' height='{1:.0f}' fill='white'/>\n{2}</svg>\n",
      width_px, height_px, body);
  out.close();
  if (!out) return Error{ErrorCode::Io, fmt::format("'{}' cannot be written: {}", file.string(), std::strerror(errno))};
  return {};
}

// The line of one marker: a box for each run of equal states. Errors are drawn last, on top.
std::string row_of(const scoring::Timeline& timeline, const std::vector<scoring::LabelVerdict>& states,
                   const TimeAxis& axis, double y) {
  std::string good, bad;
  for (std::size_t begin = 0; begin < states.size();) {
    std::size_t end = begin + 1;
    while (end < states.size() && states[end] == states[begin]) ++end;
    const double x = axis.x(timeline.t_s[begin]);
    const double till = end < states.size() ? axis.x(timeline.t_s[end]) : kLeft_px + kWide_px;
    const bool shows = is_bad(states[begin]);
    (shows ? bad : good) +=
        rectangle(x, y, std::max(till - x, shows ? kLeastWide_px : 0.05), kRow_px - 2.0, look_of(states[begin]).colour);
    begin = end;
  }
  return good + bad;
}

}  // namespace

Status plot_names(const std::filesystem::path& file, const std::string& title, const scoring::Timeline& timeline,
                  const std::vector<std::string>& names) {
  const std::size_t rows = timeline.markers.size();
  const double bottom_px = kTop_px + kRow_px * static_cast<double>(rows);
  const TimeAxis axis(timeline.t_s.empty() ? 0.0 : timeline.t_s.front(),
                      timeline.t_s.empty() ? 1.0 : timeline.t_s.back());
  std::string body = text_at(8.0, 18.0, title, "start", 14);
  double x = kLeft_px;
  for (const Look& look : kLooks) {
    body += rectangle(x, 30.0, 10.0, 10.0, look.colour) + text_at(x + 14.0, 39.0, look.words);
    x += 155.0;
  }
  body += axis.draw(bottom_px);
  for (std::size_t m = 0; m < rows; ++m) {
    const double y = kTop_px + kRow_px * static_cast<double>(m) + 1.0;
    body += text_at(kLeft_px - 5.0, y + 9.0, m < names.size() ? names[m] : fmt::format("marker {}", m), "end", 10);
    body += row_of(timeline, timeline.markers[m], axis, y);
  }
  return write(file, bottom_px + kBottom_px, body);
}

Status plot_errors(const std::filesystem::path& file, const std::string& title,
                   const std::vector<scoring::JointErrors>& errors) {
  constexpr double kLeast_mm = 0.01, kMost_mm = 1000.0;
  const double bottom_px = kTop_px + kHigh_px;
  const TimeAxis axis(errors.empty() ? 0.0 : errors.front().t_s, errors.empty() ? 1.0 : errors.back().t_s);
  const auto y = [&](double mm) {
    const double share = std::log(std::clamp(mm, kLeast_mm, kMost_mm) / kLeast_mm) / std::log(kMost_mm / kLeast_mm);
    return bottom_px - kHigh_px * share;
  };
  std::string body = text_at(8.0, 18.0, title, "start", 14) + axis.draw(bottom_px);
  for (double mm = kLeast_mm; mm <= kMost_mm * 1.01; mm *= 10.0) {
    body += line(kLeft_px, y(mm), kLeft_px + kWide_px, y(mm));
    body += text_at(kLeft_px - 5.0, y(mm) + 4.0, fmt::format("{:g} mm", mm), "end");
  }
  body += rectangle(kLeft_px, 30.0, 10.0, 10.0, "#1f6fb4") + text_at(kLeft_px + 14.0, 39.0, "rms of all joints");
  body += rectangle(kLeft_px + 155.0, 30.0, 10.0, 10.0, "#d62728") + text_at(kLeft_px + 169.0, 39.0, "worst joint");
  for (const bool worst : {true, false}) {
    std::string points;
    for (const scoring::JointErrors& error : errors) {
      points += fmt::format("{:.2f},{:.1f} ", axis.x(error.t_s), y(worst ? error.max_mm : error.rms_mm));
    }
    body += fmt::format("<polyline points='{}' fill='none' stroke='{}' stroke-width='1'/>\n", points,
                        worst ? "#d62728" : "#1f6fb4");
  }
  return write(file, bottom_px + kBottom_px, body);
}

}  // namespace mocap::score
