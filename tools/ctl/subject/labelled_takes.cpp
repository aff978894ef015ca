#include "ctl/subject/labelled_takes.h"

#include <fmt/format.h>

#include <cerrno>
#include <fstream>
#include <limits>
#include <optional>
#include <span>

#include "base/read_file.h"
#include "ctl/take/take_failure.h"
#include "wire/codec/json.h"

namespace mocap::ctl {

Result<scene::C3d> read_c3d(const std::filesystem::path& path) {
  const Result<std::string> bytes = read_file(path);
  if (!bytes) {
    return cannot_read({bytes.error().code, fmt::format("{}: cannot be read, expected a C3D file", path.string())});
  }
  Result<scene::C3d> c3d = scene::parse_c3d(std::as_bytes(std::span(*bytes)));
  if (!c3d) return Error{c3d.error().code, fmt::format("{}: {}", path.string(), c3d.error().message)};
  return c3d;
}

Result<StreamTakes> read_stream(const std::filesystem::path& path, std::uint32_t subject, const MarkerSet& set,
                                double rest_s) {
  std::ifstream in(path);
  if (!in) {
    return Error{errno == ENOENT ? ErrorCode::NotFound : ErrorCode::InvalidArgument,
                 fmt::format("{}: cannot be read, expected JSON lines", path.string())};
  }
  StreamTakes takes;
  takes.at_rest.markers = takes.moving.markers = set.markers.size();
  std::optional<Timestamp> began;
  std::string line;
  for (std::size_t number = 1; std::getline(in, line); ++number) {
    if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
    const Result<Snapshot> snapshot = wire::from_json_line(line);
    if (!snapshot) {
      if (in.eof()) break;  // the writer was interrupted in the middle of the last line
      return Error{ErrorCode::InvalidArgument,
                   fmt::format("{}:{}: {}", path.string(), number, snapshot.error().message)};
    }
    for (const SubjectLabels& labels : snapshot->labels) {
      if (labels.subject.value != subject || labels.phase != SubjectPhase::Tracking) continue;
      if (labels.markers.size() != set.markers.size()) {
        return Error{ErrorCode::InvalidArgument,
                     fmt::format("{}:{}: subject {} has {} markers, but marker set '{}' has {}", path.string(), number,
                                 subject, labels.markers.size(), set.name, set.markers.size())};
      }
      if (!began) began = snapshot->instants.exposed_at;
      const bool rests = to_s(snapshot->instants.exposed_at - *began) < rest_s;
      for (const LabelledMarker& marker : labels.markers) {
        const Eigen::Vector3d nowhere = Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
        (rests ? takes.at_rest : takes.moving)
            .places_m.push_back(marker.state == LabelState::Measured ? marker.position.v : nowhere);
      }
    }
  }
  return takes;
}

}  // namespace mocap::ctl
