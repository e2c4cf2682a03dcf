/* sdl_game.c: a game loop with SDL 2: walk around a circling bell and a pacing voice, and open a
 * door.
 *
 *   sdl_game LEVEL.clamor X Y Z [--walk X Y Z] [--seconds S] [--press KEYS] [--loudspeakers]
 *            [--record OUT.wav]
 *
 * The walker begins at X Y Z, in metres. W A S D and the up and down arrows walk, the other arrows
 * turn, 1 mutes the bell and 2 the voice, 3 opens and closes the level's door, if it has one.
 * --walk walks straight to another place instead, within --seconds [4], after which the game ends.
 * --press presses keys at first. --record renders in the game loop instead of SDL's audio thread,
 * so that the samples do not depend on the machine's speed.
 *
 * The voice is heard with its reflections where the bake has probes (clamor bake --probes auto).
 * The bell is drier.
 */
#define SDL_MAIN_HANDLED
#include <SDL.h>
#include <clamor.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define RATE_HZ 48000
#define PIXELS_PER_M 50
enum { CHANNELS = 2, BLOCK_FRAMES = 512, PICTURE_FRAMES = RATE_HZ / 60, WIDTH = 800, HEIGHT = 600 };
enum { BELL, VOICE, SOURCES };

static const double PI = 3.14159265358979323846;
static clamor_context* context;
static clamor_listener ears;
static clamor_pose pose;
static double yaw, start_m[3], end_m[3], seconds; /* 0 seconds: until the window is closed */
static int walks, is_muted[SOURCES];
static uint32_t output = CLAMOR_OUTPUT_BINAURAL;
static clamor_group groups[SOURCES];
static clamor_source sources[SOURCES];
static clamor_motion motions[SOURCES];
static clamor_level level;
static clamor_part door; /* 0: the level has none */
static clamor_part_info closed_door;
static uint32_t portal;
static int has_portal, is_opened;
static double openness;           /* of the door, 0 to 1 */
static SDL_atomic_t heard_frames; /* since the first that was not silent */

static void check(clamor_result result, const clamor_error* error) {
  if (result == CLAMOR_OK) return;
  fprintf(stderr, "sdl_game: %s\n", error != NULL ? error->sentence : clamor_result_text(result));
  exit(EXIT_FAILURE);
}

/* A bell that strikes once a second. */
static clamor_sound add_bell(void) {
  static const double partials_hz[5] = {440, 880, 1056, 1320, 1760};
  static float samples[RATE_HZ];
  static clamor_sound_options options;
  clamor_sound bell;
  clamor_error error;
  for (int i = 0; i < RATE_HZ * 5; ++i)
    samples[i / 5] += (float)(0.15 * exp(-1.0 * i / RATE_HZ) *
                              sin(2 * PI * partials_hz[i % 5] * (i / 5) / RATE_HZ));
  options.bytes = sizeof options, options.loops = 1;
  check(clamor_add_sound(context, samples, RATE_HZ, &options, &bell, &error), &error);
  return bell;
}

/* The voice: 120 pulses a second through two resonances, of "ah" and "ee" in turn. The library
 * calls it when it needs samples, on the thread that makes keyframes. */
static uint32_t speak(void* spoken_frames, float* samples, uint32_t frames) {
  static const double formants_hz[2][2] = {{700, 1100}, {300, 2300}};
  static double before[2], before_that[2];
  const double radius = exp(-PI * 80 / RATE_HZ); /* for a bandwidth of 80 Hz */
  uint32_t* const spoken = (uint32_t*)spoken_frames;
  for (uint32_t i = 0; i < frames; ++i, ++*spoken) {
    double x = *spoken % (RATE_HZ / 120) == 0 ? 6e-4 : 0;
    for (int k = 0; k < 2; ++k) {
      const double turn = 2 * PI * formants_hz[*spoken / (RATE_HZ / 2) % 2][k] / RATE_HZ;
      x += 2 * radius * cos(turn) * before[k] - radius * radius * before_that[k];
      before_that[k] = before[k], before[k] = x;
    }
    samples[i] = (float)x;
  }
  return frames;
}

static clamor_sound add_voice(void) {
  static uint32_t spoken_frames;
  static clamor_stream stream;
  clamor_sound voice;
  clamor_error error;
  stream.bytes = sizeof stream, stream.rate_hz = RATE_HZ;
  stream.pull = speak, stream.user = &spoken_frames;
  check(clamor_add_stream(context, &stream, &voice, &error), &error);
  return voice;
}

