#include "export/usd.h"

#include <fmt/format.h>

#include <cctype>
#include <iterator>
#include <string_view>
#include <utility>
#include <vector>

#include "base/expects.h"
#include "export/joint_motion.h"
#include "export/skinned_skeleton.h"

namespace mocap::exports {
namespace {

// A name as USD allows it for a prim.
std::string identifier(const std::string& name) {
  std::string made;
  for (const char c : name) {
    const bool allowed = c == '_' || (static_cast<unsigned char>(c) < 128 && std::isalnum(c) != 0);
    made += allowed ? c : '_';
  }
  const bool needs_prefix = made.empty() || std::isdigit(static_cast<unsigned char>(made.front())) != 0;
  return needs_prefix ? "_" + made : made;
}

std::vector<std::string> identifiers(std::vector<std::string> names) {
  for (std::string& name : names) {
    name = identifier(name);
  }
  return made_unique(std::move(names));
}

std::string in_quotes(std::string_view text) {
  std::string made = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') {
      made += '\\';
    }
    made += static_cast<unsigned char>(c) < ' ' ? ' ' : c;
  }
  return made + '"';
}

// Joins `element(i)` of 0 <= i < count with commas, in brackets.
template <class Element>
std::string list(std::size_t count, Element element) {
  std::string made = "[";
  for (std::size_t i = 0; i < count; ++i) {
    made += i > 0 ? ", " : "";
    made += element(i);
  }
  return made + "]";
}

template <class Vector>
std::string triple(const Vector& v) {
  return fmt::format("({}, {}, {})", static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z()));
}

std::string quaternion(const Eigen::Quaterniond& q) {
  const Eigen::Quaternionf single = q.cast<float>();
  return fmt::format("({}, {}, {}, {})", single.w(), single.x(), single.y(), single.z());
}

// A translation as USD writes matrices: for row vectors.
std::string translation(const Eigen::Vector3d& t) {
  return fmt::format("( (1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), ({}, {}, {}, 1) )", t.x(), t.y(), t.z());
}

// The path of each joint: the identifiers of its ancestors and its own, separated by "/".
std::vector<std::string> joint_paths(const SkinnedSkeleton& skeleton) {
  std::vector<std::string> names;
  for (const SkinnedBone& bone : skeleton.bones) {
    names.push_back(bone.unique_name);
  }
  std::vector<std::string> paths = identifiers(std::move(names));
  for (std::size_t b = 0; b < paths.size(); ++b) {
    const int parent = skeleton.bones[b].parent;
    paths[b] = parent < 0 ? paths[b] : paths[static_cast<std::size_t>(parent)] + "/" + paths[b];
  }
  return paths;
}

class UsdWriter {
 public:
  std::string write(const Clip& clip, BoneNames names) {
    add_layer(clip);
    add("def Xform \"Take\"\n{{\n");
    std::vector<std::string> prims;
    for (std::size_t s = 0; s < clip.subjects.size(); ++s) {
      prims.push_back(skinned_skeleton(clip, s, names).name);
    }
    prims = identifiers(std::move(prims));
    for (std::size_t s = 0; s < clip.subjects.size(); ++s) {
      const SkinnedSkeleton skeleton = skinned_skeleton(clip, s, names);
      add_subject(prims[s], skeleton, JointMotion(clip, s, skeleton));
    }
    add("}}\n");
    return std::move(text_);
  }

 private:
  template <class... Values>
  void add(fmt::format_string<Values...> format, const Values&... values) {
    fmt::vformat_to(std::back_inserter(text_), format, fmt::make_format_args(values...));
  }

  void add_layer(const Clip& clip) {
    add("#usda 1.0\n(\n    customLayerData = {{\n        string take = {}\n        string producer = {}\n",
        in_quotes(clip.name), in_quotes(clip.producer));
    add("        int64 first_frame = {}\n        int64 rate_numerator = {}\n        int64 rate_denominator = {}\n    "
        "}}\n",
        clip.first_frame, clip.rate.numerator, clip.rate.denominator);
    add("    defaultPrim = \"Take\"\n    endTimeCode = {}\n    framesPerSecond = {}\n    metersPerUnit = 1\n",
        clip.frames - 1, clip.rate.hz());
    add("    startTimeCode = 0\n    timeCodesPerSecond = {}\n    upAxis = \"Y\"\n)\n\n", clip.rate.hz());
  }

  void add_subject(const std::string& prim, const SkinnedSkeleton& skeleton, const JointMotion& motion) {
    const std::string path = "/Take/" + prim;
    const std::vector<std::string> joints = joint_paths(skeleton);
    const std::string joint_list = list(joints.size(), [&](std::size_t b) { return in_quotes(joints[b]); });
    add("    def SkelRoot \"{}\" (\n        prepend apiSchemas = [\"SkelBindingAPI\"]\n    )\n    {{\n", prim);
    add("        custom string subject = {}\n\n", in_quotes(skeleton.name));
    add_skeleton(path, skeleton, joint_list);
    add_mesh(prim, skeleton);
    add_motion(motion, joint_list);
    add("    }}\n\n");
  }

