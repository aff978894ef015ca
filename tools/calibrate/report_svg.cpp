#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "calibrate/report_rig.h"

namespace mocap::calibrate {
namespace {

using calibration::CameraAssessment;
using calibration::Grade;
using calibration::kImageCells;
using calibration::RigAssessment;
using calibration::VolumeUncertainty;
using Eigen::Vector2d;

constexpr double kWide_px = 1200.0;
constexpr double kMargin_px = 30.0;
constexpr double kGap_px = 16.0;
constexpr double kMmPerMetre = 1e3;
constexpr std::size_t kMaxArrows = 260;  // in one image
constexpr std::size_t kMaxIssues = 8;

std::string escaped(const std::string& text) {
  std::string safe;
  for (const char c : text) {
    if (c == '<') {
      safe += "&lt;";
    } else if (c == '>') {
      safe += "&gt;";
    } else if (c == '&') {
      safe += "&amp;";
    } else if (static_cast<unsigned char>(c) >= 0x20) {
      safe += c;
    }
  }
  return safe;
}

std::string words(double x, double y, const std::string& text, const char* style = "") {
  return fmt::format("<text x='{:.1f}' y='{:.1f}' {}>{}</text>\n", x, y, style, escaped(text));
}

std::string box(double x, double y, double width, double height, const std::string& style) {
  return fmt::format("<rect x='{:.2f}' y='{:.2f}' width='{:.2f}' height='{:.2f}' {}/>\n", x, y, width, height, style);
}

std::string stroke(const Vector2d& a, const Vector2d& b, const std::string& style) {
  return fmt::format("<line x1='{:.2f}' y1='{:.2f}' x2='{:.2f}' y2='{:.2f}' {}/>\n", a.x(), a.y(), b.x(), b.y(), style);
}

const char* colour_of(Grade grade) {
  constexpr std::array<const char*, 4> kColours{"#1b7f4d", "#5a9f35", "#d98a00", "#c4302b"};
  return kColours[static_cast<std::size_t>(grade)];
}

// The largest of 1, 2, 5, 10, ... that does not exceed the value.
double round_down(double value) {
  const double power = std::pow(10.0, std::floor(std::log10(value)));
  return power * (value >= 5.0 * power ? 5.0 : value >= 2.0 * power ? 2.0 : 1.0);
}

// The colour map viridis: monotonic in brightness and readable for colour-blind people.
std::string heat(double share) {
  constexpr std::array<std::array<double, 3>, 5> kStops{
      {{253, 231, 37}, {94, 201, 98}, {33, 145, 140}, {59, 82, 139}, {68, 1, 84}}};
  const double at = std::clamp(share, 0.0, 1.0) * (kStops.size() - 1);
  const auto i = std::min<std::size_t>(kStops.size() - 2, static_cast<std::size_t>(at));
  const double t = at - static_cast<double>(i);
  std::array<int, 3> rgb{};
  for (std::size_t k = 0; k < 3; ++k) {
    rgb[k] = static_cast<int>(std::lround(kStops[i][k] + t * (kStops[i + 1][k] - kStops[i][k])));
  }
  return fmt::format("rgb({},{},{})", rgb[0], rgb[1], rgb[2]);
}

/// Draws the page from top to bottom.
class Page {
 public:
  explicit Page(const RigReport& report) : report_(report), assessment_(report.assessment) {}

  std::string draw() {
    header();
    figures();
    issues();
    cameras();
    lower_part();
    return fmt::format(
               "<svg xmlns='http://www.w3.org/2000/svg' width='{0:.0f}' height='{1:.0f}' viewBox='0 0 {0:.0f} {1:.0f}' "
               "font-family='DejaVu Sans, Verdana, sans-serif' font-size='12' fill='#222'>\n"
               "<defs><style>.h{{font-size:15px;font-weight:bold}} .s{{font-size:10.5px;fill:#666}} "
               ".m{{text-anchor:middle}} .e{{text-anchor:end}}</style></defs>\n",
               kWide_px, y_ + kMargin_px) +
           box(0.0, 0.0, kWide_px, y_ + kMargin_px, "fill='white'") + body_ + "</svg>\n";
  }

 private:
  void header() {
    y_ = kMargin_px + 18.0;
    body_ += words(kMargin_px, y_, "Rig calibration: " + report_.title, "font-size='22' font-weight='bold'");
    const std::string grade = calibration::name_of(assessment_.grade);
    body_ += box(kWide_px - kMargin_px - 130.0, y_ - 22.0, 130.0, 30.0,
                 fmt::format("rx='6' fill='{}'", colour_of(assessment_.grade)));
    body_ += words(kWide_px - kMargin_px - 65.0, y_ - 1.0, grade,
                   "class='m' fill='white' font-size='17' font-weight='bold'");
  }

