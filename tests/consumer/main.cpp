// What a user of an installed Porthos writes: the include path is the one used inside the repository.
#include "phs/scalar.h"

#include <cstdio>

int main() {
  std::puts("consumer: found, compiled and linked");
  return 0;
}
