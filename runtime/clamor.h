/* clamor.h: Clamor in a game: opens baked levels and renders what listeners hear in them.
 *
 *   clamor_context* clamor;
 *   clamor_level level;
 *   clamor_listener ears;
 *   clamor_listener_options options = {sizeof options};
 *   clamor_create(NULL, &clamor, NULL);
 *   clamor_open_level(clamor, "hall.clamor", &level, NULL);
 *   clamor_create_listener(clamor, level, &options, &ears, NULL);
 *
 *   game thread:   clamor_move_listener(clamor, ears, &pose);
 *                  clamor_move_source(clamor, car, &motion);  clamor_commit(clamor, 0);
 *   audio thread:  clamor_render(clamor, ears, block, frames);
 *
 * THREADS. Each function names the threads that may call it. "Any" may be called by several threads
 * at once: such calls take turns, and may wait for a keyframe that is being made, 5 ms for 20 000
 * voices. "Audio" may be called by one thread at a time for each listener; it neither allocates nor
 * locks nor calls the system, and its cost is that of the voices alone.
 *
 * ERRORS. Functions return CLAMOR_OK, or a negative code if they failed. A function that failed has
 * changed nothing, results included, except clamor_commit(), which may have published some of the
 * changes if memory ran out. Functions with a clamor_error, which may be null, also write a sentence
 * into it. A null context is CLAMOR_ERROR_ARGUMENT. No C++ exception leaves the library. It installs
 * no signal handlers, prints nothing and reads no locale.
 *
 * CALLBACKS of the application's may run while the library holds locks. They must not throw, and
 * must neither call functions of the context nor wait for a thread that does.
 *
 * HANDLES are numbers. A handle that is stale, invented or another context's is
 * CLAMOR_ERROR_HANDLE. The pointer to a context is valid until clamor_destroy().
 *
 * FORK. A child made by fork() has none of the library's threads. There, calls with a context of its
 * parent's are CLAMOR_ERROR_ARGUMENT, clamor_destroy() does nothing, and clamor_create() is
 * CLAMOR_ERROR_STATE if the parent had called it. exec() begins anew.
 *
 * STRUCTURES begin with `bytes`, their size as the caller knows it, at most 4096: later versions
 * append members. Members that are 0 mean the default. Options that the library does not know are
 * CLAMOR_ERROR_ARGUMENT unless they are 0, and results that it does not know become 0. A structure
 * without its size is CLAMOR_ERROR_ARGUMENT, too: the sentence, or the context's log, names it.
 *
 * LIMITS, beyond which calls return CLAMOR_ERROR_ARGUMENT: listeners 1e9 m, sources and parts 1e8 m
 * from the origin, 10 km/s, 5e6 s for clamor_commit(), 1e6 s for `played_s`, 1e4 for directivity
 * exponents, 1e6 for gains of sources and groups, and 100 for the reverberation of sources.
 *
 * OUTSIDE a level, which the context's log warns of, is what lies beyond the bounds of its surfaces and
 * emitters, by more than their diagonal if sound leaves it. It costs nothing but is usually a mistake.
 *
 * UNITS. Metres and seconds. The frame is that of glTF: +X right, +Y up, and a listener whose
 * orientation is the identity looks along -Z. Samples are amplitudes, 1 at full scale.
 */
#ifndef CLAMOR_H
#define CLAMOR_H

#include <stddef.h>
#include <stdint.h>

#define CLAMOR_VERSION_MAJOR 0
#define CLAMOR_VERSION_MINOR 1
#define CLAMOR_VERSION_PATCH 0
/* Programs run with every library of the same ABI version that is not older than their header. */
#define CLAMOR_ABI_VERSION 0

#if defined(CLAMOR_BUILDS_LIBRARY) && defined(_WIN32)
#define CLAMOR_API __declspec(dllexport)
#elif defined(CLAMOR_BUILDS_LIBRARY) && defined(__GNUC__)
#define CLAMOR_API __attribute__((visibility("default")))
#else
#define CLAMOR_API
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* ---- Results ------------------------------------------------------------------------------- */

