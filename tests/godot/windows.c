/* windows.c: enters the add-on's library as a Godot would that is too old for it. The library must say so,
 * and stay where it is.   enter.exe LIBRARY */
#include <stdio.h>
#include <windows.h>

typedef void (*function)(void);
typedef unsigned char (*entry)(function (*get)(const char* name), void* library, void* initialization);

static int asked;

static function none(const char* name) {
  asked += name[0] != 0;
  return NULL;
}

int main(int argc, char** argv) {
  HMODULE library = argc == 2 ? LoadLibraryExA(argv[1], NULL, LOAD_WITH_ALTERED_SEARCH_PATH) : NULL;
  if (library == NULL) return printf("LoadLibrary: error %lu\n", GetLastError()), 1;
  const entry begin = (entry)(void*)GetProcAddress(library, "clamor_godot_begin");
  const int accepts = begin != NULL && begin(none, library, NULL);
  printf("The library has asked for %d functions, and %s.\n", asked, accepts ? "goes on" : "refuses");
  return asked < 20 || accepts;
}
