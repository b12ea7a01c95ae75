#pragma once
#include <algorithm>
#include <cstddef>
#include <string>
#include <vector>

namespace porthos::scene {

using TextRows = std::vector<std::vector<std::string>>;

/// Letters of a text in UTF-8.
inline std::size_t letters(const std::string& text) {
  return std::size_t(
      std::count_if(text.begin(), text.end(), [](char c) { return (c & 0xC0) != 0x80; }));
}

/// Rows as lines of text: columns are two blanks apart, `indent` precedes each line, and no line
/// ends in blanks.
inline std::string aligned(const TextRows& rows, const std::string& indent = "") {
  std::vector<std::size_t> width;
  for (const auto& row : rows) {
    width.resize(std::max(width.size(), row.size()));
    for (std::size_t c = 0; c < row.size(); ++c) width[c] = std::max(width[c], letters(row[c]));
  }
  std::string text;
  for (const auto& row : rows) {
    std::string line = indent;
    for (std::size_t c = 0; c < row.size(); ++c)
      line += row[c] + std::string(width[c] - letters(row[c]) + 2, ' ');
    line.erase(line.find_last_not_of(' ') + 1);
    text += line + "\n";
  }
  return text;
}

/// The lines of a text, without what ends them.
inline std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> list;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    list.push_back(text.substr(at, end - at));
    at = end + 1;
  }
  return list;
}

}  // namespace porthos::scene