/* The bell circles at 2 m within 4 s, first to the right; the voice paces 3 m ahead of the start.
 */
static void place_sources(double time_s) {
  motions[BELL].position_m[0] = start_m[0] + 2 * sin(PI / 2 * time_s);
  motions[BELL].position_m[2] = start_m[2] - 2 * cos(PI / 2 * time_s);
  motions[VOICE].position_m[0] = start_m[0] + 1.5 * sin(PI / 3 * time_s);
  motions[VOICE].position_m[2] = start_m[2] - 3;
  motions[BELL].position_m[1] = motions[VOICE].position_m[1] = start_m[1];
}

/* The door is the level's first movable part, which is closed where the level has it. Its portal,
 * if there is one, has the same name. */
static void find_door(void) {
  closed_door.bytes = sizeof closed_door;
  if (clamor_get_level_part(context, level, 0, &door) != CLAMOR_OK) return;
  check(clamor_get_part_info(context, door, &closed_door), NULL);
  has_portal = clamor_find_portal(context, level, closed_door.name, &portal) == CLAMOR_OK;
}

/* Turns the door about its hinge, which is upright, by up to 90 degrees within a second. The turn
 * is the quaternion (0, s, 0, c). */
static void swing_door(double elapsed_s) {
  const double* const q = closed_door.pose.orientation;
  clamor_pose turned = closed_door.pose;
  if (door == 0) return;
  openness = fmin(fmax(openness + (is_opened ? elapsed_s : -elapsed_s), 0), 1);
  const double s = sin(PI / 4 * openness), c = cos(PI / 4 * openness);
  turned.orientation[0] = c * q[0] + s * q[2], turned.orientation[1] = c * q[1] + s * q[3];
  turned.orientation[2] = c * q[2] - s * q[0], turned.orientation[3] = c * q[3] - s * q[1];
  check(clamor_move_part(context, door, &turned), NULL);
  if (has_portal) check(clamor_set_portal(context, level, portal, openness), NULL);
}

static void open_world(const char* path, uint32_t offline) {
  static clamor_options updates;
  static clamor_listener_options listening;
  static clamor_group_options group;
  static clamor_source_options source;
  clamor_error error;
  updates.bytes = sizeof updates, updates.caller_updates = offline;
  check(clamor_create(&updates, &context, &error), &error);
  check(clamor_open_level(context, path, &level, &error), &error);
  listening.bytes = sizeof listening, listening.offline = offline, listening.pose = pose;
  listening.rate_hz = RATE_HZ, listening.limits = 1, listening.output = output;
  check(clamor_create_listener(context, level, &listening, &ears, &error), &error);
  find_door();
  place_sources(0);
  for (int i = 0; i < SOURCES; ++i) {
    group.bytes = sizeof group, group.is_muted = (uint32_t)is_muted[i];
    check(clamor_add_group(context, &group, &groups[i]), NULL);
    source.bytes = sizeof source, source.group = groups[i], source.motion = motions[i];
    source.sound = i == BELL ? add_bell() : add_voice();
    source.has_reverberation = 1, source.reverberation = i == BELL ? 0.3 : 1;
    check(clamor_add_source(context, &source, &sources[i]), NULL);
  }
}

/* The keys 1 and 2 mute a group, or let it sound again; 3 opens or closes the door. */
static void press(int key) {
  static clamor_group_options group;
  const int i = key - '1';
  if (key == '3') is_opened = !is_opened;
  if (i < 0 || i >= SOURCES) return;
  group.bytes = sizeof group, group.is_muted = (uint32_t)(is_muted[i] = !is_muted[i]);
  if (context != NULL) check(clamor_change_group(context, groups[i], &group), NULL);
}

static void walk_by_keys(double elapsed_s) {
  const Uint8* held = SDL_GetKeyboardState(NULL);
  const int ahead = (held[SDL_SCANCODE_W] | held[SDL_SCANCODE_UP]) -
                    (held[SDL_SCANCODE_S] | held[SDL_SCANCODE_DOWN]);
  const int right = held[SDL_SCANCODE_D] - held[SDL_SCANCODE_A];
  const double step_m = 1.4 * elapsed_s;
  yaw += 1.8 * elapsed_s * (held[SDL_SCANCODE_LEFT] - held[SDL_SCANCODE_RIGHT]);
  pose.position_m[0] += step_m * (right * cos(yaw) - ahead * sin(yaw));
  pose.position_m[2] -= step_m * (right * sin(yaw) + ahead * cos(yaw));
  pose.orientation[1] = sin(yaw / 2), pose.orientation[3] = cos(yaw / 2);
}

