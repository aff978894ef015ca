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
#include "gvsp_stream.h"

typedef struct _ArvFakeCamera ArvFakeCamera;  // NOLINT(bugprone-reserved-identifier): Aravis's own name

namespace mocap::sim {

/// A GigE Vision camera at one address of this machine, as far as the network sees it: discovery, registers, control by
/// one client at a time (heartbeat), packets on request. What it shows is somebody else's matter.
///
/// The registers and their GenICam description are those of Aravis's fake camera, with pixel formats of 10 and 12
/// bits, PTP, a latch of the clock, test packets, chunk data and action commands added.
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
    double lost_share = 0.0;  ///< of the packets of images
    bool resends = true;      ///< packets that are asked for
    std::int64_t ptp_offset_ns = 0;
    double clock_skew_us = 0.0;  ///< of its own clock; none while it keeps PTP time
    double clock_drift_ppm = 0.0;
    std::uint64_t seed = 1;
  };

  /// Answers from now on. Fails with Busy where the address cannot be had.
  static Result<std::unique_ptr<GigeDevice>> serve(const Settings& settings);
  ~GigeDevice();
  GigeDevice(const GigeDevice&) = delete;
  GigeDevice& operator=(const GigeDevice&) = delete;

  /// Whether a client wants images now.
  bool acquiring() const;

  /// Raised each time that a client begins to want images.
  unsigned acquisitions() const { return acquisitions_; }

  enum class Trigger { Free, Software, Line, Action };
  Trigger trigger() const;
  /// Whether a software trigger waits; it is taken.
  bool take_software_trigger();
  /// Its action commands, as instants to expose at.
  GigeActions& actions() { return actions_; }

  const CameraClock& clock() const { return clock_; }
  /// Its master is gone: from now on its clock is its own again.
  void lose_ptp();

  std::uint32_t read(std::uint32_t address) const;
  std::uint32_t period_us() const;
  std::uint32_t exposure_us() const;
  /// Format and region that the client has chosen; id and stamp are the caller's.
  ServedImage layout() const;
  std::size_t payload_bytes() const;  ///< of the pixels

  /// The thread that shows images fills `room` and sends; chunks are added as the client wants them.
  std::span<std::byte> room() { return stream_.room(payload_bytes()); }
  void send(const ServedImage& image);
  void rehearse(const ServedImage& image) { stream_.rehearse(image, route()); }

 private:
  struct Command;

  explicit GigeDevice(const Settings& settings);
  Status open();
  void describe();
  StreamRoute route() const;
  WantedChunks wanted_chunks() const;
  void run(const std::stop_token& stop);
  void answer(int socket);
  bool read_command(const Command& command);
  bool write_command(const Command& command);
  void take_action(const Command& command);
  void written(std::uint32_t address, std::uint32_t value);
  void refuse(const Command& command);
  bool may_write(const sockaddr_in& from) const;
  void follow_control(const Command& command);
  void let_go_of_silent_client();

  Settings settings_;
  ArvFakeCamera* registers_ = nullptr;
  CameraClock clock_;
  GigeActions actions_;
  GvspStream stream_;
  int sockets_[3] = {-1, -1, -1};  // control, and discovery by broadcast to all and to the subnet
  std::optional<sockaddr_in> client_;
  Timestamp client_heard_at_;
  std::atomic<unsigned> acquisitions_{0};
  std::jthread thread_;
};

}  // namespace mocap::sim
