/* glibc_2_31.c: lets a library that is built with a newer C library run with that of Debian 11.
 *
 * A linker takes the newest version of each function of glibc, which an older glibc lacks. Here each such
 * function is a local one of the library: it jumps to an older version that all have, or is written anew.
 * tools/packaging/check_bundle finds functions that are missing here. */
#define _GNU_SOURCE
#include <link.h>
#include <stddef.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/types.h>

/* NAME jumps to the version of glibc; other files of the library see NAME, applications do not. */
#define OLD(name, version)                                                              \
  __asm__(".symver old_" #name ", " #name "@" version "\n"                              \
          ".globl " #name "\n.hidden " #name "\n.type " #name ", @function\n" #name ":\n" \
          "jmp *old_" #name "@GOTPCREL(%rip)\n");

OLD(__pthread_key_create, "GLIBC_2.2.5")
OLD(dlclose, "GLIBC_2.2.5")
OLD(dlerror, "GLIBC_2.2.5")
OLD(dlopen, "GLIBC_2.2.5")
OLD(dlsym, "GLIBC_2.2.5")
OLD(hypot, "GLIBC_2.2.5")
OLD(pthread_attr_setstacksize, "GLIBC_2.2.5")
OLD(pthread_cancel, "GLIBC_2.2.5")
OLD(pthread_cond_clockwait, "GLIBC_2.30")
OLD(pthread_create, "GLIBC_2.2.5")
OLD(pthread_detach, "GLIBC_2.2.5")
OLD(pthread_getaffinity_np, "GLIBC_2.3.4")
OLD(pthread_getcpuclockid, "GLIBC_2.2.5")
OLD(pthread_getspecific, "GLIBC_2.2.5")
OLD(pthread_join, "GLIBC_2.2.5")
OLD(pthread_key_create, "GLIBC_2.2.5")
OLD(pthread_key_delete, "GLIBC_2.2.5")
OLD(pthread_kill, "GLIBC_2.2.5")
OLD(pthread_mutex_trylock, "GLIBC_2.2.5")
OLD(pthread_once, "GLIBC_2.2.5")
OLD(pthread_rwlock_rdlock, "GLIBC_2.2.5")
OLD(pthread_rwlock_unlock, "GLIBC_2.2.5")
OLD(pthread_rwlock_wrlock, "GLIBC_2.2.5")
OLD(pthread_setaffinity_np, "GLIBC_2.3.4")
OLD(pthread_setname_np, "GLIBC_2.12")
OLD(pthread_setspecific, "GLIBC_2.2.5")
OLD(pthread_sigmask, "GLIBC_2.2.5")

#define LOCAL __attribute__((visibility("hidden")))

/* libstdc++ leaves out atomic operations while there is one thread; "no" is always right. */
LOCAL char __libc_single_threaded = 0;

/* Before 2.33 these were inline functions. The first argument is the version of the structure. */
extern int __xstat(int version, const char* path, struct stat* status);
extern int __lxstat(int version, const char* path, struct stat* status);
extern int __fxstat(int version, int file, struct stat* status);
LOCAL int stat(const char* path, struct stat* status) { return __xstat(1, path, status); }
LOCAL int lstat(const char* path, struct stat* status) { return __lxstat(1, path, status); }
LOCAL int fstat(int file, struct stat* status) { return __fxstat(1, file, status); }
LOCAL int stat64(const char* path, struct stat64* status) {
  return __xstat(1, path, (struct stat*)status);
}
LOCAL int fstat64(int file, struct stat64* status) {
  return __fxstat(1, file, (struct stat*)status);
}

/* std::random_device asks for it. */
extern ssize_t getrandom(void* bytes, size_t count, unsigned flags);
LOCAL unsigned arc4random(void) {
  unsigned value = 0;
  while (getrandom(&value, sizeof value, 0) != (ssize_t)sizeof value) {
  }
  return value;
}

/* The unwinder of GCC 12 asks for the file that holds an address. */
struct search {
  ElfW(Addr) address;
  struct dl_find_object* found;
};

static int is_here(struct dl_phdr_info* file, size_t size, void* user) {
  struct search* const search = user;
  ElfW(Addr) begin = 0, end = 0;
  const void* frames = NULL;
  (void)size;
  for (int i = 0; i < file->dlpi_phnum; ++i) {
    const ElfW(Phdr)* const part = &file->dlpi_phdr[i];
    const ElfW(Addr) first = file->dlpi_addr + part->p_vaddr;
    if (part->p_type == PT_GNU_EH_FRAME) frames = (const void*)first;
    if (part->p_type == PT_LOAD && search->address >= first &&
        search->address < first + part->p_memsz) {
      begin = first;
      end = first + part->p_memsz;
    }
  }
  if (end == 0 || frames == NULL) return 0;
  memset(search->found, 0, sizeof *search->found);
  search->found->dlfo_map_start = (void*)begin;
  search->found->dlfo_map_end = (void*)end;
  search->found->dlfo_eh_frame = (void*)frames;
  return 1;
}

LOCAL int _dl_find_object(void* address, struct dl_find_object* found) {
  struct search search = {(ElfW(Addr))address, found};
  return dl_iterate_phdr(is_here, &search) == 1 ? 0 : -1;
}
