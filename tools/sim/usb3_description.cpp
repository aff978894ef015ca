#include <fmt/format.h>

#include <initializer_list>
#include <string_view>
#include <utility>

#include "usb3_addresses.h"
#include "usb3_registers.h"

namespace mocap::sim {
namespace {

using Entries = std::initializer_list<std::pair<std::string_view, unsigned>>;

std::string int_register(std::string_view name, std::size_t address, std::string_view mode) {
  return fmt::format(
      R"(<IntReg Name="{}Register"><Address>0x{:x}</Address><Length>4</Length><AccessMode>{}</AccessMode>)"
      R"(<pPort>Device</pPort><Sign>Unsigned</Sign><Endianess>LittleEndian</Endianess></IntReg>)",
      name, address, mode);
}

std::string integer(std::string_view name, std::size_t address, std::string_view mode, std::uint32_t least,
                    std::uint32_t most) {
  return fmt::format(R"(<Integer Name="{0}"><pValue>{0}Register</pValue><Min>{1}</Min><Max>{2}</Max></Integer>)", name,
                     least, most) +
         int_register(name, address, mode);
}

std::string real(std::string_view name, std::size_t address, double least, double most, std::string_view unit) {
  return fmt::format(
      R"(<Float Name="{0}"><pValue>{0}Register</pValue><Min>{1}</Min><Max>{2}</Max><Unit>{3}</Unit></Float>)"
      R"(<FloatReg Name="{0}Register"><Address>0x{4:x}</Address><Length>8</Length><AccessMode>RW</AccessMode>)"
      R"(<pPort>Device</pPort><Endianess>LittleEndian</Endianess></FloatReg>)",
      name, least, most, unit, address);
}

std::string choice(std::string_view name, std::size_t address, Entries entries) {
  std::string text = fmt::format(R"(<Enumeration Name="{}">)", name);
  for (const auto& [entry, value] : entries) {
    text += fmt::format(R"(<EnumEntry Name="{}"><Value>{}</Value></EnumEntry>)", entry, value);
  }
  return text + fmt::format("<pValue>{}Register</pValue></Enumeration>", name) + int_register(name, address, "RW");
}

std::string command(std::string_view name, std::size_t address) {
  return fmt::format(R"(<Command Name="{0}"><pValue>{0}Register</pValue><CommandValue>1</CommandValue></Command>)",
                     name) +
         int_register(name, address, "WO");
}

std::string text(std::string_view name, std::size_t address) {
  return fmt::format(R"(<StringReg Name="{}"><Address>0x{:x}</Address><Length>64</Length><AccessMode>RO</AccessMode>)"
                     R"(<pPort>Device</pPort></StringReg>)",
                     name, address);
}

std::string category(std::string_view name, std::initializer_list<std::string_view> features) {
  std::string all = fmt::format(R"(<Category Name="{}">)", name);
  for (const std::string_view each : features) all += fmt::format("<pFeature>{}</pFeature>", each);
  return all + "</Category>";
}

std::string categories() {
  return category("Root", {"DeviceControl", "ImageFormatControl", "AcquisitionControl", "AnalogControl",
                           "TransportLayerControl"}) +
         category("DeviceControl", {"DeviceVendorName", "DeviceModelName", "DeviceVersion", "DeviceSerialNumber",
                                    "DeviceUserID", "DeviceTemperature"}) +
         category("ImageFormatControl", {"SensorWidth", "SensorHeight", "WidthMax", "HeightMax", "OffsetX", "OffsetY",
                                         "Width", "Height", "PixelFormat"}) +
         category("AcquisitionControl",
                  {"AcquisitionMode", "AcquisitionStart", "AcquisitionStop", "AcquisitionFrameRate", "ExposureTime",
                   "TriggerSelector", "TriggerMode", "TriggerSource", "TriggerActivation", "TriggerSoftware"}) +
         category("AnalogControl", {"Gain"}) + category("TransportLayerControl", {"PayloadSize"});
}

}  // namespace

std::string usb3_description(std::uint32_t width_px, std::uint32_t height_px) {
  constexpr std::uint32_t kMost = 0x7fffffff;
  std::string all =
      R"(<?xml version="1.0" encoding="utf-8"?><RegisterDescription ModelName="Usb3" VendorName="mocap" )"
      R"(ToolTip="A simulated USB3 Vision camera" StandardNameSpace="U3V" SchemaMajorVersion="1" SchemaMinorVersion="1" )"
      R"(SchemaSubMinorVersion="0" MajorVersion="1" MinorVersion="0" SubMinorVersion="0" )"
      R"(ProductGuid="3f6a1e52-60f4-4f0e-9a5e-0d9d4a3a6c01" VersionGuid="5b0d2c1f-2c5d-4c53-8a6b-6b1a8f1f9e02" )"
      R"(xmlns="http://www.genicam.org/GenApi/Version_1_1">)";
  all += categories();
  all += text("DeviceVendorName", usb3::kManufacturer) + text("DeviceModelName", usb3::kModel) +
         text("DeviceVersion", usb3::kDeviceVersion) + text("DeviceSerialNumber", usb3::kSerial) +
         text("DeviceUserID", usb3::kUserName) + integer("DeviceTemperature", usb3::kTemperature, "RO", 0, 200);
  all += integer("SensorWidth", usb3::kSensorWidth, "RO", 1, width_px) +
         integer("SensorHeight", usb3::kSensorHeight, "RO", 1, height_px) +
         integer("WidthMax", usb3::kSensorWidth, "RO", 1, width_px) +
         integer("HeightMax", usb3::kSensorHeight, "RO", 1, height_px) +
         integer("OffsetX", usb3::kLeft, "RW", 0, width_px) + integer("OffsetY", usb3::kTop, "RW", 0, height_px) +
         integer("Width", usb3::kWidth, "RW", 16, width_px) + integer("Height", usb3::kHeight, "RW", 16, height_px);
  all += choice("PixelFormat", usb3::kPixelFormat,
                {{"Mono8", 0x01080001},
                 {"Mono10", 0x01100003},
                 {"Mono12", 0x01100005},
                 {"Mono10p", 0x010a0046},
                 {"Mono12p", 0x010c0047},
                 {"BayerRG8", 0x01080009}});
  all += choice("AcquisitionMode", usb3::kAcquisitionMode, {{"Continuous", 0}}) +
         command("AcquisitionStart", usb3::kStart) + command("AcquisitionStop", usb3::kStop) +
         real("AcquisitionFrameRate", usb3::kRate_hz, 1.0, 1000.0, "Hz") +
         real("ExposureTime", usb3::kExposure_us, 10.0, 100000.0, "us") + real("Gain", usb3::kGain_db, 0.0, 24.0, "dB");
  all += choice("TriggerSelector", usb3::kTriggerSelector, {{"FrameStart", 0}}) +
         choice("TriggerMode", usb3::kTriggerMode, {{"Off", 0}, {"On", 1}}) +
         choice("TriggerSource", usb3::kTriggerSource, {{"Software", 0}, {"Line0", 1}}) +
         choice("TriggerActivation", usb3::kTriggerActivation, {{"RisingEdge", 0}, {"FallingEdge", 1}}) +
         command("TriggerSoftware", usb3::kTriggerSoftware);
  all += integer("PayloadSize", usb3::kPayload, "RO", 1, kMost);
  return all + R"(<Port Name="Device"></Port></RegisterDescription>)";
}

}  // namespace mocap::sim
