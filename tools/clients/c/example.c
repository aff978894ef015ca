/* Prints the bone positions of the first subject once a second.
 * usage: mocap_example [ENDPOINT [SECONDS [SERVER_KEY SECRET_KEY]]]    (keys: files of mocapctl keys new) */
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "mocap_client.h"

static void print_frame(const mocap_frame* frame) {
  mocap_frame_info info;
  mocap_frame_get_info(frame, &info, sizeof info);
  mocap_subject subject;
  if (!mocap_frame_get_subject(frame, 0, &subject, sizeof subject)) return;
  printf("frame %llu, ", (unsigned long long)info.number);
  const int64_t age_ns = mocap_frame_age_ns(frame);
  if (age_ns != MOCAP_ABSENT) printf("%.1f ms old, ", (double)age_ns / 1e6);
  printf("%u of %u cameras, %s\n", info.cameras, info.expected_cameras, subject.name);
  for (size_t i = 0; i < subject.bone_pose_count; ++i) {
    const mocap_bone_pose* pose = &subject.bone_poses[i];
    if (pose->state == MOCAP_STATE_LOST) continue;
    printf("  %-12s at %+.3f %+.3f %+.3f turned %+.3f %+.3f %+.3f %+.3f\n", subject.bones[i].name,
           (double)pose->position.x, (double)pose->position.y, (double)pose->position.z, (double)pose->rotation.x,
           (double)pose->rotation.y, (double)pose->rotation.z, (double)pose->rotation.w);
  }
}

int main(int argc, char** argv) {
  mocap_client_options options;
  mocap_client_options_init(&options, sizeof options);
  if (argc > 1) options.endpoint = argv[1];
  const int seconds = argc > 2 ? atoi(argv[2]) : 10;
  if (argc > 4) {
    options.server_key = argv[3];
    options.secret_key = argv[4];
  }

  char text[256];
  mocap_client* client = mocap_client_open(&options, text, sizeof text);
  if (client == NULL) {
    fprintf(stderr, "mocap_example: %s\n", text);
    return 64;
  }
  mocap_frame* frame = mocap_frame_new();
  const time_t end = time(NULL) + seconds;
  time_t shown = 0;
  unsigned got = 0;
  while (time(NULL) < end) {
    const int came = mocap_client_wait(client, frame, 1000);
    if (came == 1) ++got;
    if (came == 1 && time(NULL) == shown) continue;
    shown = time(NULL);
    if (came == 1) {
      print_frame(frame);
    } else {
      mocap_client_diagnose(client, text, sizeof text);
      printf("no data: %s\n", text);
    }
    fflush(stdout);
  }
  mocap_statistics statistics;
  mocap_client_get_statistics(client, &statistics, sizeof statistics);
  printf("%.1f Hz, %llu received, %llu lost, %llu restarts\n", statistics.rate_hz,
         (unsigned long long)statistics.received, (unsigned long long)statistics.lost,
         (unsigned long long)statistics.restarts);
  mocap_frame_free(frame);
  mocap_client_close(client);
  return got > 0 ? 0 : 69;
}
