#include "lib/simworld/trc_file.h"

#include <locale>
#include <optional>
#include <sstream>
#include <vector>

namespace mocap::simworld {
namespace {

std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells;
  std::istringstream stream(line);
  std::string cell;
  while (std::getline(stream, cell, '\t')) {
    while (!cell.empty() && (cell.back() == '\r' || cell.back() == ' ')) cell.pop_back();
    cells.push_back(cell);
  }
  return cells;
}

std::optional<double> number_of(const std::string& cell) {
  double value = 0.0;
  std::istringstream stream(cell);
  stream.imbue(std::locale::classic());
  if (!(stream >> value)) return std::nullopt;
  return value;
}

// Adds one data line of a TRC file: frame, time, x y z of each marker.
void add_trc_frame(const std::vector<std::string>& cells, double unit_m, scene::C3d& into) {
  for (std::size_t m = 0; m < into.labels.size(); ++m) {
    scene::C3dSample sample;
    Eigen::Vector3d point = Eigen::Vector3d::Zero();
    sample.there = true;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::size_t cell = 2 + 3 * m + axis;
      const auto value = cell < cells.size() ? number_of(cells[cell]) : std::nullopt;
      sample.there = sample.there && value;
      point[static_cast<Eigen::Index>(axis)] = value.value_or(0.0) * unit_m;
    }
    sample.there = sample.there && !point.isZero();
    sample.position_m = point;
    into.samples.push_back(sample);
  }
  ++into.frames;
}

}  // namespace

Result<scene::C3d> parse_trc(const std::string& text) {
  const Error broken{ErrorCode::InvalidArgument, "it is no whole TRC file: rates, names and frames are expected"};
  const Error short_lines{ErrorCode::InvalidArgument, "its lines have far fewer cells than its header has markers"};
  std::istringstream stream(text);
  std::vector<std::string> header(4);
  for (std::string& line : header) {
    if (!std::getline(stream, line)) return broken;
  }
  const auto facts = cells_of(header[2]);
  const auto names = cells_of(header[3]);
  const auto rate = facts.empty() ? std::nullopt : number_of(facts[0]);
  if (!rate || !(*rate > 0.0) || facts.size() < 5 || names.size() < 3) return broken;
  scene::C3d clip;
  clip.rate_hz = *rate;
  for (std::size_t i = 2; i < names.size(); i += 3) clip.labels.push_back(names[i].empty() ? "*" : names[i]);
  const double unit_m = facts[4] == "m" ? 1.0 : 0.001;
  for (std::string line; std::getline(stream, line);) {
    const auto cells = cells_of(line);
    if (cells.size() > 2 && number_of(cells[0])) add_trc_frame(cells, unit_m, clip);
    // Short lines below a wide header would otherwise need memory far beyond the size of the file.
    if (clip.samples.size() > text.size()) return short_lines;
  }
  if (clip.frames == 0) return broken;
  return clip;
}

}  // namespace mocap::simworld