typedef int32_t clamor_result;
enum {
  CLAMOR_OK = 0,
  CLAMOR_ERROR_ARGUMENT = -1, /* null, not finite, out of range, or without its size */
  CLAMOR_ERROR_HANDLE = -2,   /* no such object in this context */
  CLAMOR_ERROR_FILE = -3,     /* cannot be read, or is damaged; see the sentence */
  CLAMOR_ERROR_MEMORY = -4,
  CLAMOR_ERROR_FULL = -5,   /* there are as many objects as a context can hold */
  CLAMOR_ERROR_BUSY = -6,   /* another thread is rendering this listener */
  CLAMOR_ERROR_STATE = -7,  /* not possible now, or not with these options */
  CLAMOR_ERROR_INTERNAL = -8,  /* a fault of the library; please report it */
  CLAMOR_ERROR_NOT_FOUND = -12 /* nothing has this name */
};

typedef struct clamor_error {
  clamor_result code;
  char sentence[508]; /* UTF-8, ends with a zero */
} clamor_error;

/* A short text for a code. Any thread; never null. */
CLAMOR_API const char* clamor_result_text(clamor_result result);

/* The library's version, as major << 16 | minor << 8 | patch, and its ABI version. Any thread. */
CLAMOR_API uint32_t clamor_version(void);
CLAMOR_API uint32_t clamor_abi_version(void);

/* ---- Context ------------------------------------------------------------------------------- */

/* A world: open levels, and listeners in them. Contexts do not see each other. */
typedef struct clamor_context clamor_context;

typedef struct clamor_options {
  uint32_t bytes;
  /* 0: the library makes keyframes on a thread of its own, and each listener has threads that load
   * pages and sounds. 1: the caller calls clamor_update() regularly. */
  uint32_t caller_updates;
  /* With caller_updates: the longest time between two updates [1/30 s]. Shorter is lower latency. */
  double update_period_s;
  uint32_t max_sources; /* at a time, 1 to 65 536 [1024]; each takes 1.5 kB for each listener */
  uint32_t max_sounds;  /* at a time, 1 to 4096 [256] */
  /* Callbacks, each called with `user`; any may be null. */
  void* user;
  /* Receives a UTF-8 sentence for what no function can return: a page or a part of a sound that cannot
   * be read, a keyframe that could not be made, a structure's `bytes` that is not its size where the
   * function has no clamor_error, and, once for each listener and level, a listener or a source that is
   * outside the level, and once for each clamor_measure_responses() a place. Called by any thread but
   * the audio thread, several at a time. */
  void (*log)(void* user, const char* sentence);
  /* Called on each thread that the library keeps, as it begins and as it ends, so that it can be
   * registered, counted or bound to cores: "sampler", "page loader", "sound loader". Not called for
   * threads that live for one call, or for those of oneTBB. */
  void (*thread_begins)(void* user, const char* name);
  void (*thread_ends)(void* user, const char* name);
} clamor_options;

/* Errors: ARGUMENT, MEMORY; `*context` is then null. `options` may be null. Any thread;
 * microseconds. */
CLAMOR_API clamor_result clamor_create(const clamor_options* options, clamor_context** context,
                                       clamor_error* error);

/* Frees the context and all that belongs to it. No other call may be under way. Null is allowed. */
CLAMOR_API void clamor_destroy(clamor_context* context);

/* With caller_updates: makes the keyframes that listeners want now, then loads pages and sounds
 * until none are requested or `loading_s` have passed (at least one where any are requested). Call
 * it at least every update_period_s. One thread at a time, of any; 0.1 to 5 ms for each keyframe.
 * Writes to `made`, which may be null, how many keyframes were made. Errors: STATE without
 * caller_updates, ARGUMENT, MEMORY. */
CLAMOR_API clamor_result clamor_update(clamor_context* context, double loading_s, uint32_t* made);

/* ---- Levels -------------------------------------------------------------------------------- */

typedef uint64_t clamor_level;

/* Opens a file that `clamor bake` wrote. Reads its first page only, whatever its size.
 * Errors: ARGUMENT, FILE, FULL (256 levels), MEMORY. Any thread; blocks on the disk. */
CLAMOR_API clamor_result clamor_open_level(clamor_context* context, const char* path,
                                           clamor_level* level, clamor_error* error);

