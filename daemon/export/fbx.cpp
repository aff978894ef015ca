#include "export/fbx.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include "base/expects.h"
#include "export/euler_angles.h"
#include "export/fbx_document.h"
#include "export/fbx_node.h"
#include "export/fbx_scene.h"
#include "export/joint_motion.h"
#include "export/skinned_skeleton.h"

namespace mocap::exports {
namespace {

using Id = FbxScene::Id;

constexpr double kCentimetresPerMetre = 100.0;

// Versions of the records that Autodesk writes in files of version 7.4.
constexpr std::int32_t kModelVersion = 232;
constexpr std::int32_t kGeometryVersion = 124;
constexpr std::int32_t kSkinVersion = 101;
constexpr std::int32_t kClusterVersion = 100;
constexpr std::int32_t kPoseVersion = 100;
constexpr std::int32_t kMaterialVersion = 102;
constexpr std::int32_t kLayerElementVersion = 101;
constexpr std::int32_t kKeyVersion = 4008;

template <class Value>
std::span<const Value> all(const std::vector<Value>& values) {
  return values;
}

template <class Value>
FbxNode field(std::string_view name, const Value& value) {
  FbxNode node(name);
  node.add(value);
  return node;
}

// A translation as FBX writes matrices: by column.
std::vector<double> translation_cm(const Eigen::Vector3d& t_m) {
  const Eigen::Vector3d t = kCentimetresPerMetre * t_m;
  return {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, t.x(), t.y(), t.z(), 1};
}

FbxNode layer_element(std::string_view type, std::string_view mapping, std::string_view reference) {
  FbxNode node(type);
  node.add(0).field("Version", kLayerElementVersion).field("Name", "");
  node.field("MappingInformationType", mapping).field("ReferenceInformationType", reference);
  return node;
}

FbxNode layer() {
  FbxNode node("Layer");
  node.add(0).field("Version", 100);
  for (const std::string_view type : {"LayerElementNormal", "LayerElementMaterial"}) {
    node.child(FbxNode("LayerElement")).field("Type", type).field("TypedIndex", 0);
  }
  return node;
}

// Vertices, polygons and normals. The last corner of a polygon has its index inverted.
std::vector<FbxNode> geometry(const StickMesh& mesh) {
  std::vector<double> vertices;
  for (const Eigen::Vector3f& point : mesh.points_m) {
    const Eigen::Vector3d p = kCentimetresPerMetre * point.cast<double>();
    vertices.insert(vertices.end(), {p.x(), p.y(), p.z()});
  }
  std::vector<std::int32_t> corners;
  std::vector<double> normals;
  for (const auto& triangle : mesh.triangles) {
    for (const std::uint32_t corner : triangle) {
      const Eigen::Vector3d n = mesh.normals[corner].cast<double>();
      normals.insert(normals.end(), {n.x(), n.y(), n.z()});
      corners.push_back(static_cast<std::int32_t>(corner));
    }
    corners.back() = ~corners.back();
  }
  FbxNode normal = layer_element("LayerElementNormal", "ByPolygonVertex", "Direct");
  normal.field("Normals", all(normals));
  FbxNode material = layer_element("LayerElementMaterial", "AllSame", "IndexToDirect");
  material.field("Materials", all(std::vector<std::int32_t>{0}));
  return {FbxNode("Properties70"),
          field("GeometryVersion", kGeometryVersion),
          field("Vertices", all(vertices)),
          field("PolygonVertexIndex", all(corners)),
          std::move(normal),
          std::move(material),
          layer()};
}

// Content of a Model without rotation and scale.
std::vector<FbxNode> model(const Eigen::Vector3d& offset_m) {
  const Eigen::Vector3d offset = kCentimetresPerMetre * offset_m;
  return {field("Version", kModelVersion),
          FbxProperties()
              .enumeration("RotationOrder", 0)
              .enumeration("InheritType", 1)
              .local("Lcl Translation", offset.x(), offset.y(), offset.z())
              .local("Lcl Rotation", 0.0, 0.0, 0.0)
              .local("Lcl Scaling", 1.0, 1.0, 1.0)
              .node(),
          field("Shading", true), field("Culling", "CullingOff")};
}

// The curves of one property of one bone: values by frame in the unit of the file.
struct Curves {
  const char* name;      // of the curve node
  const char* property;  // of the model
  std::vector<std::array<float, 3>> values;
};

class FbxWriter {
 public:
  explicit FbxWriter(const Clip& clip) : clip_(clip) {
    for (std::size_t f = 0; f < clip.frames; ++f) {
      times_.push_back(fbx_ticks(clip.rate, f));
    }
  }

