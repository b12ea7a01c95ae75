#pragma once
#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "energy_shaping/loop/closed_loop.h"
#include "phs/functions/law.h"
#include "phs/network/network.h"

/// The laws of this folder as controllers of a network, on the ports of the plant: continuous, or
/// sampled with the energy injected by the hold in the ledger.
namespace porthos::energy_shaping {

/// The law of one port.
struct PortLaw {
  std::string port;         ///< as in the plant's description, "elbow.torque"
  phs::LawPtr law;          ///< as many numbers as the port has
  double limit = HUGE_VAL;  ///< of |u| at a port of one number, which the law keeps
  /// Why the law cannot give what its design asks for at a state, as the end of a sentence; null:
  /// it can. Empty: it always can, but for its limit.
  std::function<const char*(std::span<const double> x)> hindrance = {};
};

/// One law over all inputs of a plant, shared by the controllers of its ports. An evaluator needs
/// memory but a Law has none. So evaluators are stored here and lent for one evaluation; they
/// remember the last one, so several ports at the same state cost one evaluation. Thread-safe; no
/// allocation once there is an evaluator for each thread. Source: Callable with template <class T>
/// auto evaluator() const, giving a movable f(T t, span<const T> x, span<T> u).
template <class Source>
class SharedLaw {
 public:
  /// inputs: of the plant.
  SharedLaw(Source source, size_t inputs) : source_(std::move(source)), inputs_(inputs) {}

  /// Numbers [at, at + u.size()) of the law.
  template <class T>
  void operator()(const T& t, std::span<const T> x, size_t at, std::span<T> u) const {
    auto e = borrow<T>();
    if (!e->remembers(t, x)) {
      e->valid = false;  // if the law throws
      e->f(t, x, std::span<T>(e->u));
      e->t = t;
      e->x.assign(x.begin(), x.end());
      e->valid = true;
    }
    for (size_t k = 0; k < u.size(); ++k) u[k] = e->u[at + k];
    give_back(std::move(e));
  }

 private:
  template <class T>
  struct Evaluator {
    decltype(std::declval<const Source&>().template evaluator<T>()) f;
    std::vector<T> x, u;
    T t{};
    bool valid = false;
    bool remembers(const T& at, std::span<const T> y) const {
      static_assert(std::is_trivially_copyable_v<T>);
      return valid && x.size() == y.size() && std::memcmp(&t, &at, sizeof t) == 0 &&
             std::memcmp(x.data(), y.data(), y.size_bytes()) == 0;
    }
  };
  template <class T>
  using Pool = std::vector<std::unique_ptr<Evaluator<T>>>;

  template <class T>
  std::unique_ptr<Evaluator<T>> borrow() const {
    {
      const std::lock_guard lock(mutex_);
      auto& pool = std::get<Pool<T>>(pools_);
      if (!pool.empty()) {
        auto e = std::move(pool.back());
        pool.pop_back();
        return e;
      }
    }
    return std::unique_ptr<Evaluator<T>>(
        new Evaluator<T>{source_.template evaluator<T>(), {}, std::vector<T>(inputs_)});
  }
  template <class T>
  void give_back(std::unique_ptr<Evaluator<T>> e) const {
    const std::lock_guard lock(mutex_);
    std::get<Pool<T>>(pools_).push_back(std::move(e));
  }

  Source source_;
  size_t inputs_;
  mutable std::mutex mutex_;
  mutable std::tuple<Pool<double>, Pool<long double>, Pool<phs::Quad>, Pool<phs::Dual>,
                     Pool<phs::Pack4>, Pool<phs::Pack8>>
      pools_;
};

/// The laws of the ports that hold the inputs `actuated` (offsets in the plant's u), in the order
/// of the ports. hindrance: as phs::Law's.
template <class Source>
std::vector<PortLaw> port_laws(
    Source source, const phs::Description& plant, const std::vector<int>& actuated,
    const std::function<std::string(std::span<const double>)>& hindrance = phs::no_hindrance) {
  const auto shared =
      std::make_shared<const SharedLaw<Source>>(std::move(source), size_t(plant.nu));
  std::vector<PortLaw> laws;
  for (const auto& port : plant.ports)
    if (std::any_of(actuated.begin(), actuated.end(),
                    [&](int a) { return a >= port.at && a < port.at + port.size; }))
      laws.push_back(
          {port.name, phs::law([shared, at = size_t(port.at)](auto t, auto x, auto,
                                                              auto u) { (*shared)(t, x, at, u); },
                               hindrance)});
  return laws;
}

/// The law of the port of one number that holds an input, an offset in the plant's u; null: none.
PortLaw* law_of(std::vector<PortLaw>& laws, const phs::Description& plant, int input);

/// The laws of a closed loop, which they keep alive. limits: largest |u| of each actuated input, in
/// the order of loop->actuated(); empty: none.
/// @throws InvalidArgument for limits of the wrong number or sign
std::vector<PortLaw> port_laws(std::shared_ptr<const ClosedLoop> loop,
                               std::vector<double> limits = {});

/// Puts laws on the ports of a member of a network. Rows in the ledger: `name`, and `name`.hold of
/// a sampled one; with several ports `name`.<port> and `name`.<port>.hold. The network knows the
/// limits (NetworkModel::limited).
/// @throws InvalidArgument as Network::control does; an encoder, as it belongs to one port
phs::Network& control(phs::Network& network, const std::string& name, const std::string& member,
                      const std::vector<PortLaw>& laws, const phs::Network::Control& how = {});

}  // namespace porthos::energy_shaping
