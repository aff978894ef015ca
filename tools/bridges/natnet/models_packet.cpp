#include "bridges/natnet/bone_names.h"
#include "bridges/natnet/packets.h"
#include "bridges/natnet/receiver.h"

namespace mocap::natnet {
namespace {

constexpr std::int32_t kMarkerSet = 0;
constexpr std::int32_t kRigidBody = 1;
constexpr std::int32_t kSkeleton = 2;
constexpr Version kSizes{4, 1};           // from this version on each description has its size
constexpr std::uint8_t kMarkerNames = 4;  // from this major version on rigid bodies name their markers

/// Writes the descriptions.
class ModelsWriter {
 public:
  ModelsWriter(PacketWriter& writer, const Scene& scene, const Settings& settings)
      : writer_(writer), scene_(scene), settings_(settings), axes_(axes_of(settings.up)) {}

  void write() {
    writer_.begin(Message::Models);
    const std::size_t count_mark = writer_.reserve();
    for (const Model& model : scene_.models) {
      describe(kMarkerSet, [&] { put_marker_set(model); });
      if (model.is_body()) {
        describe(kRigidBody, [&] { put_body(model, 0, model.name, model.id, 0); });
      } else {
        describe(kSkeleton, [&] { put_skeleton(model); });
      }
    }
    describe(kMarkerSet, [&] { put_all(); });
    writer_.set(count_mark, count_);
  }

 private:
  template <class PutBody>
  void describe(std::int32_t type, PutBody put_body) {
    ++count_;
    writer_.put(type);
    const std::size_t mark = settings_.version >= kSizes ? writer_.reserve() : 0;
    put_body();
    if (mark != 0) writer_.close(mark);
  }

  void put_marker_set(const Model& model) {
    writer_.put_text(model.name);
    writer_.put(static_cast<std::int32_t>(model.markers.size()));
    for (const Marker& marker : model.markers) writer_.put_text(marker.name);
  }

  // The names of all markers with the name of their subject, because two subjects may have the same marker set.
  void put_all() {
    std::size_t all = 0;
    for (const Model& model : scene_.models) all += model.markers.size();
    writer_.put_text("all");
    writer_.put(static_cast<std::int32_t>(all));
    for (const Model& model : scene_.models) {
      for (const Marker& marker : model.markers) writer_.put_text(model.name + ':' + marker.name);
    }
  }

  // One bone as a rigid body, with its markers. `parent`: the id of the parent; 0: none.
  void put_body(const Model& model, std::size_t bone, const std::string& name, std::int32_t id, std::int32_t parent) {
    writer_.put_text(name);
    writer_.put(id);
    writer_.put(parent);
    writer_.put_vec3(axes_.place(model.bones[bone].rest_offset));
    const std::size_t count_mark = writer_.reserve();
    std::int32_t count = 0;
    const auto each_marker = [&](auto put) {
      for (const Marker& marker : model.markers) {
        if (marker.bone == static_cast<int>(bone)) put(marker);
      }
    };
    each_marker([&](const Marker& marker) {
      writer_.put_vec3(axes_.place(marker.offset));
      ++count;
    });
    each_marker([&](const Marker&) { writer_.put(std::int32_t{0}); });  // no active marker
    if (settings_.version.major >= kMarkerNames) {
      each_marker([&](const Marker& marker) { writer_.put_text(marker.name); });
    }
    writer_.set(count_mark, count);
  }

  void put_skeleton(const Model& model) {
    writer_.put_text(model.name);
    writer_.put(model.id);
    writer_.put(static_cast<std::int32_t>(model.bones.size()));
    for (std::size_t i = 0; i < model.bones.size(); ++i) {
      const Bone& bone = model.bones[i];
      put_body(model, i, model.name + '_' + bone_name(bone, settings_.naming), static_cast<std::int32_t>(i) + 1,
               bone.parent + 1);
    }
  }

  PacketWriter& writer_;
  const Scene& scene_;
  const Settings& settings_;
  bridge::Axes axes_;
  std::int32_t count_ = 0;
};

}  // namespace

std::string_view models_packet(PacketWriter& writer, const Scene& scene, const Settings& settings) {
  ModelsWriter(writer, scene, settings).write();
  return writer.finish();
}

}  // namespace mocap::natnet
