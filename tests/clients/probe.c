/* Runs the C client for the tests. usage: probe ENDPOINT AXES POLL_HZ SECONDS [SERVER_KEY PUBLIC_KEY SECRET_KEY]
   Polls at POLL_HZ and prints one JSON object at the end. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "mocap_client.h"

static double seconds_now(void) {
  struct timespec at;
  clock_gettime(CLOCK_MONOTONIC, &at);
  return (double)at.tv_sec + 1e-9 * (double)at.tv_nsec;
}

static void sleep_until(double end) {
  struct timespec at;
  at.tv_sec = (time_t)end;
  at.tv_nsec = (long)((end - (double)at.tv_sec) * 1e9);
  clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &at, NULL);
}

static void print_vec(const char* name, mocap_vec3 v) {
  printf(", \"%s\": [%.9g, %.9g, %.9g]", name, (double)v.x, (double)v.y, (double)v.z);
}
static void print_quat(const char* name, mocap_quat q) {
  printf(", \"%s\": [%.9g, %.9g, %.9g, %.9g]", name, (double)q.x, (double)q.y, (double)q.z, (double)q.w);
}

static void print_subject(const mocap_frame* frame, uint32_t index) {
  mocap_subject subject;
  if (!mocap_frame_get_subject(frame, index, &subject, sizeof subject)) return;
  printf("%s{\"name\": \"%s\", \"bone\": \"%s\"", index > 0 ? ", " : "", subject.name,
         subject.bone_count > 0 ? subject.bones[0].name : "");
  if (subject.bone_pose_count > 0) {
    print_vec("position", subject.bone_poses[0].position);
    print_quat("rotation_xyzw", subject.bone_poses[0].rotation);
    print_vec("local_position", subject.bone_poses[0].local_position);
    print_quat("local_rotation_xyzw", subject.bone_poses[0].local_rotation);
    print_vec("velocity", subject.bone_poses[0].velocity);
    print_vec("spin", subject.bone_poses[0].spin);
  }
  printf("}");
}

static void print_frame(const mocap_frame* frame) {
  mocap_frame_info info;
  mocap_frame_get_info(frame, &info, sizeof info);
  printf(", \"number\": %llu, \"version\": %u, \"session\": \"%s\"", (unsigned long long)info.number,
         info.description_version, mocap_frame_session(frame));
  printf(", \"subjects\": [");
  for (uint32_t i = 0; i < info.subject_count; ++i) print_subject(frame, i);
  printf("]");
}

int main(int argc, char** argv) {
  if (argc < 5) return 64;
  mocap_client_options options;
  mocap_client_options_init(&options, sizeof options);
  options.endpoint = argv[1];
  options.axes = atoi(argv[2]);
  if (argc > 7) {
    options.server_key = argv[5];
    options.public_key = argv[6];
    options.secret_key = argv[7];
  }
  char text[512];
  mocap_client* client = mocap_client_open(&options, text, sizeof text);
  if (client == NULL) {
    fprintf(stderr, "%s\n", text);
    return 64;
  }
  mocap_frame* frame = mocap_frame_new();
  const double period = 1.0 / atof(argv[3]);
  const double begin = seconds_now();
  unsigned long frames = 0;
  for (double at = begin; at < begin + atof(argv[4]); at += period) {
    sleep_until(at);
    if (mocap_client_poll(client, frame) == 1) ++frames;
  }
  const int diagnosis = mocap_client_diagnose(client, text, sizeof text);
  mocap_statistics s;
  mocap_client_get_statistics(client, &s, sizeof s);
  printf("{\"frames\": %lu, \"diagnosis\": %d, \"sentence\": \"%s\"", frames, diagnosis, text);
  printf(", \"received\": %llu, \"lost\": %llu, \"restarts\": %llu, \"unreadable\": %llu, \"rate_hz\": %.1f",
         (unsigned long long)s.received, (unsigned long long)s.lost, (unsigned long long)s.restarts,
         (unsigned long long)s.unreadable, s.rate_hz);
  if (s.age_p99_ns != MOCAP_ABSENT) {
    printf(", \"age_p50_ms\": %.3f, \"age_p99_ms\": %.3f", (double)s.age_p50_ns / 1e6, (double)s.age_p99_ns / 1e6);
  }
  print_frame(frame);
  printf("}\n");
  mocap_frame_free(frame);
  mocap_client_close(client);
  return 0;
}
