#include "cameras/aravis/aravis_device.h"

#include <fmt/format.h>
// The C headers of Aravis cause these warnings.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpedantic"
#pragma GCC diagnostic ignored "-Wconversion"
#include <arv.h>
#pragma GCC diagnostic pop

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstring>
#include <fstream>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "base/log.h"
#include "cameras/aravis/aravis_discovery.h"
#include "cameras/aravis/aravis_failure.h"
#include "cameras/aravis/aravis_ptp.h"
#include "cameras/aravis/usb_bandwidth.h"

namespace mocap::cameras {
namespace {

// Receive buffer of a GigE stream; packets beyond it are dropped. The kernel limits the size to net.core.rmem_max.
constexpr int kSocketBuffer_bytes = 32 * 1024 * 1024;
// Resend requests: the first after kAskAfter_us without the packet while later packets arrive, then one every
// kAskAgain_us. An image without a new packet for kGiveUp_us is given up. Aravis's defaults of 1, 20 and 100 ms delay
// an image by three periods at 120 Hz, and the images after it too, because images are delivered in order.
constexpr guint kAskAfter_us = 1000;
constexpr guint kAskAgain_us = 3000;
// Largest share of an image's packets that may be requested again. 1: the first image arrives before the socket buffer
// has its size, so most of its packets may be lost.
constexpr double kMostAsked = 1.0;
constexpr guint kGiveUp_us = 80000;
// Longest wait for a discovery answer. A camera answers within the round trip time of the network, a busy camera within
// some 10 ms. Design value.
constexpr Duration kAnswerPatience = std::chrono::milliseconds(400);

// Interval and duration of the search for a USB camera that was unplugged.
constexpr Duration kLookAtUsb = std::chrono::milliseconds(20);
constexpr Duration kUsbPatience = std::chrono::milliseconds(1500);

constexpr Duration kEmissionEndsWithin = std::chrono::seconds(2);

GQuark lost_mark() {
  static const GQuark mark = g_quark_from_static_string("mocap-control-lost");
  return mark;
}

void mark_lost(ArvDevice* lost, gpointer) { g_object_set_qdata(G_OBJECT(lost), lost_mark(), GINT_TO_POINTER(1)); }

// Releases a stream and its camera. The heartbeat thread of Aravis holds a reference to the device while it emits
// control-lost. If that reference were the last one, the device would be destroyed on the heartbeat thread, wait for
// that thread itself, and GLib would abort the process. So the signal is disconnected, and this function keeps a
// reference until no other is left (decisions/0006).
void release(ArvCamera* camera, ArvStream* stream) {
  auto* const device = G_OBJECT(g_object_ref(arv_camera_get_device(camera)));
  g_signal_handlers_disconnect_by_func(device, reinterpret_cast<gpointer>(&mark_lost), nullptr);
  if (stream != nullptr) g_object_unref(stream);
  g_object_unref(camera);
  const Timestamp end = host_now() + kEmissionEndsWithin;
  const auto held_by_others = [device] { return g_atomic_int_get(&device->ref_count) > 1; };
  while (held_by_others() && host_now() < end) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  if (!held_by_others()) g_object_unref(device);  // otherwise the device leaks, which is better than an abort
}

template <class T>
struct Unref {
  void operator()(T* object) const noexcept { g_object_unref(object); }
};
template <>
struct Unref<ArvCamera> {
  void operator()(ArvCamera* camera) const noexcept { release(camera, nullptr); }
};
template <class T>
using Held = std::unique_ptr<T, Unref<T>>;

Result<Held<ArvCamera>> open_as(const std::string& device) {
  AravisFailure failure;
  Held<ArvCamera> camera(arv_camera_new(device.c_str(), failure));
  if (!camera) return failure.error(fmt::format("cannot open {}", device));
  if (arv_camera_is_gv_device(camera.get()) &&
      !arv_gv_device_is_controller(ARV_GV_DEVICE(arv_camera_get_device(camera.get())))) {
    return Error{ErrorCode::Busy, fmt::format("{} is controlled by another program; end that one", device)};
  }
  // The heartbeat thread marks the device, not this object: the thread may run longer than this object exists.
  g_signal_connect(arv_camera_get_device(camera.get()), "control-lost", G_CALLBACK(mark_lost), nullptr);
  return camera;
}

// Queries an address directly, which also finds cameras on networks that carry no broadcasts.
Result<Held<ArvCamera>> open_at_address(const std::string& address, Seen seen) {
  if (gige_camera_answers(address, kAnswerPatience)) return open_as(address);
  // A list of the other cameras helps if the address is mistyped. A camera that was found before has lost its power or
  // cable.
  const std::string others = seen != Seen::Never ? "check its power and cable" : listed(discover_cameras());
  return Error{ErrorCode::NotFound, fmt::format("no Aravis camera answers at {}; {}", address, others)};
}

std::optional<UsbDevice> usb3_camera(const std::string& serial, Duration patience) {
  const Timestamp end = host_now() + patience;
  for (;;) {
    for (UsbDevice& each : list_usb_devices()) {
      if (each.usb3_vision && each.serial == serial) return std::move(each);
    }
    if (host_now() >= end) return std::nullopt;
    std::this_thread::sleep_for(kLookAtUsb);
  }
}

// Opens by the identifier that Aravis composes of the texts in the USB descriptor and that Aravis searches on the USB
// first. arv_uv_device_new is not used: two concurrent calls outside of the lock of Aravis abort the process
// (decisions/0007).
Result<Held<ArvCamera>> open_on_usb(const UsbDevice& found) { return open_as(found.manufacturer + "-" + found.serial); }

Result<Held<ArvCamera>> open_by_serial(const std::string& serial, Seen seen) {
  const std::optional<UsbDevice> on_usb = usb3_camera(serial, seen == Seen::OnUsb ? kUsbPatience : Duration::zero());
  if (on_usb) return open_on_usb(*on_usb);
  if (seen == Seen::OnUsb) {
    return Error{ErrorCode::NotFound,
                 fmt::format("no USB3 Vision camera with serial {} is plugged in; check its cable", serial)};
  }
  const std::vector<DiscoveredCamera> all = discover_cameras();
  const auto found = std::find_if(all.begin(), all.end(), [&](const auto& each) { return each.serial == serial; });
  if (found != all.end()) return open_as(found->id);
  return Error{ErrorCode::NotFound, fmt::format("no Aravis camera with serial {}; {}", serial, listed(all))};
}

Result<Held<ArvCamera>> open_by_mac(const std::string& mac) {
  const std::vector<DiscoveredCamera> all = discover_cameras();
  const auto found = std::find_if(
      all.begin(), all.end(), [&](const auto& each) { return g_ascii_strcasecmp(each.mac.c_str(), mac.c_str()) == 0; });
  if (found != all.end()) return open_as(found->id);
  return Error{ErrorCode::NotFound, fmt::format("no Aravis camera with mac {}; {}", mac, listed(all))};
}

Result<Held<ArvCamera>> open_by_name(const std::string& name) {
  const std::vector<DiscoveredCamera> all = discover_cameras();
  Result<Held<ArvCamera>> opened = open_as(name);
  if (opened || opened.error().code != ErrorCode::NotFound) return opened;
  return Error{ErrorCode::NotFound, fmt::format("no Aravis camera named {}; {}", name, listed(all))};
}

Result<Held<ArvCamera>> open(const AravisSettings& settings, Seen seen) {
  if (!settings.address.empty()) return open_at_address(settings.address, seen);
  if (!settings.serial.empty()) return open_by_serial(settings.serial, seen);
  if (!settings.device_name.empty()) return open_by_name(settings.device_name);
  if (!settings.mac.empty()) return open_by_mac(settings.mac);
  return Error{ErrorCode::InvalidArgument, "aravis needs one of serial, device_name, address and mac"};
}

// Warns once per process if the receive buffer that the kernel permits holds fewer than 8 images.
void check_socket_room(guint payload_bytes) {
  constexpr guint64 kImages = 8;
  static std::atomic<bool> warned{false};
  std::uint64_t most = 0;
  std::ifstream("/proc/sys/net/core/rmem_max") >> most;
  const guint64 wanted = std::min<guint64>(kSocketBuffer_bytes, kImages * payload_bytes);
  if (most == 0 || most >= wanted || warned.exchange(true)) return;
  log_warn("cameras",
           fmt::format(
               "net.core.rmem_max is {} bytes, enough for {:.1f} images of {} bytes: packets are lost if the receive "
               "thread is late; sysctl -w net.core.rmem_max={}, and systemd/60-mocapd.conf to keep it",
               most, static_cast<double>(most) / payload_bytes, payload_bytes, kSocketBuffer_bytes));
}

Result<Held<ArvStream>> open_stream(ArvCamera* camera, int buffers) {
  AravisFailure failure;
  Held<ArvStream> stream(arv_camera_create_stream(camera, nullptr, nullptr, failure));
  if (!stream) return failure.error("cannot open the stream");
  if (ARV_IS_GV_STREAM(stream.get())) {
    g_object_set(stream.get(), "socket-buffer", ARV_GV_STREAM_SOCKET_BUFFER_FIXED, "socket-buffer-size",
                 kSocketBuffer_bytes, "initial-packet-timeout", kAskAfter_us, "packet-timeout", kAskAgain_us,
                 "frame-retention", kGiveUp_us, "packet-request-ratio", kMostAsked, nullptr);
  }
  const guint payload = arv_camera_get_payload(camera, failure);
  if (failure.happened() || payload == 0) return failure.error("cannot read the size of an image");
  if (ARV_IS_GV_STREAM(stream.get())) check_socket_room(payload);
  for (int i = 0; i < std::max(2, buffers); ++i) arv_stream_push_buffer(stream.get(), arv_buffer_new(payload, nullptr));
  return stream;
}

in_addr ipv4(GSocketAddress* address) {
  in_addr raw{};
  GInetAddress* const inet = g_inet_socket_address_get_address(G_INET_SOCKET_ADDRESS(address));
  if (g_inet_address_get_family(inet) == G_SOCKET_FAMILY_IPV4) {
    std::memcpy(&raw, g_inet_address_to_bytes(inet), sizeof raw);
  }
  return raw;
}

// If the camera keeps PTP time, its clock is read for the approximate time. A camera without a readable clock is taken
// to have the host's UTC.
Result<std::unique_ptr<ActionTrigger>> open_action_trigger(ArvCamera* camera, Duration period, bool by_its_time) {
  ArvGvDevice* const device = ARV_GV_DEVICE(arv_camera_get_device(camera));
  auto trigger = ActionTrigger::open(ipv4(arv_gv_device_get_interface_address(device)),
                                     ipv4(arv_gv_device_get_device_address(device)), period);
  if (!trigger || !by_its_time) return trigger;
  const std::optional<Duration> clock = read_clock(camera);
  const Timestamp now = host_now();
  (*trigger)->set_clock(clock ? *clock - now.time_since_epoch() : utc_minus_host());
  if (const Status taken = (*trigger)->probe(now); !taken) return taken.error();
  return trigger;
}

}  // namespace

void AravisDevice::watch_ptp() {
  const char* const serial = arv_camera_get_device_serial_number(camera_, nullptr);
  const std::string who = fmt::format("camera of serial {}", serial != nullptr ? serial : "unknown");
  ptp_watch_ = std::jthread(
      [this, who](const std::stop_token& stop) { mocap::cameras::watch_ptp(camera_, who, keeps_time_, stop); });
}

AravisDevice::~AravisDevice() {
  ptp_watch_ = {};  // the thread must end before the camera is closed
  arv_camera_stop_acquisition(camera_, nullptr);
  release(camera_, stream_);
}

bool AravisDevice::on_usb() const { return arv_camera_is_uv_device(camera_) != 0; }

bool AravisDevice::lost() const {
  return g_object_get_qdata(G_OBJECT(arv_camera_get_device(camera_)), lost_mark()) != nullptr;
}

Result<std::unique_ptr<AravisDevice>> open_aravis_device(const AravisSettings& settings, Seen seen) {
  Result<Held<ArvCamera>> camera = open(settings, seen);
  if (!camera) return camera.error();
  const Result<AravisFeatures> features = apply_settings(camera->get(), settings);
  if (!features) return features.error();
  if (settings.ptp) {
    if (const Status kept = enable_ptp(camera->get()); !kept) return kept.error();
  }
  std::unique_ptr<AravisChunks> chunks;
  if (settings.chunks) {
    chunks = AravisChunks::turn_on(camera->get());
  } else {
    AravisChunks::turn_off(camera->get());
  }
  Result<Held<ArvStream>> stream = open_stream(camera->get(), settings.stream_buffers);
  if (!stream) return stream.error();
  auto device = std::make_unique<AravisDevice>(camera->release(), stream->release(), *features, std::move(chunks));
  if (settings.ptp) device->watch_ptp();
  if (features->action_period) {
    auto trigger = open_action_trigger(device->camera(), *features->action_period, settings.ptp);
    if (!trigger) return trigger.error();
    device->be_triggered_by(std::move(*trigger));
  }
  return device;
}

}  // namespace mocap::cameras
