#include "gige_features.h"

#include <fmt/format.h>

#include <initializer_list>
#include <string_view>
#include <utility>

namespace mocap::sim {
namespace {

void insert_before(std::string& text, std::string_view place, std::string_view what) {
  if (const auto at = text.find(place); at != std::string::npos) text.insert(at, what);
}

std::string entry(std::string_view name, unsigned value) {
  return fmt::format(R"(<EnumEntry Name="{}" NameSpace="Standard"><Value>{}</Value></EnumEntry>)", name, value);
}

std::string register_at(std::string_view name, unsigned address, std::string_view mode) {
  return fmt::format(
      R"(<IntReg Name="{}" NameSpace="Custom"><Address>0x{:x}</Address><Length>4</Length><AccessMode>{}</AccessMode>)"
      R"(<pPort>Device</pPort><Sign>Signed</Sign><Endianess>BigEndian</Endianess></IntReg>)",
      name, address, mode);
}

std::string integer(std::string_view name, unsigned address, std::string_view mode) {
  return fmt::format(R"(<Integer Name="{0}" NameSpace="Standard"><pValue>{0}Register</pValue></Integer>)", name) +
         register_at(fmt::format("{}Register", name), address, mode);
}

std::string ptp() {
  std::string text = fmt::format(
      R"(<Boolean Name="PtpEnable" NameSpace="Standard"><pValue>PtpEnableRegister</pValue><OnValue>1</OnValue>)"
      R"(<OffValue>0</OffValue></Boolean>{})"
      R"(<Command Name="PtpDataSetLatch" NameSpace="Standard"><pValue>PtpLatchRegister</pValue><CommandValue>1</CommandValue>)"
      R"(</Command>{}<Enumeration Name="PtpStatus" NameSpace="Standard">)",
      register_at("PtpEnableRegister", kPtpEnable, "RW"), register_at("PtpLatchRegister", kPtpLatch, "WO"));
  constexpr const char* kStates[] = {"Initializing", "Faulty",  "Disabled",     "Listening", "PreMaster",
                                     "Master",       "Passive", "Uncalibrated", "Slave"};
  constexpr unsigned kValues[] = {0, 2, kPtpDisabled, 4, 5, 6, 7, 8, kPtpSlave};
  for (std::size_t i = 0; i < std::size(kStates); ++i) text += entry(kStates[i], kValues[i]);
  return text + "<pValue>PtpStatusRegister</pValue></Enumeration>" +
         register_at("PtpStatusRegister", kPtpStatus, "RO") + integer("PtpOffsetFromMaster", kPtpOffset_ns, "RO");
}

// Bits of the packet size register. Bit 0 is the most significant (GigE Vision 2.0, SCPS).
std::string test_packets() {
  std::string text;
  for (const auto& [name, bit] : {std::pair{"GevSCPSFireTestPacket", 0}, std::pair{"GevSCPSDoNotFragment", 1}}) {
    text += fmt::format(
        R"(<Boolean Name="{0}" NameSpace="Standard"><pValue>{0}Register</pValue><OnValue>1</OnValue>)"
        R"(<OffValue>0</OffValue></Boolean><MaskedIntReg Name="{0}Register" NameSpace="Custom"><Address>0xd04</Address>)"
        R"(<Length>4</Length><AccessMode>RW</AccessMode><pPort>Device</pPort><Cachable>NoCache</Cachable><Bit>{1}</Bit>)"
        R"(<Sign>Unsigned</Sign><Endianess>BigEndian</Endianess></MaskedIntReg>)",
        name, bit);
  }
  return text;
}

std::string boolean(std::string_view name, unsigned address) {
  return fmt::format(R"(<Boolean Name="{0}" NameSpace="Standard"><pValue>{0}Register</pValue><OnValue>1</OnValue>)"
                     R"(<OffValue>0</OffValue></Boolean>)",
                     name) +
         register_at(fmt::format("{}Register", name), address, "RW");
}

// A feature whose value stands in a chunk behind the image instead of a register.
std::string chunk(std::string_view name, std::uint32_t id, bool is_float) {
  const std::string_view kind = is_float ? "Float" : "Integer";
  const std::string_view reg = is_float ? "FloatReg" : "IntReg";
  return fmt::format(
      R"(<{1} Name="{0}" NameSpace="Standard"><pValue>{0}InBuffer</pValue></{1}><{2} Name="{0}InBuffer" NameSpace="Custom">)"
      R"(<Address>0x0</Address><Length>8</Length><AccessMode>RO</AccessMode><pPort>{0}Port</pPort>{4})"
      R"(<Endianess>BigEndian</Endianess></{2}><Port Name="{0}Port" NameSpace="Standard"><ChunkID>{3:x}</ChunkID></Port>)",
      name, kind, reg, id, is_float ? "" : "<Sign>Unsigned</Sign>");
}

std::string chunks() {
  return boolean("ChunkModeActive", kChunkMode) + R"(<Enumeration Name="ChunkSelector" NameSpace="Standard">)" +
         entry("Timestamp", 0) + entry("ExposureTime", 1) + entry("FrameID", 2) +
         R"(<pValue>ChunkSelectorInteger</pValue></Enumeration><Integer Name="ChunkSelectorInteger" NameSpace="Custom">)"
         R"(<Value>0</Value></Integer>)" +
         fmt::format(
             R"(<Boolean Name="ChunkEnable" NameSpace="Standard"><pValue>ChunkEnableRegister</pValue><OnValue>1</OnValue>)"
             R"(<OffValue>0</OffValue></Boolean><IntReg Name="ChunkEnableRegister" NameSpace="Custom"><Address>0x{:x}</Address>)"
             R"(<pIndex Offset="0x4">ChunkSelectorInteger</pIndex><Length>4</Length><AccessMode>RW</AccessMode>)"
             R"(<pPort>Device</pPort><Sign>Unsigned</Sign><Endianess>BigEndian</Endianess></IntReg>)",
             kChunkTimestamp) +
         register_at("ChunkBytesRegister", kChunkBytes, "RO") + chunk("ChunkTimestamp", kTimestampChunk, false) +
         chunk("ChunkExposureTime", kExposureChunk, true) + chunk("ChunkFrameID", kFrameIdChunk, false);
}

// Features of one action command and of the clock that schedules it.
std::string actions() {
  return integer("ActionDeviceKey", kActionDeviceKey, "RW") +
         R"(<Integer Name="ActionSelector" NameSpace="Standard"><Value>1</Value><Min>1</Min><Max>1</Max></Integer>)" +
         integer("ActionGroupKey", kActionGroupKey, "RW") + integer("ActionGroupMask", kActionGroupMask, "RW") +
         R"(<Command Name="TimestampLatch" NameSpace="Standard"><pValue>TimestampLatchRegister</pValue>)"
         R"(<CommandValue>2</CommandValue></Command>)" +
         register_at("TimestampLatchRegister", kTimestampLatch, "WO") +
         fmt::format(
             R"(<Integer Name="TimestampLatchValue" NameSpace="Standard"><pValue>TimestampLatchValueRegister</pValue></Integer>)"
             R"(<IntReg Name="TimestampLatchValueRegister" NameSpace="Custom"><Address>0x{:x}</Address><Length>8</Length>)"
             R"(<AccessMode>RO</AccessMode><pPort>Device</pPort><Sign>Unsigned</Sign><Endianess>BigEndian</Endianess></IntReg>)",
             kTimestampHigh);
}

void add_to_category(std::string& xml, std::string_view category, std::initializer_list<std::string_view> names) {
  const auto at = xml.find(category);
  if (at == std::string::npos) return;
  std::string all;
  for (const std::string_view each : names) all += fmt::format("<pFeature>{}</pFeature>", each);
  xml.insert(at + category.size(), all);
}

}  // namespace

std::string with_more_features(std::string xml) {
  // GenICam PFNC 2.4.
  const std::string formats = entry("Mono10", 0x01100003) + entry("Mono12", 0x01100005) + entry("Mono10p", 0x010a0046) +
                              entry("Mono12p", 0x010c0047) + entry("Mono10Packed", 0x010c0004) +
                              entry("Mono12Packed", 0x010c0006);
  insert_before(xml, R"(<EnumEntry Name="Mono8")", formats);
  insert_before(xml, R"(<EnumEntry Name="Software")", entry("Action1", kTriggeredByAction));
  insert_before(xml, R"(<Formula>WIDTH * HEIGHT)", R"(<pVariable Name="CHUNKS">ChunkBytesRegister</pVariable>)");
  constexpr std::string_view kPixels = "((PIXELFORMAT>>16)&amp;0xFF) / 8";
  if (const auto at = xml.find(kPixels); at != std::string::npos) xml.insert(at + kPixels.size(), " + CHUNKS");
  insert_before(xml, "<!-- Port -->",
                test_packets() + ptp() + integer("DeviceTemperature", kTemperature, "RO") +
                    integer("TriggerDelay", kTriggerDelay_us, "RW") + chunks() + actions() +
                    R"(<Category Name="ChunkDataControl" NameSpace="Standard"></Category>)"
                    R"(<Category Name="ActionControl" NameSpace="Standard"></Category>)");
  add_to_category(xml, R"(<Category Name="TransportLayerControl" NameSpace="Standard">)",
                  {"PtpEnable", "PtpStatus", "PtpDataSetLatch", "PtpOffsetFromMaster", "DeviceTemperature",
                   "TriggerDelay", "GevSCPSFireTestPacket", "GevSCPSDoNotFragment"});
  add_to_category(xml, R"(<Category Name="ChunkDataControl" NameSpace="Standard">)",
                  {"ChunkModeActive", "ChunkSelector", "ChunkEnable"});
  add_to_category(xml, R"(<Category Name="ActionControl" NameSpace="Standard">)",
                  {"ActionDeviceKey", "ActionSelector", "ActionGroupKey", "ActionGroupMask"});
  add_to_category(xml, R"(<Category Name="DeviceControl" NameSpace="Standard">)",
                  {"TimestampLatch", "TimestampLatchValue"});
  add_to_category(xml, R"(<Category Name="Root" NameSpace="Standard">)", {"ChunkDataControl", "ActionControl"});
  return xml;
}

}  // namespace mocap::sim
