#include "export/gltf.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "base/expects.h"
#include "export/joint_motion.h"
#include "export/skinned_skeleton.h"

namespace mocap::exports {
namespace {

static_assert(std::endian::native == std::endian::little, "glTF and this writer are little-endian");

using Json = nlohmann::ordered_json;

// Constants of the specification.
constexpr int kUnsignedByte = 5121;
constexpr int kUnsignedShort = 5123;
constexpr int kUnsignedInt = 5125;
constexpr int kFloat = 5126;
constexpr int kArrayBuffer = 34962;
constexpr int kElementArrayBuffer = 34963;
constexpr int kNoTarget = 0;
constexpr std::uint32_t kMagic = 0x46546C67;      // glTF
constexpr std::uint32_t kJsonChunk = 0x4E4F534A;  // JSON
constexpr std::uint32_t kBinaryChunk = 0x004E4942;

Json numbers(const Eigen::Vector3d& v) { return Json::array({v.x(), v.y(), v.z()}); }

void add_word(std::string& bytes, std::uint32_t value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

void pad(std::string& bytes, char with) { bytes.append((4 - bytes.size() % 4) % 4, with); }

// The layout of an accessor: components of one element, and whether the file states minimum and maximum.
struct Layout {
  const char* type = "SCALAR";
  int target = kNoTarget;
  bool has_range = false;
};

std::size_t components(const Layout& layout) {
  const std::string_view type = layout.type;
  return type == "SCALAR" ? 1 : type == "VEC3" ? 3 : type == "VEC4" ? 4 : 16;
}

// The document and its one buffer.
class Document {
 public:
  Json json;

  // Adds data with its buffer view and accessor; returns the accessor's index.
  template <class Value>
  std::size_t add(std::span<const Value> values, int component_type, const Layout& layout) {
    const std::size_t width = components(layout);
    const std::size_t bytes = values.size_bytes();
    Json view{{"buffer", 0}, {"byteOffset", buffer_.size()}, {"byteLength", bytes}};
    if (layout.target != kNoTarget) {
      view["target"] = layout.target;
    }
    Json accessor{{"bufferView", size_of("bufferViews")},
                  {"componentType", component_type},
                  {"count", values.size() / width},
                  {"type", layout.type}};
    if (layout.has_range) {
      add_range(accessor, values, width);
    }
    buffer_.append(reinterpret_cast<const char*>(values.data()), bytes);
    pad(buffer_, '\0');
    json["bufferViews"].push_back(std::move(view));
    return push("accessors", std::move(accessor));
  }

  std::size_t push(const char* array, Json element) {
    json[array].push_back(std::move(element));
    return json[array].size() - 1;
  }

  std::size_t size_of(const char* array) const { return json.contains(array) ? json[array].size() : 0; }

  // The file: header, JSON chunk, binary chunk.
  std::string bytes() {
    json["buffers"] = Json::array({Json{{"byteLength", buffer_.size()}}});
    std::string text = json.dump(-1, ' ', false, Json::error_handler_t::replace);
    pad(text, ' ');
    std::string file;
    add_word(file, kMagic);
    add_word(file, 2);
    add_word(file, static_cast<std::uint32_t>(12 + 8 + text.size() + 8 + buffer_.size()));
    add_word(file, static_cast<std::uint32_t>(text.size()));
    add_word(file, kJsonChunk);
    file += text;
    add_word(file, static_cast<std::uint32_t>(buffer_.size()));
    add_word(file, kBinaryChunk);
    return file + buffer_;
  }

 private:
  template <class Value>
  static void add_range(Json& accessor, std::span<const Value> values, std::size_t width) {
    std::vector<Value> low(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(width));
    std::vector<Value> high = low;
    for (std::size_t i = 0; i < values.size(); ++i) {
      low[i % width] = std::min(low[i % width], values[i]);
      high[i % width] = std::max(high[i % width], values[i]);
    }
    accessor["min"] = low;
    accessor["max"] = high;
  }

  std::string buffer_;
};

std::vector<float> flat(const std::vector<Eigen::Vector3f>& vectors) {
  std::vector<float> values;
  for (const Eigen::Vector3f& v : vectors) {
    values.insert(values.end(), {v.x(), v.y(), v.z()});
  }
  return values;
}

template <class Value>
std::span<const Value> all_of(const std::vector<Value>& values) {
  return values;
}

// Adds the mesh; returns its index.
std::size_t add_mesh(Document& document, const SkinnedSkeleton& skeleton) {
  const StickMesh& mesh = skeleton.mesh;
  std::vector<std::uint32_t> indices;
  for (const auto& triangle : mesh.triangles) {
    indices.insert(indices.end(), triangle.begin(), triangle.end());
  }
  std::vector<std::uint16_t> joints;
  std::vector<float> weights;
  for (const int bone : mesh.bones) {
    joints.insert(joints.end(), {static_cast<std::uint16_t>(bone), 0, 0, 0});
    weights.insert(weights.end(), {1.0F, 0.0F, 0.0F, 0.0F});
  }
  const std::size_t positions =
      document.add(all_of(flat(mesh.points_m)), kFloat, {.type = "VEC3", .target = kArrayBuffer, .has_range = true});
  const std::size_t normals =
      document.add(all_of(flat(mesh.normals)), kFloat, {.type = "VEC3", .target = kArrayBuffer});
  const std::size_t joint_indices =
      document.add(all_of(joints), kUnsignedShort, {.type = "VEC4", .target = kArrayBuffer});
  const std::size_t joint_weights = document.add(all_of(weights), kFloat, {.type = "VEC4", .target = kArrayBuffer});
  const std::size_t triangles =
      document.add(all_of(indices), kUnsignedInt, {.type = "SCALAR", .target = kElementArrayBuffer});
  const Json primitive{
      {"attributes",
       {{"POSITION", positions}, {"NORMAL", normals}, {"JOINTS_0", joint_indices}, {"WEIGHTS_0", joint_weights}}},
      {"indices", triangles},
      {"material", 0}};
  return document.push("meshes", {{"name", skeleton.name}, {"primitives", Json::array({primitive})}});
}

// Adds the nodes of all_of bones in bind pose; returns the index of the root, after which the others follow in order.
std::size_t add_joints(Document& document, const SkinnedSkeleton& skeleton) {
  const std::size_t first = document.size_of("nodes");
  for (const SkinnedBone& bone : skeleton.bones) {
    document.push("nodes", {{"name", bone.name}, {"translation", numbers(bone.offset_m)}});
    if (bone.parent >= 0) {
      const std::size_t child = document.size_of("nodes") - 1;
      document.json["nodes"][first + static_cast<std::size_t>(bone.parent)]["children"].push_back(child);
    }
  }
  return first;
}

// Adds the skin of the joints that begin at node `first`; returns its index.
std::size_t add_skin(Document& document, const SkinnedSkeleton& skeleton, std::size_t first) {
  std::vector<float> inverse_binds;
  Json joints = Json::array();
  for (const SkinnedBone& bone : skeleton.bones) {
    Eigen::Matrix4f bone_from_world = Eigen::Matrix4f::Identity();
    bone_from_world.topRightCorner<3, 1>() = -bone.bind_m.cast<float>();
    inverse_binds.insert(inverse_binds.end(), bone_from_world.data(), bone_from_world.data() + 16);
    joints.push_back(first + joints.size());
  }
  const std::size_t accessor = document.add(all_of(inverse_binds), kFloat, {.type = "MAT4"});
  return document.push(
      "skins",
      {{"name", skeleton.name}, {"inverseBindMatrices", accessor}, {"skeleton", first}, {"joints", std::move(joints)}});
}

// Adds a sampler and its channel to the animation. `path` is a property of the node.
void add_channel(Json& animation, std::array<std::size_t, 2> input_and_output, std::size_t node, const char* path) {
  animation["channels"].push_back(
      {{"sampler", animation["samplers"].size()}, {"target", {{"node", node}, {"path", path}}}});
  animation["samplers"].push_back(
      {{"input", input_and_output[0]}, {"interpolation", "LINEAR"}, {"output", input_and_output[1]}});
}

void add_motion(Document& document, Json& animation, const JointMotion& motion, std::size_t times, std::size_t first) {
  for (std::size_t b = 0; b < motion.bones(); ++b) {
    std::vector<float> rotations;
    std::vector<float> translations;
    for (std::size_t f = 0; f < motion.frames(); ++f) {
      const Eigen::Vector4f q = motion.parent_from_bone(f, b).rotation.coeffs().cast<float>();  // x y z w
      const Eigen::Vector3f t = motion.parent_from_bone(f, b).position.cast<float>();
      rotations.insert(rotations.end(), {q[0], q[1], q[2], q[3]});
      translations.insert(translations.end(), {t[0], t[1], t[2]});
    }
    add_channel(animation, {times, document.add(all_of(rotations), kFloat, {.type = "VEC4"})}, first + b, "rotation");
    if (motion.translates(b)) {
      add_channel(animation, {times, document.add(all_of(translations), kFloat, {.type = "VEC3"})}, first + b,
                  "translation");
    }
  }
}

std::size_t add_times(Document& document, const Clip& clip) {
  std::vector<float> times_s;
  for (std::size_t f = 0; f < clip.frames; ++f) {
    times_s.push_back(static_cast<float>(clip.rate.time_s(static_cast<std::int64_t>(f))));
  }
  return document.add(all_of(times_s), kFloat, {.type = "SCALAR", .has_range = true});
}

Json scene_of(const Clip& clip, Json nodes) {
  return {{"name", clip.name},
          {"nodes", std::move(nodes)},
          {"extras",
           {{"rate_numerator", clip.rate.numerator},
            {"rate_denominator", clip.rate.denominator},
            {"first_frame", clip.first_frame}}}};
}

}  // namespace

Result<std::string> write_gltf(const Clip& clip, BoneNames names) {
  MOCAP_EXPECTS(clip.frames > 0 && !clip.subjects.empty());
  Document document;
  document.json["asset"] = {{"version", "2.0"}, {"generator", clip.producer}};
  document.json["scene"] = 0;
  document.push("materials",
                {{"name", "Sticks"},
                 {"pbrMetallicRoughness", {{"baseColorFactor", {0.8, 0.8, 0.8, 1.0}}, {"metallicFactor", 0.0}}}});
  const std::size_t times = add_times(document, clip);
  Json animation{{"name", clip.name}, {"channels", Json::array()}, {"samplers", Json::array()}};
  Json scene_nodes = Json::array();
  for (std::size_t s = 0; s < clip.subjects.size(); ++s) {
    const SkinnedSkeleton skeleton = skinned_skeleton(clip, s, names);
    const std::size_t root = add_joints(document, skeleton);
    scene_nodes.push_back(document.push("nodes", {{"name", skeleton.name}, {"children", Json::array({root})}}));
    const std::size_t mesh = add_mesh(document, skeleton);
    const std::size_t skin = add_skin(document, skeleton, root);
    scene_nodes.push_back(document.push("nodes", {{"name", skeleton.name + "_mesh"}, {"mesh", mesh}, {"skin", skin}}));
    add_motion(document, animation, JointMotion(clip, s, skeleton), times, root);
  }
  document.push("animations", std::move(animation));
  document.push("scenes", scene_of(clip, std::move(scene_nodes)));
  std::string file = document.bytes();
  if (file.size() > std::numeric_limits<std::uint32_t>::max()) {
    return Error{
        ErrorCode::Unsupported,
        fmt::format("take '{}': the glTF file would have {} bytes, expected at most 4294967295: export a shorter "
                    "range or one subject",
                    clip.name, file.size())};
  }
  return file;
}

}  // namespace mocap::exports
