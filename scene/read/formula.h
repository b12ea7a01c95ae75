#pragma once
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace porthos::scene {

/// A formula of named numbers, "sqrt(tip.x^2 + tip.y^2)": + - * / ^, comparisons, a ? b : c, and
/// the functions of the library muParser.
class Formula {
 public:
  /// names: of the numbers it may use. @throws InvalidArgument saying what is wrong and where
  Formula(const std::string& text, const std::vector<std::string>& names);
  Formula(Formula&&) noexcept;
  ~Formula();
  /// values: of all names, in their order. Not for two threads at once.
  double operator()(std::span<const double> values);
  /// Whether it contains the name.
  bool uses(const std::string& name) const;

 private:
  struct Parser;
  std::unique_ptr<Parser> parser_;
};

}  // namespace porthos::scene