/* Tells the library where all are at a time. */
static void move_all(double time_s) {
  static double moved_s;
  const double share = time_s < seconds ? time_s / seconds : 1;
  for (int i = 0; i < 3 && walks; ++i)
    pose.position_m[i] = start_m[i] + share * (end_m[i] - start_m[i]);
  check(clamor_move_listener(context, ears, &pose), NULL);
  swing_door(time_s - moved_s);
  moved_s = time_s;
  place_sources(time_s);
  for (int i = 0; i < SOURCES; ++i)
    check(clamor_move_source(context, sources[i], &motions[i]), NULL);
  check(clamor_commit(context, time_s), NULL);
}

/* Called by SDL's audio thread. */
static void SDLCALL play(void* user, Uint8* bytes, int byte_count) {
  float* const samples = (float*)(void*)bytes;
  const int count = byte_count / (int)sizeof(float);
  int is_heard = SDL_AtomicGet(&heard_frames) > 0;
  (void)user;
  if (clamor_render(context, ears, samples, (uint32_t)(count / CHANNELS)) != CLAMOR_OK)
    SDL_memset(bytes, 0, (size_t)byte_count);
  for (int i = 0; i < count && !is_heard; ++i) is_heard = samples[i] != 0;
  if (is_heard) SDL_AtomicAdd(&heard_frames, count / CHANNELS);
}

static SDL_RWops* open_wav(const char* path, uint32_t frames) {
  const uint32_t frame_bytes = CHANNELS * sizeof(float), bytes = frames * frame_bytes;
  const uint32_t header[11] = {0x46464952,
                               36 + bytes,
                               0x45564157,
                               0x20746d66, /* RIFF WAVEfmt */
                               16,
                               3 | CHANNELS << 16,
                               RATE_HZ,
                               RATE_HZ * frame_bytes,
                               frame_bytes | 32 << 16,
                               0x61746164,
                               bytes};
  SDL_RWops* const wav = SDL_RWFromFile(path, "wb");
  for (int i = 0; i < 11 && wav != NULL; ++i) SDL_WriteLE32(wav, header[i]);
  return wav;
}

/* Renders what is heard during one picture. Each keyframe has the positions of its own time. */
static void record(SDL_RWops* wav, uint32_t frames) {
  static float block[PICTURE_FRAMES * CHANNELS];
  uint32_t wanted;
  double time_s;
  while (clamor_next_keyframe(context, ears, &wanted, &time_s) == CLAMOR_OK && wanted) {
    move_all(time_s);
    check(clamor_update(context, 0, NULL), NULL);
  }
  check(clamor_render(context, ears, block, frames), NULL);
  SDL_RWwrite(wav, block, CHANNELS * sizeof(float), frames);
}

static void draw_square(SDL_Renderer* view, const double* position_m, int is_filled) {
  const SDL_Rect square = {
      WIDTH / 2 - 6 + (int)(PIXELS_PER_M * (position_m[0] - pose.position_m[0])),
      HEIGHT / 2 - 6 + (int)(PIXELS_PER_M * (position_m[2] - pose.position_m[2])), 12, 12};
  (is_filled ? SDL_RenderFillRect : SDL_RenderDrawRect)(view, &square);
}

/* A view from above, with the listener in the middle and a line each metre. */
static void draw(SDL_Renderer* view) {
  const int x = (int)(PIXELS_PER_M * fmod(pose.position_m[0], 1));
  const int z = (int)(PIXELS_PER_M * fmod(pose.position_m[2], 1));
  SDL_SetRenderDrawColor(view, 20, 22, 28, 255), SDL_RenderClear(view);
  SDL_SetRenderDrawColor(view, 45, 48, 58, 255);
  for (int line = -PIXELS_PER_M; line <= WIDTH + PIXELS_PER_M; line += PIXELS_PER_M) {
    SDL_RenderDrawLine(view, line - x, 0, line - x, HEIGHT);
    SDL_RenderDrawLine(view, 0, line - z, WIDTH, line - z);
  }
  SDL_SetRenderDrawColor(view, 240, 180, 60, 255);
  draw_square(view, motions[BELL].position_m, !is_muted[BELL]);
  SDL_SetRenderDrawColor(view, 90, 200, 140, 255);
  draw_square(view, motions[VOICE].position_m, !is_muted[VOICE]);
  SDL_SetRenderDrawColor(view, 230, 230, 240, 255);
  draw_square(view, pose.position_m, 1);
  SDL_RenderDrawLine(view, WIDTH / 2, HEIGHT / 2, WIDTH / 2 - (int)(30 * sin(yaw)),
                     HEIGHT / 2 - (int)(30 * cos(yaw)));
  SDL_RenderPresent(view);
}

