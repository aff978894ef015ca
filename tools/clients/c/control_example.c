/* Lists the health of the cameras, or starts or stops the capture.
   usage: mocap_control_example [start|stop|status] [ENDPOINT [SERVER_KEY SECRET_KEY]] */
#include <stdio.h>
#include <string.h>

#include "mocap_client.h"

static int ask(mocap_control* control, int32_t kind, mocap_answer* answer) {
  mocap_request request;
  mocap_request_init(&request, sizeof request, kind);
  const int done = mocap_control_ask(control, &request, answer) == MOCAP_CODE_DONE;
  if (!done) fprintf(stderr, "mocap_control_example: %s\n", mocap_answer_message(answer));
  return done;
}

static void print_status(const mocap_answer* answer) {
  mocap_status status;
  if (!mocap_answer_get_status(answer, &status, sizeof status)) return;
  printf("%s, capture %s, you are %s\n", status.producer, status.capturing ? "runs" : "is stopped", status.role);
  mocap_health* health = mocap_health_new();
  mocap_camera_health camera;
  mocap_answer_get_health(answer, health);
  for (size_t i = 0; mocap_health_get_camera(health, i, &camera, sizeof camera); ++i) {
    printf("%s: phase %d, %.1f Hz, %llu frames %s\n", camera.name, camera.phase, camera.rate_hz,
           (unsigned long long)camera.frames, camera.last_error);
  }
  mocap_health_free(health);
}

int main(int argc, char** argv) {
  mocap_control_options options;
  mocap_control_options_init(&options, sizeof options);
  if (argc > 2) options.endpoint = argv[2];
  if (argc > 4) {
    options.server_key = argv[3];
    options.secret_key = argv[4];
  }
  char fault[256];
  mocap_control* control = mocap_control_open(&options, fault, sizeof fault);
  if (control == NULL) {
    fprintf(stderr, "mocap_control_example: %s\n", fault);
    return 64;
  }
  mocap_answer* answer = mocap_answer_new();
  int done = 1;
  if (argc > 1 && strcmp(argv[1], "start") == 0) done = ask(control, MOCAP_REQUEST_CAPTURE_START, answer);
  if (argc > 1 && strcmp(argv[1], "stop") == 0) done = ask(control, MOCAP_REQUEST_CAPTURE_STOP, answer);
  if (done) done = ask(control, MOCAP_REQUEST_STATUS, answer);
  if (done) print_status(answer);
  mocap_answer_free(answer);
  mocap_control_close(control);
  return done ? 0 : 69;
}
