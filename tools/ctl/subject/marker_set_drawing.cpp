#include "ctl/subject/marker_set_drawing.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

namespace mocap::ctl {
namespace {

constexpr double kPanel_px = 760.0;      // width of one view
constexpr double kMargin_px = 90.0;      // room for labels beside the body
constexpr double kTitle_px = 50.0;       // height of the title line above the views
constexpr double kMarker_px = 4.0;       // radius of a marker
constexpr double kText_px = 11.0;        // font size
constexpr double kLetter_px = 6.8;       // mean width of a letter of 11 px in a sans-serif font
constexpr double kMaxScale_px_m = 2000;  // a prop of 0.2 m fills 400 px
constexpr double kMinDepth_m = 0.01;     // a marker this far before or behind its joint belongs to one view

struct Point {
  double x = 0.0, y = 0.0;  // px, y down
};

struct Box {
  double left = 0.0, top = 0.0, right = 0.0, bottom = 0.0;

  bool overlaps(const Box& other) const {
    return left < other.right && other.left < right && top < other.bottom && other.top < bottom;
  }
};

std::string escaped(const std::string& text) {
  std::string safe;
  for (const char c : text) {
    switch (c) {
      case '&': safe += "&amp;"; break;
      case '<': safe += "&lt;"; break;
      case '>': safe += "&gt;"; break;
      default: safe += c;
    }
  }
  return safe;
}

std::vector<Eigen::Vector3d> rest_joints_m(const Skeleton& skeleton) {
  std::vector<Eigen::Vector3d> joints;
  for (const Bone& bone : skeleton.bones) {
    const Eigen::Vector3d parent =
        bone.parent < 0 ? Eigen::Vector3d::Zero() : joints[static_cast<std::size_t>(bone.parent)];
    joints.push_back(parent + bone.rest_offset_m);
  }
  return joints;
}

// Front and back for a body. A prop, which has one bone, is seen from the front and from above.
enum class View { Front, Back, Above };

// The rest pose in the world, and its place in a picture.
class Layout {
 public:
  explicit Layout(const MarkerSet& set) : joints_m_(rest_joints_m(set.skeleton)) {
    for (const MarkerOnBone& marker : set.markers) {
      markers_m_.push_back(joints_m_[static_cast<std::size_t>(marker.bone)] + marker.offset_m);
    }
    const bool is_prop = set.skeleton.bones.size() == 1;
    views_ = {View::Front, is_prop ? View::Above : View::Back};
    double half_m = 0.01;  // not 0, for a set of one marker
    for (std::size_t panel = 0; panel < views_.size(); ++panel) {
      for (const auto* points : {&joints_m_, &markers_m_}) {
        for (const Eigen::Vector3d& point : *points) {
          half_m = std::max(half_m, std::abs(point.y()));
          low_m_[panel] = std::min(low_m_[panel], up_m(point, views_[panel]));
          high_m_[panel] = std::max(high_m_[panel], up_m(point, views_[panel]));
        }
      }
    }
    scale_px_m_ = std::min(kMaxScale_px_m, (kPanel_px - 2.0 * kMargin_px) / (2.0 * half_m));
    const double tallest_m = std::max(high_m_[0] - low_m_[0], high_m_[1] - low_m_[1]);
    height_px_ = kTitle_px + scale_px_m_ * tallest_m + kMargin_px;
  }

  const std::vector<Eigen::Vector3d>& joints_m() const { return joints_m_; }
  const std::vector<Eigen::Vector3d>& markers_m() const { return markers_m_; }
  const std::array<View, 2>& views() const { return views_; }
  double height_px() const { return height_px_; }
  static double left_px(View view) { return view == View::Front ? 0.0 : kPanel_px; }

  Point place(const Eigen::Vector3d& point_m, View view) const {
    const double across_m = view == View::Back ? -point_m.y() : point_m.y();
    const double below_m = high_m_[view == View::Front ? 0 : 1] - up_m(point_m, view);
    return {left_px(view) + 0.5 * kPanel_px + scale_px_m_ * across_m,
            kTitle_px + 0.5 * kMargin_px + scale_px_m_ * below_m};
  }

