#include "cameras/aravis/usb_bandwidth.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <string>

#include "cameras/aravis/aravis_settings.h"

namespace mocap::cameras {
namespace usb_bandwidth_test {

namespace fs = std::filesystem;
using testing::HasSubstr;

// A folder with the layout of sysfs: two USB3 Vision cameras on one controller, one of them at USB 2 speed, and a
// mouse.
class UsbBandwidth : public testing::Test {
 protected:
  void SetUp() override {
    fs::remove_all(sys_);
    hub("usb1", "480");
    hub("usb2", "5000");
    device("usb2", "2-1", "5000", "A1", "ef", "05");
    device("usb2", "2-2", "5000", "A2", "ef", "05");
    device("usb1", "1-3", "480", "A3", "ef", "05");
    device("usb1", "1-4", "12", "A1", "03", "01");  // a mouse with a camera's serial number
  }
  void TearDown() override { fs::remove_all(sys_); }

  void put(const fs::path& file, const std::string& text) const {
    fs::create_directories(file.parent_path());
    std::ofstream(file) << text << "\n";
  }
  void hub(const std::string& name, const std::string& speed) const {
    put(controller_ / name / "speed", speed);
    fs::create_directories(sys_ / "bus/usb/devices");
    fs::create_directory_symlink(controller_ / name, sys_ / "bus/usb/devices" / name);
  }
  void device(const std::string& hub, const std::string& name, const std::string& speed, const std::string& serial,
              const std::string& interface_class, const std::string& subclass) const {
    const fs::path folder = controller_ / hub / name;
    put(folder / "speed", speed);
    put(folder / "serial", serial);
    put(folder / "manufacturer", "maker");
    put(folder / (name + ":1.0") / "bInterfaceClass", interface_class);
    put(folder / (name + ":1.0") / "bInterfaceSubClass", subclass);
    fs::create_directory_symlink(folder, sys_ / "bus/usb/devices" / name);
  }
  // A hub with two devices.
  void hub_of_two(const std::string& hub_speed) const {
    device("usb2", "2-4", hub_speed, "", "09", "00");
    device("usb2/2-4", "2-4.1", "5000", "A5", "ef", "05");
    device("usb2/2-4", "2-4.2", "5000", "A6", "ef", "05");
  }
  static CameraSettings camera(const std::string& name, const std::string& serial, const std::string& format,
                               double rate_hz) {
    AravisSettings settings;
    settings.serial = serial;
    settings.pixel_format = format;
    settings.width_px = 1920;
    settings.height_px = 1080;
    settings.rate_hz = rate_hz;
    return {name, settings};
  }

