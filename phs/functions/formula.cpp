#include "phs/functions/formula.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <set>

#include "phs/error.h"
#include "phs/nearest.h"

namespace porthos::phs {
namespace {

constexpr size_t longest_formula = 4000;  // characters
constexpr int deepest_formula = 200;      // signs and functions within each other
constexpr double largest_whole_power = 64;

bool begins_name(char c) {  // bytes of letters that are not ASCII among them
  return std::isalpha(static_cast<unsigned char>(c)) || c == '_' ||
         static_cast<unsigned char>(c) >= 0x80;
}
bool continues_name(char c) {
  return begins_name(c) || std::isdigit(static_cast<unsigned char>(c));
}

}  // namespace

/// By recursive descent:
///   sum = product {(+|-) product};   product = signed {(*|/) signed};   signed = {+|-} power
///   power = atom [^ signed];   atom = number | name | function(sum, ...) | (sum)
class FormulaParser {
 public:
  using Op = Formula::Op;
  FormulaParser(Formula& formula, const std::string& text,
                const std::vector<std::string>& variables, const Formula::Constants& constants)
      : formula_(formula), text_(text), variables_(variables), constants_(constants) {
    if (text.size() > longest_formula)
      throw InvalidArgument("has " + std::to_string(text.size()) +
                            " characters, expected at most " + std::to_string(longest_formula));
    check_names();
    skip();
    (void)sum();
    if (at_ < text_.size()) unexpected("an operator or the end");
    for (const auto& [name, value] : constants_)
      if (!used_.contains(name))
        throw InvalidArgument("parameter '" + name + "' is not in " + quoted() +
                              ", expected only what is used");
  }

 private:
  struct Function {
    const char* name;
    Op op;
    int operands;
  };
  static constexpr Function functions[] = {
      {"sqrt", Op::sqrt, 1}, {"exp", Op::exp, 1},   {"log", Op::log, 1},   {"sin", Op::sin, 1},
      {"cos", Op::cos, 1},   {"tan", Op::tan, 1},   {"sinh", Op::sinh, 1}, {"cosh", Op::cosh, 1},
      {"tanh", Op::tanh, 1}, {"atan", Op::atan, 1}, {"abs", Op::abs, 1},   {"min", Op::min, 2},
      {"max", Op::max, 2}};

  void check_names() const {
    for (const auto& [name, value] : constants_) {
      const auto refuse = [&, n = name](const std::string& why) {
        throw InvalidArgument("parameter '" + n + "' " + why);
      };
      if (name.empty() || !begins_name(name[0]) ||
          !std::all_of(name.begin(), name.end(), continues_name))
        refuse("is no name, expected letters, digits and '_', not first a digit");
      const auto same = [&, n = name](const auto& f) { return f.name == n; };
      if (name == "pi" || std::any_of(std::begin(functions), std::end(functions), same) ||
          std::find(variables_.begin(), variables_.end(), name) != variables_.end())
        refuse("has a name of the language of formulas, expected another");
      if (!std::isfinite(value)) refuse("is " + number(value) + ", expected a finite number");
    }
  }

  // --- text --------------------------------------------------------------------------------------
  std::string quoted() const { return "\"" + text_ + "\""; }
  [[noreturn]] void fail(size_t at, const std::string& why, const std::string& rest = "") const {
    throw InvalidArgument(quoted() + ": " + why + " at character " + std::to_string(at + 1) + rest);
  }
  [[noreturn]] void unexpected(const std::string& expected) const {
    if (at_ >= text_.size()) fail(at_, "it ends", ", expected " + expected);
    size_t end = at_ + 1;
    if (begins_name(text_[at_]))
      while (end < text_.size() && continues_name(text_[end])) ++end;
    if (text_[at_] == '*' && at_ > 0 && text_[at_ - 1] == '*')
      fail(at_ - 1, "there is '**'", ", expected '^' for a power");
    fail(at_, "there is '" + text_.substr(at_, end - at_) + "'", ", expected " + expected);
  }
  void skip() {
    while (at_ < text_.size() && std::isspace(static_cast<unsigned char>(text_[at_]))) ++at_;
  }
  bool take(char c) {
    if (at_ >= text_.size() || text_[at_] != c) return false;
    ++at_;
    skip();
    return true;
  }

  // --- tree --------------------------------------------------------------------------------------
  int add(Formula::Node n) {
    const bool operands = n.op != Op::number && n.op != Op::variable;
    int depth = 0;
    bool constant = operands;
    for (const int k : {n.a, n.b}) {
      if (!operands || k < 0) continue;
      depth = std::max(depth, depths_[size_t(k)] + 1);
      constant = constant && nodes_[size_t(k)].op == Op::number;
    }
    if (depth > deepest_formula)
      throw InvalidArgument("has more than " + std::to_string(deepest_formula) +
                            " signs and functions within each other, expected fewer");
    if (constant) n = {Op::number, -1, -1, formula_.value<double>(n, {})};
    nodes_.push_back(n);
    depths_.push_back(constant ? 0 : depth);
    return int(nodes_.size()) - 1;
  }