static int usage(void) {
  fputs(
      "sdl_game LEVEL.clamor X Y Z [--walk X Y Z] [--seconds S] [--press KEYS] [--loudspeakers] "
      "[--record OUT.wav]\n",
      stderr);
  return 2;
}

static int failed(void) {
  fprintf(stderr, "sdl_game: %s\n", SDL_GetError());
  return EXIT_FAILURE;
}

int main(int count, char** words) {
  const char* recording = NULL;
  SDL_RWops* wav = NULL;
  static SDL_AudioSpec wanted;
  if (count < 5) return usage();
  for (int i = 0; i < 3; ++i) start_m[i] = pose.position_m[i] = atof(words[2 + i]);
  for (int i = 5; i < count; ++i) {
    const int left = count - 1 - i;
    if (strcmp(words[i], "--walk") == 0 && left >= 3) {
      walks = 1;
      for (int k = 0; k < 3; ++k) end_m[k] = atof(words[++i]);
    } else if (strcmp(words[i], "--seconds") == 0 && left >= 1) {
      seconds = atof(words[++i]);
    } else if (strcmp(words[i], "--press") == 0 && left >= 1) {
      for (const char* key = words[++i]; *key != 0; ++key) press(*key);
    } else if (strcmp(words[i], "--loudspeakers") == 0) {
      output = CLAMOR_OUTPUT_LOUDSPEAKERS;
    } else if (strcmp(words[i], "--record") == 0 && left >= 1) {
      recording = words[++i];
    } else {
      return usage();
    }
  }
  if ((walks || recording != NULL) && seconds == 0) seconds = 4;
  const int end = (int)(seconds * RATE_HZ + 0.5);
  pose.orientation[3] = 1;

  /* For devices of another rate: SDL 2 resamples by itself with clicks, by libsamplerate without. */
  SDL_SetHint(SDL_HINT_AUDIO_RESAMPLING_MODE, "best");
  SDL_SetMainReady();
  if (SDL_Init(SDL_INIT_VIDEO | (recording != NULL ? 0 : SDL_INIT_AUDIO)) != 0) return failed();
  SDL_Window* const window =
      SDL_CreateWindow("Clamor", SDL_WINDOWPOS_CENTERED, SDL_WINDOWPOS_CENTERED, WIDTH, HEIGHT, 0);
  SDL_Renderer* const view = window != NULL ? SDL_CreateRenderer(window, -1, 0) : NULL;
  if (view == NULL) return failed();
  open_world(words[1], recording != NULL);
  SDL_AudioDeviceID device = 0;
  if (recording != NULL) {
    if ((wav = open_wav(recording, (uint32_t)end)) == NULL) return failed();
  } else {
    wanted.freq = RATE_HZ, wanted.format = AUDIO_F32SYS, wanted.channels = CHANNELS;
    wanted.samples = BLOCK_FRAMES, wanted.callback = play;
    if ((device = SDL_OpenAudioDevice(NULL, 0, &wanted, NULL, 0)) == 0) return failed();
    move_all(0);
    SDL_PauseAudioDevice(device, 0);
  }

  const Uint32 began_ms = SDL_GetTicks();
  double time_s = 0;
  for (int is_running = 1, done = 0; is_running && (end == 0 || done < end);) {
    for (SDL_Event event; SDL_PollEvent(&event);) {
      if (event.type == SDL_QUIT) is_running = 0;
      if (event.type == SDL_KEYDOWN && event.key.repeat == 0) press(event.key.keysym.sym);
    }
    if (wav != NULL) {
      const int frames = end - done < PICTURE_FRAMES ? end - done : PICTURE_FRAMES;
      record(wav, (uint32_t)frames);
      done += frames;
    } else {
      const double now_s = 1e-3 * (SDL_GetTicks() - began_ms);
      if (!walks) walk_by_keys(now_s - time_s);
      move_all(time_s = now_s);
      done = SDL_AtomicGet(&heard_frames);
      if (end > 0 && now_s > seconds + 60) is_running = 0; /* nothing is heard */
      SDL_Delay(10);
    }
    draw(view);
  }
  if (device != 0) SDL_CloseAudioDevice(device);
  clamor_destroy(context);
  const int is_written = wav == NULL || SDL_RWclose(wav) == 0;
  SDL_Quit();
  return is_written ? EXIT_SUCCESS : failed();
}
