#pragma once

#include <netinet/in.h>

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <thread>

#include "base/result.h"
#include "camera_clock.h"
#include "gige_actions.h"
#include "gige_chunks.h"
#include "gvcp_command.h"
#include "gvsp_stream.h"

typedef struct _ArvFakeCamera ArvFakeCamera;  // NOLINT(bugprone-reserved-identifier): Aravis's own name

namespace mocap::sim {

/// The network side of a simulated GigE Vision camera at one address of this machine: discovery, registers, exclusive
/// control by one client (heartbeat), image packets and packet resend. The caller supplies the images. Registers and
/// GenICam description are those of Aravis's fake camera, plus pixel formats of 10 and 12 bits, PTP, a timestamp latch,
/// test packets, chunk data and action commands.
///
/// Source: GigE Vision 2.0, part "GVCP" and the bootstrap registers.
class GigeDevice {
 public:
  struct Settings {
    std::string address;
    std::string serial;
    std::uint32_t width_px = 640, height_px = 480;
    double rate_hz = 60.0;
    double exposure_us = 500.0;
    double lost_share = 0.0;  ///< share of the image packets that are not sent
    bool resends = true;      ///< answers requests for packet resend
    std::int64_t ptp_offset_ns = 0;
    double clock_skew_us = 0.0;  ///< offset of the camera clock while PTP is off
    double clock_drift_ppm = 0.0;
    std::uint64_t seed = 1;
  };

  /// Starts a thread that answers commands until destruction. Fails with Busy if the address cannot be bound.
  static Result<std::unique_ptr<GigeDevice>> serve(const Settings& settings);
  ~GigeDevice();
  GigeDevice(const GigeDevice&) = delete;
  GigeDevice& operator=(const GigeDevice&) = delete;

  /// Whether a client has started the acquisition.
  bool acquiring() const;

  /// Number of acquisition starts so far.
  unsigned acquisitions() const { return acquisitions_; }

  enum class Trigger { Free, Software, Line, Action };
  Trigger trigger() const;
  /// Returns whether a software trigger is pending, and clears it.
  bool take_software_trigger();
  /// The exposure instants requested by action commands.
  GigeActions& actions() { return actions_; }

  const CameraClock& clock() const { return clock_; }
  /// Simulates the loss of the PTP master: the clock runs free from now on.
  void lose_ptp();

  std::uint32_t read(std::uint32_t address) const;
  std::uint32_t period_us() const;
  std::uint32_t exposure_us() const;
  /// Pixel format and region chosen by the client. The caller must fill in id and stamp.
  ServedImage layout() const;
  std::size_t payload_bytes() const;  ///< size of the pixels, without chunks

  /// The image thread writes the pixels into room() and calls send(), which appends the enabled chunks.
  std::span<std::byte> room() { return stream_.room(payload_bytes()); }
  void send(const ServedImage& image);
  void rehearse(const ServedImage& image) { stream_.rehearse(image, route()); }

 private:
  explicit GigeDevice(const Settings& settings);
  Status open();
  void describe();
  StreamRoute route() const;
  WantedChunks wanted_chunks() const;
  void run(const std::stop_token& stop);
  void answer(int socket);
  bool read_command(const GvcpCommand& command);
  bool write_command(const GvcpCommand& command);
  void take_action(const GvcpCommand& command);
  void written(std::uint32_t address, std::uint32_t value);
  void refuse(const GvcpCommand& command);
  bool can_read(std::uint32_t address) const;
  bool may_write(const sockaddr_in& from) const;
  void follow_control(const GvcpCommand& command);
  void let_go_of_silent_client();

  Settings settings_;
  ArvFakeCamera* registers_ = nullptr;
  std::size_t description_bytes_ = 0;  // GenICam XML, after the memory of the registers
  CameraClock clock_;
  GigeActions actions_;
  GvspStream stream_;
  int sockets_[3] = {-1, -1, -1};  // control; discovery by limited broadcast; discovery by subnet broadcast
  std::optional<sockaddr_in> client_;
  Timestamp client_heard_at_;
  std::atomic<unsigned> acquisitions_{0};
  std::jthread thread_;
};

}  // namespace mocap::sim
