// Loaded in front of the C library (LD_PRELOAD): lets one call of a program that changes files
// fail, or all from one on. PORTHOS_FAULT: its number, from 1. PORTHOS_FAULT_LAST: 1 if the calls
// after it succeed again. PORTHOS_FAULT_ERROR: errno. PORTHOS_FAULT_COUNT: a file that gets the
// number of calls at the end. Output to the terminal is let through.
#include <dlfcn.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace {

std::atomic<long> calls{0};
bool counting = false;

long number(const char* name) {
  const char* text = std::getenv(name);
  return text ? std::atol(text) : 0;
}

/// Whether this call is to fail; errno is then set.
bool fails() {
  static const long at = number("PORTHOS_FAULT"), once = number("PORTHOS_FAULT_LAST"),
                    error = number("PORTHOS_FAULT_ERROR");
  if (counting) return false;
  const long now = ++calls;
  if (at == 0 || now < at || (once != 0 && now > at)) return false;
  errno = int(error);
  return true;
}

template <class F>
F* real(const char* name) {
  return reinterpret_cast<F*>(dlsym(RTLD_NEXT, name));
}

bool changes(const char* mode) { return std::strpbrk(mode, "wa+") != nullptr; }
bool changes(int flags) { return (flags & (O_WRONLY | O_RDWR | O_CREAT)) != 0; }
bool is_terminal(std::FILE* f) { return f == stdout || f == stderr; }

struct Count {
  ~Count() {
    counting = true;
    if (const char* path = std::getenv("PORTHOS_FAULT_COUNT"))
      if (std::FILE* f = std::fopen(path, "w")) {
        std::fprintf(f, "%ld\n", calls.load());
        std::fclose(f);
      }
  }
} count;

}  // namespace

extern "C" {

std::FILE* fopen(const char* path, const char* mode) {
  static const auto next = real<std::FILE*(const char*, const char*)>("fopen");
  return changes(mode) && fails() ? nullptr : next(path, mode);
}
std::FILE* fopen64(const char* path, const char* mode) {
  static const auto next = real<std::FILE*(const char*, const char*)>("fopen64");
  return changes(mode) && fails() ? nullptr : next(path, mode);
}
int open(const char* path, int flags, ...) {
  static const auto next = real<int(const char*, int, ...)>("open");
  va_list rest;
  va_start(rest, flags);
  const auto mode = va_arg(rest, unsigned);
  va_end(rest);
  return changes(flags) && fails() ? -1 : next(path, flags, mode);
}
int open64(const char* path, int flags, ...) {
  static const auto next = real<int(const char*, int, ...)>("open64");
  va_list rest;
  va_start(rest, flags);
  const auto mode = va_arg(rest, unsigned);
  va_end(rest);
  return changes(flags) && fails() ? -1 : next(path, flags, mode);
}
size_t fwrite(const void* data, size_t size, size_t n, std::FILE* f) {
  static const auto next = real<size_t(const void*, size_t, size_t, std::FILE*)>("fwrite");
  return !is_terminal(f) && fails() ? 0 : next(data, size, n, f);
}
int fflush(std::FILE* f) {
  static const auto next = real<int(std::FILE*)>("fflush");
  return f != nullptr && !is_terminal(f) && fails() ? EOF : next(f);
}
ssize_t write(int fd, const void* data, size_t n) {
  static const auto next = real<ssize_t(int, const void*, size_t)>("write");
  return fd > 2 && fails() ? -1 : next(fd, data, n);
}
ssize_t pwrite(int fd, const void* data, size_t n, off_t at) {
  static const auto next = real<ssize_t(int, const void*, size_t, off_t)>("pwrite");
  return fd > 2 && fails() ? -1 : next(fd, data, n, at);
}
ssize_t pwrite64(int fd, const void* data, size_t n, off64_t at) {
  static const auto next = real<ssize_t(int, const void*, size_t, off64_t)>("pwrite64");
  return fd > 2 && fails() ? -1 : next(fd, data, n, at);
}
int fsync(int fd) {
  static const auto next = real<int(int)>("fsync");
  return fails() ? -1 : next(fd);
}
int ftruncate(int fd, off_t size) noexcept {
  static const auto next = real<int(int, off_t)>("ftruncate");
  return fails() ? -1 : next(fd, size);
}
int ftruncate64(int fd, off64_t size) noexcept {
  static const auto next = real<int(int, off64_t)>("ftruncate64");
  return fails() ? -1 : next(fd, size);
}
int rename(const char* from, const char* to) noexcept {
  static const auto next = real<int(const char*, const char*)>("rename");
  return fails() ? -1 : next(from, to);
}
int link(const char* from, const char* to) noexcept {
  static const auto next = real<int(const char*, const char*)>("link");
  return fails() ? -1 : next(from, to);
}
int mkdir(const char* path, mode_t mode) noexcept {
  static const auto next = real<int(const char*, mode_t)>("mkdir");
  return fails() ? -1 : next(path, mode);
}

}  // extern "C"
