#pragma once
#include <array>
#include <cerrno>
#include <charconv>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

namespace porthos {

/// A mistake of the user. The text names what was wrong, its value and what was expected; for files
/// it also gives file:line.
struct InvalidArgument : std::invalid_argument {
  using std::invalid_argument::invalid_argument;
};

/// A failure of the operating system: a file that cannot be written, a full disk. The text has the
/// file and the system's reason. Handlers of wrong input do not catch it, because the input is not
/// at fault.
struct IoError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Throws what a file that could not be read is: InvalidArgument, because the user named it, or
/// IoError where the system was short of handles or memory, or the disk failed.
/// @param error  errno after the attempt
[[noreturn]] inline void throw_unreadable(const std::string& text, int error) {
  for (const int fault : {EMFILE, ENFILE, ENOMEM, EIO})
    if (error == fault) throw IoError(text);
  throw InvalidArgument(text);
}

/// Throws InvalidArgument unless `got == expected`; `what` names the array.
inline void require_size(const char* what, std::size_t got, std::size_t expected) {
  if (got != expected)
    throw InvalidArgument(std::string(what) + " has " + std::to_string(got) +
                          " entries, expected " + std::to_string(expected));
}

/// A whole number that was stored as a double, as in the checkpoint memory of a method.
/// @throws InvalidArgument if x is not in [least, most]
template <class I = int>
I whole(double x, double least = -1e9, double most = 1e9) {
  if (!(x >= least && x <= most))
    throw InvalidArgument("a checkpoint's memory has " + std::to_string(x) + " for a count");
  return static_cast<I>(x);
}

/// "<file:line>: " as the start of a sentence; empty if `where` is empty.
inline std::string in_file(const std::string& where) { return where.empty() ? "" : where + ": "; }

/// Appends a name to a list "a, b, c".
inline void add_to_list(std::string& list, std::string_view name) {
  if (!list.empty()) list += ", ";
  list += name;
}
/// "a, b, c": `name` applied to each element of a range.
template <class Range, class Name>
std::string listed(const Range& range, Name name) {
  std::string list;
  for (const auto& element : range) add_to_list(list, name(element));
  return list;
}

/// The element of a range with a given name; `name_of` gives the name of an element.
/// @throws InvalidArgument "<there is none> '<name>', expected one of <the names>"
template <class Range, class Name>
auto& find_named(Range& range, std::string_view name, const std::string& there_is_none,
                 Name name_of) {
  for (auto& element : range)
    if (name_of(element) == name) return element;
  const std::string known = listed(range, name_of);
  throw InvalidArgument(there_is_none + " '" + std::string(name) + "', expected one of " +
                        (known.empty() ? "(none)" : known));
}
/// The same, where an element's name is its member `name`.
template <class Range>
auto& find_named(Range& range, std::string_view name, const std::string& there_is_none) {
  return find_named(
      range, name, there_is_none, [](const auto& element) -> auto& { return element.name; });
}

/// The number that the whole text spells, or none.
inline std::optional<double> as_number(std::string_view text) {
  double x = 0;
  const char* const end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, x);
  if (error != std::errc() || rest != end) return {};
  return x;
}

/// A number for an error text: at most `digits` significant digits, no trailing zeros.
inline std::string number(double x, int digits = 9) {
  std::array<char, 32> text;
  constexpr auto general = std::chars_format::general;
  return {text.begin(), std::to_chars(text.begin(), text.end(), x, general, digits).ptr};
}

}  // namespace porthos
