#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstring>
#include <map>

#include "phs/error.h"
#include "report/detail/mesh.h"

/// STL and OBJ.
namespace porthos::report {
namespace {

[[noreturn]] void refuse_mesh(const std::string& file, const std::string& why) {
  throw InvalidArgument(file + ": " + why);
}

/// The words of a text, line by line.
class Words {
 public:
  explicit Words(std::string_view text) : rest_(text) {}
  /// Goes to the next line. @return false at the end
  bool next_line() {
    if (rest_.empty()) return false;
    const auto end = rest_.find('\n');
    line_ = rest_.substr(0, end);
    rest_ = end == rest_.npos ? std::string_view() : rest_.substr(end + 1);
    ++number_;
    return true;
  }
  /// The next word of the line; empty at its end.
  std::string_view word() {
    const char* const blank = " \t\r";
    line_.remove_prefix(std::min(line_.find_first_not_of(blank), line_.size()));
    const auto w = line_.substr(0, line_.find_first_of(blank));
    line_.remove_prefix(w.size());
    return w;
  }
  long number() const { return number_; }

 private:
  std::string_view rest_, line_;
  long number_ = 0;
};

/// Joins the corners of triangles that are given one by one.
class Joined {
 public:
  explicit Joined(Mesh& mesh) : mesh_(mesh) {}
  std::uint32_t index(const std::array<double, 3>& c) {
    const auto [at, fresh] = known_.emplace(c, std::uint32_t(mesh_.corners.size()));
    if (fresh) mesh_.corners.push_back(c);
    return at->second;
  }

 private:
  Mesh& mesh_;
  std::map<std::array<double, 3>, std::uint32_t> known_;
};

std::array<double, 3> three_numbers(Words& words, const std::string& file) {
  std::array<double, 3> c{};
  for (double& x : c) {
    const auto word = words.word();
    const auto value = as_number(word.substr(word.find('+') == 0 ? 1 : 0));
    if (!value || !std::isfinite(*value))
      refuse_mesh(fmt::format("{}:{}", file, words.number()),
                  fmt::format("'{}', expected three numbers", word));
    x = *value;
  }
  return c;
}

/// 80 bytes of any text, the number of triangles, and for each its normal, corners and two bytes.
constexpr size_t stl_head = 84, stl_triangle = 50;

size_t stl_count(const std::string& bytes) {
  std::uint32_t n = 0;
  if (bytes.size() >= stl_head) std::memcpy(&n, bytes.data() + stl_head - sizeof n, sizeof n);
  return n;
}

Mesh binary_stl(const std::string& bytes, const std::string& file) {
  Mesh mesh;
  Joined joined(mesh);
  for (size_t i = 0; i < stl_count(bytes); ++i) {
    float x[12];
    std::memcpy(x, bytes.data() + stl_head + i * stl_triangle, sizeof x);
    std::array<std::uint32_t, 3> t{};
    for (size_t k = 0; k < 3; ++k) {
      const float* c = x + 3 + 3 * k;
      if (!std::isfinite(c[0] + c[1] + c[2]))
        refuse_mesh(file, fmt::format("a corner of triangle {} is not finite", i));
      t[k] = joined.index({c[0], c[1], c[2]});
    }
    mesh.triangles.push_back(t);
  }
  return mesh;
}

Mesh text_stl(const std::string& text, const std::string& file) {
  Mesh mesh;
  Joined joined(mesh);
  std::vector<std::uint32_t> facet;
  for (Words words(text); words.next_line();) {
    const auto word = words.word();
    if (word == "vertex") facet.push_back(joined.index(three_numbers(words, file)));
    if (word != "endfacet") continue;
    if (facet.size() != 3)
      refuse_mesh(fmt::format("{}:{}", file, words.number()),
                  fmt::format("a facet has {} corners, expected 3", facet.size()));
    mesh.triangles.push_back({facet[0], facet[1], facet[2]});
    facet.clear();
  }
  return mesh;
}

Mesh parse_stl(const std::string& bytes, const std::string& file) {
  // Binary files may begin with "solid" too: their size tells.
  if (bytes.size() >= stl_head && bytes.size() >= stl_head + stl_triangle * stl_count(bytes) &&
      (bytes.size() == stl_head + stl_triangle * stl_count(bytes) || bytes.rfind("solid", 0) != 0))
    return binary_stl(bytes, file);
  if (bytes.rfind("solid", 0) != 0)
    refuse_mesh(file, fmt::format("it is cut off or no STL file: {} bytes for {} triangles",
                                  bytes.size(), stl_count(bytes)));
  return text_stl(bytes, file);
}

/// The corner of "7/2/3" or "-1", counted from 1 or from the end.
std::uint32_t obj_corner(std::string_view word, size_t corners, const std::string& at) {
  long i = 0;
  const auto own = word.substr(0, word.find('/'));
  const auto [end, error] = std::from_chars(own.data(), own.data() + own.size(), i);
  const long k = i < 0 ? long(corners) + i : i - 1;
  if (error != std::errc() || end != own.data() + own.size() || k < 0 || k >= long(corners))
    refuse_mesh(at, fmt::format("'{}', expected one of the {} corners before it", word, corners));
  return std::uint32_t(k);
}

Mesh parse_obj(const std::string& text, const std::string& file) {
  Mesh mesh;
  for (Words words(text); words.next_line();) {
    const auto word = words.word();
    if (word == "v") mesh.corners.push_back(three_numbers(words, file));
    if (word != "f") continue;
    const std::string at = fmt::format("{}:{}", file, words.number());
    std::vector<std::uint32_t> face;
    for (auto w = words.word(); !w.empty(); w = words.word())
      face.push_back(obj_corner(w, mesh.corners.size(), at));
    for (size_t k = 2; k < face.size(); ++k)
      mesh.triangles.push_back({face[0], face[k - 1], face[k]});
  }
  return mesh;
}

}  // namespace

Mesh parse_mesh(const std::string& bytes, const std::filesystem::path& path) {
  const std::string file = path.string();
  std::string ending = path.extension().string();
  for (char& c : ending) c = char(std::tolower(static_cast<unsigned char>(c)));
  Mesh mesh;
  if (ending == ".stl")
    mesh = parse_stl(bytes, file);
  else if (ending == ".obj")
    mesh = parse_obj(bytes, file);
  else if (ending == ".dae")
    mesh = parse_collada(bytes, file);
  else
    refuse_mesh(file, fmt::format("a mesh of kind '{}', expected .stl, .obj or .dae", ending));
  if (mesh.triangles.empty()) refuse_mesh(file, "it has no triangles");
  return mesh;
}

}  // namespace porthos::report
