/* mocap_client.h: client library for the feed of a mocapd. A C ABI, so that C, C++, C#, Rust, Unity native plugins and
 * Unreal modules can link it. Uses ZeroMQ and one thread for each client. Contains no Protobuf runtime.
 *
 *   mocap_client_options options;
 *   mocap_client_options_init(&options, sizeof options);
 *   options.axes = MOCAP_AXES_UNITY;
 *   mocap_client* client = mocap_client_open(&options, NULL, 0);
 *   mocap_frame* frame = mocap_frame_new();
 *   ... each tick:  if (mocap_client_poll(client, frame) == 1) { use frame }
 *   mocap_frame_free(frame); mocap_client_close(client);
 * mocap_client_poll never waits for the network. The client's thread receives messages, keeps the newest frame,
 * reconnects when the daemon restarts, and can report at any time why no data arrives (mocap_client_diagnose).
 *
 * Units: m (Unreal: cm), rad, s, ns. Quaternions are unit quaternions in the order x y z w. The origin of a bone's
 * frame is its joint. In the rest pose (T-pose, facing forward) the axes of every bone's frame are parallel to the
 * world axes, so a rotation is the rotation of a bone from its T-pose.
 *
 * Threads: each function may be called from any thread. One mocap_frame belongs to one thread at a time.
 * Errors: functions return 0 or a negative number. No function ends the process or throws.
 * Versions: existing declarations never change. Structs that may grow are filled up to the size that the caller passes.
 * mocap_client_abi() returns the version of the ABI.
 */
#ifndef MOCAP_CLIENT_H
#define MOCAP_CLIENT_H

#include <stddef.h>
#include <stdint.h>

#if defined(MOCAP_CLIENT_STATIC)
#define MOCAP_API
#elif defined(_WIN32) && defined(MOCAP_CLIENT_BUILD)
#define MOCAP_API __declspec(dllexport)
#elif defined(_WIN32)
#define MOCAP_API __declspec(dllimport)
#else
#define MOCAP_API __attribute__((visibility("default")))
#endif

