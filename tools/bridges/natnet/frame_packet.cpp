#include "bridges/natnet/packets.h"
#include "bridges/natnet/receiver.h"

namespace mocap::natnet {
namespace {

// Flags of a labelled marker.
constexpr std::int16_t kOccluded = 0x01;
constexpr std::int16_t kMeasured = 0x02;
constexpr std::int16_t kFromModel = 0x04;
constexpr std::int16_t kHasModel = 0x08;
constexpr std::int16_t kUnlabelled = 0x10;
constexpr std::int16_t kModelsChanged = 0x02;  // of the frame
constexpr Version kSizes{4, 1};                // from this version on each section has its size
constexpr std::uint8_t kPtpMajor = 4;          // from this version on the suffix has a PTP stamp

/// Writes the sections of one frame.
class FrameWriter {
 public:
  FrameWriter(PacketWriter& writer, const Scene& scene, const Settings& settings)
      : writer_(writer), scene_(scene), settings_(settings), axes_(axes_of(settings.up)) {}

  void write(std::uint64_t sent_ns) {
    writer_.begin(Message::Frame);
    writer_.put(scene_.number);
    section([this] { return put_marker_sets(); });
    section([this] { return put_other_markers(); });
    section([this] { return put_bodies(); });
    section([this] { return put_skeletons(); });
    if (settings_.version >= kSizes) section([] { return 0; });  // assets
    section([this] { return put_labelled_markers(); });
    section([] { return 0; });  // force plates
    section([] { return 0; });  // devices
    put_suffix(sent_ns);
  }

 private:
  // A section: count, from 4.1 on the number of bytes, items. `put_items` returns the count.
  template <class PutItems>
  void section(PutItems put_items) {
    const std::size_t count_mark = writer_.reserve();
    const std::size_t size_mark = settings_.version >= kSizes ? writer_.reserve() : 0;
    const std::int32_t count = put_items();
    writer_.set(count_mark, count);
    if (size_mark != 0) writer_.close(size_mark);
  }

  bool wants_unlabelled() const { return settings_.labelled && settings_.unlabelled && !is_filtered(settings_); }

  std::int32_t put_marker_sets() {
    std::int32_t count = 0;
    for (const Model& model : scene_.models) {
      if (!wants(settings_, Kind::MarkerSet, model.name, model.id)) continue;
      writer_.put_text(model.name);
      writer_.put(static_cast<std::int32_t>(model.markers.size()));
      put_positions(model);
      ++count;
    }
    if (!wants(settings_, Kind::MarkerSet, "all", 0)) return count;
    std::size_t all = 0;
    for (const Model& model : scene_.models) all += model.markers.size();
    writer_.put_text("all");
    writer_.put(static_cast<std::int32_t>(all));
    for (const Model& model : scene_.models) put_positions(model);
    return count + 1;
  }

  void put_positions(const Model& model) {
    for (const MarkerPose& marker : model.marker_poses) writer_.put_vec3(axes_.place(marker.position));
  }

  std::int32_t put_other_markers() {
    if (!wants_unlabelled()) return 0;
    for (const Point& point : scene_.unlabelled) writer_.put_vec3(axes_.place(point.position));
    return static_cast<std::int32_t>(scene_.unlabelled.size());
  }

  void put_body(std::int32_t id, mocap_vec3 position, mocap_quat rotation, float error_m, bool tracked) {
    writer_.put(id);
    writer_.put_vec3(axes_.place(position));
    writer_.put_quat(axes_.turn(rotation));
    writer_.put(error_m);
    writer_.put(static_cast<std::int16_t>(tracked ? 1 : 0));
  }

  std::int32_t put_bodies() {
    std::int32_t count = 0;
    for (const Model& model : scene_.models) {
      if (!model.is_body() || !wants(settings_, Kind::Body, model.name, model.id)) continue;
      const BonePose& pose = model.poses.front();
      put_body(model.id, pose.position, pose.rotation, model.error_m, pose.tracked);
      ++count;
    }
    return count;
  }

  std::int32_t put_skeletons() {
    std::int32_t count = 0;
    for (const Model& model : scene_.models) {
      if (model.is_body() || !wants(settings_, Kind::Skeleton, model.name, model.id)) continue;
      writer_.put(model.id);
      writer_.put(static_cast<std::int32_t>(model.poses.size()));
      for (std::size_t i = 0; i < model.poses.size(); ++i) {
        const BonePose& pose = model.poses[i];
        put_body(member_id(model.id, i), settings_.local_bones ? pose.local_position : pose.position,
                 settings_.local_bones ? pose.local_rotation : pose.rotation, model.error_m, pose.tracked);
      }
      ++count;
    }
    return count;
  }

  void put_labelled(std::int32_t id, mocap_vec3 position, std::int16_t flags) {
    writer_.put(id);
    writer_.put_vec3(axes_.place(position));
    writer_.put(0.0F);  // size: unknown
    writer_.put(flags);
    writer_.put(0.0F);  // residual in metres: unknown
  }

  // NatNet's list of labelled markers has the unlabelled markers too, with a flag.
  std::int32_t put_labelled_markers() {
    if (!settings_.labelled) return 0;
    std::int32_t count = 0;
    for (const Model& model : scene_.models) {
      if (is_filtered(settings_) && !is_subscribed(model)) continue;
      for (std::size_t i = 0; i < model.marker_poses.size(); ++i) {
        const MarkerPose& marker = model.marker_poses[i];
        if (!marker.known) continue;
        const int flags = kHasModel | (marker.measured ? kMeasured : kOccluded | kFromModel);
        put_labelled(member_id(model.id, i), marker.position, static_cast<std::int16_t>(flags));
        ++count;
      }
    }
    if (!wants_unlabelled()) return count;
    for (const Point& point : scene_.unlabelled) {
      put_labelled(point.id, point.position, static_cast<std::int16_t>(kUnlabelled | kMeasured));
    }
    return count + static_cast<std::int32_t>(scene_.unlabelled.size());
  }

  bool is_subscribed(const Model& model) const {
    return wants(settings_, model.is_body() ? Kind::Body : Kind::Skeleton, model.name, model.id) ||
           wants(settings_, Kind::MarkerSet, model.name, model.id);
  }

  void put_suffix(std::uint64_t sent_ns) {
    writer_.put(scene_.timecode);
    writer_.put(scene_.subframe);
    writer_.put(static_cast<double>(scene_.exposed_ns) / static_cast<double>(kTicksPerSecond));
    writer_.put(scene_.exposed_ns);
    writer_.put(scene_.received_ns);
    writer_.put(sent_ns);
    if (settings_.version.major >= kPtpMajor) writer_.put(std::uint64_t{0});  // no PTP stamp: seconds and fraction
    writer_.put(scene_.models_changed ? kModelsChanged : std::int16_t{0});
    writer_.put(std::int32_t{0});  // end of the frame
  }

  PacketWriter& writer_;
  const Scene& scene_;
  const Settings& settings_;
  bridge::Axes axes_;
};

}  // namespace

std::string_view frame_packet(PacketWriter& writer, const Scene& scene, const Settings& settings,
                              std::uint64_t sent_ns) {
  FrameWriter(writer, scene, settings).write(sent_ns);
  return writer.finish();
}

}  // namespace mocap::natnet
