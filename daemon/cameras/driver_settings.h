#pragma once

#include <concepts>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/key_check.h"
#include "base/key_visitor.h"

namespace mocap::cameras {

/// Width and height of an image, px.
struct ImageSize {
  int width_px;
  int height_px;
};

/// Facts that the daemon asks of the settings of every make. Absent if the settings do not determine them.
struct CameraFacts {
  std::optional<double> rate_hz = std::nullopt;
  std::optional<double> exposure_us = std::nullopt;
  std::optional<ImageSize> size = std::nullopt;
  /// Keys that identify the device, with their values. Two cameras of one make must differ in each of them; empty
  /// values are not compared.
  std::vector<std::pair<std::string, std::string>> device = {};
  std::filesystem::path marker_set = {};  ///< of the subject that a simulated camera sees; empty: no simulation
  /// True if images come from a recording, or from a simulation without real-time pace: the times of the images are
  /// then valid as they are, and no image is dropped.
  bool recorded_time = false;
};

/// Name and documentation of a make, for a static member `kMake` of its settings struct.
struct MakeName {
  std::string_view driver;        ///< value of the key `driver` of a [[camera]]
  std::string_view help;          ///< comment beside the [[camera]] of this make in config/mocapd.toml
  std::string_view example_name;  ///< name of that [[camera]]
};

/// The settings struct of a make: a plain struct with a static member `kMake` and three functions beside it.
///
/// - `declare_keys(keys, settings)` declares the table of its keys.
/// - `faults_of(settings)` returns the broken rules between keys. It opens and reads nothing.
/// - `facts_of(settings, camera_name)` returns the CameraFacts.
template <class S>
concept SettingsOfAMake = requires(S settings, const S& constant, KeyVisitor& keys, const std::string& camera_name) {
  { S::kMake } -> std::convertible_to<MakeName>;
  declare_keys(keys, settings);
  { faults_of(constant) } -> std::same_as<std::vector<KeyFault>>;
  { facts_of(constant, camera_name) } -> std::same_as<CameraFacts>;
};

/// The settings of one camera of any make. Copies are independent of each other.
class DriverSettings {
 public:
  /// No make, no settings.
  DriverSettings() = default;
  template <SettingsOfAMake S>
  DriverSettings(S settings) : held_(std::make_unique<Held<S>>(std::move(settings))) {}
  DriverSettings(const DriverSettings& other) : held_(other.held_ ? other.held_->clone() : nullptr) {}
  DriverSettings(DriverSettings&&) noexcept = default;
  DriverSettings& operator=(DriverSettings other) noexcept {
    held_ = std::move(other.held_);
    return *this;
  }
  ~DriverSettings() = default;

  /// The value of the key `driver` of the make; empty if there is no make.
  std::string_view driver() const { return held_ ? held_->driver() : std::string_view{}; }

  /// The settings of make S; null if the object has another make.
  template <SettingsOfAMake S>
  S* as() {
    auto* held = dynamic_cast<Held<S>*>(held_.get());
    return held != nullptr ? &held->settings : nullptr;
  }
  template <SettingsOfAMake S>
  const S* as() const {
    const auto* held = dynamic_cast<const Held<S>*>(held_.get());
    return held != nullptr ? &held->settings : nullptr;
  }

  /// Declares the keys of the make; none if there is no make.
  void declare(KeyVisitor& keys);
  /// The broken rules between keys.
  std::vector<KeyFault> faults() const;
  /// The broken rules, and the values outside of their ranges and choices: for settings that were not read from a
  /// checked file.
  std::vector<KeyFault> all_faults() const;
  CameraFacts facts(const std::string& camera_name) const;

 private:
  struct AnyMake {
    virtual ~AnyMake() = default;
    virtual std::unique_ptr<AnyMake> clone() const = 0;
    virtual std::string_view driver() const = 0;
    virtual void declare(KeyVisitor& keys) = 0;
    virtual std::vector<KeyFault> value_faults() const = 0;
    virtual std::vector<KeyFault> rule_faults() const = 0;
    virtual CameraFacts facts(const std::string& camera_name) const = 0;
  };

  template <class S>
  struct Held final : AnyMake {
    explicit Held(S wanted) : settings(std::move(wanted)) {}
    std::unique_ptr<AnyMake> clone() const override { return std::make_unique<Held>(settings); }
    std::string_view driver() const override { return S::kMake.driver; }
    void declare(KeyVisitor& keys) override { declare_keys(keys, settings); }
    std::vector<KeyFault> value_faults() const override { return check_keys(settings); }
    std::vector<KeyFault> rule_faults() const override { return faults_of(settings); }
    CameraFacts facts(const std::string& camera_name) const override { return facts_of(settings, camera_name); }

    S settings;
  };

  std::unique_ptr<AnyMake> held_;
};

}  // namespace mocap::cameras
