#pragma once

#include <linux/aio_abi.h>
#include <sys/types.h>

#include <atomic>
#include <cstddef>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "base/result.h"
#include "usb3_registers.h"

namespace mocap::sim {

/// One endpoint of a FunctionFS, transfer by transfer. One thread.
class UsbPipe {
 public:
  UsbPipe() = default;
  ~UsbPipe();
  UsbPipe(const UsbPipe&) = delete;
  UsbPipe& operator=(const UsbPipe&) = delete;

  Status open(const std::string& file);

  /// Moves bytes to the host (`write`) or from it, and waits for it while `wanted` holds. How many were moved; -1 when
  /// the device is not plugged in, was unplugged, or they are no longer wanted.
  ssize_t write(std::span<const std::byte> bytes, const std::function<bool()>& wanted);
  ssize_t read(std::span<std::byte> room, const std::function<bool()>& wanted);

 private:
  ssize_t transfer(unsigned short operation, void* bytes, std::size_t count, const std::function<bool()>& wanted);

  int file_ = -1;
  aio_context_t context_ = 0;
};

/// A USB3 Vision device that a USB device controller of this machine shows to the host at its other end, which is this
/// machine too: dummy_hcd, each with a host's controller of its own at the speed of USB 3, or usbip-vudc, all on the
/// one controller vhci_hcd.0 at the speed of USB 2. Needs root, configfs at /sys/kernel/config and the modules
/// dummy_hcd (is_super_speed=1), or vhci-hcd and usbip-vudc, and usb_f_fs.
///
/// Unplugged and plugged in again by what is written to /sys/kernel/config/usb_gadget/NAME/UDC.
///
/// Source: Linux, Documentation/usb/functionfs.rst and gadget_configfs.rst; USB3 Vision 1.0.1, section 3 (descriptors).
class Usb3Gadget {
 public:
  struct Settings {
    std::string name;        ///< of the gadget in configfs
    std::string serial;      ///< in the USB's own descriptor
    std::string controller;  ///< dummy_udc.0; usbip-vudc.0
    unsigned port = 0;       ///< of the host's controller, with usbip-vudc
  };

  /// Plugs it in; `registers` outlive it. Fails with Unsupported where the system has no such thing.
  static Result<std::unique_ptr<Usb3Gadget>> plug_in(const Settings& settings, Usb3Registers& registers);
  ~Usb3Gadget();
  Usb3Gadget(const Usb3Gadget&) = delete;
  Usb3Gadget& operator=(const Usb3Gadget&) = delete;

  /// Sends one transfer of the stream; false when the client has ended it.
  bool send(std::span<const std::byte> transfer);

 private:
  Usb3Gadget(const Settings& settings, Usb3Registers& registers) : settings_(settings), registers_(registers) {}
  bool by_usbip() const { return settings_.controller.starts_with("usbip-vudc"); }
  Status make_gadget() const;
  Status open_function();
  Status connect_by_usbip() const;
  void follow_events(const std::stop_token& stop);
  void answer_commands(const std::stop_token& stop);

  Settings settings_;
  Usb3Registers& registers_;
  int events_ = -1;
  UsbPipe answers_, commands_, stream_;
  std::jthread event_thread_, command_thread_;
};

}  // namespace mocap::sim
