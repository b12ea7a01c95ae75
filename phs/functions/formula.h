#pragma once
#include <map>
#include <span>
#include <string>
#include <vector>

#include "phs/scalars/power.h"

namespace porthos::phs {

/// A formula of named numbers over every scalar, "0.5*k*phi^2 + a*cosh(b*phi)": numbers, names, pi,
/// ( ), + - * / ^ and the functions sqrt exp log sin cos tan sinh cosh tanh atan abs min max. ^
/// binds strongest, from the right, and its exponent is a constant; -2^2 is -4.
///
/// Immutable, for any number of threads. What depends on no variable is computed once, in double.
/// An evaluation is a walk through a tree and allocates nothing. It costs one operation of T for
/// each of its signs and functions.
class Formula {
 public:
  using Constants = std::map<std::string, double>;
  /// @param variables  their names, in the order of at();  constants: those of the numbers it may
  ///   use, each of which it has to use
  /// @throws InvalidArgument saying what is wrong and at which character
  Formula(const std::string& text, const std::vector<std::string>& variables,
          const Constants& constants = {});

  /// Its value. T is a scalar of phs/scalars/scalar.h, or a type of derivatives that has the
  /// functions of scalar.h.
  template <class T>
  T at(std::span<const T> variables) const {
    return value(nodes_.back(), variables);
  }
  /// Whether its value depends on the variable of this number.
  bool depends_on(int variable) const;
  /// Whether its derivatives may jump: it has abs, min or max of a variable.
  bool has_kinks() const;

 private:
  friend class FormulaParser;
  enum class Op {
    number,
    variable,
    sum,
    difference,
    product,
    quotient,
    negative,
    power,
    whole_power,
    sqrt,
    exp,
    log,
    sin,
    cos,
    tan,
    sinh,
    cosh,
    tanh,
    atan,
    abs,
    min,
    max
  };
  /// A sign or function with its operands, which stand before it in the list.
  struct Node {
    Op op = Op::number;
    int a = -1, b = -1;  ///< the operands; of a variable: its number
    double number = 0;   ///< of a power: the exponent
  };

  template <class T>
  T value(const Node& n, std::span<const T> variables) const {
    const auto a = [&] { return value(nodes_[size_t(n.a)], variables); };
    const auto b = [&] { return value(nodes_[size_t(n.b)], variables); };
    switch (n.op) {
      case Op::number:
        return T(n.number);
      case Op::variable:
        return variables[size_t(n.a)];
      case Op::sum:
        return a() + b();
      case Op::difference:
        return a() - b();
      case Op::product:
        return a() * b();
      case Op::quotient:
        return a() / b();
      case Op::negative:
        return -a();
      case Op::power:
        return pow(a(), n.number);
      case Op::whole_power:
        return phs::whole_power(a(), int(n.number));
      case Op::sqrt:
        return sqrt(a());
      case Op::exp:
        return exp(a());
      case Op::log:
        return log(a());
      case Op::sin:
        return phs::sin(a());
      case Op::cos:
        return phs::cos(a());
      case Op::tan: {
        const T x = a();
        return phs::sin(x) / phs::cos(x);
      }
      case Op::sinh:
        return sinh(a());
      case Op::cosh:
        return cosh(a());
      case Op::tanh:
        return tanh(a());
      case Op::atan:
        return atan(a());
      case Op::abs:
        return phs::abs(a());
      case Op::min:
        return phs::min(a(), b());
      case Op::max:
        return phs::max(a(), b());
    }
    return T(0.0);
  }

  std::vector<Node> nodes_;  ///< the last one is the whole
};

}  // namespace porthos::phs