/* A bake in the application's own archive or in memory. */
typedef struct clamor_reader {
  uint32_t bytes;
  const char* name; /* stands for the path in sentences; copied */
  uint64_t size;    /* of the bake, in bytes */
  void* user;
  /* Copies `count` bytes from `offset` on into `into` and returns 0, or another number if it
   * cannot. Called by several threads at a time; never by the audio thread. It must not call
   * functions of this context. */
  int32_t (*read)(void* user, uint64_t offset, uint64_t count, void* into);
  const void* memory; /* instead of `read`: all bytes, which must not change until `release` */
  /* Called once, when nothing is read any more; may be null. Not called after an error. */
  void (*release)(void* user);
} clamor_reader;

/* As clamor_open_level(). */
CLAMOR_API clamor_result clamor_open_level_with(clamor_context* context,
                                                const clamor_reader* reader, clamor_level* level,
                                                clamor_error* error);

/* Ends the handle. Listeners who are in the level hear it until they enter another one.
 * Errors: HANDLE. Any thread. */
CLAMOR_API clamor_result clamor_close_level(clamor_context* context, clamor_level level);

typedef struct clamor_level_info {
  uint32_t bytes;
  uint32_t emitters, sounds, portals;
  uint64_t sources; /* emitters and secondary sources, those of instances counted each */
  uint32_t parts;   /* movable parts */
} clamor_level_info;

/* Errors: HANDLE, ARGUMENT. Any thread. */
CLAMOR_API clamor_result clamor_get_level_info(clamor_context* context, clamor_level level,
                                               clamor_level_info* info);

typedef struct clamor_emitter_info {
  uint32_t bytes;
  uint32_t sound;       /* of the level's: its index */
  double position_m[3];
  double gain;          /* amplitude at 1 m at full scale */
  const char* name;     /* of its node in glTF, UTF-8; valid until the level is closed */
} clamor_emitter_info;

/* The emitter number `emitter` of a level, below clamor_level_info's `emitters`. Errors: HANDLE,
 * ARGUMENT. Any thread. */
CLAMOR_API clamor_result clamor_get_emitter_info(clamor_context* context, clamor_level level,
                                                 uint32_t emitter, clamor_emitter_info* info);

/* Writes to `emitter` the number of the first one with this name. Errors: HANDLE, ARGUMENT,
 * NOT_FOUND. Any thread. */
CLAMOR_API clamor_result clamor_find_emitter(clamor_context* context, clamor_level level,
                                             const char* name, uint32_t* emitter);

/* A rectangle in an opening, as in a doorway; see clamor_set_portal(). */
typedef struct clamor_portal_info {
  uint32_t bytes;
  double centre_m[3];
  double half_u_m[3], half_v_m[3]; /* from the centre to the middle of a side, and of the next one */
  const char* name;                /* UTF-8; valid until the level is closed */
} clamor_portal_info;

/* The portal number `portal` of a level, below clamor_level_info's `portals`. Errors: HANDLE,
 * ARGUMENT. Any thread. */
CLAMOR_API clamor_result clamor_get_portal_info(clamor_context* context, clamor_level level,
                                                uint32_t portal, clamor_portal_info* info);

/* Writes to `portal` the number of the first one with this name. Errors: HANDLE, ARGUMENT,
 * NOT_FOUND. Any thread. */
CLAMOR_API clamor_result clamor_find_portal(clamor_context* context, clamor_level level,
                                            const char* name, uint32_t* portal);

/* ---- Listeners ----------------------------------------------------------------------------- */

typedef uint64_t clamor_listener;

typedef struct clamor_pose {
  double position_m[3];
  double orientation[4]; /* quaternion x, y, z, w of any length but 0 */
} clamor_pose;

enum {
  CLAMOR_OUTPUT_BINAURAL = 0,     /* for headphones, with the head in `sofa` */
  CLAMOR_OUTPUT_LOUDSPEAKERS = 1, /* in `layout`, panned by VBAP */
  CLAMOR_OUTPUT_AMBISONICS = 2,   /* third order, ACN and SN3D: 16 channels */
  CLAMOR_OUTPUT_RECEIVERS = 3,    /* two omnidirectional receivers, a head's width apart */
  CLAMOR_OUTPUT_NONE = 4          /* two silent channels: for those who mix clamor_get_voices() */
};