  int sum() {
    int left = product();
    for (;;) {
      if (take('+'))
        left = add({Op::sum, left, product()});
      else if (take('-'))
        left = add({Op::difference, left, product()});
      else
        return left;
    }
  }
  int product() {
    int left = with_sign();
    for (;;) {
      if (take('*'))
        left = add({Op::product, left, with_sign()});
      else if (take('/'))
        left = add({Op::quotient, left, with_sign()});
      else
        return left;
    }
  }
  int with_sign() {
    if (++within_ > deepest_formula) fail(at_, "there are too many brackets or signs");
    const bool minus = take('-');
    const int of = minus || take('+') ? with_sign() : power();
    --within_;
    return minus ? add({Op::negative, of}) : of;
  }
  int power() {
    const int base = atom();
    const size_t begin = at_;
    if (!take('^')) return base;
    const Formula::Node exponent = nodes_[size_t(with_sign())];
    if (exponent.op != Op::number)
      fail(begin, "there is a power whose exponent varies",
           ", expected a constant (x^y is exp(y*log(x)))");
    const double p = exponent.number;
    const bool whole = p == std::round(p) && std::fabs(p) <= largest_whole_power;
    return add({whole ? Op::whole_power : Op::power, base, -1, p});
  }
  int atom() {
    if (take('(')) {
      const int inside = sum();
      if (!take(')')) unexpected("')'");
      return inside;
    }
    if (at_ < text_.size() && begins_name(text_[at_])) return name();
    double x = 0;
    const char* const first = text_.data() + at_;
    const bool digits =
        at_ < text_.size() && (std::isdigit(static_cast<unsigned char>(*first)) || *first == '.');
    const auto [end, error] = std::from_chars(first, text_.data() + text_.size(), x);
    if (!digits || error != std::errc()) unexpected("a number, a name or '('");
    at_ += size_t(end - first);
    skip();
    return add({Op::number, -1, -1, x});
  }
  int name() {
    const size_t begin = at_;
    while (at_ < text_.size() && continues_name(text_[at_])) ++at_;
    const std::string name = text_.substr(begin, at_ - begin);
    skip();
    const auto v = std::find(variables_.begin(), variables_.end(), name);
    if (v != variables_.end()) return add({Op::variable, int(v - variables_.begin())});
    if (name == "pi") return add({Op::number, -1, -1, M_PI});
    if (const auto c = constants_.find(name); c != constants_.end()) {
      used_.insert(name);
      return add({Op::number, -1, -1, c->second});
    }
    for (const Function& f : functions)
      if (name == f.name) return call(f, begin);
    const bool is_call = at_ < text_.size() && text_[at_] == '(';
    Names known;
    if (!is_call) {
      known.assign(variables_.begin(), variables_.end());
      for (const auto& [constant, value] : constants_) known.push_back(constant);
      known.push_back("pi");
    }
    for (const Function& f : functions)
      if (is_call) known.push_back(f.name);
    fail(begin, (is_call ? "unknown function '" : "unknown name '") + name + "'",
         ", the nearest known one is '" + std::string(nearest(name, known)) +
             "' (known: " + listed(known, [](auto n) { return n; }) + ")");
  }
  int call(const Function& f, size_t begin) {
    const auto wrong = [&] {
      fail(begin, std::string("there is ") + f.name,
           f.operands == 1 ? ", expected one operand in brackets after it"
                           : ", expected two operands in brackets after it");
    };
    if (!take('(')) wrong();
    Formula::Node n{f.op, sum()};
    if (f.operands == 2) {
      if (!take(',')) wrong();
      n.b = sum();
    }
    if (at_ < text_.size() && text_[at_] == ',') wrong();
    if (!take(')')) unexpected("')'");
    return add(n);
  }

  Formula& formula_;
  std::vector<Formula::Node>& nodes_ = formula_.nodes_;
  const std::string& text_;
  const std::vector<std::string>& variables_;
  const Formula::Constants& constants_;
  std::vector<int> depths_;  ///< of the nodes
  std::set<std::string> used_;
  size_t at_ = 0;
  int within_ = 0;
};

Formula::Formula(const std::string& text, const std::vector<std::string>& variables,
                 const Constants& constants) {
  FormulaParser parser(*this, text, variables, constants);
}

bool Formula::depends_on(int variable) const {
  return std::any_of(nodes_.begin(), nodes_.end(),
                     [&](const Node& n) { return n.op == Op::variable && n.a == variable; });
}

bool Formula::has_kinks() const {
  return std::ranges::any_of(
      nodes_, [](const Node& n) { return n.op == Op::abs || n.op == Op::min || n.op == Op::max; });
}

}  // namespace porthos::phs