#ifdef __cplusplus
extern "C" {
#endif

#define MOCAP_CLIENT_ABI 1
/* An unknown instant. 0 is a valid instant. */
#define MOCAP_ABSENT INT64_MIN

/* The axes of positions and rotations. Forward is the direction that the subject faces in T-pose. */
enum mocap_axes {
  MOCAP_AXES_MOCAP = 0,  /* axes of the feed: right-handed, x forward, y left, z up, m */
  MOCAP_AXES_UNITY = 1,  /* left-handed, x right, y up, z forward, m */
  MOCAP_AXES_UNREAL = 2, /* left-handed, x forward, y right, z up, cm */
  MOCAP_AXES_GODOT = 3,  /* right-handed, x right, y up, z backward, m */
  MOCAP_AXES_GLTF = 4    /* right-handed, x left, y up, z forward, m */
};

/* The reason why no data arrives; MOCAP_WELL: no fault. */
enum mocap_diagnosis {
  MOCAP_WELL = 0,
  MOCAP_NOTHING_LISTENS = 1,
  MOCAP_NOT_A_FEED = 2,         /* the peer does not speak this protocol */
  MOCAP_KEY_MISSING = 3,        /* one side uses keys (CURVE), the other does not */
  MOCAP_KEY_REFUSED = 4,        /* the daemon does not know the client's public key */
  MOCAP_SERVER_KEY_WRONG = 5,   /* the daemon has another server key, or is not a mocapd */
  MOCAP_NO_DESCRIPTION = 6,     /* connected, but no description arrives */
  MOCAP_VERSION_TOO_NEW = 7,    /* the feed has a protocol version unknown to this library */
  MOCAP_CAMERAS_SILENT = 8,     /* at least one camera delivers no images */
  MOCAP_NO_SNAPSHOTS = 9,       /* the description arrived, but no snapshots */
  MOCAP_SUBJECT_SEARCHING = 10, /* snapshots arrive, but no subject is identified */
  MOCAP_CLOCK_SKEW = 11,        /* the clocks of the two machines differ, so ages are meaningless */
  MOCAP_CONNECTING = 12,        /* not decided yet */
  MOCAP_NO_ANSWER = 13          /* connected to a control endpoint, but no answer within the timeout */
};

enum mocap_phase { MOCAP_PHASE_SEARCHING = 1, MOCAP_PHASE_TRACKING = 2, MOCAP_PHASE_LOST = 3 };

/* State of a bone or a marker. */
enum mocap_state {
  MOCAP_STATE_LOST = 1,     /* position unknown; its numbers are meaningless */
  MOCAP_STATE_MEASURED = 2, /* measured in this frame */
  MOCAP_STATE_FILLED = 3    /* predicted by the body model or extrapolated */
};

typedef struct mocap_client mocap_client;
typedef struct mocap_frame mocap_frame;

typedef struct mocap_vec3 {
  float x, y, z;
} mocap_vec3;

typedef struct mocap_quat {
  float x, y, z, w;
} mocap_quat;

typedef struct mocap_client_options {
  size_t size;          /* of this struct; set by mocap_client_options_init */
  const char* endpoint; /* tcp://ADDRESS:PORT or ipc://PATH; default tcp://127.0.0.1:5570 */
  const char* topic; /* "snapshot" (default): everything; "subject/NAME": one subject, no points; "markers": no bones */
  int32_t axes;      /* enum mocap_axes */
  int32_t keep;      /* frames kept for poll; 1 (default): only the newest; more: poll returns all, oldest first */
  /* CURVE keys; set all or none. Each is 40 characters of Z85, or a file of `mocapctl keys new`. If secret_key is such
     a file, public_key may be NULL. */
  const char* server_key;
  const char* public_key;
  const char* secret_key;
  /* Called by the client's thread after each message, for a program that waits for other things too: it wakes the
     program, which then polls. Must return at once, and must not close the client. NULL (default): none. */
  void (*on_message)(void* argument);
  void* on_message_argument;
} mocap_client_options;

/* One bone at one instant. 88 bytes. */
typedef struct mocap_bone_pose {
  mocap_vec3 position;       /* of the joint, in the world */
  mocap_quat rotation;       /* world from bone */
  mocap_vec3 local_position; /* in the frame of the parent bone; the parent of the root is the world */
  mocap_quat local_rotation;
  mocap_vec3 velocity; /* of the joint in the world, m/s (cm/s); 0 if the feed omits it */
  mocap_vec3 spin;     /* angular velocity about the world axes, rad/s */
  float confidence;    /* 0 to 1: approximate probability that the true position is within 30 mm */
  int32_t state;       /* enum mocap_state */
} mocap_bone_pose;

/* One labelled marker at one instant. 32 bytes. */
typedef struct mocap_marker_pose {
  mocap_vec3 position;
  float residual_px; /* rms reprojection error over the cameras; 0 if not measured */
  float confidence;  /* probability that the label is right, 0 to 1 */
  uint32_t cameras;  /* number of cameras that saw the marker */
  uint32_t track;    /* id of the 3D track of the label, plus 1; 0: none */
  int32_t state;     /* enum mocap_state */
} mocap_marker_pose;

/* An unlabelled marker. 24 bytes. */
typedef struct mocap_point {
  mocap_vec3 position;
  float residual_px;
  uint32_t cameras;
  uint32_t track; /* id of the 3D track, plus 1; constant while the marker is tracked; 0: none */
} mocap_point;

/* Description of a bone. Strings are never NULL and are valid as long as the frame has this description. */
typedef struct mocap_bone {
  const char* name;
  const char* unity_name;  /* HumanBodyBones; empty: none */
  const char* unreal_name; /* Mannequin */
  const char* vrm_name;    /* VRM 1.0 humanoid */
  int32_t parent;          /* index; -1: the root */
  mocap_vec3 rest_offset;  /* from the joint of the parent, in the rest pose */
} mocap_bone;

typedef struct mocap_marker {
  const char* name;
  int32_t bone;      /* index */
  mocap_vec3 offset; /* from the joint of the bone, in the bone's frame */
} mocap_marker;

/* One subject of a frame. The arrays are valid until the frame is passed to poll, wait or free. */
typedef struct mocap_subject {
  const char* name;
  const char* marker_set;
  const char* skeleton;
  int32_t phase;           /* enum mocap_phase */
  float residual_m;        /* rms distance of the markers from the skeleton; NaN: unknown */
  float smoothing_delay_s; /* delay of the pose by smoothing */
  const mocap_bone* bones; /* bone_count of them, parents first */
  size_t bone_count;
  const mocap_bone_pose* bone_poses; /* bone_pose_count of them: bone_count, or 0 while the subject is not tracked */
  size_t bone_pose_count;
  const mocap_marker* markers;
  size_t marker_count;
  const mocap_marker_pose* marker_poses; /* marker_count of them, or 0 */
  size_t marker_pose_count;
} mocap_subject;

typedef struct mocap_frame_info {
  uint64_t number;   /* number of the frame set; a gap is a set that the daemon skipped */
  uint64_t sequence; /* number of the message in the topic; a gap is a message that was lost */
  uint32_t description_version;
  uint32_t subject_count;
  uint32_t point_count; /* unlabelled markers */
  uint32_t cameras;     /* cameras with an image in this set */
  uint32_t expected_cameras;
  uint32_t synchronised; /* 1: all cameras expose simultaneously; 2: not all; 0: unknown */
  int64_t exposed_at_ns; /* instants on the monotonic clock of the daemon's host, or MOCAP_ABSENT */
  int64_t received_at_ns;
  int64_t detected_at_ns;
  int64_t fused_at_ns;
  int64_t sent_at_ns;
  int64_t utc_minus_host_ns; /* add to an instant to get ns since the Unix epoch */
  uint32_t timecode_rate;    /* SMPTE: counted frames per second; 0: the daemon has no timecode */
  uint8_t timecode_hours, timecode_minutes, timecode_seconds, timecode_frames;
  uint32_t timecode_drop_frame; /* 1: drop-frame counting for 29.97 Hz */
  uint32_t timecode_subframe;   /* exposures since the start of the timecode frame, from 0 */
} mocap_frame_info;

typedef struct mocap_statistics {
  uint64_t received;    /* snapshots */
  uint64_t lost;        /* gaps in their sequence: lost messages */
  uint64_t skipped;     /* received but not returned, because a newer frame existed */
  uint64_t unreadable;  /* messages that do not belong to this feed */
  uint64_t restarts;    /* restarts of the daemon */
  uint64_t connections; /* successful connections */
  uint64_t bytes;
  double rate_hz;     /* snapshots per second over the last 2 s */
  int64_t age_ns;     /* time from the exposure to the return of the last frame, or MOCAP_ABSENT */
  int64_t age_p50_ns; /* over the last 2048 returned frames, or MOCAP_ABSENT before the first with a known age */
  int64_t age_p99_ns; /* likewise */
} mocap_statistics;

/* MOCAP_CLIENT_ABI of the loaded library. If the value differs from the header, the two are incompatible. */
MOCAP_API int32_t mocap_client_abi(void);

/* Sets the defaults. `size` is sizeof(mocap_client_options). */
MOCAP_API void mocap_client_options_init(mocap_client_options* options, size_t size);

/* Starts to connect and returns immediately; the daemon need not run yet. NULL options: the defaults. Returns NULL if
 * an option is invalid, with the option, the expected value and a remedy in `fault` if given.
 */
MOCAP_API mocap_client* mocap_client_open(const mocap_client_options* options, char* fault, size_t fault_size);

/* Ends the client's thread within about 50 ms. NULL is allowed. No other call on the client may run. */
MOCAP_API void mocap_client_close(mocap_client* client);

MOCAP_API mocap_frame* mocap_frame_new(void);
MOCAP_API void mocap_frame_free(mocap_frame* frame);

/* Copies the newest frame to `frame` (with keep > 1: the frame after the one in `frame`). Returns 1 if `frame` changed,
 * 0 if there is no newer frame, and a negative number for a NULL argument. Never waits. Threads with separate frames
 * each get all frames.
 */
MOCAP_API int32_t mocap_client_poll(mocap_client* client, mocap_frame* frame);

/* Like mocap_client_poll, but waits at most `timeout_ms` for a newer frame. Do not use in a render thread. */
MOCAP_API int32_t mocap_client_wait(mocap_client* client, mocap_frame* frame, int32_t timeout_ms);

/* Counts since open. `size` is sizeof(mocap_statistics). */
MOCAP_API int32_t mocap_client_get_statistics(mocap_client* client, mocap_statistics* into, size_t size);

/* The reason why no data arrives (enum mocap_diagnosis). `sentence`, if given, receives the reason and a remedy in one
   line. */
MOCAP_API int32_t mocap_client_diagnose(mocap_client* client, char* sentence, size_t sentence_size);

/* Zeros and MOCAP_ABSENT for a frame that was never filled. `size` is sizeof(mocap_frame_info). */
MOCAP_API void mocap_frame_get_info(const mocap_frame* frame, mocap_frame_info* into, size_t size);

/* Time from the exposure to now, ns; MOCAP_ABSENT if unknown. */
MOCAP_API int64_t mocap_frame_age_ns(const mocap_frame* frame);

/* Session of the daemon that sent the frame, and its program and version. Empty for an empty frame. */
MOCAP_API const char* mocap_frame_session(const mocap_frame* frame);
MOCAP_API const char* mocap_frame_producer(const mocap_frame* frame);
/* Nominal frames per second; 0: unknown. */
MOCAP_API double mocap_frame_nominal_rate_hz(const mocap_frame* frame);

/* Returns 1, or 0 if there is no such subject. `size` is sizeof(mocap_subject). */
MOCAP_API int32_t mocap_frame_get_subject(const mocap_frame* frame, size_t index, mocap_subject* into, size_t size);

/* Index of the subject with this name in the frame, or -1. */
MOCAP_API int32_t mocap_frame_find_subject(const mocap_frame* frame, const char* name);

/* The unlabelled markers; `count` receives their number. */
MOCAP_API const mocap_point* mocap_frame_points(const mocap_frame* frame, size_t* count);

/* For languages that copy data instead of using pointers. Each copy function copies at most `capacity` entries and
 * returns the number of entries. Text of a bone: what = 0 name, 1 Unity, 2 Unreal, 3 VRM; never NULL.
 */
MOCAP_API size_t mocap_frame_copy_bone_poses(const mocap_frame* frame, size_t subject, mocap_bone_pose* into,
                                             size_t capacity);
MOCAP_API size_t mocap_frame_copy_marker_poses(const mocap_frame* frame, size_t subject, mocap_marker_pose* into,
                                               size_t capacity);
MOCAP_API size_t mocap_frame_copy_points(const mocap_frame* frame, mocap_point* into, size_t capacity);
MOCAP_API size_t mocap_frame_bone_count(const mocap_frame* frame, size_t subject);
MOCAP_API size_t mocap_frame_marker_count(const mocap_frame* frame, size_t subject);
MOCAP_API const char* mocap_frame_subject_name(const mocap_frame* frame, size_t subject);
MOCAP_API int32_t mocap_frame_subject_phase(const mocap_frame* frame, size_t subject);
MOCAP_API const char* mocap_frame_bone_text(const mocap_frame* frame, size_t subject, size_t bone, int32_t what);
MOCAP_API int32_t mocap_frame_bone_parent(const mocap_frame* frame, size_t subject, size_t bone);
MOCAP_API void mocap_frame_bone_rest_offset(const mocap_frame* frame, size_t subject, size_t bone, mocap_vec3* into);
MOCAP_API const char* mocap_frame_marker_name(const mocap_frame* frame, size_t subject, size_t marker);

/* Index of the bone or marker of a subject with this name, or -1. Then `fault`, if given, receives the names that
 * exist, and a suggestion if one of them is similar.
 */
MOCAP_API int32_t mocap_frame_find_bone(const mocap_frame* frame, size_t subject, const char* name, char* fault,
                                        size_t fault_size);
MOCAP_API int32_t mocap_frame_find_marker(const mocap_frame* frame, size_t subject, const char* name, char* fault,
                                          size_t fault_size);

/* ---- Lite: the small messages of the topics lite/NAME, from a relay or from your own ZeroMQ socket. The layout and
   the precision are in proto/lite/README.md. ---- */

#define MOCAP_LITE_BONES 27

/* One message: a subject at one instant. A subject with more than MOCAP_LITE_BONES bones has several messages for an
   instant; each has the root's position and the bones from first_bone on. */
typedef struct mocap_lite {
  uint64_t number;              /* as in mocap_frame_info */
  int64_t exposed_at_utc_ns;    /* middle of the exposure, ns since the Unix epoch */
  uint32_t description_version; /* of the description that has the names and parents of the bones */
  uint32_t sequence;            /* number of the message in the topic; a gap is a message that was lost */
  int32_t phase;                /* enum mocap_phase */
  uint32_t subject_bones;       /* bones of the subject; 0: it has no pose now */
  uint32_t first_bone;          /* index of rotations[0] in the description */
  uint32_t bone_count;          /* bones of this message */
  int32_t out_of_range;         /* 1: the root is more than 838 m from the origin; its position is not right */
  int32_t off_rest;             /* 1: a joint is not at its rest_offset from its parent */
  mocap_vec3 root_position;
  mocap_quat rotations[MOCAP_LITE_BONES]; /* world from bone */
  int32_t lost[MOCAP_LITE_BONES];         /* 1: the bone has no pose */
} mocap_lite;

/* Decodes the part of a message behind the zero byte of its topic, or a message of NATS. `axes` is an enum mocap_axes.
   The world position of a bone is that of its parent plus the parent's rotation applied to the bone's rest_offset.
   Returns 1, 0 if the bytes are no such message, and a negative number for a NULL argument. `size` is
   sizeof(mocap_lite). */
MOCAP_API int32_t mocap_lite_decode(const void* bytes, size_t byte_count, int32_t axes, mocap_lite* into, size_t size);

/* ---- Health: what the daemon reports about itself once a second. The fields are explained in health.proto. ---- */

typedef struct mocap_health mocap_health;

enum mocap_camera_phase {
  MOCAP_CAMERA_STARTING = 1,
  MOCAP_CAMERA_STREAMING = 2,
  MOCAP_CAMERA_SILENT = 3,    /* open, but no image arrives */
  MOCAP_CAMERA_REOPENING = 4, /* lost; the daemon tries to reopen the camera */
  MOCAP_CAMERA_ENDED = 5,     /* a recording has ended */
  MOCAP_CAMERA_STOPPED = 6    /* an operator stopped the capture */
};

enum mocap_stage {
  MOCAP_STAGE_RECEIVE = 1,
  MOCAP_STAGE_DETECT = 2,
  MOCAP_STAGE_FUSE = 3,
  MOCAP_STAGE_SEND = 4,
  MOCAP_STAGE_TOTAL = 5 /* from the middle of the exposure until the snapshot was sent */
};

enum mocap_recording_state { MOCAP_RECORDING_RUNS = 1, MOCAP_RECORDING_ENDED = 2, MOCAP_RECORDING_FAILED = 3 };

/* Counts since the start of the daemon, unless stated otherwise. */
typedef struct mocap_health_info {
  int64_t at_ns;             /* on the daemon's monotonic clock */
  int64_t utc_minus_host_ns; /* MOCAP_ABSENT: unknown */
  double set_rate_hz;        /* frame sets per second, over the last second */
  uint64_t sets, complete_sets, passed_over_sets;
  uint64_t dropped_snapshots, passed_over_snapshots, sent_snapshots;
  size_t camera_count, latency_count, recording_count;
  int32_t has_feed;                          /* 1: the following members are known */
  uint32_t listeners, behind, subscriptions; /* now */
  uint64_t connections, disconnections, failed_handshakes, refused_clients, cut_off, failed_accepts;
} mocap_health_info;

/* Strings are never NULL and are valid as long as the health report. An unknown double is NaN, an unknown answer to a
   question (synchronised, bumped) is -1, yes is 1, no is 0. Counts since the start of the daemon. */
typedef struct mocap_camera_health {
  const char* name;
  const char* last_error; /* empty: none */
  int32_t phase;          /* enum mocap_camera_phase */
  int32_t synchronised;
  int32_t bumped; /* the pose differs from the rig */
  int32_t clock_source;
  int32_t chunk_times;
  double rate_hz; /* images per second, over the last second */
  uint64_t frames, missing_frames, failed_frames, dropped_queue_full, dropped_blobs, reopened;
  uint64_t underruns, resent_packets, missing_packets;
  uint64_t blobs, blobs_too_small, blobs_too_large, blobs_not_round, blobs_too_dim, rows_given_up;
  uint64_t repeated_frames, clock_leaps;
  double threshold_grey, noise_grey, background_grey;
  double offset_us, drift_us_s, jitter_us, clock_uncertainty_us;
  double rig_off_px, rig_turned_rad, rig_moved_m;
} mocap_camera_health;

/* Over the last second. */
typedef struct mocap_latency {
  int32_t stage; /* enum mocap_stage */
  uint64_t count;
  int64_t p50_ns, p99_ns, max_ns;
} mocap_latency;

typedef struct mocap_recording {
  const char* path;
  const char* error; /* empty unless failed */
  int32_t state;     /* enum mocap_recording_state */
  uint64_t size_bytes, records;
} mocap_recording;

MOCAP_API mocap_health* mocap_health_new(void);
MOCAP_API void mocap_health_free(mocap_health* health);

/* Copies the newest report to `into`. Returns 1, 0 if none has arrived yet, and a negative number for a NULL argument.
 */
MOCAP_API int32_t mocap_client_get_health(mocap_client* client, mocap_health* into);

/* Each returns 1, or 0 if there is no such entry or no report. `size` is the size of the struct. */
MOCAP_API int32_t mocap_health_get_info(const mocap_health* health, mocap_health_info* into, size_t size);
MOCAP_API int32_t mocap_health_get_camera(const mocap_health* health, size_t index, mocap_camera_health* into,
                                          size_t size);
MOCAP_API int32_t mocap_health_get_latency(const mocap_health* health, size_t index, mocap_latency* into, size_t size);
MOCAP_API int32_t mocap_health_get_recording(const mocap_health* health, size_t index, mocap_recording* into,
                                             size_t size);

/* ---- Events: changes of state, once each. ---- */

enum mocap_event_kind {
  MOCAP_EVENT_SUBJECT_FOUND = 1,
  MOCAP_EVENT_SUBJECT_LOST = 2,
  MOCAP_EVENT_DESCRIPTION_CHANGED = 3,
  MOCAP_EVENT_CAMERA_LOST = 4,
  MOCAP_EVENT_CAMERA_BACK = 5,
  MOCAP_EVENT_TAKE_STARTED = 6, /* message: its name */
  MOCAP_EVENT_TAKE_ENDED = 7,   /* the file is complete; message: its name and its quality */
  MOCAP_EVENT_TAKE_FAILED = 8,  /* ended early; message: its name and the reason */
  MOCAP_EVENT_MARK = 9          /* of an operator; only in takes */
};

typedef struct mocap_event {
  uint64_t sequence; /* a gap: events were lost */
  int64_t at_ns;     /* on the daemon's monotonic clock */
  int32_t kind;      /* enum mocap_event_kind; ignore an unknown kind */
  uint32_t description_version;
  char name[128];    /* of the subject or camera; empty: none, or not described yet */
  char message[384]; /* for the operator; may be empty */
} mocap_event;

/* The oldest event that was not taken yet. Returns 1, 0 if there is none, and a negative number for a NULL argument.
   Never waits. The client keeps the newest 256 events; each is returned once. */
MOCAP_API int32_t mocap_client_next_event(mocap_client* client, mocap_event* into, size_t size);

/* ---- Control: requests to a running daemon, as mocapctl sends them. ----
 *
 *   mocap_control* control = mocap_control_open(NULL, NULL, 0);
 *   mocap_answer* answer = mocap_answer_new();
 *   mocap_request request;
 *   mocap_request_init(&request, sizeof request, MOCAP_REQUEST_CAPTURE_STOP);
 *   if (mocap_control_ask(control, &request, answer) != MOCAP_CODE_DONE) puts(mocap_answer_message(answer));
 */
typedef struct mocap_control mocap_control;
typedef struct mocap_answer mocap_answer;

enum mocap_code {
  MOCAP_CODE_NO_ANSWER = 0, /* mocap_answer_diagnosis has the reason */
  MOCAP_CODE_DONE = 1,
  MOCAP_CODE_INVALID = 2,
  MOCAP_CODE_NOT_FOUND = 3,   /* no such subject or camera */
  MOCAP_CODE_FORBIDDEN = 4,   /* the role of this client's key does not permit the request */
  MOCAP_CODE_UNSUPPORTED = 5, /* the camera or the run does not support the request */
  MOCAP_CODE_TIMEOUT = 6,     /* the request may still be executed */
  MOCAP_CODE_FAILED = 7
};

/* All but MOCAP_REQUEST_STATUS need the role operator. */
enum mocap_request_kind {
  MOCAP_REQUEST_STATUS = 1,
  MOCAP_REQUEST_CAPTURE_START = 2,
  MOCAP_REQUEST_CAPTURE_STOP = 3,
  MOCAP_REQUEST_SUBJECT_ADD = 4,    /* search for `name` again; with marker_set: a new subject */
  MOCAP_REQUEST_SUBJECT_REMOVE = 5, /* `name` is away: not searched for */
  MOCAP_REQUEST_SUBJECT_RESET = 6,  /* discard pose and fit of `name` */
  MOCAP_REQUEST_SUBJECT_FIT = 7,    /* `name` has the fit in the offsets */
  MOCAP_REQUEST_CAMERA_SET = 8,     /* exposure_us and gain_db of camera `name` */
  MOCAP_REQUEST_MASK_LEARN = 9,     /* lights of the empty volume, of camera `name` or of all */
  MOCAP_REQUEST_RELOAD = 10,        /* read the configuration again */
  /* Takes. The answer's message names the file. */
  MOCAP_REQUEST_TAKE_START = 11,  /* record the take `name`; refused while another one is recorded */
  MOCAP_REQUEST_TAKE_STOP = 12,   /* the answer comes when the file is on the disk: give a timeout of 30 s */
  MOCAP_REQUEST_TAKE_CANCEL = 13, /* end the take and delete its file */
  MOCAP_REQUEST_TAKE_MARK = 14,   /* write the event `text` into the take */
  MOCAP_REQUEST_TAKE_NEXT = 15    /* end the take and start the next one of the same slate */
};

typedef struct mocap_control_options {
  size_t size;          /* of this struct; set by mocap_control_options_init */
  const char* endpoint; /* default tcp://127.0.0.1:5571 */
  int32_t timeout_ms;   /* longest wait for an answer; default 5000 */
  int32_t axes;         /* enum mocap_axes, for mocap_control_get_frame */
  /* As in mocap_client_options. */
  const char* server_key;
  const char* public_key;
  const char* secret_key;
} mocap_control_options;

typedef struct mocap_request {
  size_t size;        /* of this struct; set by mocap_request_init */
  int32_t kind;       /* enum mocap_request_kind */
  int32_t timeout_ms; /* 0 (default): that of the options */
  const char* name;   /* of the subject, camera or take; NULL for TAKE_START: by [takes] name of the configuration */
  /* Absolute path on the daemon's machine, for SUBJECT_ADD of a new subject; NULL (default): a configured subject. */
  const char* marker_set;
  double exposure_us; /* NaN (default): unchanged */
  double gain_db;     /* NaN (default): unchanged */
  uint32_t images;    /* number of images of each camera, for MASK_LEARN; 0 (default): 100 */
  /* For SUBJECT_FIT: x y z of each bone's rest offset and of each marker's offset, m, in the axes of the feed and in
     the order of the description. The counts are numbers of doubles. */
  const double* rest_offsets_m;
  size_t rest_offset_count;
  const double* marker_offsets_m;
  size_t marker_offset_count;
  double residual_m; /* rms residual of the markers; 0 (default): unknown */
  /* For TAKE_START and TAKE_NEXT; NULL and 0 are the defaults. */
  const char* slate;  /* NULL: the slate of the last take */
  const char* text;   /* notes; for TAKE_MARK: the text of the mark */
  double before_s;    /* pre-roll: the take begins this long before its start time */
  double seconds;     /* the take ends after this time; 0: at TAKE_STOP */
  double countdown_s; /* the take starts after this time */
  int64_t at_utc_ns;  /* the take starts at this time; 0: at once */
} mocap_request;

typedef struct mocap_status {
  const char* producer; /* program and version */
  const char* session;
  const char* role;  /* of this client */
  int32_t capturing; /* 0: an operator stopped the cameras */
  size_t subject_count;
} mocap_status;

typedef struct mocap_subject_status {
  const char* name;
  int32_t phase; /* enum mocap_phase */
  int32_t away;  /* 1: removed by an operator */
} mocap_subject_status;

MOCAP_API void mocap_control_options_init(mocap_control_options* options, size_t size);

/* Starts to connect and returns immediately. NULL options: the defaults. Returns NULL if an option is invalid, with the
   reason in `fault` if given. */
MOCAP_API mocap_control* mocap_control_open(const mocap_control_options* options, char* fault, size_t fault_size);

/* NULL is allowed. No other call on the control may run. */
MOCAP_API void mocap_control_close(mocap_control* control);

MOCAP_API mocap_answer* mocap_answer_new(void);
MOCAP_API void mocap_answer_free(mocap_answer* answer);

MOCAP_API void mocap_request_init(mocap_request* request, size_t size, int32_t kind);

/* Sends a request and waits for its answer. Returns an enum mocap_code, or a negative number for a NULL argument.
   Without a connection the call returns after about 1 s, with the reason in the answer, whatever the timeout. Requests
   of several threads are sent one after another. */
MOCAP_API int32_t mocap_control_ask(mocap_control* control, const mocap_request* request, mocap_answer* answer);

/* Requests the description and the next snapshot with all its parts, and copies them to `frame`. Needs no subscription.
   Returns as mocap_control_ask. */
MOCAP_API int32_t mocap_control_get_frame(mocap_control* control, mocap_frame* frame, mocap_answer* answer);

/* enum mocap_code of the last request. */
MOCAP_API int32_t mocap_answer_code(const mocap_answer* answer);
/* For the operator: the result, or the faults and their remedies, one a line. Never NULL; valid until the answer is
   used again. */
MOCAP_API const char* mocap_answer_message(const mocap_answer* answer);
/* enum mocap_diagnosis: MOCAP_WELL, or the reason why no answer came. */
MOCAP_API int32_t mocap_answer_diagnosis(const mocap_answer* answer);

/* For MOCAP_REQUEST_STATUS. Each returns 1, or 0 if the answer has no such entry. The strings are valid until the
   answer is used again. */
MOCAP_API int32_t mocap_answer_get_status(const mocap_answer* answer, mocap_status* into, size_t size);
MOCAP_API int32_t mocap_answer_get_subject(const mocap_answer* answer, size_t index, mocap_subject_status* into,
                                           size_t size);
/* Copies the health report of a status to `into`. */
MOCAP_API int32_t mocap_answer_get_health(const mocap_answer* answer, mocap_health* into);

#ifdef __cplusplus
}
#endif

#endif /* MOCAP_CLIENT_H */