enum {
  CLAMOR_MIXING_AUTO = 0,   /* a field from 4000 voices on and for dense late sound, otherwise voices
                             * with `reports_voices` */
  CLAMOR_MIXING_FIELD = 1,  /* all but the loudest and the moving are taps of responses that are
                             * convolved with their sounds: cheaper for many, and glides in steps */
  CLAMOR_MIXING_VOICES = 2  /* each of them glides */
};

enum {
  CLAMOR_LATE_STORED = 0, /* late sound as in the bake: few and strong reflections */
  CLAMOR_LATE_DENSE = 1   /* spread to a room's density, by a field; not with CLAMOR_MIXING_VOICES */
};

typedef struct clamor_listener_options {
  uint32_t bytes;
  uint32_t output;    /* CLAMOR_OUTPUT_... [binaural] */
  const char* layout; /* as `clamor render --layout` takes it ["stereo"]: "5.1", "7.1.4" */
  const char* sofa;   /* path of a SOFA file; null: the head that the library brings */
  uint32_t rate_hz;   /* 8000 to 192000 [48000] */
  uint32_t max_block_frames; /* the largest block that is expected [1024]; larger ones are allowed */
  uint32_t voices;           /* sources mixed at a time, 1 to 100 000 [2000] */
  /* For pages and sounds, which may use half of it [64 000 000 for pages, and in addition what the
   * level's sounds take decoded, but no more than 256 000 000] */
  uint64_t memory_bytes;
  double gain;               /* of the output, an amplitude [1] */
  uint32_t limits;           /* 1: true peaks stay below -1 dBFS */
  /* 1: an offline render. Keyframes wait for what they need and are for the times that
   * clamor_next_keyframe() tells, so that the samples do not depend on the machine's speed. */
  uint32_t offline;
  clamor_pose pose; /* at first; an orientation of zeros is the identity */
  uint32_t reports_voices; /* 1: clamor_get_voices() may be called */
  /* CLAMOR_MIXING_... [auto]; of 64 bits, so as to lie beyond what earlier versions knew */
  uint64_t mixing;
  uint64_t late; /* CLAMOR_LATE_... [stored] */
} clamor_listener_options;

/* Adds a listener in a level. Errors: ARGUMENT, HANDLE, FILE, FULL (64 listeners), MEMORY, STATE for
 * an offline listener without caller_updates. Any thread; 10 to 200 ms, and two seconds for the
 * first with a head of your own. */
CLAMOR_API clamor_result clamor_create_listener(clamor_context* context, clamor_level level,
                                                const clamor_listener_options* options,
                                                clamor_listener* listener, clamor_error* error);

/* Waits until the audio thread has left the listener. Errors: HANDLE. Any thread but the one that
 * renders. */
CLAMOR_API clamor_result clamor_destroy_listener(clamor_context* context, clamor_listener listener);

/* Crossfades to another level within a tenth of a second, or once a crossfade under way has ended.
 * Sounds of emitters that loop are then as far as if it had always been heard, others begin.
 * Errors: HANDLE, FILE, MEMORY; the listener then stays where it is. Any thread; as long as
 * clamor_create_listener(), during which the old level plays on. */
CLAMOR_API clamor_result clamor_enter_level(clamor_context* context, clamor_listener listener,
                                            clamor_level level, clamor_error* error);

/* Moves a listener. Doppler follows the positions of successive keyframes, 20 ms apart.
 * Errors: HANDLE, ARGUMENT. Any thread; microseconds. */
CLAMOR_API clamor_result clamor_move_listener(clamor_context* context, clamor_listener listener,
                                              const clamor_pose* pose);

/* The time of the keyframe that the next clamor_update() makes for an offline listener, in seconds
 * since it was created, so that the pose for that time can be set. `wanted` is 0 if there are
 * keyframes enough for the next 20 ms. Errors: HANDLE, ARGUMENT. Any thread. */
CLAMOR_API clamor_result clamor_next_keyframe(clamor_context* context, clamor_listener listener,
                                              uint32_t* wanted, double* time_s);

/* The number of output channels. Errors: HANDLE, ARGUMENT. Any thread. */
CLAMOR_API clamor_result clamor_get_channels(clamor_context* context, clamor_listener listener,
                                             uint32_t* channels);