  void figure(double& x, const std::string& name, const std::string& value) {
    if (x > kWide_px - kMargin_px - 150.0) {
      x = kMargin_px;
      y_ += 40.0;
    }
    body_ += words(x, y_, name, "class='s'") + words(x, y_ + 17.0, value, "font-size='15'");
    // Estimated text widths: 6 px a letter at font size 10.5, 9.2 px at 15.
    x += 24.0 + std::max(6.0 * static_cast<double>(name.size()), 9.2 * static_cast<double>(value.size()));
  }

  void figures() {
    y_ += 30.0;
    double x = kMargin_px;
    figure(x, "reprojection, rms per axis", fmt::format("{:.3f} px", assessment_.rms_px));
    if (assessment_.heldout_px) figure(x, "on held-out samples", fmt::format("{:.3f} px", *assessment_.heldout_px));
    if (assessment_.wand) {
      const auto& wand = *assessment_.wand;
      figure(x, "wand", fmt::format("{:.2f} ± {:.2f} mm", kMmPerMetre * wand.mean_m, kMmPerMetre * wand.std_m));
    }
    if (assessment_.wand) figure(x, "scale", "from the wand, not checked");
    figure(x, "floor", assessment_.lowest_camera_m ? "where it was" : "not measured");
    if (assessment_.volume && assessment_.volume->median_m)
      figure(x, "marker position, one sigma", fmt::format("{:.2f} mm", kMmPerMetre * *assessment_.volume->median_m));
    if (report_.to_truth)
      figure(x, "cameras against truth", fmt::format("{:.2f} mm", kMmPerMetre * report_.to_truth->position_m));
    if (report_.since_previous)
      figure(x, "cameras against the previous rig",
             fmt::format("{:.2f} mm", kMmPerMetre * report_.since_previous->position_m));
    y_ += 34.0;
  }

  // Wraps the text to the page width.
  void paragraph(double x, const std::string& text) {
    constexpr std::size_t kLetters = 150;
    for (std::size_t at = 0; at < text.size();) {
      std::size_t end = std::min(text.size(), at + kLetters);
      if (end < text.size()) {
        const std::size_t blank = text.rfind(' ', end);
        if (blank != std::string::npos && blank > at) end = blank;
      }
      body_ += words(x, y_, text.substr(at, end - at));
      y_ += 17.0;
      at = text.find_first_not_of(' ', end);
    }
  }

  void issues() {
    const auto& list = assessment_.issues;
    y_ += 6.0;
    for (std::size_t i = 0; i < std::min(list.size(), kMaxIssues); ++i) {
      body_ += box(kMargin_px, y_ - 9.0, 10.0, 10.0, fmt::format("rx='2' fill='{}'", colour_of(list[i].grade)));
      paragraph(kMargin_px + 18.0, list[i].text);
    }
    if (list.size() > kMaxIssues) {
      body_ += words(kMargin_px + 18.0, y_, fmt::format("and {} more, in the text report", list.size() - kMaxIssues));
      y_ += 17.0;
    }
  }

  void cameras() {
    const std::size_t count = assessment_.cameras.size();
    if (count == 0) return;
    y_ += 22.0;
    body_ += words(kMargin_px, y_, "Cameras", "class='h'");
    const double scale = arrow_scale();
    body_ += words(
        kMargin_px + 90.0, y_,
        fmt::format("shade: points in each image cell;  lines: observed minus projected, {:.0f} times enlarged (blue: "
                    "used for the adjustment, orange: held out)",
                    scale),
        "class='s'");
    y_ += 12.0;
    const std::size_t columns = count <= 4 ? std::max<std::size_t>(2, count) : count <= 15 ? 5 : 8;
    const double width =
        (kWide_px - 2.0 * kMargin_px - kGap_px * static_cast<double>(columns - 1)) / static_cast<double>(columns);
    for (std::size_t first = 0; first < count; first += columns) {
      double lowest = y_;
      for (std::size_t i = first; i < std::min(count, first + columns); ++i) {
        const double x = kMargin_px + static_cast<double>(i - first) * (width + kGap_px);
        lowest = std::max(lowest, tile(i, x, width, scale));
      }
      y_ = lowest + 8.0;
    }
  }

  // An rms residual is drawn about as long as a fortieth of the image width.
  double arrow_scale() const {
    double width = 0.0;
    for (const CameraModel& camera : report_.evidence.rig) {
      width += camera.width_px / static_cast<double>(report_.evidence.rig.size());
    }
    return round_down(std::clamp(width / 40.0 / std::max(1e-3, assessment_.rms_px), 1.0, 5000.0));
  }

