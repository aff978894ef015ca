/*
 * mocap_client.h: the feed of a mocapd for programs that are no part of it. A C ABI, so that C, C++, C#, Rust, Unity
 * native plugins and Unreal modules can link it. Behind it: ZeroMQ, one thread a client, no Protobuf runtime.
 *
 *   mocap_client_options options;
 *   mocap_client_options_init(&options, sizeof options);
 *   options.axes = MOCAP_AXES_UNITY;
 *   mocap_client* client = mocap_client_open(&options, NULL, 0);
 *   mocap_frame* frame = mocap_frame_new();
 *   ... each tick:  if (mocap_client_poll(client, frame) == 1) { use frame }
 *   mocap_frame_free(frame); mocap_client_close(client);
 *
 * Poll never waits for the network: the client's thread receives, keeps the newest frame, connects again by itself
 * when the daemon restarts, and knows at any time why no data comes (mocap_client_diagnose).
 *
 * Units: m (Unreal: cm), rad, s, ns. Quaternions are unit and in the order x y z w. A bone's frame sits in its joint;
 * in rest pose (T-pose, facing forward) every bone's frame is parallel to the axes of the world, so a rotation is what
 * turns a bone out of the T-pose.
 *
 * Threads: each function may be called from any thread. One mocap_frame belongs to one thread at a time.
 * Errors: functions return 0 or a negative number; none ends the process or throws.
 * Versions: what is here stays. Structs that may grow are filled up to the size that the caller gives. The numbers of
 * the ABI are in mocap_client_abi().
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
/* An instant that is not known; 0 is an instant. */
#define MOCAP_ABSENT INT64_MIN

/* The axes in which positions and rotations come. Forward is where the subject faces in T-pose. */
enum mocap_axes {
  MOCAP_AXES_MOCAP = 0,  /* the feed's own: right-handed, x forward, y left, z up, m */
  MOCAP_AXES_UNITY = 1,  /* left-handed, x right, y up, z forward, m */
  MOCAP_AXES_UNREAL = 2, /* left-handed, x forward, y right, z up, cm */
  MOCAP_AXES_GODOT = 3,  /* right-handed, x right, y up, z backward, m */
  MOCAP_AXES_GLTF = 4    /* right-handed, x left, y up, z forward, m */
};

/* Why no data comes, or that all is well. */
enum mocap_diagnosis {
  MOCAP_WELL = 0,
  MOCAP_NOTHING_LISTENS = 1,
  MOCAP_NOT_A_FEED = 2,         /* somebody listens there who does not speak this protocol */
  MOCAP_KEY_MISSING = 3,        /* one side wants keys (CURVE), the other has none */
  MOCAP_KEY_REFUSED = 4,        /* the daemon does not know our public key */
  MOCAP_SERVER_KEY_WRONG = 5,   /* the daemon is not who our server key says, or is no mocapd */
  MOCAP_NO_DESCRIPTION = 6,     /* connected, and nobody says what the feed is */
  MOCAP_VERSION_TOO_NEW = 7,    /* a feed of a protocol that this library does not know */
  MOCAP_CAMERAS_SILENT = 8,     /* at least one camera gives no images */
  MOCAP_NO_SNAPSHOTS = 9,       /* described, and no snapshot comes */
  MOCAP_SUBJECT_SEARCHING = 10, /* snapshots come, and nobody is recognised in them */
  MOCAP_CLOCK_SKEW = 11,        /* the clocks of the two machines differ, so ages mean nothing */
  MOCAP_CONNECTING = 12         /* too early to say */
};

enum mocap_phase { MOCAP_PHASE_SEARCHING = 1, MOCAP_PHASE_TRACKING = 2, MOCAP_PHASE_LOST = 3 };

/* Of a bone or a marker. */
enum mocap_state {
  MOCAP_STATE_LOST = 1,     /* nobody knows where it is; its numbers mean nothing */
  MOCAP_STATE_MEASURED = 2, /* seen in this frame */
  MOCAP_STATE_FILLED = 3    /* told by the body's model, or carried on */
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
  const char* topic;    /* default "snapshot", all; "subject/NAME" that one, without points; "markers" no bones */
  int32_t axes;         /* enum mocap_axes */
  int32_t keep;         /* frames kept for poll: 1 (default) the newest only; more: poll gives each, oldest first */
  /* CURVE; all or none. Each is 40 characters of Z85, or a file of `mocapctl keys new` that holds it; where secret_key
     is such a file, public_key may be NULL. */
  const char* server_key;
  const char* public_key;
  const char* secret_key;
} mocap_client_options;