typedef struct clamor_listener_statistics {
  uint32_t bytes;
  uint32_t voices;            /* of the newest keyframe, those that fade included */
  uint64_t keyframes;         /* made */
  uint64_t held_blocks;       /* rendered without a keyframe that was due: updates came too late */
  double keyframe_ms;         /* CPU time of the last keyframe */
  uint64_t pages, page_bytes; /* in memory */
  uint64_t sound_bytes;       /* in memory */
  uint64_t failures;          /* pages and sounds that could not be read */
  uint32_t unseen_sources;    /* without reflections now, because they see no probe */
} clamor_listener_statistics;

/* Errors: HANDLE, ARGUMENT. Any thread. */
CLAMOR_API clamor_result clamor_get_listener_statistics(clamor_context* context,
                                                        clamor_listener listener,
                                                        clamor_listener_statistics* statistics);

/* ---- Sounds, sources and groups --------------------------------------------------------------- */

/* A sound that any number of sources play. It is mono and kept in memory as floats at 48 kHz, once
 * for each kind of listener (binaural, others). */
typedef uint64_t clamor_sound;

typedef struct clamor_sound_options {
  uint32_t bytes;
  uint32_t rate_hz; /* of samples and streams, 1000 to 768 000 [48000] */
  uint32_t loops;   /* 1: plays without end */
} clamor_sound_options;

/* Copies samples, of up to 1 000 000 times full scale. `options` may be null. Errors: ARGUMENT, FULL,
 * MEMORY. Any thread; 3 ms for each second of sound. */
CLAMOR_API clamor_result clamor_add_sound(clamor_context* context, const float* samples,
                                          uint64_t frames, const clamor_sound_options* options,
                                          clamor_sound* sound, clamor_error* error);

/* Reads a WAV, FLAC, Ogg or MP3 file of up to 30 minutes, whose channels are averaged. Errors: as
 * above, FILE. Any thread; blocks on the disk. */
CLAMOR_API clamor_result clamor_read_sound(clamor_context* context, const char* path,
                                           const clamor_sound_options* options,
                                           clamor_sound* sound, clamor_error* error);

/* Reads the sound number `index` of a level, below clamor_level_info's `sounds`; it loops if it does
 * in the level. Errors: HANDLE, as above. Any thread; blocks on the disk. */
CLAMOR_API clamor_result clamor_read_level_sound(clamor_context* context, clamor_level level,
                                                 uint32_t index, clamor_sound* sound,
                                                 clamor_error* error);

typedef struct clamor_stream {
  uint32_t bytes;
  uint32_t rate_hz; /* 8000 to 192 000 [48000] */
  void* user;
  /* Fills `frames` samples and returns how many it had; the rest are silence. Called while a source
   * plays the stream, some 90 ms ahead of the sound, by the thread that makes keyframes or the one
   * that creates a listener, one at a time. Null: the application calls clamor_write_stream(). */
  uint32_t (*pull)(void* user, float* samples, uint32_t frames);
  /* Called once, when `pull` is not called any more: some keyframes after the stream is removed, or
   * with the context. By any thread. May be null, and must be without `pull`. Not called after an
   * error. */
  void (*release)(void* user);
} clamor_stream;

/* Adds a sound whose samples arrive while it plays: speech, a synthesiser, another engine's mix.
 * Sources up to 550 m away hear it. Errors: ARGUMENT, FULL, MEMORY. Any thread. */
CLAMOR_API clamor_result clamor_add_stream(clamor_context* context, const clamor_stream* stream,
                                           clamor_sound* sound, clamor_error* error);

/* Appends samples to a stream without `pull` and writes to `taken`, which may be null, how many
 * fitted into its buffer of one second. What is missing when a source plays it is silence. Errors:
 * HANDLE, ARGUMENT, STATE, BUSY. Audio: one thread at a time for each stream. */
CLAMOR_API clamor_result clamor_write_stream(clamor_context* context, clamor_sound sound,
                                             const float* samples, uint32_t frames,
                                             uint32_t* taken);

/* Removes a sound and all sources that play it, with the next commit. Errors: HANDLE. Any thread. */
CLAMOR_API clamor_result clamor_remove_sound(clamor_context* context, clamor_sound sound);

