// Checks, before anything else runs, whether this processor has the instructions for which the
// program was compiled. This file is compiled for every x86-64, alone, and without the C++ library,
// so that this code itself runs on every processor.
#include <unistd.h>

#include "apps/cpu_features.h"

namespace {

void say(const char* text) {
  size_t size = 0;
  while (text[size]) ++size;
  // A failed write cannot be reported.
  if (write(STDERR_FILENO, text, size) < 0) return;
}

/// Priority 101: before the constructors of static objects, which may use these instructions.
__attribute__((constructor(101))) void refuse_other_machines() {
  [[maybe_unused]] const auto need = [](bool has, const char* name) {
    if (has) return;
    say("porthos: this program was built for processors with ");
    say(name);
    say(", which this one lacks: build it here (./dev build) or take a build for every x86-64 "
        "(./dev build release)\n");
    _exit(2);
  };
#ifdef PORTHOS_NEED_CPU_FEATURES
  __builtin_cpu_init();
#define PORTHOS_NEED(name) need(__builtin_cpu_supports(name), name);
  PORTHOS_NEED_CPU_FEATURES(PORTHOS_NEED)
#undef PORTHOS_NEED
#endif
}

}  // namespace
