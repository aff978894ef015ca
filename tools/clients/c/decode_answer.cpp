#include <cstring>

#include "decode.h"
#include "decode_parts.h"
#include "text.h"

namespace mocap::client {
namespace {

std::int32_t phase_of(std::int32_t value) {
  return value == MOCAP_PHASE_TRACKING || value == MOCAP_PHASE_LOST ? value
                                                                    : static_cast<std::int32_t>(MOCAP_PHASE_SEARCHING);
}

// A reader treats an unknown code as FAILED.
std::int32_t code_of(std::int32_t value) {
  return value >= MOCAP_CODE_DONE && value <= MOCAP_CODE_FAILED ? value : static_cast<std::int32_t>(MOCAP_CODE_FAILED);
}

void read_event(pbf_reader from, Event& into) {
  while (from.next()) {
    switch (from.tag_and_type()) {
      case whole(1): into.event.sequence = from.get_uint64(); break;
      case whole(2): into.event.at_ns = from.get_int64(); break;
      case whole(3): into.event.kind = from.get_enum(); break;
      case whole(4): into.subject = from.get_uint32(); break;
      case whole(5): into.camera = from.get_uint32(); break;
      case whole(6): into.event.description_version = from.get_uint32(); break;
      case part(7): copy_text(into.event.message, sizeof(into.event.message), from.get_string()); break;
      default: from.skip();
    }
  }
}

SubjectStatus read_subject_status(pbf_reader from) {
  SubjectStatus subject;
  while (from.next()) {
    switch (from.tag_and_type()) {
      case part(1): subject.name = from.get_string(); break;
      case whole(2): subject.phase = phase_of(from.get_enum()); break;
      case whole(3): subject.away = from.get_bool(); break;
      default: from.skip();
    }
  }
  return subject;
}

std::shared_ptr<const Health> health_of(pbf_reader from) {
  auto health = std::make_shared<Health>();
  read_health(from, *health);
  return health;
}

void read_status(pbf_reader from, Answer& into) {
  into.has_status = true;
  while (from.next()) {
    switch (from.tag_and_type()) {
      case part(1): into.producer = from.get_string(); break;
      case part(2): into.session = from.get_string(); break;
      case whole(3): into.capturing = from.get_bool(); break;
      case part(4): into.health = health_of(from.get_message()); break;
      case part(5):
        if (into.subjects.size() == kMaxSubjects) throw Fault{"more subjects than the limit"};
        into.subjects.push_back(read_subject_status(from.get_message()));
        break;
      case part(6): into.role = from.get_string(); break;
      default: from.skip();
    }
  }
}

void read_answer(pbf_reader from, Answer& into) {
  into.code = MOCAP_CODE_FAILED;
  while (from.next()) {
    switch (from.tag_and_type()) {
      case whole(1): into.id = from.get_uint64(); break;
      case whole(2): into.code = code_of(from.get_enum()); break;
      case part(3): into.message = from.get_string(); break;
      case part(4): read_status(from.get_message(), into); break;
      case part(5): into.description = from.get_string(); break;
      case part(6): into.snapshot = from.get_string(); break;
      default: from.skip();
    }
  }
}

}  // namespace

const char* decode_event(std::string_view bytes, Event& into) {
  return guarded(bytes, into, [](pbf_reader from, Event& event) { read_event(from, event); });
}

const char* decode_answer(std::string_view bytes, Answer& into) {
  return guarded(bytes, into, [](pbf_reader from, Answer& answer) { read_answer(from, answer); });
}

}  // namespace mocap::client
