#pragma once
#include <array>
#include <charconv>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

namespace porthos {

/// A user's mistake: the text names what was wrong, its value and what was expected (and file:line
/// for files).
struct InvalidArgument : std::invalid_argument {
  using std::invalid_argument::invalid_argument;
};

/// What the machine refused: a file that cannot be written, a full disk. The text has the file and
/// the reason of the operating system. Nobody's input is at fault, so nothing that handles wrong
/// input catches it.
struct IoError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Throws InvalidArgument unless `got == expected`; `what` names the array.
inline void require_size(const char* what, std::size_t got, std::size_t expected) {
  if (got != expected)
    throw InvalidArgument(std::string(what) + " has " + std::to_string(got) +
                          " entries, expected " + std::to_string(expected));
}

/// A whole number kept as a double, as the memory of methods in checkpoints is.
/// @throws InvalidArgument if it is none from least to most
template <class I = int>
I whole(double x, double least = -1e9, double most = 1e9) {
  if (!(x >= least && x <= most))
    throw InvalidArgument("a checkpoint's memory has " + std::to_string(x) + " for a count");
  return static_cast<I>(x);
}

/// "<file:line>: " before a sentence, or nothing where no place is known.
inline std::string in_file(const std::string& where) { return where.empty() ? "" : where + ": "; }

/// One name more of a list "a, b, c".
inline void add_to_list(std::string& list, std::string_view name) {
  if (!list.empty()) list += ", ";
  list += name;
}
/// "a, b, c": what `name` gives of each element of a range.
template <class Range, class Name>
std::string listed(const Range& range, Name name) {
  std::string list;
  for (const auto& element : range) add_to_list(list, name(element));
  return list;
}

/// The element of a range that has a name.
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
/// The same by the member `name`.
template <class Range>
auto& find_named(Range& range, std::string_view name, const std::string& there_is_none) {
  return find_named(
      range, name, there_is_none, [](const auto& element) -> auto& { return element.name; });
}

/// The number a whole text is, or none.
inline std::optional<double> as_number(std::string_view text) {
  double x = 0;
  const char* const end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, x);
  if (error != std::errc() || rest != end) return {};
  return x;
}

/// A number for the text of an error: at most so many significant digits, no trailing zeros.
inline std::string number(double x, int digits = 9) {
  std::array<char, 32> text;
  constexpr auto general = std::chars_format::general;
  return {text.begin(), std::to_chars(text.begin(), text.end(), x, general, digits).ptr};
}

}  // namespace porthos
