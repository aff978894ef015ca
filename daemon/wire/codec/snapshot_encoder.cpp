#include "wire/codec/snapshot_encoder.h"

#include <algorithm>
#include <bit>
#include <cstring>

#include "wire/codec/encode_numbers.h"

namespace mocap::wire {
namespace {

static_assert(std::endian::native == std::endian::little, "columns of floats are copied in memory order");

enum WireType : std::uint32_t { kVarint = 0, kLengthDelimited = 2, kFixed32 = 5 };

// Writes Protobuf fields from the end of a buffer to its beginning. Source of the encoding: protobuf.dev, "Encoding".
class Backwards {
 public:
  explicit Backwards(std::span<std::uint8_t> buffer) : begin_(buffer.data()), at_(buffer.data() + buffer.size()) {}

  std::uint8_t* at() const { return at_; }

  void varint(std::uint64_t value) {
    if (value < 0x80) {
      take(1)[0] = static_cast<std::uint8_t>(value);
      return;
    }
    const auto size = static_cast<std::size_t>((std::bit_width(value) + 6) / 7);
    std::uint8_t* to = take(size);
    for (std::size_t i = 0; i + 1 < size; ++i, value >>= 7) to[i] = static_cast<std::uint8_t>(value | 0x80U);
    to[size - 1] = static_cast<std::uint8_t>(value);
  }
  void tag(std::uint32_t field, WireType type) { varint(field << 3U | type); }
  void number(std::uint32_t field, std::uint64_t value) {
    varint(value);
    tag(field, kVarint);
  }
  // For a field without presence: zero is omitted.
  void number_unless_zero(std::uint32_t field, std::uint64_t value) {
    if (value != 0) number(field, value);
  }
  void number(std::uint32_t field, float value) {
    std::memcpy(take(sizeof(value)), &value, sizeof(value));
    tag(field, kFixed32);
  }
  // Completes a length-delimited field. Its body is everything written since `at()` was `end`.
  void close(std::uint32_t field, const std::uint8_t* end) {
    varint(static_cast<std::uint64_t>(end - at_));
    tag(field, kLengthDelimited);
  }
  // Writes a packed column of integers; an empty column is omitted.
  template <class Things, class Number>
  void column(std::uint32_t field, const Things& things, const Number& number_of) {
    if (things.empty()) return;
    const std::uint8_t* end = at_;
    for (std::size_t i = things.size(); i-- > 0;) varint(number_of(things[i]));
    close(field, end);
  }
  // Writes a packed column with `Width` floats for each entry; `fill(entry, floats)` sets the floats of one entry.
  template <std::size_t Width, class Things, class Fill>
  void floats(std::uint32_t field, const Things& things, const Fill& fill) {
    if (things.empty()) return;
    const std::uint8_t* end = at_;
    std::uint8_t* to = take(Width * sizeof(float) * things.size());
    float block[Width];
    for (const auto& thing : things) {
      fill(thing, block);
      std::memcpy(to, block, sizeof(block));
      to += sizeof(block);
    }
    close(field, end);
  }
  void text(std::string_view bytes) { std::memcpy(take(bytes.size()), bytes.data(), bytes.size()); }

