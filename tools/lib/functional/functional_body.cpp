#include "lib/functional/functional_body.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "lib/functional/functional_joint.h"
#include "lib/functional/segment_motion.h"
#include "model/bounds.h"

namespace mocap::functional {
namespace {

constexpr double kTurnMargin_rad = std::numbers::pi / 6.0;
// The tree prefers the joint between nearer markers: 10 cm between markers cost as much as 5 mm of rms distance. Chosen
// by hand; not yet measured.
constexpr double kDistanceWeight = 0.05;
constexpr std::size_t kMinNameLetters = 2;
constexpr std::size_t kMaxFrames = 4000;

// A joint of the tree.
struct Edge {
  std::size_t parent = 0, child = 0;  // segments
  FunctionalJoint joint;              // `one`: the parent

  double cost_m() const { return joint.rms_m + kDistanceWeight * joint.apart_m; }
  Edge reversed() const {
    Edge other = *this;
    std::swap(other.parent, other.child);
    std::swap(other.joint.in_one_m, other.joint.in_other_m);
    return other;
  }
};

bodyfit::LabelledTake thinned(const bodyfit::LabelledTake& take) {
  const std::size_t step = (take.frames() + kMaxFrames - 1) / kMaxFrames;
  bodyfit::LabelledTake thin{take.markers, {}};
  for (std::size_t f = 0; f < take.frames(); f += step)
    thin.places_m.insert(thin.places_m.end(), take.frame(f).begin(), take.frame(f).end());
  return thin;
}

// The frame that shows most markers.
std::size_t choose_reference(const bodyfit::LabelledTake& take) {
  std::size_t fullest = 0;
  std::ptrdiff_t most = -1;
  for (std::size_t f = 0; f < take.frames(); ++f) {
    const auto seen =
        std::ranges::count_if(take.frame(f), [](const Eigen::Vector3d& place) { return place.allFinite(); });
    if (seen <= most) continue;
    most = seen;
    fullest = f;
  }
  return fullest;
}

// The segments and the tree of their joints, which grows from the segment with most markers by the joint that costs
// least (Prim's algorithm). A segment of two markers has no orientation before it has a joint.
class TreeSearch {
 public:
  TreeSearch(const bodyfit::LabelledTake& take, const SegmentSettings& settings)
      : take_(take), reference_(choose_reference(take)) {
    for (const Segment& segment : find_rigid_segments(take, settings))
      segments_.push_back(track_segment(take, segment, reference_));
  }

  // False if no segment has an orientation.
  bool run() {
    std::vector<std::size_t> outside;
    for (std::size_t s = 0; s < segments_.size(); ++s) outside.push_back(s);
    const auto markers = [&](std::size_t s) {
      return segments_[s].has_orientation() ? segments_[s].markers.size() : 0;
    };
    const auto first = std::ranges::max_element(outside, {}, markers);
    if (first == outside.end() || markers(*first) == 0) return false;
    std::size_t added = *first;
    while (std::erase(outside, added) > 0) {
      if (segments_[added].has_orientation()) {
        for (const std::size_t s : outside) add_edge(added, s);
      }
      const auto best = std::ranges::min_element(edges_, {}, &Edge::cost_m);
      if (best == edges_.end()) break;  // the others are never seen together with these
      added = take_edge(*best);
    }
    return true;
  }

  const std::vector<SegmentMotion>& segments() const noexcept { return segments_; }
  const std::vector<Edge>& tree() const noexcept { return tree_; }

 private:
  void add_edge(std::size_t from, std::size_t to) {
    const auto joint = segments_[to].has_orientation() ? find_joint(take_, segments_[from], segments_[to])
                                                       : find_joint_of_points(take_, segments_[from], segments_[to]);
    if (joint) edges_.push_back({from, to, *joint});
  }

  std::size_t take_edge(Edge edge) {
    SegmentMotion& child = segments_[edge.child];
    if (!child.has_orientation()) {
      child = track_segment(take_, child.markers, reference_, joint_places(edge));
      edge.joint.in_other_m = child.joint_m;
    }
    tree_.push_back(edge);
    std::erase_if(edges_, [&](const Edge& other) { return other.child == edge.child; });
    return edge.child;
  }