  void add_skeleton(const std::string& path, const SkinnedSkeleton& skeleton, const std::string& joint_list) {
    const std::vector<SkinnedBone>& bones = skeleton.bones;
    add("        def Skeleton \"Skeleton\" (\n            prepend apiSchemas = [\"SkelBindingAPI\"]\n        )\n       "
        " {{\n");
    add("            uniform token[] joints = {}\n", joint_list);
    add("            uniform token[] jointNames = {}\n",
        list(bones.size(), [&](std::size_t b) { return in_quotes(bones[b].name); }));
    add("            uniform matrix4d[] bindTransforms = {}\n",
        list(bones.size(), [&](std::size_t b) { return translation(bones[b].bind_m); }));
    add("            uniform matrix4d[] restTransforms = {}\n",
        list(bones.size(), [&](std::size_t b) { return translation(bones[b].offset_m); }));
    add("            rel skel:animationSource = <{}/Motion>\n        }}\n\n", path);
  }

  void add_mesh(const std::string& prim, const SkinnedSkeleton& skeleton) {
    const StickMesh& mesh = skeleton.mesh;
    const std::size_t points = mesh.points_m.size();
    Eigen::Vector3f low = mesh.points_m.front();
    Eigen::Vector3f high = low;
    for (const Eigen::Vector3f& point : mesh.points_m) {
      low = low.cwiseMin(point);
      high = high.cwiseMax(point);
    }
    add("        def Mesh \"{}_mesh\" (\n            prepend apiSchemas = [\"SkelBindingAPI\"]\n        )\n        "
        "{{\n",
        prim);
    add("            float3[] extent = [{}, {}]\n", triple(low), triple(high));
    add("            int[] faceVertexCounts = {}\n",
        list(mesh.triangles.size(), [](std::size_t) { return std::string("3"); }));
    add("            int[] faceVertexIndices = {}\n", list(mesh.triangles.size(), [&](std::size_t t) {
          return fmt::format("{}", fmt::join(mesh.triangles[t], ", "));
        }));
    add("            point3f[] points = {}\n", list(points, [&](std::size_t p) { return triple(mesh.points_m[p]); }));
    add("            normal3f[] normals = {} (\n                interpolation = \"vertex\"\n            )\n",
        list(points, [&](std::size_t p) { return triple(mesh.normals[p]); }));
    add("            color3f[] primvars:displayColor = [(0.8, 0.8, 0.8)]\n");
    add_binding("int[] primvars:skel:jointIndices",
                list(points, [&](std::size_t p) { return std::to_string(mesh.bones[p]); }));
    add_binding("float[] primvars:skel:jointWeights", list(points, [](std::size_t) { return std::string("1"); }));
    add("            matrix4d primvars:skel:geomBindTransform = {}\n", translation(Eigen::Vector3d::Zero()));
    add("            rel skel:skeleton = </Take/{}/Skeleton>\n", prim);
    add("            uniform token subdivisionScheme = \"none\"\n        }}\n\n");
  }

  void add_binding(const char* attribute, const std::string& values) {
    add("            {} = {} (\n                elementSize = 1\n                interpolation = \"vertex\"\n          "
        "  )\n",
        attribute, values);
  }

  // Each sample has a line of its own, because some readers expect that.
  void add_motion(const JointMotion& motion, const std::string& joint_list) {
    const std::size_t bones = motion.bones();
    add("        def SkelAnimation \"Motion\"\n        {{\n            uniform token[] joints = {}\n", joint_list);
    add("            quatf[] rotations.timeSamples = {{\n");
    for (std::size_t f = 0; f < motion.frames(); ++f) {
      add("                {}: {},\n", f,
          list(bones, [&](std::size_t b) { return quaternion(motion.parent_from_bone(f, b).rotation); }));
    }
    add("            }}\n            half3[] scales = {}\n",
        list(bones, [](std::size_t) { return std::string("(1, 1, 1)"); }));
    add("            float3[] translations.timeSamples = {{\n");
    for (std::size_t f = 0; f < motion.frames(); ++f) {
      add("                {}: {},\n", f,
          list(bones, [&](std::size_t b) { return triple(motion.parent_from_bone(f, b).position); }));
    }
    add("            }}\n        }}\n");
  }

  std::string text_;
};

}  // namespace

std::string write_usd(const Clip& clip, BoneNames names) {
  MOCAP_EXPECTS(clip.frames > 0 && !clip.subjects.empty());
  return UsdWriter().write(clip, names);
}

}  // namespace mocap::exports
