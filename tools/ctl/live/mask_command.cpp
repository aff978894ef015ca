#include "ctl/live/mask_command.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <cstdio>
#include <utility>

#include "base/exit_codes.h"
#include "base/time.h"
#include "ctl/live/live_answer.h"
#include "ctl/live/live_connection.h"

namespace mocap::ctl {
namespace {

constexpr double kAnswerMargin_s = 10.0;  // the daemon saves the masks and loads its configuration anew

double longest_wait_s(std::uint32_t images) { return to_s(longest_learning(images)) + kAnswerMargin_s; }

int fail_mask(const std::string& why, int code) {
  fmt::print(stderr, "mocapctl: {}\n", why);
  return code;
}

int finish(const v1::Answer& answer, const LiveOptions& options) {
  print_answer(answer, options.json, false);
  if (answer.code() != v1::CODE_DONE && !options.json) fmt::print(stderr, "mocapctl: {}\n", answer.message());
  return exit_code_of(answer.code());
}

std::vector<MaskPolygon> drawn_in(const v1::Answer& answer) {
  std::vector<MaskPolygon> all;
  for (const v1::MaskPolygon& drawn : answer.masks().cameras(0).drawn()) {
    MaskPolygon& polygon = all.emplace_back();
    for (int i = 0; i < drawn.x_px_size(); ++i) polygon.push_back({{drawn.x_px(i), drawn.y_px(i)}});
  }
  return all;
}

// Asks for the drawn masks of the camera, lets `edit` change them, and sends them back.
template <class Edit>
int change_drawn(const LiveOptions& options, const Edit& edit) {
  auto client = connect(options);
  if (!client) return fail_mask(client.error().message, client.error().exit);
  ControlRequest request = options.request;
  request.action = ControlAction::GetMasks;
  const auto listed = ask_once(**client, request, options.timeout_s);
  if (!listed) return fail_mask(listed.error().message, listed.error().exit);
  if (listed->code() != v1::CODE_DONE || listed->masks().cameras_size() != 1) return finish(*listed, options);
  request.action = ControlAction::DrawMasks;
  request.polygons = drawn_in(*listed);
  if (const Status edited = edit(request.polygons); !edited) return fail_mask(edited.error().message, kExitUsage);
  const auto answer = ask_once(**client, request, options.timeout_s);
  if (!answer) return fail_mask(answer.error().message, answer.error().exit);
  return finish(*answer, options);
}

int draw_masks(const LiveOptions& options) {
  std::vector<MaskPolygon> added;
  for (const auto& [texts, read] :
       {std::pair(&options.rectangles, &rectangle_of), std::pair(&options.polygons, &polygon_of)}) {
    for (const std::string& text : *texts) {
      Result<MaskPolygon> polygon = read(text);
      if (!polygon) return fail_mask(polygon.error().message, kExitUsage);
      added.push_back(*std::move(polygon));
    }
  }
  if (added.empty())
    return fail_mask("nothing to draw, expected --rectangle X,Y,W,H or --polygon X,Y,X,Y,X,Y", kExitUsage);
  return change_drawn(options, [&](std::vector<MaskPolygon>& drawn) {
    drawn.insert(drawn.end(), added.begin(), added.end());
    return Status{};
  });
}

int remove_masks(const LiveOptions& options) {
  return change_drawn(options, [&](std::vector<MaskPolygon>& drawn) -> Status {
    if (options.all) {
      drawn.clear();
      return {};
    }
    if (options.number < 1 || options.number > drawn.size()) {
      return Error{
          ErrorCode::InvalidArgument,
          fmt::format("camera '{}' has {} drawn masks, expected a number from 1 to that of mocapctl mask list, or "
                      "--all",
                      options.request.name, drawn.size())};
    }
    drawn.erase(drawn.begin() + static_cast<std::ptrdiff_t>(options.number) - 1);
    return {};
  });
}

int ask_about_masks(const LiveOptions& options, ControlAction action) {
  auto client = connect(options);
  if (!client) return fail_mask(client.error().message, client.error().exit);
  ControlRequest request = options.request;
  request.action = action;
  const auto answer = ask_once(**client, request, options.timeout_s);
  if (!answer) return fail_mask(answer.error().message, answer.error().exit);
  return finish(*answer, options);
}

void add_learn(cli::App& mask, LiveOptions& options) {
  cli::App* learn =
      mask.add_subcommand("learn", "learn the lights in the empty volume, save the masks and use them at once");
  learn->examples(
      "  mocapctl mask learn\n"
      "  mocapctl mask learn --camera north-east --images 500");
  add_endpoint_options(*learn, options);
  const cli::Option* const timeout =
      learn
          ->add_option("--timeout-s", options.timeout_s,
                       fmt::format("longest wait for the answer; default: depends on --images, {:.0f} s for {}",
                                   longest_wait_s(kDefaultMaskImages), kDefaultMaskImages))
          ->check(cli::Range(0.1, 600.0));
  learn->add_option("--camera", options.request.name, "only this camera");
  learn->add_option("--images", options.request.images, "number of images of each camera; default 100")
      ->check(cli::Range(10, 10000));
  learn->callback([&options, timeout] {
    if (!*timeout) options.timeout_s = longest_wait_s(options.request.images);
    options.run = [&options] { return ask_about_masks(options, ControlAction::LearnMask); };
  });
}

void add_draw(cli::App& mask, LiveOptions& options) {
  cli::App* draw = mask.add_subcommand("draw", "mask areas of a camera's image, save the masks and use them at once");
  draw->examples(
      "  mocapctl mask draw north-east --rectangle 100,0,80,60\n"
      "  mocapctl mask draw north-east --polygon 0,0,200,0,0,150");
  add_connection_options(*draw, options);
  draw->add_option("camera", options.request.name, "name of the camera")->required();
  draw->add_option("--rectangle", options.rectangles, "left, top, width and height in pixels; may be repeated")
      ->type_name("X,Y,W,H")
      ->one_value_each();
  draw->add_option("--polygon", options.polygons, "corners in pixels, three or more; may be repeated")
      ->type_name("X,Y,X,Y,...")
      ->one_value_each();
  draw->callback([&options] { options.run = [&options] { return draw_masks(options); }; });
}

void add_remove(cli::App& mask, LiveOptions& options) {
  cli::App* remove = mask.add_subcommand("remove", "remove drawn masks of a camera");
  remove->examples(
      "  mocapctl mask remove north-east 2\n"
      "  mocapctl mask remove north-east --all");
  add_connection_options(*remove, options);
  remove->add_option("camera", options.request.name, "name of the camera")->required();
  cli::Option* number = remove->add_option("number", options.number, "of the mask, as in mask list");
  remove->add_flag("--all", options.all, "all drawn masks of the camera")->excludes(number);
  remove->callback([&options] { options.run = [&options] { return remove_masks(options); }; });
}

Result<std::vector<double>> numbers_of(const std::string& text, const char* expected) {
  std::vector<double> numbers;
  const char* const end = text.data() + text.size();
  for (const char* at = text.data(); at <= end;) {
    double number = 0.0;
    const auto [behind, fault] = std::from_chars(at, end, number);
    if (fault != std::errc() || !std::isfinite(number) || (behind != end && *behind != ',')) {
      return Error{ErrorCode::InvalidArgument, fmt::format("'{}' is no list of numbers, expected {}", text, expected)};
    }
    numbers.push_back(number);
    at = behind + 1;
  }
  return numbers;
}

}  // namespace

Result<MaskPolygon> rectangle_of(const std::string& text) {
  constexpr const char* kExpected = "X,Y,W,H in pixels, W and H at least 1";
  const Result<std::vector<double>> numbers = numbers_of(text, kExpected);
  if (!numbers) return numbers.error();
  if (numbers->size() != 4 || (*numbers)[2] < 1.0 || (*numbers)[3] < 1.0) {
    return Error{ErrorCode::InvalidArgument, fmt::format("the rectangle is '{}', expected {}", text, kExpected)};
  }
  // The centres of the pixels are whole numbers, so their borders are halves.
  const double left = (*numbers)[0] - 0.5, top = (*numbers)[1] - 0.5;
  const double right = left + (*numbers)[2], bottom = top + (*numbers)[3];
  return MaskPolygon{{{left, top}}, {{right, top}}, {{right, bottom}}, {{left, bottom}}};
}

Result<MaskPolygon> polygon_of(const std::string& text) {
  constexpr const char* kExpected = "X,Y,X,Y,X,Y in pixels, three corners or more";
  const Result<std::vector<double>> numbers = numbers_of(text, kExpected);
  if (!numbers) return numbers.error();
  if (numbers->size() < 6 || numbers->size() % 2 != 0) {
    return Error{ErrorCode::InvalidArgument, fmt::format("the polygon is '{}', expected {}", text, kExpected)};
  }
  MaskPolygon polygon;
  for (std::size_t i = 0; i < numbers->size(); i += 2) polygon.push_back({{(*numbers)[i], (*numbers)[i + 1]}});
  return polygon;
}

void add_mask_command(cli::App& app, LiveOptions& options) {
  cli::App* mask = app.add_subcommand("mask", "masks: parts of the images that the running daemon ignores");
  mask->examples(
      "  mocapctl mask learn\n"
      "  mocapctl mask draw north-east --rectangle 100,0,80,60");
  mask->require_subcommand(1);
  add_learn(*mask, options);
  add_draw(*mask, options);
  add_remove(*mask, options);
  const struct {
    const char *name, *what, *example;
    ControlAction action;
  } commands[] = {
      {"undo", "the drawn masks of a camera are those before the last mask draw or mask remove", "mask undo north-east",
       ControlAction::UndoMasks},
      {"forget", "discard the learnt masks of a camera", "mask forget north-east", ControlAction::ForgetMasks},
      {"list", "the drawn and the learnt masks", "mask list", ControlAction::GetMasks}};
  for (const auto& [name, what, example, action] : commands) {
    cli::App* command = mask->add_subcommand(name, what);
    command->examples(fmt::format("  mocapctl {0}\n  mocapctl {0} --endpoint tcp://10.0.0.7:5571", example));
    add_connection_options(*command, options);
    cli::Option* camera = command->add_option("camera", options.request.name, "name of the camera");
    if (action != ControlAction::GetMasks) camera->required();
    command->callback(
        [&options, action = action] { options.run = [&options, action] { return ask_about_masks(options, action); }; });
  }
}

}  // namespace mocap::ctl