  // Returns the y of its lower end.
  double tile(std::size_t index, double x, double width, double scale) {
    const CameraAssessment& camera = assessment_.cameras[index];
    const CameraModel& model = report_.evidence.rig[index];
    const double zoom = width / model.width_px;
    const double height = zoom * model.height_px;
    int most = 1;
    for (const auto& cell : camera.cells) most = std::max(most, cell.points);
    for (std::size_t i = 0; i < camera.cells.size(); ++i) {
      const int points = camera.cells[i].points;
      const double share = points > 0 ? 0.12 + 0.38 * std::log1p(points) / std::log1p(most) : 0.0;
      const double side_x = width / kImageCells;
      const double side_y = height / kImageCells;
      const auto row = static_cast<double>(i / kImageCells);
      const auto column = static_cast<double>(i % kImageCells);
      body_ +=
          box(x + column * side_x, y_ + row * side_y, side_x, side_y,
              points > 0 ? fmt::format("fill='#7f9fbf' fill-opacity='{:.2f}'", share) : std::string("fill='#f7ece6'"));
    }
    body_ += fmt::format("<svg x='{:.2f}' y='{:.2f}' width='{:.2f}' height='{:.2f}'>\n", x, y_, width, height);
    arrows(index, zoom, scale);
    body_ += "</svg>\n" + box(x, y_, width, height, "fill='none' stroke='#888'");
    const double under = y_ + height;
    body_ += words(x, under + 15.0, camera.name, "font-weight='bold'");
    const std::string held = camera.heldout_px ? fmt::format(" ({:.2f} held out)", *camera.heldout_px) : "";
    body_ += words(x, under + 30.0, fmt::format("{:.2f} px{}", camera.rms_px, held), "class='s'");
    body_ += words(x, under + 44.0, fmt::format("{} points, {:.0f} % covered", camera.points, 100.0 * camera.coverage),
                   "class='s'");
    body_ += words(x, under + 58.0,
                   camera.position_sigma_m && camera.rotation_sigma_rad
                       ? fmt::format("±{:.2f} mm, ±{:.4f}°", kMmPerMetre * *camera.position_sigma_m,
                                     *camera.rotation_sigma_rad * 57.29577951308232)
                       : std::string("position and rotation not determined"),
                   "class='s'");
    return under + 64.0;
  }

  void arrows(std::size_t index, double zoom, double scale) {
    const auto& all = report_.evidence.residuals;
    const auto mine = [&](const auto& sight) { return static_cast<std::size_t>(sight.camera) == index; };
    const auto count = static_cast<std::size_t>(std::ranges::count_if(all, mine));
    const std::size_t step = std::max<std::size_t>(1, (count + kMaxArrows - 1) / kMaxArrows);
    std::size_t number = 0;
    for (const auto& sight : all) {
      if (!mine(sight) || number++ % step != 0) continue;
      const Vector2d from = zoom * (sight.at.v + Vector2d(0.5, 0.5));
      const Vector2d to = from + zoom * scale * sight.residual_px;
      body_ += stroke(from, to,
                      sight.held_out ? "stroke='#e07b00' stroke-width='0.9'" : "stroke='#1f4e8c' stroke-width='0.7'");
    }
  }

  void lower_part() {
    const double top = y_ + 30.0;
    double bottom = top;
    if (assessment_.wand) bottom = std::max(bottom, histogram(kMargin_px, top, 300.0, 200.0));
    if (assessment_.volume && assessment_.volume->median_m) {
      const double left = assessment_.wand ? 370.0 : kMargin_px;
      bottom = std::max(bottom, slices(left, top, kWide_px - kMargin_px - left));
    }
    y_ = bottom;
  }

