// Nothing but the header: it compiles by itself as C++ and links with C names.
#include <lumihull.h>

int main() {
  const lh_carve_options options{};
  return lh_version()[0] == '\0' || options.resolution != 0;
}
