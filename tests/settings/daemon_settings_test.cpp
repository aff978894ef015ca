#include "settings/daemon_settings.h"

#include <gmock/gmock.h>

#include "base/install_folders.h"
#include "cameras/aravis/aravis_settings.h"
#include "settings/rig/rig_file.h"
#include "settings/subject/marker_set_file.h"
#include "settings/subject/subject_file.h"
#include "support/places.h"
#include "support/temporary_folder.h"

namespace mocap::settings {
namespace daemon_settings_test {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

const std::filesystem::path kConfig = std::filesystem::path(support::source_folder()) / "config";

// A subject and a camera whose marker set is a shipped one.
constexpr const char* kShippedSet = R"(
[[subject]]
name = "actor"
marker_set = "markersets/openmocap18.toml"
[[camera]]
name = "east"
driver = "synthetic"
marker_set = "markersets/openmocap18.toml"
)";

class Configuration : public testing::Test {
 protected:
  Configuration() {
    CameraModel camera;
    camera.width_px = 640;
    camera.height_px = 480;
    camera.lens.fx_px = camera.lens.fy_px = 500.0;
    Rig rig(2, camera);
    rig[0].name = "west";
    rig[1].name = "east";
    EXPECT_TRUE(save_rig(folder_.path() / "rig.toml", rig, {}));
    marker_set_ = (kConfig / "markersets/openmocap18.toml").string();
  }

  std::filesystem::path write(const std::string& text) { return folder_.write("daemon.toml", text); }

  std::string faults_of(const std::string& text) {
    const auto settings = load_daemon_settings(write(text));
    return settings ? "" : to_text(settings.error());
  }

  std::string camera(const std::string& name, const std::string& more = "") const {
    return "[[camera]]\nname = \"" + name + "\"\ndriver = \"synthetic\"\nmarker_set = \"" + marker_set_ + "\"\n" + more;
  }

  /// A configuration without faults; `more` comes before its camera.
  std::string good(const std::string& more = "") const {
    return "[capture]\nrig = \"rig.toml\"\n" + more + camera("east");
  }

