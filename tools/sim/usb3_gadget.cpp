#include "usb3_gadget.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/usb/functionfs.h>
#include <poll.h>
#include <sys/mount.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <initializer_list>
#include <utility>

namespace mocap::sim {
namespace {

namespace fs = std::filesystem;

constexpr int kLookAtGadgetStop_ms = 20;
constexpr long kLookAtWanted_ns = 5'000'000;

fs::path gadget_folder(const std::string& name) { return fs::path("/sys/kernel/config/usb_gadget") / name; }
fs::path function_folder(const std::string& name) { return fs::path("/dev") / ("ffs-" + name); }

bool put(const fs::path& file, const std::string& text) {
  std::ofstream to(file);
  to << text << std::flush;
  return to.good();
}

constexpr unsigned kSerialText = 3;  // string index in configfs: manufacturer, product, serial number

// Maximum packet sizes of bulk endpoints, bytes.
constexpr unsigned kFullSpeedPacket = 64, kHighSpeedPacket = 512, kSuperSpeedPacket = 1024;

// The descriptors that FunctionFS passes to the host: interfaces and endpoints for USB 2 and USB 3.
class Descriptors {
 public:
  explicit Descriptors(unsigned packet_bytes) : packet_bytes_(packet_bytes) {}

  // Device class "miscellaneous", subclass 05: USB3 Vision; protocols 0 control, 1 events, 2 stream.
  void interface(unsigned number, unsigned protocol, unsigned endpoints) {
    add({9, 4, number, 0, endpoints, 0xef, 5, protocol, 0});
  }
  // FunctionFS does not pass on the class-specific descriptor of USB3 Vision, whose 12th byte is the string index of
  // the camera's GUID. Two interface associations carry the index at the position where Aravis reads it, in an
  // otherwise unused byte (see decisions/0003).
  void number_of_guid(unsigned text) {
    add({8, 0x0b, 1, 2, 0xef, 5, 0, 0});
    add({8, 0x0b, 1, text, 0xef, 5, 0, 0});
  }
  void bulk_endpoint(unsigned address) {
    add({7, 5, address, 2, packet_bytes_ & 0xff, packet_bytes_ >> 8, 0});
    if (packet_bytes_ == kSuperSpeedPacket)
      add({6, 0x30, 15, 0, 0, 0});  // endpoint companion descriptor: bursts of 16 packets
  }
  std::uint32_t count() const { return count_; }
  const std::vector<std::byte>& bytes() const { return bytes_; }