  std::vector<FbxNode> write(BoneNames names) {
    add_stack();
    material_ = scene_.add({"Material", "Material", ""}, "Sticks",
                           {field("Version", kMaterialVersion), field("ShadingModel", "lambert"),
                            field("MultiLayer", 0), FbxProperties().colour("DiffuseColor", 0.8, 0.8, 0.8).node()});
    for (std::size_t s = 0; s < clip_.subjects.size(); ++s) {
      const SkinnedSkeleton skeleton = skinned_skeleton(clip_, s, names);
      const Id holder = add_holder(skeleton);
      const std::vector<Id> bones = add_bones(skeleton, holder);
      const Id mesh = add_mesh(skeleton, bones);
      add_bind_pose(skeleton, holder, mesh, bones);
      add_motion(JointMotion(clip_, s, skeleton), bones);
    }
    std::vector<FbxNode> records{fbx_header(clip_)};
    records.push_back(FbxNode("FileId").add_raw(fbx_file_id()));
    records.push_back(field("CreationTime", kFbxCreationTime));
    records.push_back(field("Creator", clip_.producer));
    records.push_back(fbx_global_settings(clip_));
    records.push_back(fbx_documents(clip_));
    records.emplace_back("References");
    for (FbxNode& record : std::move(scene_).records()) {
      records.push_back(std::move(record));
    }
    records.push_back(fbx_takes(clip_));
    return records;
  }

 private:
  void add_stack() {
    const std::int64_t end = times_.back();
    const Id stack = scene_.add({"AnimationStack", "AnimStack", ""}, clip_.name,
                                {FbxProperties()
                                     .time("LocalStart", 0)
                                     .time("LocalStop", end)
                                     .time("ReferenceStart", 0)
                                     .time("ReferenceStop", end)
                                     .node()});
    layer_ = scene_.add({"AnimationLayer", "AnimLayer", ""}, "BaseLayer", {FbxNode("Properties70")});
    scene_.connect(layer_, stack);
  }

  // The parent of a subject's root.
  Id add_holder(const SkinnedSkeleton& skeleton) {
    if (clip_.subjects.size() == 1) {
      return FbxScene::kRoot;
    }
    const Id attribute =
        scene_.add({"NodeAttribute", "NodeAttribute", "Null"}, skeleton.name, {field("TypeFlags", "Null")});
    const Id holder = scene_.add({"Model", "Model", "Null"}, skeleton.name, model(Eigen::Vector3d::Zero()));
    scene_.connect(attribute, holder);
    scene_.connect(holder, FbxScene::kRoot);
    return holder;
  }

  std::vector<Id> add_bones(const SkinnedSkeleton& skeleton, Id holder) {
    std::vector<Id> ids;
    for (const SkinnedBone& bone : skeleton.bones) {
      const std::string& name = bone.unique_name;
      const Id attribute = scene_.add({"NodeAttribute", "NodeAttribute", "LimbNode"}, name,
                                      {FbxProperties().number("Size", 1.0).node(), field("TypeFlags", "Skeleton")});
      const Id id = scene_.add({"Model", "Model", "LimbNode"}, name, model(bone.offset_m));
      scene_.connect(attribute, id);
      scene_.connect(id, bone.parent < 0 ? holder : ids[static_cast<std::size_t>(bone.parent)]);
      ids.push_back(id);
    }
    return ids;
  }

  // Returns the id of the model.
  Id add_mesh(const SkinnedSkeleton& skeleton, const std::vector<Id>& bones) {
    const std::string name = skeleton.name + "_mesh";
    const Id shape = scene_.add({"Geometry", "Geometry", "Mesh"}, name, geometry(skeleton.mesh));
    const Id id = scene_.add({"Model", "Model", "Mesh"}, name, model(Eigen::Vector3d::Zero()));
    const Id skin = scene_.add({"Deformer", "Deformer", "Skin"}, name,
                               {field("Version", kSkinVersion), field("Link_DeformAcuracy", 50.0)});
    scene_.connect(id, FbxScene::kRoot);
    scene_.connect(shape, id);
    scene_.connect(material_, id);
    scene_.connect(skin, shape);
    for (std::size_t b = 0; b < bones.size(); ++b) {
      const Id cluster = add_cluster(skeleton, b);
      scene_.connect(cluster, skin);
      scene_.connect(bones[b], cluster);
    }
    return id;
  }

  // `Transform` is the mesh in the frame of the bone, `TransformLink` the bone in the world, both in bind pose.
  Id add_cluster(const SkinnedSkeleton& skeleton, std::size_t bone) {
    const SkinnedBone& its = skeleton.bones[bone];
    std::vector<std::int32_t> points;
    for (std::size_t p = 0; p < skeleton.mesh.bones.size(); ++p) {
      if (skeleton.mesh.bones[p] == static_cast<int>(bone)) {
        points.push_back(static_cast<std::int32_t>(p));
      }
    }
    FbxNode user_data("UserData");
    user_data.add("").add("");
    std::vector<FbxNode> content{field("Version", kClusterVersion), std::move(user_data)};
    if (!points.empty()) {
      content.push_back(field("Indexes", all(points)));
      content.push_back(field("Weights", all(std::vector<double>(points.size(), 1.0))));
    }
    content.push_back(field("Transform", all(translation_cm(-its.bind_m))));
    content.push_back(field("TransformLink", all(translation_cm(its.bind_m))));
    return scene_.add({"Deformer", "SubDeformer", "Cluster"}, its.unique_name, std::move(content));
  }

