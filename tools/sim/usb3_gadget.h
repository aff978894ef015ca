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

/// One endpoint of a FunctionFS instance. One thread.
class UsbPipe {
 public:
  UsbPipe() = default;
  ~UsbPipe();
  UsbPipe(const UsbPipe&) = delete;
  UsbPipe& operator=(const UsbPipe&) = delete;

  Status open(const std::string& file);

  /// Transfers bytes to the host (write) or from the host (read). Waits for the end of the transfer while `wanted`
  /// returns true. Returns the number of bytes, or -1 if the device is unplugged or `wanted` returns false.
  ssize_t write(std::span<const std::byte> bytes, const std::function<bool()>& wanted);
  ssize_t read(std::span<std::byte> room, const std::function<bool()>& wanted);

 private:
  ssize_t transfer(unsigned short operation, void* bytes, std::size_t count, const std::function<bool()>& wanted);

  int file_ = -1;
  aio_context_t context_ = 0;
};

/// A USB3 Vision device on an emulated USB device controller, which is connected to a host controller of the same
/// machine. With dummy_hcd each device has its own host controller at USB 3 speed. With usbip-vudc all devices share
/// the host controller vhci_hcd.0 at USB 2 speed. Needs root, configfs at /sys/kernel/config and the modules dummy_hcd
/// (is_super_speed=1), or vhci-hcd and usbip-vudc, and usb_f_fs. Writing to /sys/kernel/config/usb_gadget/NAME/UDC
/// unplugs the device and plugs it in again.
///
/// Source: Linux, Documentation/usb/functionfs.rst and gadget_configfs.rst; USB3 Vision 1.0.1, section 3 (descriptors).
class Usb3Gadget {
 public:
  struct Settings {
    std::string name;        ///< name of the gadget in configfs
    std::string serial;      ///< serial number in the USB device descriptor
    std::string controller;  ///< for example dummy_udc.0 or usbip-vudc.0
    unsigned port = 0;       ///< port of the host controller, for usbip-vudc
  };

  /// Creates and plugs in the device. `registers` must outlive it. Fails with Unsupported if the system lacks the
  /// controller or the modules.
  static Result<std::unique_ptr<Usb3Gadget>> plug_in(const Settings& settings, Usb3Registers& registers);
  ~Usb3Gadget();
  Usb3Gadget(const Usb3Gadget&) = delete;
  Usb3Gadget& operator=(const Usb3Gadget&) = delete;

  /// Sends one transfer of the stream. Returns false if the client has stopped the stream.
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
