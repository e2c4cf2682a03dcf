/* client.c: a program of the first release, compiled against that release's header, which lies
 * beside it and does not change. It has to compile, link and run with every later library of the
 * same ABI version.
 *
 *   first_release_client LEVEL     exits with the number of the first promise that is broken, or 0
 */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "clamor.h"

#define FRAMES 480

#define CHECK(promise)                                      \
  do {                                                      \
    if (!(promise)) {                                       \
      fprintf(stderr, "line %d: %s\n", __LINE__, #promise); \
      return __LINE__;                                      \
    }                                                       \
  } while (0)

/* Structures of a later release than the library's. */
struct later_options {
  clamor_options known;
  uint64_t more[2];
};
struct later_listener_options {
  clamor_listener_options known;
  double more[3];
};
struct later_statistics {
  clamor_listener_statistics known;
  uint64_t more[5];
};

static double energy_of(const float* block) {
  double energy = 0;
  int i;
  for (i = 0; i < 2 * FRAMES; ++i) energy += (double)block[i] * block[i];
  return energy;
}

static int play(clamor_context* clamor, const char* path) {
  static float block[2 * FRAMES], left[FRAMES], right[FRAMES];
  float* planes[2];
  clamor_level level = 0, other = 0;
  clamor_listener ears = 0;
  clamor_listener_options options = {.bytes = sizeof options};
  clamor_level_info info = {.bytes = sizeof info};
  clamor_listener_statistics statistics = {.bytes = sizeof statistics};
  clamor_pose pose = {{3, 4, 1.5}, {0, 0, 0, 1}};
  clamor_error error;
  uint32_t channels = 0, made = 0, wanted = 0;
  double energy = 0, time_s = 0;
  int i;
  planes[0] = left;
  planes[1] = right;
  options.output = CLAMOR_OUTPUT_RECEIVERS;
  options.voices = 100;
  options.pose.position_m[0] = 2;
  CHECK(clamor_open_level(clamor, path, &level, &error) == CLAMOR_OK);
  CHECK(error.code == CLAMOR_OK && error.sentence[0] == 0);
  CHECK(clamor_open_level(clamor, "/no/such/level", &other, &error) == CLAMOR_ERROR_FILE);
  CHECK(error.code == CLAMOR_ERROR_FILE && strstr(error.sentence, "/no/such/level") != NULL);
  CHECK(clamor_open_level(clamor, path, &other, NULL) == CLAMOR_OK);
  CHECK(clamor_get_level_info(clamor, level, &info) == CLAMOR_OK && info.emitters == 3);
  CHECK(clamor_create_listener(clamor, level, &options, &ears, &error) == CLAMOR_OK);
  CHECK(clamor_get_channels(clamor, ears, &channels) == CLAMOR_OK && channels == 2);
  CHECK(clamor_enter_level(clamor, ears, other, NULL) == CLAMOR_OK);
  CHECK(clamor_close_level(clamor, level) == CLAMOR_OK);
  CHECK(clamor_close_level(clamor, level) == CLAMOR_ERROR_HANDLE);
  for (i = 0; i < 100; ++i) {
    CHECK(clamor_move_listener(clamor, ears, &pose) == CLAMOR_OK);
    CHECK(clamor_next_keyframe(clamor, ears, &wanted, &time_s) == CLAMOR_OK);
    CHECK(clamor_update(clamor, 0.01, &made) == CLAMOR_OK);
    CHECK(clamor_render(clamor, ears, block, FRAMES) == CLAMOR_OK);
    CHECK(clamor_render_planar(clamor, ears, planes, FRAMES) == CLAMOR_OK);
    energy += energy_of(block);
  }
  CHECK(energy > 0 && isfinite(energy));
  CHECK(clamor_get_listener_statistics(clamor, ears, &statistics) == CLAMOR_OK);
  CHECK(statistics.keyframes > 0 && statistics.failures == 0);
  CHECK(clamor_destroy_listener(clamor, ears) == CLAMOR_OK);
  return 0;
}

static int play_with_later_structures(const char* path) {
  clamor_context* clamor = NULL;
  clamor_level level = 0;
  clamor_listener ears = 0;
  struct later_options options;
  struct later_listener_options listener;
  struct later_statistics statistics;
  memset(&options, 0, sizeof options);
  memset(&listener, 0, sizeof listener);
  memset(&statistics, 0xff, sizeof statistics);
  options.known.bytes = sizeof options;
  options.more[1] = 1; /* an option that the library does not know */
  CHECK(clamor_create(&options.known, &clamor, NULL) == CLAMOR_ERROR_ARGUMENT && clamor == NULL);
  options.more[1] = 0;
  CHECK(clamor_create(&options.known, &clamor, NULL) == CLAMOR_OK);
  CHECK(clamor_open_level(clamor, path, &level, NULL) == CLAMOR_OK);
  listener.known.bytes = sizeof listener;
  listener.known.output = CLAMOR_OUTPUT_RECEIVERS;
  listener.more[0] = 0.5;
  CHECK(clamor_create_listener(clamor, level, &listener.known, &ears, NULL) ==
        CLAMOR_ERROR_ARGUMENT);
  listener.more[0] = 0;
  CHECK(clamor_create_listener(clamor, level, &listener.known, &ears, NULL) == CLAMOR_OK);
  statistics.known.bytes = sizeof statistics;
  CHECK(clamor_get_listener_statistics(clamor, ears, &statistics.known) == CLAMOR_OK);
  CHECK(statistics.known.bytes == sizeof statistics && statistics.more[4] == 0);
  clamor_destroy(clamor);
  return 0;
}

int main(int count, char** words) {
  clamor_context* clamor = NULL;
  clamor_options options = {.bytes = sizeof options};
  int result;
  CHECK(count == 2);
  CHECK(clamor_abi_version() == CLAMOR_ABI_VERSION);
  CHECK(clamor_version() >= (CLAMOR_VERSION_MAJOR << 16 | CLAMOR_VERSION_MINOR << 8));
  CHECK(strcmp(clamor_result_text(CLAMOR_OK), "no error") == 0);
  options.caller_updates = 1;
  CHECK(clamor_create(&options, &clamor, NULL) == CLAMOR_OK);
  result = play(clamor, words[1]);
  clamor_destroy(clamor);
  return result != 0 ? result : play_with_later_structures(words[1]);
}
