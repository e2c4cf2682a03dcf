/* client.c: creates a context and prints the library's version. */
#include <stdio.h>

#include <clamor.h>

int main(void) {
  clamor_context* context = NULL;
  const clamor_result created = clamor_create(NULL, &context, NULL);
  const uint32_t version = clamor_version();
  printf("clamor %u.%u.%u: %s\n", (unsigned)(version >> 16), (unsigned)(version >> 8 & 255),
         (unsigned)(version & 255), clamor_result_text(created));
  clamor_destroy(context);
  return created == CLAMOR_OK ? 0 : 1;
}
