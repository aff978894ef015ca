// Requests to a running daemon through the C ABI.
#include <cmath>
#include <limits>
#include <mutex>
#include <new>

#include "clock.h"
#include "decode.h"
#include "encode_request.h"
#include "feed.h"
#include "keys.h"
#include "socket.h"
#include "text.h"
#include "wire/request_socket.h"

using mocap::client::Answer;
using mocap::client::Axes;
using mocap::client::copy_text;
using mocap::client::Feed;
using mocap::client::fill;
using mocap::client::text_of;
using mocap::wire::LinkFault;
using mocap::wire::Reply;
using mocap::wire::RequestSocket;

struct mocap_control {
  std::mutex mutex;  // one request at a time
  std::unique_ptr<RequestSocket> socket;
  std::string endpoint;
  std::int32_t timeout_ms = 0;
  std::int32_t axes = MOCAP_AXES_MOCAP;
  std::uint64_t next_id = 1;
};

namespace {

constexpr int32_t kNull = -1;
constexpr int32_t kNoMemory = -2;
constexpr int32_t kMaxTimeout_ms = 600'000;
constexpr int kMaxTries = 3;  // of a snapshot whose description changed between the two requests

std::string fault_of(const mocap_control_options& options) {
  if (!Axes::known(options.axes))
    return "axes is " + std::to_string(options.axes) + ", expected 0 to 4 (enum mocap_axes)";
  if (options.timeout_ms < 1 || options.timeout_ms > kMaxTimeout_ms)
    return "timeout_ms is " + std::to_string(options.timeout_ms) + ", expected 1 to " + std::to_string(kMaxTimeout_ms);
  return {};
}

std::unique_ptr<mocap_control> open_control(const mocap_control_options& options, std::string& fault) {
  fault = fault_of(options);
  if (!fault.empty()) return nullptr;
  mocap::client::Keys keys{text_of(options.server_key), text_of(options.public_key), text_of(options.secret_key)};
  fault = read_keys(keys);
  if (!fault.empty()) return nullptr;
  auto control = std::make_unique<mocap_control>();
  control->endpoint = text_of(options.endpoint);
  control->timeout_ms = options.timeout_ms;
  control->axes = options.axes;
  control->socket = RequestSocket::open(
      {control->endpoint, keys.server, keys.own_public, keys.own_secret, mocap::client::words_of("[control] endpoint")},
      fault);
  return control->socket == nullptr ? nullptr : std::move(control);
}

Answer failed(std::int32_t code, std::string message) {
  Answer answer;
  answer.code = code;
  answer.message = std::move(message);
  return answer;
}

Answer no_answer(Reply reply) {
  Answer answer = failed(MOCAP_CODE_NO_ANSWER, std::move(reply.why));
  answer.diagnosis = reply.fault == LinkFault::None ? static_cast<std::int32_t>(MOCAP_NO_ANSWER)
                                                    : mocap::client::diagnosis_of(reply.fault);
  return answer;
}

// Precondition: the caller has locked the control.
Answer ask(mocap_control& control, const mocap_request& request) {
  const std::uint64_t id = control.next_id++;
  const std::string bytes = mocap::client::encode_request(request, id);
  if (bytes.empty())
    return failed(MOCAP_CODE_INVALID,
                  "kind is " + std::to_string(request.kind) + ", expected an enum mocap_request_kind");
  const std::int32_t timeout_ms = request.timeout_ms > 0 ? request.timeout_ms : control.timeout_ms;
  Reply reply = control.socket->ask(bytes, std::chrono::milliseconds(timeout_ms));
  if (!reply.bytes) return no_answer(std::move(reply));
  Answer answer;
  const char* fault = decode_answer(*reply.bytes, answer);
  // The daemon answers a request that it cannot read with the id 0.
  if (fault == nullptr && answer.id != id && answer.id != 0) fault = "the answer to another request";
  if (fault == nullptr) return answer;
  answer = failed(MOCAP_CODE_NO_ANSWER, control.endpoint + ": " + fault + ": is it the control endpoint of a mocapd?");
  answer.diagnosis = MOCAP_NOT_A_FEED;
  return answer;
}

Answer ask(mocap_control& control, std::int32_t kind) {
  mocap_request request;
  mocap_request_init(&request, sizeof(request), kind);
  return ask(control, request);
}

// A snapshot by itself is a feed of two messages.
Answer get_frame(mocap_control& control, mocap::client::Frame& into) {
  Answer answer;
  for (int i = 0; i < kMaxTries; ++i) {
    answer = ask(control, mocap::client::kDescriptionRequest);
    if (answer.code != MOCAP_CODE_DONE) return answer;
    Feed feed({control.endpoint, "snapshot", control.axes, 1, 0});
    feed.take(std::string("description") + '\0' + answer.description, mocap::client::now());
    answer = ask(control, mocap::client::kSnapshotRequest);
    if (answer.code != MOCAP_CODE_DONE) return answer;
    feed.take(std::string("snapshot") + '\0' + answer.snapshot, mocap::client::now());
    into.serial = 0;  // this feed has only one frame: whatever `into` holds is older
    if (feed.hand_out(into, mocap::client::now())) return answer;
  }
  return failed(MOCAP_CODE_FAILED, control.endpoint +
                                       ": the description changes with each snapshot, or one of them is "
                                       "unreadable: update this client, or try again");
}

// Runs a request, with an answer for every exception.
template <typename Run>
int32_t run(mocap_control* control, mocap_answer* answer, Run request) {
  try {
    const std::lock_guard<std::mutex> lock(control->mutex);
    answer->answer = request();
    return answer->answer.code;
  } catch (const std::exception&) {
    return kNoMemory;
  }
}

}  // namespace

