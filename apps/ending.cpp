#include "apps/ending.h"

#include <cstdio>
#include <cstdlib>
#include <exception>
#include <mutex>
#include <new>

#include "apps/commands.h"

namespace porthos::apps {

void no_memory() {
  static std::mutex once;  // never left: several threads may end here at once
  once.lock();
  std::fputs(
      "porthos: there is not enough memory; what was recorded is kept, continue with --resume\n",
      stderr);
  std::_Exit(exit_machine);
}

void terminated() {
  try {
    if (const auto current = std::current_exception()) std::rethrow_exception(current);
  } catch (const std::bad_alloc&) {
    no_memory();
  } catch (const std::exception& e) {
    std::fprintf(stderr, "porthos: ended by an error that nothing took up: %s\n", e.what());
  } catch (...) {
  }
  std::abort();
}

}  // namespace porthos::apps