  // In the world, by frame.
  std::vector<Eigen::Vector3d> joint_places(const Edge& edge) const {
    std::vector<Eigen::Vector3d> places_m;
    for (const std::optional<Pose>& parent : segments_[edge.parent].world_from_segment) {
      places_m.push_back(parent ? Eigen::Vector3d(*parent * edge.joint.in_one_m)
                                : Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN()));
    }
    return places_m;
  }

  const bodyfit::LabelledTake& take_;
  std::size_t reference_;
  std::vector<SegmentMotion> segments_;
  std::vector<Edge> edges_;  // from the tree to the segments outside
  std::vector<Edge> tree_;
};

// The edges from the root outwards, each with its parent nearer to the root.
std::vector<Edge> rooted(std::vector<Edge> tree, std::size_t root) {
  std::vector<Edge> ordered;
  std::vector<std::size_t> reached{root};
  for (std::size_t next = 0; next < reached.size(); ++next) {
    for (auto edge = tree.begin(); edge != tree.end();) {
      const bool is_parent = edge->parent == reached[next], is_child = edge->child == reached[next];
      if (!is_parent && !is_child) {
        ++edge;
        continue;
      }
      ordered.push_back(is_parent ? *edge : edge->reversed());
      reached.push_back(ordered.back().child);
      edge = tree.erase(edge);
    }
  }
  return ordered;
}

// The segment with orientation from which the markers of all others are fewest joints away.
std::size_t middle_of(const std::vector<Edge>& tree, const std::vector<SegmentMotion>& segments) {
  std::size_t middle = 0, fewest = std::numeric_limits<std::size_t>::max();
  for (std::size_t root = 0; root < segments.size(); ++root) {
    if (!segments[root].has_orientation()) continue;
    std::vector<std::size_t> depth(segments.size());
    std::size_t sum = 0;
    for (const Edge& edge : rooted(tree, root)) {
      depth[edge.child] = depth[edge.parent] + 1;
      sum += depth[edge.child] * segments[edge.child].markers.size();
    }
    if (sum >= fewest) continue;
    fewest = sum;
    middle = root;
  }
  return middle;
}

std::string common_start(const std::vector<std::string>& names) {
  std::string common = names.front();
  for (const std::string& name : names)
    common.resize(static_cast<std::size_t>(std::ranges::mismatch(common, name).in1 - common.begin()));
  return common;
}

std::string common_end(std::vector<std::string> names) {
  for (std::string& name : names) std::ranges::reverse(name);
  std::string common = common_start(names);
  std::ranges::reverse(common);
  return common;
}

// A name that no bone has yet.
std::string bone_name(const Segment& segment, const std::vector<std::string>& labels, const std::vector<Bone>& taken) {
  std::vector<std::string> names;
  for (const std::size_t m : segment) names.push_back(labels[m]);
  std::string name = common_start(names);
  if (name.size() < kMinNameLetters) name = common_end(names);
  if (name.size() < kMinNameLetters) name = names.front();
  const auto is_taken = [&](const std::string& wanted) {
    return std::ranges::find(taken, wanted, &Bone::name) != taken.end();
  };
  std::string free = name;
  for (int number = 2; is_taken(free); ++number) free = fmt::format("{}{}", name, number);
  return free;
}

// Builds the marker set from the tree, bone by bone.
class BodyBuilder {
 public:
  BodyBuilder(const bodyfit::LabelledTake& take, const std::vector<SegmentMotion>& segments,
              const std::vector<std::string>& labels)
      : take_(take),
        segments_(segments),
        labels_(labels),
        bone_of_(segments.size(), -1),
        joint_m_(segments.size(), Eigen::Vector3d::Zero()) {}

  void add_root(std::size_t segment) {
    Bone root;
    root.rotation_limits.fill(AngleRange{});
    add(segment, std::move(root), segments_[segment].shape_m);
  }