  fs::path sys_ = fs::path(testing::TempDir()) / ("sys" + std::to_string(getpid()));
  fs::path controller_ = sys_ / "devices/pci0000:00/0000:00:14.0";
};

TEST_F(UsbBandwidth, SumsTheBandwidthOfTheCamerasOfOneBus) {
  const auto loads =
      usb_loads({camera("left", "A1", "Mono8", 100.0), camera("right", "A2", "Mono12p", 50.0)}, {}, sys_);

  ASSERT_EQ(loads.size(), 1U);
  EXPECT_EQ(loads[0].bus, "usb2");
  EXPECT_EQ(loads[0].controller, "0000:00:14.0");
  // 1920 x 1080 px are 2.0736 MB at 1 byte per pixel: 100 Hz, and 50 Hz with 1.5 bytes per pixel.
  EXPECT_NEAR(loads[0].needed_mb_per_s, 207.36 + 155.52, 1e-9);
  EXPECT_EQ(loads[0].given_mb_per_s, 400.0);
  EXPECT_FALSE(loads[0].too_much());
  EXPECT_THAT(loads[0].text(), HasSubstr("left 207.4 + right 155.5"));
}

TEST_F(UsbBandwidth, ReportsTwoCamerasThatAreTooMuchForOneBus) {
  const auto loads = usb_loads({camera("left", "A1", "Mono8", 100.0), camera("right", "A2", "Mono8", 100.0)}, {}, sys_);

  ASSERT_EQ(loads.size(), 1U);
  EXPECT_TRUE(loads[0].too_much());
}

TEST_F(UsbBandwidth, NamesTheCameraWhoseCableIsSlow) {
  const auto loads = usb_loads({camera("left", "A3", "Mono8", 30.0)}, {}, sys_);

  ASSERT_EQ(loads.size(), 1U);
  EXPECT_TRUE(loads[0].too_much());
  EXPECT_THAT(loads[0].text(), HasSubstr("left is plugged in at 480 Mbit/s, which gives 40 MB/s"));
}

TEST_F(UsbBandwidth, NamesTheHubThatIsTooNarrowForItsCamerasThoughTheBusIsNot) {
  put(controller_ / "usb2/speed", "10000");
  hub_of_two("5000");

  const auto loads = usb_loads({camera("left", "A5", "Mono8", 100.0), camera("right", "A6", "Mono8", 100.0)}, {}, sys_);

  ASSERT_EQ(loads.size(), 1U);
  EXPECT_LT(loads[0].needed_mb_per_s, loads[0].given_mb_per_s);
  EXPECT_TRUE(loads[0].too_much());
  EXPECT_THAT(loads[0].text(),
              HasSubstr("left and right are plugged in by hub 2-4 at 5000 Mbit/s, which gives 400 MB/s"));
}

TEST_F(UsbBandwidth, SumsAllBusesOfAControllerAgainstItsPcieLink) {
  put(controller_ / "current_link_speed", "2.5 GT/s PCIe");
  put(controller_ / "current_link_width", "1");
  // 207.4 MB/s and 31.1 MB/s, each within the limit of its own bus. One lane of 2.5 GT/s carries 250 MB/s, 212 MB/s
  // without packet headers.
  const auto loads = usb_loads({camera("left", "A1", "Mono8", 100.0), camera("right", "A3", "Mono8", 15.0)}, {}, sys_);
  const auto alone = usb_loads({camera("left", "A1", "Mono8", 100.0)}, {}, sys_);

  ASSERT_EQ(loads.size(), 2U);
  EXPECT_TRUE(loads[0].too_much());
  EXPECT_THAT(loads[0].text(), HasSubstr("left and right are on controller 0000:00:14.0 with a narrow PCIe link, which "
                                         "gives 212 MB/s"));
  ASSERT_EQ(alone.size(), 1U);
  EXPECT_FALSE(alone[0].too_much());
}

TEST_F(UsbBandwidth, IgnoresAPcieLinkOfWidthZero) {
  put(controller_ / "current_link_speed", "Unknown");
  put(controller_ / "current_link_width", "0");

  const auto loads = usb_loads({camera("left", "A1", "Mono8", 100.0)}, {}, sys_);

  ASSERT_EQ(loads.size(), 1U);
  EXPECT_FALSE(loads[0].too_much());
}

TEST_F(UsbBandwidth, ListsTheCamerasOfEachBusWithoutAConfiguration) {
  device("usb1", "1-5", "480", "", "0e", "01");  // UVC, without a serial number
  put(controller_ / "usb1/1-5/product", "Webcam");

  const auto lines = usb_buses_of_cameras(sys_);

  ASSERT_EQ(lines.size(), 2U);
  EXPECT_THAT(lines[0], HasSubstr("usb1 of controller 0000:00:14.0 gives 40 MB/s, shared by"));
  EXPECT_THAT(lines[0], HasSubstr("Webcam"));
  EXPECT_THAT(lines[1], HasSubstr("usb2 of controller 0000:00:14.0 gives 400 MB/s, shared by"));
  EXPECT_THAT(lines[1], HasSubstr("A1"));
  EXPECT_THAT(lines[1], HasSubstr("A2"));
}

TEST_F(UsbBandwidth, TakesTheSizeFromTheRigAndReportsAnUnknownRate) {
  CameraSettings without_size = camera("left", "A1", "Mono8", 100.0),
                 without_rate = camera("right", "A2", "Mono8", 100.0);
  without_size.driver.as<AravisSettings>()->width_px.reset();
  without_rate.driver.as<AravisSettings>()->rate_hz.reset();
  CameraModel model;
  model.name = "left";
  model.width_px = 1000;
  model.height_px = 1000;

  const auto loads = usb_loads({without_size, without_rate}, {model}, sys_);

  ASSERT_EQ(loads.size(), 1U);
  EXPECT_NEAR(loads[0].needed_mb_per_s, 108.0, 1e-9);  // 1000 x 1080 at 100 Hz
  EXPECT_THAT(loads[0].text(), HasSubstr("right ?"));
}

TEST_F(UsbBandwidth, IgnoresOtherDevicesAndAbsentCameras) {
  fs::remove(sys_ / "bus/usb/devices/2-1");  // unplugged; a mouse has the same serial number

  EXPECT_TRUE(usb_loads({camera("left", "A1", "Mono8", 100.0)}, {}, sys_).empty());
}

}  // namespace usb_bandwidth_test
}  // namespace mocap::cameras