 private:
  std::uint8_t* take(std::size_t size) {
    MOCAP_EXPECTS(static_cast<std::size_t>(at_ - begin_) >= size);
    return at_ -= size;
  }
  std::uint8_t* begin_;
  std::uint8_t* at_;
};

void put(const Eigen::Vector3d& v, float* to) {
  for (int i = 0; i < 3; ++i) to[i] = static_cast<float>(v[i]);
}

void put(const Eigen::Quaterniond& q, float* to) {
  for (int i = 0; i < 4; ++i) to[i] = static_cast<float>(q.coeffs()[i]);  // Eigen stores x y z w
}

std::uint64_t zigzag(std::int64_t value) {
  return static_cast<std::uint64_t>(value) << 1U ^ static_cast<std::uint64_t>(value >> 63);
}

bool lost(const LabelledMarker& marker) { return marker.state == LabelState::Lost; }

void write_markers(const BoundedVector<LabelledMarker, kMaxLabels>& from, Backwards& to) {
  to.column(7, from, [](const auto& m) { return lost(m) ? 0 : millipx(m.residual_px); });
  to.column(6, from, [](const auto& m) { return lost(m) ? 0 : plus_one(m.track); });
  to.column(5, from, [](const auto& m) { return lost(m) ? 0 : percent(m.confidence); });
  to.column(4, from, [](const auto& m) { return lost(m) ? 0 : m.cameras; });
  to.floats<3>(2, from, [](const auto& m, float* f) {
    put(lost(m) ? Eigen::Vector3d(Eigen::Vector3d::Zero()) : m.position.v, f);
  });
  to.column(1, from, [](const auto& m) { return static_cast<std::uint64_t>(code_of(m.state)); });
}

void write_bones(const BoundedVector<BonePose, kMaxBones>& from, const Parts& parts, Backwards& to) {
  const BonePose nothing{};
  const auto known = [&](const BonePose& bone) -> const BonePose& {
    return bone.state == BoneState::Lost ? nothing : bone;
  };
  if (parts.velocities) {
    to.floats<3>(8, from, [&](const auto& b, float* f) { put(known(b).spin_rad_s, f); });
    to.floats<3>(7, from, [&](const auto& b, float* f) { put(known(b).velocity_m_s, f); });
  }
  to.column(6, from, [&](const auto& b) { return percent(known(b).confidence); });
  to.floats<4>(5, from, [&](const auto& b, float* f) { put(known(b).parent_from_bone.rotation, f); });
  if (parts.local_positions) {
    to.floats<3>(4, from, [&](const auto& b, float* f) { put(known(b).parent_from_bone.position, f); });
  }
  to.floats<4>(3, from, [&](const auto& b, float* f) { put(known(b).world_from_bone.rotation, f); });
  to.floats<3>(2, from, [&](const auto& b, float* f) { put(known(b).world_from_bone.position, f); });
  to.column(1, from, [](const auto& b) { return static_cast<std::uint64_t>(code_of(b.state)); });
}

void write_subject(const SubjectLabels* labels, const SubjectPose* pose, const Parts& parts, Backwards& to) {
  const std::uint8_t* end = to.at();
  if (pose != nullptr && parts.bones) {
    to.number(6, static_cast<float>(pose->smoothing_delay_s));
    to.number(5, static_cast<float>(pose->residual_m));
    const std::uint8_t* end_of_bones = to.at();
    write_bones(pose->bones, parts, to);
    to.close(4, end_of_bones);
  }
  if (labels != nullptr && parts.markers) {
    const std::uint8_t* end_of_markers = to.at();
    write_markers(labels->markers, to);
    to.close(3, end_of_markers);
  }
  if (labels != nullptr) to.number_unless_zero(2, static_cast<std::uint64_t>(code_of(labels->phase)));
  to.number_unless_zero(1, labels != nullptr ? labels->subject.value : pose->subject.value);
  to.close(8, end);
}

template <class Things>
auto find_subject(const Things& things, SubjectId subject) -> decltype(things.data()) {
  const auto found = std::find_if(things.begin(), things.end(), [&](const auto& t) { return t.subject == subject; });
  return found == things.end() ? nullptr : found;
}

// Writes the subjects in the order of `encode`: subjects with labels first, then subjects that have only a pose.
void write_subjects(const Snapshot& from, const Parts& parts, Backwards& to) {
  const auto wanted = [&](SubjectId subject) { return !parts.subject || *parts.subject == subject; };
  for (std::size_t i = from.poses.size(); i-- > 0;) {
    const SubjectPose& pose = from.poses[i];
    if (wanted(pose.subject) && find_subject(from.labels, pose.subject) == nullptr)
      write_subject(nullptr, &pose, parts, to);
  }
  for (std::size_t i = from.labels.size(); i-- > 0;) {
    const SubjectLabels& labels = from.labels[i];
    if (wanted(labels.subject)) write_subject(&labels, find_subject(from.poses, labels.subject), parts, to);
  }
}

void write_unlabelled(const BoundedVector<UnlabelledMarker, kMaxMarkers>& from, Backwards& to) {
  const std::uint8_t* end = to.at();
  to.column(5, from, [](const auto& m) { return millipx(m.residual_px); });
  to.column(4, from, [](const auto& m) { return m.cameras; });
  to.floats<3>(2, from, [](const auto& m, float* f) { put(m.position.v, f); });
  to.column(1, from, [](const auto& m) { return plus_one(m.track); });
  to.close(9, end);
}

void write_views(const BoundedVector<ViewStatus, kMaxCameras>& from, Backwards& to) {
  const std::uint8_t* end = to.at();
  to.column(4, from, [](const auto& v) { return v.blobs; });
  to.column(3, from, [](const auto& v) { return zigzag(v.skew.count()); });
  to.column(2, from, [](const auto& v) { return v.frame_number; });
  to.column(1, from, [](const auto& v) { return v.camera.value; });
  to.close(7, end);
}

std::uint64_t bits_of(std::int64_t value) { return static_cast<std::uint64_t>(value); }

void write_instants(const Instants& from, Backwards& to) {
  const std::uint8_t* end = to.at();
  if (from.sent_at) to.number(5, bits_of(to_ns(*from.sent_at)));
  if (from.fused_at) to.number(4, bits_of(to_ns(*from.fused_at)));
  if (from.detected_at) to.number(3, bits_of(to_ns(*from.detected_at)));
  if (from.received_at) to.number(2, bits_of(to_ns(*from.received_at)));
  to.number_unless_zero(1, bits_of(to_ns(from.exposed_at)));
  to.close(4, end);
}

void write_timecode(const Timecode& from, Backwards& to) {
  const std::uint8_t* end = to.at();
  to.number_unless_zero(8, from.fractional ? 1 : 0);
  to.number_unless_zero(7, from.subframe);
  to.number_unless_zero(6, from.drop_frame ? 1 : 0);
  to.number_unless_zero(5, from.frames_per_second);
  to.number_unless_zero(4, from.frames);
  to.number_unless_zero(3, from.seconds);
  to.number_unless_zero(2, from.minutes);
  to.number_unless_zero(1, from.hours);
  to.close(11, end);
}

// Upper bound of the encoded size: each entry with its longest varints, plus the fields that occur once.
std::size_t most_bytes(const Snapshot& from) {
  std::size_t bytes = 512 + 30 * from.views.size() + 27 * from.unlabelled.size();
  for (const SubjectLabels& labels : from.labels) bytes += 128 + 30 * labels.markers.size();
  for (const SubjectPose& pose : from.poses) bytes += 192 + 90 * pose.bones.size();
  return bytes;
}

}  // namespace

std::span<const std::uint8_t> SnapshotEncoder::encode(std::string_view head, const Snapshot& from, const Parts& parts,
                                                      const SenderFields& sender) {
  const std::size_t most = head.size() + most_bytes(from);
  if (bytes_.size() < most) bytes_.resize(std::bit_ceil(most));
  Backwards to(bytes_);
  if (from.timecode) write_timecode(*from.timecode, to);
  if (sender.synchronisation) to.number(10, static_cast<std::uint64_t>(*sender.synchronisation));
  if (!from.unlabelled.empty() && parts.unlabelled) write_unlabelled(from.unlabelled, to);
  write_subjects(from, parts, to);
  if (!from.views.empty() && parts.views) write_views(from.views, to);
  to.number_unless_zero(6, from.expected_views);
  if (sender.utc_minus_host_ns) to.number(5, bits_of(*sender.utc_minus_host_ns));
  write_instants(from.instants, to);
  to.number_unless_zero(3, from.description_version);
  if (sender.sequence) to.number(2, *sender.sequence);
  to.number_unless_zero(1, from.number);
  to.text(head);
  const auto size = static_cast<std::size_t>(bytes_.data() + bytes_.size() - to.at());
  return {to.at(), size};
}

}  // namespace mocap::wire
