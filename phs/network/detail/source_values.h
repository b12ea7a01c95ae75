#pragma once
#include <array>
#include <span>
#include <type_traits>
#include <vector>

#include "phs/network/detail/network_plan.h"

/// The values of a network's sources, which depend on time alone.
namespace porthos::phs {

/// Keeps the values of the last few times: an implicit step asks for those of its stages at every
/// sweep, and a sine takes as long as a joint.
template <class T>
class SourceValues {
 public:
  explicit SourceValues(const std::vector<Network::Plan::Source>& sources) : sources_(sources) {
    for (Kept& k : kept_) k.values.resize(sources.size());
  }

  /// Adds the sources to their rows of v.
  void add(const T& t, std::vector<T>& v) {
    const auto& values = at(t);
    for (size_t i = 0; i < values.size(); ++i) {
      T& to = v[size_t(sources_[i].row)];
      to = to + values[i];
    }
  }
  /// Writes their powers from powers[k] on. @return the index after the last
  size_t powers(const T& t, const std::vector<T>& y, std::span<T> powers, size_t k) {
    const auto& values = at(t);
    for (size_t i = 0; i < values.size(); ++i) powers[k++] = values[i] * y[size_t(sources_[i].row)];
    return k;
  }

 private:
  const std::vector<T>& at(const T& t) {
    for (const Kept& k : kept_)
      if (k.known && is_same(k.t, t)) return k.values;
    Kept& k = kept_[next_];
    next_ = (next_ + 1) % kept_.size();
    for (size_t i = 0; i < sources_.size(); ++i) k.values[i] = (*sources_[i].v)(t);
    k.t = t;
    k.known = true;
    return k.values;
  }

  struct Kept {
    T t{0.0};
    std::vector<T> values;
    bool known = false;
  };
  /// Whether two times have the same bits; of scalars with more than a value (duals) never.
  static bool is_same(const T& a, const T& b) {
    if constexpr (is_pack<T> || std::is_same_v<T, double>) {
      if (!any(a == b)) return false;
      for (int i = 0; i < lanes<T>; ++i)
        if (!(lane_of(a, i) == lane_of(b, i))) return false;
      return true;
    } else {
      return false;
    }
  }

  const std::vector<Network::Plan::Source>& sources_;
  std::array<Kept, 8> kept_;  ///< stages of a method
  size_t next_ = 0;
};

}  // namespace porthos::phs