/* A group of sources: a bus. */
typedef uint64_t clamor_group;

typedef struct clamor_group_options {
  uint32_t bytes;
  uint32_t is_muted;
  uint32_t is_paused; /* its sounds stand still; streams are not read */
  uint32_t has_gain;  /* 0: the gain is 1 */
  double gain;        /* an amplitude, 0 to 1 000 000 */
  double max_voices;  /* share of a listener's voices that it may have, above 0 to 1 [1] */
} clamor_group_options;

/* Errors: ARGUMENT, FULL (256 groups), MEMORY. Any thread. */
CLAMOR_API clamor_result clamor_add_group(clamor_context* context,
                                          const clamor_group_options* options, clamor_group* group);
/* Errors: HANDLE, ARGUMENT. Any thread. */
CLAMOR_API clamor_result clamor_change_group(clamor_context* context, clamor_group group,
                                             const clamor_group_options* options);
/* Its sources stay, in no group. Errors: HANDLE. Any thread. */
CLAMOR_API clamor_result clamor_remove_group(clamor_context* context, clamor_group group);

/* A source that the application moves. All listeners of the context hear it, with the reflections of
 * the probes near it if the bake of their level has probes (`clamor bake --probes`). */
typedef uint64_t clamor_source;

typedef struct clamor_motion {
  double position_m[3];
  double velocity_mps[3]; /* for Doppler; zeros: the one between the last two commits */
  double axis[3];         /* of the directivity; zeros: -Z */
} clamor_motion;

typedef struct clamor_source_options {
  uint32_t bytes;
  uint32_t ends_with_sound; /* 1: the handle ends 3 s after the sound, which is heard within 1 km */
  clamor_sound sound;
  clamor_group group;    /* 0: none */
  clamor_level level;    /* only listeners in this level hear it; 0: all */
  clamor_motion motion;  /* at first */
  double gain;           /* amplitude at 1 m at full scale [1]; 0 is 1: mute a source by its bands */
  double band_gains[8];  /* 63 Hz to 8 kHz; all 0: all 1 */
  double directivity[8]; /* exponents of ((1 + cos) / 2); 0: omnidirectional */
  double played_s;       /* how much of the sound has been played when it begins */
  uint32_t has_reverberation; /* 0: the reverberation is 1 */
  double reverberation;  /* amplitude of its reflections, 0 to 100; 0: direct sound only */
} clamor_source_options;

/* The sound begins with the next commit. Errors: HANDLE, ARGUMENT, FULL, MEMORY. Any thread;
 * microseconds. */
CLAMOR_API clamor_result clamor_add_source(clamor_context* context,
                                           const clamor_source_options* options,
                                           clamor_source* source);
/* Changes all but where the sound is, unless the sound is another, which begins anew. Errors: HANDLE,
 * ARGUMENT. Any thread; microseconds. */
CLAMOR_API clamor_result clamor_change_source(clamor_context* context, clamor_source source,
                                              const clamor_source_options* options);
/* Errors: HANDLE, ARGUMENT. Any thread; microseconds. */
CLAMOR_API clamor_result clamor_move_source(clamor_context* context, clamor_source source,
                                            const clamor_motion* motion);
/* The source fades out within a tenth of a second, and what it has sounded dies away as its room does,
 * for as long as its sound is there. Errors: HANDLE. Any thread; microseconds. */
CLAMOR_API clamor_result clamor_remove_source(clamor_context* context, clamor_source source);

typedef struct clamor_emitter_options {
  uint32_t bytes;
  uint32_t is_muted;
  uint32_t has_gain;  /* 0: the gain is 1 */
  clamor_group group; /* 0: none. Its gain and mute apply, its pause mutes, its share does not apply */
  double gain;        /* amplitude relative to the bake's, 0 to 1 */
} clamor_emitter_options;

/* Changes how loud an emitter of a level is, with all its reflections, for all listeners. In a bake
 * without photons, instances of an emitter share its number and change with it. What a bake holds can
 * be turned down, not up: if the gain times that of the group is above 1, it is 1. Listeners who are
 * in a level that is closed hear its emitters as they were at the last commit before. Errors: HANDLE,
 * ARGUMENT, MEMORY. Any thread; microseconds. */