  double histogram(double x, double y, double width, double height) {
    constexpr int kBins = 30;
    const auto& wand = *assessment_.wand;
    body_ += words(x, y, "Wand length", "class='h'");
    body_ += words(x + 120.0, y, fmt::format("{} samples, triangulated", wand.samples), "class='s'");
    const double top = y + 14.0;
    const double reach = std::max({4.0 * wand.std_m, std::abs(wand.mean_m - wand.nominal_m) * 1.3, 1e-6});
    std::array<int, kBins> bins{};
    int beyond = 0;
    for (const double length : report_.evidence.lengths_m) {
      const double at = (length - wand.nominal_m + reach) / (2.0 * reach) * kBins;
      if (at < 0.0 || at >= kBins) {
        ++beyond;
      } else {
        ++bins[static_cast<std::size_t>(at)];
      }
    }
    const int most = std::max(1, *std::ranges::max_element(bins));
    for (int i = 0; i < kBins; ++i) {
      const double high = height * bins[static_cast<std::size_t>(i)] / most;
      body_ += box(x + width * i / kBins, top + height - high, width / kBins - 1.0, high, "fill='#4d7fb3'");
    }
    body_ += stroke({x, top + height}, {x + width, top + height}, "stroke='#888'");
    body_ += stroke({x + 0.5 * width, top}, {x + 0.5 * width, top + height}, "stroke='#c4302b' stroke-dasharray='4 3'");
    body_ += words(x + 0.5 * width, top + height + 15.0, fmt::format("nominal {:.1f} mm", kMmPerMetre * wand.nominal_m),
                   "class='m s'");
    body_ += words(x, top + height + 15.0, fmt::format("−{:.2f} mm", kMmPerMetre * reach), "class='s'");
    body_ += words(x + width, top + height + 15.0, fmt::format("+{:.2f} mm", kMmPerMetre * reach), "class='e s'");
    body_ += words(x, top + height + 33.0,
                   fmt::format("mean {:.3f}, std {:.3f}, {:.2f} to {:.2f} mm{}", kMmPerMetre * wand.mean_m,
                               kMmPerMetre * wand.std_m, kMmPerMetre * wand.min_m, kMmPerMetre * wand.max_m,
                               beyond > 0 ? fmt::format("; {} outside", beyond) : std::string()),
                   "class='s'");
    return top + height + 40.0;
  }

  double slices(double x, double y, double width) {
    const VolumeUncertainty& volume = *assessment_.volume;
    const auto count = static_cast<double>(volume.sigma_m.size());
    body_ += words(x, y, "Uncertainty of a marker position", "class='h'");
    body_ += words(x + 260.0, y, "one sigma, seen from above; grey: fewer than two cameras see the point", "class='s'");
    const double each = (width - kGap_px * (count - 1.0)) / count;
    const double cell = std::min(each / volume.columns, 200.0 / volume.rows);
    // Colour range about the median, so that small differences have similar colours.
    const double low = 0.5 * *volume.median_m;
    const double high = 2.0 * *volume.median_m;
    double bottom = y;
    for (std::size_t slice = 0; slice < volume.sigma_m.size(); ++slice) {
      const double left = x + static_cast<double>(slice) * (each + kGap_px);
      bottom = std::max(bottom, one_slice(volume, slice, left, y + 14.0, cell, low, high));
    }
    legend(x, bottom + 8.0, width, low, high);
    body_ +=
        words(x + 330.0, bottom + 17.0,
              fmt::format("x {:.1f} to {:.1f} m, y {:.1f} to {:.1f} m{}", volume.from_m.x(), volume.to_m.x(),
                          volume.from_m.y(), volume.to_m.y(),
                          assessment_.lowest_camera_m ? "" : "; floor not measured: origin at the mean of the cameras"),
              "class='s'");
    return bottom + 40.0;
  }

  double one_slice(const VolumeUncertainty& volume, std::size_t slice, double x, double y, double cell, double low,
                   double high) {
    for (int row = 0; row < volume.rows; ++row) {
      for (int column = 0; column < volume.columns; ++column) {
        const double sigma =
            volume.sigma_m[slice][static_cast<std::size_t>(row) * static_cast<std::size_t>(volume.columns) +
                                  static_cast<std::size_t>(column)];
        const std::string fill = std::isfinite(sigma) ? heat((sigma - low) / (high - low)) : "#d5d5d5";
        // The y axis of the world points up on the page.
        body_ += box(x + cell * column, y + cell * (volume.rows - 1 - row), cell + 0.4, cell + 0.4,
                     fmt::format("fill='{}' shape-rendering='crispEdges'", fill));
      }
    }
    const double wide = cell * volume.columns;
    const double high_px = cell * volume.rows;
    body_ += box(x, y, wide, high_px, "fill='none' stroke='#888'");
    body_ += words(x, y + high_px + 14.0, fmt::format("z {:.2f} m", volume.heights_m[slice]), "class='s'");
    return y + high_px + 20.0;
  }

  void legend(double x, double y, double width, double low, double high) {
    constexpr int kSteps = 40;
    const double wide = std::min(width, 300.0);
    for (int i = 0; i < kSteps; ++i) {
      body_ +=
          box(x + wide * i / kSteps, y, wide / kSteps + 0.4, 10.0, fmt::format("fill='{}'", heat((i + 0.5) / kSteps)));
    }
    body_ += words(x, y + 23.0, fmt::format("{:.2f} mm", kMmPerMetre * low), "class='s'");
    body_ += words(x + wide, y + 23.0, fmt::format("{:.2f} mm and more", kMmPerMetre * high), "class='e s'");
  }

  const RigReport& report_;
  const RigAssessment& assessment_;
  std::string body_;
  double y_ = 0.0;
};

}  // namespace

std::string report_svg(const RigReport& report) { return Page(report).draw(); }

}  // namespace mocap::calibrate
