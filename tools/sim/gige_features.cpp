#include "gige_features.h"

#include <fmt/format.h>

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

// Bits of the register that holds the packets' size; the first is the highest (GigE Vision 2.0, SCPS).
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

}  // namespace

std::string with_more_features(std::string xml) {
  // GenICam PFNC 2.4.
  const std::string formats = entry("Mono10", 0x01100003) + entry("Mono12", 0x01100005) + entry("Mono10p", 0x010a0046) +
                              entry("Mono12p", 0x010c0047) + entry("Mono10Packed", 0x010c0004) +
                              entry("Mono12Packed", 0x010c0006);
  insert_before(xml, R"(<EnumEntry Name="Mono8")", formats);
  insert_before(xml, "<!-- Port -->",
                test_packets() + ptp() + integer("DeviceTemperature", kTemperature, "RO") +
                    integer("TriggerDelay", kTriggerDelay_us, "RW"));
  constexpr std::string_view kCategory = R"(<Category Name="TransportLayerControl" NameSpace="Standard">)";
  if (const auto at = xml.find(kCategory); at != std::string::npos) {
    xml.insert(at + kCategory.size(),
               "<pFeature>PtpEnable</pFeature><pFeature>PtpStatus</pFeature><pFeature>PtpDataSetLatch</pFeature>"
               "<pFeature>PtpOffsetFromMaster</pFeature><pFeature>DeviceTemperature</pFeature>"
               "<pFeature>TriggerDelay</pFeature><pFeature>GevSCPSFireTestPacket</pFeature>"
               "<pFeature>GevSCPSDoNotFragment</pFeature>");
  }
  return xml;
}

}  // namespace mocap::sim