CLAMOR_API clamor_result clamor_change_emitter(clamor_context* context, clamor_level level,
                                               uint32_t emitter,
                                               const clamor_emitter_options* options);

/* The openness of a portal that its movable parts open and close. */
#define CLAMOR_PORTAL_BY_PARTS (-1.0)

/* Sets how open a portal of a level is, for all listeners: the share of power, 0 to 1, that is left of
 * all reflections whose path in the bake passed it. Until it is set, a portal is opened and closed by
 * the movable parts of its doorway, which the bake names, as the application moves and disables them:
 * what gets past them and what they transmit is left. Without such parts it is open. Once it is set,
 * its parts do not change it; CLAMOR_PORTAL_BY_PARTS gives it back to them. Where a bake holds the
 * level with portals closed, too, its reflections fade to those of that state. What a closed door
 * hides from a listener is the business of occlusion: direct sound is not changed. Listeners who are
 * in a level that is closed hear its portals as they were at the last commit before. Errors: HANDLE,
 * ARGUMENT, MEMORY. Any thread; microseconds, and some more in the listeners' next keyframes. */
CLAMOR_API clamor_result clamor_set_portal(clamor_context* context, clamor_level level,
                                           uint32_t portal, double openness);

/* ---- Movable parts ---------------------------------------------------------------------------- */

/* A door, a lift, a lorry: triangles that the application moves as a rigid body. They hide what is
 * behind them, per band, let through what they transmit, and reflect emitters and sources as mirrors:
 * faces of 0.1 m2 and more have image sources of one reflection, with their edges' diffraction. */
typedef uint64_t clamor_part;

/* Handles of a level's parts, by their number below clamor_level_info's `parts` and by the name of
 * their node in glTF (the first that has it). They end when the level is closed. Errors: HANDLE,
 * ARGUMENT, NOT_FOUND, FULL (4096 parts), MEMORY. Any thread; microseconds. */
CLAMOR_API clamor_result clamor_get_level_part(clamor_context* context, clamor_level level,
                                               uint32_t number, clamor_part* part);
CLAMOR_API clamor_result clamor_find_part(clamor_context* context, clamor_level level,
                                          const char* name, clamor_part* part);

typedef struct clamor_part_info {
  uint32_t bytes;
  uint32_t triangles;
  clamor_level level;   /* 0: none */
  clamor_pose pose;     /* the last one that was given, at first that of the level */
  uint32_t is_disabled;
  const char* name;     /* of its node in glTF, UTF-8, valid until the level is closed; or "" */
} clamor_part_info;

/* Errors: HANDLE, ARGUMENT. Any thread. */
CLAMOR_API clamor_result clamor_get_part_info(clamor_context* context, clamor_part part,
                                              clamor_part_info* info);

typedef struct clamor_part_options {
  uint32_t bytes;
  uint32_t is_disabled;
  clamor_level level; /* only listeners in this level hear it; 0: all */
  clamor_pose pose;   /* at first; an orientation of zeros is the identity */
  double half_extents_m[3]; /* of a box, each 0.001 to 10 000; all 0: a mesh */
  const float* vertices_m;  /* of a mesh: x, y, z each, relative to the pivot; copied */
  const uint32_t* indices;  /* of vertices, three for each triangle; copied */
  uint32_t vertices, triangles; /* at most 1 048 576 triangles */
  double transmission[8];   /* share of the power that passes a surface, 63 Hz to 8 kHz, 0 to 1 */
  /* Share of the power that is not reflected, 0 to 1, at least the transmission. All 0: 0.1, or the
   * transmission where that is more. All 1: it reflects nothing. */
  double absorption[8];
  double scattering[8];     /* share of the rest that is not reflected as by a mirror, 0 to 1 */
} clamor_part_options;

/* Adds a box or a mesh. A box has two surfaces on each path through it. Errors: ARGUMENT, HANDLE,
 * FULL (4096 parts), MEMORY. Any thread; a second for a million triangles. */
CLAMOR_API clamor_result clamor_add_part(clamor_context* context,
                                         const clamor_part_options* options, clamor_part* part,
                                         clamor_error* error);