 private:
  // From above, the front of the subject points down in the picture, to the reader.
  static double up_m(const Eigen::Vector3d& point_m, View view) {
    return view == View::Above ? -point_m.x() : point_m.z();
  }

  std::vector<Eigen::Vector3d> joints_m_, markers_m_;
  std::array<View, 2> views_{};
  std::array<double, 2> low_m_{1e9, 1e9}, high_m_{-1e9, -1e9};
  double scale_px_m_ = 1.0, height_px_ = 0.0;
};

// A label and the place of the marker that it names.
struct Label {
  std::string text;
  Point marker;
};

Box box_of(const Label& label, Point centre) {
  const double half_px = 0.5 * kLetter_px * static_cast<double>(label.text.size());
  return {centre.x - half_px, centre.y - 0.5 * kText_px, centre.x + half_px, centre.y + 0.5 * kText_px};
}

double overlap_px2(const Box& box, const Box& other) {
  if (!box.overlaps(other)) return 0.0;
  return (std::min(box.right, other.right) - std::max(box.left, other.left)) *
         (std::min(box.bottom, other.bottom) - std::max(box.top, other.top));
}

// Places labels one after the other: the nearest of 16 directions and 8 distances that is free, otherwise the place
// with the least overlap.
class LabelPlacer {
 public:
  LabelPlacer(Box panel, std::vector<Box> taken) : panel_(panel), taken_(std::move(taken)) {}

  Point place(const Label& label) {
    Point best = label.marker;
    double least_px2 = 1e18;
    for (int ring = 0; ring < 8 && least_px2 > 0.0; ++ring) {
      for (int direction = 0; direction < 16; ++direction) {
        const Point centre = candidate(label, ring, direction);
        const double overlap = cost_px2(box_of(label, centre));
        if (overlap >= least_px2) continue;
        least_px2 = overlap;
        best = centre;
      }
    }
    taken_.push_back(box_of(label, best));
    return best;
  }

 private:
  // Direction 0 points away from the middle of the panel; then alternately to both sides.
  Point candidate(const Label& label, int ring, int direction) const {
    const bool left = label.marker.x < 0.5 * (panel_.left + panel_.right) - 1.0;
    const int step = direction % 2 == 0 ? direction / 2 : -(direction + 1) / 2;
    const double angle = (left ? std::numbers::pi : 0.0) + 2.0 * std::numbers::pi * step / 16.0;
    const double reach_px = 2.0 * kMarker_px + 12.0 * ring;
    const double half_px = 0.5 * kLetter_px * static_cast<double>(label.text.size());
    return {label.marker.x + std::cos(angle) * (reach_px + half_px),
            label.marker.y + std::sin(angle) * (reach_px + 0.5 * kText_px)};
  }

  double cost_px2(const Box& box) const {
    double cost = 0.0;
    for (const Box& other : taken_) cost += overlap_px2(box, other);
    const bool outside =
        box.left < panel_.left || box.right > panel_.right || box.top < panel_.top || box.bottom > panel_.bottom;
    return outside ? cost + 1e6 : cost;
  }

