#include "phs/system/check_description.h"

#include <algorithm>

#include "phs/error.h"

namespace porthos::phs {
namespace {

[[noreturn]] void refuse_description(const Description& d, const std::string& what) {
  throw InvalidArgument("system '" + d.name + "': " + what);
}
std::string assigned(const char* name, long long value) {
  return std::string(name) + "=" + std::to_string(value);
}

struct Slice {
  std::string who;     ///< "block 'q'"
  const char* offset;  ///< "at" or "momentum"
  long long at, size;

  std::string text() const {
    return who + " has " + assigned(offset, at) + " and " + assigned("size", size);
  }
};

/// Slices of a vector of `size` numbers; `length` says what size is.
void check_slices(const Description& d, std::vector<Slice> slices, const char* vector,
                  const char* length, long long size) {
  for (const Slice& s : slices)
    if (s.size < 1 || s.at < 0 || s.at + s.size > size)
      refuse_description(d, s.text() + ", expected a slice within 0.." + std::to_string(size) +
                                " of " + vector + " (" + assigned(length, size) + ")");
  std::ranges::stable_sort(slices, {}, &Slice::at);
  for (size_t i = 1; i < slices.size(); ++i) {
    const Slice &before = slices[i - 1], &s = slices[i];
    if (s.at < before.at + before.size)
      refuse_description(d, s.text() + " in " + vector + ", where " + before.text() +
                                ", expected slices that do not overlap");
  }
}

void check_block(const Description& d, const Block& b) {
  const int size = b.kind == BlockKind::angle ? 1 : b.kind == BlockKind::rotation ? 4 : b.size;
  const std::string who = "block '" + b.name + "' has ";
  if (b.size != size)
    refuse_description(d, who + assigned("size", b.size) + ", expected " + std::to_string(size) +
                              (size == 1 ? " for an angle" : " for a rotation"));
  if (d.traits.canonical && b.momentum != -1 && b.momentum != b.at + d.nx / 2)
    refuse_description(d, who + assigned("at", b.at) + " and " + assigned("momentum", b.momentum) +
                              ", expected " + assigned("momentum", b.at + d.nx / 2) +
                              " (at + nx/2), as traits say that the system is canonical");
}

}  // namespace

void check_description(const Description& d) {
  if (d.nx < 0 || d.nu < 0)
    refuse_description(d, "has " + assigned("nx", d.nx) + " and " + assigned("nu", d.nu) +
                              ", expected numbers that are not negative");
  std::vector<Slice> x, u, values;
  for (const Block& b : d.blocks) {
    x.push_back({"block '" + b.name + "'", "at", b.at, b.size});
    if (b.momentum != -1) x.push_back({"block '" + b.name + "'", "momentum", b.momentum, b.size});
  }
  check_slices(d, x, "x", "nx", d.nx);
  for (const Block& b : d.blocks) check_block(d, b);
  for (const Port& p : d.ports) u.push_back({"port '" + p.name + "'", "at", p.at, p.size});
  check_slices(d, u, "u", "nu", d.nu);
  long long count = 0;
  for (const Invariant& i : d.invariants) {
    values.push_back({"invariant '" + i.name + "'", "at", i.at, i.size});
    count += i.size;
  }
  check_slices(d, values, "the invariants", "sum of sizes", count);
}

}  // namespace porthos::phs
