#include "options.h"

#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "lib/cli/app.h"

namespace mocap::sim {
namespace {

constexpr const char* kAbout =
    "A simulated capture volume: a person with markers moves in front of cameras, and the truth can be written to a "
    "file.\n"
    "Serves GigE Vision cameras on loopback addresses, plugs in USB3 Vision cameras, or writes image folders.";

constexpr const char* kExamples = R"(examples:
  mocap-sim --serve --ring 4 --write-rig rig.toml --write-truth truth.jsonl
      four GigE Vision cameras SIM001.. at 127.0.0.2.., somebody walks once all of them stream
  mocap-sim --folders /tmp/walk --ring 8 --seconds 10 --motion tpose:3,walk:20,wave --write-truth truth.jsonl
      ten seconds of images, one folder a camera
  mocap-sim --serve --rig rig.toml --only 2 --epoch 1000000000
      the second camera alone; others with the same seed and epoch show the same scene
  mocap-sim --v4l2 /dev/video0 /dev/video1 --ring 2 --fps 30
      two cameras of the kernel, as MJPEG (modprobe v4l2loopback devices=2)
  mocap-sim --serve --clock-skew-us 5000 --clock-drift-ppm 50 --delivery-jitter-us 2000 --packet-loss 0.01
      cameras without PTP on a bad network)";

void add_motion(cli::App& app, Options& options) {
  app.add_option(
         "--motion", options.motion,
         "acts with seconds (tpose, apose, walk, wave, jump, spin, crouch, hands; the last act continues), or a .bvh "
         "or .c3d file, or a calibration object wand:0,160,500 or frame:600,400 (mm)")
      ->capture_default_str()
      ->group("Motion");
  app.add_option(
         "--marker-set", options.marker_set,
         "marker set of the body; default: markersets/openmocap18.toml of the shipped ones, for a BVH its joints")
      ->group("Motion");
  app.add_option("--bvh-unit", options.bvh_unit_m,
                 "metres for one unit of a BVH; 0: scale the body to a height of 1.75 m")
      ->check(cli::Range(0.0, 10.0))
      ->group("Motion");
  app.add_option("--tpose", options.t_pose_s, "seconds of T-pose before a BVH begins")
      ->check(cli::Range(0.0, 3600.0))
      ->capture_default_str()
      ->group("Motion");
}

void add_rig(cli::App& app, Options& options) {
  auto* rig =
      app.add_option("--rig", options.rig, "rig file with the cameras")->check(cli::ExistingFile{})->group("Cameras");
  app.add_option("--ring", options.ring.cameras, "number of cameras on a ring")
      ->check(cli::Range(1, 64))
      ->capture_default_str()
      ->excludes(rig)
      ->group("Cameras");
  app.add_option("--ring-radius", options.ring.radius_m, "m")->check(cli::Range(1.0, 50.0))->group("Cameras");
  app.add_option("--ring-height", options.ring.height_m, "m")->check(cli::Range(0.1, 20.0))->group("Cameras");
  app.add_option("--hfov", options.hfov_deg, "horizontal field of view of a ring's cameras, degrees")
      ->check(cli::Range(5.0, 150.0))
      ->group("Cameras");
  app.add_option("--size", options.size_px, "width and height of a ring's images, px")
      ->check(cli::Range(16, 8192))
      ->capture_default_str()
      ->group("Cameras");
  app.add_option("--write-rig", options.write_rig, "write the cameras to this rig file")->group("Cameras");
  app.add_option("--fps", options.rate_hz, "images a second")
      ->check(cli::Range(1.0, 1000.0))
      ->capture_default_str()
      ->group("Cameras");
  app.add_option("--exposure-us", options.exposure_us, "exposure time; a client can change it")
      ->check(cli::Range(1.0, 100000.0))
      ->capture_default_str()
      ->group("Cameras");
}

void add_image(cli::App& app, Options& options) {
  scene::ImageSettings& image = options.image;
  app.add_option("--noise", image.read_noise_grey, "read noise, grey levels")
      ->check(cli::Range(0.0, 50.0))
      ->group("Image");
  app.add_option("--electrons-per-grey", image.electrons_per_grey, "sets the shot noise; 0: none")
      ->check(cli::Range(0.0, 1e6))
      ->group("Image");
  app.add_option("--background", image.background_grey, "grey level")->check(cli::Range(0.0, 255.0))->group("Image");
  app.add_option("--brightness", image.peak_grey, "grey level of a marker; over 255 saturates")
      ->check(cli::Range(1.0, 10000.0))
      ->group("Image");
  app.add_option("--blur", image.point_spread_px, "point spread of the lens, px")
      ->check(cli::Range(0.0, 5.0))
      ->group("Image");
  app.add_option("--marker-mm", options.marker_diameter_mm,
                 "diameter of a marker, mm; its image has a radius of at least 1.5 px")
      ->check(cli::Range(1.0, 200.0))
      ->capture_default_str()
      ->group("Image");
  app.add_option("--clutter", image.clutter, "number of lights that are not markers")
      ->check(cli::Range(0, 200))
      ->group("Image");
  app.add_flag("--empty", image.nobody, "empty volume: only --clutter is visible")->group("Image");
  app.add_flag("--no-occlusion", options.no_occlusion, "the body hides no marker")->group("Image");
  app.add_option("--seed", image.seed, "seed of all random numbers")->capture_default_str()->group("Image");
}

void add_output(cli::App& app, Options& options) {
  auto* serve =
      app.add_flag("--serve", options.serve, "serve GigE Vision cameras until SIGTERM or --seconds")->group("Output");
  auto* usb3 =
      app.add_flag(
             "--usb3", options.usb3,
             "plug in USB3 Vision cameras, each on its own controller dummy_udc.0, dummy_udc.1, ..., with images drawn "
             "in advance (8, or --loop-images), until SIGTERM or --seconds; needs root, dummy_hcd and usb_f_fs")
          ->excludes(serve)
          ->group("Output");
  app.add_flag("--one-controller", options.usb_one_controller,
               "all cameras on one USB2 controller of the host, through usbip-vudc.0, usbip-vudc.1, ... and "
               "vhci_hcd.0; needs these modules (usbip-vudc num=N, vhci-hcd) instead of dummy_hcd")
      ->needs(usb3)
      ->group("Output");
  app.add_option("--v4l2", options.v4l2,
                 "write the images of the cameras to these v4l2loopback devices, with images drawn in advance (8, or "
                 "--loop-images), until SIGTERM or --seconds")
      ->excludes(serve)
      ->group("Output");
  app.add_option("--v4l2-format", options.v4l2_format, "pixel format of --v4l2")
      ->check(cli::IsMember({"MJPEG", "GREY"}))
      ->capture_default_str()
      ->group("Output");
  app.add_option("--folders", options.folders, "write <folder>/<camera>/000000.pgm and timestamps.csv")
      ->excludes(serve)
      ->group("Output");
  app.add_option("--write-truth", options.write_truth, "write the truth as JSON lines, one line for each exposure")
      ->group("Output");
  app.add_option("--seconds", options.seconds, "end after this time, s; default for --folders: 10")
      ->check(cli::Range(0.0, 1e6))
      ->group("Output");
  app.add_option("--first-address", options.first_address, "loopback address of the first camera; the others follow")
      ->check(cli::ValidIPV4{})
      ->capture_default_str()
      ->group("Output");
  app.add_option("--serial-prefix", options.serial_prefix, "serial numbers are this prefix and 001, 002, ...")
      ->capture_default_str()
      ->group("Output");
  app.add_option("--only", options.only, "serve only this camera of the rig (1: the first), at its usual address")
      ->check(cli::Range(1, 64))
      ->needs(serve)
      ->group("Output");
  app.add_option("--epoch", options.epoch_ns,
                 "start of the motion, ns on CLOCK_MONOTONIC; default: when all cameras stream (--start-on-stream)")
      ->needs(serve)
      ->group("Output");
  app.add_flag("--start-on-stream", options.start_on_stream,
               "the default of --serve: the motion starts when all cameras stream; before, its first pose is shown")
      ->needs(serve)
      ->group("Output");
}

void add_faults(cli::App& app, Options& options) {
  app.add_option("--clock-skew-us", options.clock_skew_us,
                 "offset of the camera clocks, with alternating sign from camera to camera")
      ->check(cli::Range(-1e9, 1e9))
      ->group("Faults");
  app.add_option("--clock-drift-ppm", options.clock_drift_ppm, "drift of the camera clocks, with alternating sign")
      ->check(cli::Range(-1000.0, 1000.0))
      ->group("Faults");
  app.add_option("--delivery-jitter-us", options.delivery_jitter_us,
                 "mean delay of an image (exponential distribution)")
      ->check(cli::Range(0.0, 1e6))
      ->group("Faults");
  app.add_option("--packet-loss", options.packet_loss, "share of the packets that are lost, 0.01: one in a hundred")
      ->check(cli::Range(0.0, 0.9))
      ->group("Faults");
  app.add_flag("--no-resend", options.no_resend, "do not answer requests for packet resend")->group("Faults");
  app.add_option("--skip-every", options.skip_every, "every n-th image is exposed but not sent")
      ->check(cli::Range(0, 1000000))
      ->group("Faults");
  app.add_option("--repeat-every", options.repeat_every, "every n-th image is sent twice")
      ->check(cli::Range(0, 1000000))
      ->group("Faults");
  app.add_option("--silent-after", options.silent_after, "stop sending without notice after this number of images")
      ->check(cli::Range(0, 1000000))
      ->group("Faults");
  app.add_option("--loop-images", options.loop_images,
                 "draw this number of images in advance and show them forwards and backwards: saves processor time, "
                 "does not match the truth")
      ->check(cli::Range(0, 10000))
      ->excludes(app.get_option("--write-truth"))
      ->group("Output");
}

}  // namespace

CommandLine read_command_line(int argc, char** argv) {
  CommandLine line;
  Options& options = line.options;
  cli::App app(kAbout, "mocap-sim");
  app.footer(kExamples);
  add_motion(app, options);
  add_rig(app, options);
  add_image(app, options);
  add_output(app, options);
  add_faults(app, options);
  line.exit = app.parse(argc, argv);
  if (line.exit) return line;
  if (!options.serve && !options.usb3 && options.v4l2.empty() && options.folders.empty() && options.write_rig.empty() &&
      options.write_truth.empty()) {
    line.exit = app.fail(
        "nothing to do: say --serve, --usb3, --v4l2 DEVICE, --folders DIR, --write-rig FILE or --write-truth FILE");
    return line;
  }
  options.ring.width_px = options.size_px[0];
  options.ring.height_px = options.size_px[1];
  options.ring.hfov_rad = options.hfov_deg * std::numbers::pi / 180.0;
  options.image.exposure_s = options.exposure_us * 1e-6;
  options.image.marker_radius_m = 0.5e-3 * options.marker_diameter_mm;
  options.image.occlusion = !options.no_occlusion;
  return line;
}

}  // namespace mocap::sim
