#include "integrators/derivatives/gauss_pieces.h"

#include <algorithm>

#include "integrators/methods/composition.h"

namespace porthos::integrators {
namespace {

constexpr const char* gauss = "Gauss collocation";

[[noreturn]] void refuse(const std::string& method, const char* and_for = "") {
  throw InvalidArgument(
      std::string("derivatives of a run are there for Gauss collocation (gauss2 to gauss16, "
                  "midpoint)") +
      and_for + ", not for '" + method + "'");
}
constexpr const char* compositions_too = " and its compositions (yoshida4, kahan_li8 ...)";

}  // namespace

GaussPieces::GaussPieces(const std::string& method, const phs::Model& model, double h)
    : n_(size_t(model.description().nx)) {
  const Declaration& d = declaration_of(method);
  if (d.family != gauss && d.family != compositions) refuse(method, compositions_too);
  method_ = make_integrator(method, model, h, {.port_work = false});
  auto* composed = dynamic_cast<ComposedSteps<double>*>(method_.get());
  const Declaration& of_piece = composed ? composed->base().declaration() : d;
  if (of_piece.family != gauss) refuse(method, compositions_too);
  table_ = gauss_table<double>(of_piece.order / 2);
  if (composed) {
    count_ = composed->count();
    composed->watch([this, &base = composed->base()](size_t i, double t, double taken,
                                                     const phs::State& after) {
      keep(i, t, taken, base, after);
    });
  }
  size_ = 2 + size_t(table_.s) * n_;
  numbers_.resize(count_ * size_);
  for (const auto& b : model.description().blocks)
    if (b.kind == phs::BlockKind::angle) angles_.push_back(size_t(b.at));
}

Outcome GaussPieces::step(phs::State& state, double h) {
  const double t = method_->time(state);
  turns_.assign(state.turns.begin(), state.turns.end());
  const Outcome o = h == 0 ? method_->step(state) : method_->step_by(state, h);
  if (o != Outcome::ok) return o;
  if (count_ == 1)
    keep(0, t, h == 0 ? method_->step_size() : h, *method_, state);
  else if (turns_ != state.turns)
    turn_stages(state.turns);
  return o;
}

/// The stages are the values at the nodes of a Gauss step's polynomial.
void GaussPieces::keep(size_t i, double t, double h, const Integrator& by,
                       const phs::State& after) {
  const std::span<double> to = std::span(numbers_).subspan(i * size_, size_);
  to[0] = t;
  to[1] = h;
  for (size_t j = 0; j < size_t(table_.s); ++j)
    (void)by.interpolate(after, table_.c[j], to.subspan(2 + j * n_, n_));
}

/// From the turns of the state before the step to those after it.
void GaussPieces::turn_stages(const std::vector<std::int64_t>& turns) {
  for (size_t a = 0; a < angles_.size(); ++a) {
    const double by = double(turns[a] - turns_[a]) * phs::two_pi_hi;
    if (by == 0) continue;
    for (size_t i = 0; i < count_; ++i)
      for (size_t j = 0; j < size_t(table_.s); ++j)
        numbers_[i * size_ + 2 + j * n_ + angles_[a]] -= by;
  }
}

int gauss_stages(const std::string& method) {
  const Declaration& d = declaration_of(method);
  if (d.family != gauss) refuse(method);
  return d.order / 2;
}

}  // namespace porthos::integrators