/* One bone at one instant. 88 bytes. */
typedef struct mocap_bone_pose {
  mocap_vec3 position;       /* of its joint, in the world */
  mocap_quat rotation;       /* what turns its frame into the world's */
  mocap_vec3 local_position; /* the same in the parent bone's frame; the root's parent is the world */
  mocap_quat local_rotation;
  mocap_vec3 velocity; /* of its joint in the world, m/s (cm/s); 0 where the feed does not tell */
  mocap_vec3 spin;     /* about the world's axes, rad/s */
  float confidence;    /* 0 to 1: about the probability that it is within 30 mm of where it is told */
  int32_t state;       /* enum mocap_state */
} mocap_bone_pose;

/* One named marker at one instant. 32 bytes. */
typedef struct mocap_marker_pose {
  mocap_vec3 position;
  float residual_px; /* rms over the cameras' images; 0 when not measured */
  float confidence;  /* that the name is right, 0 to 1 */
  uint32_t cameras;  /* that saw it */
  uint32_t track;    /* the 3D track that bears the name, plus 1; 0: none */
  int32_t state;     /* enum mocap_state */
} mocap_marker_pose;

/* A marker without a name. 24 bytes. */
typedef struct mocap_point {
  mocap_vec3 position;
  float residual_px;
  uint32_t cameras;
  uint32_t track; /* plus 1, the same from frame to frame while it is followed; 0: none */
} mocap_point;

/* What a bone is. Strings are never NULL and live as long as the frame holds this description. */
typedef struct mocap_bone {
  const char* name;
  const char* unity_name;  /* HumanBodyBones; empty: has none */
  const char* unreal_name; /* Mannequin */
  const char* vrm_name;    /* VRM 1.0 humanoid */
  int32_t parent;          /* index; -1: the root */
  mocap_vec3 rest_offset;  /* from the parent's joint, in rest pose */
} mocap_bone;

typedef struct mocap_marker {
  const char* name;
  int32_t bone;      /* index */
  mocap_vec3 offset; /* from the bone's joint, in the bone's frame */
} mocap_marker;

/* One subject of a frame. The arrays live until the frame is next given to poll, wait or free. */
typedef struct mocap_subject {
  const char* name;
  const char* marker_set;
  const char* skeleton;
  int32_t phase;           /* enum mocap_phase */
  float residual_m;        /* rms of the markers from where the skeleton puts them; NaN: not known */
  float smoothing_delay_s; /* by which smoothing made the pose late */
  const mocap_bone* bones; /* bone_count of them, parents first */
  size_t bone_count;
  const mocap_bone_pose* bone_poses; /* bone_pose_count of them: bone_count, or 0 while it is not tracked */
  size_t bone_pose_count;
  const mocap_marker* markers;
  size_t marker_count;
  const mocap_marker_pose* marker_poses; /* marker_count of them, or 0 */
  size_t marker_pose_count;
} mocap_subject;

typedef struct mocap_frame_info {
  uint64_t number;   /* counts the daemon's sets: a gap is one that it passed over */
  uint64_t sequence; /* counts the messages of the topic: a gap is one that was lost on the way */
  uint32_t description_version;
  uint32_t subject_count;
  uint32_t point_count; /* markers without a name */
  uint32_t cameras;     /* that took part */
  uint32_t expected_cameras;
  uint32_t synchronised; /* 1: all cameras expose together; 2: some runs by itself; 0: not known */
  int64_t exposed_at_ns; /* instants on the monotonic clock of the daemon's host, or MOCAP_ABSENT */
  int64_t received_at_ns;
  int64_t detected_at_ns;
  int64_t fused_at_ns;
  int64_t sent_at_ns;
  int64_t utc_minus_host_ns; /* add it to an instant to get ns since the Unix epoch */
  uint32_t timecode_rate;    /* SMPTE: frames a second that are counted; 0: the daemon has no timecode */
  uint8_t timecode_hours, timecode_minutes, timecode_seconds, timecode_frames;
  uint32_t timecode_drop_frame; /* 1: numbers are left out to keep step with 29.97 Hz */
  uint32_t reserved;
} mocap_frame_info;