  // A bind pose is valid if it has the mesh, its bones and all their ancestors.
  void add_bind_pose(const SkinnedSkeleton& skeleton, Id holder, Id mesh, const std::vector<Id>& bones) {
    std::vector<FbxNode> nodes;
    const auto add = [&](Id id, const Eigen::Vector3d& bind_m) {
      FbxNode node("PoseNode");
      node.field("Node", id).field("Matrix", all(translation_cm(bind_m)));
      nodes.push_back(std::move(node));
    };
    add(mesh, Eigen::Vector3d::Zero());
    if (holder != FbxScene::kRoot) {
      add(holder, Eigen::Vector3d::Zero());
    }
    for (std::size_t b = 0; b < bones.size(); ++b) {
      add(bones[b], skeleton.bones[b].bind_m);
    }
    std::vector<FbxNode> content{field("Type", "BindPose"), field("Version", kPoseVersion),
                                 field("NbPoseNodes", static_cast<std::int32_t>(nodes.size()))};
    std::ranges::move(nodes, std::back_inserter(content));
    scene_.add({"Pose", "Pose", "BindPose"}, skeleton.name, std::move(content));
  }

  void add_motion(const JointMotion& motion, const std::vector<Id>& bones) {
    for (std::size_t b = 0; b < bones.size(); ++b) {
      Curves rotation{"R", "Lcl Rotation", {}};
      Curves translation{"T", "Lcl Translation", {}};
      Eigen::Vector3d angles_rad = Eigen::Vector3d::Zero();  // about z, y, x
      for (std::size_t f = 0; f < motion.frames(); ++f) {
        const Pose& pose = motion.parent_from_bone(f, b);
        angles_rad = euler_angles(pose.rotation, kZyx, angles_rad);
        const Eigen::Vector3f degrees = (angles_rad * (180.0 / std::numbers::pi)).cast<float>();
        const Eigen::Vector3f cm = (kCentimetresPerMetre * pose.position).cast<float>();
        rotation.values.push_back({degrees[2], degrees[1], degrees[0]});
        translation.values.push_back({cm[0], cm[1], cm[2]});
      }
      add_curves(rotation, bones[b]);
      if (motion.translates(b)) {
        add_curves(translation, bones[b]);
      }
    }
  }

  void add_curves(const Curves& curves, Id model) {
    constexpr std::array<const char*, 3> kComponents{"d|X", "d|Y", "d|Z"};
    const std::array<float, 3>& first = curves.values.front();
    FbxProperties defaults;
    for (std::size_t i = 0; i < 3; ++i) {
      defaults.animated_number(kComponents[i], static_cast<double>(first[i]));
    }
    const Id node = scene_.add({"AnimationCurveNode", "AnimCurveNode", ""}, curves.name, {defaults.node()});
    scene_.connect(node, layer_);
    scene_.connect(node, model, curves.property);
    for (std::size_t i = 0; i < 3; ++i) {
      std::vector<float> values;
      for (const std::array<float, 3>& value : curves.values) {
        values.push_back(value[i]);
      }
      scene_.connect(add_curve(values), node, kComponents[i]);
    }
  }

  // One set of attributes serves all keys: linear interpolation.
  Id add_curve(const std::vector<float>& values) {
    constexpr std::int32_t kLinear = 4;
    return scene_.add(
        {"AnimationCurve", "AnimCurve", ""}, "",
        {field("Default", static_cast<double>(values.front())), field("KeyVer", kKeyVersion),
         field("KeyTime", all(times_)), field("KeyValueFloat", all(values)),
         field("KeyAttrFlags", all(std::vector<std::int32_t>{kLinear})),
         field("KeyAttrDataFloat", all(std::vector<float>(4, 0.0F))),
         field("KeyAttrRefCount", all(std::vector<std::int32_t>{static_cast<std::int32_t>(values.size())}))});
  }

  const Clip& clip_;
  std::vector<std::int64_t> times_;  // of each frame, ticks
  FbxScene scene_;
  Id layer_ = 0;
  Id material_ = 0;
};

}  // namespace

Result<std::string> write_fbx(const Clip& clip, BoneNames names) {
  MOCAP_EXPECTS(clip.frames > 0 && !clip.subjects.empty());
  const std::vector<FbxNode> records = FbxWriter(clip).write(names);
  std::size_t bytes = 1024;  // header and footer
  for (const FbxNode& record : records) {
    bytes += record.size_bound();
  }
  if (bytes > std::numeric_limits<std::uint32_t>::max()) {
    return Error{
        ErrorCode::Unsupported,
        fmt::format("take '{}': the FBX file would have {} bytes, expected at most 4294967295: export a shorter "
                    "range or one subject",
                    clip.name, bytes)};
  }
  return fbx_file(records);
}

}  // namespace mocap::exports
