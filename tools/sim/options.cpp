#include "options.h"

#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "lib/cli/app.h"

namespace mocap::sim {
namespace {

constexpr const char* kAbout =
    "A simulated capture volume: somebody with markers moves, cameras see it, and the truth is written down.\n"
    "It serves GigE Vision cameras on loopback addresses, plugs in USB3 Vision cameras, or writes image folders.";

constexpr const char* kExamples = R"(Examples:
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
         "acts with seconds (tpose, apose, walk, wave, jump, spin, crouch; the last goes on), or a .bvh or .c3d file, "
         "or wand:0,160,500 or frame:600,400 (mm) to calibrate by")
      ->capture_default_str()
      ->group("Motion");
  app.add_option("--marker-set", options.marker_set,
                 "what the body wears; default: config/markersets/openmocap18.toml, and a BVH's own joints")
      ->group("Motion");
  app.add_option("--bvh-unit", options.bvh_unit_m, "metres of a BVH's unit; 0: so that the body is 1.75 m tall")
      ->check(cli::Range(0.0, 10.0))
      ->group("Motion");
  app.add_option("--tpose", options.t_pose_s, "seconds of T-pose before a BVH begins")
      ->check(cli::Range(0.0, 3600.0))
      ->capture_default_str()
      ->group("Motion");
}

void add_rig(cli::App& app, Options& options) {
  auto* rig =
      app.add_option("--rig", options.rig, "cameras of a rig file")->check(cli::ExistingFile{})->group("Cameras");
  app.add_option("--ring", options.ring.cameras, "so many cameras on a ring")
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
  app.add_option("--write-rig", options.write_rig, "writes the cameras down as a rig file")->group("Cameras");
  app.add_option("--fps", options.rate_hz, "images a second")
      ->check(cli::Range(1.0, 1000.0))
      ->capture_default_str()
      ->group("Cameras");
  app.add_option("--exposure-us", options.exposure_us, "exposure; a client that sets it is obeyed")
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
                 "diameter of a marker; it is never shown with a radius under 1.5 px")
      ->check(cli::Range(1.0, 200.0))
      ->capture_default_str()
      ->group("Image");
  app.add_option("--clutter", image.clutter, "lights that are nobody's marker")
      ->check(cli::Range(0, 200))
      ->group("Image");
  app.add_flag("--empty", image.nobody, "nobody is in the volume: only --clutter shines")->group("Image");
  app.add_flag("--no-occlusion", options.no_occlusion, "the body hides no marker")->group("Image");
  app.add_option("--seed", image.seed, "of all that is random")->capture_default_str()->group("Image");
}

void add_output(cli::App& app, Options& options) {
  auto* serve =
      app.add_flag("--serve", options.serve, "serves GigE Vision cameras until SIGTERM or --seconds")->group("Output");
  auto* usb3 =
      app.add_flag("--usb3", options.usb3,
                   "plugs in USB3 Vision cameras, one a controller dummy_udc.0, dummy_udc.1, ..., with images drawn "
                   "beforehand (8, or --loop-images), until SIGTERM or --seconds; needs root, dummy_hcd and usb_f_fs")
          ->excludes(serve)
          ->group("Output");
  app.add_flag("--one-controller", options.usb_one_controller,
               "all on one USB2 controller of the host, by usbip-vudc.0, usbip-vudc.1, ... and vhci_hcd.0; needs these "
               "modules (usbip-vudc num=N, vhci-hcd) in place of dummy_hcd")
      ->needs(usb3)
      ->group("Output");
  app.add_option(
         "--v4l2", options.v4l2,
         "shows the cameras on these devices of v4l2loopback, with images drawn beforehand (8, or --loop-images), "
         "until SIGTERM or --seconds")
      ->excludes(serve)
      ->group("Output");
  app.add_option("--v4l2-format", options.v4l2_format, "of --v4l2")
      ->check(cli::IsMember({"MJPEG", "GREY"}))
      ->capture_default_str()
      ->group("Output");
  app.add_option("--folders", options.folders, "writes <folder>/<camera>/000000.pgm and timestamps.csv")
      ->excludes(serve)
      ->group("Output");
  app.add_option("--write-truth", options.write_truth, "JSON lines, one an exposure")->group("Output");
  app.add_option("--seconds", options.seconds, "ends after so long; --folders: 10 where not given")
      ->check(cli::Range(0.0, 1e6))
      ->group("Output");
  app.add_option("--first-address", options.first_address, "loopback address of the first camera; the others follow")
      ->check(cli::ValidIPV4{})
      ->capture_default_str()
      ->group("Output");
  app.add_option("--serial-prefix", options.serial_prefix, "serial numbers are this and 001, 002, ...")
      ->capture_default_str()
      ->group("Output");
  app.add_option("--only", options.only, "serves this camera of the rig alone (1: the first), at its own address")
      ->check(cli::Range(1, 64))
      ->needs(serve)
      ->group("Output");
  app.add_option("--epoch", options.epoch_ns,
                 "ns on CLOCK_MONOTONIC when the motion begins; default: when all cameras stream, and until then its "
                 "first instant is held (--start-on-stream)")
      ->needs(serve)
      ->group("Output");
  app.add_flag("--start-on-stream", options.start_on_stream,
               "the default of --serve: the motion begins when all cameras stream")
      ->needs(serve)
      ->group("Output");
}

void add_faults(cli::App& app, Options& options) {
  app.add_option("--clock-skew-us", options.clock_skew_us,
                 "the cameras' clocks are off by this, every second one the other way")
      ->check(cli::Range(-1e9, 1e9))
      ->group("Faults");
  app.add_option("--clock-drift-ppm", options.clock_drift_ppm, "and run too fast by this, or too slow")
      ->check(cli::Range(-1000.0, 1000.0))
      ->group("Faults");
  app.add_option("--delivery-jitter-us", options.delivery_jitter_us,
                 "images leave late by a random time of this mean (exponential)")
      ->check(cli::Range(0.0, 1e6))
      ->group("Faults");
  app.add_option("--packet-loss", options.packet_loss, "share of the packets that never arrive, 0.01: one in a hundred")
      ->check(cli::Range(0.0, 0.9))
      ->group("Faults");
  app.add_flag("--no-resend", options.no_resend, "packets are not sent again")->group("Faults");
  app.add_option("--skip-every", options.skip_every, "each n-th image is exposed and never sent")
      ->check(cli::Range(0, 1000000))
      ->group("Faults");
  app.add_option("--repeat-every", options.repeat_every, "each n-th image is sent twice")
      ->check(cli::Range(0, 1000000))
      ->group("Faults");
  app.add_option("--silent-after", options.silent_after,
                 "so many images after a client began, no more are sent, without a word")
      ->check(cli::Range(0, 1000000))
      ->group("Faults");
  app.add_option("--loop-images", options.loop_images,
                 "so many images are drawn beforehand and shown to and fro: spares the processor, fits no truth")
      ->check(cli::Range(0, 10000))
      ->excludes(app.get_option("--write-truth"))
      ->group("Output");
}

}  // namespace

CommandLine read_command_line(int argc, char** argv) {
  CommandLine line;
  Options& options = line.options;
  cli::App app(kAbout);
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
