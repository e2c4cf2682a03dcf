/* start_up.c: prints what libclamor costs before it plays: time, memory and threads of each step.
 *
 *   start_up LIBRARY BAKE
 *
 * It loads the library as an engine loads a plugin. Heap is what malloc() holds, resident is what
 * the process occupies in memory, pages of shared libraries included.
 */
#define _GNU_SOURCE
#include <clamor.h>
#include <dirent.h>
#include <dlfcn.h>
#include <malloc.h>
#include <stdio.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

static double now_ms(clockid_t clock) {
  struct timespec now;
  clock_gettime(clock, &now);
  return 1e3 * (double)now.tv_sec + 1e-6 * (double)now.tv_nsec;
}

static double resident_mb(void) {
  long pages = 0, resident = 0;
  FILE* file = fopen("/proc/self/statm", "r");
  if (file != NULL && fscanf(file, "%ld %ld", &pages, &resident) != 2) resident = 0;
  if (file != NULL) fclose(file);
  return 1e-6 * (double)resident * (double)sysconf(_SC_PAGESIZE);
}

static int threads(void) {
  int count = 0;
  const struct dirent* entry;
  DIR* folder = opendir("/proc/self/task");
  while (folder != NULL && (entry = readdir(folder)) != NULL) count += entry->d_name[0] != '.';
  if (folder != NULL) closedir(folder);
  return count;
}

struct times {
  double elapsed_ms, cpu_ms; /* of all threads */
};

static struct times now(void) {
  const struct times now = {now_ms(CLOCK_MONOTONIC), now_ms(CLOCK_PROCESS_CPUTIME_ID)};
  return now;
}

/* Prints the time since `began` and what is held now, and returns the time at its end. */
static struct times report(const char* step, struct times began) {
  const struct times ended = now();
  const struct mallinfo2 heap = mallinfo2();
  printf("%-26s %8.1f %8.1f %8.2f %12.1f %8d\n", step, ended.elapsed_ms - began.elapsed_ms,
         ended.cpu_ms - began.cpu_ms, 1e-6 * (double)(heap.uordblks + heap.hblkhd), resident_mb(),
         threads());
  return now();
}

/* Declares a pointer to a function of the library. */
#define FUNCTION(name)               \
  __typeof__(&name) name##_function; \
  *(void**)&name##_function = dlsym(library, #name)

int main(int count, char** words) {
  struct stat file;
  void* library;
  clamor_context* context = NULL;
  clamor_level level;
  clamor_listener_options options = {0};
  clamor_listener listeners[2];
  clamor_error error = {0};
  float block[2 * 256];
  struct times began;
  if (count != 3 || stat(words[1], &file) != 0) {
    fprintf(stderr, "usage: start_up LIBRARY BAKE\n");
    return 2;
  }
  printf("%-26s %8.2f MB\n", "size of the library", 1e-6 * (double)file.st_size);
  printf("%-26s %8s %8s %8s %12s %8s\n", "", "time/ms", "CPU/ms", "heap/MB", "resident/MB",
         "threads");
  began = report("before", now());
  library = dlopen(words[1], RTLD_NOW | RTLD_LOCAL);
  if (library == NULL) {
    fprintf(stderr, "start_up: %s\n", dlerror());
    return 1;
  }
  began = report("dlopen", began);
  FUNCTION(clamor_create);
  FUNCTION(clamor_open_level);
  FUNCTION(clamor_create_listener);
  FUNCTION(clamor_render);
  FUNCTION(clamor_destroy);
  options.bytes = sizeof options;
  options.pose.position_m[1] = 1.7;
  clamor_result result = clamor_create_function(NULL, &context, &error);
  began = report("clamor_create", began);
  if (result == CLAMOR_OK) result = clamor_open_level_function(context, words[2], &level, &error);
  began = report("clamor_open_level", began);
  for (int i = 0; i < 2 && result == CLAMOR_OK; ++i) {
    result = clamor_create_listener_function(context, level, &options, &listeners[i], &error);
    began = report(i == 0 ? "first listener, binaural" : "second listener", began);
  }
  if (result == CLAMOR_OK) result = clamor_render_function(context, listeners[0], block, 256);
  if (result != CLAMOR_OK) {
    fprintf(stderr, "start_up: %s\n", error.sentence);
    return 1;
  }
  began = report("first block of 256 frames", began);
  clamor_destroy_function(context);
  report("clamor_destroy", began);
  return 0;
}
