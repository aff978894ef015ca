#pragma once

#include <cstddef>
#include <cstdint>
#include <mutex>
#include <span>
#include <string>
#include <vector>

namespace mocap::sim {

/// The memory of a USB3 Vision camera that a client reads and writes: bootstrap registers, features, and the GenICam
/// file that describes them. Independent of the transport. Any thread.
///
/// Source: GenCP 1.3 (commands, ABRM, manifest); USB3 Vision 1.0.1 (SBRM, SIRM).
class Usb3Registers {
 public:
  struct Settings {
    std::string serial;
    std::uint32_t width_px = 640, height_px = 480;
    double rate_hz = 60.0;
    double exposure_us = 500.0;
  };

  /// Pixel format and region chosen by the client.
  struct Layout {
    std::uint32_t pixel_format = 0;  ///< GenICam PFNC
    std::uint32_t width_px = 0, height_px = 0, left_px = 0, top_px = 0;
    std::uint64_t payload_bytes = 0;
  };
  enum class Trigger { Free, Software, Line };

  /// Largest accepted command and largest acknowledge, bytes.
  static constexpr std::size_t kMostCommand_bytes = 1024;
  static constexpr std::size_t kMostAcknowledge_bytes = 16384;

  explicit Usb3Registers(const Settings& settings);

  /// Executes a command and writes the acknowledge into `room`. Returns the length of the acknowledge, or 0 if the
  /// bytes are not a command or the command needs no acknowledge. The acknowledge has an error status for unknown
  /// addresses, read-only registers and invalid values.
  std::size_t answer(std::span<const std::byte> command, std::span<std::byte> room);

  /// Whether both the acquisition and the stream channel are enabled.
  bool streaming() const;
  /// Disables the acquisition and the stream channel after the device is unplugged. Other settings remain.
  void unplugged();

  Layout layout() const;
  double rate_hz() const;
  double exposure_us() const;
  Trigger trigger() const;
  /// Returns whether a software trigger is pending, and clears it.
  bool take_software_trigger();

 private:
  template <class T>
  T get(std::size_t address) const;
  template <class T>
  void put(std::size_t address, T value);
  void put_text(std::size_t address, const std::string& text);
  void put_bootstrap(const Settings& settings, std::size_t xml_bytes);
  std::uint16_t read(std::uint64_t address, std::span<std::byte> into) const;
  std::uint16_t write(std::uint64_t address, std::span<const std::byte> data);
  bool is_valid() const;
  void follow(std::uint64_t address);
  std::uint64_t payload_bytes() const;

  mutable std::mutex mutex_;
  std::vector<std::byte> memory_;
  bool triggered_ = false;
};

/// The GenICam description of the registers.
std::string usb3_description(std::uint32_t width_px, std::uint32_t height_px);

}  // namespace mocap::sim