  support::TemporaryFolder folder_;
  std::string marker_set_;
};

TEST_F(Configuration, IsReadWithTheRigInTheOrderOfTheCameras) {
  const auto settings = load_daemon_settings(
      write("[capture]\nrig = \"rig.toml\"\n[align]\nwindow_us = 250\n" + camera("east") + camera("west") +
            "[[subject]]\nname = \"actor\"\nmarker_set = \"" + marker_set_ + "\"\n"));

  ASSERT_TRUE(settings) << to_text(settings.error());
  ASSERT_EQ(settings->rig.size(), 2U);
  EXPECT_EQ(settings->rig[0].name, "east");
  EXPECT_EQ(settings->rig[1].name, "west");
  EXPECT_EQ(settings->pipeline.align.window, std::chrono::microseconds(250));
  EXPECT_EQ(settings->nominal_rate_hz, 60.0);
  ASSERT_EQ(settings->subject_models.size(), 1U);
  EXPECT_EQ(settings->subject_models[0].marker_set.markers.size(), 18U);
  ASSERT_EQ(settings->simulated.size(), 2U);
  EXPECT_EQ(settings->simulated[1].markers.size(), 18U);
}

TEST_F(Configuration, FindsAShippedMarkerSetThatIsNotBesideIt) {
  const auto settings = load_daemon_settings(write("[capture]\nrig = \"rig.toml\"\n" + std::string(kShippedSet)));

  ASSERT_TRUE(settings) << to_text(settings.error());
  EXPECT_EQ(settings->subjects[0].marker_set_file, install_folders().data / "markersets/openmocap18.toml");
  EXPECT_EQ(settings->subject_models[0].marker_set.markers.size(), 18U);
  EXPECT_EQ(settings->simulated[0].markers.size(), 18U);
}

TEST_F(Configuration, PrefersTheMarkerSetBesideIt) {
  std::filesystem::create_directory(folder_.path() / "markersets");
  std::filesystem::copy(kConfig / "markersets/rigid4.toml", folder_.path() / "markersets/openmocap18.toml");

  const auto settings = load_daemon_settings(write("[capture]\nrig = \"rig.toml\"\n" + std::string(kShippedSet)));

  ASSERT_TRUE(settings) << to_text(settings.error());
  EXPECT_EQ(settings->subjects[0].marker_set_file, folder_.path() / "markersets/openmocap18.toml");
  EXPECT_EQ(settings->subject_models[0].marker_set.markers.size(), 4U);  // its skeleton is the shipped one
}

TEST_F(Configuration, NamesBothPlacesOfAMissingMarkerSet) {
  const std::string faults = faults_of(good("[[subject]]\nname = \"actor\"\nmarker_set = \"sets/none.toml\"\n"));

  EXPECT_THAT(faults, HasSubstr("daemon.toml:5:14: subject 'actor': marker_set: neither " +
                                (folder_.path() / "sets/none.toml").string() + " nor " +
                                (install_folders().data / "sets/none.toml").string() + " exists"));
}

TEST_F(Configuration, RefusesRigidBodiesOfOneShapeAndAllowsPeopleWithOneMarkerSet) {
  const auto subject = [&](const std::string& name, const std::string& set) {
    return "[[subject]]\nname = \"" + name + "\"\nmarker_set = \"" + (kConfig / "markersets" / set).string() + "\"\n";
  };

  const std::string things = faults_of(good() + subject("sword", "rigid4.toml") + subject("shield", "rigid4.toml"));
  const std::string people = faults_of(good() + subject("ann", "baseline41.toml") + subject("bob", "baseline41.toml"));
  const std::string one = faults_of(good() + subject("sword", "rigid4.toml") + subject("ann", "baseline41.toml"));

  EXPECT_THAT(things,
              AllOf(HasSubstr("subject 'shield' has the shape of subject 'sword'"), HasSubstr("move one marker")));
  EXPECT_EQ(people, "");
  EXPECT_EQ(one, "");
}

TEST_F(Configuration, ListsAllFaultsAtOnceWithPlacesAndSuggestions) {
  const std::string faults = faults_of(R"([capture]
rig = "rig.toml"
[algin]
window_us = 1
[align]
windw_us = 500
patience_us = "soon"
[[camera]]
name = "east"
driver = "synthetic"
motion = "walk"
exposure_us = 0
[[camera]]
name = "weft"
driver = "v4l"
[[camera]]
name = "east"
driver = "aravis"
)");

  const std::string file = (folder_.path() / "daemon.toml").string();
  EXPECT_EQ(
      faults,
      file + ":3:2: unknown key 'algin', did you mean 'align'?\n" +                                      //
          file + ":6:1: align: unknown key 'windw_us', did you mean 'window_us'?\n" +                    //
          file + ":7:15: align: patience_us is 'soon', expected a number, 0 to 10000000\n" +             //
          file + ":8:1: camera 'east': marker_set is missing, expected a file of config/markersets\n" +  //
          file + ":12:15: camera 'east': exposure_us is 0, expected 1 to 1000000\n" +                    //
          file + ":14:8: camera 'weft': is not in the rig " + (folder_.path() / "rig.toml").string() +   //
          ", did you mean 'west'?\n" +                                                                   //
          file +
          ":15:10: camera 'weft': driver is 'v4l', expected one of aravis, v4l2, replay, synthetic, tcp, node; "  //
          "did you mean 'v4l2'?\n" +                                                                              //
          file +
          ":16:1: camera 'east': 0 of serial, device_name, address and mac are set, expected exactly one\n" +  //
          file + ":17:8: camera 'east': name 'east' is there twice, expected a different one each\n" +         //
          file + ": 9 faults, nothing started");
}

TEST_F(Configuration, MayHaveKeysWithTheirFormerNames) {
  const auto settings = load_daemon_settings(
      write(good("[track]\nbirth_speed_px_s = 300\n[track_markers]\nmax_agility = 9\nbirth_speed_m_s = 3\n"
                 "[label]\ntie_slack_mm = 30\n")));

  ASSERT_TRUE(settings) << to_text(settings.error());
  EXPECT_EQ(settings->track_blobs.initial_speed_px_s, 300.0);
  EXPECT_EQ(settings->track_markers.max_noise_scale, 9.0);
  EXPECT_EQ(settings->track_markers.initial_speed_m_s, 3.0);
  EXPECT_DOUBLE_EQ(settings->label.distance_tolerance_m, 0.03);
}

TEST_F(Configuration, RefusesAKeyWithItsFormerNameToo) {
  EXPECT_THAT(faults_of(good("[label]\ntie_slack_mm = 30\ndistance_tolerance_mm = 30\n")),
              HasSubstr("daemon.toml:4:16: label: tie_slack_mm is the former name of distance_tolerance_mm, expected "
                        "one of them"));
}

TEST_F(Configuration, IsRefusedIfItIsAnotherKindOfFile) {
  const auto faults_of_file = [](const std::filesystem::path& file) {
    const auto settings = load_daemon_settings(file);
    return settings ? std::string() : to_text(settings.error());
  };

  EXPECT_THAT(faults_of_file(kConfig / "demo.rig.toml"),
              AllOf(HasSubstr("demo.rig.toml:1:1: this looks like a rig file; give the configuration"),
                    HasSubstr(": 1 fault,")));
  EXPECT_THAT(faults_of_file(kConfig / "markersets" / "rigid3.toml"), HasSubstr("this looks like a marker set"));
  EXPECT_THAT(faults_of_file(kConfig / "skeletons" / "human18.toml"), HasSubstr("this looks like a skeleton"));
}

TEST_F(Configuration, NamesMisspeltRequiredKeys) {
  const std::string faults = faults_of(R"([capture]
rigg = "rig.toml"
[[camera]]
nam = "east"
driver = "synthetic"
[[camera]]
name = "west"
drvier = "synthetic"
[[subject]]
name = "anna"
marker_sett = "set.toml"
)");

  EXPECT_THAT(faults, HasSubstr(":2:1: capture: unknown key 'rigg', did you mean 'rig'?"));
  EXPECT_THAT(faults, HasSubstr("unknown key 'nam', did you mean 'name'?"));
  EXPECT_THAT(faults, HasSubstr(":8:1: camera 'west': unknown key 'drvier', did you mean 'driver'?"));
  EXPECT_THAT(faults, HasSubstr(":11:1: subject 'anna': unknown key 'marker_sett', did you mean 'marker_set'?"));
  for (const char* key : {"rig", "name", "driver"}) {
    EXPECT_EQ(faults.find(std::string(key) + " is missing"), std::string::npos) << faults;
  }
  EXPECT_EQ(faults.find("subject 'anna': marker_set is missing"), std::string::npos) << faults;
}

TEST_F(Configuration, SaysThatACameraNeedsTwoBrackets) {
  const std::string faults = faults_of("[capture]\nrig = \"rig.toml\"\n[camera]\nname = \"east\"\n");

  EXPECT_THAT(faults, HasSubstr(":3:1: [camera] has one bracket, expected [[camera]]"));
  EXPECT_THAT(faults, HasSubstr(": 1 fault,"));
}

TEST_F(Configuration, IsRefusedIfTimesContradictEachOther) {
  EXPECT_THAT(faults_of(good("[align]\nwindow_us = 8334\n")),
              HasSubstr(":4:13: align: window_us is 8334, expected less than half a frame period, 8333 at 60 Hz"));
  EXPECT_EQ(faults_of(good("[align]\nwindow_us = 8000\n")), "");
  EXPECT_THAT(faults_of("[capture]\nrig = \"rig.toml\"\n" + camera("east", "exposure_us = 16667\n")),
              HasSubstr("exposure_us is 16667, expected less than the period of 16667 us at 60 Hz"));
  EXPECT_THAT(faults_of(good("[reopen]\nfirst_backoff_ms = 3000\n")),
              HasSubstr(":4:20: reopen: first_backoff_ms is 3000, over longest_backoff_ms = 2000"));
}

TEST_F(Configuration, IsRefusedIfTheRigHasAnotherImageSize) {
  EXPECT_THAT(faults_of("[capture]\nrig = \"rig.toml\"\n" + camera("east", "width_px = 1280\n")),
              AllOf(HasSubstr(":7:12: camera 'east': size is 1280x480 px"), HasSubstr("made at 640x480")));
}

TEST_F(Configuration, IsRefusedWithoutARig) {
  EXPECT_THAT(faults_of(camera("east")), HasSubstr("rig is missing, expected the calibration file of the cameras"));
  EXPECT_THAT(faults_of("[capture]\nrig = \"none.toml\"\n" + camera("east")),
              AllOf(HasSubstr(":2:7: capture: rig: "), HasSubstr("none.toml: no such file")));
}

TEST_F(Configuration, ListsTheFaultsOfTheRigWithTheirPlacesInTheRigFile) {
  folder_.write("rig.toml", "[east]\nsize = [640, 480]\n");

  EXPECT_THAT(faults_of(good()),
              HasSubstr((folder_.path() / "rig.toml").string() + ":1:1: camera 'east': matrix is missing"));
}

TEST_F(Configuration, ListsTheFaultsOfAMarkerSetOnceWithTheirPlacesInItsFile) {
  const auto set = folder_.write("set.toml", "name = \"set\"\nskelton = \"x\"\n").string();
  marker_set_ = set;
  const std::string faults = faults_of("[capture]\nrig = \"rig.toml\"\n" + camera("east") + camera("west"));

  const std::size_t first = faults.find(set + ":2:1: ");
  EXPECT_NE(first, std::string::npos) << faults;
  EXPECT_EQ(faults.find(set + ":2:1: ", first + 1), std::string::npos) << faults;
  EXPECT_THAT(faults, HasSubstr("daemon.toml:6:14: camera 'east': marker_set is '" + set + "', which has faults"));
}

TEST_F(Configuration, ShowsTheBeginningOfAValueOfAnySize) {
  std::string value;
  for (int i = 0; i < 150'000; ++i) value += "\u00e4";
  const std::string bone = "name = \"set\"\n[[bone]]\nname = \"Hips\"\n[[marker]]\nname = \"M\"\nbone = \"Hips\"\n";
  const auto set = folder_.write("set.toml", bone + "offset_m = \"" + value + "\"\n").string();
  marker_set_ = set;

  const std::string faults = faults_of(good());

  EXPECT_THAT(faults, HasSubstr(set + ":7:12: "));
  EXPECT_THAT(faults, HasSubstr("\u00e4..., expected 3 numbers"));
  EXPECT_LT(faults.size(), 2000U);
}

TEST_F(Configuration, AcceptsAnyFeatureOfACameraInTheOrderOfTheFile) {
  const std::string rig = "[capture]\nrig = \"rig.toml\"\n[[camera]]\nname = \"east\"\n";
  const std::string aravis = rig + "driver = \"aravis\"\nmac = \"00:11:1c:f5:a0:01\"\n";

  const auto settings = load_daemon_settings(write(
      aravis + "features = { LineSelector = \"Line1\", LineMode = \"Output\", Delay = 2.5, Invert = true, N = 7 }\n"));

  ASSERT_TRUE(settings) << to_text(settings.error());
  const auto& camera = *settings->cameras[0].driver.as<cameras::AravisSettings>();
  const std::vector<cameras::Feature> expected{
      {"LineSelector", "Line1"}, {"LineMode", "Output"}, {"Delay", "2.5"}, {"Invert", "true"}, {"N", "7"}};
  EXPECT_EQ(camera.features, expected);
  EXPECT_THAT(faults_of(aravis + "features = [1]\n"), HasSubstr("features is a list of 1, expected a table"));
  EXPECT_THAT(faults_of(aravis + "features = { A = [1] }\n"), HasSubstr("A is a list of 1, expected a word"));
}

TEST_F(Configuration, AcceptsEveryTriggerThatTheDriverKnows) {
  const std::string aravis =
      "[capture]\nrig = \"rig.toml\"\n[[camera]]\nname = \"east\"\ndriver = \"aravis\"\nserial = \"DA1\"\n";
  for (const char* trigger : {"free_run", "software", "action", "Line0", "Line12"}) {
    EXPECT_EQ(faults_of(aravis + "rate_hz = 100\ntrigger = \"" + trigger + "\"\n"), "");
  }
  EXPECT_THAT(faults_of(aravis + "trigger = \"action\"\n"),
              HasSubstr(":7:11: camera 'east': trigger = \"action\" needs rate_hz"));
  EXPECT_THAT(faults_of(aravis + "trigger = \"Lin0\"\n"),
              HasSubstr("trigger is 'Lin0', expected one of free_run, software, action, Line<n>"));
}

TEST_F(Configuration, AcceptsAVideoCameraByItsSerialNumberOrItsPort) {
  const std::string v4l2 = "[capture]\nrig = \"rig.toml\"\n[[camera]]\nname = \"east\"\ndriver = \"v4l2\"\n";
  EXPECT_EQ(faults_of(v4l2 + "serial = \"3F2A11\"\n"), "");
  EXPECT_EQ(faults_of(v4l2 + "bus = \"usb-0000:00:14.0-2\"\n"), "");
  EXPECT_THAT(faults_of(v4l2 + "bus = \"a\"\nserial = \"b\"\n"),
              HasSubstr("2 of device, serial and bus are set, expected exactly one"));
  EXPECT_THAT(faults_of(v4l2), HasSubstr("device is missing"));
}

TEST_F(Configuration, RefusesOneDeviceAsTwoCameras) {
  const std::string aravis = "driver = \"aravis\"\nserial = \"DA1\"\n";
  EXPECT_THAT(faults_of("[capture]\nrig = \"rig.toml\"\n[[camera]]\nname = \"east\"\n" + aravis +
                        "[[camera]]\nname = \"west\"\n" + aravis),
              HasSubstr(":10:10: camera 'west': serial 'DA1' is there twice"));
}

TEST_F(Configuration, RefusesValuesThatWouldFailAtTheStart) {
  EXPECT_THAT(faults_of(good("[publish]\nendpoint = \"tcp://0.0.0.0:5570\"\n")), HasSubstr(":4:12: publish: "));
  EXPECT_THAT(faults_of(good("[record]\nsnapshots = \"run.csv\"\n")), HasSubstr("that ends in .jsonl or .pb"));
  EXPECT_THAT(faults_of(good("[detect]\nmin_area_px2 = 9\nmax_area_px2 = 8\n")),
              HasSubstr(":4:16: detect: min_area_px2 is 9, over max_area_px2 = 8"));
}

TEST_F(Configuration, UsesTheThresholdsOfACamerasOwnTableBeforeThoseOfDetect) {
  const auto settings = load_daemon_settings(
      write("[capture]\nrig = \"rig.toml\"\n[detect]\nthreshold = 100\nlow_threshold = 30\nmin_area_px2 = 7\n" +
            camera("east", "threshold = 60\nlow_threshold = 20\n") + camera("west", "threshold = 0\n")));

  ASSERT_TRUE(settings) << to_text(settings.error());
  const detect::DetectSettings east = detect_of(*settings, CameraId{0});
  const detect::DetectSettings west = detect_of(*settings, CameraId{1});
  EXPECT_EQ(east.threshold, 60.0);
  EXPECT_EQ(east.low_threshold, 20.0);
  EXPECT_EQ(east.min_area_px2, 7.0);
  EXPECT_EQ(west.threshold, std::nullopt) << "0: estimated from the noise";
  EXPECT_EQ(west.low_threshold, 30.0);
}

TEST_F(Configuration, RefusesALowThresholdOfACameraOverItsThreshold) {
  const std::string both = "[capture]\nrig = \"rig.toml\"\n[detect]\nthreshold = 100\nlow_threshold = 50\n";
  EXPECT_THAT(faults_of(both + camera("east", "threshold = 40\n")),
              HasSubstr(":10:13: camera 'east': low_threshold is 50 for this camera, over its threshold, 40"));
  EXPECT_EQ(faults_of(both + camera("east", "threshold = 40\nlow_threshold = 40\n")), "");
  EXPECT_THAT(faults_of(both + camera("east", "threshold = 0.5\n")),
              HasSubstr(":10:13: camera 'east': threshold is 0.5, expected 1 to 255, or 0: from the noise"));
}

TEST_F(Configuration, RefusesAPixelFormatAndListsTheSupportedOnes) {
  const std::string rig = "[capture]\nrig = \"rig.toml\"\n[[camera]]\nname = \"east\"\n";
  EXPECT_THAT(faults_of(rig + "driver = \"aravis\"\nserial = \"DA1\"\npixel_format = \"BayerRG12\"\n"),
              HasSubstr(":7:16: camera 'east': pixel_format is 'BayerRG12', expected one of Mono8, Mono10, Mono12, "
                        "Mono10p, Mono12p, Mono10Packed, Mono12Packed, BayerGR8, BayerRG8, BayerGB8, BayerBG8; did you "
                        "mean 'BayerRG8'?"));
  EXPECT_THAT(faults_of(rig + "driver = \"v4l2\"\ndevice = \"/dev/video0\"\npixel_format = \"H264\"\n"),
              HasSubstr("expected one of GREY, Y10, Y12, GRBG, RGGB, GBRG, BA81, YUYV, NV12, MJPEG"));
  EXPECT_EQ(faults_of(rig + "driver = \"aravis\"\nserial = \"DA1\"\npixel_format = \"Mono12Packed\"\n"), "");
}

TEST_F(Configuration, WithoutACameraIsRefused) {
  EXPECT_THAT(faults_of("[capture]\nrig = \"rig.toml\"\n"), HasSubstr("no [[camera]], expected at least one"));
  EXPECT_THAT(faults_of(""), HasSubstr("no [[camera]], expected at least one"));
}

TEST_F(Configuration, ThatIsNoTomlHasOneFaultWithItsPlace) {
  EXPECT_THAT(faults_of("[capture]\nrig = rig.toml\n"), HasSubstr("daemon.toml:2:7: "));
  EXPECT_THAT(faults_of("[capture]\nrig = \"a\"\nrig = \"b\"\n"), HasSubstr("daemon.toml:3:"));
  EXPECT_THAT(faults_of(std::string("\xff\xfe\0\0", 4)), HasSubstr("daemon.toml:1:1: "));
}

TEST_F(Configuration, RefusesValuesThatAreNotNumbersWithinRange) {
  EXPECT_THAT(faults_of(good("[align]\nwindow_us = nan\n")), HasSubstr("window_us is nan, expected 1 to 1000000"));
  EXPECT_THAT(faults_of(good("[queues]\ncamera_frames = 8.5\n")),
              HasSubstr("is 8.5, expected a whole number, 2 to 1024"));
  EXPECT_THAT(faults_of(good("[queues]\ncamera_frames = 9223372036854775807\n")), HasSubstr("expected 2 to 1024"));
  EXPECT_THAT(faults_of(good("[realtime]\ncamera_cpus = [0, -1]\n")),
              HasSubstr(":4:19: realtime: camera_cpus has -1, expected a list of whole numbers 0 to 1023"));
  EXPECT_THAT(faults_of(good("align = 3\n")), HasSubstr("unknown key 'align'"));
}

TEST_F(Configuration, AcceptsABodyThatIsFittedAlready) {
  SubjectFile anna{.name = "anna",
                   .marker_set_file = marker_set_,
                   .fitted_on = "",
                   .marker_set = {},
                   .bone_residuals_m = {},
                   .marker_residuals_m = {}};
  anna.marker_set = *load_marker_set(marker_set_);
  anna.marker_set.markers[2].offset_m.x() = 0.125;
  ASSERT_TRUE(save_subject(folder_.path() / "anna.toml", anna));
  const std::string subject = "[[subject]]\nname = \"actor\"\n";
  const std::string set = "marker_set = \"" + marker_set_ + "\"\n";

  const auto by_file = load_daemon_settings(write(good(subject + "file = \"anna.toml\"\n")));
  const auto by_keep = load_daemon_settings(write(good(subject + "keep = \"anna.toml\"\n" + set)));
  const auto to_be_kept = load_daemon_settings(write(good(subject + "keep = \"new.toml\"\n" + set)));

  for (const auto* stored : {&by_file, &by_keep}) {
    ASSERT_TRUE(*stored) << to_text(stored->error());
    EXPECT_TRUE((*stored)->subject_models[0].fitted);
    EXPECT_EQ((*stored)->subject_models[0].name, "actor");
    EXPECT_EQ((*stored)->subject_models[0].marker_set.markers[2].offset_m.x(), 0.125);
  }
  EXPECT_TRUE(by_file->kept.empty());
  ASSERT_TRUE(to_be_kept) << to_text(to_be_kept.error());
  EXPECT_FALSE(to_be_kept->subject_models[0].fitted);
  ASSERT_EQ(to_be_kept->kept.size(), 1U);
  EXPECT_EQ(to_be_kept->kept[0].path, folder_.path() / "new.toml");

  const std::string other = (kConfig / "markersets/baseline41.toml").string();
  EXPECT_THAT(faults_of(good(subject + "file = \"anna.toml\"\nmarker_set = \"" + other + "\"\n")),
              HasSubstr("was fitted with 'openmocap18'; expected one and the same"));
  EXPECT_THAT(faults_of(good(subject + "file = \"bert.toml\"\n")), HasSubstr("bert.toml"));
  EXPECT_THAT(faults_of(good(subject + "file = \"anna.toml\"\n[[subject]]\nname = \"twin\"\nfile = \"anna.toml\"\n")),
              HasSubstr("subject 'twin' is fitted to the same body as subject 'actor'"));
}

TEST_F(Configuration, RefusesRigidBodiesThatCannotBeDistinguished) {
  const auto thing = [](const std::string& name, const std::string& set) {
    return "[[subject]]\nname = \"" + name + "\"\nmarker_set = \"" + (kConfig / "markersets" / set).string() + "\"\n";
  };

  EXPECT_EQ(faults_of(good(thing("ball", "rigid4.toml") + thing("stick", "rigid5.toml") + thing("box", "rigid3.toml"))),
            "");
  EXPECT_THAT(faults_of(good(thing("ball", "rigid4.toml") + thing("bat", "rigid4.toml"))),
              HasSubstr("subject 'bat' has the shape of subject 'ball'"));
}

TEST(ShippedConfiguration, HasNoFault) {
  for (const char* name : {"mocapd.toml", "demo.toml"}) {
    const auto settings = load_daemon_settings(kConfig / name);
    EXPECT_TRUE(settings) << to_text(settings.error());
  }
}

}  // namespace daemon_settings_test
}  // namespace mocap::settings