extern "C" {

void mocap_control_options_init(mocap_control_options* options, size_t size) {
  if (options == nullptr) return;
  mocap_control_options defaults{};
  defaults.size = size;
  defaults.endpoint = "tcp://127.0.0.1:5571";
  defaults.timeout_ms = 5000;
  defaults.axes = MOCAP_AXES_MOCAP;
  std::memset(options, 0, size);
  fill(options, size, defaults);
}

void mocap_request_init(mocap_request* request, size_t size, int32_t kind) {
  if (request == nullptr) return;
  mocap_request defaults{};
  defaults.size = size;
  defaults.kind = kind;
  defaults.exposure_us = defaults.gain_db = std::numeric_limits<double>::quiet_NaN();
  std::memset(request, 0, size);
  fill(request, size, defaults);
}

mocap_control* mocap_control_open(const mocap_control_options* options, char* fault, size_t fault_size) {
  try {
    mocap_control_options all;
    mocap_control_options_init(&all, sizeof(all));
    if (options != nullptr) fill(&all, options->size, *options);
    std::string why;
    std::unique_ptr<mocap_control> control = open_control(all, why);
    if (control == nullptr) copy_text(fault, fault_size, why);
    return control.release();
  } catch (const std::exception& exception) {
    copy_text(fault, fault_size, exception.what());
    return nullptr;
  }
}

void mocap_control_close(mocap_control* control) { delete control; }

mocap_answer* mocap_answer_new(void) { return new (std::nothrow) mocap_answer; }
void mocap_answer_free(mocap_answer* answer) { delete answer; }

int32_t mocap_control_ask(mocap_control* control, const mocap_request* request, mocap_answer* answer) {
  if (control == nullptr || request == nullptr || answer == nullptr) return kNull;
  mocap_request all;
  mocap_request_init(&all, sizeof(all), request->kind);
  fill(&all, request->size, *request);
  return run(control, answer, [&] {
    // The kinds that only get_frame uses are negative.
    if (all.kind < 0) all.kind = 0;
    return ask(*control, all);
  });
}

int32_t mocap_control_get_frame(mocap_control* control, mocap_frame* frame, mocap_answer* answer) {
  if (control == nullptr || frame == nullptr || answer == nullptr) return kNull;
  return run(control, answer, [&] { return get_frame(*control, frame->frame); });
}

int32_t mocap_answer_code(const mocap_answer* answer) { return answer == nullptr ? kNull : answer->answer.code; }

const char* mocap_answer_message(const mocap_answer* answer) {
  return answer == nullptr ? "" : answer->answer.message.c_str();
}

int32_t mocap_answer_diagnosis(const mocap_answer* answer) {
  return answer == nullptr ? kNull : answer->answer.diagnosis;
}

int32_t mocap_answer_get_status(const mocap_answer* answer, mocap_status* into, size_t size) {
  if (answer == nullptr || into == nullptr || !answer->answer.has_status) return 0;
  const Answer& from = answer->answer;
  fill(into, size,
       mocap_status{from.producer.c_str(), from.session.c_str(), from.role.c_str(), from.capturing ? 1 : 0,
                    from.subjects.size()});
  return 1;
}

int32_t mocap_answer_get_subject(const mocap_answer* answer, size_t index, mocap_subject_status* into, size_t size) {
  if (answer == nullptr || into == nullptr || index >= answer->answer.subjects.size()) return 0;
  const mocap::client::SubjectStatus& from = answer->answer.subjects[index];
  fill(into, size, mocap_subject_status{from.name.c_str(), from.phase, from.away ? 1 : 0});
  return 1;
}

int32_t mocap_answer_get_health(const mocap_answer* answer, mocap_health* into) {
  if (answer == nullptr || into == nullptr) return 0;
  into->health = answer->answer.health;
  return into->health == nullptr ? 0 : 1;
}

}  // extern "C"
