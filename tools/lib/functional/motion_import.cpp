#include "lib/functional/motion_import.h"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <utility>

namespace mocap::functional {
namespace {

// The markers of a file by name, without those that occur twice or are never there.
scene::ImportedMarkerSet list_markers(const scene::C3d& c3d) {
  scene::ImportedMarkerSet listed;
  const auto kinds = scene::kinds_of(c3d.labels);
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    listed.ghosts += kinds[i] == scene::C3dPointKind::Ghost ? 1 : 0;
    listed.model_outputs += kinds[i] == scene::C3dPointKind::ModelOutput ? 1 : 0;
    if (kinds[i] != scene::C3dPointKind::Marker) continue;
    const std::string label(scene::without_subject(c3d.labels[i]));
    if (std::ranges::find(listed.marker_set.markers, label, &MarkerOnBone::name) != listed.marker_set.markers.end()) {
      listed.twice.push_back(c3d.labels[i]);
    } else if (!scene::ever_there(c3d, i)) {
      ++listed.never_seen;
    } else {
      listed.marker_set.markers.push_back({label, 0, Eigen::Vector3d::Zero(), {}});
    }
  }
  return listed;
}

}  // namespace

bool has_own_labels(const scene::C3d& c3d) {
  const auto kinds = scene::kinds_of(c3d.labels);
  std::size_t markers = 0, known = 0;
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    if (kinds[i] != scene::C3dPointKind::Marker) continue;
    ++markers;
    known += scene::known_marker(scene::without_subject(c3d.labels[i])) ? 1 : 0;
  }
  return 2 * known < markers;
}

Result<MotionImport> import_by_motion(const scene::C3d& c3d, const std::string& name) {
  MotionImport import{.imported = list_markers(c3d)};
  MarkerSet& set = import.imported.marker_set;
  std::vector<std::string> labels;
  for (const MarkerOnBone& marker : set.markers) labels.push_back(marker.name);
  auto body = find_body(scene::take_of(c3d, set), labels, name);
  if (!body) return body.error();
  set = std::move(body->marker_set);
  import.joints = std::move(body->joints);
  std::ranges::copy_if(labels, std::back_inserter(import.left_out), [&](const std::string& label) {
    return std::ranges::find(set.markers, label, &MarkerOnBone::name) == set.markers.end();
  });
  return import;
}

}  // namespace mocap::functional
