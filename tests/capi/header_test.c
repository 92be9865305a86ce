/* Nothing but the header: it compiles by itself, as C99 and (header_test.cpp) as C++. */
#include <lumihull.h>

int main(void) { return lh_version()[0] == '\0'; }
