/* Runs the C library's control, health and events for the tests.
   usage: control_probe CONTROL FEED SERVER_KEY SECRET_KEY     "-": no key
   Reads commands from standard input, one a line, and prints one JSON object for each. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "mocap_client.h"

#define MOST_WORDS 8

static mocap_control* control;
static mocap_client* client;
static mocap_answer* answer;
static mocap_frame* frame;

static void print_text(const char* name, const char* text) {
  printf("\"%s\": \"", name);
  for (; *text != '\0'; ++text) {
    if (*text == '"' || *text == '\\') putchar('\\');
    if (*text == '\n')
      fputs("\\n", stdout);
    else
      putchar(*text);
  }
  putchar('"');
}

static void print_cameras(const mocap_health* health) {
  mocap_camera_health camera;
  printf(", \"cameras\": [");
  for (size_t i = 0; mocap_health_get_camera(health, i, &camera, sizeof camera); ++i) {
    printf("%s{", i > 0 ? ", " : "");
    print_text("name", camera.name);
    printf(", \"phase\": %d, \"frames\": %llu}", camera.phase, (unsigned long long)camera.frames);
  }
  printf("]");
}

static void print_status(void) {
  mocap_status status;
  mocap_subject_status subject;
  if (!mocap_answer_get_status(answer, &status, sizeof status)) return;
  printf(", \"capturing\": %d, ", status.capturing);
  print_text("role", status.role);
  printf(", \"subjects\": [");
  for (size_t i = 0; mocap_answer_get_subject(answer, i, &subject, sizeof subject); ++i) {
    printf("%s{", i > 0 ? ", " : "");
    print_text("name", subject.name);
    printf(", \"phase\": %d, \"away\": %d}", subject.phase, subject.away);
  }
  printf("]");
  mocap_health* health = mocap_health_new();
  mocap_answer_get_health(answer, health);
  print_cameras(health);
  mocap_health_free(health);
}

static void print_answer(int32_t code) {
  printf("\"code\": %d, \"diagnosis\": %d, ", code, mocap_answer_diagnosis(answer));
  print_text("message", mocap_answer_message(answer));
  print_status();
}

static void print_frame(void) {
  mocap_subject subject;
  printf(", \"bones\": %zu", mocap_frame_get_subject(frame, 0, &subject, sizeof subject) ? subject.bone_count : 0);
}

static void print_health(void) {
  mocap_health* health = mocap_health_new();
  mocap_health_info info = {0};
  mocap_client_get_health(client, health);
  mocap_health_get_info(health, &info, sizeof info);
  printf("\"sets\": %llu", (unsigned long long)info.sets);
  print_cameras(health);
  mocap_health_free(health);
}

static void print_events(void) {
  mocap_event event;
  printf("\"events\": [");
  for (int i = 0; mocap_client_next_event(client, &event, sizeof event) == 1; ++i) {
    printf("%s{\"kind\": %d, ", i > 0 ? ", " : "", event.kind);
    print_text("name", event.name);
    printf("}");
  }
  printf("]");
}

static void print_index(const char* what, const char* name) {
  char fault[4096] = "";
  mocap_client_wait(client, frame, 10000);
  const int32_t index = strcmp(what, "bone") == 0 ? mocap_frame_find_bone(frame, 0, name, fault, sizeof fault)
                                                  : mocap_frame_find_marker(frame, 0, name, fault, sizeof fault);
  printf("\"index\": %d, ", index);
  print_text("fault", fault);
}

static size_t read_numbers(char* list, double* into) {
  size_t count = 0;
  for (char* one = strtok(list, ","); one != NULL; one = strtok(NULL, ",")) into[count++] = atof(one);
  return count;
}

static int32_t kind_of(const char* what) {
  static const char* const names[] = {"status",     "start",     "stop",        "add",       "remove",
                                      "reset",      "fit",       "camera",      "mask",      "reload",
                                      "take-start", "take-stop", "take-cancel", "take-mark", "take-next"};
  for (int32_t i = 0; i < 15; ++i) {
    if (strcmp(what, names[i]) == 0) return i + 1;
  }
  return 0;
}

static void ask(char** words, int count) {
  static double rest[1000], markers[4000];
  mocap_request request;
  mocap_request_init(&request, sizeof request, kind_of(words[0]));
  if (count > 1 && strcmp(words[1], "-") != 0) request.name = words[1];
  if (request.kind == MOCAP_REQUEST_SUBJECT_ADD && count > 2) request.marker_set = words[2];
  if (request.kind == MOCAP_REQUEST_CAMERA_SET && strcmp(words[2], "-") != 0) request.exposure_us = atof(words[2]);
  if (request.kind == MOCAP_REQUEST_CAMERA_SET && strcmp(words[3], "-") != 0) request.gain_db = atof(words[3]);
  if (request.kind >= MOCAP_REQUEST_TAKE_START && count > 2) request.text = words[2];
  if (request.kind == MOCAP_REQUEST_TAKE_STOP) request.timeout_ms = 60000;
  if (request.kind == MOCAP_REQUEST_MASK_LEARN) {
    request.images = (uint32_t)atoi(words[2]);
    request.timeout_ms = 60000;
  }
  if (request.kind == MOCAP_REQUEST_SUBJECT_FIT) {
    request.rest_offsets_m = rest;
    request.rest_offset_count = read_numbers(words[2], rest);
    request.marker_offsets_m = markers;
    request.marker_offset_count = read_numbers(words[3], markers);
    request.residual_m = 0.001;
  }
  print_answer(mocap_control_ask(control, &request, answer));
}

static void run(char** words, int count) {
  if (strcmp(words[0], "frame") == 0) {
    print_answer(mocap_control_get_frame(control, frame, answer));
    print_frame();
  } else if (strcmp(words[0], "health") == 0) {
    print_health();
  } else if (strcmp(words[0], "events") == 0) {
    print_events();
  } else if (strcmp(words[0], "bone") == 0 || strcmp(words[0], "marker") == 0) {
    print_index(words[0], words[1]);
  } else {
    ask(words, count);
  }
}

int main(int argc, char** argv) {
  if (argc < 5) return 64;
  mocap_control_options options;
  mocap_client_options feed;
  mocap_control_options_init(&options, sizeof options);
  mocap_client_options_init(&feed, sizeof feed);
  options.endpoint = argv[1];
  feed.endpoint = argv[2];
  if (strcmp(argv[3], "-") != 0) options.server_key = feed.server_key = argv[3];
  if (strcmp(argv[4], "-") != 0) options.secret_key = feed.secret_key = argv[4];
  control = mocap_control_open(&options, NULL, 0);
  client = mocap_client_open(&feed, NULL, 0);
  answer = mocap_answer_new();
  frame = mocap_frame_new();
  static char line[65536];
  while (control != NULL && client != NULL && fgets(line, sizeof line, stdin) != NULL) {
    char* words[MOST_WORDS];
    int count = 0;
    char* rest = line;
    for (char* word; count < MOST_WORDS && (word = strtok_r(rest, " \n", &rest)) != NULL;) words[count++] = word;
    printf("{");
    if (count > 0) run(words, count);
    printf("}\n");
    fflush(stdout);
  }
  mocap_frame_free(frame);
  mocap_answer_free(answer);
  mocap_client_close(client);
  mocap_control_close(control);
  return control == NULL || client == NULL ? 64 : 0;
}
