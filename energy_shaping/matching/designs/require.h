#pragma once
#include <cstdio>
#include <initializer_list>
#include <string>

#include "phs/error.h"

namespace porthos::energy_shaping {

/// Checks a condition of a design: need(holds, "a > 0", {a}) throws an error with the condition and
/// the numbers.
class Requirement {
 public:
  explicit Requirement(std::string design) : design_(std::move(design)) {}
  void operator()(bool holds, const std::string& condition,
                  std::initializer_list<double> got) const {
    if (holds) return;
    std::string numbers;
    for (const double x : got) {
      char text[32];
      std::snprintf(text, sizeof text, "%.6g", x);
      if (!numbers.empty()) numbers += ", ";
      numbers += text;
    }
    throw InvalidArgument("design '" + design_ + "' does not apply: it needs " + condition +
                          "; got " + numbers);
  }

 private:
  std::string design_;
};

}  // namespace porthos::energy_shaping
