#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <string>

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpedantic"
#pragma GCC diagnostic ignored "-Wconversion"
#include <arv.h>
#pragma GCC diagnostic pop

namespace mocap::cameras {

/// Aravis's fake GigE Vision camera, in this process, on its own loopback address.
class FakeGigE {
 public:
  FakeGigE(const std::string& address, const std::string& serial) {
    camera_ = arv_gv_fake_camera_new(address.c_str(), serial.c_str());
    arv_fake_camera_set_fill_pattern(arv_gv_fake_camera_get_fake_camera(camera_), fill, this);
  }
  ~FakeGigE() { g_object_unref(camera_); }
  FakeGigE(const FakeGigE&) = delete;
  FakeGigE& operator=(const FakeGigE&) = delete;

  bool running() const { return arv_gv_fake_camera_is_running(camera_) != 0; }
  unsigned filled() const { return filled_; }

 private:
  // Every pixel of image k is k modulo 256.
  static void fill(ArvBuffer* buffer, void* self, guint32, guint32, ArvPixelFormat) {
    auto& fake = *static_cast<FakeGigE*>(self);
    std::size_t size = 0;
    auto* data = static_cast<unsigned char*>(const_cast<void*>(arv_buffer_get_data(buffer, &size)));
    const auto pixels = static_cast<std::size_t>(arv_buffer_get_image_width(buffer)) *
                        static_cast<std::size_t>(arv_buffer_get_image_height(buffer));
    std::fill_n(data, pixels, static_cast<unsigned char>(arv_buffer_get_frame_id(buffer)));
    ++fake.filled_;
  }

  ArvGvFakeCamera* camera_ = nullptr;
  std::atomic<unsigned> filled_{0};
};

}  // namespace mocap::cameras