  Box panel_;
  std::vector<Box> taken_;
};

std::string hex(const std::array<float, 3>& colour) {
  const auto byte = [](float part) { return std::lround(255.0F * std::clamp(part, 0.0F, 1.0F)); };
  return fmt::format("#{:02x}{:02x}{:02x}", byte(colour[0]), byte(colour[1]), byte(colour[2]));
}

// Whether the body does not hide the marker.
bool in_view(const MarkerOnBone& marker, const Layout& layout, View view) {
  if (layout.views()[1] == View::Above) return true;
  return (view == View::Back ? -marker.offset_m.x() : marker.offset_m.x()) >= -kMinDepth_m;
}

std::string bones_svg(const MarkerSet& set, const Layout& layout, View view) {
  std::string svg;
  const auto line = [&svg](Point a, Point b) {
    svg += fmt::format("<line x1='{:.1f}' y1='{:.1f}' x2='{:.1f}' y2='{:.1f}'/>\n", a.x, a.y, b.x, b.y);
  };
  const std::vector<Bone>& bones = set.skeleton.bones;
  for (std::size_t i = 0; i < bones.size(); ++i) {
    if (bones[i].parent < 0) continue;
    line(layout.place(layout.joints_m()[static_cast<std::size_t>(bones[i].parent)], view),
         layout.place(layout.joints_m()[i], view));
  }
  // From each marker to the joint of its bone: the marker moves with that bone.
  svg += "</g>\n<g stroke='#c3cbd4' stroke-width='1.5' stroke-dasharray='3 3'>\n";
  for (std::size_t i = 0; i < set.markers.size(); ++i) {
    line(layout.place(layout.joints_m()[static_cast<std::size_t>(set.markers[i].bone)], view),
         layout.place(layout.markers_m()[i], view));
  }
  return "<g stroke='#8796a5' stroke-width='5' stroke-linecap='round'>\n" + svg + "</g>\n";
}

std::string markers_svg(const MarkerSet& set, const Layout& layout, View view) {
  std::string svg;
  for (std::size_t i = 0; i < set.markers.size(); ++i) {
    const Point at = layout.place(layout.markers_m()[i], view);
    svg +=
        fmt::format("<circle cx='{:.1f}' cy='{:.1f}' r='{:.0f}' fill='{}' stroke='#333'{}/>\n", at.x, at.y, kMarker_px,
                    hex(set.markers[i].colour), in_view(set.markers[i], layout, view) ? "" : " opacity='0.25'");
  }
  return svg;
}

std::string labels_svg(const MarkerSet& set, const Layout& layout, View view) {
  std::vector<Box> circles;
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < set.markers.size(); ++i) {
    if (!in_view(set.markers[i], layout, view)) continue;
    const Point at = layout.place(layout.markers_m()[i], view);
    circles.push_back({at.x - kMarker_px, at.y - kMarker_px, at.x + kMarker_px, at.y + kMarker_px});
    order.push_back(i);
  }
  // From the sides to the middle: the outermost labels have the most room.
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return std::abs(layout.markers_m()[a].y()) > std::abs(layout.markers_m()[b].y());
  });
  const double left_px = Layout::left_px(view);
  LabelPlacer placer({left_px, kTitle_px, left_px + kPanel_px, layout.height_px()}, std::move(circles));
  std::string svg;
  for (const std::size_t i : order) {
    const Label label{set.markers[i].name, layout.place(layout.markers_m()[i], view)};
    const Point at = placer.place(label);
    svg += fmt::format("<line x1='{:.1f}' y1='{:.1f}' x2='{:.1f}' y2='{:.1f}' stroke='#555' stroke-width='0.7'/>\n",
                       label.marker.x, label.marker.y, at.x, at.y);
    svg += fmt::format("<text x='{:.1f}' y='{:.1f}' stroke='white' stroke-width='2' paint-order='stroke'>{}</text>\n",
                       at.x, at.y + 0.35 * kText_px, escaped(label.text));
  }
  return svg;
}

const char* title_of(View view) {
  switch (view) {
    case View::Front: return "front (the subject's left is on the right)";
    case View::Back: return "back";
    case View::Above: return "from above (the front points down)";
  }
  return "";
}

}  // namespace

std::string marker_set_svg(const MarkerSet& set) {
  const Layout layout(set);
  std::string svg = fmt::format(
      "<svg xmlns='http://www.w3.org/2000/svg' width='{0:.0f}' height='{1:.0f}' viewBox='0 0 {0:.0f} {1:.0f}' "
      "font-family='sans-serif' font-size='{2:.0f}' text-anchor='middle'>\n<rect width='100%' height='100%' "
      "fill='white'/>\n",
      2.0 * kPanel_px, layout.height_px(), kText_px);
  svg += fmt::format("<text x='{:.0f}' y='18' font-size='15' font-weight='bold'>{}: {} markers, skeleton {}</text>\n",
                     kPanel_px, escaped(set.name), set.markers.size(), escaped(set.skeleton.name));
  for (const View view : layout.views()) {
    svg += fmt::format("<text x='{:.0f}' y='38' font-size='13'>{}</text>\n", Layout::left_px(view) + 0.5 * kPanel_px,
                       title_of(view));
    svg += bones_svg(set, layout, view) + markers_svg(set, layout, view) + labels_svg(set, layout, view);
  }
  return svg + "</svg>\n";
}

}  // namespace mocap::ctl
