/* reopened_library.c: a hundred times, a new thread loads libclamor, plays a block of a level and
 * ends, and the main thread unloads the library. Neither threads nor memory may accumulate.
 *
 * The library's code stays in memory, because threads of oneTBB outlive its callers.
 *
 *   reopened_library LIBRARY LEVEL
 */
#include <dirent.h>
#include <dlfcn.h>
#include <malloc.h>
#include <pthread.h>
#include <stdio.h>
#include <unistd.h>

#include "runtime/clamor.h"

enum { kTimes = 100, kWarmUp = 20, kFrames = 256 };

#define FIND(function) function = (__typeof__(function))dlsym(library, "clamor_" #function)
#define CHECK(promise)                                      \
  do {                                                      \
    if (!(promise)) {                                       \
      fprintf(stderr, "line %d: %s\n", __LINE__, #promise); \
      return 1;                                             \
    }                                                       \
  } while (0)

static int threads(void) {
  int count = 0;
  DIR* const tasks = opendir("/proc/self/task");
  while (readdir(tasks) != NULL) ++count;
  closedir(tasks);
  return count - 2;
}

static long resident_kilobytes(void) {
  long total = 0, resident = 0;
  FILE* const memory = fopen("/proc/self/statm", "r");
  if (fscanf(memory, "%ld %ld", &total, &resident) != 2) resident = 0;
  fclose(memory);
  return resident * (sysconf(_SC_PAGESIZE) / 1024);
}

struct round {
  const char *library_path, *level_path;
  int caller_updates;
  void* library;
};

static int play(struct round* round) {
  clamor_result (*create)(const clamor_options*, clamor_context**, clamor_error*);
  void (*destroy)(clamor_context*);
  clamor_result (*update)(clamor_context*, double, uint32_t*);
  clamor_result (*open_level)(clamor_context*, const char*, clamor_level*, clamor_error*);
  clamor_result (*create_listener)(clamor_context*, clamor_level, const clamor_listener_options*,
                                   clamor_listener*, clamor_error*);
  clamor_result (*render)(clamor_context*, clamor_listener, float*, uint32_t);
  clamor_options options = {.bytes = sizeof options};
  clamor_listener_options listener_options = {.bytes = sizeof listener_options};
  clamor_context* clamor = NULL;
  clamor_level level = 0;
  clamor_listener ears = 0;
  float block[2 * kFrames];
  void* const library = round->library = dlopen(round->library_path, RTLD_NOW | RTLD_LOCAL);
  if (library == NULL) fprintf(stderr, "%s\n", dlerror());
  CHECK(library != NULL);
  FIND(create);
  FIND(destroy);
  FIND(update);
  FIND(open_level);
  FIND(create_listener);
  FIND(render);
  options.caller_updates = (uint32_t)round->caller_updates;
  listener_options.output = CLAMOR_OUTPUT_RECEIVERS;
  listener_options.voices = 50;
  CHECK(create(&options, &clamor, NULL) == CLAMOR_OK);
  CHECK(open_level(clamor, round->level_path, &level, NULL) == CLAMOR_OK);
  CHECK(create_listener(clamor, level, &listener_options, &ears, NULL) == CLAMOR_OK);
  if (round->caller_updates) CHECK(update(clamor, 0.01, NULL) == CLAMOR_OK);
  CHECK(render(clamor, ears, block, kFrames) == CLAMOR_OK);
  destroy(clamor);
  return 0;
}

static void* play_on_thread(void* round) { return play(round) == 0 ? NULL : round; }

int main(int count, char** words) {
  long before = 0, after;
  int i;
  CHECK(count == 3);
  /* With several arenas, resident memory depends on which threads ran at the same time. */
  CHECK(mallopt(M_ARENA_MAX, 1) == 1);
  for (i = 1; i <= kTimes; ++i) {
    struct round round = {words[1], words[2], i % 2, NULL};
    pthread_t thread;
    void* failed = NULL;
    CHECK(pthread_create(&thread, NULL, play_on_thread, &round) == 0);
    CHECK(pthread_join(thread, &failed) == 0 && failed == NULL);
    CHECK(dlclose(round.library) == 0);
    malloc_trim(0);
    if (i == kWarmUp) before = resident_kilobytes();
  }
  after = resident_kilobytes();
  printf("resident: %ld kB after %d times, %ld kB after %d; threads: %d\n", before, kWarmUp, after,
         kTimes, threads());
  /* This one, and those of oneTBB, which come with the first BVH that is built in parallel. */
  CHECK(threads() <= sysconf(_SC_NPROCESSORS_ONLN));
  /* A level and a listener are 3000 kB. What grows is a few kB of Embree's for each thread that
   * built a BVH, and of the C library's for threads. */
  CHECK(after - before < 3000);
  return 0;
}
