// Loaded in front of the C and C++ libraries (LD_PRELOAD): lets one call of a program fail, or all
// from one on, of those of a kind.
// PORTHOS_FAULT_OF: files (calls that change files), rights (of these, the calls that name a path),
// handles (calls that open a file, also to read), memory (new) or threads.
// PORTHOS_FAULT: the number of the call, from 1.
// PORTHOS_FAULT_LAST: 1 if the calls after it succeed again. PORTHOS_FAULT_ERROR: errno, or -9: the
// program is killed in that call, a write after half of its bytes.
// PORTHOS_FAULT_COUNT: a file that gets the number of calls at the end. Output to the terminal is
// let through.
#include <dlfcn.h>
#include <fcntl.h>
#include <pthread.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <new>

namespace {

std::atomic<long> calls{0};
bool counting = false;

long number(const char* name) {
  const char* text = std::getenv(name);
  return text ? std::atol(text) : 0;
}

/// Whether calls of a kind are counted and let fail.
bool tried(const char* kind) {
  const char* chosen = std::getenv("PORTHOS_FAULT_OF");
  return chosen != nullptr && std::strcmp(chosen, kind) == 0;
}

/// Whether this call is to fail; errno is then set. half: what a program does of it that is killed.
template <class Half>
bool next_fails(Half half) {
  static const long at = number("PORTHOS_FAULT"), once = number("PORTHOS_FAULT_LAST"),
                    error = number("PORTHOS_FAULT_ERROR");
  if (counting) return false;
  const long now = ++calls;
  if (at == 0 || now < at || (once != 0 && now > at)) return false;
  if (error < 0) {
    half();
    std::raise(int(-error));
  }
  errno = int(error);
  return true;
}
bool next_fails() {
  return next_fails([] {});
}

template <class Half>
bool fails(Half half) {
  static const bool files = tried("files");
  return files && next_fails(half);
}
bool fails() {
  return fails([] {});
}
/// A call that names a path and changes what is there.
bool fails_at_path() {
  static const bool rights = tried("rights");
  return rights ? next_fails() : fails();
}
bool fails_to_open(bool changes) {
  static const bool handles = tried("handles");
  return handles ? next_fails() : changes && fails_at_path();
}

/// The memory of a new, or nullptr.
void* granted(size_t size, size_t alignment = 0) {
  static const bool memory = tried("memory");
  if (memory && next_fails()) return nullptr;
  if (size == 0) size = 1;
  return alignment == 0
             ? std::malloc(size)
             : std::aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment);
}
void* or_throw(void* p) {
  if (p == nullptr) throw std::bad_alloc();
  return p;
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
  return fails_to_open(changes(mode)) ? nullptr : next(path, mode);
}
std::FILE* fopen64(const char* path, const char* mode) {
  static const auto next = real<std::FILE*(const char*, const char*)>("fopen64");
  return fails_to_open(changes(mode)) ? nullptr : next(path, mode);
}
int open(const char* path, int flags, ...) {
  static const auto next = real<int(const char*, int, ...)>("open");
  va_list rest;
  va_start(rest, flags);
  const auto mode = va_arg(rest, unsigned);
  va_end(rest);
  return fails_to_open(changes(flags)) ? -1 : next(path, flags, mode);
}
int open64(const char* path, int flags, ...) {
  static const auto next = real<int(const char*, int, ...)>("open64");
  va_list rest;
  va_start(rest, flags);
  const auto mode = va_arg(rest, unsigned);
  va_end(rest);
  return fails_to_open(changes(flags)) ? -1 : next(path, flags, mode);
}
size_t fwrite(const void* data, size_t size, size_t n, std::FILE* f) {
  static const auto next = real<size_t(const void*, size_t, size_t, std::FILE*)>("fwrite");
  const auto half = [&] {
    next(data, 1, size * n / 2, f);
    real<int(std::FILE*)>("fflush")(f);
  };
  return !is_terminal(f) && fails(half) ? 0 : next(data, size, n, f);
}
int fflush(std::FILE* f) {
  static const auto next = real<int(std::FILE*)>("fflush");
  return f != nullptr && !is_terminal(f) && fails() ? EOF : next(f);
}
ssize_t write(int fd, const void* data, size_t n) {
  static const auto next = real<ssize_t(int, const void*, size_t)>("write");
  return fd > 2 && fails([&] { (void)!next(fd, data, n / 2); }) ? -1 : next(fd, data, n);
}
ssize_t pwrite(int fd, const void* data, size_t n, off_t at) {
  static const auto next = real<ssize_t(int, const void*, size_t, off_t)>("pwrite");
  return fd > 2 && fails([&] { (void)!next(fd, data, n / 2, at); }) ? -1 : next(fd, data, n, at);
}
ssize_t pwrite64(int fd, const void* data, size_t n, off64_t at) {
  static const auto next = real<ssize_t(int, const void*, size_t, off64_t)>("pwrite64");
  return fd > 2 && fails([&] { (void)!next(fd, data, n / 2, at); }) ? -1 : next(fd, data, n, at);
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
  return fails_at_path() ? -1 : next(from, to);
}
int link(const char* from, const char* to) noexcept {
  static const auto next = real<int(const char*, const char*)>("link");
  return fails_at_path() ? -1 : next(from, to);
}
int mkdir(const char* path, mode_t mode) noexcept {
  static const auto next = real<int(const char*, mode_t)>("mkdir");
  return fails_at_path() ? -1 : next(path, mode);
}
int unlink(const char* path) noexcept {
  static const auto next = real<int(const char*)>("unlink");
  return fails_at_path() ? -1 : next(path);
}
int unlinkat(int folder, const char* name, int flags) noexcept {
  static const auto next = real<int(int, const char*, int)>("unlinkat");
  return fails_at_path() ? -1 : next(folder, name, flags);
}
int rmdir(const char* path) noexcept {
  static const auto next = real<int(const char*)>("rmdir");
  return fails_at_path() ? -1 : next(path);
}
int remove(const char* path) noexcept {
  static const auto next = real<int(const char*)>("remove");
  return fails_at_path() ? -1 : next(path);
}

int pthread_create(pthread_t* thread, const pthread_attr_t* about, void* (*f)(void*),
                   void* with) noexcept {
  static const bool threads = tried("threads");
  static const auto next =
      real<int(pthread_t*, const pthread_attr_t*, void* (*)(void*), void*)>("pthread_create");
  return threads && next_fails() ? EAGAIN : next(thread, about, f, with);
}

}  // extern "C"

void* operator new(size_t n) { return or_throw(granted(n)); }
void* operator new[](size_t n) { return or_throw(granted(n)); }
void* operator new(size_t n, std::align_val_t a) { return or_throw(granted(n, size_t(a))); }
void* operator new[](size_t n, std::align_val_t a) { return or_throw(granted(n, size_t(a))); }
void* operator new(size_t n, const std::nothrow_t&) noexcept { return granted(n); }
void* operator new[](size_t n, const std::nothrow_t&) noexcept { return granted(n); }
void operator delete(void* p) noexcept { std::free(p); }
void operator delete[](void* p) noexcept { std::free(p); }
void operator delete(void* p, size_t) noexcept { std::free(p); }
void operator delete[](void* p, size_t) noexcept { std::free(p); }
void operator delete(void* p, std::align_val_t) noexcept { std::free(p); }
void operator delete[](void* p, std::align_val_t) noexcept { std::free(p); }
void operator delete(void* p, size_t, std::align_val_t) noexcept { std::free(p); }
void operator delete[](void* p, size_t, std::align_val_t) noexcept { std::free(p); }
