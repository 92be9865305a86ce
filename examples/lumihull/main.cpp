// The `lumihull` program: one verb a file, all of them written on the public headers.

#include <cstdlib>

#ifdef __GLIBC__
#include <malloc.h>
#endif

#include "program.h"

int main(int argc, char** argv) {
#ifdef __GLIBC__
  // Photographs and masks come and go by the hundred: glibc would return each to the system and ask for it again, and
  // the system clears it anew.
  mallopt(M_MMAP_THRESHOLD, 32 << 20);
  mallopt(M_TRIM_THRESHOLD, 256 << 20);
  mallopt(M_TOP_PAD, 16 << 20);
#endif
  lumihull::program::Program program;
  return program.run(argc, argv);
}