 private:
  void add(std::initializer_list<unsigned> values) {
    for (const unsigned value : values) bytes_.push_back(static_cast<std::byte>(value));
    ++count_;
  }
  unsigned packet_bytes_;
  std::vector<std::byte> bytes_;
  std::uint32_t count_ = 0;
};

// dummy_hcd assigns OUT endpoints the numbers 2, 7, 12 and then 1, and the first IN endpoint number 1. Aravis assumes
// that both endpoints of the control channel have the same number, so an unused interface occupies the first three OUT
// endpoints. usbip-vudc numbers both directions from 1.
unsigned idle_endpoints(bool by_usbip) { return by_usbip ? 0 : 3; }

Descriptors describe(unsigned packet_bytes, unsigned idle) {
  Descriptors all(packet_bytes);
  all.interface(0, 1, idle);
  for (unsigned address = 1; address <= idle; ++address) all.bulk_endpoint(address);
  all.interface(1, 0, 2);
  all.number_of_guid(kSerialText);
  all.bulk_endpoint(0x84);
  all.bulk_endpoint(5);
  all.interface(2, 2, 1);
  all.bulk_endpoint(0x86);
  return all;
}

void append(std::vector<std::byte>& to, std::initializer_list<std::uint32_t> values) {
  for (const std::uint32_t value : values) {
    const auto at = to.size();
    to.resize(at + sizeof value);
    std::memcpy(to.data() + at, &value, sizeof value);
  }
}

// Descriptors of all speeds. Without the full-speed descriptors, Linux 6.1 reads an undefined endpoint address.
std::vector<std::byte> descriptors_for_kernel(unsigned idle) {
  const Descriptors speeds[] = {describe(kFullSpeedPacket, idle), describe(kHighSpeedPacket, idle),
                                describe(kSuperSpeedPacket, idle)};
  std::size_t length = 6 * sizeof(std::uint32_t);
  for (const Descriptors& each : speeds) length += each.bytes().size();
  std::vector<std::byte> all;
  append(all, {FUNCTIONFS_DESCRIPTORS_MAGIC_V2, static_cast<std::uint32_t>(length),
               FUNCTIONFS_HAS_FS_DESC | FUNCTIONFS_HAS_HS_DESC | FUNCTIONFS_HAS_SS_DESC, speeds[0].count(),
               speeds[1].count(), speeds[2].count()});
  for (const Descriptors& each : speeds) all.insert(all.end(), each.bytes().begin(), each.bytes().end());
  return all;
}

Error failed(const std::string& what) {
  return {ErrorCode::Unsupported,
          fmt::format("{}: {}; a USB3 camera needs root, configfs at /sys/kernel/config, and the modules dummy_hcd "
                      "(is_super_speed=1) and usb_f_fs",
                      what, std::strerror(errno))};
}

}  // namespace

UsbPipe::~UsbPipe() {
  if (context_ != 0) syscall(SYS_io_destroy, context_);
  if (file_ >= 0) close(file_);
}

Status UsbPipe::open(const std::string& file) {
  file_ = ::open(file.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
  if (file_ < 0) return failed(file);
  if (syscall(SYS_io_setup, 1, &context_) != 0) return failed("io_setup");
  return {};
}

ssize_t UsbPipe::write(std::span<const std::byte> bytes, const std::function<bool()>& wanted) {
  return transfer(IOCB_CMD_PWRITE, const_cast<std::byte*>(bytes.data()), bytes.size(), wanted);
}

ssize_t UsbPipe::read(std::span<std::byte> room, const std::function<bool()>& wanted) {
  return transfer(IOCB_CMD_PREAD, room.data(), room.size(), wanted);
}

ssize_t UsbPipe::transfer(unsigned short operation, void* bytes, std::size_t count,
                          const std::function<bool()>& wanted) {
  iocb request{};
  request.aio_fildes = static_cast<std::uint32_t>(file_);
  request.aio_lio_opcode = operation;
  request.aio_buf = reinterpret_cast<std::uintptr_t>(bytes);
  request.aio_nbytes = count;
  iocb* requests[] = {&request};
  while (syscall(SYS_io_submit, context_, 1, requests) != 1) {
    if (!wanted() || (errno != EAGAIN && errno != EINTR)) return -1;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));  // the host has not enabled the device yet
  }
  io_event event{};
  bool cancelled = false;
  for (;;) {
    timespec patience{0, kLookAtWanted_ns};
    const long done = syscall(SYS_io_getevents, context_, 1, 1, &event, &patience);
    if (done == 1) return event.res < 0 ? -1 : static_cast<ssize_t>(event.res);
    if (cancelled || wanted()) continue;
    syscall(SYS_io_cancel, context_, &request, &event);  // the cancelled request completes with an event
    cancelled = true;
  }
}

Result<std::unique_ptr<Usb3Gadget>> Usb3Gadget::plug_in(const Settings& settings, Usb3Registers& registers) {
  std::unique_ptr<Usb3Gadget> gadget(new Usb3Gadget(settings, registers));
  if (const Status made = gadget->make_gadget(); !made) return made.error();
  if (const Status opened = gadget->open_function(); !opened) return opened.error();
  Usb3Gadget* const raw = gadget.get();
  gadget->event_thread_ = std::jthread([raw](const std::stop_token& stop) { raw->follow_events(stop); });
  gadget->command_thread_ = std::jthread([raw](const std::stop_token& stop) { raw->answer_commands(stop); });
  if (!put(gadget_folder(settings.name) / "UDC", settings.controller + "\n")) return failed(settings.controller);
  if (gadget->by_usbip()) {
    if (const Status connected = gadget->connect_by_usbip(); !connected) return connected.error();
  }
  return gadget;
}

Status Usb3Gadget::make_gadget() const {
  const fs::path gadget = gadget_folder(settings_.name);
  const fs::path texts = gadget / "strings/0x409", configuration = gadget / "configs/c.1";
  const fs::path function = gadget / ("functions/ffs." + settings_.name);
  std::error_code refused;
  for (const fs::path& each : {gadget, texts, configuration, function}) {
    if (mkdir(each.c_str(), 0755) != 0 && errno != EEXIST) return failed(each.string());
  }
  const std::pair<fs::path, std::string> values[] = {{gadget / "idVendor", "0x1d6b"},
                                                     {gadget / "idProduct", "0x0104"},
                                                     {gadget / "bcdUSB", "0x0300"},
                                                     {gadget / "bDeviceClass", "0xef"},
                                                     {gadget / "bDeviceSubClass", "0x02"},
                                                     {gadget / "bDeviceProtocol", "0x01"},
                                                     {texts / "manufacturer", "mocap"},
                                                     {texts / "product", "Usb3"},
                                                     {texts / "serialnumber", settings_.serial}};
  for (const auto& [file, value] : values) {
    if (!put(file, value)) return failed(file.string());
  }
  fs::create_symlink(function, configuration / function.filename(), refused);
  const fs::path folder = function_folder(settings_.name);
  mkdir(folder.c_str(), 0755);
  if (mount(settings_.name.c_str(), folder.c_str(), "functionfs", 0, "") != 0) return failed("mount functionfs");
  return {};
}

