// The `lumihull` program: one verb a file, all of them written on the public headers.

#include "program.h"

int main(int argc, char** argv) {
  lumihull::program::Program program;
  return program.run(argc, argv);
}