  // The parent is there already.
  void add_joint(const Edge& edge) {
    const SegmentMotion& parent = segments_[edge.parent];
    const SegmentMotion& child = segments_[edge.child];
    Bone bone;
    bone.parent = bone_of_[edge.parent];
    bone.rest_offset_m = edge.joint.in_one_m - joint_m_[edge.parent];
    bone.rotation_limits.fill(AngleRange{});
    FoundJoint found{.parent = body_.marker_set.skeleton.bones[static_cast<std::size_t>(bone.parent)].name,
                     .rms_m = edge.joint.rms_m};
    if (child.has_orientation()) {
      const JointRotation turned = measure_rotation(parent, child);
      for (int axis = 0; axis < 3; ++axis) {
        bone.rotation_limits[static_cast<std::size_t>(axis)] =
            AngleRange{std::max(-std::numbers::pi, turned.least_rad[axis] - kTurnMargin_rad),
                       std::min(std::numbers::pi, turned.most_rad[axis] + kTurnMargin_rad)};
      }
      found.hinge_axis = turned.hinge_axis;
      found.hinge_range_rad = turned.hinge_range_rad;
      joint_m_[edge.child] = edge.joint.in_other_m;
      add(edge.child, std::move(bone), child.shape_m);
    } else {
      joint_m_[edge.child] = edge.joint.in_one_m;
      add(edge.child, std::move(bone), places_in(parent, child.markers));
    }
    found.bone = body_.marker_set.skeleton.bones.back().name;
    body_.joints.push_back(std::move(found));
  }

  FunctionalBody finish(const std::string& name) && {
    body_.marker_set.name = body_.marker_set.skeleton.name = name;
    return std::move(body_);
  }

 private:
  // `places_m`: of the segment's markers, in the frame of the joint.
  void add(std::size_t segment, Bone bone, const std::vector<Eigen::Vector3d>& places_m) {
    Skeleton& skeleton = body_.marker_set.skeleton;
    const Segment& markers = segments_[segment].markers;
    bone.name = bone_name(markers, labels_, skeleton.bones);
    bone_of_[segment] = static_cast<int>(skeleton.bones.size());
    skeleton.bones.push_back(std::move(bone));
    for (std::size_t i = 0; i < markers.size(); ++i) {
      const Eigen::Vector3d offset_m = places_m[i] - joint_m_[segment];
      if (offset_m.allFinite()) body_.marker_set.markers.push_back({labels_[markers[i]], bone_of_[segment], offset_m});
    }
  }

  // The places of markers in the frame of a segment, in the first frame that shows most of them.
  std::vector<Eigen::Vector3d> places_in(const SegmentMotion& segment, const Segment& markers) const {
    std::vector<Eigen::Vector3d> places_m;
    std::size_t most = 0;
    for (std::size_t f = 0; f < take_.frames(); ++f) {
      if (!segment.world_from_segment[f]) continue;
      const auto there = [&](std::size_t m) { return take_.frame(f)[m].allFinite(); };
      const auto seen = static_cast<std::size_t>(std::ranges::count_if(markers, there));
      if (seen <= most) continue;
      most = seen;
      places_m.clear();
      for (const std::size_t m : markers)
        places_m.push_back(segment.world_from_segment[f]->inverse() * take_.frame(f)[m]);
    }
    return places_m;
  }

  const bodyfit::LabelledTake& take_;
  const std::vector<SegmentMotion>& segments_;
  const std::vector<std::string>& labels_;
  std::vector<int> bone_of_;              // by segment
  std::vector<Eigen::Vector3d> joint_m_;  // by segment: its joint with the parent, in its frame
  FunctionalBody body_;
};

}  // namespace

Result<FunctionalBody> find_body(const bodyfit::LabelledTake& take, const std::vector<std::string>& labels,
                                 const std::string& name, const SegmentSettings& settings) {
  if (take.markers > kMaxLabels) {
    return Error{ErrorCode::InvalidArgument, fmt::format("{} markers, expected at most {}", take.markers, kMaxLabels)};
  }
  const bodyfit::LabelledTake used = thinned(take);
  TreeSearch search(used, settings);
  if (!search.run()) {
    return Error{ErrorCode::InvalidArgument,
                 "no three markers keep their distances while the others move, so that no bone is found; record some "
                 "seconds in which every joint bends, or write a marker set by hand"};
  }
  const std::vector<SegmentMotion>& segments = search.segments();
  const std::size_t root = middle_of(search.tree(), segments);
  BodyBuilder builder(used, segments, labels);
  builder.add_root(root);
  for (const Edge& edge : rooted(search.tree(), root)) builder.add_joint(edge);
  return std::move(builder).finish(name);
}

}  // namespace mocap::functional