Status Usb3Gadget::open_function() {
  const std::string folder = function_folder(settings_.name).string();
  events_ = ::open((folder + "/ep0").c_str(), O_RDWR | O_CLOEXEC);
  const unsigned idle = idle_endpoints(by_usbip());
  const std::vector<std::byte> descriptors = descriptors_for_kernel(idle);
  if (events_ < 0 || ::write(events_, descriptors.data(), descriptors.size()) < 0) return failed(folder + "/ep0");
  std::vector<std::byte> no_texts;
  append(no_texts, {FUNCTIONFS_STRINGS_MAGIC, 16, 0, 0});
  if (::write(events_, no_texts.data(), no_texts.size()) < 0) return failed(folder + "/ep0");
  // The first endpoints belong to the unused interface.
  const auto endpoint = [&](unsigned number) { return fmt::format("{}/ep{}", folder, idle + number); };
  if (const Status opened = answers_.open(endpoint(1)); !opened) return opened;
  if (const Status opened = commands_.open(endpoint(2)); !opened) return opened;
  return stream_.open(endpoint(3));
}

// Device and host use the two ends of one socket pair. The kernel keeps both ends open. Source: Linux,
// drivers/usb/usbip (vudc_sysfs.c, vhci_sysfs.c).
Status Usb3Gadget::connect_by_usbip() const {
  constexpr unsigned kHighSpeed = 3;  // USB_SPEED_HIGH, the highest speed of usbip-vudc
  const fs::path platform = "/sys/devices/platform";
  int ends[2] = {-1, -1};
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) return failed("socketpair");
  const bool connected = put(platform / settings_.controller / "usbip_sockfd", fmt::format("{}\n", ends[0])) &&
                         put(platform / "vhci_hcd.0/attach",
                             fmt::format("{} {} {} {}\n", settings_.port, ends[1], settings_.port + 1, kHighSpeed));
  const Status done = connected ? Status{} : failed(settings_.controller);
  for (const int each : ends) close(each);
  return done;
}

Usb3Gadget::~Usb3Gadget() {
  const fs::path gadget = gadget_folder(settings_.name);
  put(gadget / "UDC", "\n");
  command_thread_ = {};
  event_thread_ = {};
  if (events_ >= 0) close(events_);
  events_ = -1;
}

void Usb3Gadget::follow_events(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    pollfd waiting{events_, POLLIN, 0};
    if (poll(&waiting, 1, kLookAtGadgetStop_ms) != 1) continue;
    usb_functionfs_event event{};
    if (::read(events_, &event, sizeof event) != sizeof event) continue;
    if (event.type == FUNCTIONFS_DISABLE || event.type == FUNCTIONFS_UNBIND) registers_.unplugged();
    // No control request is supported: a transfer in the wrong direction stalls the endpoint.
    if (event.type != FUNCTIONFS_SETUP) continue;
    std::byte nothing{};
    if ((event.u.setup.bRequestType & USB_DIR_IN) != 0) {
      [[maybe_unused]] const ssize_t refused = ::read(events_, &nothing, 0);
    } else {
      [[maybe_unused]] const ssize_t refused = ::write(events_, &nothing, 0);
    }
  }
}

void Usb3Gadget::answer_commands(const std::stop_token& stop) {
  std::array<std::byte, Usb3Registers::kMostCommand_bytes> command{};
  std::vector<std::byte> answer(Usb3Registers::kMostAcknowledge_bytes);
  const auto wanted = [&stop] { return !stop.stop_requested(); };
  while (!stop.stop_requested()) {
    const ssize_t length = commands_.read(command, wanted);
    if (length <= 0) continue;
    const std::size_t answered = registers_.answer(std::span(command).first(static_cast<std::size_t>(length)), answer);
    if (answered > 0) answers_.write(std::span(answer).first(answered), wanted);
  }
}

bool Usb3Gadget::send(std::span<const std::byte> transfer) {
  return stream_.write(transfer, [this] { return registers_.streaming(); }) == static_cast<ssize_t>(transfer.size());
}

}  // namespace mocap::sim