/* Turns and moves a part about its pivot, which is the origin of its node or of its vertices, or the
 * centre of the box. Errors: HANDLE, ARGUMENT. Any thread; microseconds. */
CLAMOR_API clamor_result clamor_move_part(clamor_context* context, clamor_part part,
                                          const clamor_pose* pose);
/* A part that is not enabled hides nothing. Errors: HANDLE, ARGUMENT. Any thread; microseconds. */
CLAMOR_API clamor_result clamor_enable_part(clamor_context* context, clamor_part part,
                                            uint32_t enabled);
/* Errors: HANDLE, STATE for a part of a level, which can be disabled. Any thread; microseconds. */
CLAMOR_API clamor_result clamor_remove_part(clamor_context* context, clamor_part part);

/* Publishes all changes of sounds, sources, emitters, portals, groups and parts together. Parts are
 * heard in the next keyframe. `time_s` is the time of an offline listener that the changes are for
 * (clamor_next_keyframe()); listeners in real time take them over now. Errors: ARGUMENT, MEMORY. Any
 * thread; 0.1 us for each source. */
CLAMOR_API clamor_result clamor_commit(clamor_context* context, double time_s);

/* ---- Results for other mixers ------------------------------------------------------------------ */

typedef struct clamor_voice {
  uint32_t slot;        /* the same in successive keyframes while the source is heard */
  uint32_t starts;      /* 1: another source has taken the slot */
  clamor_sound sound;   /* of the application's; 0: of the level's */
  uint32_t level_sound; /* of the level's: its index */
  float direction[3];   /* to the source, a unit vector: x right, y up, -z ahead of the listener */
  double delay_s;       /* when the sound's beginning arrives, on the time of clamor_voices */
  float band_gains[8];  /* amplitudes, 63 Hz to 8 kHz; negative where the sign is inverted */
} clamor_voice;

typedef struct clamor_voices {
  uint32_t bytes;
  uint32_t capacity;   /* of `voices`, in */
  clamor_voice* voices;
  uint32_t count;      /* of all voices of the keyframe, which may be more, out */
  double time_s;       /* of the keyframe, out: gains and delays are reached then */
} clamor_voices;

/* Reads the newest keyframe's voices. A new one is made every 20 ms while clamor_render() is called.
 * Errors: HANDLE, ARGUMENT, STATE without `reports_voices`. Any thread; waits for a keyframe under
 * way. */
CLAMOR_API clamor_result clamor_get_voices(clamor_context* context, clamor_listener listener,
                                           clamor_voices* voices);

/* Measures the response of a level to an impulse of one emitter (its index; 0xffffffff: of all) with
 * an omnidirectional receiver at each of `places` positions: `frames` samples at 48 kHz for each,
 * from the emission on. An emitter of gain 1 at 1 m gives one sample of 1. All sources of the level
 * take part, those of instances included; surfaces occlude, and so do movable parts where the level has
 * them at rest; clamor_change_emitter() and clamor_move_part() have no effect.
 * Writes to `whole_frames`, which may be null, how long the longest response is: a minute at most,
 * from the emission or, where the sound travels for more than ten seconds, from its arrival.
 * Errors: HANDLE, ARGUMENT, FILE, MEMORY. Any thread; takes a second for 100 000 sources and place,
 * on all cores. */
CLAMOR_API clamor_result clamor_measure_responses(clamor_context* context, clamor_level level,
                                                  uint32_t emitter, const double* positions_m,
                                                  uint32_t places, float* samples, uint64_t frames,
                                                  uint64_t* whole_frames, clamor_error* error);

/* ---- Rendering ------------------------------------------------------------------------------ */

/* Overwrites `frames` frames of all channels, interleaved; after an error they are as they were.
 * Errors: HANDLE, ARGUMENT, BUSY. Audio; about a nanosecond for each voice and frame. */
CLAMOR_API clamor_result clamor_render(clamor_context* context, clamor_listener listener,
                                       float* interleaved, uint32_t frames);

/* As clamor_render(), into one array for each channel. */
CLAMOR_API clamor_result clamor_render_planar(clamor_context* context, clamor_listener listener,
                                              float* const* planes, uint32_t frames);

#ifdef __cplusplus
}
#endif

#endif
