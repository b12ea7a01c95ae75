// The library of dart.cpp, opened so that it and DART look for symbols among themselves first:
// libdart.so exports functions of Eigen that would otherwise be taken from here, where they
// allocate differently.
#include <dlfcn.h>

#include <stdexcept>

#include "bench/peers/subject.h"

namespace porthos::bench {

Subject dart_subject(const Case& c) {
  void* library = dlopen(PORTHOS_PEER_DART, RTLD_NOW | RTLD_LOCAL | RTLD_DEEPBIND);
  void* symbol = library ? dlsym(library, "porthos_dart_subject") : nullptr;
  if (!symbol) throw std::runtime_error(std::string("DART's adapter: ") + dlerror());
  Subject s;
  reinterpret_cast<void (*)(const Case&, Subject&)>(symbol)(c, s);
  return s;
}

}  // namespace porthos::bench
