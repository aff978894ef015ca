#pragma once

#include <cstdint>

namespace mocap::cameras {

/// Converts the frame ids of a device to increasing frame numbers. Ids are GigE Vision's 16-bit block ids (1 to 65535,
/// then 1 again; 0 is never used), V4L2's 32-bit sequence, or 64-bit ids. A gap in the ids is the same gap in the
/// numbers. An id that repeats or runs backwards (the device restarted) counts as the next number.
class FrameCounter {
 public:
  std::uint64_t number_of(std::uint64_t id) {
    if (!begun_) {
      begun_ = true;
      number_ = id;
    } else if (id > last_id_) {
      number_ += id - last_id_;
    } else {
      number_ += wrapped(id);
    }
    last_id_ = id;
    return number_;
  }

 private:
  // Distance from the last id to `id` if the counter wrapped (from near its end to near its begin), otherwise 1.
  std::uint64_t wrapped(std::uint64_t id) const {
    constexpr std::uint64_t kEnd16 = 0xFFFF;
    constexpr std::uint64_t kEnd32 = 0xFFFF'FFFF;
    constexpr std::uint64_t kNear = 0x1000;
    if (last_id_ <= kEnd16 && last_id_ > kEnd16 - kNear && id < kNear) return kEnd16 - last_id_ + (id == 0 ? 1 : id);
    if (last_id_ <= kEnd32 && last_id_ > kEnd32 - kNear && id < kNear) return kEnd32 - last_id_ + id + 1;
    return 1;
  }

  bool begun_ = false;
  std::uint64_t last_id_ = 0;
  std::uint64_t number_ = 0;
};

}  // namespace mocap::cameras
