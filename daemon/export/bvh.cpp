#include "export/bvh.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <numbers>
#include <vector>

#include "base/expects.h"
#include "export/euler_angles.h"
#include "export/joint_motion.h"
#include "export/skinned_skeleton.h"

namespace mocap::exports {
namespace {

// A name ends at a space in BVH.
std::string word(std::string name) {
  std::ranges::replace_if(
      name, [](unsigned char c) { return c <= ' '; }, '_');
  return name;
}

class BvhWriter {
 public:
  BvhWriter(const SkinnedSkeleton& skeleton, double units_per_m) : skeleton_(skeleton), units_per_m_(units_per_m) {}

  std::string write(const JointMotion& motion, const Rate& rate) {
    text_ = "HIERARCHY\n";
    add_bone(0, "");
    add("MOTION\nFrames: {}\nFrame Time: {:.12f}\n", motion.frames(), rate.time_s(1));
    std::vector<Eigen::Vector3d> angles_rad(motion.bones(), Eigen::Vector3d::Zero());
    for (std::size_t f = 0; f < motion.frames(); ++f) {
      add_frame(motion, f, angles_rad);
    }
    return std::move(text_);
  }

 private:
  template <class... Values>
  void add(fmt::format_string<Values...> format, const Values&... values) {
    fmt::vformat_to(std::back_inserter(text_), format, fmt::make_format_args(values...));
  }

  void add_offset(const Eigen::Vector3d& offset_m, const std::string& indent) {
    const Eigen::Vector3d offset = units_per_m_ * offset_m;
    add("{}OFFSET {:.6f} {:.6f} {:.6f}\n", indent, offset.x(), offset.y(), offset.z());
  }

  // Writes a bone and, nested, its children. The channels of a frame follow the same order, which `order_` holds.
  void add_bone(std::size_t bone, const std::string& indent) {
    const SkinnedBone& its = skeleton_.bones[bone];
    const bool is_root = its.parent < 0;
    const std::string inner = indent + "\t";
    order_.push_back(bone);
    add("{0}{1} {2}\n{0}{{\n", indent, is_root ? "ROOT" : "JOINT", word(its.name));
    add_offset(is_root ? Eigen::Vector3d(Eigen::Vector3d::Zero()) : its.offset_m, inner);
    add("{}CHANNELS {}Zrotation Xrotation Yrotation\n", inner, is_root ? "6 Xposition Yposition Zposition " : "3 ");
    for (std::size_t child = bone + 1; child < skeleton_.bones.size(); ++child) {
      if (skeleton_.bones[child].parent == static_cast<int>(bone)) {
        add_bone(child, inner);
      }
    }
    if (its.end_m) {
      add("{0}End Site\n{0}{{\n", inner);
      add_offset(*its.end_m, inner + "\t");
      add("{}}}\n", inner);
    }
    add("{}}}\n", indent);
  }

  // `angles_rad` are those of the previous frame, and then of this frame.
  void add_frame(const JointMotion& motion, std::size_t frame, std::vector<Eigen::Vector3d>& angles_rad) {
    const Eigen::Vector3d root = units_per_m_ * motion.parent_from_bone(frame, 0).position;
    add("{:.6f} {:.6f} {:.6f}", root.x(), root.y(), root.z());
    for (const std::size_t bone : order_) {
      Eigen::Vector3d& angles = angles_rad[bone];
      angles = euler_angles(motion.parent_from_bone(frame, bone).rotation, kZxy, angles);
      const Eigen::Vector3d degrees = angles * (180.0 / std::numbers::pi);
      add(" {:.6f} {:.6f} {:.6f}", degrees[0], degrees[1], degrees[2]);
    }
    text_ += '\n';
  }

  const SkinnedSkeleton& skeleton_;
  double units_per_m_;
  std::vector<std::size_t> order_;
  std::string text_;
};

}  // namespace

std::string write_bvh(const Clip& clip, std::size_t subject, const BvhSettings& settings) {
  MOCAP_EXPECTS(clip.frames > 0 && settings.units_per_m > 0.0);
  const SkinnedSkeleton skeleton = skinned_skeleton(clip, subject, settings.names);
  return BvhWriter(skeleton, settings.units_per_m).write(JointMotion(clip, subject, skeleton), clip.rate);
}

}  // namespace mocap::exports