typedef struct mocap_statistics {
  uint64_t received;    /* snapshots */
  uint64_t lost;        /* gaps in their sequence: lost on the way */
  uint64_t skipped;     /* came and were never handed out: a newer one was there */
  uint64_t unreadable;  /* messages that are none of this feed */
  uint64_t restarts;    /* the daemon began anew */
  uint64_t connections; /* how often the connection was made */
  uint64_t bytes;
  double rate_hz;     /* snapshots a second over the last 2 s */
  int64_t age_ns;     /* exposure to hand-out of the last frame handed out, or MOCAP_ABSENT */
  int64_t age_p50_ns; /* over the last 2048 frames handed out */
  int64_t age_p99_ns;
} mocap_statistics;

/* MOCAP_CLIENT_ABI of the library that is loaded. Another number than the header's: the two do not go together. */
MOCAP_API int32_t mocap_client_abi(void);

/* Sets the defaults. `size` is sizeof(mocap_client_options). */
MOCAP_API void mocap_client_options_init(mocap_client_options* options, size_t size);

/*
 * Begins to connect and returns at once; nobody need be there yet. NULL options are the defaults. NULL when an option
 * is wrong; then `fault`, if given, says which, what is expected and what helps.
 */
MOCAP_API mocap_client* mocap_client_open(const mocap_client_options* options, char* fault, size_t fault_size);

/* Ends the client's thread, within about 50 ms. NULL is harmless. No other call may run on it. */
MOCAP_API void mocap_client_close(mocap_client* client);

MOCAP_API mocap_frame* mocap_frame_new(void);
MOCAP_API void mocap_frame_free(mocap_frame* frame);

/*
 * Puts the newest frame into `frame` (with keep > 1: the one after that which is in it). 1: it did; 0: there is none
 * newer than what is in it; negative: NULL was given. Never waits. Two threads with a frame each get all frames each.
 */
MOCAP_API int32_t mocap_client_poll(mocap_client* client, mocap_frame* frame);

/* The same, and waits for it at most `timeout_ms`. Not for a thread that draws. */
MOCAP_API int32_t mocap_client_wait(mocap_client* client, mocap_frame* frame, int32_t timeout_ms);

/* Counts since open. `size` is sizeof(mocap_statistics). */
MOCAP_API int32_t mocap_client_get_statistics(mocap_client* client, mocap_statistics* into, size_t size);

/* Why no data comes (enum mocap_diagnosis); `sentence`, if given, gets it in one line together with what helps. */
MOCAP_API int32_t mocap_client_diagnose(mocap_client* client, char* sentence, size_t sentence_size);

/* All zero and absent for a frame that was never filled. `size` is sizeof(mocap_frame_info). */
MOCAP_API void mocap_frame_get_info(const mocap_frame* frame, mocap_frame_info* into, size_t size);

/* Exposure to now, ns; MOCAP_ABSENT where nobody knows. */
MOCAP_API int64_t mocap_frame_age_ns(const mocap_frame* frame);

/* Session of the daemon that the frame comes from, and its program and version; empty for an empty frame. */
MOCAP_API const char* mocap_frame_session(const mocap_frame* frame);
MOCAP_API const char* mocap_frame_producer(const mocap_frame* frame);
/* Frames a second when all goes well; 0: not known. */
MOCAP_API double mocap_frame_nominal_rate_hz(const mocap_frame* frame);

/* 1, or 0 when there is no such subject. `size` is sizeof(mocap_subject). */
MOCAP_API int32_t mocap_frame_get_subject(const mocap_frame* frame, size_t index, mocap_subject* into, size_t size);

/* Index of the subject of this name in the frame, or -1. */
MOCAP_API int32_t mocap_frame_find_subject(const mocap_frame* frame, const char* name);

/* Markers without a name; `count` of them. */
MOCAP_API const mocap_point* mocap_frame_points(const mocap_frame* frame, size_t* count);

/*
 * For languages that copy rather than point. Each copies at most `capacity` entries and returns how many there are.
 * Text of a bone: what = 0 name, 1 Unity, 2 Unreal, 3 VRM; never NULL.
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

#ifdef __cplusplus
}
#endif

#endif /* MOCAP_CLIENT_H */
